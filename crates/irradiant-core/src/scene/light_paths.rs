//! What paths that begin at lights ask of the scene: which light, how much leaves it, what the camera sees of a point,
//! and which pixels show that.

use super::Scene;
use crate::camera::CameraConnection;
use crate::film::Layer;
use crate::interaction::{Interaction, LightId, TextureContext};
use crate::light::{EmittedRay, Light, LightSample, LightTarget, Lights};
use crate::light_sampler::PickedLight;
use irradiant_math::distribution::AliasTable;
use irradiant_math::{Normal3, Point2, Point3, Ray, Vec3};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// Lights by power, each with a little more than its share, so that none whose power is not seen at the four
/// wavelengths it is measured at is left out.
#[derive(Clone, Debug)]
pub struct EmissionSampler {
    /// None without lights that can emit.
    table: Option<AliasTable>,
}

impl EmissionSampler {
    /// The part of all choices that is spread evenly.
    const EVEN: f32 = 0.02;

    /// Over all lights; those that no ray can be drawn from (curves) are never picked.
    pub fn new(lights: &Lights) -> Self {
        let lambda = Wavelengths::sample_visible(0.5);
        let emits = |l: &Light| match l {
            Light::Area(a) => a.shape.can_be_drawn_from(),
            Light::Point(_)
            | Light::Distant(_)
            | Light::Spot(_)
            | Light::Goniometric(_)
            | Light::Projection(_)
            | Light::UniformInfinite(_)
            | Light::ImageInfinite(_)
            | Light::PortalInfinite(_) => true,
        };
        let power = |l: &Light| if emits(l) { l.power(&lambda).safe_div(lambda.pdf()).average().max(0.0) } else { 0.0 };
        let powers: Vec<f32> = lights.as_slice().iter().map(power).collect();
        let n = lights.as_slice().iter().filter(|l| emits(l)).count().max(1) as f32;
        let total = powers.iter().sum::<f32>();
        // All alike when there is no power to go by.
        let known = total > 0.0 && total.is_finite();
        let weight = |(l, &p): (&Light, &f32)| match (emits(l), known) {
            (false, _) => 0.0,
            (true, false) => 1.0,
            (true, true) => p + Self::EVEN * total / n,
        };
        let weights: Vec<f32> = lights.as_slice().iter().zip(&powers).map(weight).collect();
        Self { table: AliasTable::new(&weights) }
    }

    /// Picks a light by `u` in [0, 1); `None` when none emits.
    #[inline]
    pub fn sample(&self, u: f32) -> Option<PickedLight> {
        let s = self.table.as_ref()?.sample(u);
        (s.pmf > 0.0).then_some(PickedLight { id: LightId(s.index as u32), pmf: s.pmf })
    }

    /// The probability of a light.
    #[inline]
    pub fn pmf(&self, id: LightId) -> f32 {
        self.table.as_ref().map_or(0.0, |table| table.pmf(id.0 as usize))
    }
}

impl Scene {
    /// Which light a path begins at: by power. Made when first asked for.
    pub fn emission_sampler(&self) -> &EmissionSampler {
        self.emission.get_or_init(|| EmissionSampler::new(&self.lights))
    }

    /// How much of an emitted ray is there: the light's opacity where that is a texture; else 1.
    pub fn emitted_opacity(&self, emitted: &EmittedRay) -> f32 {
        emitted.alpha.map_or(1.0, |alpha| {
            let at = TextureContext::without_footprint(emitted.ray.o, emitted.normal, alpha.uv, 0);
            self.clamped_opacity(alpha.texture, &at)
        })
    }

    /// True when nothing stands between a surface point and another point (`n` its normal, zero in space). Where a mix
    /// holds an interface the segment passes with the chance that a path's ray does.
    pub fn is_visible(&self, at: &Interaction, p: Point3, p_error: Vec3, n: Normal3) -> bool {
        let segment = at.spawn_ray_to(p, p_error, n);
        if self.materials.may_pass() {
            return self.is_passable(segment, 1.0, |boundary| boundary.spawn_ray_to(p, p_error, n));
        }
        !self.geometry.occluded_between(&segment, &self.alpha())
    }

    /// As [`Scene::is_visible`], out of the scene in direction `w`.
    pub fn is_open(&self, at: &Interaction, w: Vec3) -> bool {
        let ray = at.spawn_ray(w);
        if self.materials.may_pass() {
            return self.is_passable(ray, f32::INFINITY, |boundary| boundary.spawn_ray(w));
        }
        !self.geometry.occluded(&ray, f32::INFINITY, &self.alpha())
    }

    /// True when nothing stands between a surface point and the end of a light sample, as [`Scene::is_visible`] sees it.
    pub fn is_lit(&self, at: &Interaction, sample: &LightSample) -> bool {
        match sample.target {
            LightTarget::Infinite => self.is_open(at, sample.wi),
            LightTarget::Point(p) => self.is_visible(at, p, Vec3::ZERO, Normal3::ZERO),
            LightTarget::Surface { p, p_error, n, .. } => self.is_visible(at, p, p_error, n),
        }
    }

    /// True when each surface on the way lets pass; `beyond` is the rest of the way behind one.
    #[cold]
    fn is_passable(&self, mut ray: Ray, end: f32, beyond: impl Fn(&Interaction) -> Ray) -> bool {
        loop {
            let Some(hit) = self.geometry.intersect(&ray, end, &self.alpha()) else { return true };
            let boundary = self.geometry.interaction(&ray, &hit);
            let footprint = self.texture_context(&boundary, None);
            if !self.materials.passes(boundary.material, &self.textures, &boundary, &footprint) {
                return false;
            }
            ray = beyond(&boundary);
        }
    }

