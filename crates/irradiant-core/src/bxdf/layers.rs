//! The random walk of light between a clear coat and an opaque base, with scattering matter between if there is any.
//!
//! Position-free (Guo, Hasan and Zhao 2018, "Position-free Monte Carlo simulation for arbitrary layered BSDFs") in the
//! form of pbrt-v4's `LayeredBxDF`, whose expectation it reproduces. Depth counts events between the interfaces as
//! there: a walk of depth n touches base and coat n/2 times each. The unit of thickness is the mean free path; light
//! crossing without scattering matter is still attenuated by `exp(-thickness/|cos|)`.
//!
//! Evaluation is stochastic and yet a pure function: the walk's random numbers come from a hash of the directions.

use super::dielectric::{Dielectric, InterfaceSample};
use super::{BsdfSample, CoatWeights, Lobe, Sides, TransportMode};
use irradiant_math::elementary::{exp, ln};
use irradiant_math::hash::{Pcg32, hash2};
use irradiant_math::warp::uniform_sphere;
use irradiant_math::{Frame, Point2, Vec3};
use irradiant_spectrum::SampledSpectrum;
use std::f32::consts::PI;

/// What lies under the coat: reflects only.
pub(super) trait Base {
    /// Whether it only mirrors.
    fn is_specular(&self) -> bool;
    /// Value and density; both directions above the base.
    fn f_and_pdf(&self, wo: Vec3, wi: Vec3) -> (SampledSpectrum, f32);
    /// A reflected direction.
    fn sample(&self, wo: Vec3, u: Point2) -> Option<BsdfSample>;
}

/// A coat, what fills it, and a base.
pub(super) struct Layers<'a, B> {
    pub top: &'a Dielectric,
    pub base: &'a B,
    pub thickness: f32,
    /// Single-scattering albedo of the filling; black if it only absorbs.
    pub albedo: SampledSpectrum,
    /// Henyey-Greenstein's g of the filling, in (-1, 1).
    pub g: f32,
    /// Events; 0 for no limit.
    pub max_depth: u16,
    /// Walks per evaluation.
    pub n_samples: u16,
    pub weights: CoatWeights,
}

/// A walk that long never happens but for a lossless, unlimited one that is trapped; it ends so that all calls return.
const LONGEST_WALK: u32 = 1 << 16;

fn random_for(a: Vec3, b: Vec3, salt: u64) -> Pcg32 {
    let key = |v: Vec3| (u64::from(v.x.to_bits()) << 32 | u64::from(v.y.to_bits())) ^ u64::from(v.z.to_bits() >> 31);
    Pcg32::new(hash2(key(a), salt), hash2(key(b), !salt))
}

#[inline]
fn power_heuristic(a: f32, b: f32) -> f32 {
    // Ratios, since squares of sharp lobes overflow.
    if a == 0.0 {
        return 0.0;
    }
    let r = b / a;
    1.0 / (1.0 + r * r)
}

#[inline]
fn transmittance(distance: f32, w: Vec3) -> f32 {
    if distance == 0.0 { 1.0 } else { exp(-(distance / w.z).abs()) }
}

/// Henyey-Greenstein, 1/sr, for directions both pointing away from the point.
#[inline]
fn phase(g: f32, cos: f32) -> f32 {
    let d = 1.0 + g * g + 2.0 * g * cos;
    (1.0 - g * g) / (4.0 * PI * d * d.max(0.0).sqrt())
}

/// A direction by [`phase`] about `wo`, with its density.
fn sample_phase(g: f32, wo: Vec3, u: Point2) -> (Vec3, f32) {
    if g.abs() < 1e-3 {
        return (uniform_sphere(u), phase(g, 0.0));
    }
    let s = (1.0 - g * g) / (1.0 + g - 2.0 * g * u.x);
    let cos = (-(1.0 + g * g - s * s) / (2.0 * g)).clamp(-1.0, 1.0);
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let (sin_phi, cos_phi) = irradiant_math::elementary::sin_cos(2.0 * PI * u.y);
    let w = Frame::from_z(wo).from_local(Vec3::new(sin * cos_phi, sin * sin_phi, cos));
    (w.normalize(), phase(g, cos))
}

