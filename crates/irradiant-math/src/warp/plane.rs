//! Planar warps: disks, triangles, bilinear densities.

use crate::elementary::{atan2, lerp, sin_cos, sin_cos_octant};
use crate::vector::Point2;
use crate::warp::line::{linear, linear_inverse};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, PI, TAU};

/// Uniform point of the unit disk by polar coordinates: radius from `u.x`, angle from `u.y`.
#[inline]
pub fn uniform_disk_polar(u: Point2) -> Point2 {
    let r = u.x.sqrt();
    let (s, c) = sin_cos(TAU * u.y);
    Point2::new(r * c, r * s)
}

/// The `u` that [`uniform_disk_polar`] maps to `p`.
#[inline]
pub fn uniform_disk_polar_inverse(p: Point2) -> Point2 {
    Point2::new(p.x * p.x + p.y * p.y, turn_fraction(p.y, p.x))
}

/// Density of a uniform point of the unit disk: 1/pi, per unit area.
#[inline]
pub const fn uniform_disk_pdf() -> f32 {
    FRAC_1_PI
}

/// Uniform point of the unit disk; squares around the centre become circles, so strata keep their shape.
///
/// Shirley and Chiu 1997. The centre of the square maps to the centre.
#[inline(always)]
pub fn uniform_disk_concentric(u: Point2) -> Point2 {
    let (x, y) = (2.0 * u.x - 1.0, 2.0 * u.y - 1.0);
    if x == 0.0 && y == 0.0 {
        return Point2::ZERO;
    }
    // Within pi/4 of the dominant axis, without a branch on which that is: noise to the processor.
    let steep = x.abs() <= y.abs();
    let (r, other) = if steep { (y, x) } else { (x, y) };
    let (s, c) = sin_cos_octant(FRAC_PI_4 * (other / r));
    let (along, across) = (r * c, r * s);
    if steep { Point2::new(across, along) } else { Point2::new(along, across) }
}

/// The `u` that [`uniform_disk_concentric`] maps to `p`.
#[inline]
pub fn uniform_disk_concentric_inverse(p: Point2) -> Point2 {
    let r = (p.x * p.x + p.y * p.y).sqrt();
    // Fold into the wedge around the dominant axis; there the angle over pi/4 is the other coordinate over r.
    let (x, y) = if p.x.abs() > p.y.abs() {
        let x = r.copysign(p.x);
        (x, x * (atan2(p.y / p.x, 1.0) * (4.0 / PI)))
    } else if p.y != 0.0 {
        let y = r.copysign(p.y);
        (y * (atan2(p.x / p.y, 1.0) * (4.0 / PI)), y)
    } else {
        (0.0, 0.0)
    };
    Point2::new(0.5 * (x + 1.0), 0.5 * (y + 1.0))
}

/// The angle of (x, y) as a fraction of a turn, in [0, 1).
#[inline]
pub(crate) fn turn_fraction(y: f32, x: f32) -> f32 {
    let t = atan2(y, x) * (1.0 / TAU);
    // A tiny negative angle plus 1 would round to 1.
    if t < 0.0 { (t + 1.0).min(crate::elementary::ONE_MINUS_EPSILON) } else { t }
}

/// Barycentric coordinates of a uniform point of a triangle; continuous, and gentler to strata than the square root.
///
/// Heitz 2019, "A low-distortion map between triangle and square".
#[inline]
pub fn uniform_triangle(u: Point2) -> [f32; 3] {
    let (b0, b1) = if u.x < u.y {
        let b0 = 0.5 * u.x;
        (b0, u.y - b0)
    } else {
        let b1 = 0.5 * u.y;
        (u.x - b1, b1)
    };
    [b0, b1, 1.0 - b0 - b1]
}

/// The `u` that [`uniform_triangle`] maps to barycentric coordinates `b`.
#[inline]
pub fn uniform_triangle_inverse(b: [f32; 3]) -> Point2 {
    if b[0] > b[1] { Point2::new(b[0] + b[1], 2.0 * b[1]) } else { Point2::new(2.0 * b[0], b[0] + b[1]) }
}

