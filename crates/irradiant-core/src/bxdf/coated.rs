//! Plastic, varnish, lacquer: a clear coat over a diffuse base or over a metal. Two-sided.
//!
//! | parameter | meaning | pbrt-v4's default |
//! |---|---|---|
//! | coat | index, facets, thickness in mean free paths | 1.5, smooth, 0.01 |
//! | filling | single-scattering albedo and g of what fills the coat | 0, 0 |
//! | limits | events of a walk between the layers (0: all), walks per evaluation | 10, 1 |
//!
//! Expected values are pbrt-v4's `CoatedDiffuseBxDF` and `CoatedConductorBxDF`. A diffuse base under an unfilled coat
//! with a table has a closed form (see [`coat`](super::coat)), free of noise and much faster; everything else walks.

use super::coat::{Coat, CoatForm, CoatWeights, pbrt_like_pdf};
use super::conductor::Conductor;
use super::dielectric::Dielectric;
use super::diffuse::Diffuse;
use super::fresnel::fresnel_dielectric;
use super::layers::{Base, Layers};
use super::microfacet::Ggx;
use super::{BsdfSample, Lobe, Sides, TransportMode};
use irradiant_math::warp::cosine_hemisphere;
use irradiant_math::{Point2, Vec3};
use irradiant_spectrum::SampledSpectrum;
use std::f32::consts::{FRAC_1_PI, PI};

/// Scattering matter within a coat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filling {
    /// Single-scattering albedo, in [0, 1]; black for none.
    pub albedo: SampledSpectrum,
    /// Henyey-Greenstein asymmetry, in (-1, 1).
    pub g: f32,
}

impl Filling {
    /// Nothing scatters within the coat.
    pub const NONE: Self = Self { albedo: SampledSpectrum::ZERO, g: 0.0 };
}

/// How far light is followed between the layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WalkLimits {
    /// Events between entering and leaving; 0 for no limit. A limit loses energy: 10 keeps 0.927 of a white, smooth,
    /// lossless coat's light at normal incidence.
    pub max_depth: u16,
    /// Walks per evaluation, at least 1.
    pub n_samples: u16,
}

impl WalkLimits {
    /// pbrt-v4's: depth 10, one walk.
    pub const PBRT: Self = Self { max_depth: 10, n_samples: 1 };
    /// All paths.
    pub const UNLIMITED: Self = Self { max_depth: 0, n_samples: 1 };

    /// Bounces off the base that are summed, `None` for all.
    fn base_bounces(self) -> Option<u32> {
        (self.max_depth > 0).then(|| u32::from(self.max_depth).div_ceil(2))
    }
}

/// A clear coat over a diffuse base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoatedDiffuse {
    coat: Coat,
    /// `R/pi / eta^2 (1 + R K + ...)`.
    series: SampledSpectrum,
    reflectance: SampledSpectrum,
    filling: Filling,
    limits: WalkLimits,
    closed: bool,
}

/// Up to which there is one orientation only: the pair with `wo` above.
#[inline]
fn upright(wo: Vec3, wi: Vec3) -> (Vec3, Vec3) {
    if wo.z < 0.0 { (-wo, -wi) } else { (wo, wi) }
}

impl CoatedDiffuse {
    /// A base of this reflectance, in [0, 1], under a coat.
    #[inline]
    pub fn new(coat: &Coat, reflectance: SampledSpectrum, filling: Filling, limits: WalkLimits) -> Self {
        let eta = coat.interface.eta;
        let scale = FRAC_1_PI / (eta * eta);
        let k = coat.internal_reflectance;
        let series = match limits.base_bounces() {
            None => reflectance.map(|r| scale * r / (1.0 - r * k)),
            Some(n) => reflectance.map(|r| {
                // Horner's form of 1 + x + ... + x^(n-1); n is 5 by default.
                let x = r * k;
                let sum = if n <= 8 {
                    (1..n).fold(1.0, |sum, _| 1.0 + x * sum)
                } else {
                    (1.0 - irradiant_math::elementary::powi(x, n)) / (1.0 - x)
                };
                scale * r * sum
            }),
        };
        let closed = coat.form != CoatForm::Unknown && filling.albedo.is_black();
        Self { coat: *coat, series, reflectance, filling, limits, closed }
    }

    pub(super) fn coat(&self) -> &Coat {
        &self.coat
    }

    pub(super) fn reflectance(&self) -> SampledSpectrum {
        self.reflectance
    }

