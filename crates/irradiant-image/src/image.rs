//! A rectangle of pixels with named channels.
//!
//! Pixels are interleaved, row by row from the top. 8-bit storage carries an [`Encoding`] that
//! applies to all channels alike (alpha too, as in pbrt-v4); half and float storage is linear.
//! Textures are many, so a file's 8 and 16 bits stay 8 and 16 bits in memory.

use half::f16;
use half::slice::HalfFloatSliceExt;

use crate::encoding::{EncoderU8, Encoding};
use crate::error::ImageError;
use crate::metadata::Metadata;

/// How one sample is kept in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelFormat {
    /// 8-bit code values.
    U8,
    /// IEEE half floats, linear.
    F16,
    /// IEEE single floats, linear.
    F32,
}

impl PixelFormat {
    /// Bytes of one sample.
    pub const fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::F16 => 2,
            Self::F32 => 4,
        }
    }
}

/// The samples of an image: interleaved channels, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// 8-bit code values.
    U8(Vec<u8>),
    /// IEEE half floats, linear.
    F16(Vec<f16>),
    /// IEEE single floats, linear.
    F32(Vec<f32>),
}

impl Pixels {
    /// Number of samples (pixels times channels).
    pub fn len(&self) -> usize {
        match self {
            Self::U8(samples) => samples.len(),
            Self::F16(samples) => samples.len(),
            Self::F32(samples) => samples.len(),
        }
    }

    /// Whether there is no sample at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How one sample is kept.
    pub fn format(&self) -> PixelFormat {
        match self {
            Self::U8(_) => PixelFormat::U8,
            Self::F16(_) => PixelFormat::F16,
            Self::F32(_) => PixelFormat::F32,
        }
    }

    fn zeros(format: PixelFormat, count: usize) -> Self {
        match format {
            PixelFormat::U8 => Self::U8(vec![0; count]),
            PixelFormat::F16 => Self::F16(vec![f16::ZERO; count]),
            PixelFormat::F32 => Self::F32(vec![0.0; count]),
        }
    }
}

/// A rectangle of pixels with named channels; (0, 0) is the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    channels: Vec<String>,
    pixels: Pixels,
    encoding: Encoding,
    /// What the file said beside the pixels.
    pub metadata: Metadata,
}

impl Image {
    /// A black float image.
    ///
    /// # Panics
    /// If the sample count overflows `usize` or memory runs out; sizes from files are checked by the readers.
    pub fn new(width: usize, height: usize, channels: &[&str]) -> Self {
        Self::zeros(PixelFormat::F32, Encoding::Linear, width, height, &owned(channels))
    }

    pub(crate) fn zeros(
        format: PixelFormat,
        encoding: Encoding,
        width: usize,
        height: usize,
        channels: &[String],
    ) -> Self {
        let count = width.checked_mul(height).and_then(|pixels| pixels.checked_mul(channels.len()));
        let pixels = Pixels::zeros(format, count.expect("sample count overflows"));
        Self { width, height, channels: channels.to_vec(), pixels, encoding, metadata: Metadata::default() }
    }

    /// An image of given samples: interleaved channels, rows from the top.
    ///
    /// `encoding` is what 8-bit codes stand for and is ignored (set to linear) for floats.
    /// An error if the count does not match, there is no channel, or a name occurs twice.
    pub fn from_pixels(
        width: usize,
        height: usize,
        channels: Vec<String>,
        pixels: Pixels,
        encoding: Encoding,
    ) -> Result<Self, ImageError> {
        let count = width.checked_mul(height).and_then(|pixels| pixels.checked_mul(channels.len()));
        if channels.is_empty() || count != Some(pixels.len()) {
            let (found, count) = (pixels.len(), channels.len());
            return Err(ImageError::invalid(format!(
                "{found} samples do not fill {width} x {height} pixels of {count} channels"
            )));
        }
        for (index, name) in channels.iter().enumerate() {
            if channels[..index].contains(name) {
                return Err(ImageError::invalid(format!("channel {name:?} occurs twice")));
            }
        }
        let encoding = if pixels.format() == PixelFormat::U8 { encoding } else { Encoding::Linear };
        Ok(Self { width, height, channels, pixels, encoding, metadata: Metadata::default() })
    }

