//! JPEG: in through `jpeg-decoder`, out through the `image` crate.

use std::io::Cursor;

use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageDecoder};
use jpeg_decoder::{Decoder, Error, PixelFormat};

use crate::error::ImageError;
use crate::format::{ReadOptions, TRANSFORM_RATIO, codes_for_display, guarded};
use crate::image::Image;

/// Reads a JPEG file: Y or R, G, B in 8 bits, sRGB unless the options say otherwise.
///
/// Four inks (CMYK, YCCK) become R, G, B by multiplication of ink and black, as in stb_image.
pub fn read_jpeg(bytes: &[u8], options: &ReadOptions) -> Result<Image, ImageError> {
    guarded("JPEG", || {
        let invalid = |error: Error| match error {
            Error::Unsupported(what) => ImageError::unsupported(format!("JPEG: {what:?}")),
            other => ImageError::invalid(format!("JPEG: {other}")),
        };
        let mut decoder = Decoder::new(Cursor::new(bytes));
        decoder.set_max_decoding_buffer_size(usize::try_from(options.max_bytes).unwrap_or(usize::MAX));
        decoder.read_info().map_err(invalid)?;
        let Some(info) = decoder.info() else { return Err(ImageError::invalid("JPEG: there is no frame")) };
        let (names, stored): (&[&str], u64) = match info.pixel_format {
            PixelFormat::L8 => (&["Y"], 1),
            PixelFormat::RGB24 => (&["R", "G", "B"], 3),
            PixelFormat::CMYK32 => (&["R", "G", "B"], 4),
            PixelFormat::L16 => return Err(ImageError::unsupported("JPEG of 16 bits")),
        };
        let size = [info.width.into(), info.height.into(), stored];
        let count = options.budget(size, 1, bytes.len(), TRANSFORM_RATIO)?;
        let mut codes = decoder.decode().map_err(invalid)?;
        if codes.len() != count {
            return Err(ImageError::invalid("JPEG: the rows do not fill the picture"));
        }
        if stored == 4 {
            let times = |ink: u8, black: u8| ((u32::from(ink) * u32::from(black) + 127) / 255) as u8;
            codes =
                codes.chunks_exact(4).flat_map(|inks| [0, 1, 2].map(|i| times(255 - inks[i], 255 - inks[3]))).collect();
        }
        Image::from_u8(info.width.into(), info.height.into(), names, codes, options.encoding())
    })
}

/// Any decoder of the `image` crate that yields 8-bit samples.
pub(super) fn decode_u8(
    decoder: impl ImageDecoder,
    input: usize,
    ratio: u64,
    options: &ReadOptions,
) -> Result<Image, ImageError> {
    let (width, height) = decoder.dimensions();
    let names: &[&str] = match decoder.color_type() {
        image::ColorType::L8 => &["Y"],
        image::ColorType::La8 => &["Y", "A"],
        image::ColorType::Rgb8 => &["R", "G", "B"],
        image::ColorType::Rgba8 => &["R", "G", "B", "A"],
        other => return Err(ImageError::unsupported(format!("samples of kind {other:?}"))),
    };
    let count = options.budget([width.into(), height.into(), names.len() as u64], 1, input, ratio)?;
    if decoder.total_bytes() != count as u64 {
        return Err(ImageError::invalid("the rows do not fill the picture"));
    }
    let mut codes = vec![0; count];
    decoder.read_image(&mut codes).map_err(|error| ImageError::invalid(error.to_string()))?;
    Image::from_u8(width as usize, height as usize, names, codes, options.encoding())
}

/// The bytes of a JPEG file of quality 1 to 100; floats are clamped and sRGB-encoded, alpha is left out.
pub fn write_jpeg(image: &Image, quality: u8) -> Result<Vec<u8>, ImageError> {
    let (codes, channels) = codes_for_display(image, 3)?;
    let (Ok(width), Ok(height)) = (u16::try_from(image.width()), u16::try_from(image.height())) else {
        return Err(ImageError::unsupported("JPEG holds at most 65,535 pixels a side"));
    };
    let kind = if channels == 1 { ExtendedColorType::L8 } else { ExtendedColorType::Rgb8 };
    let mut file = Vec::new();
    JpegEncoder::new_with_quality(&mut file, quality.clamp(1, 100))
        .encode(&codes, width.into(), height.into(), kind)
        .map_err(|error| ImageError::unsupported(format!("JPEG: {error}")))?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_picture_survives_nearly() {
        let image = Image::from_fn(64, 48, ["R", "G", "B"], |x, y| [x as f32 / 63.0, y as f32 / 47.0, 0.3]);
        let back = read_jpeg(&write_jpeg(&image, 98).unwrap(), &ReadOptions::default()).unwrap();
        assert_eq!((back.width(), back.height(), back.channel_count()), (64, 48, 3));
        let error: f32 = image.to_f32().iter().zip(back.to_f32()).map(|(a, b)| (a - b).abs()).sum();
        assert!(error / image.to_f32().len() as f32 <= 0.01);
        let grey = Image::from_fn(9, 9, ["Y"], |_, _| [0.5]);
        let back = read_jpeg(&write_jpeg(&grey, 90).unwrap(), &ReadOptions::default()).unwrap();
        assert!((back.get(4, 4, 0) - 0.5).abs() < 0.02);
    }
}
