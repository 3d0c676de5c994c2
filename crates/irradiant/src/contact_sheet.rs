//! All layers of a picture on one sheet, for the eye: small, labelled, under one exposure.

use crate::error::Error;
use crate::render::Rendering;
use irradiant_core::film::DevelopOptions;
use irradiant_image::lettering::{LETTER, text_width, write_text};
use irradiant_image::{Encoding, FileFormat, Image, ImageError, ResizeFilter, ToneOptions, atomic_write, to_srgb8};
use std::path::Path;

/// Width of a tile at most, pixels.
const TILE: usize = 320;
/// Width of the sheet at most; only a single tile may be wider.
const SHEET: usize = 1600;
/// Between tiles.
const GUTTER: usize = 6;
const BACKGROUND: u8 = 24;
const INK: [u8; 3] = [224; 3];

/// Where the tiles of a sheet stand.
struct Grid {
    tile: [usize; 2],
    /// Of a tile with its label.
    column: usize,
    columns: usize,
    rows: usize,
    /// Size of a letter's dot.
    dot: usize,
}

impl Grid {
    /// For `n` pictures of this size, with labels that are at most so wide in the smallest letters.
    fn new(picture: [usize; 2], n: usize, label: usize) -> Self {
        let width = picture[0].clamp(1, TILE);
        let height = (picture[1] * width).div_ceil(picture[0].max(1)).max(1);
        // Small pictures stand further apart, so that one can read what they are.
        let column = width.max(label.min(TILE));
        let most = ((SHEET - GUTTER) / (column + GUTTER)).max(1);
        // About as wide as high, in whole rows where that is easy.
        let square = (1..).find(|c| c * c * column >= n * height).unwrap_or(1);
        let columns = square.min(most).min(n).max(1);
        let dot = if width >= 200 { 2 } else { 1 };
        Self { tile: [width, height], column, columns, rows: n.div_ceil(columns), dot }
    }

    fn label_height(&self) -> usize {
        LETTER[1] * self.dot + 2 * GUTTER
    }

    fn size(&self) -> [usize; 2] {
        let [_, height] = self.tile;
        [GUTTER + self.columns * (self.column + GUTTER), GUTTER + self.rows * (height + self.label_height())]
    }

    /// Upper left corner of a tile.
    fn at(&self, i: usize) -> [usize; 2] {
        let [_, height] = self.tile;
        let (column, row) = (i % self.columns, i / self.columns);
        [GUTTER + column * (self.column + GUTTER), GUTTER + row * (height + self.label_height())]
    }
}

impl Rendering {
    /// The picture and its layers as tiles of one 8-bit sRGB picture, all brightened by `exposure` stops; below each its name
    /// and its share of the picture's luminance.
    pub fn contact_sheet(&self, exposure: f32) -> Result<Image, ImageError> {
        let image = self.film.develop(DevelopOptions::default());
        let mut labels = vec![("picture".to_string(), ["R", "G", "B"].map(String::from))];
        labels.extend(self.layer_light().into_iter().map(|l| {
            let channels = ["R", "G", "B"].map(|c| format!("{}.{c}", l.name));
            (format!("{} {:.2} %", l.name, 100.0 * l.share), channels)
        }));
        let widest = labels.iter().map(|(label, _)| text_width(label, 1)).max().unwrap_or(0);
        let grid = Grid::new([image.width(), image.height()], labels.len(), widest);
        let [width, height] = grid.size();
        let mut codes = vec![BACKGROUND; width * height * 3];
        for (i, (_, channels)) in labels.iter().enumerate() {
            let channels = [0, 1, 2].map(|c| image.channel_index(&channels[c]).unwrap_or(c));
            let picked = Image::from_fn(image.width(), image.height(), ["R", "G", "B"], |x, y| {
                channels.map(|c| image.get(x, y, c))
            });
            let [tile_width, tile_height] = grid.tile;
            let small = picked.resize(tile_width, tile_height, ResizeFilter::Box).unwrap_or(picked);
            let shown = to_srgb8(&small, &ToneOptions { exposure, ..ToneOptions::default() })?;
            let [left, top] = grid.at(i);
            for y in 0..tile_height {
                for x in 0..tile_width {
                    let first = ((top + y) * width + left + x) * 3;
                    for c in 0..3 {
                        codes[first + c] = code(&shown, (y * tile_width + x) * 3 + c);
                    }
                }
            }
        }
        let mut sheet = Image::from_u8(width, height, &["R", "G", "B"], codes, Encoding::Srgb)?;
        for (i, (label, _)) in labels.iter().enumerate() {
            let [left, top] = grid.at(i);
            let mut label = label.clone();
            let dot = if text_width(&label, grid.dot) > grid.column { 1 } else { grid.dot };
            // Only names of more than fifty letters are too long even so.
            while text_width(&label, dot) > grid.column {
                label.pop();
            }
            write_text(&mut sheet, [left, top + grid.tile[1] + GUTTER], dot, &label, INK);
        }
        Ok(sheet)
    }

    /// Writes [`Rendering::contact_sheet`] as a PNG file, all of it or none.
    pub fn save_contact_sheet(&self, path: impl AsRef<Path>, exposure: f32) -> Result<(), Error> {
        let path = path.as_ref();
        let output = |why| Error::Output { path: path.to_owned(), why };
        let sheet = self.contact_sheet(exposure).map_err(output)?;
        let bytes = irradiant_image::write(&sheet, FileFormat::Png).map_err(output)?;
        atomic_write(path, &bytes).map_err(output)
    }
}

/// The code of an 8-bit picture's sample.
fn code(image: &Image, index: usize) -> u8 {
    match image.pixels() {
        irradiant_image::Pixels::U8(codes) => codes[index],
        irradiant_image::Pixels::F16(_) | irradiant_image::Pixels::F32(_) => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sheets_are_of_a_size_to_look_at_and_tiles_do_not_overlap() {
        for picture in [[1, 1], [16, 12], [512, 512], [4000, 100], [100, 4000]] {
            for (n, label) in [(1, 0), (2, 70), (4, 150), (9, 100), (18, 90), (65, 500)] {
                let grid = Grid::new(picture, n, label);
                let [width, height] = grid.size();
                assert!(width <= SHEET.max(TILE + 2 * GUTTER), "{picture:?} {n}");
                assert!(grid.columns * grid.rows >= n && (grid.rows - 1) * grid.columns < n);
                assert!(grid.column >= label.min(TILE), "{picture:?} {n}: labels are cut");
                for i in 0..n {
                    let [x, y] = grid.at(i);
                    assert!(x + grid.column + GUTTER <= width && y + grid.tile[1] + grid.label_height() <= height);
                    if i > 0 {
                        let [px, py] = grid.at(i - 1);
                        assert!(x >= px + grid.column + GUTTER || y >= py + grid.tile[1] + grid.label_height());
                    }
                }
            }
        }
    }
}