    /// A float image of given samples; see [`Image::from_pixels`].
    pub fn from_f32(width: usize, height: usize, channels: &[&str], samples: Vec<f32>) -> Result<Self, ImageError> {
        Self::from_pixels(width, height, owned(channels), Pixels::F32(samples), Encoding::Linear)
    }

    /// An 8-bit image of given codes; see [`Image::from_pixels`].
    pub fn from_u8(
        width: usize,
        height: usize,
        channels: &[&str],
        codes: Vec<u8>,
        encoding: Encoding,
    ) -> Result<Self, ImageError> {
        Self::from_pixels(width, height, owned(channels), Pixels::U8(codes), encoding)
    }

    /// A float image whose pixel (x, y) is `f(x, y)`.
    pub fn from_fn<const N: usize>(
        width: usize,
        height: usize,
        channels: [&str; N],
        mut f: impl FnMut(usize, usize) -> [f32; N],
    ) -> Self {
        let mut image = Self::new(width, height, &channels);
        if let Pixels::F32(samples) = &mut image.pixels {
            for (index, pixel) in samples.chunks_exact_mut(N).enumerate() {
                pixel.copy_from_slice(&f(index % width, index / width));
            }
        }
        image
    }

    /// Pixels in a row.
    #[inline]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of rows.
    #[inline]
    pub fn height(&self) -> usize {
        self.height
    }

    /// Names of the channels in storage order.
    #[inline]
    pub fn channels(&self) -> &[String] {
        &self.channels
    }

    /// Number of channels, at least 1.
    #[inline]
    pub fn channel_count(&self) -> usize {
        self.channels.len()
    }

    pub(crate) fn pixels_mut(&mut self) -> &mut Pixels {
        &mut self.pixels
    }

    /// The samples as they are stored.
    #[inline]
    pub fn pixels(&self) -> &Pixels {
        &self.pixels
    }

    /// The stored samples, taken out.
    pub fn into_pixels(self) -> Pixels {
        self.pixels
    }

    /// How one sample is kept.
    pub fn format(&self) -> PixelFormat {
        self.pixels.format()
    }

    /// What 8-bit codes stand for; [`Encoding::Linear`] for float storage.
    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// Says anew what the 8-bit codes stand for; without effect on float storage.
    pub fn set_encoding(&mut self, encoding: Encoding) {
        if self.format() == PixelFormat::U8 {
            self.encoding = encoding;
        }
    }

    /// Memory of the samples in bytes.
    pub fn bytes_used(&self) -> usize {
        self.pixels.len() * self.format().bytes()
    }

