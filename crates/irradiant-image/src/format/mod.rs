//! Image files in and out.
//!
//! [`read`] looks at the first bytes, then at the name. Every reader checks the size that a header
//! claims against the bytes there are and against [`ReadOptions::max_bytes`] before it allocates:
//!
//! | format | samples may take at most, per input byte |
//! |---|---|
//! | PFM, BMP, TGA without runs | the file's own size (times 4 for palettes) |
//! | TGA, QOI, HDR, BMP with runs | 1,100 |
//! | PNG, EXR (none, RLE, ZIP) | 1,100 before palettes and low bit depths are widened |
//! | JPEG, EXR (PIZ, PXR24, B44, DWA) | 65,536 |
//!
//! plus 64 KiB. The third-party decoders (`exr`, `png`, `jpeg-decoder`, `image` for BMP) run inside
//! `catch_unwind`, since a decoder that panics on a hostile file must not take the renderer along.

pub mod bmp;
pub mod exr_read;
pub mod exr_write;
pub mod hdr;
pub mod jpeg;
pub mod pfm;
pub mod png;
pub mod qoi;
pub mod tga;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use crate::encoding::Encoding;
use crate::error::ImageError;
use crate::format::exr_write::Compression;
use crate::format::png::PngDepth;
use crate::image::Image;

/// The file formats that this crate knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileFormat {
    /// OpenEXR.
    Exr,
    /// Portable Network Graphics.
    Png,
    /// Portable float map.
    Pfm,
    /// Radiance RGBE.
    Hdr,
    /// JPEG.
    Jpeg,
    /// Truevision TGA; read only.
    Tga,
    /// The "quite OK" image format.
    Qoi,
    /// Windows bitmap; read only.
    Bmp,
}

impl FileFormat {
    /// The format that a file name's extension stands for, in either case.
    pub fn from_name(name: &str) -> Option<Self> {
        let extension = Path::new(name).extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "exr" => Some(Self::Exr),
            "png" => Some(Self::Png),
            "pfm" => Some(Self::Pfm),
            "hdr" | "rgbe" | "pic" => Some(Self::Hdr),
            "jpg" | "jpeg" => Some(Self::Jpeg),
            "tga" => Some(Self::Tga),
            "qoi" => Some(Self::Qoi),
            "bmp" => Some(Self::Bmp),
            _ => None,
        }
    }

    /// The format that the first bytes announce; TGA has no such mark.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        const MARKS: [(&[u8], FileFormat); 9] = [
            (b"\x76\x2f\x31\x01", FileFormat::Exr),
            (b"\x89PNG\r\n\x1a\n", FileFormat::Png),
            (b"PF", FileFormat::Pfm),
            (b"Pf", FileFormat::Pfm),
            (b"#?RADIANCE", FileFormat::Hdr),
            (b"#?RGBE", FileFormat::Hdr),
            (b"\xff\xd8\xff", FileFormat::Jpeg),
            (b"qoif", FileFormat::Qoi),
            (b"BM", FileFormat::Bmp),
        ];
        MARKS.iter().find(|(mark, _)| bytes.starts_with(mark)).map(|&(_, format)| format)
    }
}

/// What a reader may do and how it keeps what it reads.
#[derive(Clone, Debug)]
pub struct ReadOptions {
    /// Most bytes that the samples may take in memory.
    pub max_bytes: u64,
    /// What 8- and 16-bit integer samples stand for, if not what the format implies (sRGB).
    pub encoding: Option<Encoding>,
    /// Keeps 16-bit integer samples as floats rather than as halves (11 significant bits, pbrt-v4's choice).
    pub widen_16_bit: bool,
    /// Reads only this part of a multi-part OpenEXR file, rather than all parts that cover the first one's pixels.
    pub part: Option<usize>,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { max_bytes: 4 << 30, encoding: None, widen_16_bit: false, part: None }
    }
}

impl ReadOptions {
    pub(crate) fn encoding(&self) -> Encoding {
        self.encoding.unwrap_or(Encoding::Srgb)
    }

