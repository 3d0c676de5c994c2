//! What lights shine with: spectra tabulated once, and images of RGB that become spectra at each look-up.

use irradiant_image::Image;
use irradiant_math::Point2;
use irradiant_spectrum::{Basis, ColorSpace, LAMBDA_MIN, RgbIlluminant, SampledSpectrum, Spectrum, Wavelengths};
use std::sync::Arc;

const TABLE_LENGTH: usize = 471;

/// An emitted spectrum at 1 nm with its scale multiplied in, ready in both bases; cloning shares the table.
///
/// Read at the nearest nanometre, as pbrt-v4's lights are.
#[derive(Clone, Debug)]
pub struct Emission(Arc<EmissionTable>);

#[derive(Debug)]
struct EmissionTable {
    /// Per nanometre from 360 to 830.
    values: [f32; TABLE_LENGTH],
    /// In the render's RGB.
    rgb: [f32; 3],
    max: f32,
}

impl Emission {
    /// `scale` times `spectrum`, whose RGB lanes are to be those of `space`.
    pub fn new(spectrum: &Spectrum, scale: f32, space: &'static ColorSpace) -> Self {
        let values = std::array::from_fn(|i| scale * spectrum.eval(LAMBDA_MIN + i as f32));
        let rgb = spectrum.in_space(space).to_rgb().map(|v| v * scale);
        let max = values.iter().copied().fold(0.0, f32::max);
        Self(Arc::new(EmissionTable { values, rgb, max }))
    }

    /// The value in each lane of `lambda`.
    #[inline]
    pub fn sample(&self, lambda: &Wavelengths) -> SampledSpectrum {
        match lambda.basis {
            Basis::Spectral => SampledSpectrum::new(lambda.lambda.map(|nm| {
                // Through 16 bits: 7 instructions a lane; straight to 64 it was 15.
                let i = usize::from((nm - (LAMBDA_MIN - 0.5)) as u16);
                if i < TABLE_LENGTH { self.0.values[i] } else { 0.0 }
            })),
            Basis::Rgb => rgb_lanes(self.0.rgb),
        }
    }

    /// The greatest value at any wavelength.
    pub fn max_value(&self) -> f32 {
        self.0.max
    }
}

#[inline]
fn rgb_lanes(rgb: [f32; 3]) -> SampledSpectrum {
    SampledSpectrum::new([rgb[0], rgb[1], rgb[2], rgb[1]])
}

/// What was amiss in an image, and replaced by 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImageFaults {
    /// Pixels with a component that is infinite or not a number.
    pub not_finite: usize,
    /// Pixels with a negative component (and none that is not finite).
    pub negative: usize,
    /// The first such pixel: column, row from the top.
    pub first: Option<[usize; 2]>,
}

/// An image of radiance (or intensity) in RGB; components are finite and not negative.
///
/// Rows run from the top; (0, 0) is the image's top left corner.
#[derive(Clone, Debug)]
pub struct RadianceImage {
    width: usize,
    height: usize,
    pixels: Pixels,
    space: &'static ColorSpace,
    /// To the render's RGB, when that is another space than the image's.
    to_render: Option<[[f32; 3]; 3]>,
}

/// Colours, finite and not negative, in as few bytes as keep them exactly: looking up a sky is waiting for its memory.
#[derive(Clone, Debug)]
enum Pixels {
    /// IEEE halves: what most files of radiance hold.
    Half(Box<[[u16; 3]]>),
    Single(Box<[[f32; 3]]>),
}

/// 2^112: the exponents of single and half precision differ by 112.
const HALF_SCALE: f32 = 5.192_296_9e33;

/// The value of a finite, non-negative half; subnormal ones too, since the product is exact.
#[inline(always)]
fn from_half(half: u16) -> f32 {
    f32::from_bits(u32::from(half) << 13) * HALF_SCALE
}

/// The half of this value, and whether there is one. Without branches, so that an image is packed several at a time.
#[inline]
fn exact_half(v: f32) -> (u16, bool) {
    let bits = (v * (1.0 / HALF_SCALE)).to_bits() >> 13;
    let half = bits as u16;
    (half, (bits < 0x7c00) & (from_half(half) == v))
}