    pub(super) fn flags(&self) -> Lobe {
        let mut flags = Lobe::REFLECTION;
        if self.coat.interface.is_specular() {
            flags |= Lobe::SPECULAR;
        }
        if !self.reflectance.is_black() || !self.filling.albedo.is_black() {
            flags |= Lobe::DIFFUSE;
        } else if !self.coat.interface.is_specular() {
            flags |= Lobe::GLOSSY;
        }
        flags
    }

    fn layers<'a>(&'a self, base: &'a Diffuse) -> Layers<'a, Diffuse> {
        Layers {
            top: &self.coat.interface,
            base,
            thickness: self.coat.thickness,
            albedo: self.filling.albedo,
            g: self.filling.g,
            max_depth: self.limits.max_depth,
            n_samples: self.limits.n_samples,
            weights: self.coat.weights,
        }
    }

    /// The chance with which the closed form's sampler takes the coat's own reflection.
    #[inline]
    fn coat_probability(&self, wo: Vec3, enter: f32) -> f32 {
        let coat = &self.coat;
        let eta2 = coat.interface.eta * coat.interface.eta;
        let reflected = if coat.interface.eta == 1.0 { 0.0 } else { fresnel_dielectric(wo.z, coat.interface.eta) };
        let base = enter * self.series.max_component() * PI * eta2 * (1.0 - coat.internal_reflectance);
        if reflected + base > 0.0 { reflected / (reflected + base) } else { 0.0 }
    }

    /// The coat's own lobe: value, and the density of its sampler.
    #[inline]
    fn coat_lobe(&self, wo: Vec3, wi: Vec3) -> (f32, f32) {
        let interface = &self.coat.interface;
        if self.coat.form == CoatForm::Smooth {
            return (0.0, 0.0);
        }
        let h = wo + wi;
        let m = h / h.length();
        let value = fresnel_dielectric(wo.dot(m), interface.eta) * interface.facets.reflection(wo, wi, m);
        (value, interface.facets.bounded_pdf(wo, m))
    }

    /// Value with this transmission on the way out, and the sampler's density; both directions above.
    #[inline]
    fn closed_form(&self, wo: Vec3, wi: Vec3, exit: f32) -> (SampledSpectrum, f32) {
        let enter = self.coat.enter(wo.z);
        let (coat, coat_pdf) = self.coat_lobe(wo, wi);
        let p = self.coat_probability(wo, enter);
        let f = self.series * (enter * exit) + coat;
        (f, p * coat_pdf + (1.0 - p) * wi.z * FRAC_1_PI)
    }

