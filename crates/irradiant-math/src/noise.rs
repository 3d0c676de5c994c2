//! Gradient noise and its sums over octaves, with pbrt-v4's values.
//!
//! Perlin 1985, "An image synthesizer", with the permutation and the quintic weight of Perlin 2002, "Improving noise";
//! gradients are chosen as pbrt does, which differs from Perlin's program for two of the sixteen cases. Textures that
//! look the same as in pbrt depend on these exact choices.

use crate::elementary::{lerp, log2, smoothstep};
use crate::vector::{Point3, Vec3};

/// Perlin's permutation of 0..=255 (2002).
static PERMUTATION: [u8; 256] = [
    151, 160, 137, 91, 90, 15, 131, 13, 201, 95, 96, 53, 194, 233, 7, 225, 140, 36, 103, 30, 69, 142, 8, 99, 37, 240,
    21, 10, 23, 190, 6, 148, 247, 120, 234, 75, 0, 26, 197, 62, 94, 252, 219, 203, 117, 35, 11, 32, 57, 177, 33, 88,
    237, 149, 56, 87, 174, 20, 125, 136, 171, 168, 68, 175, 74, 165, 71, 134, 139, 48, 27, 166, 77, 146, 158, 231, 83,
    111, 229, 122, 60, 211, 133, 230, 220, 105, 92, 41, 55, 46, 245, 40, 244, 102, 143, 54, 65, 25, 63, 161, 1, 216,
    80, 73, 209, 76, 132, 187, 208, 89, 18, 169, 200, 196, 135, 130, 116, 188, 159, 86, 164, 100, 109, 198, 173, 186,
    3, 64, 52, 217, 226, 250, 124, 123, 5, 202, 38, 147, 118, 126, 255, 82, 85, 212, 207, 206, 59, 227, 47, 16, 58, 17,
    182, 189, 28, 42, 223, 183, 170, 213, 119, 248, 152, 2, 44, 154, 163, 70, 221, 153, 101, 155, 167, 43, 172, 9, 129,
    22, 39, 253, 19, 98, 108, 110, 79, 113, 224, 232, 178, 185, 112, 104, 218, 246, 97, 228, 251, 34, 242, 193, 238,
    210, 144, 12, 191, 179, 162, 241, 81, 51, 145, 235, 249, 14, 239, 107, 49, 192, 214, 31, 181, 199, 106, 157, 184,
    84, 204, 176, 115, 121, 50, 45, 127, 4, 150, 254, 138, 236, 205, 93, 222, 114, 67, 29, 24, 72, 243, 141, 128, 195,
    78, 66, 215, 61, 156, 180,
];

#[inline]
fn permute(i: usize) -> usize {
    PERMUTATION[i & 255] as usize
}

/// The gradients: a table, since the rule's branches are unpredictable (three times slower when measured).
static GRADIENTS: [[f32; 3]; 16] = gradients();

/// Two of three components are +-1: u from bit 0, v from bit 1.
const fn gradients() -> [[f32; 3]; 16] {
    let mut table = [[0.0; 3]; 16];
    let mut h = 0;
    while h < 16 {
        let u = if h < 8 || h == 12 || h == 13 { 0 } else { 1 };
        let v = if h < 4 || h == 12 || h == 13 { 1 } else { 2 };
        table[h][u] = if h & 1 == 0 { 1.0 } else { -1.0 };
        table[h][v] = if h & 2 == 0 { 1.0 } else { -1.0 };
        h += 1;
    }
    table
}

/// The dot product of (dx, dy, dz) with the gradient of a lattice point, whose hash so far is `xy` (permuted x + y).
#[inline]
fn gradient(xy: usize, z: usize, dx: f32, dy: f32, dz: f32) -> f32 {
    let g = &GRADIENTS[permute(xy + z) & 15];
    g[0] * dx + g[1] * dy + g[2] * dz
}