/// A point of the unit square with density bilinear between corner weights `w` at (0,0), (1,0), (0,1), (1,1).
///
/// Weights >= 0, not all zero; for all zero the result is not finite: see [`bilinear_pdf`].
#[inline(always)]
pub fn bilinear(u: Point2, w: [f32; 4]) -> Point2 {
    let y = linear(u.y, w[0] + w[1], w[2] + w[3]);
    let x = linear(u.x, lerp(y, w[0], w[2]), lerp(y, w[1], w[3]));
    Point2::new(x, y)
}

/// Density of [`bilinear`] on the unit square, 0 outside; 1 when all weights are zero.
#[inline(always)]
pub fn bilinear_pdf(p: Point2, w: [f32; 4]) -> f32 {
    if !((0.0..=1.0).contains(&p.x) && (0.0..=1.0).contains(&p.y)) {
        return 0.0;
    }
    let sum = w[0] + w[1] + w[2] + w[3];
    if sum == 0.0 {
        return 1.0;
    }
    4.0 * lerp(p.y, lerp(p.x, w[0], w[1]), lerp(p.x, w[2], w[3])) / sum
}

/// The `u` that [`bilinear`] maps to `p`.
#[inline]
pub fn bilinear_inverse(p: Point2, w: [f32; 4]) -> Point2 {
    Point2::new(
        linear_inverse(p.x, lerp(p.y, w[0], w[2]), lerp(p.y, w[1], w[3])),
        linear_inverse(p.y, w[0] + w[1], w[2] + w[3]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use irradiant_testkit::{Chi2, Rng};

    fn check(
        name: &str,
        low: f64,
        draw: impl Fn(Point2) -> Point2,
        pdf: impl Fn(Point2) -> f32,
        inverse: impl Fn(Point2) -> Point2,
    ) {
        // 1e-6 false alarms; 100,000 samples in 400 cells: a density wrong by 5 % over half the domain gives a
        // chi-square near 650, p < 1e-13.
        let mut rng = Rng::new(17);
        let report = Chi2::new(100_000).grid(
            [low, low],
            [1.0, 1.0],
            [20, 20],
            |x, y| pdf(Point2::new(x as f32, y as f32)) as f64,
            || {
                let p = draw(Point2::new(rng.next_f32(), rng.next_f32()));
                Some([p.x as f64, p.y as f64])
            },
        );
        assert!(report.p_value > 1e-6, "{name}: {report:?}");
        for i in 1..64 {
            for j in 1..64 {
                let u = Point2::new(i as f32 / 64.0, j as f32 / 64.0);
                let v = inverse(draw(u));
                assert!((v - u).length() < 2e-6 || draw(u) == Point2::ZERO, "{name}: {u:?} {v:?}");
            }
        }
    }

    #[test]
    fn plane_warps_have_the_density_and_inverse_they_claim() {
        let disk = |p: Point2| if p.x * p.x + p.y * p.y <= 1.0 { uniform_disk_pdf() } else { 0.0 };
        check("disk polar", -1.0, uniform_disk_polar, disk, uniform_disk_polar_inverse);
        check("disk concentric", -1.0, uniform_disk_concentric, disk, uniform_disk_concentric_inverse);
        check(
            "triangle",
            0.0,
            |u| Point2::new(uniform_triangle(u)[0], uniform_triangle(u)[1]),
            |p| if p.x + p.y <= 1.0 { 2.0 } else { 0.0 },
            |p| uniform_triangle_inverse([p.x, p.y, 1.0 - p.x - p.y]),
        );
        for w in [[1.0, 1.0, 1.0, 1.0], [0.0, 1.0, 2.0, 3.0], [5.0, 0.1, 0.2, 4.0]] {
            check("bilinear", 0.0, |u| bilinear(u, w), |p| bilinear_pdf(p, w), |p| bilinear_inverse(p, w));
        }
    }

    #[test]
    fn edges_of_the_square_stay_on_the_shapes() {
        for u in [0.0, 0.5, crate::elementary::ONE_MINUS_EPSILON] {
            for v in [0.0, 0.5, crate::elementary::ONE_MINUS_EPSILON] {
                let u = Point2::new(u, v);
                let p = uniform_disk_concentric(u);
                assert!(p.x * p.x + p.y * p.y <= 1.0 + 3e-7);
                assert!(uniform_triangle(u).iter().all(|b| *b >= -1e-7));
            }
        }
        assert!(turn_fraction(-1e-30, 1.0) < 1.0);
    }
}