    /// The density for walks: any positive function will do, this one is near.
    #[inline]
    fn walk_pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if self.coat.weights == CoatWeights::Pbrt {
            return pbrt_like_pdf(&self.coat.interface, wo, wi);
        }
        let fresnel = fresnel_dielectric(wo.z, self.coat.interface.eta);
        let coat = self.coat.interface.reflection_only_pdf(wo, wi);
        0.1 / (2.0 * PI) + 0.9 * (fresnel * coat + (1.0 - fresnel) * wi.z * FRAC_1_PI)
    }

    #[inline]
    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let (wo, wi) = upright(wo, wi);
        if wi.z <= 0.0 {
            0.0
        } else if !self.closed {
            self.walk_pdf(wo, wi)
        } else if self.coat.weights == CoatWeights::Pbrt {
            pbrt_like_pdf(&self.coat.interface, wo, wi)
        } else {
            self.closed_form(wo, wi, 0.0).1
        }
    }

    #[inline]
    pub(super) fn f_and_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (SampledSpectrum, f32) {
        let (wo, wi) = upright(wo, wi);
        if wi.z <= 0.0 {
            return (SampledSpectrum::ZERO, 0.0);
        }
        if self.closed {
            let (f, pdf) = self.closed_form(wo, wi, self.coat.exit(wi.z));
            return match self.coat.weights {
                CoatWeights::Exact => (f, pdf),
                CoatWeights::Pbrt => (f, pbrt_like_pdf(&self.coat.interface, wo, wi)),
            };
        }
        let base = Diffuse::new(self.reflectance);
        let coat = self.coat.interface.f_and_pdf(wo, wi, mode, Sides::All).0;
        (self.layers(&base).f(wo, wi, mode) + coat, self.walk_pdf(wo, wi))
    }

    pub(super) fn sample(&self, wo: Vec3, uc: f32, u: Point2, mode: TransportMode, sides: Sides) -> Option<BsdfSample> {
        if !sides.reflection() {
            return None;
        }
        let flip = wo.z < 0.0;
        let wo = if flip { -wo } else { wo };
        let mut sample = if self.closed {
            self.sample_closed_form(wo, uc, u)?
        } else {
            let base = Diffuse::new(self.reflectance);
            self.layers(&base).sample(wo, uc, u, mode)?.with_pdf(|wi| self.walk_pdf(wo, wi))
        };
        if flip {
            sample.wi = -sample.wi;
        }
        Some(sample)
    }

    #[inline]
    fn sample_closed_form(&self, wo: Vec3, uc: f32, u: Point2) -> Option<BsdfSample> {
        let coat = &self.coat;
        let smooth = coat.form == CoatForm::Smooth;
        let enter = coat.enter(wo.z);
        let p = self.coat_probability(wo, enter);
        let (wi, lobe) = if uc < p {
            if smooth {
                let reflected = fresnel_dielectric(wo.z, coat.interface.eta);
                let wi = Vec3::new(-wo.x, -wo.y, wo.z);
                let f = SampledSpectrum::splat(reflected / wo.z);
                return Some(BsdfSample::new(f, wi, p, Lobe::SPECULAR_REFLECTION));
            }
            (coat.interface.facets.sample_bounded_reflection(wo, u)?, Lobe::GLOSSY_REFLECTION)
        } else {
            (cosine_hemisphere(u), Lobe::DIFFUSE_REFLECTION)
        };
        if wi.z <= 0.0 {
            return None;
        }
        let (value, coat_pdf) = self.coat_lobe(wo, wi);
        let pdf = p * coat_pdf + (1.0 - p) * wi.z * FRAC_1_PI;
        // Sampled paths are right with either kind of weights: `enter` is the exact table, and A is the same both ways.
        let f = self.series * (enter * coat.enter(wi.z)) + value;
        if coat.weights == CoatWeights::Exact {
            return Some(BsdfSample::new(f, wi, pdf, lobe));
        }
        let stated = pbrt_like_pdf(&coat.interface, wo, wi);
        let f = f * (stated / pdf);
        Some(BsdfSample { pdf_is_proportional: true, ..BsdfSample::new(f, wi, stated, lobe) })
    }

    pub(super) fn regularize(&mut self) {
        self.coat.regularize();
        self.closed &= self.coat.form != CoatForm::Unknown;
    }
}

impl Base for Diffuse {
    #[inline]
    fn is_specular(&self) -> bool {
        false
    }

    #[inline]
    fn f_and_pdf(&self, wo: Vec3, wi: Vec3) -> (SampledSpectrum, f32) {
        Diffuse::f_and_pdf(self, wo, wi)
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: Point2) -> Option<BsdfSample> {
        Diffuse::sample(self, wo, u, Sides::Reflection)
    }
}

impl Base for Conductor {
    #[inline]
    fn is_specular(&self) -> bool {
        self.facets.is_smooth()
    }

    #[inline]
    fn f_and_pdf(&self, wo: Vec3, wi: Vec3) -> (SampledSpectrum, f32) {
        Conductor::f_and_pdf(self, wo, wi)
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: Point2) -> Option<BsdfSample> {
        Conductor::sample(self, wo, u, Sides::Reflection)
    }
}

/// What a coat over a mirror-like base needs: shared by [`CoatedConductor`] and the paint with a film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CoatOverMirror {
    pub interface: Dielectric,
    pub thickness: f32,
    pub filling: Filling,
    pub limits: WalkLimits,
    pub weights: CoatWeights,
}

impl CoatOverMirror {
    pub fn flags(&self, base_is_specular: bool) -> Lobe {
        let mut flags = Lobe::REFLECTION;
        let top_is_specular = self.interface.is_specular();
        if top_is_specular {
            flags |= Lobe::SPECULAR;
        }
        if !self.filling.albedo.is_black() {
            flags |= Lobe::DIFFUSE;
        } else if !(top_is_specular && base_is_specular) {
            flags |= Lobe::GLOSSY;
        }
        flags
    }

    fn layers<'a, B: Base>(&'a self, base: &'a B) -> Layers<'a, B> {
        Layers {
            top: &self.interface,
            base,
            thickness: self.thickness,
            albedo: self.filling.albedo,
            g: self.filling.g,
            max_depth: self.limits.max_depth,
            n_samples: self.limits.n_samples,
            weights: self.weights,
        }
    }

