//! Integrals of a grid over any rectangle, and sampling a grid within a window.

use crate::bounds::Bounds2;
use crate::vector::Point2;

/// Sums of a grid over [0, x] by [0, y], so that any rectangle's integral is four lookups (Crow 1984).
///
/// Sums are `f64`: differences of large `f32` sums would lose small windows.
#[derive(Clone, Debug, PartialEq)]
pub struct SummedAreaTable {
    nx: usize,
    ny: usize,
    // (nx + 1) by (ny + 1), zero on the lower edges.
    sums: Vec<f64>,
}

impl SummedAreaTable {
    /// From `nx` by `ny` values, row after row, over the unit square; `None` when their count is wrong or zero.
    pub fn new(values: &[f32], nx: usize, ny: usize) -> Option<Self> {
        if values.is_empty() || nx.checked_mul(ny) != Some(values.len()) {
            return None;
        }
        let mut sums = vec![0.0; (nx + 1) * (ny + 1)];
        for y in 0..ny {
            let mut row = 0.0;
            for x in 0..nx {
                row += values[y * nx + x] as f64;
                sums[(y + 1) * (nx + 1) + x + 1] = sums[y * (nx + 1) + x + 1] + row;
            }
        }
        Some(Self { nx, ny, sums })
    }

    /// The integral over [0, x] by [0, y], bilinear within cells; in units of cells.
    #[inline]
    fn corner(&self, x: f64, y: f64) -> f64 {
        let (x, y) = ((x * self.nx as f64).clamp(0.0, self.nx as f64), (y * self.ny as f64).clamp(0.0, self.ny as f64));
        let (ix, iy) = ((x as usize).min(self.nx - 1), (y as usize).min(self.ny - 1));
        let (tx, ty) = (x - ix as f64, y - iy as f64);
        let row = self.nx + 1;
        let i = iy * row + ix;
        (1.0 - ty) * ((1.0 - tx) * self.sums[i] + tx * self.sums[i + 1])
            + ty * ((1.0 - tx) * self.sums[i + row] + tx * self.sums[i + row + 1])
    }

    /// The integral over a rectangle of the unit square (clipped to it); never negative.
    #[inline]
    pub fn integral(&self, b: &Bounds2) -> f64 {
        self.integral_of(b.min.x as f64, b.max.x as f64, b.min.y as f64, b.max.y as f64)
    }

    #[inline]
    fn integral_of(&self, x0: f64, x1: f64, y0: f64, y1: f64) -> f64 {
        let sum = (self.corner(x1, y1) - self.corner(x0, y1)) - (self.corner(x1, y0) - self.corner(x0, y0));
        (sum / (self.nx as f64 * self.ny as f64)).max(0.0)
    }
}

/// A density constant on each cell of a grid over the unit square, sampled within a window given at the time.
///
/// For portal lights. Draws x from the window's marginal, then y within that column of cells.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowedPiecewiseConstant2D {
    table: SummedAreaTable,
    values: Vec<f32>,
}

/// A point drawn from a [`WindowedPiecewiseConstant2D`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowSample {
    /// The point, inside the window.
    pub p: Point2,
    /// Density there, per unit area of the unit square, normalised over the window.
    pub pdf: f32,
}

impl WindowedPiecewiseConstant2D {
    /// From `nx` by `ny` values >= 0, row after row; `None` when their count is wrong or zero. Negative values count by
    /// magnitude, non-finite ones as zero.
    pub fn new(values: impl Into<Vec<f32>>, nx: usize, ny: usize) -> Option<Self> {
        let mut values = values.into();
        values.iter_mut().for_each(|v| *v = if v.is_finite() { v.abs() } else { 0.0 });
        SummedAreaTable::new(&values, nx, ny).map(|table| Self { table, values })
    }

    /// The integral over a window.
    #[inline]
    pub fn integral(&self, window: &Bounds2) -> f64 {
        self.table.integral(window)
    }

    /// The value of the cell at `p`, clamped to the grid.
    #[inline]
    pub fn value(&self, p: Point2) -> f32 {
        let (nx, ny) = (self.table.nx, self.table.ny);
        let (x, y) = (((p.x * nx as f32) as usize).min(nx - 1), ((p.y * ny as f32) as usize).min(ny - 1));
        self.values[y * nx + x]
    }

    /// Draws a point of the window; `None` when the window holds nothing.
    pub fn sample(&self, u: Point2, window: &Bounds2) -> Option<WindowSample> {
        let t = &self.table;
        let total = t.integral(window);
        if !(total > 0.0) {
            return None;
        }
        let (x0, x1, y0, y1) = (window.min.x as f64, window.max.x as f64, window.min.y as f64, window.max.y as f64);
        let x = invert(x0, x1, t.nx, u.x as f64 * total, |x| t.integral_of(x0, x, y0, y1));
        // The column of cells that x fell into; within it the density depends on y alone.
        let column = ((x * t.nx as f64) as usize).min(t.nx - 1) as f64;
        let (c0, c1) = (column / t.nx as f64, (column + 1.0) / t.nx as f64);
        let conditional = t.integral_of(c0, c1, y0, y1);
        if !(conditional > 0.0) {
            return None;
        }
        let y = invert(y0, y1, t.ny, u.y as f64 * conditional, |y| t.integral_of(c0, c1, y0, y));
        let p = Point2::new((x as f32).clamp(window.min.x, window.max.x), (y as f32).clamp(window.min.y, window.max.y));
        let pdf = (self.value(p) as f64 / total) as f32;
        (pdf > 0.0).then_some(WindowSample { p, pdf })
    }

