//! Warps to directions: hemisphere, sphere, cone; spherical coordinates; the equal-area square.

use crate::elementary::{ONE_MINUS_EPSILON, atan2, atan2_core, safe_acos, safe_sqrt, sin_cos, sin_cos_bounded};
use crate::vector::{Point2, Vec3};
use crate::warp::plane::{turn_fraction, uniform_disk_concentric, uniform_disk_concentric_inverse};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, TAU};

const INV_2_PI: f32 = 0.159_154_94;
const INV_4_PI: f32 = 0.079_577_47;

/// The unit vector at polar angle theta from +z and azimuth `phi` from +x.
#[inline]
pub fn spherical_direction(sin_theta: f32, cos_theta: f32, phi: f32) -> Vec3 {
    let (s, c) = sin_cos(phi);
    let sin_theta = sin_theta.clamp(-1.0, 1.0);
    Vec3::new(sin_theta * c, sin_theta * s, cos_theta.clamp(-1.0, 1.0))
}

/// Polar angle of the unit vector `v` from +z, in [0, pi].
#[inline]
pub fn spherical_theta(v: Vec3) -> f32 {
    safe_acos(v.z)
}

/// Azimuth of `v` from +x, in [0, 2 pi).
#[inline]
pub fn spherical_phi(v: Vec3) -> f32 {
    let phi = atan2(v.y, v.x);
    if phi < 0.0 { phi + TAU } else { phi }
}

/// Uniform direction of the hemisphere about +z: z from `u.x`, azimuth from `u.y`. pdf 1/(2 pi), per steradian.
#[inline]
pub fn uniform_hemisphere(u: Point2) -> Vec3 {
    let z = u.x;
    let r = safe_sqrt(1.0 - z * z);
    let (s, c) = sin_cos(TAU * u.y);
    Vec3::new(r * c, r * s, z)
}

/// Density of [`uniform_hemisphere`], per steradian.
#[inline]
pub const fn uniform_hemisphere_pdf() -> f32 {
    INV_2_PI
}

/// The `u` that [`uniform_hemisphere`] maps to `v`.
#[inline]
pub fn uniform_hemisphere_inverse(v: Vec3) -> Point2 {
    Point2::new(v.z, turn_fraction(v.y, v.x))
}

/// Uniform direction: z = 1 - 2 `u.x`, azimuth from `u.y`. pdf 1/(4 pi), per steradian.
#[inline]
pub fn uniform_sphere(u: Point2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = safe_sqrt(1.0 - z * z);
    let (s, c) = sin_cos(TAU * u.y);
    Vec3::new(r * c, r * s, z)
}

/// Density of [`uniform_sphere`], per steradian.
#[inline]
pub const fn uniform_sphere_pdf() -> f32 {
    INV_4_PI
}

/// The `u` that [`uniform_sphere`] maps to `v`.
#[inline]
pub fn uniform_sphere_inverse(v: Vec3) -> Point2 {
    Point2::new(0.5 * (1.0 - v.z), turn_fraction(v.y, v.x))
}

/// Cosine-weighted direction about +z. pdf = cos theta / pi, per steradian.
#[inline(always)]
pub fn cosine_hemisphere(u: Point2) -> Vec3 {
    let d = uniform_disk_concentric(u);
    Vec3::new(d.x, d.y, safe_sqrt(1.0 - d.x * d.x - d.y * d.y))
}

/// Density of [`cosine_hemisphere`] at cosine `cos_theta` >= 0, per steradian.
#[inline]
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta * FRAC_1_PI
}

/// The `u` that [`cosine_hemisphere`] maps to `v`.
#[inline]
pub fn cosine_hemisphere_inverse(v: Vec3) -> Point2 {
    uniform_disk_concentric_inverse(Point2::new(v.x, v.y))
}

/// Uniform direction of the cone about +z whose rim has cosine `cos_theta_max`.
#[inline]
pub fn uniform_cone(u: Point2, cos_theta_max: f32) -> Vec3 {
    uniform_cone_of_height(u, 1.0 - cos_theta_max)
}

