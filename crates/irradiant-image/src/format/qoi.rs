//! The "quite OK" image format.
//!
//! Source: Szablewski, "The Quite OK Image Format", specification version 1.0 (2022).

use crate::encoding::Encoding;
use crate::error::ImageError;
use crate::format::{Bytes, RUN_RATIO, ReadOptions, codes_for_display};
use crate::image::{Image, Pixels, owned};

const INDEX: u8 = 0x00;
const DIFF: u8 = 0x40;
const LUMA: u8 = 0x80;
const RUN: u8 = 0xc0;
const RGB: u8 = 0xfe;
const RGBA: u8 = 0xff;

fn slot([red, green, blue, alpha]: [u8; 4]) -> usize {
    let sum = usize::from(red) * 3 + usize::from(green) * 5 + usize::from(blue) * 7 + usize::from(alpha) * 11;
    sum % 64
}

/// Reads a QOI file: R, G, B or R, G, B, A in 8 bits; sRGB or linear as the file says.
pub fn read_qoi(bytes: &[u8], options: &ReadOptions) -> Result<Image, ImageError> {
    let mut input = Bytes::new(bytes);
    if input.take(4)? != b"qoif" {
        return Err(ImageError::invalid_at(0, "a QOI file begins with qoif"));
    }
    let (width, height) = (input.u32_be()?, input.u32_be()?);
    let names: &[&str] = match input.u8()? {
        3 => &["R", "G", "B"],
        4 => &["R", "G", "B", "A"],
        other => return Err(ImageError::invalid_at(12, format!("{other} channels, 3 or 4 expected"))),
    };
    let implied = match input.u8()? {
        0 => Encoding::Srgb,
        1 => Encoding::Linear,
        other => return Err(ImageError::invalid_at(13, format!("colour space {other}, 0 or 1 expected"))),
    };
    let count = options.budget([width.into(), height.into(), names.len() as u64], 1, bytes.len(), RUN_RATIO)?;

    let mut codes = Vec::with_capacity(count);
    let mut seen = [[0u8; 4]; 64];
    let mut pixel = [0, 0, 0, 255];
    while codes.len() < count {
        let byte = input.u8()?;
        let mut repeat = 1;
        match byte {
            RGB => pixel[..3].copy_from_slice(input.take(3)?),
            RGBA => pixel.copy_from_slice(input.take(4)?),
            _ => match byte & 0xc0 {
                INDEX => pixel = seen[usize::from(byte)],
                DIFF => {
                    pixel[0] = pixel[0].wrapping_add(byte >> 4 & 3).wrapping_sub(2);
                    pixel[1] = pixel[1].wrapping_add(byte >> 2 & 3).wrapping_sub(2);
                    pixel[2] = pixel[2].wrapping_add(byte & 3).wrapping_sub(2);
                }
                LUMA => {
                    let second = input.u8()?;
                    let green = (byte & 63).wrapping_sub(32);
                    pixel[0] = pixel[0].wrapping_add(green).wrapping_add(second >> 4).wrapping_sub(8);
                    pixel[1] = pixel[1].wrapping_add(green);
                    pixel[2] = pixel[2].wrapping_add(green).wrapping_add(second & 15).wrapping_sub(8);
                }
                _ => repeat = usize::from(byte & 63) + 1,
            },
        }
        seen[slot(pixel)] = pixel;
        for _ in 0..repeat.min((count - codes.len()) / names.len()) {
            codes.extend_from_slice(&pixel[..names.len()]);
        }
    }
    let encoding = options.encoding.unwrap_or(implied);
    Image::from_pixels(width as usize, height as usize, owned(names), Pixels::U8(codes), encoding)
}

/// The bytes of a QOI file; floats are clamped and sRGB-encoded, grey is tripled, 8-bit images keep their codes.
pub fn write_qoi(image: &Image) -> Result<Vec<u8>, ImageError> {
    let coloured;
    let source = if image.channel_index("R").is_some() {
        image
    } else {
        coloured = image.to_rgb().ok_or_else(|| ImageError::unsupported("QOI holds R, G, B and A"))?;
        &coloured
    };
    let (codes, channels) = codes_for_display(source, 4)?;
    let too_wide = |_| ImageError::unsupported("QOI holds at most 2^32 - 1 pixels a side");
    let mut file = b"qoif".to_vec();
    file.extend(u32::try_from(image.width()).map_err(too_wide)?.to_be_bytes());
    file.extend(u32::try_from(image.height()).map_err(too_wide)?.to_be_bytes());
    let linear = image.format() == crate::PixelFormat::U8 && image.encoding() == Encoding::Linear;
    file.extend([channels as u8, u8::from(linear)]);

    let mut seen = [[0u8; 4]; 64];
    let mut previous = [0, 0, 0, 255];
    let mut run = 0u8;
    for stored in codes.chunks_exact(channels) {
        let mut pixel = [0, 0, 0, 255];
        pixel[..channels].copy_from_slice(stored);
        if pixel == previous {
            run += 1;
            if run == 62 {
                file.push(RUN | 61);
                run = 0;
            }
            continue;
        }
        if run > 0 {
            file.push(RUN | (run - 1));
            run = 0;
        }
        let place = slot(pixel);
        if seen[place] == pixel {
            file.push(INDEX | place as u8);
        } else if pixel[3] != previous[3] {
            file.push(RGBA);
            file.extend(pixel);
        } else {
            write_difference(&mut file, pixel, previous);
        }
        seen[place] = pixel;
        previous = pixel;
    }
    if run > 0 {
        file.push(RUN | (run - 1));
    }
    file.extend([0, 0, 0, 0, 0, 0, 0, 1]);
    Ok(file)
}

fn write_difference(file: &mut Vec<u8>, pixel: [u8; 4], previous: [u8; 4]) {
    let red = pixel[0].wrapping_sub(previous[0]);
    let green = pixel[1].wrapping_sub(previous[1]);
    let blue = pixel[2].wrapping_sub(previous[2]);
    let (small, wide) = ([red, green, blue].map(|d| d.wrapping_add(2)), green.wrapping_add(32));
    let around = [red, blue].map(|d| d.wrapping_sub(green).wrapping_add(8));
    if small.iter().all(|&d| d < 4) {
        file.push(DIFF | small[0] << 4 | small[1] << 2 | small[2]);
    } else if wide < 64 && around.iter().all(|&d| d < 16) {
        file.extend([LUMA | wide, around[0] << 4 | around[1]]);
    } else {
        file.push(RGB);
        file.extend(&pixel[..3]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_survive() {
        // Runs, small and large steps, and colours that come back.
        let value = |i: usize| match i / 300 % 4 {
            0 => 77,
            1 => (i / 3 % 256) as u8,
            2 => (i * i % 251) as u8,
            _ => (i % 12 * 20) as u8,
        };
        for (names, encoding) in [(&["R", "G", "B"][..], Encoding::Srgb), (&["R", "G", "B", "A"], Encoding::Linear)] {
            let codes = (0..61 * 59 * names.len()).map(value).collect();
            let image = Image::from_u8(61, 59, names, codes, encoding).unwrap();
            assert_eq!(read_qoi(&write_qoi(&image).unwrap(), &ReadOptions::default()).unwrap(), image);
        }
    }
}
