//! Three floats, and numbers that look random.

/// A point or a vector.
pub type V = [f32; 3];

/// Sum.
pub fn add(a: V, b: V) -> V {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Difference.
pub fn sub(a: V, b: V) -> V {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Multiple.
pub fn scale(a: V, s: f32) -> V {
    a.map(|x| x * s)
}

/// Dot product.
pub fn dot(a: V, b: V) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Cross product.
pub fn cross(a: V, b: V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Of length 1.
pub fn unit(a: V) -> V {
    scale(a, 1.0 / dot(a, a).sqrt())
}

/// Two vectors that make a right-handed frame with unit `n`.
pub fn frame(n: V) -> (V, V) {
    let x = unit(cross(if n[0].abs() > 0.5 { [0.0, 1.0, 0.0] } else { [1.0, 0.0, 0.0] }, n));
    (x, cross(n, x))
}

/// A number in [0, 1), a pure function of its arguments (the finaliser of MurmurHash3).
pub fn random(i: usize, dimension: u64) -> f32 {
    let mut x = (i as u64).wrapping_mul(64).wrapping_add(dimension + 1);
    x = (x ^ (x >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
    x = (x ^ (x >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    ((x ^ (x >> 33)) >> 40) as f32 / (1 << 24) as f32
}
