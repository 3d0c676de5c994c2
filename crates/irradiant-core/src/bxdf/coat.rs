//! A clear coat, worked out in advance: how much light enters, how much comes back out, how much stays in.
//!
//! Over a *diffuse* base the random walk between coat and base has a closed form, because the base forgets where light
//! came from. With no scattering matter between (but absorption `exp(-thickness/|cos|)` per crossing, as pbrt-v4):
//!
//! ```text
//! f(wo, wi) = f_coat(wo, wi) + A(wo) A(wi) / eta^2  R / pi  (1 + R K + (R K)^2 + ...)
//! ```
//!
//! `A(w)` is the fraction of light from `w` that reaches the base unscattered, `K` the fraction of diffuse light from the
//! base that the coat returns to it, `R` the base's reflectance. A series of n terms is what a walk of depth 2 n sums.
//! `A` is smooth in `sqrt(cos)`; for a rough coat it is tabulated when the scene is compiled, `K` always.
//!
//! **Two kinds of weights.** pbrt-v4's `LayeredBxDF::f` combines two ways of leaving a rough coat by multiple importance
//! sampling, with the density of `wi` given the inner direction where that of the inner direction given `wi` belongs:
//! its weights do not sum to 1 and it evaluates up to 15 % (roughness 0.15) too bright, while its *sampled* paths are
//! right (its issue #187 observes the disagreement). [`CoatWeights::Pbrt`] tabulates exactly that expectation for
//! evaluation and draws right samples, so that images agree; [`CoatWeights::Exact`] is right both ways.

use super::dielectric::Dielectric;
use super::fresnel::fresnel_dielectric;
use super::microfacet::Ggx;
use super::{Sides, TransportMode};
use irradiant_math::elementary::exp;
use irradiant_math::{Point2, Vec3};
use std::f32::consts::{FRAC_1_PI, PI};

/// Nodes of the table, equally spaced in `sqrt(cos)` over [0, 1].
const NODES: usize = 20;
/// With one more on either side for the cubic.
const STORED: usize = NODES + 2;
const SCALE: f32 = 40_000.0;

/// How evaluation weighs the ways out of a rough coat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoatWeights {
    /// Right: evaluation and sampling agree.
    Exact,
    /// As pbrt-v4: evaluation by light sampling is brighter than the truth by a few per cent for rough coats.
    Pbrt,
}

/// How the coat's transmission is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CoatForm {
    /// Smooth: by Fresnel's formula.
    Smooth,
    /// Rough and isotropic: by table.
    Tabulated,
    /// By random walk only.
    Unknown,
}

/// `A` of the module's front at nodes of `sqrt(cos)`, in units of 1/[`SCALE`].
type Table = [u16; STORED];

/// A clear interface over a base, with what the closed form needs. Compile once, copy into each hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    pub(super) interface: Dielectric,
    pub(super) thickness: f32,
    /// K: diffuse light returned to the base per trip through the coat, absorption of both crossings included.
    pub(super) internal_reflectance: f32,
    pub(super) form: CoatForm,
    pub(super) weights: CoatWeights,
    enter: Table,
    exit: Table,
}

