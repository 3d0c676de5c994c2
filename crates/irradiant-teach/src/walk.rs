//! An estimator written a second time, after the slides and not after the production code: the witness of many rows, and where
//! faults live.
//!
//! One loop with its choices laid open: how lights are found, how directions are drawn, how paths end, where emission counts.
//! The lectures' estimators are settings of it: "try 1" is no direct light, BSDF directions, no roulette, emission everywhere.

use crate::estimate::{Estimator, Part};
use irradiant::core::bxdf::{Lobe, Sides, TransportMode};
use irradiant::core::camera::CameraRay;
use irradiant::core::interaction::{Interaction, LightId, ReferencePoint};
use irradiant::core::light::SampleMode;
use irradiant::core::light_sampler::PickedLight;
use irradiant::core::sampler::SampleStream;
use irradiant::core::scene::Scene;
use irradiant::math::{Frame, Point2, Ray, Vec3, warp};
use irradiant::renderer::RenderStats;
use irradiant::spectrum::{SampledSpectrum, Wavelengths};
use std::f32::consts::PI;

/// How light that arrives straight from lights is found at a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direct {
    /// By chance only.
    Chance,
    /// One sample of one light that the scene's selector picks.
    OneLight,
    /// One sample of one light, each as likely as the others.
    OneLightUniformly,
    /// So many samples of each light.
    AllLights(u32),
}

/// How the next direction is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Directions {
    /// Uniformly over the hemisphere (the sphere where surfaces transmit).
    Uniform,
    /// By the cosine.
    Cosine,
    /// By the BSDF.
    Bsdf,
}

/// How paths end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Roulette {
    /// By the depth limit, absorption and escape alone.
    None,
    /// With probability `q` at each vertex after the first `spared`.
    Constant {
        /// Chance to end.
        q: f32,
        /// Scattering events without roulette.
        spared: u32,
    },
    /// Survive with the weight of the event: the lecture's "if the BRDF is low".
    Bsdf,
    /// Survive with what the path carries.
    Throughput,
}

/// Where emission that a ray meets counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Emission {
    /// Wherever it is met: right without light samples.
    Everywhere,
    /// At the eye only: the slide's pseudo-code with light samples.
    AtTheEye,
    /// At the eye and after specular events: the Bern notes' exception.
    AtTheEyeAndAfterSpecular,
    /// Weighed against light samples by the balance heuristic.
    Weighed,
}

/// What is wrong on purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrong {
    /// Nothing.
    Nothing,
    /// The density of light samples is taken half as large as it is.
    LightDensityHalved,
    /// No cosine at the surface for light samples.
    NoCosine,
    /// Weights of two techniques are both 1.
    WeightsDropped,
    /// Survivors of the roulette are not made heavier.
    RouletteNotCompensated,
    /// One bounce more than the limit allows.
    DepthOffByOne,
    /// Emission met by rays fades with distance.
    EmissionFades,
    /// Shadow rays are not shot.
    NoShadows,
    /// Radiance is not scaled at refractions.
    NoSquaredIndex,
    /// Emission after one bounce is counted again although light samples cover it.
    EmissionTwice,
    /// The chance of the light that was picked is left out.
    PickNotCounted,
    /// Contributions brighter than a limit (a little more than what the film shows as 1) are cut.
    Clamped,
    /// Rays leave from the rounded hit itself.
    NoOffset,
}

/// The witness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walk {
    /// How lights are found.
    pub direct: Direct,
    /// How directions are drawn.
    pub directions: Directions,
    /// How paths end.
    pub roulette: Roulette,
    /// Where emission counts.
    pub emission: Emission,
    /// Scattering events at most.
    pub max_depth: Option<u32>,
    /// At glass, reflected or refracted with one half each instead of by Fresnel.
    pub constant_glass: bool,
    /// What is wrong.
    pub wrong: Wrong,
}

impl Walk {
    /// Lecture A's path tracer with the Bern exception: right wherever light samples reach.
    pub const PATH: Self = Self {
        direct: Direct::OneLight,
        directions: Directions::Bsdf,
        roulette: Roulette::Throughput,
        emission: Emission::AtTheEyeAndAfterSpecular,
        max_depth: None,
        constant_glass: false,
        wrong: Wrong::Nothing,
    };