    /// The index of a channel of that name.
    pub fn channel_index(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|channel| channel == name)
    }

    #[inline]
    fn index(&self, x: usize, y: usize, channel: usize) -> usize {
        assert!(x < self.width && channel < self.channels.len(), "pixel ({x}, {y}), channel {channel} is outside");
        (y * self.width + x) * self.channels.len() + channel
    }

    /// The linear value of one sample.
    ///
    /// # Panics
    /// If the pixel or channel is outside.
    #[inline]
    pub fn get(&self, x: usize, y: usize, channel: usize) -> f32 {
        let index = self.index(x, y, channel);
        match &self.pixels {
            Pixels::U8(codes) => self.encoding.decode_u8(codes[index]),
            Pixels::F16(samples) => samples[index].to_f32(),
            Pixels::F32(samples) => samples[index],
        }
    }

    /// Stores a linear value, rounded to the nearest that the storage can hold.
    ///
    /// # Panics
    /// If the pixel or channel is outside.
    pub fn set(&mut self, x: usize, y: usize, channel: usize, value: f32) {
        let index = self.index(x, y, channel);
        let encoding = self.encoding;
        match &mut self.pixels {
            Pixels::U8(codes) => codes[index] = (encoding.encode(value.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8,
            Pixels::F16(samples) => samples[index] = f16::from_f32(value),
            Pixels::F32(samples) => samples[index] = value,
        }
    }

    /// All samples as linear floats: interleaved channels, rows from the top.
    pub fn to_f32(&self) -> Vec<f32> {
        match &self.pixels {
            Pixels::U8(codes) => {
                let table = self.encoding.decode_table();
                codes.iter().map(|&code| table[usize::from(code)]).collect()
            }
            Pixels::F16(samples) => {
                let mut floats = vec![0.0; samples.len()];
                samples.convert_to_f32_slice(&mut floats);
                floats
            }
            Pixels::F32(samples) => samples.clone(),
        }
    }

    /// The samples of a float image, without a copy; `None` for other storage.
    pub fn as_f32(&self) -> Option<&[f32]> {
        match &self.pixels {
            Pixels::F32(samples) => Some(samples),
            Pixels::U8(_) | Pixels::F16(_) => None,
        }
    }

    /// The samples of a float image, to change; `None` for other storage.
    pub fn as_f32_mut(&mut self) -> Option<&mut [f32]> {
        match &mut self.pixels {
            Pixels::F32(samples) => Some(samples),
            Pixels::U8(_) | Pixels::F16(_) => None,
        }
    }

    /// The same picture in another storage; 8-bit storage clamps to [0, 1] and takes `encoding`.
    pub fn convert(&self, format: PixelFormat, encoding: Encoding) -> Self {
        if format == self.format() && (format != PixelFormat::U8 || encoding == self.encoding) {
            return self.clone();
        }
        self.with_samples(self.width, self.height, &self.to_f32(), format, encoding)
    }

    /// An image of this one's channels and metadata from linear floats.
    pub(crate) fn with_samples(
        &self,
        width: usize,
        height: usize,
        samples: &[f32],
        format: PixelFormat,
        encoding: Encoding,
    ) -> Self {
        assert_eq!(samples.len(), width * height * self.channels.len());
        let encoding = if format == PixelFormat::U8 { encoding } else { Encoding::Linear };
        Self {
            width,
            height,
            channels: self.channels.clone(),
            pixels: pack(samples, format, encoding),
            encoding,
            metadata: self.metadata.clone(),
        }
    }

    /// The channels of those names in that order, or `None` if one is missing.
    pub fn select(&self, names: &[&str]) -> Option<Self> {
        let indices: Vec<usize> = names.iter().map(|name| self.channel_index(name)).collect::<Option<_>>()?;
        if indices.is_empty() {
            return None;
        }
        let count = self.channels.len();
        let pixels = match &self.pixels {
            Pixels::U8(samples) => Pixels::U8(pick(samples, count, &indices)),
            Pixels::F16(samples) => Pixels::F16(pick(samples, count, &indices)),
            Pixels::F32(samples) => Pixels::F32(pick(samples, count, &indices)),
        };
        Some(Self { channels: owned(names), pixels, metadata: self.metadata.clone(), ..*self })
    }

    /// The channels "R", "G" and "B", or a single channel (grey) three times; `None` if there are neither.
    pub fn to_rgb(&self) -> Option<Self> {
        if let Some(rgb) = self.select(&["R", "G", "B"]) {
            return Some(rgb);
        }
        let grey = match self.channel_index("Y") {
            Some(_) => "Y",
            None if self.channels.len() == 1 => &self.channels[0],
            None => return None,
        };
        let mut tripled = self.select(&[grey, grey, grey])?;
        tripled.channels = owned(&["R", "G", "B"]);
        Some(tripled)
    }

    /// The part of `width` x `height` pixels whose top left is (x, y), or `None` if it reaches outside.
    pub fn crop(&self, x: usize, y: usize, width: usize, height: usize) -> Option<Self> {
        if x.checked_add(width)? > self.width || y.checked_add(height)? > self.height {
            return None;
        }
        let count = self.channels.len();
        let rows = (y..y + height).map(|row| {
            let start = (row * self.width + x) * count;
            start..start + width * count
        });
        let pixels = match &self.pixels {
            Pixels::U8(samples) => Pixels::U8(rows.flat_map(|row| samples[row].iter().copied()).collect()),
            Pixels::F16(samples) => Pixels::F16(rows.flat_map(|row| samples[row].iter().copied()).collect()),
            Pixels::F32(samples) => Pixels::F32(rows.flat_map(|row| samples[row].iter().copied()).collect()),
        };
        let mut metadata = self.metadata.clone();
        let [x0, y0] = self.metadata.origin;
        metadata.display_window.get_or_insert([
            x0,
            y0,
            x0.saturating_add_unsigned(self.width as u32),
            y0.saturating_add_unsigned(self.height as u32),
        ]);
        metadata.origin = [x0.saturating_add_unsigned(x as u32), y0.saturating_add_unsigned(y as u32)];
        Some(Self { width, height, channels: self.channels.clone(), pixels, metadata, ..*self })
    }

    /// Turns the picture upside down.
    pub fn flip_y(&mut self) {
        let row = self.width * self.channels.len();
        match &mut self.pixels {
            Pixels::U8(samples) => flip_rows(samples, row),
            Pixels::F16(samples) => flip_rows(samples, row),
            Pixels::F32(samples) => flip_rows(samples, row),
        }
    }

    /// Mirrors the picture left to right.
    pub fn flip_x(&mut self) {
        let (width, count) = (self.width, self.channels.len());
        match &mut self.pixels {
            Pixels::U8(samples) => mirror_rows(samples, width, count),
            Pixels::F16(samples) => mirror_rows(samples, width, count),
            Pixels::F32(samples) => mirror_rows(samples, width, count),
        }
    }

    /// The mean of each channel over all pixels, in linear light; empty images give NaN.
    pub fn average(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.channels.len()];
        let samples = self.to_f32();
        for pixel in samples.chunks_exact(self.channels.len()) {
            for (sum, &value) in sums.iter_mut().zip(pixel) {
                *sum += f64::from(value);
            }
        }
        let pixels = (self.width * self.height) as f64;
        sums.iter().map(|sum| sum / pixels).collect()
    }
}