impl Pixels {
    fn new(pixels: Box<[[f32; 3]]>) -> Self {
        /// After so many it is seen whether all were exact.
        const STRETCH: usize = 4096;
        // A sky is looked up all over, more than the processor's table of small pages covers.
        let mut all = irradiant_bvh::vec_on_large_pages(pixels.len());
        for stretch in pixels.chunks(STRETCH) {
            let mut exact = true;
            all.extend(stretch.iter().map(|&[r, g, b]| {
                let ((r, r_exact), (g, g_exact), (b, b_exact)) = (exact_half(r), exact_half(g), exact_half(b));
                exact &= r_exact & g_exact & b_exact;
                [r, g, b]
            }));
            if !exact {
                irradiant_bvh::move_to_large_pages(&pixels);
                return Self::Single(pixels);
            }
        }
        irradiant_bvh::move_to_large_pages(&all);
        Self::Half(all.into_boxed_slice())
    }

    #[inline(always)]
    fn at(&self, i: usize) -> [f32; 3] {
        match self {
            Self::Half(pixels) => pixels[i].map(from_half),
            Self::Single(pixels) => pixels[i],
        }
    }
}

impl RadianceImage {
    /// The "R", "G", "B" channels (or a single grey one) of `image`; `None` when it has neither, or no pixels.
    ///
    /// Colours are in the space of the image's chromaticities, sRGB when it states none; `render_space` is the one
    /// whose RGB a render in the RGB basis uses.
    pub fn new(image: &Image, render_space: &'static ColorSpace) -> Option<(Self, ImageFaults)> {
        let (width, height) = (image.width(), image.height());
        let samples = image.to_rgb()?.to_f32();
        if width == 0 || height == 0 {
            return None;
        }
        let mut faults = ImageFaults::default();
        let mut pixels: Box<[[f32; 3]]> = samples.as_chunks::<3>().0.into();
        for (i, rgb) in pixels.iter_mut().enumerate() {
            if rgb.iter().all(|v| (0.0..f32::INFINITY).contains(v)) {
                continue;
            }
            let finite = rgb.iter().all(|v| v.is_finite());
            *(if finite { &mut faults.negative } else { &mut faults.not_finite }) += 1;
            faults.first.get_or_insert([i % width, i / width]);
            for v in rgb {
                *v = if v.is_finite() { v.max(0.0) } else { 0.0 };
            }
        }
        let space = color_space_of(image);
        Some((Self::from_pixels(width, height, pixels, space, render_space), faults))
    }

    /// From checked pixels: `width * height` of them, finite and not negative.
    pub(crate) fn from_pixels(
        width: usize,
        height: usize,
        pixels: Box<[[f32; 3]]>,
        space: &'static ColorSpace,
        render_space: &'static ColorSpace,
    ) -> Self {
        debug_assert_eq!(pixels.len(), width * height);
        let to_render = (space != render_space).then(|| space.convert_to(render_space));
        Self { width, height, pixels: Pixels::new(pixels), space, to_render }
    }

    /// Another image with the same colour spaces.
    pub(crate) fn with_pixels(&self, width: usize, height: usize, pixels: Box<[[f32; 3]]>) -> Self {
        debug_assert_eq!(pixels.len(), width * height);
        Self { width, height, pixels: Pixels::new(pixels), space: self.space, to_render: self.to_render }
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The space that the colours are in.
    pub fn space(&self) -> &'static ColorSpace {
        self.space
    }

