//! The film: sums and counts per pixel. Averages exist only in [`Film::develop`].
//!
//! There is one film. What varies is which layers it keeps beside radiance ([`Layer`]). Each sample touches exactly
//! one pixel (reconstruction by filter importance sampling; Ernst et al. 2006), so a tile has one writer. What paths from
//! lights bring to other pixels goes to a plane of its own ([`FilmTile::splat`]), which films of other renders lack.

mod develop;
pub mod exact;
pub mod filter;
mod lanes;
mod parts;
mod splat;

pub use develop::DevelopOptions;
pub use parts::SampleParts;
pub use splat::SplatEstimate;

use exact::{ExactSum, SquareSum};
use splat::{Splat, SplatPixel, SplatPlane};

/// What a film keeps beside radiance, channel by channel.
///
/// As pbrt-v4's gbuffer film has them: reflectance is a mean over the pixel's samples; positions, slopes and texture
/// coordinates are means over those that hit something (told by [`Layer::Hits`], without which: all of them); slopes
/// without their sign; normals the direction of their sum. All are 0 where nothing was hit.
#[derive(Clone, Debug, PartialEq)]
pub enum Layer {
    /// Reflectance at the first visible surface (R, G, B).
    Albedo,
    /// Position of the first hit (X, Y, Z).
    Position,
    /// Change of the first hit's depth per pixel (x, y).
    DepthSlope,
    /// Geometric normal of the first hit.
    Normal,
    /// Shading normal of the first hit.
    ShadingNormal,
    /// Texture coordinates of the first hit (u, v).
    Uv,
    /// Number of samples that hit something; kept, not written.
    Hits,
    /// Radiance averaged over a wavelength interval; one channel.
    Bucket {
        /// Least wavelength, nm.
        lambda_min: f32,
        /// Greatest wavelength, nm.
        lambda_max: f32,
    },
    /// Radiance carried by some of the paths (R, G, B): a mean over the pixel's samples, as the picture's own is.
    Paths {
        /// The channels are this and `.R`, `.G`, `.B`.
        name: String,
        /// Which paths, in words that determine them.
        expression: String,
    },
}

impl Layer {
    /// Number of channels.
    pub const fn n_channels(&self) -> usize {
        match self {
            Self::Albedo | Self::Position | Self::Normal | Self::ShadingNormal | Self::Paths { .. } => 3,
            Self::DepthSlope | Self::Uv => 2,
            Self::Hits | Self::Bucket { .. } => 1,
        }
    }

    /// Channel names as pbrt-v4 writes them; none for what is not written.
    pub fn channel_names(&self) -> Vec<String> {
        let names = |list: &[&str]| list.iter().map(|s| s.to_string()).collect();
        match self {
            Self::Albedo => names(&["Albedo.R", "Albedo.G", "Albedo.B"]),
            Self::Position => names(&["P.X", "P.Y", "P.Z"]),
            Self::DepthSlope => names(&["dzdx", "dzdy"]),
            Self::Normal => names(&["N.X", "N.Y", "N.Z"]),
            Self::ShadingNormal => names(&["Ns.X", "Ns.Y", "Ns.Z"]),
            Self::Uv => names(&["u", "v"]),
            Self::Hits => Vec::new(),
            Self::Paths { name, .. } => ["R", "G", "B"].map(|c| format!("{name}.{c}")).to_vec(),
            Self::Bucket { lambda_min, lambda_max } => {
                vec![format!("S0.{:.3}nm", 0.5 * (lambda_min + lambda_max)).replace('.', ",").replacen("S0,", "S0.", 1)]
            }
        }
    }
}

/// Pixels as integer rectangles, end-exclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelBounds {
    /// Least x.
    pub x0: i32,
    /// Least y.
    pub y0: i32,
    /// One past the greatest x.
    pub x1: i32,
    /// One past the greatest y.
    pub y1: i32,
}

impl PixelBounds {
    /// Pixels across.
    pub const fn width(&self) -> usize {
        if self.x1 > self.x0 { (self.x1 - self.x0) as usize } else { 0 }
    }

    /// Pixels down.
    pub const fn height(&self) -> usize {
        if self.y1 > self.y0 { (self.y1 - self.y0) as usize } else { 0 }
    }

