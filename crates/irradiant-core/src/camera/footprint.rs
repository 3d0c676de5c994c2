//! How large a pixel is where a path meets a surface.

use super::{Camera, CameraRay};
use crate::interaction::{Interaction, TextureContext};
use irradiant_math::vector::difference_of_products;
use irradiant_math::{AnimatedTransform, Frame, Point2, Point3, Vec3};

/// Changes of texture coordinates are cut off here, so that products of them stay finite (pbrt-v4's figure).
const MOST_CHANGE: f32 = 1e8;

/// Finds the extent of a pixel on surfaces.
///
/// Where the camera's own ray meets a surface, its neighbours are intersected with the tangent plane (Igehy 1999). Elsewhere
/// it is what the sharpest part of the camera would see of that point from where it stands, however the path came there
/// (Pharr, Jakob and Humphreys 2023, section 10.1.1): about right after flat mirrors, too sharp after rough scattering,
/// and free of state along the path. Footprints shrink with the number of samples, by 1 / sqrt(n), at most by 8. What filtering by them saves and
/// how far it blurs: decision 7.
#[derive(Clone, Debug)]
pub struct FootprintEstimator {
    /// The camera's position in render space, where it rests.
    origin: Point3,
    motion: Option<Box<AnimatedTransform>>,
    /// Smallest change of ray origin from pixel to pixel, in x and in y, in a frame along the ray.
    position: [Vec3; 2],
    /// Smallest change of unit direction.
    direction: [Vec3; 2],
    scale: f32,
}

/// Part of a pixel that one sample of `samples_per_pixel` is taken to stand for, lengthwise.
pub(super) fn sample_scale(samples_per_pixel: u32) -> f32 {
    (1.0 / (samples_per_pixel.max(1) as f32).sqrt()).max(0.125)
}

impl FootprintEstimator {
    /// Looks along the film's diagonal for the smallest changes from pixel to pixel.
    pub(super) fn new(camera: &Camera, resolution: [u32; 2], origin: Point3) -> Self {
        const PLACES: u32 = 512;
        let infinite = Vec3::new(f32::INFINITY, f32::INFINITY, f32::INFINITY);
        let (mut position, mut direction) = ([infinite; 2], [infinite; 2]);
        let keep_smaller = |least: &mut Vec3, change: Vec3| {
            if change.length_squared() < least.length_squared() {
                *least = change;
            }
        };
        for i in 0..PLACES {
            let at = i as f32 / (PLACES - 1) as f32;
            let film = Point2::new(at * resolution[0] as f32, at * resolution[1] as f32);
            let ray = camera.scaled_ray(film, Point2::new(0.5, 0.5), 0.5, 1.0).filter(|ray| ray.has_offsets);
            let Some(CameraRay { ray, offsets: o, .. }) = ray else { continue };
            let frame = Frame::from_z(ray.d);
            for (axis, [origin, change]) in
                [[o.origin_x, o.direction_x], [o.origin_y, o.direction_y]].into_iter().enumerate()
            {
                keep_smaller(&mut position[axis], frame.to_local(origin));
                keep_smaller(&mut direction[axis], frame.to_local((ray.d + change).normalize()) - Vec3::Z);
            }
        }
        // A camera that sees nothing has no footprint.
        let known = |v: Vec3| if v.is_finite() { v } else { Vec3::ZERO };
        Self {
            origin,
            motion: camera.motion.clone(),
            position: position.map(known),
            direction: direction.map(known),
            scale: camera.footprint_scale,
        }
    }

    /// How a hit looks to textures: by the camera ray that found it, or, for hits of other rays, by an estimate.
    #[inline]
    pub fn texture_context(&self, at: &Interaction, camera_ray: Option<&CameraRay>) -> TextureContext {
        let changes = camera_ray.and_then(|ray| ray.position_change(at));
        let [dpdx, dpdy] = changes.unwrap_or_else(|| self.estimate(at));
        let [dudx, dvdx, dudy, dvdy] = parameter_changes(at, dpdx, dpdy);
        TextureContext { dpdx, dpdy, dudx, dvdx, dudy, dvdy, ..TextureContext::point(at) }
    }

    /// Changes of position from pixel to pixel that the camera would see at least; zero where the surface is edge-on.
    #[inline]
    pub fn estimate(&self, at: &Interaction) -> [Vec3; 2] {
        let origin = match &self.motion {
            None => self.origin,
            Some(motion) => motion.at(at.time).point(Point3::ZERO),
        };
        let seen = at.p - origin;
        let distance = seen.length();
        let frame = Frame::from_z(seen * (1.0 / distance));
        let n = frame.to_local(at.n.as_vec());
        // The tangent plane in that frame is n . q = n.z distance.
        std::array::from_fn(|axis| {
            let (o, d) = (self.position[axis], Vec3::Z + self.direction[axis]);
            let t = (n.z * distance - n.dot(o)) / n.dot(d);
            let q = o + d * t;
            let change = frame.from_local(Vec3::new(q.x, q.y, q.z - distance)) * self.scale;
            if change.is_finite() { change } else { Vec3::ZERO }
        })
    }
}

/// Changes of (u, v) that come nearest to changes of position: du/dx, dv/dx, du/dy, dv/dy.
#[inline]
fn parameter_changes(at: &Interaction, dpdx: Vec3, dpdy: Vec3) -> [f32; 4] {
    // Least squares: the normal equations of dpdu du + dpdv dv = dp.
    let (uu, uv, vv) = (at.dpdu.dot(at.dpdu), at.dpdu.dot(at.dpdv), at.dpdv.dot(at.dpdv));
    let inverse = 1.0 / difference_of_products(uu, vv, uv, uv);
    let inverse = if inverse.is_finite() { inverse } else { 0.0 };
    let kept = |x: f32| if x.is_finite() { x.clamp(-MOST_CHANGE, MOST_CHANGE) } else { 0.0 };
    let solve = |dp: Vec3| {
        let (u, v) = (at.dpdu.dot(dp), at.dpdv.dot(dp));
        let du = difference_of_products(vv, u, uv, v) * inverse;
        let dv = difference_of_products(uu, v, uv, u) * inverse;
        [kept(du), kept(dv)]
    };
    let ([dudx, dvdx], [dudy, dvdy]) = (solve(dpdx), solve(dpdy));
    [dudx, dvdx, dudy, dvdy]
}
