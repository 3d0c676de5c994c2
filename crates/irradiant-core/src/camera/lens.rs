//! Rays through a stack of spherical glass surfaces.
//!
//! Kolb, Mitchell and Hanrahan 1995, "A realistic camera model for computer graphics". Camera space: the film lies at
//! z = 0, the scene at +z. In `f64`: focusing and finite differences along the film subtract nearly equal numbers.

use super::aperture::Mask;

/// A ray in the camera's space, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct LensRay {
    pub o: [f64; 3],
    pub d: [f64; 3],
}

impl LensRay {
    pub fn at(&self, t: f64) -> [f64; 3] {
        std::array::from_fn(|i| self.o[i] + self.d[i] * t)
    }
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn normalize(v: [f64; 3]) -> [f64; 3] {
    let length = dot(v, v).sqrt();
    v.map(|c| c / length)
}

/// A surface of the stack, as the author gives it but in metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Element {
    /// Radius of curvature, positive when the centre lies on the film's side; 0 for the aperture stop.
    pub radius: f64,
    /// Distance along the axis to the next surface towards the film (to the film, for the last).
    pub thickness: f64,
    /// Refractive index of what lies on the film's side; 0 counts as air.
    pub eta: f64,
    /// Radius of the opening.
    pub opening: f64,
}

impl Element {
    fn is_stop(&self) -> bool {
        self.radius == 0.0
    }

    fn eta(&self) -> f64 {
        if self.eta == 0.0 { 1.0 } else { self.eta }
    }
}

/// Surfaces from front (scene) to rear (film).
#[derive(Clone, Debug)]
pub(super) struct Lens {
    pub elements: Vec<Element>,
    /// What the aperture stop lets through, when it is not just a hole.
    pub mask: Option<Mask>,
}

impl Lens {
    /// Distance from the film to the rearmost surface.
    pub fn rear_z(&self) -> f64 {
        self.elements.last().map_or(0.0, |e| e.thickness)
    }

    /// Distance from the film to the frontmost surface.
    pub fn front_z(&self) -> f64 {
        self.elements.iter().map(|e| e.thickness).sum()
    }

    /// The ray as it leaves the lens towards the scene, its direction unit, with the mask's transmittance; `None` when it is blocked.
    pub fn trace_to_scene(&self, ray: LensRay) -> Option<(LensRay, f64)> {
        let (mut ray, mut z, mut weight) = (LensRay { d: normalize(ray.d), ..ray }, 0.0, 1.0);
        for (i, element) in self.elements.iter().enumerate().rev() {
            z += element.thickness;
            let hit = meet(element, z, &ray)?;
            let p = ray.at(hit.t);
            match &self.mask {
                Some(mask) if element.is_stop() => {
                    weight = mask.transmittance(p[0] / element.opening, p[1] / element.opening);
                    if !(weight > 0.0) {
                        return None;
                    }
                }
                _ => within(element, p)?,
            }
            let beyond = if i > 0 { self.elements[i - 1].eta() } else { 1.0 };
            ray = LensRay { o: p, d: refracted(ray.d, hit.normal, element.eta(), beyond)? };
        }
        Some((ray, weight))
    }

    /// The ray as it leaves the lens towards the film; `None` when it is blocked. The mask is not looked at.
    pub fn trace_to_film(&self, ray: LensRay) -> Option<LensRay> {
        let (mut ray, mut z, mut before) = (LensRay { d: normalize(ray.d), ..ray }, self.front_z(), 1.0);
        for element in &self.elements {
            let hit = meet(element, z, &ray)?;
            let p = ray.at(hit.t);
            within(element, p)?;
            ray = LensRay { o: p, d: refracted(ray.d, hit.normal, before, element.eta())? };
            before = element.eta();
            z -= element.thickness;
        }
        Some(ray)
    }
}

struct SurfaceHit {
    t: f64,
    /// Against the ray, unit; `None` at the stop.
    normal: Option<[f64; 3]>,
}

