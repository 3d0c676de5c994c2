//! Glass, water and other clear matter: an interface that reflects and refracts, smooth or rough; and thin panes.
//!
//! Walter et al. 2007 with GGX facets, single scattering. Transmitted radiance is scaled by the squared index ratio
//! (Veach 1997, 5.2), transmitted importance is not. One index for all wavelengths: where it varies, the material ends
//! the secondary wavelengths first.

use super::fresnel::{fresnel_dielectric, reflect, refract};
use super::microfacet::Ggx;
use super::{BsdfSample, Lobe, Sides, TransportMode};
use irradiant_math::{Point2, Vec3};
use irradiant_spectrum::SampledSpectrum;

/// An interface between two clear media; the normal points into the outer one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index below the surface over the index above.
    pub(super) eta: f32,
    pub(super) facets: Ggx,
}

/// What an interface drew: [`BsdfSample`] with one number for all wavelengths, and its weight already divided.
#[derive(Clone, Copy, Debug)]
pub(super) struct InterfaceSample {
    /// `f cos / pdf`.
    pub weight: f32,
    pub wi: Vec3,
    /// Per steradian; a probability when `specular`.
    pub pdf: f32,
    pub reflection: bool,
    pub specular: bool,
    /// Transmitted over incident index; 1 for reflection.
    pub eta: f32,
}

impl InterfaceSample {
    pub(super) fn lobe(&self) -> Lobe {
        match (self.reflection, self.specular) {
            (true, true) => Lobe::SPECULAR_REFLECTION,
            (true, false) => Lobe::GLOSSY_REFLECTION,
            (false, true) => Lobe::SPECULAR_TRANSMISSION,
            (false, false) => Lobe::GLOSSY_TRANSMISSION,
        }
    }

    #[inline]
    pub(super) fn to_bsdf_sample(self) -> BsdfSample {
        let f = SampledSpectrum::splat(self.weight * self.pdf / self.wi.z.abs());
        BsdfSample { eta: self.eta, ..BsdfSample::new(f, self.wi, self.pdf, self.lobe()) }
    }
}

impl Dielectric {
    /// An interface of relative index `eta` (inside over outside) with GGX facets.
    #[inline]
    pub fn new(eta: f32, facets: Ggx) -> Self {
        Self { eta, facets }
    }

    /// Index below the surface over the index above.
    #[inline]
    pub fn eta(&self) -> f32 {
        self.eta
    }

    /// Whether all light goes in single directions: smooth facets, or nothing to refract at.
    #[inline]
    pub(super) fn is_specular(&self) -> bool {
        self.eta == 1.0 || self.facets.is_smooth()
    }

    #[inline]
    pub(super) fn flags(&self) -> Lobe {
        let kind = if self.is_specular() { Lobe::SPECULAR } else { Lobe::GLOSSY };
        let sides = if self.eta == 1.0 { Lobe::TRANSMISSION } else { Lobe::REFLECTION | Lobe::TRANSMISSION };
        sides | kind
    }