    /// Row by row from the top.
    pub fn pixels(&self) -> impl ExactSizeIterator<Item = [f32; 3]> + '_ {
        (0..self.width * self.height).map(|i| self.pixels.at(i))
    }

    /// The mean of the channels of each of `means.len()` pixels of row `y` from column `x` on.
    #[inline(always)]
    pub(super) fn means(&self, x: usize, y: usize, means: &mut [f32]) {
        let first = y * self.width + x;
        let row = first..first + means.len();
        let mean = |[r, g, b]: [f32; 3]| (r + g + b) * (1.0 / 3.0);
        match &self.pixels {
            Pixels::Half(pixels) => {
                for (value, &[r, g, b]) in means.iter_mut().zip(&pixels[row]) {
                    *value = mean([from_half(r), from_half(g), from_half(b)]);
                }
            }
            Pixels::Single(pixels) => {
                for (value, &rgb) in means.iter_mut().zip(&pixels[row]) {
                    *value = mean(rgb);
                }
            }
        }
    }

    /// The pixel in column `x` of row `y` from the top, both within the image.
    #[inline(always)]
    pub fn pixel(&self, x: usize, y: usize) -> [f32; 3] {
        self.pixels.at(y * self.width + x)
    }

    /// The spectrum that `rgb` of the image stands for: a colour times the illuminant of its space.
    #[inline]
    pub fn radiance(&self, rgb: [f32; 3], lambda: &Wavelengths) -> SampledSpectrum {
        match lambda.basis {
            Basis::Spectral => {
                if rgb == [0.0; 3] {
                    return SampledSpectrum::ZERO;
                }
                RgbIlluminant::new(rgb, self.space).sample(lambda)
            }
            Basis::Rgb => rgb_lanes(match &self.to_render {
                None => rgb,
                Some(m) => m.map(|row| (row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2]).max(0.0)),
            }),
        }
    }

    #[inline]
    fn nearest_index(&self, uv: Point2) -> usize {
        // The saturating casts send negatives and NaN to 0.
        let x = ((uv.x * self.width as f32) as usize).min(self.width - 1);
        let y = ((uv.y * self.height as f32) as usize).min(self.height - 1);
        y * self.width + x
    }

    /// The pixel at (u, v); outside of the unit square the nearest one.
    #[inline]
    pub fn nearest(&self, uv: Point2) -> [f32; 3] {
        self.pixels.at(self.nearest_index(uv))
    }

    /// Asks for the memory of [`RadianceImage::nearest`].
    #[inline]
    pub(crate) fn prefetch(&self, uv: Point2) {
        let i = self.nearest_index(uv);
        match &self.pixels {
            Pixels::Half(pixels) => irradiant_bvh::prefetch_read(&pixels[i]),
            Pixels::Single(pixels) => irradiant_bvh::prefetch_read(&pixels[i]),
        }
    }

    /// Asks for the memory of `count` pixels of row `y` from column `x` on, at most three cache lines.
    #[inline(always)]
    pub(super) fn prefetch_run(&self, x: usize, y: usize, count: usize) {
        let end = self.width * self.height - 1;
        let (first, middle, last) =
            (y * self.width + x, y * self.width + x + count / 2, y * self.width + x + count - 1);
        let places = [first.min(end), middle.min(end), last.min(end)];
        match &self.pixels {
            Pixels::Half(pixels) => {
                irradiant_bvh::prefetch_read(&pixels[places[0]]);
                irradiant_bvh::prefetch_read(&pixels[places[2]]);
            }
            Pixels::Single(pixels) => {
                for place in places {
                    irradiant_bvh::prefetch_read(&pixels[place]);
                }
            }
        }
    }

    /// Bilinear between pixel centres, the border repeated outwards.
    #[inline]
    pub fn bilinear(&self, uv: Point2) -> [f32; 3] {
        self.blend(uv, |image, x, y| {
            let x = x.clamp(0, image.width as i64 - 1) as usize;
            let y = y.clamp(0, image.height as i64 - 1) as usize;
            image.pixel(x, y)
        })
    }

    /// Bilinear between pixel centres, continued over the border as the equal-area octahedral map is (square images).
    pub fn bilinear_octahedral(&self, uv: Point2) -> [f32; 3] {
        self.blend(uv, |image, x, y| {
            let (w, h) = (image.width as i64, image.height as i64);
            let (mut x, mut y) = (x, y);
            if x < 0 || x >= w {
                x = if x < 0 { -x - 1 } else { 2 * w - 1 - x };
                y = h - 1 - y;
            }
            if y < 0 || y >= h {
                x = w - 1 - x;
                y = if y < 0 { -y - 1 } else { 2 * h - 1 - y };
            }
            image.pixel(x.clamp(0, w - 1) as usize, y.clamp(0, h - 1) as usize)
        })
    }

    #[inline]
    fn blend(&self, uv: Point2, pixel: impl Fn(&Self, i64, i64) -> [f32; 3]) -> [f32; 3] {
        let (x, y) = (uv.x * self.width as f32 - 0.5, uv.y * self.height as f32 - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let (dx, dy) = (x - x0, y - y0);
        let (x0, y0) = (x0 as i64, y0 as i64);
        let corners =
            [pixel(self, x0, y0), pixel(self, x0 + 1, y0), pixel(self, x0, y0 + 1), pixel(self, x0 + 1, y0 + 1)];
        let weights = [(1.0 - dx) * (1.0 - dy), dx * (1.0 - dy), (1.0 - dx) * dy, dx * dy];
        std::array::from_fn(|c| {
            weights[0] * corners[0][c]
                + weights[1] * corners[1][c]
                + weights[2] * corners[2][c]
                + weights[3] * corners[3][c]
        })
    }

    /// What is proportional to a pixel's chance to be sampled: the mean of its channels, times `weight(u, v)` at its
    /// centre.
    pub(crate) fn sampling_weights(&self, weight: impl Fn(Point2) -> f32) -> Vec<f32> {
        (0..self.height)
            .flat_map(|y| (0..self.width).map(move |x| (x, y)))
            .map(|(x, y)| {
                let rgb = self.pixel(x, y);
                (rgb[0] + rgb[1] + rgb[2]) * (1.0 / 3.0) * weight(self.center_of(x, y))
            })
            .collect()
    }

    /// The (u, v) of a pixel's centre.
    #[inline]
    pub(crate) fn center_of(&self, x: usize, y: usize) -> Point2 {
        Point2::new((x as f32 + 0.5) / self.width as f32, (y as f32 + 0.5) / self.height as f32)
    }

    /// The mean over pixels of RGB times `weight(u, v)` at their centres.
    pub(crate) fn mean_rgb(&self, weight: impl Fn(Point2) -> f32) -> [f32; 3] {
        let mut sum = [0f64; 3];
        for y in 0..self.height {
            for x in 0..self.width {
                let rgb = self.pixel(x, y);
                let w = f64::from(weight(self.center_of(x, y)));
                for c in 0..3 {
                    sum[c] += f64::from(rgb[c]) * w;
                }
            }
        }
        sum.map(|s| (s / (self.width * self.height) as f64) as f32)
    }
}

