//! How far a picture is from a reference: sums in f64 over all pixels and channels.
//!
//! Samples that are not finite in either picture are counted and left out, so one NaN neither hides
//! nor is hidden.

use std::fmt;

use crate::image::Image;

/// Side of the tiles of [`Comparison::worst_tile`], in pixels.
pub const TILE: usize = 16;

/// Why two pictures cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CompareError {
    /// The sizes differ (width, height of the picture, then of the reference).
    Size([usize; 2], [usize; 2]),
    /// A picture has no channels that both could be read by: R, G, B, or one alone, or the same names.
    Channels(Vec<String>, Vec<String>),
}

impl fmt::Display for CompareError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size([w, h], [rw, rh]) => write!(f, "the pictures differ in size: {w} x {h} and {rw} x {rh}"),
            Self::Channels(found, reference) => {
                write!(f, "the pictures have no channels in common: {found:?} and {reference:?}")
            }
        }
    }
}

impl std::error::Error for CompareError {}

/// The tile whose mean deviates most from the reference's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorstTile {
    /// Left column of the tile.
    pub x: usize,
    /// Upper row of the tile.
    pub y: usize,
    /// Mean of the picture over the mean of the reference in the tile; infinite if the latter is 0.
    pub ratio: f64,
    /// |difference of the means| / (reference's mean there + 1 % of its mean everywhere).
    pub deviation: f64,
}

/// The differences between a picture x and its reference r, in linear light.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Mean of (x - r)^2.
    pub mse: f64,
    /// Mean of |x - r|.
    pub mae: f64,
    /// Mean of |x - r| / (|r| + 0.01 mean |r|): a fraction, not percent.
    pub mape: f64,
    /// Mean of (x - r)^2 / (r^2 + 0.01 mean(r)^2), after Rousselle et al. 2011 with an offset that scales with the picture.
    pub rel_mse: f64,
    /// 10 log10(peak^2 / MSE) in decibels, the peak being the largest reference value; infinite for equal pictures.
    pub psnr: f64,
    /// Mean of x over mean of r.
    pub mean_ratio: f64,
    /// The same for each channel.
    pub channel_ratios: Vec<f64>,
    /// The tile of 16 x 16 pixels that deviates most, of those that are not black in both; `None` if all are.
    pub worst_tile: Option<WorstTile>,
    /// Names of the channels that were compared.
    pub channels: Vec<String>,
    /// Samples left out because one of the two values is not finite.
    pub not_finite: u64,
}

/// The differences between a picture and its reference.
///
/// Compares R, G, B where both have them (grey counts as all three), else the channels of the same names.
pub fn compare(image: &Image, reference: &Image) -> Result<Comparison, CompareError> {
    let (found, expected) = comparable(image, reference)?;
    let (width, height, count) = (found.width(), found.height(), found.channel_count());
    let (x, r) = (found.to_f32(), expected.to_f32());
    let finite = |i: usize| x[i].is_finite() && r[i].is_finite();

    let mut sums = vec![[0.0f64; 2]; count];
    let (mut magnitude, mut peak, mut used) = (0.0f64, 0.0f64, 0u64);
    for i in (0..x.len()).filter(|&i| finite(i)) {
        let (x, r) = (f64::from(x[i]), f64::from(r[i]));
        sums[i % count][0] += x;
        sums[i % count][1] += r;
        magnitude += r.abs();
        peak = peak.max(r);
        used += 1;
    }
    let total = used as f64;
    let sum = |which: usize| sums.iter().map(|pair| pair[which]).sum::<f64>();
    let mean = sum(1) / total;

    let (mut mse, mut mae, mut mape, mut rel_mse) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
    let ratio_or_zero = |error: f64, scale: f64| if error == 0.0 { 0.0 } else { error / scale };
    for i in (0..x.len()).filter(|&i| finite(i)) {
        let (x, r) = (f64::from(x[i]), f64::from(r[i]));
        let error = (x - r).abs();
        mse += error * error;
        mae += error;
        mape += ratio_or_zero(error, r.abs() + 0.01 * magnitude / total);
        rel_mse += ratio_or_zero(error * error, r * r + 0.01 * mean * mean);
    }

    let mut worst: Option<WorstTile> = None;
    for top in (0..height).step_by(TILE) {
        for left in (0..width).step_by(TILE) {
            let (mut a, mut b, mut samples) = (0.0f64, 0.0f64, 0u64);
            for row in top..(top + TILE).min(height) {
                for i in (row * width + left) * count..(row * width + (left + TILE).min(width)) * count {
                    if finite(i) {
                        a += f64::from(x[i]);
                        b += f64::from(r[i]);
                        samples += 1;
                    }
                }
            }
            let n = samples as f64;
            let deviation = ratio_or_zero((a - b).abs() / n, b.abs() / n + 0.01 * mean.abs());
            // Tiles without samples, or without light in both pictures, have no ratio.
            if (a, b) != (0.0, 0.0) && deviation >= 0.0 && worst.is_none_or(|worst| deviation > worst.deviation) {
                worst = Some(WorstTile { x: left, y: top, ratio: a / b, deviation });
            }
        }
    }
    Ok(Comparison {
        mse: mse / total,
        mae: mae / total,
        mape: mape / total,
        rel_mse: rel_mse / total,
        psnr: 10.0 * libm::log10(peak * peak / (mse / total)),
        mean_ratio: sum(0) / sum(1),
        channel_ratios: sums.iter().map(|[a, b]| a / b).collect(),
        worst_tile: worst,
        channels: found.channels().to_vec(),
        not_finite: x.len() as u64 - used,
    })
}