/// Uniform direction of the cone about +z with `height` = 1 - cos theta_max: exact for cones of any smallness, where
/// the cosine has no digits left. With h = 1 - cos, sin^2 = h (2 - h), without cancellation.
#[inline]
pub fn uniform_cone_of_height(u: Point2, height: f32) -> Vec3 {
    let h = u.x * height;
    let sin_theta = safe_sqrt(h * (2.0 - h));
    let (s, c) = sin_cos(TAU * u.y);
    Vec3::new(sin_theta * c, sin_theta * s, 1.0 - h)
}

/// Density of [`uniform_cone`] inside it, per steradian.
#[inline]
pub fn uniform_cone_pdf(cos_theta_max: f32) -> f32 {
    INV_2_PI / (1.0 - cos_theta_max)
}

/// The `u` that [`uniform_cone`] maps to `v`.
#[inline]
pub fn uniform_cone_inverse(v: Vec3, cos_theta_max: f32) -> Point2 {
    Point2::new((1.0 - v.z) / (1.0 - cos_theta_max), turn_fraction(v.y, v.x))
}

/// The unit vector at a point of the unit square under the equal-area octahedral map.
///
/// Clarberg 2008, "Fast equal-area mapping of the (hemi)sphere using SIMD". The centre is +z, the corners are -z, the
/// middle of the right edge is +x and of the top edge (v = 1) +y; equal areas of the square are equal solid angles.
/// Orientation as pbrt-v4's environment images. Without branches, as its inverse: loops over them become vector code.
#[inline(always)]
pub fn equal_area_square_to_sphere(p: Point2) -> Vec3 {
    let (u, v) = (2.0 * p.x - 1.0, 2.0 * p.y - 1.0);
    let (au, av) = (u.abs(), v.abs());
    // Signed distance from the diagonal: positive in the upper hemisphere.
    let signed = 1.0 - (au + av);
    let r = 1.0 - signed.abs();
    let share = (av - au) / r + 1.0;
    let phi = if r == 0.0 { 1.0 } else { share } * (0.5 * FRAC_PI_2);
    let z = (1.0 - r * r).copysign(signed);
    let (s, c) = sin_cos_bounded(phi);
    let sin_theta = r * safe_sqrt(2.0 - r * r);
    Vec3::new((sin_theta * c.abs()).copysign(u), (sin_theta * s.abs()).copysign(v), z)
}

/// The point of the unit square that [`equal_area_square_to_sphere`] maps to the unit vector `d`.
#[inline(always)]
pub fn equal_area_sphere_to_square(d: Vec3) -> Point2 {
    let (x, y, z) = (d.x.abs(), d.y.abs(), d.z.abs());
    // sqrt(1 - z) as sin / sqrt(1 + z): the naive form has no digits near the poles.
    let r = ((x * x + y * y) / (1.0 + z)).sqrt().min(1.0);
    // 0 at the poles.
    let phi = atan2_core(y as f64, x as f64) as f32 * (1.0 / FRAC_PI_2);
    let v = phi * r;
    let u = r - v;
    let is_below = d.z < 0.0;
    let (u, v) = (if is_below { 1.0 - v } else { u }, if is_below { 1.0 - u } else { v });
    Point2::new(0.5 * (u.copysign(d.x) + 1.0), 0.5 * (v.copysign(d.y) + 1.0))
}

/// A point just outside of the unit square (by less than 1), continued across the octahedral map's edges.
///
/// For texture filters that reach over the border of an equal-area image.
#[inline]
pub fn wrap_equal_area_square(p: Point2) -> Point2 {
    let Point2 { mut x, mut y } = p;
    if x < 0.0 {
        (x, y) = (-x, 1.0 - y);
    } else if x > 1.0 {
        (x, y) = (2.0 - x, 1.0 - y);
    }
    if y < 0.0 {
        (x, y) = (1.0 - x, -y);
    } else if y > 1.0 {
        (x, y) = (1.0 - x, 2.0 - y);
    }
    Point2::new(x, y)
}