impl Coat {
    /// The coat of an interface and a thickness (in mean free paths, >= 0), tabulated if that is possible.
    ///
    /// Smooth coats cost microseconds, rough ones some ten milliseconds: do it once per material. Anisotropic coats are
    /// left to the random walk. Rough coats with alpha below 0.005 are always [`CoatWeights::Exact`]: pbrt-v4's own
    /// deviation is then below 0.7 % at 80 degrees and 0.1 % at normal incidence.
    pub fn new(eta: f32, facets: Ggx, thickness: f32, weights: CoatWeights) -> Self {
        let mut coat = Self::walked(eta, facets, thickness, weights);
        if coat.interface.is_specular() {
            coat.form = CoatForm::Smooth;
            coat.weights = CoatWeights::Exact;
            coat.internal_reflectance = coat.smooth_internal_reflectance();
        } else if facets.is_isotropic() {
            coat.form = CoatForm::Tabulated;
            let alpha = facets.alphas()[0];
            if alpha < 0.005 {
                coat.weights = CoatWeights::Exact;
            }
            let points = if alpha < 0.02 { 1024 } else { 4096 };
            // Both kinds of weights from the same samples, which is what takes the time.
            let mut at_nodes = [[0.0; 2]; NODES];
            for (i, values) in at_nodes.iter_mut().enumerate().skip(1) {
                *values = coat.transmission(node(i), points, coat.weights);
            }
            coat.enter = table(|i| at_nodes[i][0]);
            coat.exit = table(|i| at_nodes[i][1]);
            coat.internal_reflectance = coat.rough_internal_reflectance();
        }
        coat
    }

    /// A coat without precomputation: evaluated by random walk. For coats whose parameters vary over the surface.
    pub fn walked(eta: f32, facets: Ggx, thickness: f32, weights: CoatWeights) -> Self {
        Self {
            interface: Dielectric::new(eta, facets),
            thickness: if thickness > 0.0 { thickness } else { 0.0 },
            internal_reflectance: 0.0,
            form: CoatForm::Unknown,
            weights,
            enter: [0; STORED],
            exit: [0; STORED],
        }
    }

    /// A coat that loses nothing: all light it does not reflect reaches the base, and all of that comes out again
    /// from a white base. Isotropic; some ten milliseconds.
    ///
    /// `A = 1 - E` with E the coat's own albedo, and `1 - K = mean(A) / eta^2`, after Kelemen and Szirmay-Kalos 2001, "A
    /// microfacet based coupled specular-matte BRDF model". With a smooth coat this *is* the physical answer; with
    /// a rough one, energy that single scattering loses goes to the base. Reciprocal.
    pub fn lossless(eta: f32, alpha: f32) -> Self {
        let mut coat = Self::walked(eta, Ggx::new(alpha, alpha), 0.0, CoatWeights::Exact);
        if coat.interface.is_specular() {
            // Its mirror reflection is a delta, which tables of the rest know nothing of.
            return Self::new(eta, Ggx::SMOOTH, 0.0, CoatWeights::Exact);
        }
        coat.form = CoatForm::Tabulated;
        coat.enter = table(|i| (1.0 - coat.reflection(node(i), 4096)) as f32);
        coat.exit = coat.enter;
        // mean(A) = int 2 mu A(mu) dmu over the interpolated table itself, so that the furnace closes on it.
        let n = 2000;
        let mean: f64 = (0..n)
            .map(|i| (i as f64 + 0.5) / n as f64)
            .map(|mu| 2.0 * mu * f64::from(coat.enter(mu as f32)) / n as f64)
            .sum();
        let eta = f64::from(eta);
        coat.internal_reflectance = (1.0 - mean / (eta * eta)) as f32;
        coat
    }

    /// The interface.
    #[inline]
    pub fn interface(&self) -> &Dielectric {
        &self.interface
    }

    /// Whether evaluation deviates from the truth as pbrt-v4's does: rough, and [`CoatWeights::Pbrt`].
    pub fn has_pbrt_weights(&self) -> bool {
        self.weights == CoatWeights::Pbrt && !self.interface.is_specular()
    }

    /// A of the module's front: the fraction of light at this angle that reaches the base unscattered, times the squared
    /// index ratio left out. `mu` in [0, 1].
    #[inline]
    pub(super) fn enter(&self, mu: f32) -> f32 {
        match self.form {
            CoatForm::Smooth => self.smooth_transmission(mu),
            CoatForm::Tabulated => interpolate(&self.enter, mu),
            CoatForm::Unknown => 0.0,
        }
    }

