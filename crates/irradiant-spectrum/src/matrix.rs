//! The 3 x 3 matrices of colorimetry, in `f64`.

/// Row-major 3 x 3 matrix.
pub(crate) type Matrix = [[f64; 3]; 3];

/// `m v`.
pub(crate) fn apply(m: &Matrix, v: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|r| m[r][0] * v[0] + m[r][1] * v[1] + m[r][2] * v[2])
}

/// `a b`.
pub(crate) fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|r| std::array::from_fn(|c| (0..3).map(|k| a[r][k] * b[k][c]).sum()))
}

/// The matrix with `d` on its diagonal.
pub(crate) fn diagonal(d: [f64; 3]) -> Matrix {
    std::array::from_fn(|r| std::array::from_fn(|c| if r == c { d[r] } else { 0.0 }))
}

/// The inverse, by cofactors; `None` if the determinant is 0 or not finite.
pub(crate) fn invert(m: &Matrix) -> Option<Matrix> {
    let cofactor = |r: usize, c: usize| {
        let (r1, r2, c1, c2) = ((r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3);
        m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
    };
    let determinant = (0..3).map(|c| m[0][c] * cofactor(0, c)).sum::<f64>();
    if determinant == 0.0 || !determinant.is_finite() {
        return None;
    }
    Some(std::array::from_fn(|r| std::array::from_fn(|c| cofactor(c, r) / determinant)))
}

/// Rounded to `f32`.
pub(crate) fn rounded(m: &Matrix) -> [[f32; 3]; 3] {
    m.map(|row| row.map(|v| v as f32))
}

/// `m v` in `f32`, for matrices kept rounded.
#[inline]
pub(crate) fn apply_f32(m: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|r| m[r][0] * v[0] + m[r][1] * v[1] + m[r][2] * v[2])
}