    /// The path tracer with both techniques weighed.
    pub const WEIGHED: Self = Self { emission: Emission::Weighed, ..Self::PATH };

    /// BSDF-sampled recursion that meets lights by chance; ends only at a safety stop ("try 1").
    pub const TRY_1: Self = Self {
        direct: Direct::Chance,
        roulette: Roulette::None,
        emission: Emission::Everywhere,
        max_depth: Some(64),
        ..Self::PATH
    };

    /// The same with roulette ("try 2").
    pub const TRY_2: Self = Self { roulette: Roulette::Bsdf, max_depth: None, ..Self::TRY_1 };

    /// With a depth limit.
    pub fn depth(self, limit: u32) -> Self {
        Self { max_depth: Some(limit), ..self }
    }

    /// With something wrong.
    pub fn wrong(self, wrong: Wrong) -> Self {
        Self { wrong, ..self }
    }

    fn leave(&self, at: &Interaction, w: Vec3) -> Ray {
        match self.wrong {
            Wrong::NoOffset => Ray::new(at.p, w, at.time),
            _ => at.spawn_ray(w),
        }
    }

    /// Emission's weight where a ray met a light that light samples could have drawn with density `light_pdf`.
    fn emission_weight(&self, depth: u32, specular: bool, light_pdf: f32, bsdf_pdf: f32) -> f32 {
        if depth == 0 {
            return 1.0;
        }
        if depth == 1 && self.wrong == Wrong::EmissionTwice {
            return 1.0;
        }
        match self.emission {
            Emission::Everywhere => 1.0,
            Emission::AtTheEye => 0.0,
            // What light samples cannot draw is found by chance alone.
            Emission::AtTheEyeAndAfterSpecular => f32::from(u8::from(specular || light_pdf == 0.0)),
            Emission::Weighed if specular || light_pdf == 0.0 || self.wrong == Wrong::WeightsDropped => 1.0,
            Emission::Weighed => bsdf_pdf / (bsdf_pdf + light_pdf),
        }
    }

    fn pick_chance(&self, scene: &Scene, at: &ReferencePoint, light: LightId) -> f32 {
        match self.direct {
            Direct::Chance => 0.0,
            Direct::OneLight => scene.light_sampler.pmf(at, light),
            Direct::OneLightUniformly => 1.0 / scene.lights.len() as f32,
            Direct::AllLights(_) => 1.0,
        }
    }
}

struct Previous {
    at: ReferencePoint,
    pdf: f32,
    specular: bool,
}

