//! An environment seen through a rectangle: scene word `infinite` with `portal`.
//!
//! Light arrives only through the portal, a window or a skylight whose corners p0 to p3 are given in world space, in
//! order around it, and only from the side that (p3 - p0) x (p1 - p0) points to. From a point, the portal is a box in
//! the angles atan(x/z), atan(y/z) about its normal, so the image is resampled to those angles and sampled within that
//! box (Bitterli, Novak and Jarosz 2015, "Portal-masked environment map sampling"; details as in pbrt-v4: the resampled
//! image has the resolution of the original and constant pixels).

use super::emission::{MeanRadiance, RadianceImage};
use super::orientation::Orientation;
use super::{EmittedRay, LightSample, LightTarget};
use irradiant_math::distribution::WindowedPiecewiseConstant2D;
use irradiant_math::elementary::{atan2, tan};
use irradiant_math::{Bounds2, Frame, Normal3, Point2, Point3, Ray, Vec3, warp};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};
use std::f32::consts::{FRAC_PI_2, PI};

/// An image environment behind a rectangular portal.
#[derive(Debug)]
pub struct PortalInfiniteLight {
    corners: [Point3; 4],
    /// x along p0 to p3, y along p0 to p1; light comes from the side of +z.
    frame: Frame,
    /// Over the two angles.
    image: RadianceImage,
    scale: f32,
    distribution: WindowedPiecewiseConstant2D,
    mean: MeanRadiance,
}

/// Why four corners are not a portal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PortalError {
    /// Opposite sides differ in direction, or neighbours are not perpendicular.
    NotRectangle,
    /// The image is not square, or empty.
    NotSquare,
}

const WHOLE: Bounds2 = Bounds2 { min: Point2 { x: 0.0, y: 0.0 }, max: Point2 { x: 1.0, y: 1.0 } };

impl PortalInfiniteLight {
    /// From corners in render space and an equal-area image in light space.
    ///
    pub fn new(
        corners: [Point3; 4],
        equal_area: &RadianceImage,
        orientation: &Orientation,
        scale: f32,
    ) -> Result<Self, PortalError> {
        let side = |a: usize, b: usize| (corners[b] - corners[a]).normalize();
        let (p01, p12, p32, p03) = (side(0, 1), side(1, 2), side(3, 2), side(0, 3));
        let parallel = |a: Vec3, b: Vec3| (a.dot(b) - 1.0).abs() <= 1e-3;
        let square = |a: Vec3, b: Vec3| a.dot(b).abs() <= 1e-3;
        if !(parallel(p01, p32) && parallel(p12, p03) && square(p01, p12) && square(p12, p32) && square(p03, p01)) {
            return Err(PortalError::NotRectangle);
        }
        let frame = Frame { x: p03, y: p01, z: p03.cross(p01) };
        let (width, height) = (equal_area.width(), equal_area.height());
        if width != height {
            return Err(PortalError::NotSquare);
        }
        let pixels = (0..width * height)
            .map(|i| {
                let (w, _) = direction(&frame, equal_area.center_of(i % width, i / width));
                equal_area.bilinear_octahedral(warp::equal_area_sphere_to_square(orientation.to_light(w)))
            })
            .collect();
        let image = equal_area.with_pixels(width, height, pixels);
        // Density by solid angle should follow radiance, so weigh pixels by their solid angle.
        let solid_angle = |uv| direction(&frame, uv).1;
        let distribution = WindowedPiecewiseConstant2D::new(image.sampling_weights(solid_angle), width, height)
            .ok_or(PortalError::NotSquare)?;
        let mean = image.mean_radiance(solid_angle);
        Ok(Self { corners, frame, image, scale, distribution, mean })
    }

    /// The part of the image that the portal shows from `p`; `None` from behind it.
    #[inline]
    fn window(&self, p: Point3) -> Option<Bounds2> {
        let (a, _) = image_point(&self.frame, (self.corners[0] - p).normalize())?;
        let (b, _) = image_point(&self.frame, (self.corners[2] - p).normalize())?;
        Some(Bounds2::new(a, b))
    }

    #[inline]
    fn radiance(&self, uv: Point2, lambda: &Wavelengths) -> SampledSpectrum {
        self.image.radiance(self.image.nearest(uv), lambda) * self.scale
    }

