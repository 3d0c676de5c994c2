//! Roots and small linear systems: each states its behaviour at its degenerate ends.

/// Real roots of a t^2 + b t + c = 0 in ascending order, in `f64`; `None` without real roots.
///
/// With `a == 0` the single root of the line comes twice; all zero coefficients, or NaN, give `None`. The stable form
/// (no subtraction of near equals): q = -(b + sign(b) sqrt(D)) / 2, roots q/a and c/q.
#[inline]
pub fn quadratic(a: f64, b: f64, c: f64) -> Option<(f64, f64)> {
    if a == 0.0 {
        let t = -c / b;
        return t.is_finite().then_some((t, t));
    }
    let discriminant = b * b - 4.0 * a * c;
    if !(discriminant >= 0.0) {
        return None;
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    let (t0, t1) = (q / a, if q == 0.0 { 0.0 } else { c / q });
    Some(if t0 <= t1 { (t0, t1) } else { (t1, t0) })
}

/// Real roots of an `f32` quadratic, computed in `f64`; see [`quadratic`].
#[inline]
pub fn quadratic_f32(a: f32, b: f32, c: f32) -> Option<(f32, f32)> {
    quadratic(a as f64, b as f64, c as f64).map(|(t0, t1)| (t0 as f32, t1 as f32))
}

/// The solution of the 2x2 system `a x = b`; `None` when singular or not finite.
#[inline]
pub fn linear_2x2(a: [[f32; 2]; 2], b: [f32; 2]) -> Option<[f32; 2]> {
    let determinant = a[0][0] as f64 * a[1][1] as f64 - a[0][1] as f64 * a[1][0] as f64;
    if determinant == 0.0 {
        return None;
    }
    let x = (a[1][1] as f64 * b[0] as f64 - a[0][1] as f64 * b[1] as f64) / determinant;
    let y = (a[0][0] as f64 * b[1] as f64 - a[1][0] as f64 * b[0] as f64) / determinant;
    let solution = [x as f32, y as f32];
    solution.iter().all(|x| x.is_finite()).then_some(solution)
}

/// The inverse of a 3x3 matrix (rows), by cofactors; `None` when singular or not finite.
pub fn invert_3x3(m: [[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let cofactor = |r0: usize, c0: usize, r1: usize, c1: usize| m[r0][c0] * m[r1][c1] - m[r0][c1] * m[r1][c0];
    let (c0, c1, c2) = (cofactor(1, 1, 2, 2), cofactor(1, 2, 2, 0), cofactor(1, 0, 2, 1));
    let determinant = m[0][0] * c0 + m[0][1] * c1 + m[0][2] * c2;
    if !(determinant != 0.0 && determinant.is_finite()) {
        return None;
    }
    let s = 1.0 / determinant;
    let r = [
        [c0 * s, cofactor(0, 2, 2, 1) * s, cofactor(0, 1, 1, 2) * s],
        [c1 * s, cofactor(0, 0, 2, 2) * s, cofactor(0, 2, 1, 0) * s],
        [c2 * s, cofactor(0, 1, 2, 0) * s, cofactor(0, 0, 1, 1) * s],
    ];
    r.iter().flatten().all(|x: &f64| x.is_finite()).then_some(r)
}

/// The solution of the 3x3 system `a x = b`; `None` when singular or not finite.
pub fn linear_3x3(a: [[f64; 3]; 3], b: [f64; 3]) -> Option<[f64; 3]> {
    invert_3x3(a).map(|inv| std::array::from_fn(|i| inv[i][0] * b[0] + inv[i][1] * b[1] + inv[i][2] * b[2]))
}

/// A root of `f` (value, derivative) between `x0` and `x1`, where it must change sign: Newton's steps, bisection where
/// they leave the bracket. Ends that are roots are returned at once; without a sign change the result is an end or some
/// point between. At most 100 steps; stops when the value or the bracket is below 1e-12 (relative to the first bracket).
pub fn newton_bisection(mut x0: f64, mut x1: f64, f: impl Fn(f64) -> (f64, f64)) -> f64 {
    let (f0, f1) = (f(x0).0, f(x1).0);
    if f0.abs() < 1e-12 {
        return x0;
    }
    if f1.abs() < 1e-12 {
        return x1;
    }
    let starts_negative = f0 < 0.0;
    let tolerance = 1e-12 * (x1 - x0);
    // The secant, unless it is undefined.
    let mut x = x0 + (x1 - x0) * -f0 / (f1 - f0);
    for _ in 0..100 {
        if !(x0 < x && x < x1) {
            x = 0.5 * (x0 + x1);
        }
        let (value, derivative) = f(x);
        if starts_negative == (value < 0.0) {
            x0 = x;
        } else {
            x1 = x;
        }
        if x1 - x0 <= tolerance || value.abs() < 1e-12 {
            return x;
        }
        x -= value / derivative;
    }
    x.clamp(x0, x1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadratics_at_their_ends() {
        assert_eq!(quadratic(1.0, -3.0, 2.0), Some((1.0, 2.0)));
        assert_eq!(quadratic(-1.0, 3.0, -2.0), Some((1.0, 2.0)));
        assert_eq!(quadratic(0.0, 2.0, -4.0), Some((2.0, 2.0)));
        assert_eq!(quadratic(0.0, 0.0, 1.0), None);
        assert_eq!(quadratic(1.0, 0.0, 1.0), None);
        assert_eq!(quadratic(1.0, 0.0, 0.0), Some((0.0, 0.0)));
        assert_eq!(quadratic(f64::NAN, 0.0, 0.0), None);
        // The small root of t^2 - 1e9 t + 1 is 1e-9; the textbook formula gives 0 digits of it.
        let (small, large) = quadratic(1.0, -1e9, 1.0).unwrap();
        assert!((small * 1e9 - 1.0).abs() < 1e-15 && (large * 1e-9 - 1.0).abs() < 1e-15);
        assert_eq!(quadratic_f32(1.0, -3.0, 2.0), Some((1.0, 2.0)));
    }

    #[test]
    fn linear_systems_solve_or_refuse() {
        assert_eq!(linear_2x2([[2.0, 1.0], [1.0, 3.0]], [3.0, 4.0]), Some([1.0, 1.0]));
        assert_eq!(linear_2x2([[2.0, 1.0], [4.0, 2.0]], [3.0, 4.0]), None);
        let a = [[2.0, -1.0, 0.5], [0.3, 4.0, 1.0], [-1.0, 0.2, 3.0]];
        let x = linear_3x3(a, [1.0, 2.0, 3.0]).unwrap();
        for i in 0..3 {
            assert!(((0..3).map(|j| a[i][j] * x[j]).sum::<f64>() - (i + 1) as f64).abs() < 1e-12);
        }
        assert_eq!(invert_3x3([[1.0, 2.0, 3.0], [2.0, 4.0, 6.0], [0.0, 1.0, 0.0]]), None);
    }

    #[test]
    fn brackets_hold_what_newton_would_lose() {
        // atan overshoots under plain Newton from |x| > 1.39.
        let r = newton_bisection(-3.0, 50.0, |x| (x.atan(), 1.0 / (1.0 + x * x)));
        assert!(r.abs() < 1e-9, "{r}");
        let r = newton_bisection(0.0, 2.0, |x| (2.0 - x * x, -2.0 * x));
        assert!((r - std::f64::consts::SQRT_2).abs() < 1e-11, "{r}");
        assert_eq!(newton_bisection(0.0, 1.0, |x| (x, 1.0)), 0.0);
        // A zero derivative is not a division away from disaster.
        let r = newton_bisection(-1.0, 1.5, |x| (x * x * x, 0.0));
        assert!(r.abs() < 1e-3, "{r}");
    }
}
