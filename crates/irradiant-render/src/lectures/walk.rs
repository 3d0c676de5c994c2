//! What all of the lectures' estimators share: a sample under way, and what a ray of it meets.

use crate::camera_samples::for_each_sample;
use crate::integrator::{RenderStats, WorkUnit};
use irradiant_core::bsdf::Bsdf;
use irradiant_core::camera::CameraRay;
use irradiant_core::film::FilmTile;
use irradiant_core::interaction::{Interaction, LightId, ReferencePoint};
use irradiant_core::light::{LightHit, SampleMode};
use irradiant_core::sampler::{LightDraws, SampleStream, ScatterDraws};
use irradiant_core::scene::Scene;
use irradiant_math::{Ray, Vec3};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// A sample under way: the scene, its random numbers, what it tells.
pub struct Walk<'a> {
    /// What is walked.
    pub scene: &'a Scene,
    /// The sample's numbers.
    pub stream: SampleStream<'a>,
    /// Where it starts.
    pub camera_ray: &'a CameraRay,
    /// What was done.
    pub stats: &'a mut RenderStats,
    /// Its wavelengths; a dispersive surface ends the secondary ones, for all branches of the sample.
    pub lambda: &'a mut Wavelengths,
    layers: &'a mut [f32],
    layers_filled: bool,
    branches: u32,
}

/// A surface that scatters: the slides' `p` and `hitRecord`.
#[derive(Clone, Copy)]
pub struct Vertex {
    /// Where.
    pub at: Interaction,
    /// How.
    pub bsdf: Bsdf,
}

/// Light that a ray meets by itself.
#[derive(Clone, Copy)]
pub struct Met {
    /// Which light.
    pub light: LightId,
    /// What comes along the ray, >= 0 and not black.
    pub emitted: SampledSpectrum,
    /// Of the ray, unit.
    pub direction: Vec3,
    /// Where, unless it came from outside the scene.
    pub hit: Option<LightHit>,
    /// The ray passed a surface of material `interface` on its way, which shadow rays do not.
    pub behind_interface: bool,
}

impl Met {
    /// The density per solid angle with which sampling this light from `from` draws it; 0 if it never does.
    pub fn light_pdf(&self, scene: &Scene, from: &ReferencePoint, mode: SampleMode) -> f32 {
        let light = scene.lights.get(self.light);
        match &self.hit {
            Some(hit) => light.pdf_hit(from, self.direction, hit),
            None => light.pdf_escaped(from, self.direction, mode),
        }
    }
}

/// Takes a unit's samples, each by `estimate`.
pub fn render(
    scene: &Scene,
    unit: &WorkUnit,
    tile: &mut FilmTile,
    stats: &mut RenderStats,
    estimate: impl Fn(&mut Walk) -> SampledSpectrum,
) {
    for_each_sample(scene, unit, tile, stats, |sample, camera_ray, lambda, layers, stats| {
        let layers_filled = layers.is_empty();
        let stream = sample.stream;
        estimate(&mut Walk { scene, stream, camera_ray, stats, lambda, layers, layers_filled, branches: 0 })
    });
}

impl Walk<'_> {
    /// The slides' `intersectScene`: the first surface along a ray that comes after `depth` scattering events, `None` if there is
    /// none. Tells `light` of all emission along the way: of that surface, of interfaces before it, else of environments.
    ///
    /// Ray 0 is the camera's and brings the footprint of its pixel; the first of them fills the film's layers.
    pub fn look(&mut self, ray: &Ray, depth: u32, mut light: impl FnMut(&Met)) -> Option<Vertex> {
        let scene = self.scene;
        let mut ray = *ray;
        let mut behind_interface = false;
        self.count_ray(depth);
        loop {
            let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) else {
                for &id in scene.lights.environments() {
                    let emitted = scene.lights.get(id).escaped(&ray, self.lambda);
                    if !emitted.is_black() {
                        light(&Met { light: id, emitted, direction: ray.d, hit: None, behind_interface });
                    }
                }
                return None;
            };
            let at = scene.geometry.interaction(&ray, &hit);
            if let Some(id) = at.light {
                let emitted = scene.lights.get(id).emitted(at.n, at.uv, at.wo, self.lambda);
                if !emitted.is_black() {
                    light(&Met { light: id, emitted, direction: ray.d, hit: Some((&at).into()), behind_interface });
                }
            }
            let footprint = scene.texture_context(&at, (depth == 0).then_some(self.camera_ray));
            let mix = self.stream.mix(depth);
            let Some(bsdf) = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, self.lambda, mix)
            else {
                ray = at.spawn_ray(ray.d);
                behind_interface = true;
                self.stats.bounce_rays += 1;
                continue;
            };
            if !self.layers_filled {
                scene.layers.fill(self.layers, scene, self.camera_ray, &at, &footprint, &bsdf, self.lambda);
                self.layers_filled = true;
            }
            return Some(Vertex { at, bsdf });
        }
    }

    fn count_ray(&mut self, depth: u32) {
        self.stats.bounce_rays += u64::from(depth > 0);
        let place = depth as usize;
        if place < RenderStats::MAX_DEPTHS {
            if self.stats.rays_by_depth.len() <= place {
                self.stats.rays_by_depth.resize(place + 1, 0);
            }
            self.stats.rays_by_depth[place] += 1;
        }
    }

    /// Counts a scattering event, the `depth`th (from 1) of its path.
    pub fn scattered(&mut self, depth: u32) {
        self.stats.scatterings += 1;
        self.stats.longest_path = self.stats.longest_path.max(depth);
    }

    /// Fresh numbers for one more light sample, beyond one at each vertex.
    pub fn another_light(&mut self) -> LightDraws {
        self.branches += 1;
        self.stream.another_light(self.branches)
    }

    /// Fresh numbers for one more direction, beyond one at each vertex.
    pub fn another_scatter(&mut self) -> ScatterDraws {
        self.branches += 1;
        self.stream.another_scatter(self.branches)
    }
}