    /// A density near the walk's: the coat's lobe, the base's seen through it, and a little of everything.
    #[inline]
    fn density(&self, base: &Ggx, wo: Vec3, wi: Vec3) -> f32 {
        let specular = self.interface.is_specular();
        let filled = !self.filling.albedo.is_black();
        if specular && base.is_smooth() && !filled {
            return 0.0;
        }
        let eta = self.interface.eta;
        let h = wo + wi;
        let m = h / h.length();
        let fresnel = fresnel_dielectric(wo.z, eta);
        let coat = if specular { 0.0 } else { self.interface.facets.visible_reflection_pdf(wo, m) };
        // Variances of slopes add: the base's, magnified by refraction, and the coat's twice.
        let [tx, ty] = if specular { [0.0; 2] } else { self.interface.facets.alphas() };
        let [bx, by] = if base.is_smooth() { [0.0; 2] } else { base.alphas() };
        let spread = 2.0 * (eta - 1.0) * (eta - 1.0);
        let through = |b: f32, t: f32| (eta * eta * b * b + spread * t * t).sqrt().clamp(1e-3, 1.0);
        let seen = Ggx::new(through(bx, tx), through(by, ty));
        let mirrored = if specular && base.is_smooth() { 0.0 } else { seen.visible_reflection_pdf(wo, m) };
        let inner = if filled { 0.5 * (mirrored + wi.z * FRAC_1_PI) } else { mirrored };
        0.1 / (2.0 * PI) + 0.9 * (fresnel * coat + (1.0 - fresnel) * inner)
    }

    pub fn pdf(&self, base: &Ggx, wo: Vec3, wi: Vec3) -> f32 {
        let (wo, wi) = upright(wo, wi);
        if wi.z <= 0.0 { 0.0 } else { self.density(base, wo, wi) }
    }

    pub fn f_and_pdf<B: Base>(
        &self,
        base: &B,
        base_facets: &Ggx,
        wo: Vec3,
        wi: Vec3,
        mode: TransportMode,
    ) -> (SampledSpectrum, f32) {
        let (wo, wi) = upright(wo, wi);
        if wi.z <= 0.0 {
            return (SampledSpectrum::ZERO, 0.0);
        }
        let coat = self.interface.f_and_pdf(wo, wi, mode, Sides::All).0;
        (self.layers(base).f(wo, wi, mode) + coat, self.density(base_facets, wo, wi))
    }

    pub fn sample<B: Base>(
        &self,
        base: &B,
        base_facets: &Ggx,
        wo: Vec3,
        uc: f32,
        u: Point2,
        mode: TransportMode,
    ) -> Option<BsdfSample> {
        let flip = wo.z < 0.0;
        let wo = if flip { -wo } else { wo };
        let sample = self.layers(base).sample(wo, uc, u, mode)?;
        let mut sample = sample.with_pdf(|wi| self.density(base_facets, wo, wi));
        if flip {
            sample.wi = -sample.wi;
        }
        Some(sample)
    }
}

/// A clear coat over a metal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoatedConductor {
    coat: CoatOverMirror,
    base: Conductor,
}

impl CoatedConductor {
    /// A metal of absolute index `eta + i k` and facets `base`, under an interface of relative index `coat_eta`.
    ///
    /// The metal's index is divided by the coat's, in which it lies. `thickness` in mean free paths, >= 0.
    pub fn new(
        interface: Dielectric,
        thickness: f32,
        weights: CoatWeights,
        eta: SampledSpectrum,
        k: SampledSpectrum,
        base: Ggx,
        filling: Filling,
        limits: WalkLimits,
    ) -> Self {
        let thickness = if thickness > 0.0 { thickness } else { 0.0 };
        let n = interface.eta;
        Self {
            coat: CoatOverMirror { interface, thickness, filling, limits, weights },
            base: Conductor::new(eta / n, k / n, base),
        }
    }

    pub(super) fn coat(&self) -> &CoatOverMirror {
        &self.coat
    }

    pub(super) fn facets(&self) -> &Ggx {
        &self.base.facets
    }

    pub(super) fn flags(&self) -> Lobe {
        self.coat.flags(self.base.facets.is_smooth())
    }

    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.coat.pdf(&self.base.facets, wo, wi)
    }

    pub(super) fn f_and_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (SampledSpectrum, f32) {
        self.coat.f_and_pdf(&self.base, &self.base.facets, wo, wi, mode)
    }

    pub(super) fn sample(&self, wo: Vec3, uc: f32, u: Point2, mode: TransportMode, sides: Sides) -> Option<BsdfSample> {
        if !sides.reflection() {
            return None;
        }
        self.coat.sample(&self.base, &self.base.facets, wo, uc, u, mode)
    }

    pub(super) fn regularize(&mut self) {
        self.coat.interface.facets.regularize();
        self.base.facets.regularize();
    }
}
