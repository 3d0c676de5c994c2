//! Histograms over an interval and over a rectangle, sampled by inverting their distribution functions.

use crate::bounds::Bounds2;
use crate::elementary::ONE_MINUS_EPSILON;
use crate::vector::Point2;

/// A density that is constant on each of n equal cells of [min, max].
///
/// Values that are all zero make the uniform choice (every `u` has an image) with density 0, as in pbrt-v4.
#[derive(Clone, Debug, PartialEq)]
pub struct PiecewiseConstant1D {
    values: Vec<f32>,
    cdf: Vec<f32>,
    /// The cells of equally spaced values of the distribution function, a power of two of them and that of 1: where to look for
    /// a cell. Bisection of all cells waits for one cache line after another.
    guide: Vec<u32>,
    min: f32,
    max: f32,
    integral: f32,
}

/// A point drawn from a [`PiecewiseConstant1D`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample1D {
    /// The point, in [min, max].
    pub x: f32,
    /// Density there, per unit of x; 0 when the whole table is zero.
    pub pdf: f32,
    /// The cell it lies in.
    pub offset: usize,
}

/// The magnitude of a table value; non-finite ones count as nothing.
#[inline]
fn weight(v: f32) -> f32 {
    if v.is_finite() { v.abs() } else { 0.0 }
}

/// Fills `cdf` (one longer than `values`) from 0 to exactly 1; returns the sum of values in `f64`.
fn accumulate(values: &[f32], cdf: &mut [f32]) -> f64 {
    let n = values.len();
    let total: f64 = values.iter().map(|v| *v as f64).sum();
    let mut sum = 0f64;
    cdf[0] = 0.0;
    for i in 0..n {
        sum += values[i] as f64;
        cdf[i + 1] = if total > 0.0 { (sum / total) as f32 } else { (i + 1) as f32 / n as f32 };
    }
    // Trailing empty cells must start at 1 too, or rounding would give them a chance.
    let last = values.iter().rposition(|v| *v > 0.0).map_or(n, |i| i + 1);
    cdf[last..].fill(1.0);
    total
}

/// The last cell whose cdf is <= u and whose width is positive.
#[inline]
fn find_cell(cdf: &[f32], u: f32) -> usize {
    // cdf[0] = 0 <= u and cdf[n] = 1 > u, so the partition point lies in 1..=n and the cell is never empty.
    cdf[1..cdf.len() - 1].partition_point(|c| *c <= u)
}

#[inline]
fn place_in_cell(cdf: &[f32], cell: usize, u: f32) -> f32 {
    let width = cdf[cell + 1] - cdf[cell];
    if width > 0.0 { ((u - cdf[cell]) / width).clamp(0.0, ONE_MINUS_EPSILON) } else { 0.0 }
}

impl PiecewiseConstant1D {
    /// From the values of the cells over [0, 1]. `None` for no values.
    pub fn new(values: impl Into<Vec<f32>>) -> Option<Self> {
        Self::over(values, 0.0, 1.0)
    }

    /// From the values of the cells over [min, max]; `None` for no values or an interval that is empty or not finite.
    pub fn over(values: impl Into<Vec<f32>>, min: f32, max: f32) -> Option<Self> {
        let mut values = values.into();
        if values.is_empty() || !(min < max && (max - min).is_finite()) {
            return None;
        }
        values.iter_mut().for_each(|v| *v = weight(*v));
        let mut cdf = vec![0.0; values.len() + 1];
        let total = accumulate(&values, &mut cdf);
        let integral = (total * (max as f64 - min as f64) / values.len() as f64) as f32;
        let guides = values.len().next_power_of_two();
        let guide = (0..=guides).map(|i| find_cell(&cdf, i as f32 / guides as f32) as u32).collect();
        Some(Self { values, cdf, guide, min, max, integral })
    }

