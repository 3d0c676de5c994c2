//! From linear light to what a display shows: exposure, a filmic curve, sRGB bytes; and false colour.

use crate::encoding::Encoding;
use crate::error::ImageError;
use crate::image::{Image, PixelFormat};

/// How values above 1 are brought into reach.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// Not at all: values are clamped.
    #[default]
    None,
    /// Reinhard et al. 2002, equation 3: L / (1 + L) on the luminance, colours keep their ratios.
    Reinhard,
    /// Narkowicz 2015: a rational fit to the ACES output curve, on each channel, its input scaled by 0.6.
    Aces,
}

/// Exposure and curve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToneOptions {
    /// Stops by which the picture is brightened first: a factor of 2^exposure.
    pub exposure: f32,
    /// The curve after that.
    pub curve: ToneCurve,
    /// Adds an 8 x 8 ordered pattern of at most half a code before rounding, which hides banding; off by default.
    pub dither: bool,
}

/// The picture (R, G, B, or grey as such) after exposure and curve, still linear, in floats, with sRGB's primaries: colours
/// of a picture that states others are converted first, white to white.
///
/// An error if it has neither R, G, B nor a lone channel.
pub fn tone_map(image: &Image, options: &ToneOptions) -> Result<Image, ImageError> {
    let mut picture = crate::format::displayable(image, 3)?.convert(PixelFormat::F32, Encoding::Linear);
    let count = picture.channel_count();
    let factor = libm::exp2f(options.exposure);
    let stated = image.metadata.chromaticities.filter(|c| !c.is_srgb());
    let to_srgb = stated.and_then(|c| c.to_srgb()).map(|m| m.map(|row| row.map(|v| v as f32)));
    picture.metadata.chromaticities = None;
    if let Some(samples) = picture.as_f32_mut() {
        for pixel in samples.chunks_exact_mut(count) {
            if let (Some(m), [r, g, b]) = (&to_srgb, &mut *pixel) {
                let given = [*r, *g, *b];
                [*r, *g, *b] = m.map(|row| row[0] * given[0] + row[1] * given[1] + row[2] * given[2]);
            }
            for value in pixel.iter_mut() {
                *value *= factor;
            }
            match options.curve {
                ToneCurve::None => {}
                ToneCurve::Reinhard => {
                    let luminance = if let [r, g, b] = *pixel { luminance([r, g, b]) } else { pixel[0] };
                    let scale = if luminance > 0.0 { 1.0 / (1.0 + luminance) } else { 1.0 };
                    pixel.iter_mut().for_each(|value| *value *= scale);
                }
                ToneCurve::Aces => pixel.iter_mut().for_each(|value| *value = aces(*value)),
            }
        }
    }
    Ok(picture)
}

/// 8-bit sRGB codes of the picture after exposure and curve; what is below 0 or not a number becomes 0.
pub fn to_srgb8(image: &Image, options: &ToneOptions) -> Result<Image, ImageError> {
    let picture = tone_map(image, options)?;
    if !options.dither {
        return Ok(picture.convert(PixelFormat::U8, Encoding::Srgb));
    }
    let (width, count) = (picture.width(), picture.channel_count());
    let samples = picture.to_f32();
    let codes = samples.iter().enumerate().map(|(index, &value)| {
        let pixel = index / count;
        let threshold = bayer(pixel % width, pixel / width);
        let code = crate::encoding::srgb_from_linear(if value > 0.0 { value.min(1.0) } else { 0.0 });
        (code * 255.0 + threshold) as u8
    });
    let names: Vec<&str> = picture.channels().iter().map(String::as_str).collect();
    Image::from_u8(width, picture.height(), &names, codes.collect(), Encoding::Srgb)
}

/// The ordered pattern of Bayer 1973, in (0, 1): bits of x ^ y and y interleaved, low ones first.
fn bayer(x: usize, y: usize) -> f32 {
    let rank = (0..3).fold(0, |rank, bit| rank << 2 | (((x ^ y) >> bit & 1) << 1) | (y >> bit & 1));
    (rank as f32 + 0.5) / 64.0
}

fn aces(value: f32) -> f32 {
    // Beyond 1e15 the squares overflow and the fit has long been flat.
    let x = if value > 0.0 { (0.6 * value).min(1e15) } else { 0.0 };
    (x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)).clamp(0.0, 1.0)
}

/// Rec. 709 luminance of linear R, G, B.
pub fn luminance([red, green, blue]: [f32; 3]) -> f32 {
    0.2126 * red + 0.7152 * green + 0.0722 * blue
}

