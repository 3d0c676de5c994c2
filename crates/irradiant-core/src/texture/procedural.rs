//! Patterns that formulas make: checkerboards, polka dots, marble, wind over water.
//!
//! Values are pbrt-v4's (Pharr, Jakob and Humphreys 2023, 10.5), tested at points computed from its formulas.

use super::mapping::{Coordinates, SolidCoordinates};
use irradiant_math::Point3;
use irradiant_math::elementary::sin;
use irradiant_math::noise::{fbm, noise};

/// The mean of a square wave (1 on [0, 1), -1 on [1, 2), and so on) under a tent of half-width `r` about `x`.
///
/// The second difference of the wave's second integral. It cancels badly for narrow tents: pbrt-v4 computes it in single
/// precision and leaves [-1, 1] there; here it is in double and stays.
fn filtered_square_wave(x: f32, r: f32) -> f32 {
    let (x, r) = (f64::from(x), f64::from(r));
    let floor = x.floor();
    if (x - r).floor() == (x + r).floor() {
        return if (floor as i64) & 1 == 0 { 1.0 } else { -1.0 };
    }
    let integral = |x: f64| {
        let y = x / 2.0 - (x / 2.0).floor() - 0.5;
        x / 2.0 + y * (1.0 - 2.0 * y.abs())
    };
    let mean = (integral(x + r) - 2.0 * integral(x) + integral(x - r)) / (r * r);
    // Not a number for infinite footprints: they see the mean.
    if mean.is_nan() { 0.0 } else { mean.clamp(-1.0, 1.0) as f32 }
}

/// Tents are this much wider than the pixel spacing on each side.
const TENT: f32 = 1.5;

/// The share of the second texture of a checkerboard of unit squares, averaged over the footprint, in [0, 1].
#[inline]
pub fn checkerboard(c: &Coordinates) -> f32 {
    let ds = TENT * c.dx[0].abs().max(c.dy[0].abs());
    let dt = TENT * c.dx[1].abs().max(c.dy[1].abs());
    0.5 - 0.5 * filtered_square_wave(c.s, ds) * filtered_square_wave(c.t, dt)
}

/// The share of the second texture of a board of unit cubes, averaged over the footprint, in [0, 1].
#[inline]
pub fn solid_checkerboard(c: &SolidCoordinates) -> f32 {
    let wave = |i: usize| filtered_square_wave(c.p[i], TENT * c.dpdx[i].abs().max(c.dpdy[i].abs()));
    0.5 - 0.5 * wave(0) * wave(1) * wave(2)
}

/// The share of the plane that polka dots cover.
pub const DOT_SHARE: f32 = 0.153;

/// Whether (s, t) lies in a polka dot: two in five unit cells hold one of radius 0.35, shifted at
/// random. (The noise that decides is symmetric, but exactly 0 in every fifth cell's centre.)
pub fn in_polka_dot(s: f32, t: f32) -> bool {
    let (cell_s, cell_t) = ((s + 0.5).floor(), (t + 0.5).floor());
    let random = |ds: f32, dt: f32| noise(Point3::new(cell_s + ds, cell_t + dt, 0.5));
    const RADIUS: f32 = 0.35;
    if !(random(0.5, 0.5) > 0.0) {
        return false;
    }
    let shift = 0.5 - RADIUS;
    let (x, y) = (s - (cell_s + shift * random(1.5, 2.8)), t - (cell_t + shift * random(4.5, 9.8)));
    x * x + y * y < RADIUS * RADIUS
}

/// The height of waves under gusts of wind.
pub fn windy(c: &SolidCoordinates) -> f32 {
    let strength = fbm(c.p * 0.1, c.dpdx * 0.1, c.dpdy * 0.1, 0.5, 3);
    strength.abs() * fbm(c.p, c.dpdx, c.dpdy, 0.5, 6)
}

