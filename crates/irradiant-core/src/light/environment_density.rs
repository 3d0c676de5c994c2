//! Which pixel of an environment's image to look at: in proportion to brightness, touching few cache lines.
//!
//! An environment of 1024 x 1024 pixels has 12 MB of colours (6 as halves); tables of its density and of its distribution
//! function were another 8 MB, and the cache lines of them that a sample touched were nearly all missing: waiting took
//! 44 % of the time of a scene under a sky. So here a pixel's density is computed from its colour, which is read anyway;
//! the distribution function is kept for runs of [`RUN`] pixels only, in a tree of one cache line per step; and within
//! a run the pixel is found by adding up. Same expectation, and up to rounding the same map from the square to the image
//! as [`PiecewiseConstant2D`](irradiant_math::distribution::PiecewiseConstant2D) over all pixels.
//!
//! Tried and not here: where a surface only reflects, the image in 64 tiles that count by the cosine at which they are seen (bands and columns cut by brightness and
//! area; a surface that turns away from the sun no longer asks for it). Under open sky the variance of light samples alone, computed for walls and ground, is then 0.04 to 0.15 of what it was. But what is left in the
//! benchmark's scenes is shadow and indirect light, and a sample below the horizon was free, while one above asks a ray and memory: the street by `path` 0.84 of the error at
//! 1.25 of the time, by `sharedpath` 0.86 at 1.18, a million triangles 0.95 at 1.18. No gain.
//!
//! What waiting is left is hidden by drawing the first light samples of many paths in three steps, each of which asks for the
//! memory of the next (figures/f3-18: 0.95 of the time; a street whose cost is in its triangles: no gain).

use super::emission::RadianceImage;
use irradiant_math::Point2;
use irradiant_math::distribution::PiecewiseConstant1D;
use irradiant_math::elementary::ONE_MINUS_EPSILON;

/// Pixels of a row that share an entry of the distribution function: 48 or 96 bytes of colours. In the street and with a million triangles under a sky, both of 1024
/// by 1024 pixels, 16 take 1.06 and 1.08 of the time, 4 0.99 and 1.01 (a Xeon of the 5th generation): most of it goes into comparing sums of a run's pixels.
const RUN: usize = 8;

/// Entries of the distribution function in a cache line.
const LINE: usize = 16;

/// The distribution function of a row at the starts of runs. What is behind the last run is 1, then beyond reach.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Line([f32; LINE]);

/// A density over the pixels of an image, in proportion to how far their mean channel exceeds a threshold.
#[derive(Debug)]
pub(super) struct PixelDensity {
    threshold: f32,
    /// What every pixel weighs beside that; not 0 only when nothing exceeds the threshold and all shall be alike.
    base: f32,
    /// Density over the unit square per weight.
    normalisation: f32,
    rows: PiecewiseConstant1D,
    /// Lines that a row has.
    lines_per_row: usize,
    /// The first entry of each line, row by row: small enough to stay in the cache.
    coarse: Vec<f32>,
    fine: Vec<Line>,
}

/// A point of the unit square drawn from a [`PixelDensity`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PixelSample {
    pub uv: Point2,
    /// Of the pixel.
    pub rgb: [f32; 3],
    /// Over the unit square.
    pub pdf: f32,
}

/// A random point on its way to a pixel: the row is known, and which line of its distribution function to read.
#[derive(Clone, Copy, Debug)]
pub struct PixelLine {
    u: f32,
    y: usize,
    dy: f32,
    /// In the row.
    line: usize,
}

/// A random point on its way to a pixel: the row and the run of pixels are known.
#[derive(Clone, Copy, Debug)]
pub struct PixelRun {
    y: usize,
    dy: f32,
    first: usize,
    /// In the run, in [0, 1).
    u: f32,
}

#[inline(always)]
fn brightness(rgb: [f32; 3]) -> f32 {
    (rgb[0] + rgb[1] + rgb[2]) * (1.0 / 3.0)
}