    /// Value and density of the rough lobes; zeros for a smooth interface.
    #[inline]
    pub(super) fn f_and_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode, sides: Sides) -> (f32, f32) {
        let (co, ci) = (wo.z, wi.z);
        if co == 0.0 || ci == 0.0 || self.is_specular() {
            return (0.0, 0.0);
        }
        let reflection = co * ci > 0.0;
        // Walter's half vector: wo + wi, or wo + etap wi across the interface.
        let etap = if reflection {
            1.0
        } else if co > 0.0 {
            self.eta
        } else {
            1.0 / self.eta
        };
        let h = wi * etap + wo;
        let length_squared = h.length_squared();
        if length_squared == 0.0 {
            return (0.0, 0.0);
        }
        let m = h / length_squared.sqrt();
        let m = if m.z < 0.0 { -m } else { m };
        // Facets seen from behind do not count.
        let (dot_o, dot_i) = (wo.dot(m), wi.dot(m));
        if dot_o * co < 0.0 || dot_i * ci < 0.0 {
            return (0.0, 0.0);
        }
        let fresnel = fresnel_dielectric(dot_o, self.eta);
        let (pr, pt) =
            (if sides.reflection() { fresnel } else { 0.0 }, if sides.transmission() { 1.0 - fresnel } else { 0.0 });
        let d = self.facets.d(m);
        let (so, si) = (self.facets.stretch(wo), self.facets.stretch(wi));
        let (co, ci) = (co.abs(), ci.abs());
        // G2 / (cos cos) and G1 / cos.
        let pair = 2.0 / (so * ci + si * co);
        let single = 2.0 / (co + so);
        if reflection {
            let f = 0.25 * d * fresnel * pair;
            let pdf = if pr > 0.0 { 0.25 * d * single * (pr / (pr + pt)) } else { 0.0 };
            (f, pdf)
        } else {
            let denominator = dot_i + dot_o / etap;
            let jacobian = dot_i.abs() / (denominator * denominator);
            let scale = match mode {
                TransportMode::Radiance => 1.0 / (etap * etap),
                TransportMode::Importance => 1.0,
            };
            let common = d * dot_o.abs() * jacobian;
            let f = (1.0 - fresnel) * common * pair * scale;
            let pdf = if pt > 0.0 { common * single * (pt / (pr + pt)) } else { 0.0 };
            (f, pdf)
        }
    }

    /// The density of the rough reflection lobe if only reflection is drawn, per steradian.
    #[inline]
    pub(super) fn reflection_only_pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let h = wo + wi;
        let length_squared = h.length_squared();
        if self.is_specular() || wo.z * wi.z <= 0.0 || length_squared == 0.0 {
            return 0.0;
        }
        self.facets.visible_reflection_pdf(wo, h / length_squared.sqrt())
    }

    #[inline]
    pub(super) fn sample_interface(
        &self,
        wo: Vec3,
        uc: f32,
        u: Point2,
        mode: TransportMode,
        sides: Sides,
    ) -> Option<InterfaceSample> {
        let specular = self.is_specular();
        let m = if specular { Vec3::Z } else { self.facets.sample_visible(wo, u) };
        let fresnel = if self.eta == 1.0 { 0.0 } else { fresnel_dielectric(wo.dot(m), self.eta) };
        let (pr, pt) =
            (if sides.reflection() { fresnel } else { 0.0 }, if sides.transmission() { 1.0 - fresnel } else { 0.0 });
        if pr + pt == 0.0 {
            return None;
        }
        let probability = pr / (pr + pt);
        let reflection = uc < probability;
        let (wi, eta, mut weight, mut pdf) = if reflection {
            let wi = if specular { Vec3::new(-wo.x, -wo.y, wo.z) } else { reflect(wo, m) };
            if wo.z * wi.z <= 0.0 {
                return None;
            }
            (wi, 1.0, fresnel / probability, probability)
        } else {
            let (wi, eta) = refract(wo, m, self.eta)?;
            if wo.z * wi.z >= 0.0 {
                return None;
            }
            let probability = pt / (pr + pt);
            let scale = match mode {
                TransportMode::Radiance => 1.0 / (eta * eta),
                TransportMode::Importance => 1.0,
            };
            (wi, eta, (1.0 - fresnel) / probability * scale, probability)
        };
        if !specular {
            let dot_o = wo.dot(m).abs();
            weight *= self.facets.g2_over_g1(wo, wi);
            pdf *= self.facets.visible_pdf(wo, m);
            if reflection {
                pdf /= 4.0 * dot_o;
            } else {
                let dot_i = wi.dot(m).abs();
                let denominator = dot_i - dot_o / eta;
                pdf *= dot_i / (denominator * denominator);
            }
        }
        Some(InterfaceSample { weight, wi, pdf, reflection, specular, eta })
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, uc: f32, u: Point2, mode: TransportMode, sides: Sides) -> Option<BsdfSample> {
        Some(self.sample_interface(wo, uc, u, mode, sides)?.to_bsdf_sample())
    }
}

/// A thin clear pane: light passes straight on or is mirrored, all reflections between its faces summed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinDielectric {
    eta: f32,
}

impl ThinDielectric {
    /// A pane of relative index `eta`.
    #[inline]
    pub fn new(eta: f32) -> Self {
        Self { eta }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, uc: f32, sides: Sides) -> Option<BsdfSample> {
        let cos = wo.z.abs();
        let single = fresnel_dielectric(cos, self.eta);
        // R + T R T + T R^3 T + ... = 2 R / (1 + R).
        let r = 2.0 * single / (1.0 + single);
        let t = 1.0 - r;
        let (pr, pt) = (if sides.reflection() { r } else { 0.0 }, if sides.transmission() { t } else { 0.0 });
        if pr + pt == 0.0 {
            return None;
        }
        let probability = pr / (pr + pt);
        Some(if uc < probability {
            let wi = Vec3::new(-wo.x, -wo.y, wo.z);
            BsdfSample::new(SampledSpectrum::splat(r / cos), wi, probability, Lobe::SPECULAR_REFLECTION)
        } else {
            let f = SampledSpectrum::splat(t / cos);
            BsdfSample::new(f, -wo, pt / (pr + pt), Lobe::SPECULAR_TRANSMISSION)
        })
    }
}