    /// What [`find_cell`] says.
    #[inline]
    fn find_cell(&self, u: f32) -> usize {
        // Exact, since the number of guides is a power of two.
        let part = ((u * (self.guide.len() - 1) as f32) as usize).min(self.guide.len() - 2);
        let (low, high) = (self.guide[part] as usize, self.guide[part + 1] as usize);
        low + self.cdf[low + 1..high + 1].partition_point(|c| *c <= u)
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Never true: a distribution has at least one cell.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Integral of the values over [min, max].
    #[inline]
    pub fn integral(&self) -> f32 {
        self.integral
    }

    /// The (magnitudes of the) cell values.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Distribution function at the n + 1 cell edges: from 0 to 1.
    pub fn cdf(&self) -> &[f32] {
        &self.cdf
    }

    /// The point with distribution function `u`; cells of value zero are never drawn unless all are zero.
    #[inline]
    pub fn sample(&self, u: f32) -> Sample1D {
        let offset = self.find_cell(u);
        let t = (offset as f32 + place_in_cell(&self.cdf, offset, u)) / self.values.len() as f32;
        Sample1D { x: crate::elementary::lerp(t, self.min, self.max), pdf: self.pdf_of_cell(offset), offset }
    }

    /// The cell that holds the point with distribution function `u`, and where in it that lies, in [0, 1).
    #[inline]
    pub fn sample_cell(&self, u: f32) -> (usize, f32) {
        let cell = self.find_cell(u);
        (cell, place_in_cell(&self.cdf, cell, u))
    }

    #[inline]
    fn pdf_of_cell(&self, offset: usize) -> f32 {
        if self.integral > 0.0 { self.values[offset] / self.integral } else { 0.0 }
    }

    /// Density at `x`, per unit of x; 0 outside of the interval.
    #[inline]
    pub fn pdf(&self, x: f32) -> f32 {
        self.cell(x).map_or(0.0, |c| self.pdf_of_cell(c))
    }

    #[inline]
    fn cell(&self, x: f32) -> Option<usize> {
        (self.min <= x && x <= self.max).then(|| {
            let t = (x - self.min) / (self.max - self.min) * self.values.len() as f32;
            (t as usize).min(self.values.len() - 1)
        })
    }

    /// The `u` that [`PiecewiseConstant1D::sample`] maps to `x`; `None` outside of the interval.
    #[inline]
    pub fn inverse(&self, x: f32) -> Option<f32> {
        let cell = self.cell(x)?;
        let t = (x - self.min) / (self.max - self.min) * self.values.len() as f32 - cell as f32;
        Some(crate::elementary::lerp(t.clamp(0.0, 1.0), self.cdf[cell], self.cdf[cell + 1]))
    }
}

/// A density that is constant on each cell of an nx by ny grid over a rectangle.
///
/// Draws the row from the marginal in y, then the column within it. All-zero tables draw uniformly with density 0.
#[derive(Clone, Debug, PartialEq)]
pub struct PiecewiseConstant2D {
    nx: usize,
    ny: usize,
    domain: Bounds2,
    values: Vec<f32>,
    conditional: Vec<f32>,
    marginal: Vec<f32>,
    integral: f32,
    // Values per density: 1 / integral, or 0 for an empty table.
    normalisation: f32,
}

/// A point drawn from a [`PiecewiseConstant2D`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample2D {
    /// The point, inside the domain.
    pub p: Point2,
    /// Density there, per unit area of the domain; 0 when the whole table is zero.
    pub pdf: f32,
    /// The cell it lies in, (column, row).
    pub offset: [usize; 2],
}

impl PiecewiseConstant2D {
    /// From `nx` by `ny` values, row after row (`values[y * nx + x]`), over the unit square. `None` when the count of
    /// values is wrong or zero.
    pub fn new(values: impl Into<Vec<f32>>, nx: usize, ny: usize) -> Option<Self> {
        Self::over(values, nx, ny, Bounds2 { min: Point2::ZERO, max: Point2::new(1.0, 1.0) })
    }

    /// From values over a rectangle; `None` also for a rectangle without area.
    pub fn over(values: impl Into<Vec<f32>>, nx: usize, ny: usize, domain: Bounds2) -> Option<Self> {
        let mut values = values.into();
        let area = domain.area();
        let proper = domain.min.x < domain.max.x && domain.min.y < domain.max.y && area.is_finite() && area > 0.0;
        if values.is_empty() || nx.checked_mul(ny) != Some(values.len()) || !proper {
            return None;
        }
        values.iter_mut().for_each(|v| *v = weight(*v));
        let mut conditional = vec![0.0; (nx + 1) * ny];
        let mut row_sums = Vec::with_capacity(ny);
        for y in 0..ny {
            let cdf = &mut conditional[y * (nx + 1)..(y + 1) * (nx + 1)];
            row_sums.push(accumulate(&values[y * nx..(y + 1) * nx], cdf));
        }
        let total: f64 = row_sums.iter().sum();
        // Relative to the largest, so that no sum of many bright rows overflows f32.
        let largest = row_sums.iter().fold(0f64, |a, b| a.max(*b));
        let rows: Vec<f32> = row_sums.iter().map(|r| if largest > 0.0 { (r / largest) as f32 } else { 0.0 }).collect();
        let mut marginal = vec![0.0; ny + 1];
        accumulate(&rows, &mut marginal);
        let integral = total * area as f64 / (nx as f64 * ny as f64);
        let normalisation = if integral > 0.0 { (1.0 / integral) as f32 } else { 0.0 };
        Some(Self { nx, ny, domain, values, conditional, marginal, integral: integral as f32, normalisation })
    }

