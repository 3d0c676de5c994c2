//! What lights claim, taken at their word: densities over directions that sum to one (B21), darkness off the lights (B07).

use super::Tally;
use irradiant_core::interaction::ReferencePoint;
use irradiant_core::scene::Scene;
use irradiant_math::hash::Pcg32;
use irradiant_math::{Frame, Normal3, Point2, Point3, Ray, Vec3, warp};
use irradiant_spectrum::Wavelengths;
use std::f32::consts::PI;

/// The integral over all directions of the density with which light sampling draws them from `p`, which must be 1 where every
/// light is a surface that the point can be lit by; with its standard error (B21). Area densities become densities per
/// solid angle on the way: |x - p|^2 / cos.
///
/// Directions are uniform in the cone around the scene's sphere, so the scene should hold the lights and nothing else. `n` is
/// the point's normal; zero in space.
pub fn light_density_integral(scene: &Scene, p: Point3, n: Normal3, directions: u32, seed: u64) -> Tally<1> {
    let at = ReferencePoint { p, p_error: Vec3::ZERO, n, ns: n };
    let (center, radius) = scene.geometry.bounds().bounding_sphere();
    let towards = center - p;
    let distance = towards.length();
    // Padded a little; all directions from inside.
    let sin2 = if distance > 0.0 { (1.001 * radius / distance).powi(2) } else { 1.0 };
    let height = if sin2 < 1.0 { sin2 / (1.0 + (1.0 - sin2).sqrt()) } else { 2.0 };
    let frame = Frame::from_z(if distance > 0.0 { towards * (1.0 / distance) } else { Vec3::Z });
    let mut random = Pcg32::new(seed, 21);
    let mut tally = Tally::default();
    for _ in 0..directions {
        let u = Point2::new(random.next_f32(), random.next_f32());
        let w = frame.from_local(warp::uniform_cone_of_height(u, height));
        tally.add([f64::from(density(scene, &at, w)) * f64::from(2.0 * PI * height)]);
    }
    tally
}

/// The density of one direction: of all lights on the way, since each may be drawn through the others.
fn density(scene: &Scene, at: &ReferencePoint, w: Vec3) -> f32 {
    let mut ray = Ray::new(at.p, w, scene.camera.time(0.5));
    let mut sum = 0.0;
    for _ in 0..64 {
        let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) else { break };
        let met = scene.geometry.interaction(&ray, &hit);
        if let Some(light) = met.light {
            sum += scene.light_sampler.pmf(at, light) * scene.lights.get(light).pdf_hit(at, w, &(&met).into());
        }
        ray = met.spawn_ray(w);
    }
    sum
}

/// What [`off_lights`] counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OffLights {
    /// Surfaces that are no light, and the dark sides of lights that have one.
    pub asked: u64,
    /// Of them, those that emitted anything at all.
    pub shining: u64,
    /// Light sides met, for comparison.
    pub lights: u64,
    /// Of them, those that were black (an image may be).
    pub dark_lights: u64,
}

/// Asks random points of a scene's surfaces for what they emit towards where they are seen from (B07): Le is exactly 0 off the
/// lights, and on the dark side of one-sided ones.
pub fn off_lights(scene: &Scene, rays: u32, seed: u64) -> OffLights {
    use irradiant_core::light::Light;
    let (center, radius) = scene.geometry.bounds().bounding_sphere();
    let lambda: Wavelengths = scene.sample_wavelengths(0.37);
    let mut random = Pcg32::new(seed, 7);
    let mut count = OffLights::default();
    for _ in 0..rays {
        let mut unit = || warp::uniform_sphere(Point2::new(random.next_f32(), random.next_f32()));
        let from = center + unit() * (2.0 * radius);
        let to = center + unit() * (0.7 * radius);
        let mut ray = Ray::new(from, (to - from).normalize(), scene.camera.time(0.5));
        for _ in 0..16 {
            let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) else { break };
            let at = scene.geometry.interaction(&ray, &hit);
            let light = at.light.map(|id| scene.lights.get(id));
            let emitted = light.is_some_and(|l| !l.emitted(at.n, at.uv, at.wo, &lambda).is_black());
            let has_light_here = match light {
                Some(Light::Area(l)) => l.two_sided || at.wo.dot_normal(at.n) > 0.0,
                _ => false,
            };
            if has_light_here {
                count.lights += 1;
                count.dark_lights += u64::from(!emitted);
            } else {
                count.asked += 1;
                count.shining += u64::from(emitted);
            }
            ray = at.spawn_ray(ray.d);
        }
    }
    count
}
