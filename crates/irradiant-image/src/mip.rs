//! Filtered texture lookups as pbrt-v4 makes them: point, bilinear, trilinear and elliptical (EWA).
//!
//! The pyramid is pbrt-v4's: a picture whose sides are not powers of two is enlarged to them first, every level is
//! the box-filtered one below, computed in floats and stored in the source's own format (so 8-bit levels are
//! rounded to codes). Level 0 is the finest.
//!
//! A lookup does not allocate and chooses its storage, channel layout and filter once.
//!
//! Sources: Williams 1983 (pyramids); Heckbert 1989 and Greene and Heckbert 1986 (EWA); Pharr, Jakob and
//! Humphreys, "Physically Based Rendering", 4th edition, 10.4.

use half::f16;

use crate::encoding::Encoding;
use crate::error::ImageError;
use crate::image::{Image, PixelFormat, Pixels, pack};
use crate::resize::enlarge;
pub use crate::wrap::WrapMode;
use crate::wrap::{ceil_i32, floor_i32, unfold};

/// How a lookup averages over its footprint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MipFilter {
    /// The nearest texel of the level that suits the footprint.
    Point,
    /// Four texels of the level that suits the footprint; pbrt-v4's default.
    #[default]
    Bilinear,
    /// Bilinear in the two nearest levels.
    Trilinear,
    /// A Gaussian over the ellipse of the footprint, in the two nearest levels.
    Ewa,
}

impl MipFilter {
    /// The filter that a pbrt-v4 scene calls so: "point", "bilinear", "trilinear", "EWA" or "ewa".
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "point" => Some(Self::Point),
            "bilinear" => Some(Self::Bilinear),
            "trilinear" => Some(Self::Trilinear),
            "EWA" | "ewa" => Some(Self::Ewa),
            _ => None,
        }
    }
}

/// Filter, wrap and anisotropy of a [`MipMap`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MipOptions {
    /// How footprints are averaged.
    pub filter: MipFilter,
    /// What lies outside the unit square.
    pub wrap: WrapMode,
    /// Longest over shortest axis that [`MipFilter::Ewa`] follows; thinner ellipses are widened. At least 1.
    pub max_anisotropy: f32,
}

impl Default for MipOptions {
    fn default() -> Self {
        Self { filter: MipFilter::default(), wrap: WrapMode::default(), max_anisotropy: 8.0 }
    }
}

/// A texture pyramid with 1 (grey), 3 (RGB) or 4 (RGBA) channels.
#[derive(Clone, Debug)]
pub struct MipMap {
    texels: Texels,
    levels: Vec<Level>,
    channels: usize,
    options: MipOptions,
    last_level: f32,
}

/// Sides are powers of two.
#[derive(Clone, Copy, Debug)]
struct Level {
    /// Index of its first sample.
    start: usize,
    width: i32,
    height: i32,
}

/// All levels, one after the other.
#[derive(Clone, Debug)]
enum Texels {
    U8 { codes: Vec<u8>, table: Box<[f32; 256]> },
    F16(Vec<f16>),
    F32(Vec<f32>),
}

const EWA_STEPS: usize = 128;

/// exp(-2 r^2) - exp(-2) at r^2 = i / 127: the Gaussian of EWA, brought to 0 at the ellipse's rim.
fn ewa_weights() -> &'static [f32; EWA_STEPS] {
    static WEIGHTS: std::sync::OnceLock<[f32; EWA_STEPS]> = std::sync::OnceLock::new();
    WEIGHTS.get_or_init(|| {
        std::array::from_fn(|index| {
            let r2 = index as f64 / (EWA_STEPS - 1) as f64;
            (libm::exp(-2.0 * r2) - libm::exp(-2.0)) as f32
        })
    })
}