/// A unit vector in 32 bits: octahedral, 16 bits a coordinate, error below 8e-5 radians.
///
/// Cigolle et al. 2014, "A survey of efficient representations for independent unit vectors".
#[inline]
pub fn octahedral_encode(v: Vec3) -> [u16; 2] {
    let scale = 1.0 / (v.x.abs() + v.y.abs() + v.z.abs());
    let (x, y) = (v.x * scale, v.y * scale);
    let (x, y) = if v.z >= 0.0 { (x, y) } else { ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y)) };
    let quantise = |f: f32| (((f.clamp(-1.0, 1.0) + 1.0) * 0.5) * 65535.0 + 0.5) as u16;
    [quantise(x), quantise(y)]
}

/// The unit vector of [`octahedral_encode`]'s code.
#[inline]
pub fn octahedral_decode(code: [u16; 2]) -> Vec3 {
    let (mut x, mut y) = (code[0] as f32 * (2.0 / 65535.0) - 1.0, code[1] as f32 * (2.0 / 65535.0) - 1.0);
    let z = 1.0 - (x.abs() + y.abs());
    if z < 0.0 {
        (x, y) = ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y));
    }
    Vec3::new(x, y, z).normalize()
}

/// `x` kept inside [0, 1): for coordinates computed by an inverse map.
#[inline]
pub fn clamp_to_unit(x: f32) -> f32 {
    x.clamp(0.0, ONE_MINUS_EPSILON)
}

#[cfg(test)]
mod tests {
    use super::*;
    use irradiant_testkit::{Chi2, Rng, integrate_sphere};

    fn check(
        name: &str,
        draw: impl Fn(Point2) -> Vec3,
        pdf: impl Fn(Vec3) -> f32,
        inverse: impl Fn(Vec3) -> Point2,
        slack: f32,
    ) {
        // 1e-6 false alarms; 100,000 samples over 20 x 40 cells of equal solid angle; a density 5 % off over half of
        // the sphere gives p < 1e-10. Unit length is asserted for every sample.
        let mut rng = Rng::new(23);
        let report = Chi2::new(100_000).sphere(
            20,
            |d| pdf(Vec3::from(d.map(|c| c as f32))) as f64,
            || Some(draw(Point2::new(rng.next_f32(), rng.next_f32())).to_array()),
        );
        assert!(report.p_value > 1e-6, "{name}: {report:?}");
        for i in 1..64 {
            for j in 1..64 {
                let u = Point2::new(i as f32 / 64.0, j as f32 / 64.0);
                let v = draw(u);
                assert!((v.length() - 1.0).abs() < 3e-7);
                let back = inverse(v);
                assert!((back - u).length() < slack || v.z == 1.0, "{name}: {u:?} {v:?} {back:?}");
            }
        }
    }

    #[test]
    fn direction_warps_have_the_density_and_inverse_they_claim() {
        let upper = |v: Vec3, p: f32| if v.z > 0.0 { p } else { 0.0 };
        check(
            "hemisphere",
            uniform_hemisphere,
            |v| upper(v, uniform_hemisphere_pdf()),
            uniform_hemisphere_inverse,
            2e-6,
        );
        check("sphere", uniform_sphere, |_| uniform_sphere_pdf(), uniform_sphere_inverse, 2e-6);
        check("cosine", cosine_hemisphere, |v| upper(v, cosine_hemisphere_pdf(v.z)), cosine_hemisphere_inverse, 2e-6);
        for c in [0.9, 0.0, -0.7] {
            check(
                "cone",
                |u| uniform_cone(u, c),
                |v| if v.z >= c { uniform_cone_pdf(c) } else { 0.0 },
                |v| uniform_cone_inverse(v, c),
                2e-5,
            );
        }
        check("equal area", equal_area_square_to_sphere, |_| uniform_sphere_pdf(), equal_area_sphere_to_square, 2e-6);
    }