    /// Number of pixels.
    pub const fn area(&self) -> usize {
        self.width() * self.height()
    }

    /// The part inside another rectangle.
    pub fn intersection(&self, b: &Self) -> Self {
        Self { x0: self.x0.max(b.x0), y0: self.y0.max(b.y0), x1: self.x1.min(b.x1), y1: self.y1.min(b.y1) }
    }

    /// True when the pixel is inside.
    pub const fn contains(&self, x: i32, y: i32) -> bool {
        self.x0 <= x && x < self.x1 && self.y0 <= y && y < self.y1
    }
}

/// Sums and counts of one pixel: 112 bytes, so that a 4K film with error bars stays under 1 GB.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pixel {
    /// Weighted radiance, linear RGB of the film's colour space.
    pub radiance: [ExactSum; 3],
    /// Its squares.
    pub squares: [SquareSum; 3],
    /// Samples summed.
    pub count: u32,
    /// Samples refused: not finite.
    pub not_finite: u32,
    /// Samples refused: finite but beyond the range of the sums.
    pub out_of_range: u32,
    /// Samples summed whose square was beyond the range: the pixel's error bar is unknown.
    pub square_overflow: u32,
}

impl Pixel {
    /// Adds a weighted sample; false when it was refused (and counted).
    #[inline]
    pub fn add(&mut self, rgb: [f32; 3]) -> bool {
        let quantised = (ExactSum::quantised(rgb[0]), ExactSum::quantised(rgb[1]), ExactSum::quantised(rgb[2]));
        let (Some(r), Some(g), Some(b)) = quantised else {
            if rgb.iter().all(|x| x.is_finite()) {
                self.out_of_range += 1;
            } else {
                self.not_finite += 1;
            }
            return false;
        };
        self.radiance[0] += r;
        self.radiance[1] += g;
        self.radiance[2] += b;
        let mut in_range = true;
        for c in 0..3 {
            in_range &= self.squares[c].add(rgb[c]);
        }
        self.square_overflow += u32::from(!in_range);
        self.count += 1;
        true
    }

    /// Adds another pixel's sums: associative, commutative, with the empty pixel as identity.
    #[inline]
    pub fn merge(&mut self, other: &Pixel) {
        for c in 0..3 {
            self.radiance[c] += other.radiance[c];
            self.squares[c] += other.squares[c];
        }
        self.count += other.count;
        self.not_finite += other.not_finite;
        self.out_of_range += other.out_of_range;
        self.square_overflow += other.square_overflow;
    }

    /// Mean radiance; zero without samples.
    pub fn mean(&self) -> [f64; 3] {
        let n = self.count.max(1) as f64;
        self.radiance.map(|sum| sum.value() / n)
    }

    /// Sample variance of one sample (unbiased); infinite when unknown, zero for fewer than two samples.
    pub fn variance(&self) -> [f64; 3] {
        let n = self.count as f64;
        if self.square_overflow > 0 {
            return [f64::INFINITY; 3];
        }
        if self.count < 2 {
            return [0.0; 3];
        }
        std::array::from_fn(|c| {
            let (sum, square) = (self.radiance[c].value(), self.squares[c].value());
            ((square - sum * sum / n) / (n - 1.0)).max(0.0)
        })
    }
}

/// A part of a film: what a work unit fills, and what a film is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmTile {
    bounds: PixelBounds,
    pixels: Vec<Pixel>,
    layers: Vec<ExactSum>,
    channels_per_pixel: usize,
    /// For any pixel of the film; empty in a film, which has a plane for them.
    splats: Vec<Splat>,
}

impl FilmTile {
    /// An empty tile.
    pub fn new(bounds: PixelBounds, channels_per_pixel: usize) -> Self {
        Self {
            bounds,
            pixels: vec![Pixel::default(); bounds.area()],
            layers: vec![ExactSum::default(); bounds.area() * channels_per_pixel],
            channels_per_pixel,
            splats: Vec::new(),
        }
    }

    /// Its pixels' place in the image.
    pub fn bounds(&self) -> PixelBounds {
        self.bounds
    }