impl MipMap {
    /// The pyramid of a picture.
    ///
    /// A lone channel is grey. Of several, R, G, B are taken and A if it is not 1 everywhere, or else Y; an error
    /// if there are neither.
    pub fn new(image: &Image, options: MipOptions) -> Result<Self, ImageError> {
        if image.width() == 0 || image.height() == 0 || image.width().max(image.height()) > 1 << 24 {
            let (width, height) = (image.width(), image.height());
            return Err(ImageError::unsupported(format!("a texture of {width} x {height} texels")));
        }
        let chosen = texture_channels(image)?;
        let source = chosen.as_ref().unwrap_or(image);
        let (width, height) = (source.width().next_power_of_two(), source.height().next_power_of_two());
        let is_enlarged = (width, height) != (source.width(), source.height());
        let finest = if !is_enlarged {
            source.to_f32()
        } else {
            match enlarge(source, width, height, options.wrap).into_pixels() {
                Pixels::F32(samples) => samples,
                Pixels::U8(_) | Pixels::F16(_) => return Err(ImageError::unsupported("enlarging gave no floats")),
            }
        };
        let channels = source.channel_count();
        let (format, encoding) = (source.format(), source.encoding());
        let mut map = Self {
            texels: Texels::empty(format, encoding),
            levels: Vec::new(),
            channels,
            options: MipOptions { max_anisotropy: options.max_anisotropy.clamp(1.0, 4096.0), ..options },
            last_level: 0.0,
        };
        let (mut samples, mut width, mut height) = (finest, width, height);
        let mut start = 0;
        loop {
            map.levels.push(Level { start, width: width as i32, height: height as i32 });
            // The picture itself needs no rounding: it took three times as long as all other levels together.
            let is_source = start == 0 && !is_enlarged;
            map.texels.append(if is_source { source.pixels().clone() } else { pack(&samples, format, encoding) });
            start += samples.len();
            if width == 1 && height == 1 {
                break;
            }
            samples = halve(&samples, width, height, channels);
            (width, height) = ((width / 2).max(1), (height / 2).max(1));
        }
        map.last_level = (map.levels.len() - 1) as f32;
        Ok(map)
    }

    /// Number of levels, at least 1.
    pub fn levels(&self) -> usize {
        self.levels.len()
    }

    /// Width and height of a level, powers of two; level 0 is the finest.
    pub fn level_size(&self, level: usize) -> (usize, usize) {
        (self.levels[level].width as usize, self.levels[level].height as usize)
    }

    /// Number of channels: 1, 3 or 4.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Whether there is alpha below 1 somewhere.
    pub fn has_alpha(&self) -> bool {
        self.channels == 4
    }

    /// Memory of the texels in bytes.
    pub fn bytes_used(&self) -> usize {
        match &self.texels {
            Texels::U8 { codes, .. } => codes.len() + 1024,
            Texels::F16(halves) => halves.len() * 2,
            Texels::F32(floats) => floats.len() * 4,
        }
    }

    /// One texel's linear value; coordinates outside are wrapped.
    ///
    /// # Panics
    /// If there is no such level or channel.
    pub fn texel(&self, level: usize, x: i32, y: i32, channel: usize) -> f32 {
        assert!(channel < self.channels);
        let Some(base) = self.texel_index(&self.levels[level], x, y) else { return 0.0 };
        match &self.texels {
            Texels::U8 { codes, table } => table[usize::from(codes[base + channel])],
            Texels::F16(halves) => halves[base + channel].to_f32(),
            Texels::F32(floats) => floats[base + channel],
        }
    }

    /// Linear R, G, B at `st`, averaged over the footprint that `dst0` and `dst1` span.
    ///
    /// (0, 0) is the picture's top left corner and (1, 1) its bottom right; the derivatives are in the same units
    /// per pixel step. Zero derivatives give the finest level, bilinear (or nearest). Coordinates must be finite.
    #[inline]
    pub fn filter_rgb(&self, st: [f32; 2], dst0: [f32; 2], dst1: [f32; 2]) -> [f32; 3] {
        match &self.texels {
            Texels::U8 { codes, table } => self.rgb(st, dst0, dst1, |index| table[usize::from(codes[index])]),
            Texels::F16(halves) => self.rgb(st, dst0, dst1, |index| float_from_half(halves[index])),
            Texels::F32(floats) => self.rgb(st, dst0, dst1, |index| floats[index]),
        }
    }

    /// A scalar at `st`, averaged over the footprint; see [`MipMap::filter_rgb`] for the coordinates.
    ///
    /// As in pbrt-v4: grey is itself, bilinear and trilinear lookups give the mean of R, G, B or, with alpha,
    /// alpha alone; point and EWA lookups and the coarsest level give R. It is the reference's choice, kept because
    /// scenes depend on it.
    #[inline]
    pub fn filter_f32(&self, st: [f32; 2], dst0: [f32; 2], dst1: [f32; 2]) -> f32 {
        match &self.texels {
            Texels::U8 { codes, table } => self.scalar(st, dst0, dst1, |index| table[usize::from(codes[index])]),
            Texels::F16(halves) => self.scalar(st, dst0, dst1, |index| float_from_half(halves[index])),
            Texels::F32(floats) => self.scalar(st, dst0, dst1, |index| floats[index]),
        }
    }

