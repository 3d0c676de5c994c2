//! Elementary functions with pinned bits: the same result on every platform, compiler and CPU.
//!
//! # Why not std
//! `f32::sin` and its kin call the system's library, whose last bits differ between machines, so a picture would not
//! have one hash. Everything here is IEEE additions, multiplications, divisions and square roots in a fixed order, or
//! the `libm` crate, which is the same.
//!
//! # How
//! `f32` in and out, `f64` inside: range reduction is then plain, and a short polynomial leaves room for one correct
//! rounding nearly always. Polynomials interpolate the function at Chebyshev nodes (near-minimax), fitted in 60-digit
//! arithmetic for this crate; each states its relative error. No fused multiply-add, few branches, so that LLVM may
//! vectorise loops over them.
//!
//! # Accuracy
//! Worst error over the tested inputs (see the tests): `sin`, `cos`, `tan`, `exp`, `exp2`, `ln`, `log2`, `pow`, `asin`,
//! `acos`, `atan`, `atan2`, `atanh` <= 0.55 ulp. `erf`, `sinh`, `cosh`, `cbrt` are `libm`'s (<= 1 ulp, or 2 near
//! overflow); `erf_inv` <= 8 ulp.

/// The largest `f32` below one.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

// Adding and subtracting 1.5 * 2^52 rounds an f64 to an integer, ties to even, and leaves that integer in the low bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// Sine and cosine of `r` quadrants-reduced: the shared core. Relative error 2^-37; |x| below 5e7.
#[inline(always)]
pub(crate) fn sin_cos_core(x: f64) -> (f64, f64) {
    // Cody and Waite 1980: pi/2 in two parts, the first with 25 trailing zero bits, so that k * HIGH is exact.
    const HIGH: f64 = 1.570796325802803;
    const LOW: f64 = 9.920935796805404e-10;
    let rounded = x * std::f64::consts::FRAC_2_PI + ROUND;
    let k = rounded - ROUND;
    let quadrant = rounded.to_bits();
    let r = (x - k * HIGH) - k * LOW;
    let z = r * r;
    let z2 = z * z;
    // sin r / r, error 2^-37.6, and cos r, error 2^-43.5, both in z = r^2 on |r| <= pi/4.
    let s = (0.9999999999956688 - 0.16666666631563162 * z)
        + z2 * ((0.008333328779736226 - 0.00019839201388559692 * z) + z2 * 2.717338055746829e-06);
    let s = r * s;
    let c = (0.9999999999999444 - 0.4999999999935047 * z)
        + z2 * ((0.041666666543813194 - 0.001388888038869402 * z)
            + z2 * (2.4798927696218343e-05 - 2.7173353546655085e-07 * z));
    let (a, b) = if quadrant & 1 == 0 { (s, c) } else { (c, s) };
    let flip_sin = (quadrant & 2) << 62;
    let flip_cos = (quadrant.wrapping_add(1) & 2) << 62;
    (f64::from_bits(a.to_bits() ^ flip_sin), f64::from_bits(b.to_bits() ^ flip_cos))
}

/// Where the two-part reduction ends and `libm` takes over.
const TRIG_LIMIT: f32 = 4.0e7;

/// Sine and cosine of `x` radians. NaN for infinite or NaN `x`.
#[inline]
pub fn sin_cos(x: f32) -> (f32, f32) {
    if x.abs() < TRIG_LIMIT {
        let (s, c) = sin_cos_core(x as f64);
        // -0 keeps its sign, like sin itself.
        (if x == 0.0 { x } else { s as f32 }, c as f32)
    } else {
        libm::sincosf(x)
    }
}

/// [`sin_cos`] of |x| below 4e7, without asking: for loops that become vector code.
#[inline(always)]
pub fn sin_cos_bounded(x: f32) -> (f32, f32) {
    debug_assert!(!(x.abs() >= TRIG_LIMIT));
    let (s, c) = sin_cos_core(x as f64);
    (if x == 0.0 { x } else { s as f32 }, c as f32)
}

/// Sine and cosine of `x` in [-pi/4, pi/4] (about), where nothing need be reduced: `f32` series, error 1 ulp of 1.
#[inline(always)]
pub(crate) fn sin_cos_octant(x: f32) -> (f32, f32) {
    let z = x * x;
    let s = x + x * z * (-0.166_666_67 + z * (0.008_333_328 + z * (-0.000_198_392 + z * 2.717_338e-6)));
    let c = 1.0 - z * (0.5 - z * (0.041_666_667 - z * (0.001_388_888 - z * 2.479_893e-5)));
    (s, c)
}