/// Colours along a vein, as control points of a chain of cubic curves; linear sRGB.
const VEIN: [[f32; 3]; 9] = {
    let (stone, grey, warm, dark) = ([0.58, 0.58, 0.6], [0.5, 0.5, 0.5], [0.6, 0.59, 0.58], [0.2, 0.2, 0.33]);
    [stone, stone, stone, grey, warm, stone, stone, dark, stone]
};

/// The colour of marble: layers in y, bent by noise. Linear sRGB, each component in [0, 1].
pub fn marble(c: &SolidCoordinates, octaves: u32, omega: f32, scale: f32, variation: f32) -> [f32; 3] {
    let p = c.p * scale;
    let layer = p.y + variation * fbm(p, c.dpdx * scale, c.dpdy * scale, omega, octaves);
    let along = 0.5 + 0.5 * sin(layer);
    // Six overlapping cubic Bézier segments, the last of which begins at the sixth point.
    let segments = VEIN.len() - 3;
    let first = ((along * segments as f32) as usize).min(segments - 1);
    let t = along * segments as f32 - first as f32;
    let s = 1.0 - t;
    let weights = [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t];
    std::array::from_fn(|i| {
        let sum: f32 = weights.iter().zip(&VEIN[first..]).map(|(w, point)| w * point[i]).sum();
        (1.5 * sum).clamp(0.0, 1.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use irradiant_math::Vec3;

    fn at(s: f32, t: f32, d: f32) -> Coordinates {
        Coordinates { s, t, dx: [d, 0.0], dy: [0.0, d] }
    }

    #[test]
    fn a_sharp_board_has_squares() {
        for (s, t, expected) in [
            (0.5, 0.5, 0.0),
            (1.5, 0.5, 1.0),
            (1.5, 1.5, 0.0),
            (-0.5, 0.5, 1.0),
            (-0.5, -0.5, 0.0),
            (100.25, 7.75, 1.0),
            (1e9, 0.5, 0.0),
        ] {
            assert_eq!(checkerboard(&at(s, t, 0.0)), expected, "{s} {t}");
        }
    }

    // The closed form against a sum over the tent: wrong by 0.1 % of a square's contrast fails.
    #[test]
    fn a_blurred_wave_is_its_mean_under_a_tent() {
        for (x, r) in [(0.1f32, 0.3f32), (0.95, 0.2), (1.02, 0.7), (-3.3, 1.4), (7.5, 2.3), (12.25, 11.0)] {
            let n = 40_000;
            let mean: f64 = (0..n)
                .map(|i| {
                    let d = (i as f64 + 0.5) / n as f64 * 2.0 - 1.0;
                    let wave = if ((f64::from(x) + d * f64::from(r)).floor() as i64) & 1 == 0 { 1.0 } else { -1.0 };
                    2.0 * (1.0 - d.abs()) * wave / n as f64
                })
                .sum();
            let got = filtered_square_wave(x, r);
            assert!((f64::from(got) - mean).abs() < 1e-3, "{x} {r}: {got} {mean}");
        }
        assert!(filtered_square_wave(0.3, 1e4).abs() < 1e-3);
        for r in [f32::INFINITY, f32::NAN] {
            assert_eq!(filtered_square_wave(0.3, r), 0.0);
        }
        // Narrow tents over an edge far out: in single precision this leaves the range.
        for i in 0..1000 {
            let v = filtered_square_wave(4097.0 + (i as f32 - 500.0) * 1e-6, 3e-4);
            assert!(v.abs() <= 1.0);
        }
    }

    #[test]
    fn blurred_boards_are_grey() {
        // A tent of half-width 1.5 x 0.1 at 0.05 from an edge: (1 - 0.05/0.15)^2 / 2 of it lie beyond.
        assert!((checkerboard(&at(0.95, 0.5, 0.1)) - 2.0 / 9.0).abs() < 1e-5);
        let c = SolidCoordinates {
            p: Point3::new(0.5, 0.95, 0.5),
            dpdx: Vec3::new(0.02, -0.03, 0.0),
            dpdy: Vec3::new(0.0, 0.1, 0.01),
        };
        assert!((solid_checkerboard(&c) - 2.0 / 9.0).abs() < 1e-5);
        assert!((checkerboard(&at(0.3, 0.7, 500.0)) - 0.5).abs() < 1e-4);
        let wide =
            SolidCoordinates { p: Point3::new(0.1, 0.2, 0.3), dpdx: Vec3::new(300.0, 300.0, 300.0), dpdy: Vec3::ZERO };
        assert!((solid_checkerboard(&wide) - 0.5).abs() < 1e-4);
        let sharp = |x, y, z| {
            solid_checkerboard(&SolidCoordinates { p: Point3::new(x, y, z), dpdx: Vec3::ZERO, dpdy: Vec3::ZERO })
        };
        assert_eq!((sharp(0.5, 0.5, 0.5), sharp(0.5, 0.5, 1.5), sharp(1.5, 0.5, 1.5)), (0.0, 1.0, 0.0));
    }

    // Dots are whole within their cells, so their share is that of cells that hold one times pi 0.35^2: both are counted.
    // The grid knows the area to 1 %; a radius or a shift wrong by 2 % fails.
    #[test]
    fn dots_cover_their_share() {
        let (mut inside, mut cells, n) = (0, 0, 256);
        for i in 0..n {
            for j in 0..n {
                let (x, y) = (i as f32, j as f32);
                cells += i32::from(noise(Point3::new(x + 0.5, y + 0.5, 0.5)) > 0.0);
                for (k, l) in (0..25).map(|k| (k % 5, k / 5)) {
                    let jitter = ((i * 31 + j * 17) % 64) as f32 * (0.2 / 64.0);
                    let (s, t) = (x - 0.5 + k as f32 * 0.2 + jitter, y - 0.5 + l as f32 * 0.2 + 0.2 - jitter);
                    inside += i32::from(in_polka_dot(s, t));
                }
            }
        }
        let (all, cells) = (f64::from(n * n), f64::from(cells));
        let share = f64::from(inside) / (25.0 * all);
        let expected = cells / all * std::f64::consts::PI * 0.35 * 0.35;
        assert!((share / expected - 1.0).abs() < 0.01, "{share} {expected}");
        assert!((share - DOT_SHARE as f64).abs() < 0.002, "{share}");
    }

    #[test]
    fn marble_is_the_curve() {
        // Without noise the layer is y: at y = -pi/2 the curve begins, at pi/2 it ends, both in the stone's colour.
        let colour = |y: f32| {
            let c = SolidCoordinates { p: Point3::new(0.0, y, 0.0), dpdx: Vec3::ZERO, dpdy: Vec3::ZERO };
            marble(&c, 8, 0.5, 1.0, 0.0)
        };
        for y in [-std::f32::consts::FRAC_PI_2, std::f32::consts::FRAC_PI_2] {
            for (got, expected) in colour(y).into_iter().zip([0.87, 0.87, 0.9]) {
                assert!((got - expected).abs() < 1e-5, "{got} {expected}");
            }
        }
        // In the middle: t = 3 of 6, the start of the fourth segment, control point "grey".
        for got in colour(0.0) {
            assert!((got - 0.75).abs() < 1e-5, "{got}");
        }
    }

    #[test]
    fn wind_is_the_product_of_two_octave_sums() {
        let c =
            SolidCoordinates { p: Point3::new(1.3, -2.7, 5.1), dpdx: Vec3::new(0.01, 0.01, 0.01), dpdy: Vec3::ZERO };
        let gust = fbm(Point3::new(0.13, -0.27, 0.51), Vec3::new(0.001, 0.001, 0.001), Vec3::ZERO, 0.5, 3).abs();
        assert!((windy(&c) - gust * fbm(c.p, c.dpdx, c.dpdy, 0.5, 6)).abs() < 1e-6);
    }
}
