//! PNG of 8 and 16 bits.
//!
//! Palettes and low bit depths are widened to 8 bits. Like pbrt-v4, samples are taken as sRGB whatever
//! gamma or profile chunks say, unless the caller names an encoding.

use std::io::Cursor;

use half::f16;
use png::{BitDepth, ColorType, Decoder, Encoder, Limits, Transformations};

use crate::encoding::{Encoding, srgb_from_linear};
use crate::error::ImageError;
use crate::format::{RUN_RATIO, ReadOptions, codes_for_display, displayable, guarded};
use crate::image::{Image, Pixels, owned};

/// Bits of a sample in a PNG file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PngDepth {
    /// 8 bits.
    Eight,
    /// 16 bits.
    Sixteen,
}

/// Reads a PNG file: Y, Y A, R G B or R G B A.
///
/// 8 bits stay 8 bits; 16 bits become linear halves, or floats with [`ReadOptions::widen_16_bit`].
pub fn read_png(bytes: &[u8], options: &ReadOptions) -> Result<Image, ImageError> {
    guarded("PNG", || decode(bytes, options))
}

fn decode(bytes: &[u8], options: &ReadOptions) -> Result<Image, ImageError> {
    let invalid = |error: png::DecodingError| match error {
        png::DecodingError::LimitsExceeded => {
            ImageError::TooLarge { needed: options.max_bytes.saturating_add(1), allowed: options.max_bytes }
        }
        other => ImageError::invalid(format!("PNG: {other}")),
    };
    let limit = usize::try_from(options.max_bytes).unwrap_or(usize::MAX);
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: limit });
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(invalid)?;

    // The stored rows must be there in the deflated data; the widened ones must fit the cap.
    let info = reader.info();
    let (width, height) = (info.width, info.height);
    let (color, depth) = reader.output_color_type();
    options.budget([info.raw_row_length() as u64, height.into(), 1], 1, bytes.len(), RUN_RATIO)?;
    let names: &[&str] = match color {
        ColorType::Grayscale => &["Y"],
        ColorType::GrayscaleAlpha => &["Y", "A"],
        ColorType::Rgb => &["R", "G", "B"],
        ColorType::Rgba => &["R", "G", "B", "A"],
        ColorType::Indexed => return Err(ImageError::invalid("PNG: a palette is missing")),
    };
    let wide = if options.widen_16_bit { 4 } else { 2 };
    let bytes_per_sample = if depth == BitDepth::Sixteen { wide } else { 1 };
    let size = [width.into(), height.into(), names.len() as u64];
    let count = options.budget(size, bytes_per_sample, bytes.len(), RUN_RATIO * 32)?;

    let stored = count * if depth == BitDepth::Sixteen { 2 } else { 1 };
    if reader.output_buffer_size() != Some(stored) {
        return Err(ImageError::invalid("PNG: the rows do not fill the picture"));
    }
    let mut data = vec![0; stored];
    reader.next_frame(&mut data).map_err(invalid)?;
    let encoding = options.encoding();
    let pixels = if depth == BitDepth::Sixteen {
        let linear = |pair: &[u8]| encoding.decode(f32::from(u16::from_be_bytes([pair[0], pair[1]])) / 65535.0);
        if options.widen_16_bit {
            Pixels::F32(data.chunks_exact(2).map(linear).collect())
        } else {
            Pixels::F16(data.chunks_exact(2).map(|pair| f16::from_f32(linear(pair))).collect())
        }
    } else {
        Pixels::U8(data)
    };
    Image::from_pixels(width as usize, height as usize, owned(names), pixels, encoding)
}