    /// Density of [`WindowedPiecewiseConstant2D::sample`] at a point of the window; 0 outside of it.
    #[inline]
    pub fn pdf(&self, p: Point2, window: &Bounds2) -> f32 {
        let total = self.table.integral(window);
        if total > 0.0 && window.contains(p) { (self.value(p) as f64 / total) as f32 } else { 0.0 }
    }
}

/// Where the increasing function `mass`, linear within each of the `n` cells of [0, 1], reaches `target` in [a, b].
fn invert(a: f64, b: f64, n: usize, target: f64, mass: impl Fn(f64) -> f64) -> f64 {
    // Bisect over whole cell edges strictly inside of the window, then interpolate within one cell.
    let scale = n as f64;
    let (mut low, mut high) = ((a * scale).floor() as i64, (b * scale).ceil() as i64);
    while high - low > 1 {
        let middle = (low + high) / 2;
        if mass(middle as f64 / scale) > target {
            high = middle;
        } else {
            low = middle;
        }
    }
    let (low, high) = ((low as f64 / scale).max(a), (high as f64 / scale).min(b));
    let (m0, m1) = (mass(low), mass(high));
    let t = if m1 > m0 { ((target - m0) / (m1 - m0)).clamp(0.0, 1.0) } else { 0.5 };
    low + t * (high - low)
}

#[cfg(test)]
mod tests {
    use super::*;
    use irradiant_testkit::{Chi2, Rng};

    fn grid(nx: usize, ny: usize) -> Vec<f32> {
        (0..nx * ny).map(|i| if i % 5 == 3 { 0.0 } else { (i * 37 % 11) as f32 * 0.5 }).collect()
    }

    #[test]
    fn rectangles_sum_as_their_cells_do() {
        let (nx, ny) = (7, 5);
        let values = grid(nx, ny);
        let t = SummedAreaTable::new(&values, nx, ny).unwrap();
        let mut rng = Rng::new(4);
        for _ in 0..200 {
            let b =
                Bounds2::new(Point2::new(rng.next_f32(), rng.next_f32()), Point2::new(rng.next_f32(), rng.next_f32()));
            let mut brute = 0.0;
            for y in 0..ny {
                for x in 0..nx {
                    let overlap = |i: usize, n: usize, a: f32, b: f32| {
                        let (c0, c1) = (i as f64 / n as f64, (i + 1) as f64 / n as f64);
                        (c1.min(b as f64) - c0.max(a as f64)).max(0.0)
                    };
                    brute +=
                        values[y * nx + x] as f64 * overlap(x, nx, b.min.x, b.max.x) * overlap(y, ny, b.min.y, b.max.y);
                }
            }
            assert!((t.integral(&b) - brute).abs() < 1e-12, "{b:?}");
        }
    }

    #[test]
    fn windows_are_drawn_from_what_they_show() {
        let d = WindowedPiecewiseConstant2D::new(grid(9, 6), 9, 6).unwrap();
        let mut rng = Rng::new(8);
        for (a, b) in [
            ((0.0, 0.0), (1.0, 1.0)),
            ((0.13, 0.2), (0.71, 0.93)),
            ((0.3, 0.4), (0.32, 0.45)),
            ((0.0, 0.5), (0.2, 1.0)),
        ] {
            let w = Bounds2::new(Point2::new(a.0, a.1), Point2::new(b.0, b.1));
            // 1e-6 false alarms; 5 % off over half of the window gives p < 1e-10.
            let report = Chi2::new(60_000).grid(
                [w.min.x as f64, w.min.y as f64],
                [w.max.x as f64, w.max.y as f64],
                [12, 12],
                |x, y| d.pdf(Point2::new(x as f32, y as f32), &w) as f64,
                || d.sample(Point2::new(rng.next_f32(), rng.next_f32()), &w).map(|s| [s.p.x as f64, s.p.y as f64]),
            );
            assert!(report.p_value > 1e-6, "{w:?} {report:?}");
        }
        let empty = WindowedPiecewiseConstant2D::new([0.0, 1.0], 2, 1).unwrap();
        let left = Bounds2::new(Point2::ZERO, Point2::new(0.4, 1.0));
        assert!(empty.sample(Point2::new(0.5, 0.5), &left).is_none());
        assert_eq!(empty.pdf(Point2::new(0.2, 0.2), &left), 0.0);
    }
}
