//! FLIP: the difference that a person alternating between two pictures would see, from 0 to 1.
//!
//! Sources: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild 2020, "FLIP: A Difference Evaluator
//! for Alternating Images"; Andersson, Nilsson, Shirley and Akenine-Möller 2021, "Visualizing Errors in Rendered
//! High Dynamic Range Images". Agrees with `flip-evaluator` 1.7 to 1e-3 or better (see the tests).

use crate::image::Image;
use crate::metrics::{CompareError, comparable};

/// How a picture is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlipOptions {
    /// Pixels per degree of visual angle; 67.02 is a 0.7 m wide 4K display seen from 0.7 m.
    pub pixels_per_degree: f32,
    /// First exposure, last exposure (both in stops) and their number for [`flip_hdr`]; `None` finds them in the reference.
    pub exposures: Option<(f32, f32, usize)>,
}

impl Default for FlipOptions {
    fn default() -> Self {
        Self { pixels_per_degree: 67.020_645, exposures: None }
    }
}

/// The perceived difference at each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// One channel "FLIP", 0 (equal) to 1.
    pub map: Image,
    /// Its mean.
    pub mean: f64,
    /// First exposure, last exposure and their number; `None` for [`flip_ldr`].
    pub exposures: Option<(f32, f32, usize)>,
}

/// The perceived difference of two pictures as a display of [0, 1] shows them: linear values are clamped to that.
pub fn flip_ldr(image: &Image, reference: &Image, options: &FlipOptions) -> Result<Flip, CompareError> {
    let (image, reference) = pair(image, reference)?;
    let clamp = |value: f32| if value > 0.0 { value.min(1.0) } else { 0.0 };
    let clamped = |image: &Image| pixels(&image.to_f32(), clamp);
    let viewer = Viewer::new(options.pixels_per_degree, image.width(), image.height());
    let map = viewer.difference(&clamped(&image), &clamped(&reference));
    Ok(finish(image.width(), image.height(), map, None))
}

/// The perceived difference of two pictures of high dynamic range: at each pixel the largest of [`flip_ldr`] over
/// exposures that span the reference, tone mapped with a fit to ACES. Values that are negative or not finite count as 0.
pub fn flip_hdr(image: &Image, reference: &Image, options: &FlipOptions) -> Result<Flip, CompareError> {
    let (image, reference) = pair(image, reference)?;
    let finite = |value: f32| if value > 0.0 && value.is_finite() { value } else { 0.0 };
    let (test, truth) = (pixels(&image.to_f32(), finite), pixels(&reference.to_f32(), finite));
    let (start, stop, count) = options.exposures.unwrap_or_else(|| exposure_range(&truth));
    let step = if count > 1 { (stop - start) / (count - 1) as f32 } else { 0.0 };
    let viewer = Viewer::new(options.pixels_per_degree, image.width(), image.height());
    let mut map = vec![0.0f32; truth.len()];
    for index in 0..count.max(1) {
        let factor = libm::exp2f(start + index as f32 * step);
        let exposed = |pixels: &[[f32; 3]]| -> Vec<[f32; 3]> {
            pixels.iter().map(|pixel| pixel.map(|value| aces(value * factor).clamp(0.0, 1.0))).collect()
        };
        for (largest, value) in map.iter_mut().zip(viewer.difference(&exposed(&test), &exposed(&truth))) {
            *largest = largest.max(value);
        }
    }
    Ok(finish(image.width(), image.height(), map, Some((start, stop, count))))
}

fn pair(image: &Image, reference: &Image) -> Result<(Image, Image), CompareError> {
    let (image, reference) = comparable(image, reference)?;
    if image.channel_count() != 3 {
        return Err(CompareError::Channels(image.channels().to_vec(), reference.channels().to_vec()));
    }
    Ok((image, reference))
}

fn pixels(samples: &[f32], f: impl Fn(f32) -> f32) -> Vec<[f32; 3]> {
    samples.chunks_exact(3).map(|pixel| [f(pixel[0]), f(pixel[1]), f(pixel[2])]).collect()
}

