//! Radiance RGBE pictures, plain and run-length coded.
//!
//! Source: Ward, "Real Pixels", Graphics Gems II (1991); the "adaptive" run-length code of Radiance's `color.c`.
//! A mantissa m and exponent e stand for m 2^(e - 136), without the half step that some readers add; this is
//! what pbrt-v4's reader does.

use crate::encoding::Encoding;
use crate::error::ImageError;
use crate::format::{Bytes, RUN_RATIO, ReadOptions};
use crate::image::{Image, Pixels, owned};

/// Reads a Radiance file as floats R, G, B. Exposure and primaries in the header are not applied.
pub fn read_hdr(bytes: &[u8], options: &ReadOptions) -> Result<Image, ImageError> {
    let mut input = Bytes::new(bytes);
    if !line(&mut input)?.starts_with(b"#?") {
        return Err(ImageError::invalid_at(0, "a Radiance file begins with #?"));
    }
    loop {
        let text = line(&mut input)?;
        if text.is_empty() {
            break;
        }
        if text.starts_with(b"FORMAT=") && text != b"FORMAT=32-bit_rle_rgbe" {
            return Err(ImageError::unsupported(format!("Radiance {}", String::from_utf8_lossy(text))));
        }
    }
    let at = input.at();
    let resolution = String::from_utf8_lossy(line(&mut input)?).into_owned();
    let words: Vec<&str> = resolution.split_ascii_whitespace().collect();
    let [vertical, height, "+X", width] = words[..] else {
        return Err(ImageError::unsupported(format!("Radiance orientation {resolution:?}")));
    };
    let parse =
        |word: &str| word.parse::<u32>().map_err(|_| ImageError::invalid_at(at, format!("{word:?} is not a size")));
    let (width, height) = (parse(width)?, parse(height)?);
    // 4 stored bytes become 12; the budget is on what the samples take.
    options.budget([width.into(), height.into(), 12], 1, bytes.len(), 3 * RUN_RATIO)?;

    let (width, height) = (width as usize, height as usize);
    let mut samples = Vec::new();
    let mut row = vec![[0u8; 4]; width];
    for _ in 0..height {
        read_row(&mut input, &mut row)?;
        samples.extend(row.iter().flat_map(|&pixel| decode(pixel)));
    }
    let mut image = Image::from_pixels(width, height, owned(&["R", "G", "B"]), Pixels::F32(samples), Encoding::Linear)?;
    match vertical {
        "-Y" => {}
        "+Y" => image.flip_y(),
        _ => return Err(ImageError::unsupported(format!("Radiance orientation {resolution:?}"))),
    }
    Ok(image)
}

fn line<'a>(input: &mut Bytes<'a>) -> Result<&'a [u8], ImageError> {
    let rest = &input.bytes[input.at..];
    let Some(end) = rest.iter().take(4096).position(|&byte| byte == b'\n') else {
        return Err(ImageError::invalid_at(input.at, "the header has no end"));
    };
    input.at += end + 1;
    Ok(&rest[..end])
}

fn read_row(input: &mut Bytes<'_>, row: &mut [[u8; 4]]) -> Result<(), ImageError> {
    let width = row.len();
    let start = [input.u8()?, input.u8()?, input.u8()?, input.u8()?];
    if start[0] == 2 && start[1] == 2 && start[2] & 0x80 == 0 && (8..32768).contains(&width) {
        if usize::from(start[2]) << 8 | usize::from(start[3]) != width {
            return Err(ImageError::invalid_at(input.at(), "a row is coded for another width"));
        }
        for component in 0..4 {
            let mut x = 0;
            while x < width {
                let count = input.u8()?;
                let run = count > 128;
                let length = usize::from(if run { count - 128 } else { count });
                if length == 0 || x + length > width {
                    return Err(ImageError::invalid_at(input.at(), "a run leaves its row"));
                }
                let values = input.take(if run { 1 } else { length })?;
                for (index, pixel) in row[x..x + length].iter_mut().enumerate() {
                    pixel[component] = values[if run { 0 } else { index }];
                }
                x += length;
            }
        }
        return Ok(());
    }
    // Plain pixels, or the oldest code: (1, 1, 1, n) repeats the pixel before, successive ones in base 256.
    let mut pixel = start;
    let (mut x, mut shift) = (0, 0);
    loop {
        if pixel[..3] == [1, 1, 1] && x > 0 {
            let length = usize::from(pixel[3]).checked_shl(shift).unwrap_or(usize::MAX);
            if shift > 24 || length > width - x {
                return Err(ImageError::invalid_at(input.at(), "a run leaves its row"));
            }
            let previous = row[x - 1];
            row[x..x + length].fill(previous);
            x += length;
            shift += 8;
        } else {
            row[x] = pixel;
            x += 1;
            shift = 0;
        }
        if x >= width {
            return Ok(());
        }
        pixel = [input.u8()?, input.u8()?, input.u8()?, input.u8()?];
    }
}

