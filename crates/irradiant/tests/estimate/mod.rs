//! Small pictures as numbers with error bars, and what it takes for two of them to agree.
//!
//! Scenes render with the `independent` sampler and the box filter, so that the film's own variances are exact standard
//! errors. Two pictures agree when no channel's mean over the picture, and no 4 by 4 tile of it, is further off than
//! chance allows: 4.9 joint standard errors for a mean (two-sided 1e-6), 1e-6 over all tiles together (Sidak). Each call
//! asserts its own power: the bias of the mean that would be seen with a chance of 98 % (6.9 standard errors).

#![allow(dead_code, reason = "each test binary uses its part")]

use irradiant::renderer::RenderStats;
use irradiant::{ColorMode, IntegratorChoice, MaxDepth, RenderSettings, load_text, render};
use irradiant_testkit::Tiles;

/// Standard errors that a right program exceeds with chance 1e-6.
pub const SIGMAS: f64 = 4.9;

/// How to estimate.
#[derive(Clone)]
pub struct How {
    /// Samples per pixel.
    pub spp: u32,
    /// Of the random numbers; estimates to be compared must differ in it.
    pub seed: u64,
    /// Instead of the scene's.
    pub integrator: Option<IntegratorChoice>,
    /// Instead of the scene's.
    pub max_depth: MaxDepth,
    /// Basis.
    pub color: ColorMode,
}

impl How {
    /// By the scene's own integrator without depth limit, in RGB.
    pub fn new(spp: u32, seed: u64) -> Self {
        Self { spp, seed, integrator: None, max_depth: MaxDepth::None, color: ColorMode::Rgb }
    }

    /// With another integrator.
    pub fn by(self, integrator: impl Into<IntegratorChoice>) -> Self {
        Self { integrator: Some(integrator.into()), ..self }
    }

    /// With a depth limit.
    pub fn depth(self, limit: u32) -> Self {
        Self { max_depth: MaxDepth::Limit(limit), ..self }
    }

    /// With wavelengths.
    pub fn spectral(self) -> Self {
        Self { color: ColorMode::Spectral, ..self }
    }

    /// As the library wants it.
    pub fn settings(&self) -> RenderSettings {
        RenderSettings {
            samples_per_pixel: Some(self.spp),
            seed: Some(self.seed),
            integrator: self.integrator.clone(),
            max_depth: Some(self.max_depth),
            color: self.color,
            threads: 1,
            ..RenderSettings::default()
        }
    }
}

/// A picture of means with the variances of these means.
pub struct Estimate {
    /// Pixels per row.
    pub width: usize,
    /// Linear RGB.
    pub mean: Vec<[f64; 3]>,
    /// Of each of `mean`.
    pub variance: Vec<[f64; 3]>,
    /// Scattering events on the longest path.
    pub longest_path: u32,
    /// What was done.
    pub stats: RenderStats,
    /// What the header says of the estimate.
    pub label: String,
}

/// A film of `size` by `size` pixels whose variances are exact.
pub fn film(size: u32) -> String {
    format!(
        "Film \"rgb\" \"integer xresolution\" {size} \"integer yresolution\" {size}\nPixelFilter \"box\"\nSampler \"independent\"\n"
    )
}

/// Renders; no sample may be refused.
pub fn estimate(scene: &str, how: How) -> Estimate {
    let file = load_text("test", scene, ".").unwrap_or_else(|e| panic!("{e}\n{scene}"));
    let rendering = render(&file, &how.settings()).unwrap_or_else(|e| panic!("{e}\n{scene}"));
    assert_eq!(rendering.header.samples_refused, 0, "refused samples: {:?}", rendering.stats.refused);
    let bounds = rendering.film.bounds();
    let (mut mean, mut variance) = (vec![], vec![]);
    for y in bounds.y0..bounds.y1 {
        for x in bounds.x0..bounds.x1 {
            let pixel = rendering.film.pixel(x, y);
            assert_eq!((pixel.count, pixel.square_overflow), (how.spp, 0));
            // What paths from lights bring has its own sums.
            let light = rendering.film.splat_estimate(x, y);
            let (own, spread) = (pixel.mean(), pixel.variance());
            mean.push([0, 1, 2].map(|c| own[c] + light.mean[c]));
            variance.push([0, 1, 2].map(|c| spread[c] / f64::from(how.spp) + light.variance[c]));
        }
    }
    Estimate {
        width: bounds.width(),
        mean,
        variance,
        longest_path: rendering.stats.longest_path,
        stats: rendering.stats,
        label: rendering.header.estimate,
    }
}

impl Estimate {
    /// Mean over the picture and its standard error, by channel.
    pub fn total(&self) -> [(f64, f64); 3] {
        let n = self.mean.len() as f64;
        std::array::from_fn(|c| {
            let mean = self.mean.iter().map(|p| p[c]).sum::<f64>() / n;
            (mean, self.variance.iter().map(|p| p[c]).sum::<f64>().sqrt() / n)
        })
    }