fn finish(width: usize, height: usize, map: Vec<f32>, exposures: Option<(f32, f32, usize)>) -> Flip {
    let mean = map.iter().map(|&value| f64::from(value)).sum::<f64>() / map.len() as f64;
    let mut pixels = map.into_iter();
    let map = Image::from_fn(width, height, ["FLIP"], |_, _| [pixels.next().unwrap_or(0.0)]);
    Flip { map, mean, exposures }
}

// Narkowicz 2015, with the exposure of 0.6 that FLIP puts before it: numerator and denominator of the fit.
const ACES: [f64; 6] = [0.36 * 2.51, 0.6 * 0.03, 0.0, 0.36 * 2.43, 0.6 * 0.59, 0.14];

fn aces(value: f32) -> f32 {
    // Far up the fit is flat; its squares would overflow.
    let x = value.min(1e15);
    let [a, b, c, d, e, f] = ACES.map(|k| k as f32);
    ((a * x + b) * x + c) / ((d * x + e) * x + f)
}

/// Exposures at which the reference's brightest and its median luminance reach 85 % of white.
fn exposure_range(reference: &[[f32; 3]]) -> (f32, f32, usize) {
    let mut luminances: Vec<f32> = reference.iter().map(|&pixel| xyz_from_rgb(pixel)[1]).collect();
    luminances.sort_unstable_by(f32::total_cmp);
    let (Some(&brightest), count) = (luminances.last(), luminances.len()) else { return (0.0, 0.0, 1) };
    let median =
        if count % 2 == 1 { luminances[count / 2] } else { 0.5 * (luminances[count / 2 - 1] + luminances[count / 2]) };
    let white = 0.85;
    let [a, b, c] = [ACES[0] - white * ACES[3], ACES[1] - white * ACES[4], ACES[2] - white * ACES[5]];
    let bright = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
    // A black reference (or one more than half black) has no stops to find.
    let stops = |luminance: f32| libm::log2(bright / f64::from(luminance).max(1e-10)) as f32;
    let (start, stop) = (stops(brightest), stops(median));
    (start, stop, ((stop - start).ceil() as usize).max(2))
}

fn xyz_from_rgb([r, g, b]: [f32; 3]) -> [f32; 3] {
    [
        (10_135_552.0 / 24_577_794.0) * r + (8_788_810.0 / 24_577_794.0) * g + (4_435_075.0 / 24_577_794.0) * b,
        (2_613_072.0 / 12_288_897.0) * r + (8_788_810.0 / 12_288_897.0) * g + (887_015.0 / 12_288_897.0) * b,
        (1_425_312.0 / 73_733_382.0) * r + (8_788_810.0 / 73_733_382.0) * g + (70_074_185.0 / 73_733_382.0) * b,
    ]
}

fn rgb_from_xyz([x, y, z]: [f32; 3]) -> [f32; 3] {
    [
        3.241_003_3 * x - 1.537_398_9 * y - 0.498_615_86 * z,
        -0.969_224_3 * x + 1.875_930_1 * y + 0.041_554_224 * z,
        0.055_639_423 * x - 0.204_011_2 * y + 1.057_148_9 * z,
    ]
}

const WHITE: [f32; 3] = [0.950_428_55, 1.0, 1.088_900_4];