    fn rgb(&self, st: [f32; 2], dst0: [f32; 2], dst1: [f32; 2], at: impl Fn(usize) -> f32 + Copy) -> [f32; 3] {
        if self.channels == 1 {
            let grey = |base| [at(base)];
            return [self.filter(st, dst0, dst1, grey, grey)[0]; 3];
        }
        let colour = |base| [at(base), at(base + 1), at(base + 2)];
        self.filter(st, dst0, dst1, colour, colour)
    }

    fn scalar(&self, st: [f32; 2], dst0: [f32; 2], dst1: [f32; 2], at: impl Fn(usize) -> f32 + Copy) -> f32 {
        let first = |base| [at(base)];
        let [value] = match self.channels {
            1 => self.filter(st, dst0, dst1, first, first),
            4 => self.filter(st, dst0, dst1, |base| [at(base + 3)], first),
            _ => {
                let mean = |base| [(at(base) + at(base + 1) + at(base + 2)) * (1.0 / 3.0)];
                self.filter(st, dst0, dst1, mean, first)
            }
        };
        value
    }

    /// The filtered value, where `blended` reads a texel for bilinear lookups and `single` for all others.
    #[inline]
    fn filter<const N: usize>(
        &self,
        st: [f32; 2],
        dst0: [f32; 2],
        dst1: [f32; 2],
        blended: impl Fn(usize) -> [f32; N] + Copy,
        single: impl Fn(usize) -> [f32; N] + Copy,
    ) -> [f32; N] {
        if self.options.filter == MipFilter::Ewa {
            return self.ewa(st, dst0, dst1, blended, single);
        }
        // The level whose texel is as wide as the longest derivative component, twice over.
        let longest = dst0[0].abs().max(dst0[1].abs()).max(dst1[0].abs().max(dst1[1].abs()));
        let level = self.last_level + log2((2.0 * longest).max(1e-8));
        if level >= self.last_level {
            return self.coarsest(single);
        }
        let fine = floor_i32(level).max(0) as usize;
        match self.options.filter {
            MipFilter::Point => {
                let Level { width, height, .. } = self.levels[fine];
                let (x, y) = (floor_i32(st[0] * width as f32), floor_i32(st[1] * height as f32));
                self.texel_index(&self.levels[fine], x, y).map_or([0.0; N], single)
            }
            MipFilter::Bilinear => self.bilinear(fine, st, blended),
            MipFilter::Trilinear | MipFilter::Ewa => {
                if fine == 0 {
                    return self.bilinear(0, st, blended);
                }
                let towards = level - fine as f32;
                lerp(towards, self.bilinear(fine, st, blended), self.bilinear(fine + 1, st, blended))
            }
        }
    }

    fn coarsest<const N: usize>(&self, single: impl Fn(usize) -> [f32; N]) -> [f32; N] {
        single(self.levels[self.levels.len() - 1].start)
    }

    /// Index of a texel's first sample, or `None` for black. Sides are powers of two, so repeating is masking.
    #[inline]
    fn texel_index(&self, level: &Level, mut x: i32, mut y: i32) -> Option<usize> {
        let (width, height) = (level.width, level.height);
        if x as u32 >= width as u32 || y as u32 >= height as u32 {
            match self.options.wrap {
                WrapMode::Repeat => (x, y) = (x & (width - 1), y & (height - 1)),
                WrapMode::Black => return None,
                WrapMode::Clamp => (x, y) = (x.clamp(0, width - 1), y.clamp(0, height - 1)),
                WrapMode::OctahedralSphere => (x, y) = unfold(x, y, width, height),
            }
        }
        Some(level.start + (y as usize * width as usize + x as usize) * self.channels)
    }