    fn channel(&self, c: usize) -> (Vec<f64>, Vec<f64>) {
        (self.mean.iter().map(|p| p[c]).collect(), self.variance.iter().map(|p| p[c]).collect())
    }
}

/// Panics unless two estimates agree and a bias of `power` (relative, of any channel's mean) would have been seen.
#[track_caller]
pub fn assert_agree(a: &Estimate, b: &Estimate, power: f64, what: &str) {
    for (c, (x, y)) in a.total().into_iter().zip(b.total()).enumerate() {
        let se = x.1.hypot(y.1);
        let visible = (SIGMAS + 2.0) * se / y.0.abs();
        told(what, c, (x.0 - y.0) / se, visible);
        assert!(visible <= power, "{what}: only a bias of {:.2} % would be seen in channel {c}", 100.0 * visible);
        assert!(
            (x.0 - y.0).abs() <= SIGMAS * se + 1e-6 * y.0.abs(),
            "{what}: channel {c} is {} +- {} and {} +- {}: z {:.2}",
            x.0,
            x.1,
            y.0,
            y.1,
            (x.0 - y.0) / se
        );
        let ((image_a, variance_a), (image_b, variance_b)) = (a.channel(c), b.channel(c));
        let report = Tiles {
            width: a.width,
            a: &image_a,
            variance_a: &variance_a,
            b: &image_b,
            variance_b: &variance_b,
            tile: 4,
            slack: 1e-6,
        }
        .compare(1e-6)
        .expect("pictures of one size");
        assert!(report.failed.is_empty(), "{what}: tiles {:?} of channel {c} are off: z {:?}", report.failed, report.z);
    }
}

/// A line for `--nocapture`.
fn told(what: &str, channel: usize, z: f64, visible: f64) {
    if channel == 1 {
        eprintln!("{what}: z {z:.2}; would see a bias of {:.2} %", 100.0 * visible);
    }
}

/// Panics unless every channel's mean is `expected` and a bias of `power` (relative) would have been seen.
#[track_caller]
pub fn assert_is(a: &Estimate, expected: [f64; 3], power: f64, what: &str) {
    for (c, (mean, se)) in a.total().into_iter().enumerate() {
        let visible = (SIGMAS + 2.0) * se / expected[c].abs();
        told(what, c, (mean - expected[c]) / se, visible);
        assert!(visible <= power, "{what}: only a bias of {:.2} % would be seen in channel {c}", 100.0 * visible);
        // f32 transport rounds by some 1e-6.
        let allowed = SIGMAS * se + 1e-5 * expected[c].abs();
        assert!(
            (mean - expected[c]).abs() <= allowed,
            "{what}: channel {c} is {mean} +- {se}, expected {}: z {:.2}",
            expected[c],
            (mean - expected[c]) / se
        );
    }
}

/// A quadrilateral as two triangles.
pub fn quad(p: [[f32; 3]; 4]) -> String {
    let list = p.iter().flatten().map(f32::to_string).collect::<Vec<_>>().join(" ");
    format!("Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 2 3 0 ] \"point3 P\" [ {list} ]\n")
}

/// A material.
pub fn diffuse(r: f32, g: f32, b: f32) -> String {
    format!("Material \"diffuse\" \"rgb reflectance\" [ {r} {g} {b} ]\n")
}

/// The cube from -1 to 1, seen from inside near its front wall, without content.
pub fn cube(colors: [[f32; 3]; 6]) -> String {
    let mut text = String::new();
    for (i, [r, g, b]) in colors.into_iter().enumerate() {
        let (axis, side) = (i / 2, if i % 2 == 0 { -1.0 } else { 1.0 });
        let corner = |u: f32, v: f32| {
            let mut p = [0.0; 3];
            p[axis] = side;
            p[(axis + 1) % 3] = u;
            p[(axis + 2) % 3] = v;
            p
        };
        text += &diffuse(r, g, b);
        text += &quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
    }
    text
}

/// A camera in [`cube`].
pub const INSIDE: &str = "LookAt 0 0 -0.95  0 -0.1 0  0 1 0\nCamera \"perspective\" \"float fov\" 70\n";

/// A diffuse box with a lamp and a diffuse ball.
pub fn lit_box() -> String {
    let walls = [[0.7, 0.3, 0.2], [0.2, 0.6, 0.3], [0.7, 0.7, 0.7], [0.5, 0.5, 0.6], [0.6, 0.6, 0.6], [0.7, 0.7, 0.7]];
    film(8)
        + INSIDE
        + "WorldBegin\n"
        + &cube(walls)
        + "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 3 2 4 ] \"bool twosided\" true\n"
        + &quad([[-0.6, 0.7, -0.5], [0.6, 0.7, -0.5], [0.6, 0.6, 0.6], [-0.6, 0.6, 0.6]])
        + "AttributeEnd\n"
        + &diffuse(0.4, 0.5, 0.8)
        + "Translate 0.3 -0.6 0.3\nShape \"sphere\" \"float radius\" 0.4\n"
}