/// Where a ray of unit direction meets a surface whose vertex is at `z`.
#[inline]
fn meet(element: &Element, z: f64, ray: &LensRay) -> Option<SurfaceHit> {
    if element.is_stop() {
        let t = (z - ray.o[2]) / ray.d[2];
        return (t >= 0.0).then_some(SurfaceHit { t, normal: None });
    }
    let radius = element.radius;
    let o = [ray.o[0], ray.o[1], ray.o[2] - (z - radius)];
    let b = dot(ray.d, o);
    let discriminant = b * b - (dot(o, o) - radius * radius);
    if !(discriminant >= 0.0) {
        return None;
    }
    // The surface is the cap around the vertex: the near half of the sphere for a ray that comes from outside of it.
    let enters = (ray.d[2] < 0.0) != (radius < 0.0);
    let t = if enters { -b - discriminant.sqrt() } else { -b + discriminant.sqrt() };
    if !(t >= 0.0) {
        return None;
    }
    let scale = if enters { 1.0 } else { -1.0 } / radius.abs();
    Some(SurfaceHit { t, normal: Some(std::array::from_fn(|i| (o[i] + ray.d[i] * t) * scale)) })
}

/// Nothing when a point lies outside of the opening.
fn within(element: &Element, p: [f64; 3]) -> Option<()> {
    (p[0] * p[0] + p[1] * p[1] <= element.opening * element.opening).then_some(())
}

/// A unit direction behind a surface (Snell), unit but for rounding; unchanged at the stop, `None` under total reflection.
fn refracted(d: [f64; 3], normal: Option<[f64; 3]>, eta_from: f64, eta_to: f64) -> Option<[f64; 3]> {
    let Some(n) = normal else { return Some(d) };
    let ratio = eta_from / eta_to;
    let cos_from = -dot(d, n);
    let sin2_to = (1.0 - cos_from * cos_from).max(0.0) * ratio * ratio;
    if sin2_to >= 1.0 {
        return None;
    }
    let along = ratio * cos_from - (1.0 - sin2_to).sqrt();
    Some(std::array::from_fn(|i| d[i] * ratio + n[i] * along))
}

/// What the paraxial theory of thick lenses says of a stack: distances from the film towards the scene, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct ThickLens {
    /// Principal plane for light from the scene.
    pub film_principal: f64,
    /// Where parallel light from the scene meets.
    pub film_focus: f64,
    /// Principal plane for light from the film.
    pub scene_principal: f64,
}

impl ThickLens {
    /// From two rays parallel to the axis at that height. `None` when they are blocked.
    pub fn new(lens: &Lens, height: f64) -> Option<Self> {
        let cardinal = |out: LensRay| {
            let focus = out.at(-out.o[0] / out.d[0])[2];
            let principal = out.at((height - out.o[0]) / out.d[0])[2];
            (principal, focus)
        };
        let from_scene = LensRay { o: [height, 0.0, lens.front_z() + 1.0], d: [0.0, 0.0, -1.0] };
        let from_film = LensRay { o: [height, 0.0, lens.rear_z() - 1.0], d: [0.0, 0.0, 1.0] };
        let (film_principal, film_focus) = cardinal(lens.trace_to_film(from_scene)?);
        let (scene_principal, scene_focus) = cardinal(lens.trace_to_scene(from_film)?.0);
        [film_principal, film_focus, scene_principal, scene_focus].iter().all(|z| z.is_finite()).then_some(Self {
            film_principal,
            film_focus,
            scene_principal,
        })
    }

    /// Effective focal length; positive for a lens that gathers light.
    pub fn focal_length(&self) -> f64 {
        self.film_principal - self.film_focus
    }

    /// How far the lens must move away from the film for a point of the axis at `distance` from the film to be sharp.
    /// `None` when it is too near.
    pub fn shift_to_focus(&self, distance: f64) -> Option<f64> {
        // Gauss: 1/f = 1/a + 1/b, with a and b from the shifted principal planes to the point and to the film.
        let f = self.focal_length();
        let span = distance - self.scene_principal + self.film_principal;
        let discriminant = span * (span - 4.0 * f);
        if !(discriminant > 0.0) {
            return None;
        }
        // b (span - b) = f span, the smaller root, in a form that keeps its digits for far points.
        let b = 2.0 * f * span / (span + discriminant.sqrt());
        Some(b - self.film_principal)
    }
}
