//! Truevision TGA in: grey, palettes and colour of 8 to 32 bits, plain and run-length coded, all four origins.
//!
//! Source: Truevision TGA File Format Specification, version 2.0 (1991). As in the readers of stb and pbrt-v4,
//! 32-bit pixels have alpha in their last byte and 16-bit ones have none.

use crate::error::ImageError;
use crate::format::{Bytes, RUN_RATIO, ReadOptions};
use crate::image::{Image, Pixels, owned};

/// Reads a TGA file: Y, R G B or R G B A in 8 bits, sRGB unless the options say otherwise.
pub fn read_tga(bytes: &[u8], options: &ReadOptions) -> Result<Image, ImageError> {
    let mut input = Bytes::new(bytes);
    let (id_length, has_map, kind) = (input.u8()?, input.u8()?, input.u8()?);
    let (map_first, map_length, map_bits) = (input.u16_le()?, input.u16_le()?, input.u8()?);
    input.take(4)?;
    let (width, height) = (input.u16_le()?, input.u16_le()?);
    let (bits, descriptor) = (input.u8()?, input.u8()?);
    input.take(id_length.into())?;

    let runs = kind & 8 != 0;
    let layout = match (kind & !8, bits, has_map) {
        (1, 8 | 16, 1) => match map_bits {
            15 | 16 | 24 | 32 => Layout::of_colour(map_bits),
            _ => return Err(ImageError::unsupported(format!("TGA palette of {map_bits} bits"))),
        },
        (2, 15 | 16 | 24 | 32, _) => Layout::of_colour(bits),
        (3, 8, _) => Layout::Grey,
        _ => return Err(ImageError::invalid_at(2, format!("TGA type {kind} of {bits} bits (is this a TGA file?)"))),
    };
    let names: &[&str] = match layout {
        Layout::Grey => &["Y"],
        Layout::Colour15 | Layout::Colour24 => &["R", "G", "B"],
        Layout::Colour32 => &["R", "G", "B", "A"],
    };
    let ratio = if runs { RUN_RATIO } else { 4 };
    let count = options.budget([width.into(), height.into(), names.len() as u64], 1, bytes.len(), ratio)?;

    let palette =
        if has_map == 1 { input.take(usize::from(map_length) * usize::from(map_bits.div_ceil(8)))? } else { &[] };
    let indexed = kind & !8 == 1;
    let pixel_bytes = usize::from(bits.div_ceil(8));
    let mut codes = Vec::with_capacity(count);
    let mut put = |stored: &[u8], at: usize| -> Result<(), ImageError> {
        if !indexed {
            layout.decode(stored, &mut codes);
            return Ok(());
        }
        let index = usize::from(stored[0]) | stored.get(1).map_or(0, |&high| usize::from(high) << 8);
        let entry_bytes = usize::from(map_bits.div_ceil(8));
        let entry = index
            .checked_sub(usize::from(map_first))
            .and_then(|index| palette.get(index * entry_bytes..(index + 1) * entry_bytes));
        layout.decode(entry.ok_or_else(|| ImageError::invalid_at(at, "a pixel is outside its palette"))?, &mut codes);
        Ok(())
    };
    let pixels = usize::from(width) * usize::from(height);
    let mut done = 0;
    while done < pixels {
        let (length, repeated) = if runs {
            let head = input.u8()?;
            (usize::from(head & 127) + 1, head & 128 != 0)
        } else {
            (1, false)
        };
        // Some writers let the last packet reach over the end; what is over is dropped.
        let length = length.min(pixels - done);
        let mut stored = input.take(pixel_bytes)?;
        for index in 0..length {
            if index > 0 && !repeated {
                stored = input.take(pixel_bytes)?;
            }
            put(stored, input.at())?;
        }
        done += length;
    }
    let mut image =
        Image::from_pixels(width.into(), height.into(), owned(names), Pixels::U8(codes), options.encoding())?;
    if descriptor & 0x20 == 0 {
        image.flip_y();
    }
    if descriptor & 0x10 != 0 {
        image.flip_x();
    }
    Ok(image)
}

#[derive(Clone, Copy)]
enum Layout {
    Grey,
    Colour15,
    Colour24,
    Colour32,
}

impl Layout {
    fn of_colour(bits: u8) -> Self {
        match bits {
            32 => Self::Colour32,
            24 => Self::Colour24,
            _ => Self::Colour15,
        }
    }

    fn decode(self, stored: &[u8], codes: &mut Vec<u8>) {
        match self {
            Self::Grey => codes.push(stored[0]),
            Self::Colour15 => {
                let packed = u16::from_le_bytes([stored[0], stored[1]]);
                codes.extend([10, 5, 0].map(|shift| ((packed >> shift & 31) * 255 / 31) as u8));
            }
            Self::Colour24 => codes.extend([stored[2], stored[1], stored[0]]),
            Self::Colour32 => codes.extend([stored[2], stored[1], stored[0], stored[3]]),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    fn header(kind: u8, map: [u8; 5], size: [u16; 2], bits: u8, descriptor: u8) -> Vec<u8> {
        let mut file = vec![0, u8::from(map != [0; 5]), kind];
        file.extend(map);
        file.extend([0; 4]);
        file.extend(size[0].to_le_bytes());
        file.extend(size[1].to_le_bytes());
        file.extend([bits, descriptor]);
        file
    }

    /// A run-length coded picture of 4 x 2 pixels, top row first.
    pub(crate) fn small() -> Vec<u8> {
        let mut file = header(10, [0; 5], [4, 2], 24, 0x20);
        file.extend([0x84, 1, 2, 3, 0x02, 4, 5, 6, 7, 8, 9, 10, 11, 12]);
        file
    }

    fn codes(file: &[u8]) -> Vec<u8> {
        match read_tga(file, &ReadOptions::default()).unwrap().into_pixels() {
            Pixels::U8(codes) => codes,
            _ => panic!("8-bit storage expected"),
        }
    }

    #[test]
    fn runs_and_literals() {
        let codes = codes(&small());
        assert_eq!(codes[..15], [3, 2, 1].repeat(5)[..]);
        assert_eq!(codes[15..], [6, 5, 4, 9, 8, 7, 12, 11, 10]);
    }

    #[test]
    fn origins() {
        let grey = |descriptor| {
            let mut file = header(3, [0; 5], [2, 2], 8, descriptor);
            file.extend([1, 2, 3, 4]);
            codes(&file)
        };
        assert_eq!(grey(0x20), [1, 2, 3, 4]);
        assert_eq!(grey(0x00), [3, 4, 1, 2]);
        assert_eq!(grey(0x30), [2, 1, 4, 3]);
    }

    #[test]
    fn palettes_and_sixteen_bits() {
        let mut file = header(1, [5, 0, 2, 0, 24], [2, 1], 8, 0x20);
        file.extend([1, 2, 3, 4, 5, 6, 6, 5]);
        assert_eq!(codes(&file), [6, 5, 4, 3, 2, 1]);
        *file.last_mut().unwrap() = 9;
        assert!(read_tga(&file, &ReadOptions::default()).is_err(), "index outside the palette");
        let mut file = header(2, [0; 5], [1, 1], 16, 0x20);
        file.extend(0b0_11111_00000_10000u16.to_le_bytes());
        assert_eq!(codes(&file), [255, 0, 131]);
    }
}