    /// The sample count of a picture, if the budget allows `bytes_per_sample` for each and there can be
    /// so many in a file of `input` bytes when one byte yields at most `ratio` bytes.
    pub(crate) fn budget(
        &self,
        [width, height, channels]: [u64; 3],
        bytes_per_sample: u64,
        input: usize,
        ratio: u64,
    ) -> Result<usize, ImageError> {
        if width == 0 || height == 0 || channels == 0 {
            return Err(ImageError::invalid(format!("empty picture of {width} x {height} pixels")));
        }
        let samples = width.checked_mul(height).and_then(|pixels| pixels.checked_mul(channels));
        let needed = samples.and_then(|samples| samples.checked_mul(bytes_per_sample)).unwrap_or(u64::MAX);
        let allowed = (input as u64).saturating_mul(ratio).saturating_add(1 << 16).min(self.max_bytes);
        if needed > allowed {
            return Err(ImageError::TooLarge { needed, allowed });
        }
        usize::try_from(needed / bytes_per_sample).map_err(|_| ImageError::TooLarge { needed, allowed })
    }
}

/// Most bytes that a byte of deflate or of a run-length code is taken to yield (deflate's limit is 1,032).
pub(crate) const RUN_RATIO: u64 = 1_100;

/// Most bytes that a byte of a transform code (JPEG, DWA, PIZ) is taken to yield.
pub(crate) const TRANSFORM_RATIO: u64 = 65_536;

/// Reads a picture from the bytes of a file.
///
/// The format is what the first bytes say, else what the extension of `name_hint` says. Integer
/// samples keep their code values under an [`Encoding`] (sRGB unless the options say otherwise), floats
/// stay linear. Channels are named "R", "G", "B", "A", or "Y" (and "A") for grey, or as the EXR file says.
pub fn read(bytes: &[u8], name_hint: &str, options: &ReadOptions) -> Result<Image, ImageError> {
    let format = FileFormat::from_bytes(bytes).or_else(|| FileFormat::from_name(name_hint));
    match format {
        Some(FileFormat::Exr) => exr_read::read_exr(bytes, options),
        Some(FileFormat::Png) => png::read_png(bytes, options),
        Some(FileFormat::Pfm) => pfm::read_pfm(bytes, options),
        Some(FileFormat::Hdr) => hdr::read_hdr(bytes, options),
        Some(FileFormat::Jpeg) => jpeg::read_jpeg(bytes, options),
        Some(FileFormat::Tga) => tga::read_tga(bytes, options),
        Some(FileFormat::Qoi) => qoi::read_qoi(bytes, options),
        Some(FileFormat::Bmp) => bmp::read_bmp(bytes, options),
        None => Err(ImageError::unsupported(format!(
            "{name_hint:?} is of no format known here; known are EXR, PNG, PFM, HDR, JPEG, TGA, QOI and BMP"
        ))),
    }
}

/// Reads a picture from a file; see [`read`].
pub fn read_file(path: &Path, options: &ReadOptions) -> Result<Image, ImageError> {
    let bytes = std::fs::read(path).map_err(|error| ImageError::Io { path: path.to_owned(), error })?;
    read(&bytes, &path.to_string_lossy(), options)
}

/// The bytes of a file of that format, with each format's usual settings: EXR in the image's own depth
/// with ZIP, PNG of 8 bits, JPEG of quality 92.
pub fn write(image: &Image, format: FileFormat) -> Result<Vec<u8>, ImageError> {
    match format {
        FileFormat::Exr => exr_write::write_exr(image, Compression::Zip),
        FileFormat::Png => png::write_png(image, PngDepth::Eight),
        FileFormat::Pfm => pfm::write_pfm(image),
        FileFormat::Hdr => hdr::write_hdr(image),
        FileFormat::Jpeg => jpeg::write_jpeg(image, 92),
        FileFormat::Qoi => qoi::write_qoi(image),
        FileFormat::Tga | FileFormat::Bmp => Err(ImageError::unsupported(format!("{format:?} files are only read"))),
    }
}

