//! The numbers of many paths side by side, one array for each number, so that plain loops over them become vector code.
//!
//! A loop takes the values of lane `i` out, calls the same functions as code for one path, and puts the results back. What it calls is
//! inlined, and chooses where it can rather than branches.

use crate::vector::{Normal3, Point3, Vec3};

/// How many there are at once: enough that the last paths of a batch, which go on alone for long, fill vectors and share the cost of a stage; few enough
/// that all numbers of all stages stay in the second-level cache. Not a power of two, or the arrays of a lane's numbers would compete for the same
/// places of the first-level cache.
pub const LANES: usize = 480;

/// Loops run over a multiple of so many lanes, the last ones for nothing: a vector's worth, so that none is left over.
pub const WHOLE: usize = 16;

/// One number each.
pub type Floats = [f32; LANES];

/// Three numbers each: points, vectors, normals.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Triples<const N: usize = LANES> {
    /// First coordinates.
    pub x: [f32; N],
    /// Second ones.
    pub y: [f32; N],
    /// Third ones.
    pub z: [f32; N],
}

impl<const N: usize> Triples<N> {
    /// All zero.
    pub const ZERO: Self = Self { x: [0.0; N], y: [0.0; N], z: [0.0; N] };

    /// Those of a lane.
    #[inline(always)]
    pub fn vector(&self, i: usize) -> Vec3 {
        Vec3::new(self.x[i], self.y[i], self.z[i])
    }

    /// Those of a lane, as a point.
    #[inline(always)]
    pub fn point(&self, i: usize) -> Point3 {
        Point3::new(self.x[i], self.y[i], self.z[i])
    }

    /// Those of a lane, as a normal.
    #[inline(always)]
    pub fn normal(&self, i: usize) -> Normal3 {
        Normal3::new(self.x[i], self.y[i], self.z[i])
    }

    /// Sets those of a lane.
    #[inline(always)]
    pub fn set(&mut self, i: usize, [x, y, z]: [f32; 3]) {
        (self.x[i], self.y[i], self.z[i]) = (x, y, z);
    }

    /// Sets those of the first `n` lanes to what others are.
    #[inline(always)]
    pub fn copy(&mut self, n: usize, from: &Self) {
        self.x[..n].copy_from_slice(&from.x[..n]);
        self.y[..n].copy_from_slice(&from.y[..n]);
        self.z[..n].copy_from_slice(&from.z[..n]);
    }

    /// Those of lane `from` go to lane `to`.
    #[inline(always)]
    pub fn shift(&mut self, to: usize, from: usize) {
        (self.x[to], self.y[to], self.z[to]) = (self.x[from], self.y[from], self.z[from]);
    }
}

/// The lanes that a loop over `n` goes over: whole vectors.
#[inline(always)]
pub fn whole(n: usize) -> std::ops::Range<usize> {
    0..n.next_multiple_of(WHOLE).min(LANES)
}