    #[test]
    fn densities_integrate_to_one() {
        let total = integrate_sphere(|d| cosine_hemisphere_pdf(d[2].max(0.0) as f32) as f64, 1e-6);
        assert!((total - 1.0).abs() < 1e-4, "{total}");
    }

    #[test]
    fn the_equal_area_square_is_oriented_as_documented() {
        let at = |x, y| equal_area_square_to_sphere(Point2::new(x, y));
        let near = |a: Vec3, b: Vec3| assert!((a - b).length() < 1e-6, "{a:?} {b:?}");
        near(at(0.5, 0.5), Vec3::Z);
        near(at(1.0, 0.5), Vec3::X);
        near(at(0.0, 0.5), -Vec3::X);
        near(at(0.5, 1.0), Vec3::Y);
        near(at(0.5, 0.0), -Vec3::Y);
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            near(at(x, y), -Vec3::Z);
        }
        // Halfway out along +x in the square, r = 1/2: z = 3/4.
        near(at(0.75, 0.5), Vec3::new((1f32 - 0.5625).sqrt(), 0.0, 0.75));
        // An arbitrary lower-hemisphere point, worked by hand from Clarberg's equations: u = 0.8, v = 0.6, d = -0.4,
        // r = 0.6, phi = (0.6 - 0.8) / 0.6 + 1 = 2/3 of pi/4, z = -0.64.
        let p = at(0.9, 0.8);
        assert!((p.z + 0.64).abs() < 1e-6 && (p.y.atan2(p.x) - std::f32::consts::PI / 6.0).abs() < 1e-6);
    }

    #[test]
    fn equal_area_edges_wrap_to_their_neighbours() {
        // Across an edge the map continues: points a little in and a little out are near on the sphere.
        for i in 0..200 {
            let t = i as f32 / 199.0;
            for (p, q) in [
                ((1e-4, t), (-1e-4, t)),
                ((1.0 - 1e-4, t), (1.0 + 1e-4, t)),
                ((t, 1e-4), (t, -1e-4)),
                ((t, 1.0 - 1e-4), (t, 1.0 + 1e-4)),
            ] {
                let a = equal_area_square_to_sphere(Point2::new(p.0, p.1));
                let b = equal_area_square_to_sphere(wrap_equal_area_square(Point2::new(q.0, q.1)));
                assert!((a - b).length() < 2e-3, "{p:?} {q:?} {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn poles_and_axes_survive_the_round_trip() {
        for v in [
            Vec3::X,
            Vec3::Y,
            Vec3::Z,
            -Vec3::X,
            -Vec3::Y,
            -Vec3::Z,
            Vec3::new(1e-5, 1e-6, 1.0),
            Vec3::new(-1e-5, 1e-6, -1.0),
        ] {
            let w = equal_area_square_to_sphere(equal_area_sphere_to_square(v));
            assert!((v - w).length() < 3e-7, "{v:?} {w:?}");
            let o = octahedral_decode(octahedral_encode(v));
            assert!((v - o).length() < 8e-5, "{v:?} {o:?}");
        }
        let mut rng = Rng::new(2);
        for _ in 0..10_000 {
            let v = uniform_sphere(Point2::new(rng.next_f32(), rng.next_f32()));
            assert!((v - octahedral_decode(octahedral_encode(v))).length() < 8e-5);
            assert!((spherical_direction(safe_sqrt(1.0 - v.z * v.z), v.z, spherical_phi(v)) - v).length() < 1e-6);
            assert!((spherical_theta(v).cos() - v.z).abs() < 1e-6);
        }
    }

    #[test]
    fn tiny_cones_keep_their_digits() {
        // A cone of 1e-5 radians: 1 - cos = 5e-11 cannot be told from the cosine in f32.
        let height = 5e-11;
        let v = uniform_cone_of_height(Point2::new(1.0, 0.0), height);
        assert!((v.x - 1e-5).abs() < 1e-11);
    }
}