    #[inline]
    fn bilinear<const N: usize>(&self, level: usize, st: [f32; 2], at: impl Fn(usize) -> [f32; N] + Copy) -> [f32; N] {
        let level = &self.levels[level];
        let (x, y) = (st[0] * level.width as f32 - 0.5, st[1] * level.height as f32 - 0.5);
        let (x0, y0) = (floor_i32(x), floor_i32(y));
        let (dx, dy) = (x - x0 as f32, y - y0 as f32);
        let (w00, w10, w01, w11) = ((1.0 - dx) * (1.0 - dy), dx * (1.0 - dy), (1.0 - dx) * dy, dx * dy);
        // Away from the edges the other three texels are at fixed distances.
        let inside = x0 >= 0 && y0 >= 0 && x0 < level.width - 1 && y0 < level.height - 1;
        let (v00, v10, v01, v11) = if inside {
            let row = level.width as usize * self.channels;
            let base = level.start + y0 as usize * row + x0 as usize * self.channels;
            (at(base), at(base + self.channels), at(base + row), at(base + row + self.channels))
        } else {
            let at = |x, y| self.texel_index(level, x, y).map_or([0.0; N], at);
            let (x1, y1) = (x0.wrapping_add(1), y0.wrapping_add(1));
            (at(x0, y0), at(x1, y0), at(x0, y1), at(x1, y1))
        };
        std::array::from_fn(|n| w00 * v00[n] + w10 * v10[n] + w01 * v01[n] + w11 * v11[n])
    }

    #[inline]
    fn ewa<const N: usize>(
        &self,
        st: [f32; 2],
        mut long: [f32; 2],
        mut short: [f32; 2],
        blended: impl Fn(usize) -> [f32; N] + Copy,
        single: impl Fn(usize) -> [f32; N] + Copy,
    ) -> [f32; N] {
        let length = |[x, y]: [f32; 2]| (x * x + y * y).sqrt();
        let (mut long_length, mut short_length) = (length(long), length(short));
        if long_length < short_length {
            (long, short) = (short, long);
            (long_length, short_length) = (short_length, long_length);
        }
        // Thin ellipses take many texels; blur them across instead.
        if short_length * self.options.max_anisotropy < long_length && short_length > 0.0 {
            let scale = long_length / (short_length * self.options.max_anisotropy);
            short = [short[0] * scale, short[1] * scale];
            short_length *= scale;
        }
        // NaN goes this way too.
        if !(short_length > 0.0 && long_length.is_finite()) {
            return self.bilinear(0, st, blended);
        }
        let lod = (self.last_level + log2(short_length)).max(0.0);
        if lod >= self.levels.len() as f32 {
            return self.coarsest(single);
        }
        let fine = lod as usize;
        let towards = lod - fine as f32;
        let near = self.ellipse(fine, st, long, short, single);
        // Magnified lookups stay in the finest level: half the texels.
        if towards == 0.0 {
            return near;
        }
        lerp(towards, near, self.ellipse(fine + 1, st, long, short, single))
    }

    /// The Gaussian mean over an ellipse in one level.
    fn ellipse<const N: usize>(
        &self,
        level: usize,
        st: [f32; 2],
        long: [f32; 2],
        short: [f32; 2],
        at: impl Fn(usize) -> [f32; N] + Copy,
    ) -> [f32; N] {
        let Some(level) = self.levels.get(level) else { return self.coarsest(at) };
        let (width, height) = (level.width as f32, level.height as f32);
        let (s, t) = (st[0] * width - 0.5, st[1] * height - 0.5);
        let (long, short) = ([long[0] * width, long[1] * height], [short[0] * width, short[1] * height]);

        // a x^2 + b x y + c y^2 < 1 inside, with at least a texel's radius added to both axes.
        let a = long[1] * long[1] + short[1] * short[1] + 1.0;
        let b = -2.0 * (long[0] * long[1] + short[0] * short[1]);
        let c = long[0] * long[0] + short[0] * short[0] + 1.0;
        let scale = 1.0 / (a * c - b * b * 0.25);
        let (a, b, c) = (a * scale, b * scale, c * scale);

        let half_height = 2.0 * (a / (4.0 * a * c - b * b)).max(0.0).sqrt();
        let (t0, t1) = (ceil_i32(t - half_height), floor_i32(t + half_height));
        let weights = ewa_weights();
        let half_over_a = 0.5 / a;
        let mut sum = [0.0; N];
        let mut weight_sum = 0.0;
        for y in t0..=t1 {
            let dy = y as f32 - t;
            // Only the texels of this row that the ellipse reaches; those at its rim weigh nothing.
            let (linear, constant) = (b * dy, c * dy * dy);
            let discriminant = linear * linear - 4.0 * a * (constant - 1.0);
            if discriminant < 0.0 {
                continue;
            }
            let (centre, reach) = (s - linear * half_over_a, discriminant.sqrt() * half_over_a);
            for x in ceil_i32(centre - reach)..=floor_i32(centre + reach) {
                let dx = x as f32 - s;
                let r2 = (a * dx + linear) * dx + constant;
                if r2 < 1.0 {
                    let weight = weights[((r2 * EWA_STEPS as f32) as usize).min(EWA_STEPS - 1)];
                    let value = self.texel_index(level, x, y).map_or([0.0; N], at);
                    for n in 0..N {
                        sum[n] += weight * value[n];
                    }
                    weight_sum += weight;
                }
            }
        }
        if weight_sum > 0.0 { sum.map(|value| value / weight_sum) } else { self.coarsest(at) }
    }
}

