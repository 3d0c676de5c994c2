//! OpenEXR out: scanlines, halves or floats, ZIP blocks of 16 lines or none.
//!
//! Written here rather than by the `exr` crate because that keeps custom attributes in a hash map, whose
//! order differs from run to run, and equal images are to be equal files. All attributes are sorted by
//! name, nothing depends on the clock, and the deflater is pure Rust of a locked version.
//!
//! Source: "OpenEXR File Layout" and "Technical Introduction to OpenEXR", Academy Software Foundation.

use std::collections::BTreeMap;

use crate::encoding::Encoding;
use crate::error::ImageError;
use crate::image::{Image, PixelFormat, Pixels};
use crate::metadata::Attribute;

/// How scanlines are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compression {
    /// Not at all.
    None,
    /// Blocks of 16 lines through zlib.
    Zip,
}

impl Compression {
    fn lines(self) -> usize {
        match self {
            Self::None => 1,
            Self::Zip => 16,
        }
    }
}

/// zlib effort: OpenEXR's own default since 3.1, within 1 % of level 6 on renderings at half the time.
const ZLIB_LEVEL: u8 = 4;

/// The bytes of an OpenEXR file: half channels for half images, float channels for all others.
///
/// Channel names, windows, chromaticities and attributes are the image's; equal images give equal bytes.
/// Values of 8-bit images are decoded to linear light.
pub fn write_exr(image: &Image, compression: Compression) -> Result<Vec<u8>, ImageError> {
    let (width, height, count) = (image.width(), image.height(), image.channel_count());
    if width == 0 || height == 0 {
        return Err(ImageError::unsupported("OpenEXR holds no empty picture"));
    }
    let order = channel_order(image)?;
    let half = image.format() == PixelFormat::F16;
    let long_names =
        image.channels().iter().map(String::len).chain(image.metadata.attributes.iter().map(|a| a.0.len()));
    let version: u32 = if long_names.max() > Some(31) { 2 | 0x400 } else { 2 };

    let mut file = vec![0x76, 0x2f, 0x31, 0x01];
    file.extend(version.to_le_bytes());
    write_header(&mut file, image, &order, half, compression)?;

    // The table of block positions comes before the blocks and is filled in as they are written.
    let lines = compression.lines();
    let blocks = height.div_ceil(lines);
    let table = file.len();
    file.resize(table + 8 * blocks, 0);

    let converted;
    let pixels = match image.pixels() {
        Pixels::U8(_) => {
            converted = image.convert(PixelFormat::F32, Encoding::Linear);
            converted.pixels()
        }
        stored => stored,
    };
    let bytes_per_sample = if half { 2 } else { 4 };
    let mut raw = Vec::with_capacity(lines * width * count * bytes_per_sample);
    for block in 0..blocks {
        let first = block * lines;
        raw.clear();
        for y in first..(first + lines).min(height) {
            for &channel in &order {
                let start = y * width * count + channel;
                match pixels {
                    Pixels::F16(samples) => {
                        let row = samples[start..].iter().step_by(count).take(width);
                        raw.extend(row.flat_map(|value| value.to_bits().to_le_bytes()));
                    }
                    Pixels::F32(samples) => {
                        let row = samples[start..].iter().step_by(count).take(width);
                        raw.extend(row.flat_map(|value| value.to_bits().to_le_bytes()));
                    }
                    Pixels::U8(_) => unreachable!("8-bit images were converted above"),
                }
            }
        }
        let position = file.len() as u64;
        file[table + 8 * block..][..8].copy_from_slice(&position.to_le_bytes());
        let y = i64::from(image.metadata.origin[1]) + first as i64;
        file.extend((y as i32).to_le_bytes());
        let packed = match compression {
            Compression::None => None,
            Compression::Zip => Some(deflate(&raw)),
        };
        // A block that does not shrink is stored as it is; readers tell by its size.
        let data = packed.as_ref().filter(|packed| packed.len() < raw.len()).unwrap_or(&raw);
        let size = i32::try_from(data.len())
            .map_err(|_| ImageError::TooLarge { needed: data.len() as u64, allowed: i32::MAX as u64 })?;
        file.extend(size.to_le_bytes());
        file.extend_from_slice(data);
    }
    Ok(file)
}

/// Channel indices in the order of their names, which the format requires.
fn channel_order(image: &Image) -> Result<Vec<usize>, ImageError> {
    let names = image.channels();
    let mut order: Vec<usize> = (0..names.len()).collect();
    order.sort_by(|&a, &b| names[a].cmp(&names[b]));
    for name in names {
        check_name(name)?;
    }
    Ok(order)
}

fn check_name(name: &str) -> Result<(), ImageError> {
    if name.is_empty() || name.len() > 255 || name.contains('\0') {
        return Err(ImageError::unsupported(format!("OpenEXR cannot hold the name {name:?}")));
    }
    Ok(())
}