/// The picture's luminance (or lone channel) in false colour, by stops: `lowest` is dark blue, `highest` white.
///
/// Codes run through blue, cyan, green, yellow and red at equal distances; what is 0, below or undefined is black.
/// An error if there is neither R, G, B nor a lone channel.
pub fn false_colour(image: &Image, lowest: f32, highest: f32) -> Result<Image, ImageError> {
    const STOPS: [[f32; 3]; 7] = [
        [0.05, 0.03, 0.30],
        [0.10, 0.25, 0.90],
        [0.10, 0.75, 0.85],
        [0.15, 0.75, 0.20],
        [0.95, 0.90, 0.15],
        [0.90, 0.15, 0.10],
        [1.00, 1.00, 1.00],
    ];
    let picture = crate::format::displayable(image, 3)?;
    let samples = picture.to_f32();
    let colour = |value: f32| -> [u8; 3] {
        if value.is_nan() || value <= 0.0 {
            return [0; 3];
        }
        let place = (libm::log2f(value) - lowest) / (highest - lowest).max(1e-6);
        let place = place.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
        let index = (place as usize).min(STOPS.len() - 2);
        let towards = place - index as f32;
        std::array::from_fn(|c| {
            ((STOPS[index][c] + towards * (STOPS[index + 1][c] - STOPS[index][c])) * 255.0 + 0.5) as u8
        })
    };
    let value = |pixel: &[f32]| if let [r, g, b] = *pixel { luminance([r, g, b]) } else { pixel[0] };
    let codes = samples.chunks_exact(picture.channel_count()).flat_map(|pixel| colour(value(pixel)));
    Image::from_u8(picture.width(), picture.height(), &["R", "G", "B"], codes.collect(), Encoding::Srgb)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Pixels;

    fn codes(image: &Image) -> &[u8] {
        match image.pixels() {
            Pixels::U8(codes) => codes,
            _ => panic!("8-bit storage expected"),
        }
    }

    #[test]
    fn exposure_is_in_stops() {
        let image = Image::from_fn(1, 1, ["R", "G", "B"], |_, _| [0.25, 0.125, f32::NAN]);
        let plain = to_srgb8(&image, &ToneOptions::default()).unwrap();
        assert_eq!(codes(&plain), [137, 99, 0]);
        let brighter = to_srgb8(&image, &ToneOptions { exposure: 2.0, ..ToneOptions::default() }).unwrap();
        assert_eq!(codes(&brighter), [255, 188, 0]);
    }

    #[test]
    fn a_display_shows_srgb_whatever_primaries_a_picture_has() {
        let mut image = Image::from_fn(2, 1, ["R", "G", "B"], |x, _| [[0.5, 0.5, 0.5], [0.3, 0.2, 0.1]][x]);
        let plain = to_srgb8(&image, &ToneOptions::default()).unwrap();
        // Stating sRGB's changes nothing, to the bit, and a wide red is redder than sRGB's.
        image.metadata.chromaticities = Some(crate::metadata::Chromaticities::SRGB);
        assert_eq!(codes(&to_srgb8(&image, &ToneOptions::default()).unwrap()), codes(&plain));
        image.metadata.chromaticities = Some(crate::metadata::Chromaticities {
            red: [0.708, 0.292],
            green: [0.170, 0.797],
            blue: [0.131, 0.046],
            white: [0.3127, 0.3290],
        });
        let wide = to_srgb8(&image, &ToneOptions::default()).unwrap();
        assert_eq!(codes(&wide)[..3], codes(&plain)[..3]);
        // 1.6605 x 0.3 - 0.5876 x 0.2 - 0.0728 x 0.1 = 0.3734, 0.1884, 0.0863, encoded.
        assert_eq!(codes(&wide)[3..], [164, 120, 83]);
    }

    #[test]
    fn curves_rise_and_stay_below_one() {
        for curve in [ToneCurve::Reinhard, ToneCurve::Aces] {
            let image = Image::from_fn(200, 1, ["R", "G", "B"], |x, _| [(x as f32 * 0.5 - 30.0).exp2(); 3]);
            let mapped = tone_map(&image, &ToneOptions { curve, ..ToneOptions::default() }).unwrap();
            let mut previous = -1.0;
            for x in 0..200 {
                let value = mapped.get(x, 0, 1);
                // Near 1 rounding may step back by a bit or two.
                assert!(value >= previous - 3e-7 && value <= 1.0 + 3e-7, "{curve:?} {x}: {value}");
                previous = value;
            }
        }
        let grey = Image::from_fn(1, 1, ["Y"], |_, _| [1.0]);
        let mapped = tone_map(&grey, &ToneOptions { curve: ToneCurve::Reinhard, ..ToneOptions::default() });
        assert_eq!(mapped.unwrap().get(0, 0, 0), 0.5);
    }

    /// 64 pixels of one value between two codes: as many of the upper one as the value says, to one pixel.
    #[test]
    fn dither_keeps_the_mean() {
        let value = Encoding::Srgb.decode(100.3 / 255.0);
        let image = Image::from_fn(8, 8, ["Y"], |_, _| [value]);
        let dithered = to_srgb8(&image, &ToneOptions { dither: true, ..ToneOptions::default() }).unwrap();
        let upper = codes(&dithered).iter().filter(|&&code| code == 101).count();
        assert!(codes(&dithered).iter().all(|&code| code == 100 || code == 101));
        assert!((upper as f32 - 0.3 * 64.0).abs() <= 1.0, "{upper}");
    }

    #[test]
    fn false_colours_span_the_stops() {
        let image = Image::from_fn(4, 1, ["Y"], |x, _| [[0.0, 0.25, 1.0, 64.0][x]]);
        let shown = false_colour(&image, -2.0, 2.0).unwrap();
        assert_eq!(codes(&shown), [0, 0, 0, 13, 8, 77, 38, 191, 51, 255, 255, 255]);
    }
}