/// The linearised opponent space in which contrast sensitivity is applied.
fn opponent_from_rgb(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = xyz_from_rgb(rgb);
    let (x, z) = (x / WHITE[0], z / WHITE[2]);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn rgb_from_opponent([luma, red_green, blue_yellow]: [f32; 3]) -> [f32; 3] {
    let y = (luma + 16.0) / 116.0;
    rgb_from_xyz([(y + red_green / 500.0) * WHITE[0], y, (y - blue_yellow / 200.0) * WHITE[2]])
}

/// CIELAB with the Hunt effect: chroma fades with lightness.
fn hunt_lab(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = xyz_from_rgb(rgb);
    let compress = |t: f32| {
        let delta = 6.0f32 / 29.0;
        if t > delta * delta * delta { libm::cbrtf(t) } else { t / (3.0 * delta * delta) + 4.0 / 29.0 }
    };
    let (x, y, z) = (compress(x / WHITE[0]), compress(y), compress(z / WHITE[2]));
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// Abasi et al. 2020: city block in lightness, Euclid in chroma.
fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    let (da, db) = (a[1] - b[1], a[2] - b[2]);
    (a[0] - b[0]).abs() + (da * da + db * db).sqrt()
}

const COLOUR_EXPONENT: f32 = 0.7;

/// The filters of one viewing condition and picture size.
struct Viewer {
    width: usize,
    height: usize,
    /// Contrast sensitivity of luminance, red-green, and the two parts of blue-yellow; each normalised to sum 1.
    luma: Vec<f32>,
    red_green: Vec<f32>,
    blue_yellow: [Vec<f32>; 2],
    /// What each part of the blue-yellow filter weighs.
    blue_yellow_shares: [f32; 2],
    /// Gaussian, its first and its second derivative, for edges and points.
    blur: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
    largest_colour_difference: f32,
}

impl Viewer {
    fn new(pixels_per_degree: f32, width: usize, height: usize) -> Self {
        let ppd = f64::from(pixels_per_degree);
        let pi = std::f64::consts::PI;
        let radius = (3.0 * (0.04 / (2.0 * pi * pi)).sqrt() * ppd).ceil() as i32;
        // A two-dimensional a sqrt(pi / b) exp(-pi^2 d^2 / b) is the product of two one-dimensional ones.
        let gaussian = |b: f64| -> Vec<f64> {
            let at = |i: i32| libm::exp(-pi * pi * f64::from(i * i) / (ppd * ppd) / b);
            (-radius..=radius).map(at).collect()
        };
        let normalised = |kernel: &[f64]| -> Vec<f32> {
            let sum: f64 = kernel.iter().sum();
            kernel.iter().map(|value| (value / sum) as f32).collect()
        };
        let parts = [gaussian(0.04), gaussian(0.025)];
        let mass = |a: f64, b: f64, kernel: &[f64]| {
            let sum: f64 = kernel.iter().sum();
            a * (pi / b).sqrt() * sum * sum
        };
        let masses = [mass(34.1, 0.04, &parts[0]), mass(13.5, 0.025, &parts[1])];

        // Features are half as wide as a tenth of a degree or so: the paper's w = 0.082.
        let deviation = 0.5 * 0.082 * ppd;
        let reach = (3.0 * deviation).ceil() as i32;
        let bell = |i: i32| libm::exp(-f64::from(i * i) / (2.0 * deviation * deviation));
        // Positive and negative lobes each sum to 1.
        let balanced = |kernel: Vec<f64>| -> Vec<f32> {
            let positive: f64 = kernel.iter().filter(|&&value| value > 0.0).sum();
            let negative: f64 = -kernel.iter().filter(|&&value| value < 0.0).sum::<f64>();
            kernel.iter().map(|&value| (value / if value > 0.0 { positive } else { negative }) as f32).collect()
        };
        let span = || -reach..=reach;
        let second = |i: i32| (f64::from(i * i) / (deviation * deviation) - 1.0) * bell(i);

        let extreme = hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0]));
        Self {
            width,
            height,
            luma: normalised(&gaussian(0.0047)),
            red_green: normalised(&gaussian(0.0053)),
            blue_yellow: [normalised(&parts[0]), normalised(&parts[1])],
            blue_yellow_shares: masses.map(|mass| (mass / (masses[0] + masses[1])) as f32),
            blur: normalised(&span().map(bell).collect::<Vec<_>>()),
            edge: balanced(span().map(|i| -f64::from(i) * bell(i)).collect()),
            point: balanced(span().map(second).collect()),
            largest_colour_difference: libm::powf(extreme, COLOUR_EXPONENT),
        }
    }

    /// FLIP of two pictures of linear values in [0, 1].
    fn difference(&self, test: &[[f32; 3]], reference: &[[f32; 3]]) -> Vec<f32> {
        let (test, reference) = (self.seen(test), self.seen(reference));
        let magnitude = |pair: [f32; 2]| (pair[0] * pair[0] + pair[1] * pair[1]).sqrt();
        let (break_point, break_value) = (0.4 * self.largest_colour_difference, 0.95);
        (0..self.width * self.height)
            .map(|i| {
                let colour = libm::powf(hyab(test.lab[i], reference.lab[i]), COLOUR_EXPONENT);
                let colour = if colour < break_point {
                    break_value / break_point * colour
                } else {
                    let rest = (colour - break_point) / (self.largest_colour_difference - break_point);
                    break_value + rest * (1.0 - break_value)
                };
                let edges = (magnitude(test.edges[i]) - magnitude(reference.edges[i])).abs();
                let points = (magnitude(test.points[i]) - magnitude(reference.points[i])).abs();
                let features = (edges.max(points) * std::f32::consts::FRAC_1_SQRT_2).sqrt().min(1.0);
                if colour <= 0.0 { 0.0 } else { libm::powf(colour, 1.0 - features) }
            })
            .collect()
    }

    /// What the eye makes of a picture: blurred colours, and edges and points of its luminance.
    fn seen(&self, picture: &[[f32; 3]]) -> Seen {
        let opponent: Vec<[f32; 3]> = picture.iter().map(|&rgb| opponent_from_rgb(rgb)).collect();
        let plane = |channel: usize| -> Vec<f32> { opponent.iter().map(|pixel| pixel[channel]).collect() };
        let luma = self.convolve(&plane(0), &self.luma, &self.luma);
        let red_green = self.convolve(&plane(1), &self.red_green, &self.red_green);
        let yellow = plane(2);
        let wide = self.convolve(&yellow, &self.blue_yellow[0], &self.blue_yellow[0]);
        let narrow = self.convolve(&yellow, &self.blue_yellow[1], &self.blue_yellow[1]);
        let [wide_share, narrow_share] = self.blue_yellow_shares;
        let lab = (0..picture.len())
            .map(|i| {
                let yellow = wide_share * wide[i] + narrow_share * narrow[i];
                let rgb = rgb_from_opponent([luma[i], red_green[i], yellow]);
                hunt_lab(rgb.map(|value| value.clamp(0.0, 1.0)))
            })
            .collect();
        let grey: Vec<f32> = opponent.iter().map(|pixel| (pixel[0] + 16.0) / 116.0).collect();
        let both = |kernel: &[f32]| -> Vec<[f32; 2]> {
            let across = self.convolve(&grey, kernel, &self.blur);
            let down = self.convolve(&grey, &self.blur, kernel);
            across.into_iter().zip(down).map(|(across, down)| [across, down]).collect()
        };
        Seen { lab, edges: both(&self.edge), points: both(&self.point) }
    }

    /// The plane filtered by one kernel along rows and another along columns; edges are continued outwards.
    fn convolve(&self, plane: &[f32], across: &[f32], down: &[f32]) -> Vec<f32> {
        let (width, height) = (self.width, self.height);
        let reach = across.len() / 2;
        let mut rows = vec![0.0f32; plane.len()];
        let mut padded = Vec::with_capacity(width + 2 * reach);
        for (row, output) in plane.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
            padded.clear();
            padded.extend(std::iter::repeat_n(row[0], reach));
            padded.extend_from_slice(row);
            padded.extend(std::iter::repeat_n(row[width - 1], reach));
            for (offset, &weight) in across.iter().enumerate() {
                for (sum, &value) in output.iter_mut().zip(&padded[offset..]) {
                    *sum += weight * value;
                }
            }
        }
        let reach = down.len() / 2;
        let mut result = vec![0.0f32; plane.len()];
        for (y, output) in result.chunks_exact_mut(width).enumerate() {
            for (offset, &weight) in down.iter().enumerate() {
                let from = (y + offset).saturating_sub(reach).min(height - 1);
                for (sum, &value) in output.iter_mut().zip(&rows[from * width..]) {
                    *sum += weight * value;
                }
            }
        }
        result
    }
}