/// The bytes of a PNG file of the channels R, G, B (A), or of a lone channel (and A).
///
/// Linear samples are clamped to [0, 1] and sRGB-encoded, alpha is not; 8-bit images keep their codes.
pub fn write_png(image: &Image, depth: PngDepth) -> Result<Vec<u8>, ImageError> {
    let (data, count) = match depth {
        PngDepth::Eight => codes_for_display(image, 4)?,
        PngDepth::Sixteen => {
            let picture = displayable(image, 4)?;
            let count = picture.channel_count();
            let colours = if count % 2 == 0 { count - 1 } else { count };
            let encode = |(index, value): (usize, f32)| {
                let clamped = if value > 0.0 { value.min(1.0) } else { 0.0 };
                let code = if index % count < colours { srgb_from_linear(clamped) } else { clamped };
                ((code * 65535.0 + 0.5) as u16).to_be_bytes()
            };
            (picture.to_f32().into_iter().enumerate().flat_map(encode).collect(), count)
        }
    };
    let color = match count {
        1 => ColorType::Grayscale,
        2 => ColorType::GrayscaleAlpha,
        3 => ColorType::Rgb,
        _ => ColorType::Rgba,
    };
    let too_wide = |_| ImageError::unsupported("PNG holds at most 2^32 - 1 pixels a side");
    let width = u32::try_from(image.width()).map_err(too_wide)?;
    let height = u32::try_from(image.height()).map_err(too_wide)?;
    let failed = |error: png::EncodingError| ImageError::unsupported(format!("PNG: {error}"));
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, width, height);
    encoder.set_color(color);
    encoder.set_depth(if depth == PngDepth::Eight { BitDepth::Eight } else { BitDepth::Sixteen });
    if image.encoding() != Encoding::Linear || image.format() != crate::PixelFormat::U8 {
        encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    }
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(&data).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_bit_codes_survive() {
        for names in [&["Y"][..], &["Y", "A"], &["R", "G", "B"], &["R", "G", "B", "A"]] {
            let codes = (0..17 * 9 * names.len()).map(|i| (i * 37 % 256) as u8).collect();
            let image = Image::from_u8(17, 9, names, codes, Encoding::Srgb).unwrap();
            let file = write_png(&image, PngDepth::Eight).unwrap();
            assert_eq!(read_png(&file, &ReadOptions::default()).unwrap(), image);
        }
    }

    #[test]
    fn sixteen_bits_survive_to_half_a_step() {
        let image = Image::from_fn(64, 4, ["R", "G", "B"], |x, y| [x as f32 / 63.0, (y as f32) / 3.0, 0.2]);
        let file = write_png(&image, PngDepth::Sixteen).unwrap();
        let options = ReadOptions { widen_16_bit: true, ..ReadOptions::default() };
        let back = read_png(&file, &options).unwrap();
        for (a, b) in image.to_f32().iter().zip(back.to_f32()) {
            assert!((srgb_from_linear(*a) - srgb_from_linear(b)).abs() <= 0.51 / 65535.0);
        }
        let half = read_png(&file, &ReadOptions::default()).unwrap();
        assert_eq!(half.bytes_used(), 64 * 4 * 3 * 2);
        for (a, b) in image.to_f32().iter().zip(half.to_f32()) {
            assert!((a - b).abs() <= 5e-4 * a + 1e-5);
        }
    }

    #[test]
    fn palettes_and_single_bits_are_widened() {
        let mut file = Vec::new();
        let mut encoder = Encoder::new(&mut file, 8, 1);
        encoder.set_color(ColorType::Indexed);
        encoder.set_depth(BitDepth::One);
        encoder.set_palette(vec![10, 20, 30, 200, 210, 220]);
        encoder.write_header().unwrap().write_image_data(&[0b0100_0001]).unwrap();
        let image = read_png(&file, &ReadOptions::default()).unwrap();
        let Pixels::U8(codes) = image.pixels() else { panic!("8-bit storage expected") };
        assert_eq!(image.channels(), ["R", "G", "B"]);
        assert_eq!((&codes[..6], &codes[21..]), (&[10, 20, 30, 200, 210, 220][..], &[200, 210, 220][..]));
    }

    #[test]
    fn a_bomb_is_refused_before_it_is_inflated() {
        let image = Image::from_u8(4000, 4000, &["Y"], vec![0; 16_000_000], Encoding::Srgb).unwrap();
        let file = write_png(&image, PngDepth::Eight).unwrap();
        let options = ReadOptions { max_bytes: 1 << 20, ..ReadOptions::default() };
        assert!(matches!(read_png(&file, &options), Err(ImageError::TooLarge { .. })));
    }
}
