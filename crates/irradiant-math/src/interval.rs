//! Error-bounded floats and robust ray origins.
//!
//! # What it is for
//! An [`Interval`] contains the exact result of everything that was computed with it, so the width at the end bounds the
//! rounding error. [`gamma`] is the closed form of the same bound for short formulas. [`offset_ray_origin`] turns such a
//! bound into a ray origin that cannot hit the surface it leaves. After Pharr, Jakob and Humphreys 2023, "Physically
//! Based Rendering", 4th ed., section 6.8.
//!
//! Where `f64` is enough to make rounding invisible (2^-53 against 2^-24), computing in it is faster and tighter.

use crate::vector::{Normal3, Point3, Vec3};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Half the distance from 1 to the next float: the largest relative error of one rounding.
pub const MACHINE_EPSILON: f32 = f32::EPSILON * 0.5;

/// A bound n e / (1 - n e) on the relative error of `n` successive roundings (Higham 2002, Lemma 3.1).
#[inline]
pub const fn gamma(n: u32) -> f32 {
    let e = n as f32 * MACHINE_EPSILON;
    e / (1.0 - e)
}

/// The closed interval [low, high]: somewhere in it lies the exact value. Operations round outward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f32,
    /// Upper end.
    pub high: f32,
}

#[inline]
fn outward(low: f32, high: f32) -> Interval {
    Interval { low: low.next_down(), high: high.next_up() }
}

impl From<f32> for Interval {
    #[inline]
    fn from(value: f32) -> Self {
        Self { low: value, high: value }
    }
}

impl Interval {
    /// Everything.
    pub const ALL: Self = Self { low: f32::NEG_INFINITY, high: f32::INFINITY };

    /// Between two ends, given in any order.
    #[inline]
    pub fn new(a: f32, b: f32) -> Self {
        Self { low: a.min(b), high: a.max(b) }
    }

    /// Around a value that is known to within an absolute `error` >= 0.
    #[inline]
    pub fn with_error(value: f32, error: f32) -> Self {
        if error == 0.0 { value.into() } else { outward(value - error, value + error) }
    }

    /// The middle: the best single value.
    #[inline]
    pub fn value(self) -> f32 {
        0.5 * (self.low + self.high)
    }

    /// High minus low.
    #[inline]
    pub fn width(self) -> f32 {
        self.high - self.low
    }

    /// Half of the width, rounded up: the bound on the error of [`Interval::value`].
    #[inline]
    pub fn error(self) -> f32 {
        if self.low == self.high { 0.0 } else { (0.5 * self.width()).next_up() }
    }

    /// True when `x` lies inside or at an end.
    #[inline]
    pub fn contains(self, x: f32) -> bool {
        self.low <= x && x <= self.high
    }

    /// The square; never below zero.
    #[inline]
    pub fn square(self) -> Self {
        let (a, b) = (self.low.abs(), self.high.abs());
        let (small, large) = if a < b { (a, b) } else { (b, a) };
        let low = if self.contains(0.0) { 0.0 } else { (small * small).next_down().max(0.0) };
        Self { low, high: (large * large).next_up() }
    }

    /// The square root; a lower end below zero counts as zero.
    #[inline]
    pub fn sqrt(self) -> Self {
        Self { low: self.low.max(0.0).sqrt().next_down().max(0.0), high: self.high.max(0.0).sqrt().next_up() }
    }

    /// The absolute value.
    #[inline]
    pub fn abs(self) -> Self {
        if self.low >= 0.0 {
            self
        } else if self.high <= 0.0 {
            -self
        } else {
            Self { low: 0.0, high: self.high.max(-self.low) }
        }
    }

    /// Roots of a t^2 + b t + c in ascending order of their lower ends; `None` unless there certainly are real ones.
    pub fn quadratic(a: Self, b: Self, c: Self) -> Option<(Self, Self)> {
        let discriminant = b.square() - Self::from(4.0) * a * c;
        if !(discriminant.low >= 0.0) {
            return None;
        }
        let root = discriminant.sqrt();
        let sum = if b.value() < 0.0 { b - root } else { b + root };
        let q = sum * Self::from(-0.5);
        let (t0, t1) = (q / a, c / q);
        Some(if t0.low <= t1.low { (t0, t1) } else { (t1, t0) })
    }
}

impl Neg for Interval {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }
}

impl Add for Interval {
    type Output = Self;
    #[inline]
    fn add(self, b: Self) -> Self {
        outward(self.low + b.low, self.high + b.high)
    }
}

impl Sub for Interval {
    type Output = Self;
    #[inline]
    fn sub(self, b: Self) -> Self {
        outward(self.low - b.high, self.high - b.low)
    }
}

impl Mul for Interval {
    type Output = Self;
    #[inline]
    fn mul(self, b: Self) -> Self {
        let p = [self.low * b.low, self.high * b.low, self.low * b.high, self.high * b.high];
        // 0 * infinity is NaN: then nothing is known.
        if p.iter().any(|p| p.is_nan()) {
            return Self::ALL;
        }
        outward(p[0].min(p[1]).min(p[2].min(p[3])), p[0].max(p[1]).max(p[2].max(p[3])))
    }
}