impl Estimator for Walk {
    fn sample(
        &self,
        scene: &Scene,
        camera_ray: &CameraRay,
        stream: &SampleStream,
        lambda: &mut Wavelengths,
        stats: &mut RenderStats,
        tell: &mut dyn FnMut(&Part),
    ) -> SampledSpectrum {
        let limit = self.max_depth.map(|d| d + u32::from(self.wrong == Wrong::DepthOffByOne));
        let mut sum = SampledSpectrum::ZERO;
        let mut lobes: Vec<Lobe> = Vec::new();
        let mut add = |sum: &mut SampledSpectrum, bounces, radiance: SampledSpectrum, by_hit, light, lobes: &[Lobe]| {
            let radiance =
                if self.wrong == Wrong::Clamped { radiance.min(SampledSpectrum::splat(0.012)) } else { radiance };
            *sum += radiance;
            tell(&Part { bounces, radiance, by_hit, light, lobes });
        };
        let mut ray = camera_ray.ray;
        let mut throughput = SampledSpectrum::ONE;
        let mut eta_scale = 1.0;
        let mut depth = 0;
        let mut previous: Option<Previous> = None;
        loop {
            // Find what the ray meets; count emission by the rule.
            let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) else {
                for &light in scene.lights.environments() {
                    let (pdf, bsdf_pdf, specular) = previous.as_ref().map_or((0.0, 0.0, false), |p| {
                        let mode = SampleMode::Complete;
                        let pdf = scene.lights.get(light).pdf_escaped(&p.at, ray.d, mode);
                        (self.pick_chance(scene, &p.at, light) * pdf, p.pdf, p.specular)
                    });
                    let weight = self.emission_weight(depth, specular, pdf, bsdf_pdf);
                    let emitted = scene.lights.get(light).escaped(&ray, lambda);
                    if weight > 0.0 && !emitted.is_black() {
                        add(&mut sum, depth, throughput * emitted * weight, true, light, &lobes);
                    }
                }
                break;
            };
            let at = scene.geometry.interaction(&ray, &hit);
            if let Some(light) = at.light {
                let mut emitted = scene.lights.get(light).emitted(at.n, at.uv, at.wo, lambda);
                if self.wrong == Wrong::EmissionFades {
                    emitted *= 1.0 / (1.0 + 0.01 * at.t);
                }
                let (pdf, bsdf_pdf, specular) = previous.as_ref().map_or((0.0, 0.0, false), |p| {
                    let pdf = scene.lights.get(light).pdf_hit(&p.at, ray.d, &(&at).into());
                    (self.pick_chance(scene, &p.at, light) * pdf, p.pdf, p.specular)
                });
                let weight = self.emission_weight(depth, specular, pdf, bsdf_pdf);
                if weight > 0.0 && !emitted.is_black() {
                    add(&mut sum, depth, throughput * emitted * weight, true, light, &lobes);
                }
            }
            if limit.is_some_and(|limit| depth >= limit) {
                break;
            }
            let footprint = scene.texture_context(&at, (depth == 0).then_some(camera_ray));
            let mix = stream.mix(depth);
            let Some(bsdf) = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, lambda, mix) else {
                ray = at.spawn_ray(ray.d);
                if let Some(p) = &mut previous {
                    p.specular = true;
                }
                continue;
            };

            // Light samples.
            if self.direct != Direct::Chance && bsdf.flags().is_non_specular() {
                let draws = stream.light(depth);
                let mut try_light = |light: LightId, pmf: f32, u: Point2| {
                    let reference = at.reference();
                    let Some(s) = scene.lights.get(light).sample(&reference, u, lambda, SampleMode::Complete) else {
                        return;
                    };
                    let (f, bsdf_pdf) = bsdf.f_and_pdf(at.wo, s.wi, TransportMode::Radiance);
                    let cosine = if self.wrong == Wrong::NoCosine { 1.0 } else { bsdf.abs_cos(s.wi) };
                    let arriving = s.radiance * scene.opacity(&s) * f * cosine;
                    if arriving.is_black() {
                        return;
                    }
                    stats.shadow_rays += 1;
                    let blocked = match self.wrong {
                        Wrong::NoShadows => false,
                        Wrong::NoOffset => {
                            scene.geometry.occluded(&Ray::new(at.p, s.wi, at.time), 1e30, &scene.alpha())
                        }
                        _ => scene.is_occluded(&at, &s),
                    };
                    if blocked {
                        return;
                    }
                    let mut pdf = pmf * s.pdf;
                    if self.emission == Emission::Weighed && !s.is_delta && self.wrong != Wrong::WeightsDropped {
                        // Balance heuristic: the weight turns the density into the sum of both.
                        let chance = self.pick_chance(scene, &reference, light) * s.pdf;
                        pdf *= (chance + bsdf_pdf) / chance;
                    }
                    if self.wrong == Wrong::LightDensityHalved {
                        pdf *= 0.5;
                    }
                    if self.wrong == Wrong::PickNotCounted {
                        pdf /= pmf;
                    }
                    add(&mut sum, depth + 1, throughput * arriving * (1.0 / pdf), false, light, &lobes);
                };
                match self.direct {
                    Direct::Chance => {}
                    Direct::OneLight => {
                        if let Some(PickedLight { id, pmf }) = scene.light_sampler.sample(&at.reference(), draws.pick) {
                            try_light(id, pmf, draws.uv);
                        }
                    }
                    Direct::OneLightUniformly => {
                        let n = scene.lights.len();
                        let id = ((draws.pick * n as f32) as usize).min(n - 1);
                        try_light(LightId(id as u32), 1.0 / n as f32, draws.uv);
                    }
                    Direct::AllLights(samples) => {
                        for id in 0..scene.lights.len() as u32 {
                            // One ray says all there is to say of a light without extent.
                            let many = if scene.lights.get(LightId(id)).is_delta() { 1 } else { samples };
                            for j in 0..many {
                                // Numbers beyond those of any path, so that they are independent of it.
                                let [u, v, _, _] = stream.block(1_000_000 + (depth * 4096 + id) * 64 + j);
                                try_light(LightId(id), many as f32, Point2::new(u, v));
                            }
                        }
                    }
                }
            }