/// Linear floats in the given storage.
pub(crate) fn pack(samples: &[f32], format: PixelFormat, encoding: Encoding) -> Pixels {
    match format {
        PixelFormat::U8 => {
            let encoder = EncoderU8::new(encoding);
            Pixels::U8(samples.iter().map(|&value| encoder.encode(value)).collect())
        }
        PixelFormat::F16 => {
            let mut halves = vec![f16::ZERO; samples.len()];
            halves.convert_from_f32_slice(samples);
            Pixels::F16(halves)
        }
        PixelFormat::F32 => Pixels::F32(samples.to_vec()),
    }
}

pub(crate) fn owned(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}

fn pick<T: Copy>(samples: &[T], count: usize, indices: &[usize]) -> Vec<T> {
    if indices.iter().copied().eq(0..count) {
        return samples.to_vec();
    }
    let mut picked = Vec::with_capacity(samples.len() / count * indices.len());
    if let &[r, g, b] = indices {
        for pixel in samples.chunks_exact(count) {
            picked.extend_from_slice(&[pixel[r], pixel[g], pixel[b]]);
        }
    } else {
        for pixel in samples.chunks_exact(count) {
            picked.extend(indices.iter().map(|&index| pixel[index]));
        }
    }
    picked
}

fn flip_rows<T>(samples: &mut [T], row: usize) {
    if row == 0 {
        return;
    }
    let height = samples.len() / row;
    for y in 0..height / 2 {
        let (upper, lower) = samples.split_at_mut((height - 1 - y) * row);
        upper[y * row..(y + 1) * row].swap_with_slice(&mut lower[..row]);
    }
}