impl<B: Base> Layers<'_, B> {
    #[inline]
    fn depth_limit(&self) -> u32 {
        if self.max_depth == 0 { LONGEST_WALK } else { u32::from(self.max_depth) }
    }

    #[inline]
    fn is_filled(&self) -> bool {
        !self.albedo.is_black()
    }

    /// The value for light entering and leaving at the top, without the top's own reflection.
    ///
    /// Both directions above. Mean over all random numbers is the truncated sum of all paths.
    pub fn f(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> SampledSpectrum {
        if self.base.is_specular() && self.top.is_specular() && !self.is_filled() {
            return SampledSpectrum::ZERO;
        }
        let mut random = random_for(wo, wi, 0x5eed_f00d);
        let n = self.n_samples.max(1);
        let mut sum = SampledSpectrum::ZERO;
        for _ in 0..n {
            sum += self.walk_for_value(wo, wi, mode, &mut random);
        }
        sum / f32::from(n)
    }

    fn enter(&self, w: Vec3, mode: TransportMode, random: &mut Pcg32) -> Option<InterfaceSample> {
        let u = if self.top.is_specular() { Point2::ZERO } else { random.next_2d() };
        let s = self.top.sample_interface(w, 0.0, u, mode, Sides::Transmission)?;
        (s.weight > 0.0 && s.pdf > 0.0).then_some(s)
    }

    /// Weight of a path that chose its way up to the coat first, in view of the exit `wi` leads to.
    #[inline]
    fn outward_density(&self, up: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
        match self.weights {
            CoatWeights::Exact => self.top.f_and_pdf(wi, -up, mode.flip(), Sides::Transmission).1,
            CoatWeights::Pbrt => self.top.f_and_pdf(-up, wi, mode, Sides::Transmission).1,
        }
    }

    fn walk_for_value(&self, wo: Vec3, wi: Vec3, mode: TransportMode, random: &mut Pcg32) -> SampledSpectrum {
        let mut f = SampledSpectrum::ZERO;
        let Some(first) = self.enter(wo, mode, random) else { return f };
        // The way out, chosen from the end: a virtual light inside the coat.
        let Some(last) = self.enter(wi, mode.flip(), random) else { return f };
        let top_is_specular = self.top.is_specular();
        let up = -last.wi;
        let exit_weight = last.weight * transmittance(self.thickness, up);
        let mut throughput = SampledSpectrum::splat(first.weight);
        let mut w = first.wi;
        let (mut z, top_z) = (self.thickness, self.thickness);
        for depth in 0..self.depth_limit() {
            if depth > 3 {
                let survive = throughput.max_component();
                if survive < 0.25 {
                    if random.next_f32() >= survive {
                        break;
                    }
                    throughput /= survive;
                }
            }
            if !self.is_filled() {
                throughput *= transmittance(self.thickness, w);
                z = top_z - z;
            } else {
                let dz = -ln(1.0 - random.next_f32()) * w.z.abs();
                let next = if w.z > 0.0 { z + dz } else { z - dz };
                if next == z {
                    continue;
                }
                if 0.0 < next && next < top_z {
                    // Scatter in the filling: towards the chosen exit ...
                    let p = phase(self.g, (-w).dot(up));
                    let weight = if top_is_specular { 1.0 } else { power_heuristic(last.pdf, p) };
                    f += throughput
                        * self.albedo
                        * (p * weight * transmittance(top_z - next, up) * last.weight / up.z.abs());
                    // ... and anywhere.
                    let (ws, pdf) = sample_phase(self.g, -w, random.next_2d());
                    if ws.z == 0.0 || pdf == 0.0 {
                        continue;
                    }
                    throughput *= self.albedo;
                    w = ws;
                    z = next;
                    if w.z > 0.0 && !top_is_specular {
                        f += throughput * self.leave(w, wi, mode, pdf, transmittance(top_z - z, w));
                    }
                    continue;
                }
                z = next.clamp(0.0, top_z);
            }
            let u = random.next_2d();
            if w.z > 0.0 {
                // At the coat, from below: only what stays in.
                let Some(s) = self.top.sample_interface(-w, 0.0, u, mode, Sides::Reflection) else { break };
                throughput *= s.weight;
                w = s.wi;
            } else {
                // At the base: towards the chosen exit ...
                if !self.base.is_specular() {
                    let (value, pdf) = self.base.f_and_pdf(-w, up);
                    let weight = if top_is_specular { 1.0 } else { power_heuristic(last.pdf, pdf) };
                    f += throughput * value * (weight * exit_weight);
                }
                // ... and on.
                let Some(s) = self.base.sample(-w, u) else { break };
                throughput *= s.f * (s.wi.z.abs() / s.pdf);
                w = s.wi;
                if !top_is_specular {
                    let pdf = if self.base.is_specular() { f32::INFINITY } else { s.pdf };
                    f += throughput * self.leave(w, wi, mode, pdf, transmittance(self.thickness, w));
                }
            }
            if throughput.is_black() {
                break;
            }
        }
        f
    }

    /// What a path going up along `w`, drawn with density `pdf`, sends out to `wi` through the rough coat.
    #[inline]
    fn leave(&self, w: Vec3, wi: Vec3, mode: TransportMode, pdf: f32, transmitted: f32) -> f32 {
        let value = self.top.f_and_pdf(-w, wi, mode, Sides::Transmission).0;
        if value == 0.0 {
            return 0.0;
        }
        let weight = if pdf == f32::INFINITY { 1.0 } else { power_heuristic(pdf, self.outward_density(w, wi, mode)) };
        value * weight * transmitted
    }

    /// A path in at the top from `wo` and out again: its direction and the product of its weights.
    ///
    /// The first event (reflection or entry) is drawn with `uc` and `u`, the rest from a hash of all.
    pub fn sample(&self, wo: Vec3, uc: f32, u: Point2, mode: TransportMode) -> Option<LayersSample> {
        let first = self.top.sample_interface(wo, uc, u, mode, Sides::All)?;
        let mut throughput = SampledSpectrum::splat(first.weight);
        let mut specular = first.specular;
        if first.reflection {
            return Some(LayersSample { weight: throughput, wi: first.wi, specular });
        }
        let mut random = random_for(wo, Vec3::new(u.x, u.y, 0.0), u64::from(uc.to_bits()));
        let mut w = first.wi;
        let (mut z, top_z) = (self.thickness, self.thickness);
        for depth in 0..self.depth_limit() {
            if depth > 3 {
                let survive = throughput.max_component();
                if survive < 0.25 {
                    if random.next_f32() >= survive {
                        return None;
                    }
                    throughput /= survive;
                }
            }
            if w.z == 0.0 {
                return None;
            }
            if self.is_filled() {
                let dz = -ln(1.0 - random.next_f32()) * w.z.abs();
                let next = if w.z > 0.0 { z + dz } else { z - dz };
                if next == z {
                    return None;
                }
                if 0.0 < next && next < top_z {
                    w = sample_phase(self.g, -w, random.next_2d()).0;
                    throughput *= self.albedo;
                    specular = false;
                    z = next;
                    continue;
                }
                z = next.clamp(0.0, top_z);
            } else {
                throughput *= transmittance(self.thickness, w);
                z = top_z - z;
            }
            if w.z > 0.0 {
                let uc = random.next_f32();
                let s = self.top.sample_interface(-w, uc, random.next_2d(), mode, Sides::All)?;
                throughput *= s.weight;
                specular &= s.specular;
                w = s.wi;
                if !s.reflection {
                    return Some(LayersSample { weight: throughput, wi: w, specular });
                }
            } else {
                let s = self.base.sample(-w, random.next_2d())?;
                throughput *= s.f * (s.wi.z.abs() / s.pdf);
                specular &= s.lobe.is_specular();
                w = s.wi;
            }
            if throughput.is_black() {
                return None;
            }
        }
        None
    }
}

/// Where a walk left the layers.
pub(super) struct LayersSample {
    /// `f cos / pdf`.
    pub weight: SampledSpectrum,
    pub wi: Vec3,
    /// Only mirrors on the way.
    pub specular: bool,
}

impl LayersSample {
    /// As a sample whose density is said to be `pdf(wi)`.
    #[inline]
    pub fn with_pdf(self, pdf: impl FnOnce(Vec3) -> f32) -> BsdfSample {
        let cos = self.wi.z.abs();
        if self.specular {
            let lobe = Lobe::SPECULAR_REFLECTION;
            return BsdfSample { pdf_is_proportional: true, ..BsdfSample::new(self.weight / cos, self.wi, 1.0, lobe) };
        }
        let pdf = pdf(self.wi);
        let f = self.weight * (pdf / cos);
        BsdfSample { pdf_is_proportional: true, ..BsdfSample::new(f, self.wi, pdf, Lobe::GLOSSY_REFLECTION) }
    }
}