    /// Columns and rows.
    pub fn resolution(&self) -> [usize; 2] {
        [self.nx, self.ny]
    }

    /// The rectangle it covers.
    pub fn domain(&self) -> Bounds2 {
        self.domain
    }

    /// Integral of the values over the domain.
    #[inline]
    pub fn integral(&self) -> f32 {
        self.integral
    }

    #[inline]
    fn row_cdf(&self, y: usize) -> &[f32] {
        &self.conditional[y * (self.nx + 1)..(y + 1) * (self.nx + 1)]
    }

    /// Draws a point: its row from `u.y`, its column from `u.x`.
    #[inline]
    pub fn sample(&self, u: Point2) -> Sample2D {
        let y = find_cell(&self.marginal, u.y);
        let cdf = self.row_cdf(y);
        let x = find_cell(cdf, u.x);
        let t = Point2::new(
            (x as f32 + place_in_cell(cdf, x, u.x)) / self.nx as f32,
            (y as f32 + place_in_cell(&self.marginal, y, u.y)) / self.ny as f32,
        );
        Sample2D { p: self.domain.lerp(t), pdf: self.values[y * self.nx + x] * self.normalisation, offset: [x, y] }
    }

    /// The fractional grid position of `p`, as cell and remainder; `None` outside.
    #[inline]
    fn locate(&self, p: Point2) -> Option<([usize; 2], [f32; 2])> {
        let b = &self.domain;
        if !b.contains(p) {
            return None;
        }
        let x = (p.x - b.min.x) / (b.max.x - b.min.x) * self.nx as f32;
        let y = (p.y - b.min.y) / (b.max.y - b.min.y) * self.ny as f32;
        let cell = [(x as usize).min(self.nx - 1), (y as usize).min(self.ny - 1)];
        Some((cell, [(x - cell[0] as f32).clamp(0.0, 1.0), (y - cell[1] as f32).clamp(0.0, 1.0)]))
    }

    /// Density at `p`, per unit area of the domain; 0 outside.
    #[inline]
    pub fn pdf(&self, p: Point2) -> f32 {
        self.locate(p).map_or(0.0, |([x, y], _)| self.values[y * self.nx + x] * self.normalisation)
    }