    fn index(&self, x: i32, y: i32) -> usize {
        debug_assert!(self.bounds.contains(x, y));
        (y - self.bounds.y0) as usize * self.bounds.width() + (x - self.bounds.x0) as usize
    }

    /// A pixel.
    #[inline]
    pub fn pixel(&self, x: i32, y: i32) -> &Pixel {
        &self.pixels[self.index(x, y)]
    }

    /// Adds a sample to a pixel: weighted radiance, and the layers' channels (which need not be finite: those that
    /// are not, or out of range, count as 0).
    #[inline]
    pub fn add(&mut self, x: i32, y: i32, rgb: [f32; 3], layers: &[f32]) -> bool {
        let i = self.index(x, y);
        let accepted = self.pixels[i].add(rgb);
        if accepted && self.channels_per_pixel > 0 {
            let at = i * self.channels_per_pixel;
            for (sum, &value) in self.layers[at..at + self.channels_per_pixel].iter_mut().zip(layers) {
                let _ = sum.add(value);
            }
        }
        accepted
    }

    /// Adds what a path from a light brings to a pixel, in the tile or not: linear RGB of the film's colour space, of
    /// which a pixel shows the mean over all paths from lights, one for each sample of the film. Of one path all at once, or
    /// the film's error bars are too small. Pixels outside of the film are left out.
    #[inline]
    pub fn splat(&mut self, x: i32, y: i32, rgb: [f32; 3]) {
        self.splats.push(Splat { x, y, rgb });
    }

    /// Adds the sums of a tile of the same bounds and layers.
    pub fn merge(&mut self, other: &FilmTile) {
        debug_assert_eq!((self.bounds, self.channels_per_pixel), (other.bounds, other.channels_per_pixel));
        for (a, b) in self.pixels.iter_mut().zip(&other.pixels) {
            a.merge(b);
        }
        for (a, b) in self.layers.iter_mut().zip(&other.layers) {
            *a += *b;
        }
        self.splats.extend_from_slice(&other.splats);
    }

    /// All zero again, for other pixels of the same number; storage kept.
    pub fn restart(&mut self, bounds: PixelBounds) {
        debug_assert_eq!(bounds.area(), self.bounds.area());
        self.bounds = bounds;
        self.pixels.fill(Pixel::default());
        self.layers.fill(ExactSum::default());
        self.splats.clear();
    }
}

/// Totals over a film, for reports.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FilmTotals {
    /// Samples summed.
    pub samples: u64,
    /// Samples refused because not finite, and contributions of paths from lights.
    pub not_finite: u64,
    /// Samples refused because out of range, and contributions of paths from lights.
    pub out_of_range: u64,
    /// Pixels with at least one refused sample.
    pub pixels_with_refused: u64,
    /// Fewest samples taken of a pixel, refused ones included.
    pub min_count: u32,
    /// Most samples taken of a pixel, refused ones included.
    pub max_count: u32,
    /// Pixels of which no sample was taken: nothing is known of them, and they are black.
    pub pixels_without_samples: u64,
    /// Mean standard error of a pixel over the mean of the picture, estimated as if samples were independent.
    pub relative_error: f64,
}

/// A whole film.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    full_resolution: [u32; 2],
    tile: FilmTile,
    layers: Vec<Layer>,
    /// Once a path from a light has brought something.
    splats: Option<Box<SplatPlane>>,
}

impl Film {
    /// An empty film for the pixels `bounds` of an image of `full_resolution`.
    pub fn new(full_resolution: [u32; 2], bounds: PixelBounds, layers: Vec<Layer>) -> Self {
        let channels = layers.iter().map(Layer::n_channels).sum();
        Self { full_resolution, tile: FilmTile::new(bounds, channels), layers, splats: None }
    }

    /// Memory that a film takes for each pixel, bytes, when its layers have so many channels.
    pub const fn bytes_per_pixel(channels: u64) -> u64 {
        size_of::<Pixel>() as u64 + channels.saturating_mul(size_of::<ExactSum>() as u64)
    }

    /// More of it, bytes, where paths from lights bring something ([`FilmTile::splat`]).
    pub const SPLAT_BYTES_PER_PIXEL: u64 = size_of::<SplatPixel>() as u64;

    /// Width and height of the image that this is a (perhaps cropped) film of.
    pub fn full_resolution(&self) -> [u32; 2] {
        self.full_resolution
    }