fn decode([red, green, blue, exponent]: [u8; 4]) -> [f32; 3] {
    if exponent == 0 {
        return [0.0; 3];
    }
    let scale = libm::ldexp(1.0, i32::from(exponent) - 136);
    [red, green, blue].map(|mantissa| (f64::from(mantissa) * scale) as f32)
}

/// The bytes of a run-length coded Radiance file. Negative and undefined values become 0, huge ones the largest.
///
/// The shared exponent leaves 8 bits to the brightest channel: steps of up to 0.8 % of it.
pub fn write_hdr(image: &Image) -> Result<Vec<u8>, ImageError> {
    let picture = image
        .to_rgb()
        .ok_or_else(|| ImageError::unsupported(format!("Radiance holds R, G, B, not {:?}", image.channels())))?;
    let (width, height) = (picture.width(), picture.height());
    let mut file = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    let samples = picture.to_f32();
    let pixels: Vec<[u8; 4]> = samples.chunks_exact(3).map(|rgb| encode([rgb[0], rgb[1], rgb[2]])).collect();
    if !(8..32768).contains(&width) {
        file.extend(pixels.as_flattened());
        return Ok(file);
    }
    for row in pixels.chunks_exact(width) {
        file.extend([2, 2, (width >> 8) as u8, width as u8]);
        for component in 0..4 {
            let bytes: Vec<u8> = row.iter().map(|pixel| pixel[component]).collect();
            write_runs(&mut file, &bytes);
        }
    }
    Ok(file)
}

fn encode(rgb: [f32; 3]) -> [u8; 4] {
    // The largest value that the format can hold: 255 at the largest exponent.
    const LARGEST: f32 = 1.695e38;
    let rgb = rgb.map(|value| if value > 0.0 { value.min(LARGEST) } else { 0.0 });
    let brightest = rgb[0].max(rgb[1]).max(rgb[2]);
    if brightest < 1e-38 {
        return [0; 4];
    }
    let (_, mut exponent) = libm::frexp(f64::from(brightest));
    // Rounding up the mantissa may need one more power of two.
    if (f64::from(brightest) * libm::ldexp(1.0, 8 - exponent)).round() > 255.0 {
        exponent += 1;
    }
    if exponent > 127 {
        return [255, 255, 255, 255];
    }
    let scale = libm::ldexp(1.0, 8 - exponent);
    let [red, green, blue] = rgb.map(|value| (f64::from(value) * scale).round() as u8);
    [red, green, blue, (exponent + 128) as u8]
}

/// Runs of 4 and more are worth their two bytes.
fn write_runs(file: &mut Vec<u8>, bytes: &[u8]) {
    let run_at = |from: usize| bytes[from..].iter().take(127).take_while(|&&byte| byte == bytes[from]).count();
    let mut at = 0;
    while at < bytes.len() {
        let run = run_at(at);
        if run >= 4 {
            file.extend([128 + run as u8, bytes[at]]);
            at += run;
            continue;
        }
        let mut end = at + run;
        while end < bytes.len() && end - at < 128 {
            let next = run_at(end);
            if next >= 4 {
                break;
            }
            end = (end + next).min(at + 128);
        }
        file.push((end - at) as u8);
        file.extend_from_slice(&bytes[at..end]);
        at = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_survive_to_the_shared_exponents_step() {
        for width in [3, 8, 300] {
            let image = Image::from_fn(width, 7, ["R", "G", "B"], |x, y| {
                let base = (x as f32 * 0.37 + y as f32).exp2();
                [base, base * if x > 200 { 1.0 } else { 0.01 * x as f32 }, 0.0]
            });
            let back = read_hdr(&write_hdr(&image).unwrap(), &ReadOptions::default()).unwrap();
            for (a, b) in image.to_f32().chunks(3).zip(back.to_f32().chunks(3)) {
                let step = a[0].max(a[1]) / 128.0;
                assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 0.51 * step), "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn extremes_stay_in_range() {
        for value in [f32::NAN, -1.0, 0.0, 1e-45, f32::MAX, f32::INFINITY, 1.0, 0.999_999] {
            let decoded = decode(encode([value, 0.0, 0.0]));
            assert!(decoded[0].is_finite() && decoded[0] >= 0.0, "{value}");
            if (1e-30..1e30).contains(&value) {
                assert!((decoded[0] / value - 1.0).abs() < 0.004, "{value} {}", decoded[0]);
            }
        }
    }

    #[test]
    fn the_oldest_runs_are_read() {
        let mut file = b"#?RGBE\n\n-Y 1 +X 600\n".to_vec();
        file.extend([128, 128, 128, 129, 1, 1, 1, 87, 1, 1, 1, 2]);
        let image = read_hdr(&file, &ReadOptions::default()).unwrap();
        assert!(image.to_f32().iter().all(|&value| value == 1.0));
    }
}
