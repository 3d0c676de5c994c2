//! The sky, shared: directions in which one pixel's path looked for it are looked at by its neighbours too.
//!
//! A path looks at the sky from its first vertex in two directions: that of a light sample, and that of the BSDF, whatever it meets there. So a block of
//! sixteen has up to thirty-two directions, all samples of one mixture by the balance heuristic (Veach and Guibas 1995): for the pixel i the direction w brings
//! f_i(w) L(w) V_i(w) / (sum over k of p_light(w) + p_k(w)). Unlike second vertices these densities do not depend on who sees what, since a direction that is
//! blocked has been drawn all the same.
//!
//! A pixel knows V for its own two. Of the others it tests but some, drawn without bias in proportion to what they would bring if it saw what their
//! finders saw (with [`UNSEEN`] instead of 0, for it may see more): of a chance c a contribution is divided by c. Chances go up to 1, and are taken along one line by one
//! random number (systematic sampling: Madow 1949; proportional to size: Hartley and Rao 1962). What one pixel has found out by rays so spares
//! its neighbours theirs, as in spatial resampling (Bitterli et al. 2020), without bias, and with weights that are bounded ([`LEAST_SHARE`]).

use super::{PIXELS, Scratch};
use crate::integrator::RenderStats;
use crate::path::PathIntegrator;
use irradiant_core::bxdf::TransportMode;
use irradiant_core::interaction::{LightId, ReferencePoint};
use irradiant_core::light::{Sky, SkyPoint};
use irradiant_core::scene::Scene;
use irradiant_math::{Normal3, Point3, Vec3};
use irradiant_spectrum::SampledSpectrum;

/// Directions of a block at most: light samples of its pixels, then directions of their BSDFs.
pub(crate) const GLIMPSES: usize = 2 * PIXELS;

/// What a direction counts for, when it is chosen which to test, whose finder saw something else than the sky there.
const UNSEEN: f32 = 0.2;

/// The sky whose directions pixels share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SharedSky<'a> {
    pub id: LightId,
    pub sky: Sky<'a>,
    /// How often a first vertex draws a light sample of it, on average: the same everywhere, since lights at infinity have no place.
    times: f32,
    /// How many directions of others a pixel tests.
    pub tests: u32,
}

impl<'a> SharedSky<'a> {
    /// The only environment, if it looks the same from everywhere and `tests` of a sample's directions are to be shared.
    pub fn of(scene: &'a Scene, path: &PathIntegrator, tests: u32) -> Option<Self> {
        let (id, sky) = scene.lights.only_sky().filter(|_| tests > 0)?;
        let anywhere = ReferencePoint { p: Point3::ZERO, p_error: Vec3::ZERO, n: Normal3::ZERO, ns: Normal3::ZERO };
        Some(Self { id, sky, times: path.light_choice_at(scene, 0).tests_of(scene, &anywhere, id), tests })
    }

    /// What a light sample counts for that stands for a `share` of all and was picked with the chance `pmf`.
    #[inline(always)]
    pub fn factor(&self, share: f32, pmf: f32) -> f32 {
        share * self.times / pmf
    }

    /// The density with which a block finds a point, 1/sr: so many light samples, and the BSDFs of its first vertices with these densities.
    #[inline(always)]
    pub fn density(&self, seeking: u32, point: &SkyPoint, pdfs: &[f32; PIXELS]) -> f32 {
        // In halves, as vectors add.
        let mut sums = *pdfs;
        let mut half = PIXELS / 2;
        while half > 0 {
            for i in 0..half {
                sums[i] += sums[i + half];
            }
            half /= 2;
        }
        seeking as f32 * self.times * point.pdf + sums[0]
    }
}

/// A direction in which a path looked for the sky from its first vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Glimpse {
    pub point: SkyPoint,
    /// What it counts for in the sum.
    pub factor: f32,
    /// Whether the sky was to be seen.
    pub sees: bool,
}

impl Glimpse {
    /// How much one who scatters 1 expects of it, as one more term of the sum over a mixture of this density.
    #[inline(always)]
    pub fn expected(&self, density: f32) -> f32 {
        let [r, g, b] = self.point.rgb;
        r.max(g).max(b) * self.share(density) * if self.sees { 1.0 } else { UNSEEN }
    }

    /// What its radiance is multiplied with in the sum.
    #[inline(always)]
    pub fn share(&self, density: f32) -> f32 {
        if density > 0.0 { self.factor / density } else { 0.0 }
    }
}