fn mirror_rows<T>(samples: &mut [T], width: usize, count: usize) {
    if width == 0 {
        return;
    }
    for row in samples.chunks_exact_mut(width * count) {
        for x in 0..width / 2 {
            for channel in 0..count {
                row.swap(x * count + channel, (width - 1 - x) * count + channel);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient() -> Image {
        Image::from_fn(5, 3, ["R", "G", "B"], |x, y| [x as f32, y as f32, (x * y) as f32 / 8.0])
    }

    #[test]
    fn channels_are_found_by_name() {
        let image = gradient();
        let swapped = image.select(&["B", "R"]).unwrap();
        assert_eq!(swapped.channels(), ["B", "R"]);
        assert_eq!(swapped.get(4, 2, 0), 1.0);
        assert_eq!(swapped.get(4, 2, 1), 4.0);
        assert!(image.select(&["Z"]).is_none());
        let grey = image.select(&["G"]).unwrap().to_rgb().unwrap();
        assert_eq!((grey.get(0, 2, 0), grey.get(0, 2, 2)), (2.0, 2.0));
    }

    #[test]
    fn flipping_twice_is_nothing() {
        let image = gradient();
        let mut flipped = image.clone();
        flipped.flip_y();
        assert_eq!(flipped.get(3, 0, 1), 2.0);
        flipped.flip_x();
        assert_eq!(flipped.get(0, 0, 0), 4.0);
        flipped.flip_y();
        flipped.flip_x();
        assert_eq!(flipped, image);
    }

    #[test]
    fn a_crop_knows_where_it_was() {
        let part = gradient().crop(1, 2, 3, 1).unwrap();
        assert_eq!((part.width(), part.height(), part.get(2, 0, 0)), (3, 1, 3.0));
        assert_eq!(part.metadata.origin, [1, 2]);
        assert_eq!(part.metadata.display_window, Some([0, 0, 5, 3]));
        assert!(gradient().crop(3, 0, 3, 1).is_none());
        assert!(gradient().crop(usize::MAX, 0, 2, 1).is_none());
    }

    #[test]
    fn storage_rounds_to_nearest() {
        let image = Image::from_fn(256, 1, ["Y"], |x, _| [x as f32 / 255.0]);
        for encoding in [Encoding::Linear, Encoding::Srgb] {
            let small = image.convert(PixelFormat::U8, encoding);
            assert_eq!(small.bytes_used(), 256);
            for x in 0..256 {
                let mut one = small.clone();
                one.set(x, 0, 0, image.get(x, 0, 0));
                assert_eq!(one, small, "set and convert agree at {x}");
                let error = (encoding.encode(small.get(x, 0, 0)) - encoding.encode(image.get(x, 0, 0))).abs();
                assert!(error <= 0.501 / 255.0);
            }
        }
        let halves = image.convert(PixelFormat::F16, Encoding::Linear);
        assert!((halves.get(100, 0, 0) - 100.0 / 255.0).abs() < 2.5e-4);
    }

    #[test]
    fn sizes_must_match() {
        assert!(Image::from_f32(2, 2, &["R"], vec![0.0; 3]).is_err());
        assert!(Image::from_f32(usize::MAX, 2, &["R"], vec![0.0; 3]).is_err());
        assert!(Image::from_f32(1, 1, &["R", "R"], vec![0.0; 2]).is_err());
        assert!(Image::from_f32(1, 1, &[], vec![]).is_err());
    }

    #[test]
    fn averages_are_linear_light() {
        let image = Image::from_u8(2, 1, &["Y"], vec![0, 255], Encoding::Srgb).unwrap();
        assert_eq!(image.average(), [0.5]);
    }
}