/// Runs a third-party decoder; a panic in it becomes an error.
pub(crate) fn guarded<T>(name: &str, decode: impl FnOnce() -> Result<T, ImageError>) -> Result<T, ImageError> {
    catch_unwind(AssertUnwindSafe(decode))
        .unwrap_or_else(|_| Err(ImageError::invalid(format!("the {name} decoder gave up on this file"))))
}

/// 8-bit codes for formats that hold nothing else: the image's own if it is stored so, else sRGB, alpha linear.
///
/// Gives the channel count as well: 1 (grey), 2 (grey, alpha), 3 or 4. More than `most` channels are reduced
/// by leaving out alpha.
pub(crate) fn codes_for_display(image: &Image, most: usize) -> Result<(Vec<u8>, usize), ImageError> {
    let picture = displayable(image, most)?;
    let count = picture.channel_count();
    let codes = match picture.pixels() {
        crate::image::Pixels::U8(codes) => codes.clone(),
        _ => {
            let colour = crate::encoding::EncoderU8::new(Encoding::Srgb);
            let linear = crate::encoding::EncoderU8::new(Encoding::Linear);
            let colours = if count % 2 == 0 { count - 1 } else { count };
            let samples = picture.to_f32();
            samples
                .iter()
                .enumerate()
                .map(
                    |(index, &value)| if index % count < colours { colour.encode(value) } else { linear.encode(value) },
                )
                .collect()
        }
    };
    Ok((codes, count))
}

/// The channels that an ordinary picture file can hold, in its order: RGBA, RGB, YA, or a lone channel.
pub(crate) fn displayable(image: &Image, most: usize) -> Result<Image, ImageError> {
    const ORDERS: [&[&str]; 4] = [&["R", "G", "B", "A"], &["R", "G", "B"], &["Y", "A"], &["Y"]];
    for names in ORDERS {
        if names.len() <= most
            && names.len() != if most == 3 { 2 } else { 0 }
            && let Some(chosen) = image.select(names)
        {
            return Ok(chosen);
        }
    }
    if image.channel_count() == 1 {
        return Ok(image.clone());
    }
    Err(ImageError::unsupported(format!("this format holds R, G, B or Y, the image has {:?}", image.channels())))
}

/// Little-endian and big-endian numbers at an offset, or an error that names the place.
pub(crate) struct Bytes<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Bytes<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    pub(crate) fn at(&self) -> usize {
        self.at
    }

    pub(crate) fn take(&mut self, count: usize) -> Result<&'a [u8], ImageError> {
        let rest = &self.bytes[self.at..];
        if count > rest.len() {
            return Err(ImageError::invalid_at(self.bytes.len(), "the file ends too early"));
        }
        self.at += count;
        Ok(&rest[..count])
    }

    pub(crate) fn u8(&mut self) -> Result<u8, ImageError> {
        Ok(self.take(1)?[0])
    }

    pub(crate) fn u16_le(&mut self) -> Result<u16, ImageError> {
        let bytes = self.take(2)?;
        Ok(u16::from_le_bytes([bytes[0], bytes[1]]))
    }

    pub(crate) fn u32_be(&mut self) -> Result<u32, ImageError> {
        let bytes = self.take(4)?;
        Ok(u32::from_be_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }

    /// The text up to the next white space, which is skipped: one byte of it.
    pub(crate) fn word(&mut self) -> Result<&'a str, ImageError> {
        let start = self.at;
        while self.at < self.bytes.len() && self.bytes[self.at].is_ascii_whitespace() {
            self.at += 1;
        }
        let from = self.at;
        while self.at < self.bytes.len() && !self.bytes[self.at].is_ascii_whitespace() && self.at - from < 64 {
            self.at += 1;
        }
        let word = &self.bytes[from..self.at];
        if word.is_empty() || self.at >= self.bytes.len() {
            return Err(ImageError::invalid_at(start, "the header ends too early"));
        }
        self.at += 1;
        std::str::from_utf8(word).map_err(|_| ImageError::invalid_at(from, "the header is not text"))
    }
}
