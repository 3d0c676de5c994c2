//! OpenEXR in: single and multi-part, half, float and integer samples, any channel names.
//!
//! Decompression is the `exr` crate's. Deep data and subsampled channels are not supported by it.

use std::io::Cursor;

use exr::meta::MetaData;
use exr::meta::attribute::AttributeValue;
use exr::meta::header::Header;
use exr::prelude::{FlatSamples, ReadChannels, ReadLayers};
use half::f16;

use crate::encoding::Encoding;
use crate::error::ImageError;
use crate::format::{RUN_RATIO, ReadOptions, TRANSFORM_RATIO, guarded};
use crate::image::{Image, Pixels};
use crate::metadata::{Attribute, Chromaticities, Metadata};

/// Reads an OpenEXR file: halves if all its samples are, else floats; channels in the file's (alphabetical) order.
///
/// Integer channels become floats, exact up to 2^24. Channels of later parts are prefixed with the part's name
/// unless their own name is free; parts that cover other pixels than the first are listed in the metadata.
pub fn read_exr(bytes: &[u8], options: &ReadOptions) -> Result<Image, ImageError> {
    guarded("OpenEXR", || decode(bytes, options))
}

fn translate(error: exr::error::Error) -> ImageError {
    match error {
        exr::error::Error::NotSupported(what) => ImageError::unsupported(format!("OpenEXR: {what}")),
        other => ImageError::invalid(format!("OpenEXR: {other}")),
    }
}

fn decode(bytes: &[u8], options: &ReadOptions) -> Result<Image, ImageError> {
    let headers = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(translate)?.headers;
    let mut needed = 0u64;
    for header in &headers {
        needed = needed.saturating_add(check(header, bytes.len(), options)?);
    }
    // Samples live twice for a moment, planar and interleaved; the cap is on what is kept.
    if needed > options.max_bytes {
        return Err(ImageError::TooLarge { needed, allowed: options.max_bytes });
    }

    let file = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(translate)?;
    let chosen = options.part.unwrap_or(0);
    let Some(first) = file.layer_data.get(chosen) else {
        return Err(ImageError::invalid(format!("there is no part {chosen}")));
    };
    let (width, height) = (first.size.width(), first.size.height());
    let mut metadata = metadata(&file.attributes, &first.attributes);
    let mut names: Vec<String> = Vec::new();
    let mut planes: Vec<&FlatSamples> = Vec::new();
    for (index, layer) in file.layer_data.iter().enumerate() {
        let part = layer.attributes.layer_name.as_ref().map_or(index.to_string(), text);
        if index != chosen
            && (options.part.is_some()
                || layer.size != first.size
                || layer.attributes.layer_position != first.attributes.layer_position)
        {
            metadata.skipped_parts.push(part);
            continue;
        }
        for channel in &layer.channel_data.list {
            let name = text(&channel.name);
            let name = if names.contains(&name) { format!("{part}.{name}") } else { name };
            names.push(name);
            planes.push(&channel.sample_data);
        }
    }
    let pixels = interleave(&planes, width * height);
    let mut image = Image::from_pixels(width, height, names, pixels, Encoding::Linear)?;
    image.metadata = metadata;
    Ok(image)
}

/// The bytes that a part will take in memory, if there can be so much in the file.
fn check(header: &Header, input: usize, options: &ReadOptions) -> Result<u64, ImageError> {
    use exr::compression::Compression;
    let ratio = match header.compression {
        Compression::Uncompressed => 1,
        Compression::RLE | Compression::ZIP1 | Compression::ZIP16 => RUN_RATIO,
        _ => TRANSFORM_RATIO,
    };
    let samples = header.channels.list.iter().map(|channel| channel.sample_type.bytes_per_sample() as u64);
    let size = [header.layer_size.width() as u64, header.layer_size.height() as u64, samples.sum()];
    Ok(options.budget(size, 1, input, ratio)? as u64)
}