    /// See [`super::Light::sample`].
    #[inline]
    pub fn sample(&self, at: Point3, u: Point2, lambda: &Wavelengths) -> Option<LightSample> {
        let s = self.distribution.sample(u, &self.window(at)?)?;
        let (wi, solid_angle) = direction(&self.frame, s.p);
        let pdf = s.pdf / solid_angle;
        (pdf > 0.0 && pdf.is_finite()).then(|| LightSample {
            radiance: self.radiance(s.p, lambda),
            wi,
            pdf,
            target: LightTarget::Infinite,
            is_delta: false,
            alpha: None,
        })
    }

    /// See [`super::Light::pdf_escaped`].
    #[inline]
    pub fn pdf(&self, at: Point3, wi: Vec3) -> f32 {
        let Some((uv, solid_angle)) = image_point(&self.frame, wi) else { return 0.0 };
        self.window(at).map_or(0.0, |window| self.distribution.pdf(uv, &window) / solid_angle)
    }

    /// See [`super::Light::escaped`].
    #[inline]
    pub fn escaped(&self, origin: Point3, direction: Vec3, lambda: &Wavelengths) -> SampledSpectrum {
        match (image_point(&self.frame, direction.normalize()), self.window(origin)) {
            (Some((uv, _)), Some(window)) if window.contains(uv) => self.radiance(uv, lambda),
            _ => SampledSpectrum::ZERO,
        }
    }

    /// The direction in which light passes the portal.
    pub fn normal(&self) -> Normal3 {
        -self.frame.normal()
    }

    fn area(&self) -> f32 {
        (self.corners[1] - self.corners[0]).length() * (self.corners[3] - self.corners[0]).length()
    }

    /// See [`super::Light::power`]: radiance integrated over directions, times the portal's area.
    pub fn power(&self, lambda: &Wavelengths) -> SampledSpectrum {
        self.mean.sample(&self.image, lambda) * (self.scale * self.area())
    }

    /// See [`super::Light::emit`]: from points of the portal, so that what stands outside of it does not matter.
    pub fn emit(&self, u_position: Point2, u_direction: Point2, lambda: &Wavelengths, time: f32) -> Option<EmittedRay> {
        let s = self.distribution.sample(u_direction, &WHOLE)?;
        let (wi, solid_angle) = direction(&self.frame, s.p);
        let pdf_direction = s.pdf / solid_angle;
        let [p0, p1, _, p3] = self.corners;
        let origin = p0 + (p1 - p0) * u_position.x + (p3 - p0) * u_position.y;
        (pdf_direction > 0.0 && pdf_direction.is_finite()).then(|| EmittedRay {
            radiance: self.radiance(s.p, lambda),
            ray: Ray::new(origin, -wi, time),
            normal: self.normal(),
            uv: Point2::ZERO,
            pdf_position: 1.0 / self.area(),
            pdf_direction,
            alpha: None,
        })
    }

    /// Densities of [`PortalInfiniteLight::emit`] for a direction of travel: per area, per solid angle.
    pub fn pdf_emit(&self, w: Vec3) -> (f32, f32) {
        let direction = image_point(&self.frame, -w)
            .map_or(0.0, |(uv, solid_angle)| self.distribution.pdf(uv, &WHOLE) / solid_angle);
        (1.0 / self.area(), direction)
    }
}

/// The direction that a point of the image shows, and solid angle for a unit of image area there, sr.
#[inline]
fn direction(frame: &Frame, uv: Point2) -> (Vec3, f32) {
    let w = Vec3::new(tan((uv.x - 0.5) * PI), tan((uv.y - 0.5) * PI), 1.0).normalize();
    (frame.from_local(w), solid_angle_by_area(w))
}

/// Inverse of [`direction`], for a unit vector; `None` behind the plane of the portal.
#[inline]
fn image_point(frame: &Frame, w: Vec3) -> Option<(Point2, f32)> {
    let w = frame.to_local(w);
    if !(w.z > 0.0) {
        return None;
    }
    let coordinate = |t: f32| ((atan2(t, w.z) + FRAC_PI_2) * (1.0 / PI)).clamp(0.0, 1.0);
    Some((Point2::new(coordinate(w.x), coordinate(w.y)), solid_angle_by_area(w)))
}

/// pi^2 (1 - x^2) (1 - y^2) / z of the unit vector `w`.
#[inline]
fn solid_angle_by_area(w: Vec3) -> f32 {
    // x^2 + z^2 is 1 - y^2 without its loss of digits near the poles.
    let zz = w.z * w.z;
    PI * PI * (w.y * w.y + zz) * (w.x * w.x + zz) / w.z
}