/// Cells along each of two ratios.
const RATIO_CELLS: usize = 32;

/// The mean of an image's radiance, each pixel with a weight.
///
/// Uplifting is not linear: the spectrum of the mean colour is not the mean of the colours' spectra (of a sky with a sunset in it
/// by 16 % of the watts). But it keeps factors, so colours are gathered by their ratios to their largest component, in cells so
/// small that it is as good as linear within each.
#[derive(Clone, Debug)]
pub(crate) struct MeanRadiance {
    /// The share of each cell that is not black, in the image's space.
    cells: Box<[[f32; 3]]>,
    /// All together.
    pub rgb: [f32; 3],
}

impl MeanRadiance {
    /// As a spectrum; `image` is the one that it is the mean of.
    pub fn sample(&self, image: &RadianceImage, lambda: &Wavelengths) -> SampledSpectrum {
        self.cells.iter().fold(SampledSpectrum::ZERO, |sum, &rgb| sum + image.radiance(rgb, lambda))
    }
}

impl RadianceImage {
    /// The mean over pixels of radiance times `weight(u, v)` at their centres.
    pub(crate) fn mean_radiance(&self, weight: impl Fn(Point2) -> f32) -> MeanRadiance {
        let mut sums = vec![[0f64; 3]; 3 * RATIO_CELLS * RATIO_CELLS];
        for y in 0..self.height {
            for x in 0..self.width {
                let rgb = self.pixel(x, y);
                let largest = if rgb[0] >= rgb[1] && rgb[0] >= rgb[2] {
                    0
                } else if rgb[1] >= rgb[2] {
                    1
                } else {
                    2
                };
                if !(rgb[largest] > 0.0) {
                    continue;
                }
                let cell = |c: usize| ((rgb[c] / rgb[largest] * RATIO_CELLS as f32) as usize).min(RATIO_CELLS - 1);
                let i = (largest * RATIO_CELLS + cell((largest + 1) % 3)) * RATIO_CELLS + cell((largest + 2) % 3);
                let w = f64::from(weight(self.center_of(x, y)));
                (0..3).for_each(|c| sums[i][c] += f64::from(rgb[c]) * w);
            }
        }
        let n = (self.width * self.height) as f64;
        let rgb = std::array::from_fn(|c| (sums.iter().map(|sum| sum[c]).sum::<f64>() / n) as f32);
        let cells = sums.iter().map(|sum| sum.map(|s| (s / n) as f32)).filter(|&cell| cell != [0.0; 3]).collect();
        MeanRadiance { cells, rgb }
    }
}