    /// The same for light going out, with the coat's [`CoatWeights`].
    #[inline]
    pub(super) fn exit(&self, mu: f32) -> f32 {
        match self.form {
            CoatForm::Smooth => self.smooth_transmission(mu),
            CoatForm::Tabulated => interpolate(&self.exit, mu),
            CoatForm::Unknown => 0.0,
        }
    }

    #[inline]
    fn smooth_transmission(&self, mu: f32) -> f32 {
        let eta = self.interface.eta;
        let t = 1.0 - fresnel_dielectric(mu, eta);
        if self.thickness == 0.0 {
            return t;
        }
        let sin2_t = (1.0 - mu * mu) / (eta * eta);
        if sin2_t >= 1.0 {
            return 0.0;
        }
        t * exp(-self.thickness / (1.0 - sin2_t).sqrt())
    }

    /// Roughens the interface (biased); what was tabulated is then unknown.
    pub(super) fn regularize(&mut self) {
        let before = self.interface.facets;
        self.interface.facets.regularize();
        if before != self.interface.facets && self.interface.eta != 1.0 {
            self.form = CoatForm::Unknown;
        }
    }

    /// K of a smooth coat, by the midpoint rule in the sine's fourth-root-free variable `mu^2`.
    fn smooth_internal_reflectance(&self) -> f32 {
        // int 2 mu F e^(-2 t / mu) dmu = int F e^(-2 t / sqrt(x)) dx; F has a kink at the critical angle: split there.
        let eta = f64::from(self.interface.eta);
        let critical = (1.0 - 1.0 / (eta * eta)).clamp(0.0, 1.0);
        let n = 400;
        let t = f64::from(self.thickness);
        let mut sum = 0.0;
        for (lo, hi) in [(0.0, critical), (critical, 1.0)] {
            for i in 0..n {
                // Squared spacing tames the square root at the critical angle.
                let s = (i as f64 + 0.5) / n as f64;
                let x = lo + (hi - lo) * s * s;
                let weight = (hi - lo) * 2.0 * s / n as f64;
                let mu = x.sqrt();
                let f = if self.interface.eta == 1.0 {
                    0.0
                } else {
                    f64::from(fresnel_dielectric(-(mu as f32), self.interface.eta))
                };
                sum += weight * f * f64::from(exp((-2.0 * t / mu) as f32));
            }
        }
        sum as f32
    }

    /// K of a rough coat, by a lattice over angle and facets.
    fn rough_internal_reflectance(&self) -> f32 {
        let n = 1 << 15;
        let mut sum = 0.0f64;
        for i in 0..n {
            let [a, b, c] = lattice3(i, n);
            // Cosine-distributed from below, hence mu = sqrt(u).
            let mu = a.sqrt();
            let wo = Vec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, -mu);
            let u = Point2::new(b, c);
            if let Some(s) = self.interface.sample_interface(wo, 0.0, u, TransportMode::Radiance, Sides::Reflection) {
                let path = f64::from(self.thickness) * (1.0 / f64::from(mu) + 1.0 / f64::from(s.wi.z.abs()));
                sum += f64::from(s.weight) * f64::from(exp(-path as f32));
            }
        }
        (sum / n as f64) as f32
    }

    /// A of a rough coat at one angle, by a lattice over facets: with right weights, and with these.
    fn transmission(&self, mu: f32, points: usize, weights: CoatWeights) -> [f32; 2] {
        let w = Vec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
        let mut sums = [0.0f64; 2];
        for i in 0..points {
            let u = lattice2(i, points);
            let Some(s) =
                self.interface.sample_interface(w, 0.999_999, u, TransportMode::Importance, Sides::Transmission)
            else {
                continue;
            };
            let inside = s.wi.z.abs();
            let value = f64::from(s.weight * exp(-self.thickness / inside));
            let factor = match weights {
                CoatWeights::Exact => 1.0,
                CoatWeights::Pbrt => {
                    // Its two weights: exit direction first, against the base's cosine density; and the other way around,
                    // but against the density of going out to w instead of that of coming in from it.
                    let power = |a: f64, b: f64| a * a / (a * a + b * b);
                    let base = f64::from(inside) / std::f64::consts::PI;
                    let outward = self.interface.f_and_pdf(s.wi, w, TransportMode::Radiance, Sides::Transmission).1;
                    power(f64::from(s.pdf), base) + power(base, f64::from(outward))
                }
            };
            sums[0] += value;
            sums[1] += value * factor;
        }
        sums.map(|sum| (sum / points as f64) as f32)
    }

    /// The coat's own albedo from outside at one angle.
    fn reflection(&self, mu: f32, points: usize) -> f64 {
        if self.interface.is_specular() {
            return f64::from(fresnel_dielectric(mu, self.interface.eta));
        }
        let w = Vec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
        let sum: f64 = (0..points)
            .filter_map(|i| {
                let u = lattice2(i, points);
                self.interface.sample_interface(w, 0.0, u, TransportMode::Radiance, Sides::Reflection)
            })
            .map(|s| f64::from(s.weight))
            .sum();
        sum / points as f64
    }
}