impl Texels {
    fn empty(format: PixelFormat, encoding: Encoding) -> Self {
        match format {
            PixelFormat::U8 => Self::U8 { codes: Vec::new(), table: Box::new(encoding.decode_table()) },
            PixelFormat::F16 => Self::F16(Vec::new()),
            PixelFormat::F32 => Self::F32(Vec::new()),
        }
    }

    /// `pixels` are of the storage that this was made for.
    fn append(&mut self, pixels: Pixels) {
        match (self, pixels) {
            (Self::U8 { codes, .. }, Pixels::U8(more)) => codes.extend(more),
            (Self::F16(halves), Pixels::F16(more)) => halves.extend(more),
            (Self::F32(floats), Pixels::F32(more)) => floats.extend(more),
            _ => debug_assert!(false, "levels of one pyramid share their storage"),
        }
    }
}

/// The channels that a texture uses, or `None` if they are the image's as they are.
fn texture_channels(image: &Image) -> Result<Option<Image>, ImageError> {
    if image.channel_count() == 1 {
        return Ok(None);
    }
    let colour = image.select(&["R", "G", "B"]);
    if let (Some(colour), Some(alpha)) = (&colour, image.channel_index("A")) {
        let count = image.channel_count();
        let opaque = match image.pixels() {
            Pixels::U8(codes) => codes.iter().skip(alpha).step_by(count).all(|&code| code == 255),
            Pixels::F16(halves) => halves.iter().skip(alpha).step_by(count).all(|&half| half == f16::ONE),
            Pixels::F32(floats) => floats.iter().skip(alpha).step_by(count).all(|&float| float == 1.0),
        };
        return Ok(if opaque { Some(colour.clone()) } else { image.select(&["R", "G", "B", "A"]) });
    }
    colour.or_else(|| image.select(&["Y"])).map(Some).ok_or_else(|| {
        ImageError::unsupported(format!("a texture needs channels R, G, B or Y, the image has {:?}", image.channels()))
    })
}

/// The next level: means of 2 x 2 texels, or of 2 once a side is 1.
fn halve(samples: &[f32], width: usize, height: usize, channels: usize) -> Vec<f32> {
    let (new_width, new_height) = ((width / 2).max(1), (height / 2).max(1));
    let right = if width == 1 { 0 } else { channels };
    let below = if height == 1 { 0 } else { width * channels };
    let mut coarse = Vec::with_capacity(new_width * new_height * channels);
    for y in 0..new_height {
        for x in 0..new_width {
            let base = (2 * y * width + 2 * x) * channels;
            for channel in base..base + channels {
                let sum = samples[channel]
                    + samples[channel + right]
                    + samples[channel + below]
                    + samples[channel + right + below];
                coarse.push(0.25 * sum);
            }
        }
    }
    coarse
}

#[inline]
fn lerp<const N: usize>(towards: f32, from: [f32; N], to: [f32; N]) -> [f32; N] {
    std::array::from_fn(|n| (1.0 - towards) * from[n] + towards * to[n])
}

/// Base-2 logarithm of a positive normal number, to 1e-6 absolutely; the same bits everywhere, a handful of operations.
#[inline]
fn log2(value: f32) -> f32 {
    // The mantissa in [1/sqrt 2, sqrt 2) and log2 m = 2 / ln 2 atanh((m - 1) / (m + 1)).
    let bits = value.to_bits().wrapping_sub(0x3f35_04f3);
    let exponent = (bits as i32) >> 23;
    let mantissa = f32::from_bits((bits & 0x007f_ffff).wrapping_add(0x3f35_04f3));
    let q = (mantissa - 1.0) / (mantissa + 1.0);
    let q2 = q * q;
    let series = 2.885_390_1 + q2 * (0.961_796_7 + q2 * (0.577_078 + q2 * 0.412_198_6));
    exponent as f32 + q * series
}