struct Seen {
    lab: Vec<[f32; 3]>,
    edges: Vec<[f32; 2]>,
    points: Vec<[f32; 2]>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ramps with a checkerboard, and the same with noise and stripes; f64 as in the script that made the goldens.
    fn pictures() -> (Image, Image) {
        let make = |noisy: bool| {
            Image::from_fn(96, 64, ["R", "G", "B"], |x, y| {
                let base = [x as f64 / 95.0, y as f64 / 63.0, ((x / 8 + y / 8) % 2) as f64 * 0.6 + 0.2];
                std::array::from_fn(|c| {
                    let noise = ((x * 31 + y * 17 + x * y * 5 + c * 101) * 7919 % 1009) as f64 / 1009.0;
                    let noise = if x > 40 { 0.2 * (noise - 0.5) } else { 0.0 };
                    let stripes = if y > 30 { 0.1 * ((x / 4) % 2) as f64 } else { 0.0 };
                    (if noisy { base[c] + noise + stripes } else { base[c] }).clamp(0.0, 1.0) as f32
                })
            })
        };
        (make(true), make(false))
    }

    fn brightened(image: &Image) -> Image {
        let samples = image.to_f32();
        let scaled = samples.iter().enumerate().map(|(i, &value)| {
            let x = (i / 3 % 96) as f64;
            (f64::from(value) * (x / 16.0 - 2.0).exp2()) as f32
        });
        Image::from_f32(96, 64, &["R", "G", "B"], scaled.collect()).unwrap()
    }