/// Sine of `x` radians. NaN for infinite or NaN `x`.
#[inline]
pub fn sin(x: f32) -> f32 {
    sin_cos(x).0
}

/// Cosine of `x` radians. NaN for infinite or NaN `x`.
#[inline]
pub fn cos(x: f32) -> f32 {
    sin_cos(x).1
}

/// Tangent of `x` radians. Finite for every finite `f32`, since none is an odd multiple of pi/2.
#[inline]
pub fn tan(x: f32) -> f32 {
    if x == 0.0 {
        x
    } else if x.abs() < TRIG_LIMIT {
        let (s, c) = sin_cos_core(x as f64);
        (s / c) as f32
    } else {
        libm::tanf(x)
    }
}

/// 2^t for |t| <= 1100, relative error 2^-28.6.
#[inline(always)]
fn exp2_core(t: f64) -> f64 {
    let rounded = t + ROUND;
    let r = t - (rounded - ROUND);
    let r2 = r * r;
    let p = (1.0 + 0.6931472067342503 * r)
        + r2 * ((0.2402265092256076 + 0.05550327159647605 * r)
            + r2 * ((0.00961805662050108 + 0.0013400454984126323 * r) + r2 * 0.00015461467905285986));
    // The low bits of `rounded` hold the integer part; shifted, they become the exponent.
    p * f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52)
}

/// e^x. 0 below -104, infinite above 88.8, NaN for NaN.
#[inline]
pub fn exp(x: f32) -> f32 {
    exp2_core((x as f64).clamp(-150.0, 150.0) * std::f64::consts::LOG2_E) as f32
}

/// 2^x. Exact for integers. 0 below -150, infinite from 128, NaN for NaN.
#[inline]
pub fn exp2(x: f32) -> f32 {
    exp2_core((x as f64).clamp(-200.0, 200.0)) as f32
}

/// Natural logarithm of a positive normal `f64`; relative error 2^-50.
#[inline(always)]
pub(crate) fn ln_core(x: f64) -> f64 {
    let (k, s) = log_parts(x);
    k * std::f64::consts::LN_2 + atanh_twice(s)
}

/// `x = 2^k m` with m in [sqrt(1/2), sqrt(2)); returns k and (m - 1) / (m + 1).
#[inline(always)]
fn log_parts(x: f64) -> (f64, f64) {
    const SQRT_HALF: u64 = 0x3FE6_A09E_667F_3BCD;
    let offset = x.to_bits().wrapping_sub(SQRT_HALF) as i64;
    let k = offset >> 52;
    let m = f64::from_bits(x.to_bits().wrapping_sub((k << 52) as u64));
    // i32, since SSE2 converts that and not i64.
    (k as i32 as f64, (m - 1.0) / (m + 1.0))
}

/// 2 atanh s = ln((1 + s) / (1 - s)) for |s| <= 0.1716; relative error 2^-52.
#[inline(always)]
fn atanh_twice(s: f64) -> f64 {
    let z = s * s;
    let z2 = z * z;
    let p = (2.0000000000000004 + 0.6666666666655278 * z)
        + z2 * ((0.40000000061804514 + 0.2857141601084151 * z)
            + z2 * ((0.22223435295414856 + 0.18121909573946912 * z) + z2 * 0.16837967184210836));
    s * p
}

/// Natural logarithm. -infinity at 0 (of either sign), NaN below, +infinity at +infinity.
#[inline]
pub fn ln(x: f32) -> f32 {
    if !(x > 0.0 && x < f32::INFINITY) {
        return log_edge(x);
    }
    ln_core(x as f64) as f32
}

/// Logarithm to base 2. Exact for powers of two; edges as [`ln`].
#[inline]
pub fn log2(x: f32) -> f32 {
    if !(x > 0.0 && x < f32::INFINITY) {
        return log_edge(x);
    }
    log2_core(x as f64) as f32
}

/// Logarithm to base 10; edges as [`ln`].
#[inline]
pub fn log10(x: f32) -> f32 {
    if !(x > 0.0 && x < f32::INFINITY) {
        return log_edge(x);
    }
    (ln_core(x as f64) * std::f64::consts::LOG10_E) as f32
}