/// A half as a float, exactly: the exponent is shifted into place by a product, which also handles denormals.
#[inline]
fn float_from_half(half: f16) -> f32 {
    let bits = u32::from(half.to_bits());
    // 2^112, the difference of the exponents' biases.
    let magnitude = f32::from_bits((bits & 0x7fff) << 13) * f32::from_bits(0x7780_0000);
    let magnitude = if bits & 0x7c00 == 0x7c00 { f32::from_bits(magnitude.to_bits() | 0x7f80_0000) } else { magnitude };
    f32::from_bits(magnitude.to_bits() | (bits & 0x8000) << 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(width: usize, height: usize) -> Image {
        Image::from_fn(width, height, ["R", "G", "B"], |x, y| {
            let mix = (x * 7919 + y * 104_729 + x * y * 31) % 997;
            [mix as f32 / 997.0, ((mix * 13) % 997) as f32 / 997.0, 0.25]
        })
    }

    fn map(image: &Image, filter: MipFilter, wrap: WrapMode) -> MipMap {
        MipMap::new(image, MipOptions { filter, wrap, ..MipOptions::default() }).unwrap()
    }

    const FILTERS: [MipFilter; 4] = [MipFilter::Point, MipFilter::Bilinear, MipFilter::Trilinear, MipFilter::Ewa];

    #[test]
    fn levels_keep_the_mean() {
        for (width, height) in [(64, 64), (128, 4), (1, 32), (1, 1)] {
            let image = noise(width, height);
            let map = map(&image, MipFilter::Bilinear, WrapMode::Repeat);
            let mean = image.average();
            for level in 0..map.levels() {
                let (w, h) = map.level_size(level);
                for channel in 0..3 {
                    let texels =
                        (0..w * h).map(|i| f64::from(map.texel(level, (i % w) as i32, (i / w) as i32, channel)));
                    assert!((texels.sum::<f64>() / (w * h) as f64 - mean[channel]).abs() < 1e-6);
                }
            }
            assert_eq!(map.level_size(map.levels() - 1), (1, 1));
        }
    }

    #[test]
    fn odd_sizes_become_powers_of_two_of_nearly_the_same_mean() {
        // Lanczos clamps at 0 and weighs edges unevenly when clamped; repeated it keeps the mean to a percent or so.
        let image = noise(100, 37);
        let map = map(&image, MipFilter::Bilinear, WrapMode::Repeat);
        assert_eq!((map.level_size(0), map.levels()), ((128, 64), 8));
        for (channel, mean) in image.average().iter().enumerate() {
            assert!((f64::from(map.texel(7, 0, 0, channel)) / mean - 1.0).abs() < 0.01);
        }
        let flat = Image::from_u8(5, 3, &["Y"], vec![77; 15], Encoding::Srgb).unwrap();
        for wrap in [WrapMode::Repeat, WrapMode::Clamp, WrapMode::OctahedralSphere] {
            let map = MipMap::new(&flat, MipOptions { wrap, ..MipOptions::default() }).unwrap();
            for level in 0..map.levels() {
                assert_eq!(map.texel(level, 0, 0, 0), Encoding::Srgb.decode_u8(77));
            }
        }
    }

    #[test]
    fn constants_stay_constant_in_every_filter_and_storage() {
        let image = Image::from_fn(16, 32, ["R", "G", "B"], |_, _| [0.25, 0.5, 1.0]);
        for filter in FILTERS {
            for format in [PixelFormat::U8, PixelFormat::F16, PixelFormat::F32] {
                let stored = image.convert(format, Encoding::Linear);
                let map = map(&stored, filter, WrapMode::Repeat);
                for step in 0..200 {
                    let x = step as f32;
                    let st = [x * 0.173 - 9.0, x * 0.091 + 3.0];
                    let d0 = [0.001 * x * x.sqrt() * 0.01, 0.0003 * x];
                    let rgb = map.filter_rgb(st, d0, [-0.0002 * x, 0.01]);
                    for (found, expected) in rgb.iter().zip([stored.get(0, 0, 0), stored.get(0, 0, 1), 1.0]) {
                        assert!((found - expected).abs() < 1e-6, "{filter:?} {format:?} {step} {rgb:?}");
                    }
                }
            }
        }
    }

    /// What a filter finds, averaged over all positions, is the picture's mean: no level or ellipse loses energy.
    ///
    /// 200 x 200 stratified positions of a periodic picture; a bias of 0.2 % fails. Deterministic.
    #[test]
    fn filters_keep_the_mean_of_a_periodic_picture() {
        let image = noise(64, 64);
        let mean = image.average();
        for filter in FILTERS {
            let map = map(&image, filter, WrapMode::Repeat);
            for (d0, d1) in [([0.0; 2], [0.0; 2]), ([0.02, 0.0], [0.0, 0.03]), ([0.05, 0.02], [-0.004, 0.01])] {
                let mut sums = [0.0f64; 3];
                for i in 0..40_000 {
                    let st = [((i % 200) as f32 + 0.5) / 200.0, ((i / 200) as f32 + 0.5) / 200.0];
                    for (sum, value) in sums.iter_mut().zip(map.filter_rgb(st, d0, d1)) {
                        *sum += f64::from(value) / 40_000.0;
                    }
                }
                for (sum, mean) in sums.iter().zip(&mean) {
                    assert!((sum / mean - 1.0).abs() < 2e-3, "{filter:?} {d0:?}: {sum} {mean}");
                }
            }
        }
    }

    /// Level and blend, from pbrt-v4's formulas by hand.
    #[test]
    fn levels_are_chosen_by_the_footprint() {
        // Each level of a ramp along x is a ramp; its texels tell which level was read.
        let image = Image::from_fn(256, 256, ["Y"], |x, _| [(x % 2) as f32]);
        let point = map(&image, MipFilter::Point, WrapMode::Clamp);
        // 2 x 1/512 = 1/256: level 8 - 8 = 0, where odd texels are 1; twice as wide: level 1, all 1/2.
        let st = [3.5 / 256.0, 0.5];
        assert_eq!(point.filter_f32(st, [1.0 / 512.0, 0.0], [0.0, 0.0]), 1.0);
        assert_eq!(point.filter_f32(st, [1.01 / 256.0, 0.0], [0.0, 0.0]), 0.5);
        // Half way in log2 between levels 0 and 1 trilinear stays in level 0, as pbrt-v4 does.
        let trilinear = map(&image, MipFilter::Trilinear, WrapMode::Clamp);
        assert_eq!(trilinear.filter_f32(st, [1.4 / 512.0, 0.0], [0.0, 0.0]), 1.0);
        let steps = Image::from_fn(256, 256, ["Y"], |x, _| [if x / 2 % 2 == 1 { 1.0 } else { 0.0 }]);
        let trilinear = map(&steps, MipFilter::Trilinear, WrapMode::Clamp);
        // Between levels 1 (1 at this texel's centre) and 2 (1/2): sqrt 2 wider than level 1 blends half and half.
        let found = trilinear.filter_f32([3.0 / 256.0, 0.5], [2f32.sqrt() / 256.0, 0.0], [0.0, 0.0]);
        assert!((found - 0.75).abs() < 1e-5, "{found}");
    }

    /// The row-wise ellipse against the definition: every texel of a generous box, weighed by the quadratic form.
    #[test]
    fn ewa_is_its_definition() {
        let image = noise(64, 64);
        let map = map(&image, MipFilter::Ewa, WrapMode::Repeat);
        for step in 0..300 {
            let x = step as f32;
            let st = [x * 0.0137 % 1.0, x * 0.0711 % 1.0];
            let angle = x * 0.1;
            let (long, short) = (0.02 + 0.0002 * x, 0.016 + 0.00005 * x);
            let d0 = [long * angle.cos(), long * angle.sin()];
            let d1 = [-short * angle.sin(), short * angle.cos()];
            for level in 0..3 {
                let found = map.ellipse(level, st, d0, d1, |base| match &map.texels {
                    Texels::F32(floats) => [floats[base]],
                    _ => panic!("floats expected"),
                });
                let size = f64::from(map.levels[level].width);
                let scaled = |d: [f32; 2]| [f64::from(d[0]) * size, f64::from(d[1]) * size];
                let (p, q) = (scaled(d0), scaled(d1));
                let (a, b, c) = (
                    p[1] * p[1] + q[1] * q[1] + 1.0,
                    -2.0 * (p[0] * p[1] + q[0] * q[1]),
                    p[0] * p[0] + q[0] * q[0] + 1.0,
                );
                let f = a * c - b * b / 4.0;
                let (s, t) = (f64::from(st[0]) * size - 0.5, f64::from(st[1]) * size - 0.5);
                let (mut sum, mut weights) = (0.0, 0.0);
                for y in (t as i32 - 12)..(t as i32 + 13) {
                    for x in (s as i32 - 12)..(s as i32 + 13) {
                        let (dx, dy) = (f64::from(x) - s, f64::from(y) - t);
                        let r2 = (a * dx * dx + b * dx * dy + c * dy * dy) / f;
                        if r2 < 1.0 {
                            let bucket = (r2 * 128.0).floor().min(127.0) / 127.0;
                            let weight = libm::exp(-2.0 * bucket) - libm::exp(-2.0);
                            sum += weight * f64::from(map.texel(level, x, y, 0));
                            weights += weight;
                        }
                    }
                }
                // A texel may fall on the other side of a bucket's border: 1.8 % of its weight.
                assert!(
                    (f64::from(found[0]) - sum / weights).abs() < 2e-3,
                    "{step} {level}: {} {}",
                    found[0],
                    sum / weights
                );
            }
        }
    }

    #[test]
    fn wraps_reach_the_filters() {
        let image = Image::from_fn(4, 4, ["Y"], |x, _| [x as f32]);
        let at = |wrap, s| map(&image, MipFilter::Bilinear, wrap).filter_f32([s, 0.5], [0.0; 2], [0.0; 2]);
        assert_eq!(at(WrapMode::Repeat, 0.0), 1.5);
        assert_eq!(at(WrapMode::Clamp, -7.0), 0.0);
        assert_eq!(at(WrapMode::Black, 1.0), 1.5);
        assert_eq!(at(WrapMode::Black, 2.0), 0.0);
        assert_eq!(at(WrapMode::Repeat, 5.0), 1.5);
    }

    #[test]
    fn scalars_are_means_or_alpha() {
        let rgb = Image::from_fn(2, 2, ["R", "G", "B"], |_, _| [0.3, 0.6, 0.0]);
        assert!(
            (map(&rgb, MipFilter::Bilinear, WrapMode::Repeat).filter_f32([0.3; 2], [0.0; 2], [0.0; 2]) - 0.3).abs()
                < 1e-7
        );
        let rgba = Image::from_fn(2, 2, ["R", "G", "B", "A"], |x, _| [0.1, 0.2, 0.3, x as f32]);
        let alpha = map(&rgba, MipFilter::Bilinear, WrapMode::Clamp);
        assert!(alpha.has_alpha());
        assert_eq!(alpha.filter_f32([0.9, 0.5], [0.0; 2], [0.0; 2]), 1.0);
        let opaque = Image::from_fn(2, 2, ["A", "B", "G", "R"], |_, _| [1.0, 0.3, 0.2, 0.1]);
        let opaque = map(&opaque, MipFilter::Bilinear, WrapMode::Clamp);
        assert_eq!((opaque.channels(), opaque.filter_rgb([0.5; 2], [0.0; 2], [0.0; 2])), (3, [0.1, 0.2, 0.3]));
        let other = Image::from_fn(2, 2, ["U", "V"], |_, _| [1.0, 0.3]);
        assert!(MipMap::new(&other, MipOptions::default()).is_err());
    }

    #[test]
    fn nonsense_neither_hangs_nor_panics() {
        let image = noise(16, 16);
        let values = [0.0, -0.0, 1e-40, 1.0, -1e9, 1e30, f32::MAX, f32::INFINITY, f32::NAN];
        for wrap in [WrapMode::Repeat, WrapMode::Black, WrapMode::Clamp, WrapMode::OctahedralSphere] {
            for filter in FILTERS {
                let map = map(&image, filter, wrap);
                for &a in &values {
                    for &b in &values {
                        map.filter_rgb([a, b], [b, a], [0.0, 1e-3]);
                        map.filter_rgb([0.5, a], [b, 0.1], [a, 1e-3]);
                        map.filter_f32([0.5, 0.25], [a, a], [b, 1e-3]);
                    }
                }
            }
        }
    }

    #[test]
    fn halves_and_logarithms_are_exact_enough() {
        for bits in 0..=u16::MAX {
            let half = f16::from_bits(bits);
            let (found, expected) = (float_from_half(half), half.to_f32());
            assert!(found == expected || found.is_nan() && expected.is_nan(), "{bits:x}");
        }
        for step in 1..20_000 {
            let value = 1e-8 * libm::exp2(f64::from(step) * 0.002) as f32;
            assert!((f64::from(log2(value)) - libm::log2(f64::from(value))).abs() < 2e-6, "{value}");
        }
        assert_eq!((log2(1.0), log2(0.25), log2(1024.0)), (0.0, -2.0, 10.0));
    }
}