    /// The pixels that this film holds.
    pub fn bounds(&self) -> PixelBounds {
        self.tile.bounds
    }

    /// The layers beside radiance.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// Channels of all layers together.
    pub fn channels_per_pixel(&self) -> usize {
        self.tile.channels_per_pixel
    }

    /// The sums of a pixel in the layer of this index in [`Film::layers`], channel by channel.
    pub fn layer_sums(&self, x: i32, y: i32, layer: usize) -> &[ExactSum] {
        let first: usize = self.layers[..layer].iter().map(Layer::n_channels).sum();
        let at = self.tile.index(x, y) * self.tile.channels_per_pixel + first;
        &self.tile.layers[at..at + self.layers[layer].n_channels()]
    }

    /// A pixel's sums.
    pub fn pixel(&self, x: i32, y: i32) -> &Pixel {
        self.tile.pixel(x, y)
    }

    /// Adds the sums of a tile that lies inside.
    pub fn merge_tile(&mut self, tile: &FilmTile) {
        debug_assert_eq!(self.tile.channels_per_pixel, tile.channels_per_pixel);
        let n = self.tile.channels_per_pixel;
        for y in tile.bounds.y0..tile.bounds.y1 {
            let (from, to) = (tile.index(tile.bounds.x0, y), self.tile.index(tile.bounds.x0, y));
            for i in 0..tile.bounds.width() {
                self.tile.pixels[to + i].merge(&tile.pixels[from + i]);
            }
            for i in 0..tile.bounds.width() * n {
                self.tile.layers[to * n + i] += tile.layers[from * n + i];
            }
        }
        if !tile.splats.is_empty() {
            let n_pixels = self.tile.pixels.len();
            let plane = self.splats.get_or_insert_with(|| Box::new(SplatPlane::new(n_pixels)));
            for splat in tile.splats.iter().filter(|s| self.tile.bounds.contains(s.x, s.y)) {
                plane.add(self.tile.index(splat.x, splat.y), splat.rgb);
            }
        }
    }

    /// True when paths from lights have brought something: pixels then show [`Film::splat_estimate`] too.
    pub fn has_splats(&self) -> bool {
        self.splats.is_some()
    }

    /// What paths from lights make of a pixel, to be added to its own mean. Counts the film's samples at each call.
    pub fn splat_estimate(&self, x: i32, y: i32) -> SplatEstimate {
        let index = self.tile.index(x, y);
        self.splats.as_ref().map_or(SplatEstimate::default(), |s| s.estimate(index, self.samples_taken()))
    }

    /// Samples of all pixels, refused ones included: each has traced one path from a light, if any has.
    fn samples_taken(&self) -> u64 {
        self.tile.pixels.iter().map(|p| u64::from(p.count) + u64::from(p.not_finite) + u64::from(p.out_of_range)).sum()
    }

    /// Adds the sums of another film of the same pixels and layers (other samples of the same picture).
    pub fn merge(&mut self, other: &Film) -> Result<(), FilmMismatch> {
        if self.full_resolution != other.full_resolution
            || self.layers != other.layers
            || self.bounds() != other.bounds()
        {
            return Err(FilmMismatch);
        }
        self.tile.merge(&other.tile);
        match (&mut self.splats, &other.splats) {
            (Some(a), Some(b)) => a.merge(b),
            (a @ None, Some(b)) => *a = Some(b.clone()),
            (_, None) => {}
        }
        Ok(())
    }