#[cold]
fn log_edge(x: f32) -> f32 {
    if x == 0.0 {
        f32::NEG_INFINITY
    } else if x > 0.0 {
        f32::INFINITY
    } else {
        f32::NAN
    }
}

#[inline(always)]
fn log2_core(x: f64) -> f64 {
    let (k, s) = log_parts(x);
    k + atanh_twice(s) * std::f64::consts::LOG2_E
}

/// x^y, with the edge cases of C's `powf`: 1 for y = 0, NaN for a negative `x` and a non-integer `y`.
#[inline]
pub fn pow(x: f32, y: f32) -> f32 {
    if x > 0.0 && x < f32::INFINITY && y.abs() < f32::INFINITY {
        exp2_core((log2_core(x as f64) * y as f64).clamp(-200.0, 200.0)) as f32
    } else {
        libm::powf(x, y)
    }
}

/// atan t for |t| <= tan(pi/8); relative error 2^-40.
#[inline(always)]
fn atan_core(t: f64) -> f64 {
    let z = t * t;
    let z2 = z * z;
    let z4 = z2 * z2;
    let low = (0.9999999999992436 - 0.33333333276849636 * z) + z2 * (0.1999999304596702 - 0.142853862605561 * z);
    let high = (0.11103451563136532 - 0.08992503246718883 * z) + z2 * (0.06973970393191921 - 0.03765104129649976 * z);
    t * (low + z4 * high)
}

/// The angle of (x, y) for finite f64 x, y that need not be normalised; (0, 0) gives 0 or pi by the sign of x.
#[inline(always)]
pub(crate) fn atan2_core(y: f64, x: f64) -> f64 {
    let (ax, ay) = (x.abs(), y.abs());
    let (low, high) = if ay > ax { (ax, ay) } else { (ay, ax) };
    // Above tan(pi/8), turn by pi/4: atan(l/h) = pi/4 + atan((l - h) / (l + h)). One division either way.
    let turned = low > 0.414_213_562_373_095 * high;
    let (numerator, denominator) = if turned { (low - high, low + high) } else { (low, high) };
    let base = if turned { std::f64::consts::FRAC_PI_4 } else { 0.0 };
    let quotient = numerator / denominator;
    let t = if denominator == 0.0 { 0.0 } else { quotient };
    let angle = base + atan_core(t);
    let angle = if ay > ax { std::f64::consts::FRAC_PI_2 - angle } else { angle };
    let angle = if x.is_sign_negative() { std::f64::consts::PI - angle } else { angle };
    angle.copysign(y)
}

/// The angle of the point (x, y) from the +x axis, in [-pi, pi]; `y`'s sign chooses between -pi and pi.
///
/// Zeros and infinities as C's `atan2`: (0, 0) is 0, (-0, -1) is -pi, both infinite is an odd multiple of pi/4.
#[inline]
pub fn atan2(y: f32, x: f32) -> f32 {
    if x.is_infinite() && y.is_infinite() {
        return atan2_core(1f64.copysign(y as f64), 1f64.copysign(x as f64)) as f32;
    }
    if x.is_nan() || y.is_nan() {
        return f32::NAN;
    }
    atan2_core(y as f64, x as f64) as f32
}

/// The angle whose tangent is `x`, in [-pi/2, pi/2].
#[inline]
pub fn atan(x: f32) -> f32 {
    if x.is_nan() { x } else { atan2_core(x as f64, 1.0) as f32 }
}

/// For |x| <= 1: `a` and a flag with asin|x| = a, or pi/2 - 2 a when the flag is set.
#[inline(always)]
fn asin_parts(ax: f64) -> (f64, bool) {
    // Beyond 1/2 by the half angle, which keeps the relative accuracy of acos near 1.
    let far = ax > 0.5;
    let z = if far { 0.5 * (1.0 - ax) } else { ax * ax };
    let s = if far { z.sqrt() } else { ax };
    let z2 = z * z;
    let z4 = z2 * z2;
    let low = (1.0000000000008284 + 0.16666666613082337 * z) + z2 * (0.07500005674339076 + 0.044640558118577034 * z);
    let high =
        (0.030428232514128867 + 0.021854687048307064 * z) + z2 * (0.020686728801278316 + 0.0019013011917725624 * z);
    (s * (low + z4 * (high + z4 * 0.032972918847588364)), far)
}