    /// The ray of a light at infinity, put back to where it comes from: outside of everything, so that it meets all that
    /// stands in its way (a portal's rays start at the portal).
    pub fn from_outside(&self, ray: &Ray) -> Ray {
        let (center, radius) = self.geometry.bounds().bounding_sphere();
        if !(radius.is_finite() && radius > 0.0) {
            return *ray;
        }
        let back = (ray.o - center).dot(ray.d) + 1.01 * radius;
        if back > 0.0 { Ray::new(ray.o - ray.d * back, ray.d, ray.time) } else { *ray }
    }

    /// Why paths from lights cannot end at this camera and film; `None` when they can.
    pub fn light_path_obstacle(&self) -> Option<&'static str> {
        if !self.camera.can_connect() {
            return Some("the camera is neither perspective nor orthographic");
        }
        if !self.pixel_jitter {
            return Some("\"disablepixeljitter\" leaves only the centres of pixels to be seen");
        }
        let buckets = self.layers.layers().iter().any(|l| matches!(l, Layer::Bucket { .. }));
        buckets.then_some("the film is \"spectral\"")
    }

    /// As the camera sees a point, where the film or a pixel filter at its border reaches that far.
    #[inline]
    pub fn connect_camera(&self, p: Point3, lens: Point2, time: f32) -> Option<CameraConnection> {
        let seen = self.camera.connect(p, lens, time)?;
        let (r, b) = (self.filter.radius(), &self.bounds);
        // Samples of pixels lie within the filter's radius of their centres.
        let within = |x: f32, lo: i32, hi: i32, r: f32| lo as f32 + 0.5 - r <= x && x < hi as f32 - 0.5 + r;
        (within(seen.film.x, b.x0, b.x1, r[0]) && within(seen.film.y, b.y0, b.y1, r[1])).then_some(seen)
    }

    /// What the film makes of light that arrives at a place of it: calls `add` for each rendered pixel whose filter reaches
    /// there, with linear RGB. Not clamped: a path from a light brings, to few pixels, what is then divided by all paths.
    #[inline]
    pub fn splat(
        &self,
        film: Point2,
        radiance: SampledSpectrum,
        lambda: &Wavelengths,
        mut add: impl FnMut(i32, i32, [f32; 3]),
    ) {
        let rgb = self.sensor_rgb(radiance, lambda);
        let r = self.filter.radius();
        // Pixels whose centre is within the radius.
        let first = |x: f32, r: f32, least: i32| ((x - 0.5 - r).floor() as i32).max(least);
        let last = |x: f32, r: f32, most: i32| ((x - 0.5 + r).ceil() as i32).min(most - 1);
        for y in first(film.y, r[1], self.bounds.y0)..=last(film.y, r[1], self.bounds.y1) {
            for x in first(film.x, r[0], self.bounds.x0)..=last(film.x, r[0], self.bounds.x1) {
                let value = self.filter.value([film.x - (x as f32 + 0.5), film.y - (y as f32 + 0.5)]);
                if value != 0.0 {
                    add(x, y, rgb.map(|c| c * value));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::CompileOptions;
    use irradiant_scene::assets::MemoryAssets;
    use irradiant_scene::desc::{ColorSpaceName, LightDesc, LightKind, MotionDesc, SceneDesc, SpectrumDesc};
    use irradiant_scene::{Span, Spanned};

    fn scene(intensities: &[f32]) -> Scene {
        let light = |&i: &f32| LightDesc {
            kind: LightKind::Point {
                intensity: Spanned::unplaced(SpectrumDesc::Rgb([i; 3], ColorSpaceName::Srgb)),
                from: [0.0; 3],
                power: None,
            },
            world_from_light: MotionDesc::default(),
            scale: Spanned::unplaced(1.0),
            color_space: ColorSpaceName::Srgb,
            group: None,
            span: Span::NONE,
        };
        let desc = SceneDesc { lights: intensities.iter().map(light).collect(), ..SceneDesc::default() };
        Scene::compile(&desc, &MemoryAssets::default(), &CompileOptions::default()).scene.expect("a scene")
    }

    #[test]
    fn lights_emit_by_power_and_none_is_left_out() {
        let scene = scene(&[1.0, 0.0, 3.0]);
        let sampler = scene.emission_sampler();
        let pmf = [0, 1, 2].map(|i| sampler.pmf(LightId(i)));
        assert!((pmf.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        assert!((pmf[2] / pmf[0] - 3.0).abs() < 0.1 && pmf[1] > 0.001, "{pmf:?}");
        let mut counts = [0; 3];
        for i in 0..3000 {
            let picked = sampler.sample((i as f32 + 0.5) / 3000.0).unwrap();
            assert_eq!(picked.pmf, pmf[picked.id.0 as usize]);
            counts[picked.id.0 as usize] += 1;
        }
        for (n, p) in counts.into_iter().zip(pmf) {
            assert!((n as f32 - 3000.0 * p).abs() < 3.0, "{counts:?} {pmf:?}");
        }
        // Black ones alike; none at all: nothing to draw.
        assert_eq!(EmissionSampler::new(&self::scene(&[0.0, 0.0]).lights).pmf(LightId(1)), 0.5);
        assert!(self::scene(&[]).emission_sampler().sample(0.5).is_none());
    }
}