impl PixelDensity {
    /// In proportion to brightness; if `compensated`, to what of it exceeds the mean (equal if nothing does).
    ///
    /// Error x time by `path` of a million triangles 0.4, of the benchmark's street 0.84 of what it is without compensation (decision 7).
    ///
    /// `None` for an image without pixels. All-black images have density 0.
    pub fn new(image: &RadianceImage, compensated: bool) -> Option<Self> {
        let (width, height) = (image.width(), image.height());
        let count = (width * height) as f64;
        let runs = width.div_ceil(RUN);
        // One more entry than runs, so that every run's end is the next entry of its line or of the next line.
        let lines_per_row = (runs + 1).div_ceil(LINE);
        let mut row = vec![0.0; width];
        let threshold = if compensated {
            let mut sum = 0.0;
            for y in 0..height {
                image.means(0, y, &mut row);
                sum += row.iter().map(|&mean| f64::from(mean)).sum::<f64>();
            }
            (sum / count) as f32
        } else {
            0.0
        };
        let mut density = Self {
            threshold,
            base: 0.0,
            normalisation: 0.0,
            rows: PiecewiseConstant1D::new([1.0])?,
            lines_per_row,
            coarse: Vec::with_capacity(lines_per_row * height),
            fine: Vec::with_capacity(lines_per_row * height),
        };
        if compensated && !image.pixels().any(|rgb| density.weight(rgb) > 0.0) {
            density.base = 1.0;
        }
        let mut row_sums = Vec::with_capacity(height);
        let mut run_sums = vec![0f64; runs];
        for y in 0..height {
            image.means(0, y, &mut row);
            for (sum, run) in run_sums.iter_mut().zip(row.chunks(RUN)) {
                *sum = run.iter().map(|&mean| f64::from(density.weight_of_mean(mean))).sum();
            }
            let row_sum: f64 = run_sums.iter().sum();
            row_sums.push(row_sum);
            let occupied = run_sums.iter().rposition(|&s| s > 0.0).map_or(0, |last| last + 1);
            let mut before = 0.0;
            let mut entries = (0..lines_per_row * LINE).map(|i| {
                // Empty runs at the end must not get a chance by rounding.
                let entry = if i < occupied { (before / row_sum) as f32 } else { 1.0 };
                before += run_sums.get(i).unwrap_or(&0.0);
                entry
            });
            for _ in 0..lines_per_row {
                let line = Line(std::array::from_fn(|_| entries.next().unwrap_or(1.0)));
                density.coarse.push(line.0[0]);
                density.fine.push(line);
            }
        }
        let total: f64 = row_sums.iter().sum();
        let largest = row_sums.iter().copied().fold(0.0, f64::max);
        let rows: Vec<f32> = row_sums.iter().map(|r| if largest > 0.0 { (r / largest) as f32 } else { 0.0 }).collect();
        density.rows = PiecewiseConstant1D::new(rows)?;
        density.normalisation = if total > 0.0 { (count / total) as f32 } else { 0.0 };
        irradiant_bvh::move_to_large_pages(&density.fine);
        Some(density)
    }

    #[inline(always)]
    fn weight(&self, rgb: [f32; 3]) -> f32 {
        self.weight_of_mean(brightness(rgb))
    }

    #[inline(always)]
    fn weight_of_mean(&self, mean: f32) -> f32 {
        (mean - self.threshold).max(0.0) + self.base
    }

    /// The density over the unit square at a pixel of this colour.
    #[inline]
    pub fn pdf(&self, rgb: [f32; 3]) -> f32 {
        self.weight(rgb) * self.normalisation
    }

    /// A point in a pixel by its weight; `None` if the image is black.
    #[inline]
    pub fn sample(&self, image: &RadianceImage, u: Point2) -> Option<PixelSample> {
        self.arrive(image, self.approach(self.seek(u)))
    }

    /// The first of the three steps of [`PixelDensity::sample`].
    #[inline(always)]
    pub fn seek(&self, u: Point2) -> PixelLine {
        let (y, dy) = self.rows.sample_cell(u.y);
        // Counting entries is branchless, and several are compared at once.
        let first = y * self.lines_per_row;
        let coarse = &self.coarse[first..first + self.lines_per_row];
        let line = coarse[1..].iter().filter(|&&entry| entry <= u.x).count();
        PixelLine { u: u.x, y, dy, line }
    }