fn interleave(planes: &[&FlatSamples], pixels: usize) -> Pixels {
    let count = planes.len();
    if planes.iter().all(|plane| matches!(plane, FlatSamples::F16(_))) {
        let mut samples = vec![f16::ZERO; pixels * count];
        for (channel, plane) in planes.iter().enumerate() {
            if let FlatSamples::F16(plane) = plane {
                scatter(&mut samples, channel, count, plane.iter().copied());
            }
        }
        return Pixels::F16(samples);
    }
    let mut samples = vec![0.0f32; pixels * count];
    for (channel, plane) in planes.iter().enumerate() {
        match plane {
            FlatSamples::F16(plane) => scatter(&mut samples, channel, count, plane.iter().map(|half| half.to_f32())),
            FlatSamples::F32(plane) => scatter(&mut samples, channel, count, plane.iter().copied()),
            FlatSamples::U32(plane) => scatter(&mut samples, channel, count, plane.iter().map(|&int| int as f32)),
        }
    }
    Pixels::F32(samples)
}

fn scatter<T>(samples: &mut [T], channel: usize, count: usize, plane: impl Iterator<Item = T>) {
    for (pixel, value) in samples.chunks_exact_mut(count).zip(plane) {
        pixel[channel] = value;
    }
}

fn metadata(file: &exr::meta::header::ImageAttributes, layer: &exr::meta::header::LayerAttributes) -> Metadata {
    let window = file.display_window;
    let (x0, y0) = (window.position.x(), window.position.y());
    let far = |start: i32, length: usize| i32::try_from(i64::from(start) + length as i64).unwrap_or(i32::MAX);
    let mut found = Metadata {
        origin: [layer.layer_position.x(), layer.layer_position.y()],
        display_window: Some([x0, y0, far(x0, window.size.width()), far(y0, window.size.height())]),
        chromaticities: file.chromaticities.map(|c| Chromaticities {
            red: [c.red.x(), c.red.y()],
            green: [c.green.x(), c.green.y()],
            blue: [c.blue.x(), c.blue.y()],
            white: [c.white.x(), c.white.y()],
        }),
        ..Metadata::default()
    };
    // The crate knows some attributes by name; those that tell something are given back as they were.
    let mut attributes: Vec<(String, Attribute)> = Vec::new();
    for (name, value) in file.other.iter().chain(&layer.other) {
        if let Some(value) = attribute(value) {
            attributes.push((text(name), value));
        }
    }
    let texts = [
        ("comments", &layer.comments),
        ("owner", &layer.owner),
        ("capDate", &layer.capture_date),
        ("software", &layer.software_name),
        ("view", &layer.view_name),
    ];
    for (name, value) in texts {
        if let Some(value) = value {
            attributes.push((name.to_owned(), Attribute::Text(text(value))));
        }
    }
    for (name, matrix) in [("worldToCamera", layer.world_to_camera), ("worldToNDC", layer.world_to_normalized_device)] {
        if let Some(matrix) = matrix {
            attributes.push((name.to_owned(), Attribute::Matrix4(matrix)));
        }
    }
    let floats = [
        ("exposure", layer.exposure),
        ("whiteLuminance", layer.white_luminance),
        ("focus", layer.focus),
        ("aperture", layer.aperture),
        ("isoSpeed", layer.iso_speed),
        ("xDensity", layer.horizontal_density),
    ];
    for (name, value) in floats {
        if let Some(value) = value {
            attributes.push((name.to_owned(), Attribute::Float(value)));
        }
    }
    // The crate hands out a hash map; sorting makes the order a property of the file.
    attributes.sort_by(|a, b| a.0.cmp(&b.0));
    found.attributes = attributes;
    found
}

/// Bytes of a text as UTF-8; the crate's own conversion takes each byte for a character.
fn text(stored: &exr::prelude::Text) -> String {
    String::from_utf8_lossy(stored.bytes()).into_owned()
}

fn attribute(value: &AttributeValue) -> Option<Attribute> {
    Some(match value {
        AttributeValue::Text(value) => Attribute::Text(text(value)),
        AttributeValue::TextVector(texts) => Attribute::TextVector(texts.iter().map(text).collect()),
        AttributeValue::I32(value) => Attribute::Int(*value),
        AttributeValue::F32(value) => Attribute::Float(*value),
        AttributeValue::F64(value) => Attribute::Double(*value),
        AttributeValue::FloatVec2(value) => Attribute::Vec2([value.x(), value.y()]),
        AttributeValue::FloatVec3((x, y, z)) => Attribute::Vec3([*x, *y, *z]),
        AttributeValue::Matrix4x4(value) => Attribute::Matrix4(*value),
        _ => return None,
    })
}
