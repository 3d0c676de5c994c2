//! The lecture's numerical example (A63): a ray from the origin meets a circle of radius 1 some 2760 away.
//!
//! The lecture prints C = (1930.420, 1973.505), a "true" hit (1929.7203, 1972.7897) and a "computed" one (1930.4196,
//! 1973.5054). Its own digits are inconsistent: the "true" point is 1.00062 from C, and the "computed" one is 0.00057
//! from C, which is the centre. What the ray through the "true" point does in each arithmetic is computed here.

use super::number::school_roots;
use crate::geometry::placement::Placement;
use crate::geometry::sphere::Sphere;
use irradiant_math::{Point3, Ray, Transform, Vec3};

/// The circle's centre, as the lecture prints it.
pub const CENTER: [f64; 2] = [1930.420, 1973.505];
/// The hit that the lecture calls true.
pub const LECTURE_TRUE: [f64; 2] = [1929.7203, 1972.7897];
/// The hit that the lecture calls computed.
pub const LECTURE_COMPUTED: [f64; 2] = [1930.4196, 1973.5054];

/// A computed hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CircleHit {
    /// Where.
    pub p: [f64; 2],
    /// |p - C|, which should be 1.
    pub distance: f64,
}

/// The same hit by three arithmetics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FarCircle {
    /// The formula from school in single precision: wrong by 0.41.
    pub naive: CircleHit,
    /// The formula from school in double precision.
    pub double: CircleHit,
    /// What rays of a render get: a point of single precision, from arithmetic of double.
    pub ours: CircleHit,
    /// How far ours is from the sphere before its coordinates are rounded: in the sphere's own frame.
    pub ours_in_own_frame: f64,
}

fn at(p: [f64; 2]) -> CircleHit {
    let (x, y) = (p[0] - CENTER[0], p[1] - CENTER[1]);
    CircleHit { p, distance: (x * x + y * y).sqrt() }
}

/// How far the lecture's own two points are from the centre: neither lies on the circle.
pub fn lecture_distances() -> [f64; 2] {
    [at(LECTURE_TRUE).distance, at(LECTURE_COMPUTED).distance]
}

/// Computes the example.
pub fn far_circle() -> FarCircle {
    let length = (LECTURE_TRUE[0] * LECTURE_TRUE[0] + LECTURE_TRUE[1] * LECTURE_TRUE[1]).sqrt();
    let d = LECTURE_TRUE.map(|c| c / length);

    // In each precision everything is rounded to it, the input first.
    let d32 = d.map(|c| c as f32);
    let c32 = CENTER.map(|c| c as f32);
    let (a, b) = (d32[0] * d32[0] + d32[1] * d32[1], -2.0 * (d32[0] * c32[0] + d32[1] * c32[1]));
    let c = c32[0] * c32[0] + c32[1] * c32[1] - 1.0;
    let t = school_roots(a, b, c).map_or(f32::NAN, |t| t[0]);
    let naive = at(d32.map(|c| f64::from(t * c)));

    let (a, b) = (d[0] * d[0] + d[1] * d[1], -2.0 * (d[0] * CENTER[0] + d[1] * CENTER[1]));
    let c = CENTER[0] * CENTER[0] + CENTER[1] * CENTER[1] - 1.0;
    let t = school_roots(a, b, c).map_or(f64::NAN, |t| t[0]);
    let double = at(d.map(|c| t * c));

    // The sphere of a scene, and a ray as a render has it.
    let place = Transform::translate(CENTER[0], CENTER[1], 0.0);
    let sphere = Placement::new(&place, false).map(|p| Sphere::new(1.0, -1.0, 1.0, 360.0, p));
    let ray = Ray::new(Point3::ZERO, Vec3::new(d32[0], d32[1], 0.0), 0.0);
    let none = (CircleHit { p: [f64::NAN; 2], distance: f64::NAN }, f64::NAN);
    let (ours, ours_in_own_frame) = sphere
        .and_then(|s| {
            let placed = s.place(&ray, 0)?;
            let (o, d) = s.placement.ray_to_shape(&ray);
            let own = s.point(o, d, s.roots(o, d)?[0])?;
            let off = ((own[0] * own[0] + own[1] * own[1] + own[2] * own[2]).sqrt() - 1.0).abs();
            Some((at([f64::from(placed.p.x), f64::from(placed.p.y)]), off))
        })
        .unwrap_or(none);
    FarCircle { naive, double, ours, ours_in_own_frame }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A63, with the ledger's own figures.
    #[test]
    fn a_far_circle_is_missed_by_school_arithmetic_and_met_by_ours() {
        let close = |a: [f64; 2], b: [f64; 2], tolerance: f64| (0..2).all(|i| (a[i] - b[i]).abs() <= tolerance);
        let f = far_circle();
        assert!(close(f.double.p, [1929.7207, 1972.7901], 5e-5), "{f:?}");
        assert!((f.double.distance - 1.0).abs() < 1e-8, "{f:?}");
        assert!(close(f.naive.p, [1929.4312, 1972.4941], 2e-4), "{f:?}");
        assert!((f.naive.distance - 1.414).abs() < 1e-3, "{f:?}");
        assert!((f.ours.distance - 1.0).abs() < 3e-4, "{f:?}");
        assert!(f.ours_in_own_frame < 1e-7, "{f:?}");
        let [of_true, of_computed] = lecture_distances();
        assert!((of_true - 1.00062).abs() < 1e-5 && (of_computed - 0.00057).abs() < 1e-5, "{of_true} {of_computed}");
    }
}
