//! Portable float maps: "PF" (RGB) and "Pf" (grey), both byte orders, rows from the bottom.
//!
//! Source: Debevec's definition as kept by Netpbm. The scale's sign is the byte order and its magnitude
//! a factor on the samples, as in pbrt-v4.

use crate::encoding::Encoding;
use crate::error::ImageError;
use crate::format::{Bytes, ReadOptions};
use crate::image::{Image, Pixels, owned};

/// Reads a PFM file: channels R, G, B or Y, as floats.
pub fn read_pfm(bytes: &[u8], options: &ReadOptions) -> Result<Image, ImageError> {
    let mut input = Bytes::new(bytes);
    let channels: &[&str] = match input.word()? {
        "PF" => &["R", "G", "B"],
        "Pf" => &["Y"],
        other => return Err(ImageError::invalid_at(0, format!("{other:?} is neither PF nor Pf"))),
    };
    let width: u32 = number(&mut input, "width")?;
    let height: u32 = number(&mut input, "height")?;
    let scale: f32 = number(&mut input, "scale")?;
    if !scale.is_finite() || scale == 0.0 {
        return Err(ImageError::invalid_at(input.at(), "the scale is not a finite number other than 0"));
    }
    let size = [width.into(), height.into(), channels.len() as u64];
    let count = options.budget(size, 4, bytes.len(), 1)?;
    let data = input.take(count * 4)?;
    let factor = scale.abs();
    let decode = |four: &[u8]| {
        let four = [four[0], four[1], four[2], four[3]];
        let value = if scale < 0.0 { f32::from_le_bytes(four) } else { f32::from_be_bytes(four) };
        if factor == 1.0 { value } else { value * factor }
    };
    let row = width as usize * channels.len() * 4;
    let samples = data.chunks_exact(row).rev().flat_map(|row| row.chunks_exact(4)).map(decode).collect();
    Image::from_pixels(width as usize, height as usize, owned(channels), Pixels::F32(samples), Encoding::Linear)
}

fn number<T: std::str::FromStr>(input: &mut Bytes<'_>, what: &str) -> Result<T, ImageError> {
    let at = input.at();
    let word = input.word()?;
    word.parse().map_err(|_| ImageError::invalid_at(at, format!("{word:?} is not a {what}")))
}

/// The bytes of a little-endian PFM file of the channels R, G, B, or of a lone channel.
pub fn write_pfm(image: &Image) -> Result<Vec<u8>, ImageError> {
    let picture = super::displayable(image, 3)?;
    let kind = if picture.channel_count() == 3 { "PF" } else { "Pf" };
    let mut file = format!("{kind}\n{} {}\n-1.0\n", picture.width(), picture.height()).into_bytes();
    let samples = picture.to_f32();
    let row = picture.width() * picture.channel_count();
    if row > 0 {
        for row in samples.chunks_exact(row).rev() {
            file.extend(row.iter().flat_map(|value| value.to_le_bytes()));
        }
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_survive_bit_for_bit() {
        let image = Image::from_fn(7, 5, ["R", "G", "B"], |x, y| [x as f32 * 1e-30, y as f32 - 2.5, f32::INFINITY]);
        assert_eq!(read_pfm(&write_pfm(&image).unwrap(), &ReadOptions::default()).unwrap(), image);
        let grey = Image::from_fn(3, 2, ["Y"], |x, y| [(x + 10 * y) as f32]);
        assert_eq!(read_pfm(&write_pfm(&grey).unwrap(), &ReadOptions::default()).unwrap(), grey);
    }

    #[test]
    fn big_endian_and_scaled() {
        let mut file = b"Pf\n1 2\n2.0\n".to_vec();
        file.extend(3.0f32.to_be_bytes());
        file.extend(5.0f32.to_be_bytes());
        let image = read_pfm(&file, &ReadOptions::default()).unwrap();
        assert_eq!((image.get(0, 0, 0), image.get(0, 1, 0)), (10.0, 6.0), "the first row is the lowest");
    }

    #[test]
    fn lies_about_the_size_are_found() {
        for header in ["PF\n4294967295 4294967295\n-1\n", "PF\n100000 100000\n-1\n", "PF\n0 1\n-1\n", "PF\n1 1\nnan\n"]
        {
            assert!(read_pfm(header.as_bytes(), &ReadOptions::default()).is_err(), "{header:?}");
        }
    }
}
