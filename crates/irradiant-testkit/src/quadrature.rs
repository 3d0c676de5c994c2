//! Adaptive quadrature in one and two dimensions and over the sphere.

/// Nodes and weights of Gauss-Legendre quadrature on [0, 1] with 5 points (degree 9).
const GAUSS5: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_4),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

fn gauss(f: &dyn Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    (b - a) * GAUSS5.iter().map(|(x, w)| w * f(a + (b - a) * x)).sum::<f64>()
}

fn refine(f: &dyn Fn(f64) -> f64, a: f64, b: f64, whole: f64, tolerance: f64, depth: u32) -> f64 {
    let middle = 0.5 * (a + b);
    let (left, right) = (gauss(f, a, middle), gauss(f, middle, b));
    if depth == 0 || (left + right - whole).abs() <= tolerance {
        return left + right;
    }
    refine(f, a, middle, left, 0.5 * tolerance, depth - 1) + refine(f, middle, b, right, 0.5 * tolerance, depth - 1)
}

/// The integral of `f` over [a, b] to about the absolute `tolerance`: Gauss-Legendre with 5 points, halved where halving
/// changes it, at most 24 times. Jumps cost depth but are found; spikes narrower than 1/40 of the interval may be missed.
pub fn integrate_interval(f: impl Fn(f64) -> f64, a: f64, b: f64, tolerance: f64) -> f64 {
    let f: &dyn Fn(f64) -> f64 = &f;
    // Eight pieces first, so that a feature in one does not hide behind a lucky coarse estimate.
    let edge = |i: usize| a + (b - a) * i as f64 / 8.0;
    (0..8).map(|i| refine(f, edge(i), edge(i + 1), gauss(f, edge(i), edge(i + 1)), tolerance / 8.0, 21)).sum()
}

fn gauss2(f: &dyn Fn(f64, f64) -> f64, low: [f64; 2], high: [f64; 2]) -> f64 {
    let size = [high[0] - low[0], high[1] - low[1]];
    let mut sum = 0.0;
    for (x, wx) in GAUSS5 {
        for (y, wy) in GAUSS5 {
            sum += wx * wy * f(low[0] + size[0] * x, low[1] + size[1] * y);
        }
    }
    sum * size[0] * size[1]
}

fn refine2(f: &dyn Fn(f64, f64) -> f64, low: [f64; 2], high: [f64; 2], whole: f64, tolerance: f64, depth: u32) -> f64 {
    let middle = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
    let quarters = [
        (low, middle),
        ([middle[0], low[1]], [high[0], middle[1]]),
        ([low[0], middle[1]], [middle[0], high[1]]),
        (middle, high),
    ];
    let parts = quarters.map(|(l, h)| gauss2(f, l, h));
    let sum: f64 = parts.iter().sum();
    if depth == 0 || (sum - whole).abs() <= tolerance {
        return sum;
    }
    quarters.iter().zip(parts).map(|((l, h), part)| refine2(f, *l, *h, part, 0.5 * tolerance, depth - 1)).sum()
}

/// The integral of `f` over a rectangle to about `tolerance`; each piece quartered at most `depth` times.
///
/// A jump along a curve converges like 2^-depth in area, at 4 * 25 * 2^depth evaluations.
pub(crate) fn integrate_rectangle(
    f: &dyn Fn(f64, f64) -> f64,
    low: [f64; 2],
    high: [f64; 2],
    tolerance: f64,
    depth: u32,
) -> f64 {
    refine2(f, low, high, gauss2(f, low, high), tolerance, depth)
}

/// The integral of `f` over the unit square to about the absolute `tolerance` (5-by-5-point Gauss-Legendre, quartered
/// adaptively at most 8 times over an initial 4 by 4 grid).
pub fn integrate_square(f: impl Fn(f64, f64) -> f64, tolerance: f64) -> f64 {
    let f: &dyn Fn(f64, f64) -> f64 = &f;
    let mut sum = 0.0;
    for i in 0..4 {
        for j in 0..4 {
            let low = [i as f64 / 4.0, j as f64 / 4.0];
            sum += integrate_rectangle(f, low, [low[0] + 0.25, low[1] + 0.25], tolerance / 16.0, 8);
        }
    }
    sum
}

/// The direction at a cosine from +z and an azimuth in radians.
pub(crate) fn direction(cos_theta: f64, phi: f64) -> [f64; 3] {
    let r = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
    let (s, c) = phi.sin_cos();
    [r * c, r * s, cos_theta]
}

/// The integral of `f` over all unit directions to about the absolute `tolerance`, in (cos theta, phi), where equal
/// areas are equal solid angles. The equator is an edge of the initial grid: a density on one hemisphere costs nothing.
pub fn integrate_sphere(f: impl Fn([f64; 3]) -> f64, tolerance: f64) -> f64 {
    let on_square = |x: f64, y: f64| f(direction(2.0 * x - 1.0, std::f64::consts::TAU * y));
    let area = 4.0 * std::f64::consts::PI;
    area * integrate_square(on_square, tolerance / area)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_and_broken_functions_integrate() {
        assert!((integrate_interval(|x| x.exp(), 0.0, 1.0, 1e-12) - (1f64.exp() - 1.0)).abs() < 1e-12);
        assert!((integrate_interval(|x| (x > 0.3) as u8 as f64, 0.0, 1.0, 1e-6) - 0.7).abs() < 1e-5);
        assert!((integrate_square(|x, y| x * x * y, 1e-12) - 1.0 / 6.0).abs() < 1e-12);
        let disk = integrate_square(|x, y| (x * x + y * y < 1.0) as u8 as f64, 1e-5);
        assert!((disk - std::f64::consts::FRAC_PI_4).abs() < 1e-4, "{disk}");
        let cosine = integrate_sphere(|d| d[2].max(0.0), 1e-9);
        assert!((cosine - std::f64::consts::PI).abs() < 1e-9, "{cosine}");
        // A lobe of 2 degrees: Gaussian in 1 - cos with weight 1 / (2 pi s) per steradian.
        let s = 6e-4;
        let lobe =
            integrate_sphere(|d| (-(1.0 - (0.6 * d[0] + 0.8 * d[2])) / s).exp() / (std::f64::consts::TAU * s), 1e-4);
        assert!((lobe - 1.0).abs() < 1e-3, "{lobe}");
    }
}