/// Both pictures with the channels that they share, in the same order.
pub(crate) fn comparable(image: &Image, reference: &Image) -> Result<(Image, Image), CompareError> {
    let size = |image: &Image| [image.width(), image.height()];
    if size(image) != size(reference) {
        return Err(CompareError::Size(size(image), size(reference)));
    }
    if let (Some(image), Some(reference)) = (image.to_rgb(), reference.to_rgb()) {
        return Ok((image, reference));
    }
    let shared: Vec<&str> = image.channels().iter().map(String::as_str).collect();
    let shared: Vec<&str> = shared.into_iter().filter(|name| reference.channel_index(name).is_some()).collect();
    match (image.select(&shared), reference.select(&shared)) {
        (Some(image), Some(reference)) => Ok((image, reference)),
        _ => Err(CompareError::Channels(image.channels().to_vec(), reference.channels().to_vec())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reference() -> Image {
        Image::from_fn(40, 20, ["R", "G", "B"], |x, y| [1.0 + x as f32, 2.0, 3.0 + y as f32 * 0.5])
    }

    fn close(found: f64, expected: f64) {
        assert!((found - expected).abs() <= 1e-6 * expected.abs().max(1e-12), "{found}, {expected} expected");
    }

    #[test]
    fn equal_pictures_do_not_differ() {
        let same = compare(&reference(), &reference()).unwrap();
        assert_eq!((same.mse, same.mae, same.mape, same.rel_mse, same.mean_ratio), (0.0, 0.0, 0.0, 0.0, 1.0));
        assert_eq!((same.psnr, same.not_finite), (f64::INFINITY, 0));
        let black = Image::new(3, 3, &["Y"]);
        let of_black = compare(&black, &black).unwrap();
        assert_eq!((of_black.rel_mse, of_black.worst_tile), (0.0, None));
        // A black corner has no ratio of means, and does not hide that of the others.
        let corner = Image::from_fn(40, 20, ["Y"], |x, _| [if x < 16 { 0.0 } else { 1.0 }]);
        assert_eq!(compare(&corner, &corner).unwrap().worst_tile.map(|t| (t.x, t.ratio)), Some((16, 1.0)));
    }

    #[test]
    fn a_constant_offset_and_a_factor_in_closed_form() {
        let flat = |value: f32| Image::from_fn(20, 30, ["R", "G", "B"], |_, _| [value; 3]);
        let off = compare(&flat(2.5), &flat(2.0)).unwrap();
        close(off.mse, 0.25);
        close(off.mae, 0.5);
        close(off.mape, 0.5 / 2.02);
        close(off.rel_mse, 0.25 / 4.04);
        close(off.psnr, 10.0 * 16f64.log10());
        close(off.mean_ratio, 1.25);
        close(off.worst_tile.unwrap().deviation, 0.5 / 2.02);

        let mut scaled = reference();
        for value in scaled.as_f32_mut().unwrap() {
            *value *= 1.03125;
        }
        let scaled = compare(&scaled, &reference()).unwrap();
        close(scaled.mean_ratio, 1.03125);
        scaled.channel_ratios.iter().for_each(|&ratio| close(ratio, 1.03125));
    }

    #[test]
    fn the_worst_tile_is_found() {
        let mut image = reference();
        for (x, y) in [(33, 17), (34, 18)] {
            image.set(x, y, 1, 90.0);
        }
        image.set(0, 0, 0, 2.0);
        let worst = compare(&image, &reference()).unwrap().worst_tile.unwrap();
        assert_eq!((worst.x, worst.y), (32, 16));
        assert!(worst.ratio > 1.0);
    }

    #[test]
    fn undefined_samples_are_counted_and_left_out() {
        let mut image = reference();
        image.set(3, 3, 0, f32::NAN);
        image.set(4, 3, 2, f32::INFINITY);
        let found = compare(&image, &reference()).unwrap();
        assert_eq!((found.not_finite, found.mse, found.mean_ratio), (2, 0.0, 1.0));
    }

    #[test]
    fn channels_are_matched_by_name() {
        let swapped = reference().select(&["B", "G", "R"]).unwrap();
        assert_eq!(compare(&swapped, &reference()).unwrap().mse, 0.0);
        let depth = Image::from_fn(40, 20, ["Z", "N.X"], |x, _| [x as f32, 0.0]);
        let other = Image::from_fn(40, 20, ["A", "Z"], |x, _| [0.0, x as f32]);
        assert_eq!(compare(&depth, &other).unwrap().channels, ["Z"]);
        assert!(matches!(compare(&depth, &reference()), Err(CompareError::Channels(..))));
        let small = Image::new(4, 4, &["R", "G", "B"]);
        assert!(matches!(compare(&small, &reference()), Err(CompareError::Size(..))));
    }
}