    /// Totals for reports.
    pub fn totals(&self) -> FilmTotals {
        let mut totals = FilmTotals { min_count: u32::MAX, ..Default::default() };
        let (mut mean, mut error) = (0.0, 0.0);
        let splats = self.splats.as_ref().map(|s| (s, self.samples_taken()));
        for (i, pixel) in self.tile.pixels.iter().enumerate() {
            totals.samples += pixel.count as u64;
            totals.not_finite += pixel.not_finite as u64;
            totals.out_of_range += pixel.out_of_range as u64;
            totals.pixels_with_refused += u64::from(pixel.not_finite + pixel.out_of_range > 0);
            let taken = pixel.count + pixel.not_finite + pixel.out_of_range;
            totals.min_count = totals.min_count.min(taken);
            totals.max_count = totals.max_count.max(taken);
            totals.pixels_without_samples += u64::from(taken == 0);
            let light = splats.map_or(SplatEstimate::default(), |(plane, n)| plane.estimate(i, n));
            mean += pixel.mean().iter().sum::<f64>() + light.mean.iter().sum::<f64>();
            let of_mean = pixel.variance().map(|v| v / pixel.count.max(1) as f64);
            let known = of_mean.into_iter().zip(light.variance).map(|(a, b)| a + b).filter(|v| v.is_finite());
            error += known.map(f64::sqrt).sum::<f64>();
        }
        if let Some((plane, _)) = splats {
            let [not_finite, out_of_range] = plane.refused();
            totals.not_finite += not_finite;
            totals.out_of_range += out_of_range;
        }
        totals.relative_error = if mean > 0.0 { error / mean } else { 0.0 };
        totals.min_count = totals.min_count.min(totals.max_count);
        totals
    }
}

/// Two films hold different pixels or layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilmMismatch;

impl std::fmt::Display for FilmMismatch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "the films differ in resolution, pixel bounds or layers")
    }
}

impl std::error::Error for FilmMismatch {}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: PixelBounds = PixelBounds { x0: 2, y0: 1, x1: 5, y1: 4 };

    fn film() -> Film {
        Film::new([8, 8], BOUNDS, vec![Layer::Uv])
    }

    #[test]
    fn merging_is_associative_and_commutative_with_an_identity() {
        let fill = |seed: u32| {
            let mut f = film();
            for i in 0..50u32 {
                let h = i.wrapping_mul(2_654_435_761).wrapping_add(seed.wrapping_mul(97));
                let (x, y) = (2 + (h >> 8) as i32 % 3, 1 + (h >> 16) as i32 % 3);
                let (x, y) = (x.clamp(2, 4), y.clamp(1, 3));
                f.tile.add(x, y, [h as f32 * 1e-9, 0.1, h as f32], &[0.25, 1e-3 * i as f32]);
            }
            f
        };
        let (a, b, c) = (fill(1), fill(2), fill(3));
        let sum = |list: &[&Film]| {
            let mut total = film();
            list.iter().for_each(|f| total.merge(f).unwrap());
            total
        };
        let ab = sum(&[&a, &b]);
        assert_eq!(sum(&[&ab, &c]), sum(&[&a, &sum(&[&c, &b])]));
        assert_eq!(sum(&[&a, &film()]), a);
        assert!(a.clone().merge(&Film::new([8, 8], BOUNDS, vec![])).is_err());
    }

    #[test]
    fn refused_samples_are_counted_and_leave_the_sums_alone() {
        let mut pixel = Pixel::default();
        assert!(pixel.add([1.0, 2.0, 3.0]));
        assert!(!pixel.add([1.0, f32::NAN, 3.0]));
        assert!(!pixel.add([1e30, 2.0, 3.0]));
        assert!(pixel.add([1e10, 2.0, 3.0]));
        assert_eq!((pixel.count, pixel.not_finite, pixel.out_of_range, pixel.square_overflow), (2, 1, 1, 1));
        assert_eq!(pixel.mean()[2], 3.0);
        assert_eq!(pixel.variance()[2], f64::INFINITY);
    }

    #[test]
    fn pixels_without_samples_are_those_that_nothing_was_taken_of() {
        let mut film = film();
        assert_eq!(film.totals().pixels_without_samples, 9);
        film.tile.add(2, 1, [0.0; 3], &[0.0; 2]);
        // One that was refused is one that was taken.
        film.tile.add(3, 2, [f32::NAN; 3], &[0.0; 2]);
        assert_eq!(film.totals().pixels_without_samples, 7);
    }

    #[test]
    fn variance_is_the_sample_variance() {
        let mut pixel = Pixel::default();
        for x in [1.0, 2.0, 4.0] {
            pixel.add([x, 0.5, 0.0]);
        }
        let v = pixel.variance();
        assert!((v[0] - 7.0 / 3.0).abs() < 1e-12 && v[1].abs() < 1e-12);
        assert_eq!(size_of::<Pixel>(), 112);
    }
}