impl Div for Interval {
    type Output = Self;
    /// Everything when the divisor contains zero.
    #[inline]
    fn div(self, b: Self) -> Self {
        if b.contains(0.0) {
            return Self::ALL;
        }
        let q = [self.low / b.low, self.high / b.low, self.low / b.high, self.high / b.high];
        if q.iter().any(|q| q.is_nan()) {
            return Self::ALL;
        }
        outward(q[0].min(q[1]).min(q[2].min(q[3])), q[0].max(q[1]).max(q[2].max(q[3])))
    }
}

/// An origin for rays in direction `w` from a point `p` of a surface with normal `n`, moved off the surface by no more
/// than its error needs.
///
/// `p_error` bounds the absolute error of each coordinate of `p`; `n` is the geometric normal (either side, unit). The
/// exact surface then lies strictly behind the returned point as seen along `w`. Wächter 2008; Pharr et al. 2023, 6.8.6.
#[inline(always)]
pub fn offset_ray_origin(p: Point3, p_error: Vec3, n: Normal3, w: Vec3) -> Point3 {
    // Towards w, without a branch: which side is a coin toss to the processor.
    let distance = n.abs().dot(p_error).copysign(w.dot_normal(n));
    let offset = n.as_vec() * distance;
    // Away from p by one unit in the last place or two, since the addition itself may round back onto the surface. (The
    // next float, through its bits, took three times as long.)
    let push = |p: f32, o: f32| {
        let moved = p + o;
        let away = (moved.abs() * f32::EPSILON + f32::MIN_POSITIVE).copysign(o);
        moved + if o != 0.0 { away } else { 0.0 }
    };
    Point3::new(push(p.x, offset.x), push(p.y, offset.y), push(p.z, offset.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::Pcg32;

    fn random(rng: &mut Pcg32) -> f32 {
        let magnitude = crate::elementary::exp2(rng.next_f32() * 40.0 - 20.0);
        if rng.next_u32() & 1 == 0 { magnitude } else { -magnitude }
    }

    #[test]
    fn intervals_contain_what_f64_finds() {
        let mut rng = Pcg32::new(1, 1);
        for _ in 0..100_000 {
            let (a, b) = (random(&mut rng), random(&mut rng));
            let (ia, ib) = (Interval::with_error(a, a.abs() * 1e-6), Interval::with_error(b, b.abs() * 1e-6));
            // Any inside values, in f64, must give results inside.
            let pick = |i: Interval, t: f64| i.low as f64 + (i.high as f64 - i.low as f64) * t;
            let (x, y) = (pick(ia, rng.next_f64()), pick(ib, rng.next_f64()));
            let holds = |i: Interval, v: f64| i.low as f64 <= v && v <= i.high as f64;
            assert!(holds(ia + ib, x + y) && holds(ia - ib, x - y) && holds(ia * ib, x * y) && holds(ia / ib, x / y));
            assert!(holds(ia.square(), x * x) && holds(ia.abs(), x.abs()) && holds(ia.abs().sqrt(), x.abs().sqrt()));
            assert!((ia + ib).error() <= 4e-6 * (a.abs() + b.abs()));
        }
    }

    #[test]
    fn edges_of_intervals() {
        let around_zero = Interval::new(1.0, -1.0);
        assert_eq!(Interval::from(1.0) / around_zero, Interval::ALL);
        assert_eq!(around_zero.square().low, 0.0);
        assert_eq!(Interval::ALL * Interval::from(0.0), Interval::ALL);
        assert_eq!(Interval::from(2.0).error(), 0.0);
        let (t0, t1) = Interval::quadratic(1.0.into(), (-3.0).into(), 2.0.into()).unwrap();
        assert!(t0.contains(1.0) && t1.contains(2.0) && t0.width() < 1e-5);
        assert!(Interval::quadratic(1.0.into(), 0.0.into(), 1.0.into()).is_none());
        assert!((gamma(3) - 1.788e-7).abs() < 1e-10);
    }

    #[test]
    fn offset_origins_clear_the_error_box() {
        let mut rng = Pcg32::new(2, 1);
        for _ in 0..100_000 {
            let p = Point3::new(random(&mut rng), random(&mut rng), random(&mut rng));
            let n = Vec3::new(random(&mut rng), random(&mut rng), random(&mut rng)).normalize();
            let e = p.abs().as_vec() * 1e-6;
            let w = Vec3::new(random(&mut rng), random(&mut rng), random(&mut rng)).normalize();
            let o = offset_ray_origin(p, e, n.as_normal(), w);
            let side = if w.dot(n) < 0.0 { -1.0 } else { 1.0 };
            // Signed distance of the origin from the plane through the farthest corner of the error box, in f64.
            let d = |a: Vec3, b: Vec3| a.x as f64 * b.x as f64 + a.y as f64 * b.y as f64 + a.z as f64 * b.z as f64;
            let moved = [o.x as f64 - p.x as f64, o.y as f64 - p.y as f64, o.z as f64 - p.z as f64];
            let clearance = side * (moved[0] * n.x as f64 + moved[1] * n.y as f64 + moved[2] * n.z as f64);
            assert!(clearance >= d(n.abs(), e) * (1.0 - 1e-6), "{p:?} {n:?}");
        }
        // No error, no move.
        let p = Point3::new(1.0, 2.0, 3.0);
        assert_eq!(offset_ray_origin(p, Vec3::ZERO, Normal3::new(0.0, 0.0, 1.0), Vec3::Z), p);
    }
}