/// acos of an f64 in [-1, 1]; relative error 2^-38. NaN outside.
#[inline(always)]
pub(crate) fn acos_core(x: f64) -> f64 {
    let (a, far) = asin_parts(x.abs());
    let magnitude = if far { 2.0 * a } else { std::f64::consts::FRAC_PI_2 - a };
    if x < 0.0 { std::f64::consts::PI - magnitude } else { magnitude }
}

/// The angle in [0, pi] whose cosine is `x`. NaN outside [-1, 1]; see [`safe_acos`].
#[inline]
pub fn acos(x: f32) -> f32 {
    acos_core(x as f64) as f32
}

/// The angle in [-pi/2, pi/2] whose sine is `x`. NaN outside [-1, 1]; see [`safe_asin`].
#[inline]
pub fn asin(x: f32) -> f32 {
    let (a, far) = asin_parts((x as f64).abs());
    let magnitude = if far { std::f64::consts::FRAC_PI_2 - 2.0 * a } else { a };
    (magnitude as f32).copysign(x)
}

/// [`asin`] of `x` clamped to [-1, 1]: for sines that rounding pushed out by an ulp. NaN stays NaN.
#[inline]
pub fn safe_asin(x: f32) -> f32 {
    asin(x.clamp(-1.0, 1.0))
}

/// [`acos`] of `x` clamped to [-1, 1]: for cosines that rounding pushed out by an ulp. NaN stays NaN.
#[inline]
pub fn safe_acos(x: f32) -> f32 {
    acos(x.clamp(-1.0, 1.0))
}

/// sqrt(max(0, x)): for squares that rounding pushed below zero. 0 for NaN.
#[inline(always)]
pub fn safe_sqrt(x: f32) -> f32 {
    x.max(0.0).sqrt()
}

/// Inverse hyperbolic tangent. +-infinity at +-1, NaN outside.
#[inline]
pub fn atanh(x: f32) -> f32 {
    let d = x as f64;
    if d.abs() < 0.17 {
        return if x == 0.0 { x } else { (0.5 * atanh_twice(d)) as f32 };
    }
    if x.abs() >= 1.0 || x.is_nan() {
        return if x.abs() == 1.0 { f32::INFINITY.copysign(x) } else { f32::NAN };
    }
    (0.5 * ln_core((1.0 + d) / (1.0 - d))) as f32
}

/// Hyperbolic sine.
#[inline]
pub fn sinh(x: f32) -> f32 {
    libm::sinhf(x)
}

/// Hyperbolic cosine.
#[inline]
pub fn cosh(x: f32) -> f32 {
    libm::coshf(x)
}

/// Cube root, of either sign.
#[inline]
pub fn cbrt(x: f32) -> f32 {
    libm::cbrtf(x)
}

/// The error function 2/sqrt(pi) * integral of exp(-t^2) from 0 to x.
#[inline]
pub fn erf(x: f32) -> f32 {
    libm::erff(x)
}

/// The `x` with erf(x) = y. +-infinity at +-1, NaN outside.
///
/// Giles 2010, "Approximating the erfinv function", table 5: single precision, two polynomials in -ln(1 - y^2).
#[inline]
pub fn erf_inv(y: f32) -> f32 {
    if !(y.abs() < 1.0) {
        return if y.abs() == 1.0 { f32::INFINITY.copysign(y) } else { f32::NAN };
    }
    let d = y as f64;
    let w = -ln_core((1.0 - d) * (1.0 + d));
    let (w, coefficients): (f64, [f64; 9]) = if w < 5.0 {
        (
            w - 2.5,
            [
                2.810_226_36e-8,
                3.432_739_39e-7,
                -3.523_387_7e-6,
                -4.391_506_54e-6,
                0.000_218_580_87,
                -0.001_253_725_03,
                -0.004_177_681_64,
                0.246_640_727,
                1.501_409_41,
            ],
        )
    } else {
        (
            w.sqrt() - 3.0,
            [
                -0.000_200_214_257,
                0.000_100_950_558,
                0.001_349_343_22,
                -0.003_673_428_44,
                0.005_739_507_73,
                -0.007_622_461_3,
                0.009_438_870_47,
                1.001_674_06,
                2.832_976_82,
            ],
        )
    };
    (d * coefficients.iter().fold(0.0, |p, c| p * w + c)) as f32
}