    /// Asks for the memory that [`PixelDensity::approach`] reads.
    #[inline(always)]
    pub fn prefetch_line(&self, at: &PixelLine) {
        irradiant_bvh::prefetch_read(&self.fine[at.y * self.lines_per_row + at.line]);
    }

    /// The second step.
    #[inline(always)]
    pub fn approach(&self, PixelLine { u, y, dy, line }: PixelLine) -> PixelRun {
        let first = y * self.lines_per_row;
        let coarse = &self.coarse[first..first + self.lines_per_row];
        let entries = &self.fine[first + line].0;
        let place = entries[1..].iter().filter(|&&entry| entry <= u).count();
        let start = entries[place];
        let end = *entries.get(place + 1).or(coarse.get(line + 1)).unwrap_or(&1.0);
        let u = if end > start { ((u - start) / (end - start)).clamp(0.0, ONE_MINUS_EPSILON) } else { 0.0 };
        PixelRun { y, dy, first: (line * LINE + place) * RUN, u }
    }

    /// Asks for the memory that [`PixelDensity::arrive`] reads.
    #[inline(always)]
    pub fn prefetch_run(&self, image: &RadianceImage, at: &PixelRun) {
        image.prefetch_run(at.first, at.y, RUN);
    }

    /// The last step.
    #[inline(always)]
    pub fn arrive(&self, image: &RadianceImage, at: PixelRun) -> Option<PixelSample> {
        let PixelRun { y, dy, first, u: u_run } = at;
        let pixels = image.width().saturating_sub(first).min(RUN);
        if pixels == 0 {
            return None;
        }
        // Sums up to and with each pixel; those past the row's end weigh nothing.
        let mut weights = [0.0; RUN];
        image.means(first, y, &mut weights[..pixels]);
        weights[..pixels].iter_mut().for_each(|mean| *mean = self.weight_of_mean(*mean));
        let mut upto = [0.0; RUN];
        let mut sum = 0.0;
        for (upto, weight) in upto.iter_mut().zip(weights) {
            sum += weight;
            *upto = sum;
        }
        let target = u_run * sum;
        // Rounding may lead past the last pixel that weighs something: then that one.
        let past = upto.iter().filter(|&&s| s <= target).count();
        let i = if past < RUN { past } else { upto.iter().position(|&s| s == sum)? };
        let below = if i > 0 { upto[i - 1] } else { 0.0 };
        if i >= pixels {
            return None;
        }
        let (rgb, weight) = (image.pixel(first + i, y), weights[i]);
        if !(weight > 0.0) {
            return None;
        }
        let dx = ((target - below) / weight).clamp(0.0, ONE_MINUS_EPSILON);
        let uv = Point2::new(((first + i) as f32 + dx) / image.width() as f32, (y as f32 + dy) / image.height() as f32);
        Some(PixelSample { uv, rgb, pdf: weight * self.normalisation })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use irradiant_math::distribution::PiecewiseConstant2D;
    use irradiant_spectrum::ColorSpace;
    use irradiant_testkit::{Rng, chi2_counts};

    fn image(width: usize, height: usize, pixel: impl Fn(usize) -> [f32; 3]) -> RadianceImage {
        let pixels = (0..width * height).map(pixel).collect();
        RadianceImage::from_pixels(width, height, pixels, ColorSpace::srgb(), ColorSpace::srgb())
    }

    /// Skewed, with black stretches; 21 pixels a row, so that runs end early.
    fn uneven() -> RadianceImage {
        image(21, 13, |i| {
            let x = if i % 7 == 0 || (60..90).contains(&i) { 0.0 } else { ((i * 37) % 101) as f32 / 100.0 };
            [x * x, 2.0 * x, 0.1 * x]
        })
    }

    // 2e5 draws over 273 pixels: a pixel of mean weight 15 % off is seen, a wrong density over all 1 % off; 1e-6 false alarms.
    #[test]
    fn pixels_come_by_their_density_and_points_lie_in_them() {
        let image = uneven();
        for compensated in [false, true] {
            let density = PixelDensity::new(&image, compensated).unwrap();
            let mut rng = Rng::new(7);
            let mut counts = vec![0u64; 21 * 13];
            for _ in 0..200_000 {
                let u = Point2::new(rng.next_f32(), rng.next_f32());
                let s = density.sample(&image, u).unwrap();
                assert_eq!(image.nearest(s.uv), s.rgb);
                assert_eq!(density.pdf(s.rgb), s.pdf);
                counts[(s.uv.y * 13.0) as usize * 21 + (s.uv.x * 21.0) as usize] += 1;
            }
            let expected: Vec<f64> = image.pixels().map(|rgb| f64::from(density.pdf(rgb)) / (21.0 * 13.0)).collect();
            assert!((expected.iter().sum::<f64>() - 1.0).abs() < 1e-5);
            let report = chi2_counts(&counts, &expected);
            assert!(report.p_value > 1e-6, "{report:?}");
        }
    }

    // The stratification of low-discrepancy points survives: neighbours in the square stay neighbours.
    #[test]
    fn the_map_is_that_of_a_table_over_all_pixels() {
        let image = uneven();
        let density = PixelDensity::new(&image, false).unwrap();
        let table = PiecewiseConstant2D::new(image.sampling_weights(|_| 1.0), 21, 13).unwrap();
        for i in 0..10_000 {
            let u = Point2::new((i as f32 * 0.618_034).fract(), (i as f32 + 0.5) / 10_000.0);
            let (a, b) = (density.sample(&image, u).unwrap(), table.sample(u));
            assert!((a.uv.x - b.p.x).abs() < 1e-4 && (a.uv.y - b.p.y).abs() < 1e-4, "{u:?} {a:?} {b:?}");
            assert!((a.pdf - b.pdf).abs() <= 1e-4 * b.pdf || a.uv.x.fract() < 1e-3);
        }
    }

    // Rows of several lines, one of them ending with its line; a run of every share is met.
    #[test]
    fn wide_images_are_searched_in_two_steps() {
        for width in [15 * RUN, 16 * RUN, 16 * RUN + 3, 700] {
            let image = image(width, 3, |i| [((i * 31) % 97) as f32; 3]);
            let density = PixelDensity::new(&image, true).unwrap();
            let table: Vec<f32> = image.pixels().map(|rgb| density.pdf(rgb)).collect();
            let table = PiecewiseConstant2D::new(table, width, 3).unwrap();
            for i in 0..20_000 {
                let u = Point2::new((i as f32 + 0.5) / 20_000.0, (i as f32 * 0.618_034).fract());
                let (a, b) = (density.sample(&image, u).unwrap(), table.sample(u));
                assert!((a.uv.x - b.p.x).abs() < 1e-3 && (a.uv.y - b.p.y).abs() < 1e-4, "{width} {u:?} {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn uniform_black_and_single_pixels() {
        let grey = image(20, 20, |_| [0.3; 3]);
        let density = PixelDensity::new(&grey, true).unwrap();
        let s = density.sample(&grey, Point2::new(0.99999994, 0.99999994)).unwrap();
        assert!((s.pdf - 1.0).abs() < 1e-5 && s.uv.x < 1.0 && s.uv.y < 1.0);
        let black = image(4, 4, |_| [0.0; 3]);
        let density = PixelDensity::new(&black, false).unwrap();
        assert_eq!((density.sample(&black, Point2::new(0.5, 0.5)), density.pdf([0.0; 3])), (None, 0.0));
        let one = image(1, 1, |_| [5.0, 0.0, 1.0]);
        let s = PixelDensity::new(&one, false).unwrap().sample(&one, Point2::new(0.25, 0.75)).unwrap();
        assert_eq!((s.uv, s.pdf), (Point2::new(0.25, 0.75), 1.0));
        // A single bright pixel is always met, at both ends of the range.
        let spot = image(40, 40, |i| if i == 15 * 40 + 23 { [9.0; 3] } else { [0.0; 3] });
        let density = PixelDensity::new(&spot, true).unwrap();
        for u in [0.0, 0.3, ONE_MINUS_EPSILON] {
            assert_eq!(density.sample(&spot, Point2::new(u, u)).unwrap().rgb, [9.0; 3]);
        }
    }
}