    /// Goldens: flip-evaluator 1.7 from PyPI on the same pictures. Means to 2e-4, single pixels to 1e-3.
    #[test]
    fn agrees_with_the_authors_program() {
        const PLACES: [(usize, usize); 5] = [(0, 0), (50, 10), (60, 40), (95, 63), (41, 31)];
        let check = |found: &Flip, mean: f64, pixels: [f32; 5]| {
            assert!((found.mean - mean).abs() < 2e-4, "mean {}, {mean} expected", found.mean);
            for ((x, y), expected) in PLACES.into_iter().zip(pixels) {
                let value = found.map.get(x, y, 0);
                assert!((value - expected).abs() < 1e-3, "({x}, {y}): {value}, {expected} expected");
            }
        };
        let (test, reference) = pictures();
        let options = FlipOptions::default();
        let ldr = flip_ldr(&test, &reference, &options).unwrap();
        check(&ldr, 0.127_102_42, [0.0, 0.091_905_914, 0.291_801_42, 0.340_235_89, 0.050_995_342]);

        let (test, reference) = (brightened(&test), brightened(&reference));
        let hdr = flip_hdr(&test, &reference, &options).unwrap();
        check(&hdr, 0.147_117_57, [0.0, 0.199_547_63, 0.227_070_21, 0.342_686_53, 0.055_987_187]);
        let (start, stop, count) = hdr.exposures.unwrap();
        assert!((start + 2.768_369_4).abs() < 1e-4 && (stop - 1.253_281_4).abs() < 1e-4 && count == 5);
        let fixed = FlipOptions { exposures: Some((-2.0, 1.0, 3)), ..options };
        assert!((flip_hdr(&test, &reference, &fixed).unwrap().mean - 0.139_813_23).abs() < 2e-4);
    }

    #[test]
    fn agrees_at_other_distances_and_for_black() {
        let (test, reference) = pictures();
        let near = FlipOptions { pixels_per_degree: 40.0, ..FlipOptions::default() };
        assert!((flip_ldr(&test, &reference, &near).unwrap().mean - 0.155_152_28).abs() < 2e-4);
        let black = Image::new(96, 64, &["R", "G", "B"]);
        let mean = flip_ldr(&black, &reference, &FlipOptions::default()).unwrap().mean;
        assert!((mean - 0.973_644_2).abs() < 2e-4, "{mean}");
        assert_eq!(flip_ldr(&test, &test, &near).unwrap().mean, 0.0);
        assert!(flip_hdr(&black, &black, &near).unwrap().mean == 0.0);
        assert!(flip_hdr(&brightened(&test), &black, &near).unwrap().mean.is_finite());
    }
}