/// Splits a coordinate into its lattice cell (modulo 256) and the rest in [0, 1].
#[inline]
fn cell(x: f32) -> (usize, f32) {
    // Beyond 2^30 floats are whole numbers and the cell would not fit an integer.
    let x = if x.abs() < 1_073_741_824.0 { x } else { x % 1_073_741_824.0 };
    let floor = x.floor();
    ((floor as i32 & 255) as usize, x - floor)
}

#[inline]
fn weight(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Perlin noise at a point: continuous, 0 at whole coordinates, within [-1, 1], period 256. NaN for non-finite points.
pub fn noise(p: Point3) -> f32 {
    let ((ix, dx), (iy, dy), (iz, dz)) = (cell(p.x), cell(p.y), cell(p.z));
    let (x0, x1) = (permute(ix), permute(ix + 1));
    let (h00, h10, h01, h11) = (permute(x0 + iy), permute(x1 + iy), permute(x0 + iy + 1), permute(x1 + iy + 1));
    let (ex, ey, ez) = (dx - 1.0, dy - 1.0, dz - 1.0);
    let (wx, wy, wz) = (weight(dx), weight(dy), weight(dz));
    let near = lerp(
        wy,
        lerp(wx, gradient(h00, iz, dx, dy, dz), gradient(h10, iz, ex, dy, dz)),
        lerp(wx, gradient(h01, iz, dx, ey, dz), gradient(h11, iz, ex, ey, dz)),
    );
    let far = lerp(
        wy,
        lerp(wx, gradient(h00, iz + 1, dx, dy, ez), gradient(h10, iz + 1, ex, dy, ez)),
        lerp(wx, gradient(h01, iz + 1, dx, ey, ez), gradient(h11, iz + 1, ex, ey, ez)),
    );
    lerp(wz, near, far)
}

/// How many octaves (with a fraction) a footprint can resolve: those whose period exceeds twice its longer side.
#[inline]
fn visible_octaves(dpdx: Vec3, dpdy: Vec3, max_octaves: u32) -> (u32, f32) {
    let length_squared = dpdx.length_squared().max(dpdy.length_squared());
    let n = (-1.0 - 0.5 * log2(length_squared)).max(0.0).min(max_octaves as f32);
    (n as u32, n - n.floor())
}

/// Each octave is a little less than twice as fine, so that lattices do not line up.
const LACUNARITY: f32 = 1.99;

#[inline]
fn scaled(p: Point3, s: f32) -> Point3 {
    p * s
}

/// Fractional Brownian motion: octaves of [`noise`], each `omega` times as strong as the last, faded out where the footprint
/// (`dpdx`, `dpdy`: the change of `p` from pixel to pixel) cannot resolve them. Mandelbrot and Van Ness 1968.
pub fn fbm(p: Point3, dpdx: Vec3, dpdy: Vec3, omega: f32, max_octaves: u32) -> f32 {
    let (octaves, partial) = visible_octaves(dpdx, dpdy, max_octaves);
    let (mut sum, mut scale, mut strength) = (0.0, 1.0, 1.0);
    for _ in 0..octaves {
        sum += strength * noise(scaled(p, scale));
        scale *= LACUNARITY;
        strength *= omega;
    }
    sum + strength * smoothstep(partial, 0.3, 0.7) * noise(scaled(p, scale))
}

/// Turbulence: like [`fbm`] of |noise|, with the mean 0.2 of |noise| for octaves that are too fine. Perlin 1985.
///
/// As in pbrt-v4, the octave that is partly visible is counted again among those that are not, so unresolved turbulence
/// comes out brighter than its mean (0.6 instead of 0.4 for 8 octaves of omega 1/2); pictures depend on it.
pub fn turbulence(p: Point3, dpdx: Vec3, dpdy: Vec3, omega: f32, max_octaves: u32) -> f32 {
    let (octaves, partial) = visible_octaves(dpdx, dpdy, max_octaves);
    let (mut sum, mut scale, mut strength) = (0.0, 1.0, 1.0);
    for _ in 0..octaves {
        sum += strength * noise(scaled(p, scale)).abs();
        scale *= LACUNARITY;
        strength *= omega;
    }
    sum += strength * lerp(smoothstep(partial, 0.3, 0.7), 0.2, noise(scaled(p, scale)).abs());
    for _ in octaves..max_octaves {
        sum += strength * 0.2;
        strength *= omega;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::Pcg32;

    #[test]
    fn values_are_those_of_an_independent_program() {
        for ((x, y, z), expected) in NOISE_VALUES {
            let got = noise(Point3::new(x, y, z));
            assert!((got - expected).abs() < 2e-6, "{x} {y} {z}: {got} {expected}");
        }
        for (omega, octaves, footprint, f, t) in OCTAVE_VALUES {
            let (p, d) = (Point3::new(1.3, -2.7, 5.1), Vec3::new(footprint, 0.0, 0.0));
            let (got_f, got_t) = (fbm(p, d, Vec3::ZERO, omega, octaves), turbulence(p, d, Vec3::ZERO, omega, octaves));
            assert!((got_f - f).abs() < 2e-5 && (got_t - t).abs() < 2e-5, "{got_f} {f} {got_t} {t}");
        }
    }

    #[test]
    fn noise_is_bounded_continuous_periodic_and_vanishes_on_the_lattice() {
        let mut rng = Pcg32::new(1, 2);
        let mut widest = 0f32;
        for _ in 0..100_000 {
            let p = Point3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 300.0;
            let v = noise(p);
            widest = widest.max(v.abs());
            assert!((v - noise(p + Vec3::new(1e-3, 0.0, 0.0))).abs() < 0.01);
        }
        assert!(widest <= 1.0 && widest > 0.7, "{widest}");
        assert_eq!(noise(Point3::new(3.0, -7.0, 255.0)), 0.0);
        let p = Point3::new(0.25, 0.5, 0.125);
        assert_eq!(noise(p), noise(p + Vec3::new(256.0, -256.0, 512.0)));
        for huge in [1e9, -1e9, 3e38, -3e38] {
            assert!(noise(Point3::new(huge, 0.5, huge)).abs() <= 1.0);
        }
        assert!(noise(Point3::new(f32::INFINITY, 0.0, 0.0)).is_nan());
    }

    #[test]
    fn unresolved_turbulence_is_the_mean_that_pbrt_puts_there() {
        // Fully unresolved: 0.2 for the partial octave and 0.2 omega^i for each octave, hence 0.2 + 0.2 * 1.992.
        let p = Point3::new(1.3, -2.7, 5.1);
        assert!((turbulence(p, Vec3::X, Vec3::ZERO, 0.5, 8) - 0.598_437_5).abs() < 1e-6);
        // Fully resolved, the mean is that of |noise|, near 0.2, times 1.992.
        let mut rng = Pcg32::new(1, 2);
        let mean = irradiant_testkit::Mean::of(20_000, || {
            let p = Point3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 250.0;
            turbulence(p, Vec3::ZERO, Vec3::ZERO, 0.5, 8) as f64
        });
        assert!((mean.mean() / 1.992 - 0.21).abs() < 0.02, "{mean:?}");
    }

    // (point, noise there), by a program written from the formulas in f64.
    const NOISE_VALUES: [((f32, f32, f32), f32); 6] = [
        ((0.5, 0.25, 0.75), -0.3750787),
        ((1.3, -2.7, 5.1), 0.0455298),
        ((-10.125, 200.5, 33.0625), -0.0628800),
        ((254.75, 255.5, 255.9375), 0.0512287),
        ((0.0625, 0.0, 0.0), 0.0602818),
        ((-0.5, -0.25, -0.125), -0.2705155),
    ];

    // (omega, octaves, footprint, fbm, turbulence) at (1.3, -2.7, 5.1).
    const OCTAVE_VALUES: [(f32, u32, f32, f32, f32); 4] = [
        (0.5, 8, 0.0, -0.3488720, 0.4639302),
        (0.5, 8, 0.1, -0.2648851, 0.5039479),
        (0.7, 4, 0.33, 0.0383468, 0.5764999),
        (0.5, 3, 2.0, 0.0000000, 0.5500000),
    ];
}