            // The next direction.
            let draws = stream.scatter(depth);
            let before = throughput;
            let specular_only = !bsdf.flags().is_non_specular();
            let (wi, pdf, lobe) = if self.directions == Directions::Bsdf || specular_only {
                let (mut sides, mut lobe_draw) = (Sides::All, draws.lobe);
                let two_ways = specular_only && bsdf.flags().is_reflective() && bsdf.flags().is_transmissive();
                if self.constant_glass && two_ways {
                    sides = if draws.lobe < 0.5 { Sides::Reflection } else { Sides::Transmission };
                    lobe_draw = (2.0 * draws.lobe).fract();
                }
                let Some(mut s) = bsdf.sample(at.wo, lobe_draw, draws.uv, TransportMode::Radiance, sides) else {
                    break;
                };
                if sides != Sides::All {
                    s.pdf *= 0.5;
                }
                let mut f = s.f * (bsdf.abs_cos(s.wi) / s.pdf);
                if s.lobe.is_transmissive() {
                    eta_scale *= s.eta * s.eta;
                    if self.wrong == Wrong::NoSquaredIndex {
                        f *= s.eta * s.eta;
                    }
                }
                throughput *= f;
                (s.wi, s.pdf, s.lobe)
            } else {
                let (wi, pdf) = draw_direction(self.directions, &at, bsdf.frame.z, bsdf.flags(), draws.uv);
                throughput *= bsdf.f(at.wo, wi, TransportMode::Radiance) * (bsdf.abs_cos(wi) / pdf);
                (wi, pdf, if bsdf.flags().is_diffuse() { Lobe::DIFFUSE } else { Lobe::GLOSSY })
            };
            if throughput.is_black() {
                break;
            }
            depth += 1;
            lobes.push(lobe);
            stats.scatterings += 1;
            stats.longest_path = stats.longest_path.max(depth);
            let carried = (throughput * eta_scale).max_component();
            let survival = match self.roulette {
                Roulette::None => 1.0,
                Roulette::Constant { q, spared } => {
                    if depth > spared {
                        1.0 - q
                    } else {
                        1.0
                    }
                }
                Roulette::Bsdf => (carried / (before * eta_scale).max_component()).clamp(0.05, 0.95),
                Roulette::Throughput => {
                    if depth <= 1 {
                        1.0
                    } else {
                        carried.min(0.99)
                    }
                }
            };
            if survival < 1.0 {
                if draws.roulette >= survival {
                    break;
                }
                if self.wrong != Wrong::RouletteNotCompensated {
                    throughput *= 1.0 / survival;
                }
            }
            previous = Some(Previous { at: at.reference(), pdf, specular: lobe.is_specular() });
            ray = self.leave(&at, wi);
            stats.bounce_rays += 1;
        }
        sum
    }
}

fn draw_direction(how: Directions, at: &Interaction, n: Vec3, flags: Lobe, u: Point2) -> (Vec3, f32) {
    if flags.is_reflective() && flags.is_transmissive() {
        return (warp::uniform_sphere(u), 1.0 / (4.0 * PI));
    }
    let up = if (at.wo.dot(n) > 0.0) == flags.is_reflective() { n } else { -n };
    let local = match how {
        Directions::Cosine => warp::cosine_hemisphere(u),
        Directions::Uniform | Directions::Bsdf => warp::uniform_hemisphere(u),
    };
    let pdf = if how == Directions::Cosine { local.z / PI } else { 0.5 / PI };
    (Frame::from_z(up).from_local(local), pdf)
}
