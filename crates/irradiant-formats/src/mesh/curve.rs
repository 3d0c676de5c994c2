//! Splines of degree 2 and 3 as chains of cubic Bezier segments.

/// What the control points mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// Bezier segments that share their end points.
    Bezier,
    /// A uniform B-spline: each window of `degree + 1` points makes a segment.
    BSpline,
}

/// The cubic Bezier segments of a spline; `Err` says which numbers of control points are possible.
///
/// Lower degrees are elevated exactly (Farin, Curves and Surfaces for CAGD, 5th edition, sections 6.1 and 8.3).
pub fn segments(points: &[[f32; 3]], basis: Basis, degree: usize) -> Result<Vec<[[f32; 3]; 4]>, String> {
    let n = points.len();
    let fits = n > degree && (basis == Basis::BSpline || (n - 1).is_multiple_of(degree));
    if !fits {
        let expected = match basis {
            Basis::Bezier => format!("{} or a multiple of {degree} more", degree + 1),
            Basis::BSpline => format!("{} or more", degree + 1),
        };
        return Err(format!("{n} control points; a curve of degree {degree} takes {expected}"));
    }
    let (step, count) = match basis {
        Basis::Bezier => (degree, (n - 1) / degree),
        Basis::BSpline => (1, n - degree),
    };
    let segment = |i: usize| {
        let window = &points[i * step..i * step + degree + 1];
        match (basis, window) {
            (Basis::Bezier, [a, b, c]) => elevate([*a, *b, *c]),
            (Basis::BSpline, [a, b, c]) => {
                elevate([weighted(&[(0.5, a), (0.5, b)]), *b, weighted(&[(0.5, b), (0.5, c)])])
            }
            (Basis::Bezier, [a, b, c, d, ..]) => [*a, *b, *c, *d],
            (Basis::BSpline, [a, b, c, d, ..]) => {
                let (third, sixth) = (1.0 / 3.0, 1.0 / 6.0);
                [
                    weighted(&[(sixth, a), (4.0 * sixth, b), (sixth, c)]),
                    weighted(&[(2.0 * third, b), (third, c)]),
                    weighted(&[(third, b), (2.0 * third, c)]),
                    weighted(&[(sixth, b), (4.0 * sixth, c), (sixth, d)]),
                ]
            }
            // Degrees below 2 are the caller's error; they give no curve.
            _ => [[0.0; 3]; 4],
        }
    };
    Ok((0..count).map(segment).collect())
}

fn weighted(terms: &[(f64, &[f32; 3])]) -> [f32; 3] {
    std::array::from_fn(|i| terms.iter().map(|(w, p)| w * f64::from(p[i])).sum::<f64>() as f32)
}

fn elevate([a, b, c]: [[f32; 3]; 3]) -> [[f32; 3]; 4] {
    let (one, two) = (1.0 / 3.0, 2.0 / 3.0);
    [a, weighted(&[(one, &a), (two, &b)]), weighted(&[(two, &b), (one, &c)]), c]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bezier(s: &[[f32; 3]; 4], u: f32) -> [f32; 3] {
        let w = [(1.0 - u).powi(3), 3.0 * u * (1.0 - u).powi(2), 3.0 * u * u * (1.0 - u), u.powi(3)];
        std::array::from_fn(|i| (0..4).map(|k| w[k] * s[k][i]).sum())
    }

    fn close(a: [f32; 3], b: [f32; 3]) -> bool {
        (0..3).all(|i| (a[i] - b[i]).abs() < 1e-5)
    }

    #[test]
    fn b_splines_join_smoothly_and_keep_their_polynomials() {
        let points: Vec<[f32; 3]> = (0..7).map(|i| [i as f32, (i * i % 5) as f32, (i % 3) as f32]).collect();
        let cubic = segments(&points, Basis::BSpline, 3).unwrap();
        assert_eq!(cubic.len(), 4);
        for w in cubic.windows(2) {
            assert!(close(w[0][3], w[1][0]));
            let leaving: [f32; 3] = std::array::from_fn(|i| w[0][3][i] - w[0][2][i]);
            let arriving: [f32; 3] = std::array::from_fn(|i| w[1][1][i] - w[1][0][i]);
            assert!(close(leaving, arriving));
        }
        // Uniform B-spline basis of degree 2 at the middle of a segment: 1/8, 3/4, 1/8.
        let quadratic = segments(&points, Basis::BSpline, 2).unwrap();
        let middle: [f32; 3] = std::array::from_fn(|i| points[1][i] / 8.0 + points[2][i] * 0.75 + points[3][i] / 8.0);
        assert!(close(bezier(&quadratic[1], 0.5), middle));
    }

    #[test]
    fn elevation_changes_nothing() {
        let points = [[0.0, 0.0, 0.0], [1.0, 2.0, 0.0], [2.0, 0.0, 1.0], [3.0, 1.0, 1.0], [4.0, 4.0, 4.0]];
        let s = segments(&points, Basis::Bezier, 2).unwrap();
        assert_eq!(s.len(), 2);
        for u in [0.0f32, 0.3, 1.0] {
            let expected: [f32; 3] = std::array::from_fn(|i| {
                (1.0 - u).powi(2) * points[0][i] + 2.0 * u * (1.0 - u) * points[1][i] + u * u * points[2][i]
            });
            assert!(close(bezier(&s[0], u), expected));
        }
    }

    #[test]
    fn wrong_numbers_of_control_points_are_refused() {
        for (n, basis, degree) in
            [(0, Basis::Bezier, 3), (3, Basis::Bezier, 3), (6, Basis::Bezier, 3), (2, Basis::BSpline, 2)]
        {
            assert!(segments(&vec![[0.0; 3]; n], basis, degree).is_err(), "{n} {basis:?} {degree}");
        }
    }
}