fn write_header(
    file: &mut Vec<u8>,
    image: &Image,
    order: &[usize],
    half: bool,
    compression: Compression,
) -> Result<(), ImageError> {
    let outside = || ImageError::unsupported("the data window does not fit 32-bit coordinates");
    let [x0, y0] = image.metadata.origin;
    let last = |start: i32, length: usize| {
        i64::try_from(length)
            .ok()
            .and_then(|length| i32::try_from(i64::from(start) + length - 1).ok())
            .ok_or_else(outside)
    };
    let data_window = [x0, y0, last(x0, image.width())?, last(y0, image.height())?];
    let display_window = match image.metadata.display_window {
        Some([left, top, right, bottom]) if right > left && bottom > top => [left, top, right - 1, bottom - 1],
        _ => data_window,
    };

    let mut entries: BTreeMap<String, (&'static str, Vec<u8>)> = BTreeMap::new();
    for (name, value) in &image.metadata.attributes {
        check_name(name)?;
        entries.insert(name.clone(), encode_attribute(value)?);
    }
    // The format's own attributes come last, so that no custom one can displace them.
    let mut channels = Vec::new();
    for &index in order {
        channels.extend_from_slice(image.channels()[index].as_bytes());
        channels.push(0);
        channels.extend(if half { 1i32 } else { 2i32 }.to_le_bytes());
        channels.extend([0; 4]);
        channels.extend(1i32.to_le_bytes());
        channels.extend(1i32.to_le_bytes());
    }
    channels.push(0);
    let mut required = |name: &str, kind, value| {
        entries.insert(name.to_owned(), (kind, value));
    };
    required("channels", "chlist", channels);
    let method = match compression {
        Compression::None => 0,
        Compression::Zip => 3,
    };
    required("compression", "compression", vec![method]);
    required("dataWindow", "box2i", data_window.iter().flat_map(|value| value.to_le_bytes()).collect());
    required("displayWindow", "box2i", display_window.iter().flat_map(|value| value.to_le_bytes()).collect());
    required("lineOrder", "lineOrder", vec![0]);
    required("pixelAspectRatio", "float", 1.0f32.to_le_bytes().to_vec());
    required("screenWindowCenter", "v2f", vec![0; 8]);
    required("screenWindowWidth", "float", 1.0f32.to_le_bytes().to_vec());
    if let Some(c) = image.metadata.chromaticities {
        required("chromaticities", "chromaticities", floats(&[c.red, c.green, c.blue, c.white].concat()));
    }

    for (name, (kind, value)) in entries {
        file.extend_from_slice(name.as_bytes());
        file.push(0);
        file.extend_from_slice(kind.as_bytes());
        file.push(0);
        file.extend((value.len() as i32).to_le_bytes());
        file.extend_from_slice(&value);
    }
    file.push(0);
    Ok(())
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn encode_attribute(value: &Attribute) -> Result<(&'static str, Vec<u8>), ImageError> {
    let length = |text: &str| {
        i32::try_from(text.len()).map_err(|_| ImageError::unsupported("an attribute is longer than 2 GiB"))
    };
    Ok(match value {
        Attribute::Text(text) => {
            length(text)?;
            ("string", text.as_bytes().to_vec())
        }
        Attribute::TextVector(texts) => {
            let mut bytes = Vec::new();
            for text in texts {
                bytes.extend(length(text)?.to_le_bytes());
                bytes.extend_from_slice(text.as_bytes());
            }
            ("stringvector", bytes)
        }
        Attribute::Int(value) => ("int", value.to_le_bytes().to_vec()),
        Attribute::Float(value) => ("float", value.to_le_bytes().to_vec()),
        Attribute::Double(value) => ("double", value.to_le_bytes().to_vec()),
        Attribute::Vec2(value) => ("v2f", floats(value)),
        Attribute::Vec3(value) => ("v3f", floats(value)),
        Attribute::Matrix4(value) => ("m44f", floats(value)),
    })
}

/// OpenEXR's ZIP: bytes of even and of odd places apart, each as its difference from the one before, then zlib.
fn deflate(raw: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(raw.len());
    bytes.extend(raw.iter().step_by(2));
    bytes.extend(raw.iter().skip(1).step_by(2));
    let mut previous = bytes.first().copied().unwrap_or(0);
    for byte in bytes.iter_mut().skip(1) {
        let current = *byte;
        *byte = current.wrapping_sub(previous).wrapping_add(128);
        previous = current;
    }
    miniz_oxide::deflate::compress_to_vec_zlib(&bytes, ZLIB_LEVEL)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::ReadOptions;
    use crate::format::exr_read::read_exr;
    use crate::metadata::Chromaticities;

    fn render() -> Image {
        let mut image = Image::from_fn(37, 41, ["R", "G", "B", "N.X", "Albedo.R", "Z"], |x, y| {
            let noise = ((x * 7919 + y * 104_729) % 1000) as f32 / 1000.0;
            [noise, x as f32, -0.5, f32::INFINITY, 1e-40, noise * 1e30]
        });
        image.metadata.origin = [-3, 5];
        image.metadata.display_window = Some([-10, 0, 100, 80]);
        image.metadata.chromaticities = Some(Chromaticities { white: [0.3, 0.31], ..Chromaticities::SRGB });
        image.metadata.attributes = vec![
            ("comments".into(), Attribute::Text("grüße".into())),
            ("irradiant:aVeryLongAttributeNameIndeed".into(), Attribute::Double(1.0 / 3.0)),
            ("irradiant:list".into(), Attribute::TextVector(vec!["a".into(), String::new(), "bc".into()])),
            ("samplesPerPixel".into(), Attribute::Int(256)),
            ("v2".into(), Attribute::Vec2([1.0, 2.0])),
            ("v3".into(), Attribute::Vec3([1.0, 2.0, 3.0])),
            ("worldToCamera".into(), Attribute::Matrix4(std::array::from_fn(|i| i as f32))),
        ];
        image
    }

    #[test]
    fn everything_survives() {
        for compression in [Compression::None, Compression::Zip] {
            for format in [PixelFormat::F32, PixelFormat::F16] {
                let image = render().convert(format, Encoding::Linear);
                let file = write_exr(&image, compression).unwrap();
                let back = read_exr(&file, &ReadOptions::default()).unwrap();
                assert_eq!(back.format(), format);
                assert_eq!(back.channels(), ["Albedo.R", "B", "G", "N.X", "R", "Z"]);
                let names: Vec<&str> = image.channels().iter().map(String::as_str).collect();
                let back = back.select(&names).unwrap();
                assert_eq!(back.metadata, image.metadata);
                assert!(back == image, "some sample differs");
            }
        }
    }

    #[test]
    fn equal_images_are_equal_files() {
        let file = write_exr(&render(), Compression::Zip).unwrap();
        let mut shuffled = render();
        shuffled.metadata.attributes.reverse();
        assert_eq!(write_exr(&shuffled, Compression::Zip).unwrap(), file);
        let mut other = render();
        other.set(36, 40, 0, 0.123);
        assert_ne!(write_exr(&other, Compression::Zip).unwrap(), file);
    }

    #[test]
    fn smooth_pictures_shrink() {
        let smooth = Image::from_fn(512, 64, ["R"], |x, _| [(x / 64) as f32]);
        let zip = write_exr(&smooth, Compression::Zip).unwrap().len();
        assert!(zip * 20 < write_exr(&smooth, Compression::None).unwrap().len());
    }

    #[test]
    fn files_of_the_exr_crate_are_read() {
        use exr::prelude::{
            Compression, Encoding, ImageAttributes, IntegerBounds, Layer, LayerAttributes, SpecificChannels, Vec2,
            WritableImage,
        };
        let size = (33, 21);
        let at = |p: Vec2<usize>| (p.x() as f32, p.y() as f32, 0.25f32);
        for compression in
            [Compression::Uncompressed, Compression::RLE, Compression::ZIP1, Compression::PIZ, Compression::PXR24]
        {
            let encoding = Encoding { compression, ..Encoding::default() };
            let layer = Layer::new(size, LayerAttributes::named("main"), encoding, SpecificChannels::rgb(at));
            let mut file = Vec::new();
            exr::prelude::Image::from_layer(layer).write().to_buffered(std::io::Cursor::new(&mut file)).unwrap();
            let image = read_exr(&file, &ReadOptions::default()).unwrap();
            let red = image.channel_index("R").unwrap();
            assert_eq!(image.get(30, 20, red), 30.0);
        }
        let part =
            |name| Layer::new(size, LayerAttributes::named(name), Encoding::default(), SpecificChannels::rgb(at));
        let frame = ImageAttributes::new(IntegerBounds::new((0, 0), size));
        let mut file = Vec::new();
        let image = exr::prelude::Image::empty(frame).with_layer(part("first")).with_layer(part("second"));
        image.write().to_buffered(std::io::Cursor::new(&mut file)).unwrap();
        let both = read_exr(&file, &ReadOptions::default()).unwrap();
        assert_eq!(both.channels(), ["B", "G", "R", "second.B", "second.G", "second.R"]);
        let second = read_exr(&file, &ReadOptions { part: Some(1), ..ReadOptions::default() }).unwrap();
        assert_eq!((second.channels().len(), &second.metadata.skipped_parts[..]), (3, &["first".to_owned()][..]));
    }
}