/// `x^n` for a small whole `n`, by repeated squaring.
#[inline]
pub fn powi(x: f32, n: u32) -> f32 {
    let (mut result, mut square, mut n) = (1.0, x, n);
    while n > 0 {
        if n & 1 == 1 {
            result *= square;
        }
        square *= square;
        n >>= 1;
    }
    result
}

/// (1 - t) a + t b.
#[inline]
pub fn lerp(t: f32, a: f32, b: f32) -> f32 {
    (1.0 - t) * a + t * b
}

/// 0 below `a`, 1 above `b`, the cubic 3t^2 - 2t^3 between; a step when `a == b`.
#[inline]
pub fn smoothstep(x: f32, a: f32, b: f32) -> f32 {
    if a == b {
        return if x < a { 0.0 } else { 1.0 };
    }
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Error of `got` in units in the last place of the exact value (which is `f64`, good to far below an ulp).
    fn ulps(got: f32, exact: f64) -> f64 {
        if exact.is_nan() {
            return if got.is_nan() { 0.0 } else { f64::INFINITY };
        }
        let rounded = exact as f32;
        if got == rounded {
            return if got.is_infinite() { 0.0 } else { ulp_distance(got, exact) };
        }
        if !got.is_finite() || !rounded.is_finite() {
            return f64::INFINITY;
        }
        ulp_distance(got, exact)
    }

    fn ulp_distance(got: f32, exact: f64) -> f64 {
        let magnitude = exact.abs().max(f32::MIN_POSITIVE as f64);
        let exponent = ((magnitude.to_bits() >> 52) as i32 - 1023).max(-126);
        (got as f64 - exact).abs() / libm::ldexp(1.0, exponent - 23)
    }

    /// Every 1009th positive and negative float between two magnitudes, and the edges.
    fn floats(low: f32, high: f32, step: usize) -> impl Iterator<Item = f32> {
        (low.to_bits()..=high.to_bits())
            .step_by(step)
            .chain([high.to_bits()])
            .flat_map(|b| [f32::from_bits(b), -f32::from_bits(b)])
    }

    fn worst(inputs: impl Iterator<Item = f32>, f: impl Fn(f32) -> f32, exact: impl Fn(f64) -> f64) -> (f64, f32) {
        inputs.fold((0.0, 0.0), |worst, x| {
            let e = ulps(f(x), exact(x as f64));
            if e > worst.0 { (e, x) } else { worst }
        })
    }

    #[track_caller]
    fn within(bound: f64, (error, at): (f64, f32)) {
        assert!(error <= bound, "{error} ulp at {at:e} ({:#x})", at.to_bits());
    }

    // The exact values are libm's f64 functions (error < 1 ulp of f64, 2^-29 of an f32 ulp).
    const STEP: usize = 4001;

    #[test]
    fn trigonometry_rounds_almost_correctly() {
        within(0.51, worst(floats(0.0, 10.0, STEP), sin, libm::sin));
        within(0.51, worst(floats(0.0, 10.0, STEP), cos, libm::cos));
        within(0.51, worst(floats(0.0, 10.0, STEP), tan, libm::tan));
        within(0.51, worst(floats(10.0, 3.9e7, STEP), sin, libm::sin));
        within(0.51, worst(floats(10.0, 3.9e7, STEP), cos, libm::cos));
        within(1.0, worst(floats(4.1e7, f32::MAX, 100_003), sin, libm::sin));
        // Where sine or cosine nearly vanish: the floats nearest to multiples of pi/2.
        let hostile = (1..400_000).flat_map(|k| {
            let x = (k as f64 * std::f64::consts::FRAC_PI_2) as f32;
            [f32::from_bits(x.to_bits() - 1), x, f32::from_bits(x.to_bits() + 1)]
        });
        within(0.51, worst(hostile.clone(), sin, libm::sin));
        within(0.51, worst(hostile.clone(), cos, libm::cos));
        within(0.51, worst(hostile, tan, libm::tan));
        assert!(sin(f32::INFINITY).is_nan() && cos(f32::NAN).is_nan() && tan(f32::NEG_INFINITY).is_nan());
        assert_eq!(sin(-0.0).to_bits(), (-0f32).to_bits());
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
    }

    #[test]
    fn exponentials_and_logarithms_round_almost_correctly() {
        within(0.55, worst(floats(0.0, 110.0, STEP), exp, libm::exp));
        within(0.55, worst(floats(0.0, 160.0, STEP), exp2, libm::exp2));
        within(0.51, worst(floats(0.0, f32::MAX, STEP), ln, libm::log));
        within(0.51, worst(floats(0.5, 2.0, 61), ln, libm::log));
        within(0.51, worst(floats(0.0, f32::MAX, STEP), log2, libm::log2));
        within(0.51, worst(floats(0.5, 2.0, 61), log2, libm::log2));
        within(0.51, worst(floats(0.0, 1.0, 503), atanh, libm::atanh));
        for k in -149..128 {
            assert_eq!(exp2(k as f32) as f64, libm::ldexp(1.0, k));
            assert_eq!(log2(exp2(k as f32)), k as f32);
        }
        assert_eq!((exp(f32::INFINITY), exp(f32::NEG_INFINITY), exp(0.0)), (f32::INFINITY, 0.0, 1.0));
        assert_eq!(
            (ln(1.0), ln(0.0), ln(-0.0), ln(f32::INFINITY)),
            (0.0, f32::NEG_INFINITY, f32::NEG_INFINITY, f32::INFINITY)
        );
        assert!(exp(f32::NAN).is_nan() && ln(-1.0).is_nan() && ln(f32::NAN).is_nan() && exp2(f32::NAN).is_nan());
    }

    #[test]
    fn powers_round_almost_correctly() {
        let mut worst = (0.0, 0.0, 0.0);
        for x in floats(1e-38, 1e38, 1_000_003).filter(|x| *x > 0.0) {
            for y in floats(1e-3, 40.0, 2_000_003) {
                let e = ulps(pow(x, y), libm::pow(x as f64, y as f64));
                if e > worst.0 {
                    worst = (e, x, y);
                }
            }
        }
        assert!(worst.0 <= 0.55, "{worst:?}");
        // Near 1, where y log x is small but y may be large.
        for i in 0..20_000u32 {
            let (x, y) = (f32::from_bits(1f32.to_bits() - 10_000 + i), 100_000.0 + i as f32);
            assert!(ulps(pow(x, y), libm::pow(x as f64, y as f64)) < 0.55, "{x} {y}");
        }
        assert_eq!(
            (pow(-2.0, 3.0), pow(0.0, 0.0), pow(0.0, -1.0), pow(1.0, f32::INFINITY)),
            (-8.0, 1.0, f32::INFINITY, 1.0)
        );
        assert!(pow(-2.0, 0.5).is_nan());
    }

    #[test]
    fn inverse_trigonometry_rounds_almost_correctly() {
        within(0.51, worst(floats(0.0, 1.0, 503), asin, libm::asin));
        within(0.51, worst(floats(0.0, 1.0, 503), acos, libm::acos));
        within(0.51, worst(floats(0.0, f32::MAX, STEP), atan, libm::atan));
        let mut worst = 0f64;
        for x in floats(0.0, f32::MAX, 3_000_017) {
            for y in floats(0.0, f32::MAX, 3_000_029) {
                let exact = libm::atan2(y as f64, x as f64);
                worst = worst.max(ulps(atan2(y, x), exact));
            }
        }
        assert!(worst <= 0.51, "{worst}");
        for y in [0.0f32, -0.0, 1.0, -1.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
            for x in [0.0f32, -0.0, 1.0, -1.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
                let (got, exact) = (atan2(y, x), libm::atan2(y as f64, x as f64) as f32);
                assert!(
                    got == exact && got.is_sign_negative() == exact.is_sign_negative()
                        || exact.is_nan() && got.is_nan(),
                    "{y} {x}: {got}"
                );
            }
        }
        assert!(acos(1.0000001).is_nan() && asin(-1.1).is_nan());
        assert_eq!((acos(1.0), safe_acos(1.1), safe_acos(-1.1)), (0.0, 0.0, std::f32::consts::PI));
    }

    #[test]
    fn the_error_function_inverts() {
        within(2.0, worst(floats(0.0, 5.0, STEP), erf, libm::erf));
        for y in floats(1e-20, ONE_MINUS_EPSILON, 997) {
            let x = erf_inv(y) as f64;
            // One Newton step from the answer tells its error.
            let error = (libm::erf(x) - y as f64) * 0.886_226_925_452_758 * libm::exp(x * x);
            assert!(error.abs() / x.abs() <= 8.0 * 1.2e-7, "{y}: {error}");
        }
        assert_eq!((erf_inv(1.0), erf_inv(0.0)), (f32::INFINITY, 0.0));
        assert!(erf_inv(1.5).is_nan());
    }
}