    /// The `u` that [`PiecewiseConstant2D::sample`] maps to `p`; `None` outside of the domain.
    #[inline]
    pub fn inverse(&self, p: Point2) -> Option<Point2> {
        let ([x, y], [tx, ty]) = self.locate(p)?;
        let cdf = self.row_cdf(y);
        Some(Point2::new(
            crate::elementary::lerp(tx, cdf[x], cdf[x + 1]),
            crate::elementary::lerp(ty, self.marginal[y], self.marginal[y + 1]),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use irradiant_testkit::{Chi2, Rng};

    #[test]
    fn guided_search_is_bisection() {
        let spike = |i: u32| if i == 700 { 1e6 } else { (i % 7) as f32 };
        for values in [vec![1.0], vec![0.0; 9], vec![0.0, 3.0, 0.0, 0.0], (0..1000).map(spike).collect(), vec![1.0; 64]]
        {
            let d = PiecewiseConstant1D::new(values).unwrap();
            let ends = d.cdf().iter().flat_map(|c| [c.next_down(), *c, c.next_up()]);
            for u in ends.filter(|u| (0.0..1.0).contains(u)) {
                assert_eq!(d.find_cell(u), find_cell(&d.cdf, u), "{u}");
            }
        }
    }

    #[test]
    fn one_dimension_draws_what_it_says() {
        let d = PiecewiseConstant1D::over([0.0, 1.0, 0.0, 3.0, 2.0, 0.0], -1.0, 2.0).unwrap();
        assert!((d.integral() - 3.0).abs() < 1e-6);
        let mut rng = Rng::new(3);
        // 1e-6 false alarms; a pdf 5 % off over half of the range gives p < 1e-8.
        let report = Chi2::new(50_000).line(
            -1.0,
            2.0,
            60,
            |x| d.pdf(x as f32) as f64,
            || Some(d.sample(rng.next_f32()).x as f64),
        );
        assert!(report.p_value > 1e-6, "{report:?}");
        for i in 0..1000 {
            let u = i as f32 / 1000.0;
            let s = d.sample(u);
            assert!((d.inverse(s.x).unwrap() - u).abs() < 1e-6);
            assert!(s.pdf > 0.0 && (s.pdf - d.pdf(s.x)).abs() < 1e-7 && d.values()[s.offset] > 0.0, "{s:?}");
        }
        assert_eq!(d.pdf(2.5), 0.0);
        assert_eq!(d.inverse(-1.1), None);
    }

    #[test]
    fn empty_cells_are_never_drawn_even_at_the_ends_of_u() {
        let d = PiecewiseConstant1D::new([0.0, 0.0, 1e-30, 0.0, 0.0]).unwrap();
        for u in [0.0, 1e-30, 0.5, ONE_MINUS_EPSILON] {
            assert_eq!(d.sample(u).offset, 2);
        }
        let mut many = vec![0.1f32; 4096];
        many.extend([0.0; 4096]);
        let d = PiecewiseConstant1D::new(many).unwrap();
        assert!(d.sample(ONE_MINUS_EPSILON).offset < 4096);
    }

    #[test]
    fn all_zero_tables_are_uniform_with_density_zero() {
        let d = PiecewiseConstant1D::new([0.0; 4]).unwrap();
        let s = d.sample(0.6);
        assert!((s.x - 0.6).abs() < 1e-6 && s.pdf == 0.0 && d.pdf(0.3) == 0.0);
        let d = PiecewiseConstant2D::new([0.0; 6], 3, 2).unwrap();
        let s = d.sample(Point2::new(0.3, 0.7));
        assert!((s.p - Point2::new(0.3, 0.7)).length() < 1e-6 && s.pdf == 0.0);
        assert!(PiecewiseConstant1D::new([]).is_none() && PiecewiseConstant2D::new([1.0], 2, 1).is_none());
        assert!(PiecewiseConstant1D::over([1.0], 1.0, 1.0).is_none());
        // Not a number and infinity weigh nothing; signs do not matter.
        let d = PiecewiseConstant1D::new([f32::NAN, -1.0, f32::INFINITY]).unwrap();
        assert_eq!(d.sample(0.5).offset, 1);
    }

    #[test]
    fn two_dimensions_draw_what_they_say() {
        let values: Vec<f32> = (0..8 * 5).map(|i| if i % 7 == 0 { 0.0 } else { (i * i % 13) as f32 }).collect();
        let domain = Bounds2::new(Point2::new(-1.0, 2.0), Point2::new(3.0, 5.0));
        let d = PiecewiseConstant2D::over(values, 8, 5, domain).unwrap();
        let mut rng = Rng::new(9);
        let report = Chi2::new(100_000).grid(
            [-1.0, 2.0],
            [3.0, 5.0],
            [16, 15],
            |x, y| d.pdf(Point2::new(x as f32, y as f32)) as f64,
            || {
                let p = d.sample(Point2::new(rng.next_f32(), rng.next_f32())).p;
                Some([p.x as f64, p.y as f64])
            },
        );
        assert!(report.p_value > 1e-6, "{report:?}");
        for i in 0..64 {
            for j in 0..64 {
                let u = Point2::new(i as f32 / 64.0, j as f32 / 64.0);
                let s = d.sample(u);
                assert!((d.inverse(s.p).unwrap() - u).length() < 3e-6, "{u:?} {s:?}");
                assert!(s.pdf > 0.0);
            }
        }
    }

    #[test]
    fn huge_and_tiny_values_neither_overflow_nor_vanish() {
        let d = PiecewiseConstant2D::new(vec![3e38; 64], 8, 8).unwrap();
        assert!((d.sample(Point2::new(0.5, 0.5)).pdf - 1.0).abs() < 1e-5);
        let d = PiecewiseConstant2D::new(vec![1e-37; 64], 8, 8).unwrap();
        assert!((d.pdf(Point2::new(0.5, 0.5)) - 1.0).abs() < 1e-5);
    }
}