/// The density of pbrt-v4's estimate for a coat over a diffuse base, in expectation: for weights that agree with it.
///
/// `0.1/4pi + 0.9 (reflection + |cos inside|/pi)`, the inner cosine being that of the refracted `wi`.
#[inline]
pub(super) fn pbrt_like_pdf(interface: &Dielectric, wo: Vec3, wi: Vec3) -> f32 {
    let sin2 = (1.0 - wi.z * wi.z) / (interface.eta * interface.eta);
    let inside = (1.0 - sin2).max(0.0).sqrt();
    0.1 / (4.0 * PI) + 0.9 * (interface.reflection_only_pdf(wo, wi) + inside * FRAC_1_PI)
}

/// Point `i` of `n` of a rank-1 lattice in the plane, by the golden ratio's generalisation (Roberts 2018, R2).
fn lattice2(i: usize, n: usize) -> Point2 {
    let x = (i as f64 + 0.5) / n as f64;
    let y = (0.5 + i as f64 * 0.618_033_988_749_894_9).fract();
    Point2::new(x as f32, y as f32)
}

/// Point `i` of `n` in the cube, likewise.
fn lattice3(i: usize, n: usize) -> [f32; 3] {
    let x = (i as f64 + 0.5) / n as f64;
    let y = (0.5 + i as f64 * 0.754_877_666_246_692_8).fract();
    let z = (0.5 + i as f64 * 0.569_840_290_998_053_3).fract();
    [x as f32, y as f32, z as f32]
}

/// The cosine at node `i`.
fn node(i: usize) -> f32 {
    let s = i as f32 / (NODES - 1) as f32;
    s * s
}

/// `value` of the nodes, in fixed point. The first is not asked for: at exactly grazing incidence nothing enters.
fn table(value: impl Fn(usize) -> f32) -> Table {
    let mut table = [0; STORED];
    for i in 1..NODES {
        table[i + 1] = (value(i) * SCALE + 0.5).clamp(0.0, 65_535.0) as u16;
    }
    // Even about 0; straight on beyond 1.
    table[0] = table[2];
    table[NODES + 1] = (2 * i32::from(table[NODES]) - i32::from(table[NODES - 1])).clamp(0, 65_535) as u16;
    table
}

/// Catmull-Rom in `sqrt(mu)`.
#[inline]
fn interpolate(table: &Table, mu: f32) -> f32 {
    let x = mu.clamp(0.0, 1.0).sqrt() * (NODES - 1) as f32;
    let i = (x as usize).min(NODES - 2);
    let t = x - i as f32;
    let [p, a, b, q] = [table[i], table[i + 1], table[i + 2], table[i + 3]].map(f32::from);
    let value = a + 0.5 * t * ((b - p) + t * ((2.0 * p - 5.0 * a + 4.0 * b - q) + t * (3.0 * (a - b) + q - p)));
    (value * (1.0 / SCALE)).max(0.0)
}