/// What weights are multiplied with to be chances of which `tests` are taken on average; no chance exceeds 1, nearly.
fn chances_per_weight(weights: &[f32], tests: f32) -> f32 {
    if weights.iter().filter(|weight| **weight > 0.0).count() as f32 <= tests {
        return f32::INFINITY;
    }
    let mut scale = 0.0;
    for _ in 0..ROUNDS {
        let (mut certain, mut rest) = (0.0, 0.0);
        for weight in weights {
            if weight * scale >= 1.0 {
                certain += 1.0;
            } else {
                rest += weight;
            }
        }
        if rest > 0.0 && tests > certain {
            scale = (tests - certain) / rest;
        }
    }
    scale
}

/// What a direction of which anything is expected counts for at least, as a share of all: what finders saw may mislead, and what is tested seldom counts much when it
/// is. Of thirty directions at most an eighth of the tests goes there.
pub(super) const LEAST_SHARE: f32 = 0.004;

/// Rounds in which chances above 1 are cut and what is left is spread over the others.
pub(super) const ROUNDS: usize = 3;

/// Takes the next weight's chance from the line, where the next mark is `mark` away: its inverse if it is hit.
fn choose(weight: f32, scale: f32, mark: &mut f32) -> Option<f32> {
    if !(weight > 0.0) {
        return None;
    }
    let chance = (weight * scale).min(1.0);
    if chance < 1.0 {
        *mark -= chance;
        if *mark >= 0.0 {
            return None;
        }
        *mark += 1.0;
    }
    Some(1.0 / chance)
}

/// Brings the sky to all first vertices of a block.
pub(super) fn share_sky(scene: &Scene, sky: &SharedSky, scratch: &mut Scratch, stats: &mut RenderStats) {
    let Scratch { members, glimpses, seeking, .. } = scratch;
    // With the cosine.
    let mut scattered = [[SampledSpectrum::ZERO; PIXELS]; GLIMPSES];
    let (mut shares, mut expected) = ([0.0; GLIMPSES], [0.0; GLIMPSES]);
    for (j, glimpse) in glimpses.iter_mut().enumerate() {
        let Some(glimpse) = glimpse else { continue };
        let wi = glimpse.point.wi;
        let mut pdfs = [0.0; PIXELS];
        for (i, member) in members.iter().enumerate() {
            let Some(first) = &member.first else { continue };
            let (f, pdf) = first.bsdf.f_and_pdf(first.at.wo, wi, TransportMode::Radiance);
            let f_cos = f * first.bsdf.abs_cos(wi);
            // Light samples find what is too rare for the BSDF to draw (pdf 0), too.
            if f_cos.is_black() || !pdf.is_finite() {
                continue;
            }
            (scattered[j][i], pdfs[i]) = (f_cos, pdf);
        }
        let density = sky.density(*seeking, &glimpse.point, &pdfs);
        // A light sample is not tested by its own pixel until now.
        if j < PIXELS
            && let Some(own) = members[j].first.as_ref().filter(|_| !scattered[j][j].is_black())
        {
            stats.shadow_rays += 1;
            glimpse.sees = !scene.geometry.occluded(&own.at.spawn_ray(wi), f32::INFINITY, &scene.alpha());
        }
        (shares[j], expected[j]) = (glimpse.share(density), glimpse.expected(density));
    }
    for (i, member) in members.iter_mut().enumerate() {
        let Some(first) = &member.first else { continue };
        let mut weights = [0.0; GLIMPSES];
        for j in (0..GLIMPSES).filter(|j| j % PIXELS != i) {
            weights[j] = scattered[j][i].max_component() * expected[j];
        }
        let least = LEAST_SHARE * weights.iter().sum::<f32>();
        weights.iter_mut().filter(|weight| **weight > 0.0).for_each(|weight| *weight = weight.max(least));
        let scale = chances_per_weight(&weights, sky.tests as f32);
        // Roulette has no use for this number here.
        let mut mark = member.sample.stream.scatter(0).roulette;
        let mut sum = SampledSpectrum::ZERO;
        for (j, glimpse) in glimpses.iter().enumerate() {
            let Some(glimpse) = glimpse else { continue };
            let inverse_chance = if j % PIXELS == i {
                if glimpse.sees { 1.0 } else { 0.0 }
            } else if let Some(inverse) = choose(weights[j], scale, &mut mark) {
                stats.shadow_rays += 1;
                let ray = first.at.spawn_ray(glimpse.point.wi);
                if scene.geometry.occluded(&ray, f32::INFINITY, &scene.alpha()) { 0.0 } else { inverse }
            } else {
                0.0
            };
            if inverse_chance > 0.0 {
                let radiance = sky.sky.radiance(&glimpse.point, &member.lambda);
                sum += scattered[j][i] * radiance * (shares[j] * inverse_chance);
            }
        }
        member.radiance += sum;
    }
}