/// The space of an image's chromaticities; sRGB when it states none, or ones that no space has.
pub(crate) fn color_space_of(image: &Image) -> &'static ColorSpace {
    image
        .metadata
        .chromaticities
        .and_then(|c| {
            let pair = |v: [f32; 2]| v.map(f64::from);
            ColorSpace::with_chromaticities([pair(c.red), pair(c.green), pair(c.blue)], pair(c.white))
        })
        .unwrap_or(ColorSpace::srgb())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checker(width: usize, height: usize) -> RadianceImage {
        let pixels = (0..width * height).map(|i| [i as f32, 1.0, (i % 3) as f32]).collect();
        RadianceImage::from_pixels(width, height, pixels, ColorSpace::srgb(), ColorSpace::srgb())
    }

    #[test]
    fn bad_pixels_become_zero_and_are_counted() {
        let samples = vec![1.0, 1.0, 1.0, f32::NAN, 1.0, 1.0, -1.0, 2.0, 2.0, 1.0, f32::INFINITY, 0.0];
        let image = Image::from_f32(2, 2, &["R", "G", "B"], samples).unwrap();
        let (r, faults) = RadianceImage::new(&image, ColorSpace::srgb()).unwrap();
        assert_eq!(faults, ImageFaults { not_finite: 2, negative: 1, first: Some([1, 0]) });
        assert_eq!([r.pixel(1, 0), r.pixel(0, 1)], [[0.0, 1.0, 1.0], [0.0, 2.0, 2.0]]);
    }

    #[test]
    fn halves_are_kept_as_halves_and_nothing_is_rounded() {
        for half in 0..0x7c00 {
            assert_eq!(exact_half(from_half(half)), (half, true));
        }
        assert_eq!((from_half(1), from_half(0x3c00), from_half(0x7bff)), (2f32.powi(-24), 1.0, 65504.0));
        for v in [1.000_1, 65_520.0, 1e9, 1e-9, f32::MAX, f32::MIN_POSITIVE] {
            assert!(!exact_half(v).1, "{v}");
        }
        let image = |v| checker(1, 1).with_pixels(1, 1, Box::new([[v, 0.5, 0.25]]));
        assert!(matches!(image(2.0).pixels, Pixels::Half(_)) && matches!(image(0.1).pixels, Pixels::Single(_)));
        assert_eq!((image(2.0).pixel(0, 0), image(0.1).pixel(0, 0)), ([2.0, 0.5, 0.25], [0.1, 0.5, 0.25]));
    }

    #[test]
    fn lookups_hit_centres_and_survive_hostile_coordinates() {
        let image = checker(4, 4);
        for y in 0..4 {
            for x in 0..4 {
                let uv = image.center_of(x, y);
                assert_eq!(image.nearest(uv), image.pixel(x, y));
                for blended in [image.bilinear(uv), image.bilinear_octahedral(uv)] {
                    assert!((0..3).all(|c| (blended[c] - image.pixel(x, y)[c]).abs() < 1e-5));
                }
            }
        }
        for bad in [f32::NAN, f32::INFINITY, -1e30, 1e30, 1.0, 0.0] {
            image.nearest(Point2::new(bad, bad));
            image.bilinear(Point2::new(bad, 0.5));
            image.bilinear_octahedral(Point2::new(0.5, bad));
        }
    }

    // Across an edge of the square the octahedral map is continuous: a smooth function of direction stays smooth.
    #[test]
    fn the_octahedral_border_is_seamless() {
        let n = 64;
        let f = |w: irradiant_math::Vec3| [2.0 + w.x, 2.0 + w.y * w.z, 2.0 + w.z];
        let blank = checker(n, n);
        let direction = |i| irradiant_math::warp::equal_area_square_to_sphere(blank.center_of(i % n, i / n));
        let image = blank.with_pixels(n, n, (0..n * n).map(|i| f(direction(i))).collect());
        for i in 0..1000 {
            let t = (i as f32 + 0.5) / 1000.0;
            for far in [1e-6, 1.0 - 1e-6] {
                for (a, b) in
                    [(Point2::new(t, far), Point2::new(1.0 - t, far)), (Point2::new(far, t), Point2::new(far, 1.0 - t))]
                {
                    let exact = f(irradiant_math::warp::equal_area_square_to_sphere(a));
                    let (a, b) = (image.bilinear_octahedral(a), image.bilinear_octahedral(b));
                    // The map has a crease at the border: half a pixel away the slope is another.
                    assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-3 && (a[c] - exact[c]).abs() < 0.05));
                }
            }
        }
    }

    #[test]
    fn a_white_emission_of_unit_photometric_scale_has_luminance_one() {
        let space = ColorSpace::srgb();
        let s = Spectrum::rgb_illuminant([1.0; 3], space);
        let e = Emission::new(&s, 1.0 / irradiant_spectrum::spectrum_to_photometric(&s), space);
        let sensor = irradiant_spectrum::Sensor::cie1931();
        let mut sum = [0f64; 3];
        for i in 0..4096 {
            let lambda = Wavelengths::sample_visible((i as f32 + 0.5) / 4096.0);
            let c = sensor.to_rgb(e.sample(&lambda), &lambda);
            (0..3).for_each(|k| sum[k] += f64::from(c[k]) / 4096.0);
        }
        assert!((sum[1] - 1.0).abs() < 2e-3, "{sum:?}");
        let rgb = sensor.to_rgb(e.sample(&Wavelengths::rgb()), &Wavelengths::rgb());
        assert!(rgb.iter().all(|c| (c - 1.0).abs() < 1e-4), "{rgb:?}");
    }
}
