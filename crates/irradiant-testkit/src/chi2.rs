//! Pearson's chi-square test of a sampler against the density it claims.

use crate::quadrature::{direction, integrate_rectangle};
use crate::special::chi2_survival;

/// A chi-square test of `samples` draws. The density is integrated per cell by adaptive quadrature; cells that expect
/// fewer than 5 draws are pooled; draws that give nothing (`None`) count as the missing part of the density's integral.
///
/// # False alarms and power
/// A right sampler gets a p-value below t with chance t (about: the statistic is chi-square for large counts). A density
/// off by a ratio r over half of the samples raises the statistic by about n r^2 / 2; see
/// [`Chi2Report::detectable_ratio`].
#[derive(Clone, Copy, Debug)]
pub struct Chi2 {
    samples: u64,
    tolerance: f64,
    depth: u32,
}

/// The outcome of a chi-square test.
#[derive(Clone, Copy, Debug)]
pub struct Chi2Report {
    /// The chance that a right sampler would look at least this wrong; 0 when a draw fell where the density is zero.
    pub p_value: f64,
    /// Pearson's statistic.
    pub statistic: f64,
    /// Degrees of freedom.
    pub degrees_of_freedom: f64,
    /// The integral of the claimed density over the domain: 1, or less for samplers that sometimes draw nothing.
    pub integral: f64,
    /// Draws that gave nothing.
    pub missed: u64,
    /// Draws outside of the domain.
    pub outside: u64,
    /// Draws in cells where the density integrates to nothing.
    pub impossible: u64,
    /// Draws altogether.
    pub samples: u64,
    /// The cell that contributed most: (index, counted, expected).
    pub worst: (usize, f64, f64),
}

impl Chi2Report {
    /// The least ratio of error, present in half of the samples, that would have given p < `threshold` half of the time.
    pub fn detectable_ratio(&self, threshold: f64) -> f64 {
        let k = self.degrees_of_freedom.max(1.0);
        // The critical value by bisection; the excess it needs is n r^2 / 2.
        let (mut low, mut high) = (0.0, 20.0 * k + 1000.0);
        while high - low > 1e-6 * high {
            let middle = 0.5 * (low + high);
            if chi2_survival(middle, k) > threshold { low = middle } else { high = middle }
        }
        (2.0 * (high - k).max(0.0) / self.samples.max(1) as f64).sqrt()
    }

    /// Panics, with the report, unless the p-value exceeds `threshold`.
    #[track_caller]
    pub fn assert_above(&self, threshold: f64, name: &str) {
        assert!(self.p_value > threshold, "{name}: the sampler does not have its density: {self:?}");
    }
}

impl Chi2 {
    /// A test with so many draws.
    pub fn new(samples: u64) -> Self {
        Self { samples, tolerance: 0.02, depth: 7 }
    }

    /// Sets how many times a cell may be quartered to integrate the density (default 7): more for sharp edges.
    pub fn depth(self, depth: u32) -> Self {
        Self { depth, ..self }
    }

    /// Tests a sampler of the line over [a, b] in `n` cells; `pdf` per unit of length.
    pub fn line(
        self,
        a: f64,
        b: f64,
        n: usize,
        pdf: impl Fn(f64) -> f64,
        mut draw: impl FnMut() -> Option<f64>,
    ) -> Chi2Report {
        self.grid([a, 0.0], [b, 1.0], [n, 1], |x, _| pdf(x), || draw().map(|x| [x, 0.5]))
    }

    /// Tests a sampler of a rectangle in nx by ny cells; `pdf` per unit of area.
    pub fn grid(
        self,
        low: [f64; 2],
        high: [f64; 2],
        [nx, ny]: [usize; 2],
        pdf: impl Fn(f64, f64) -> f64,
        mut draw: impl FnMut() -> Option<[f64; 2]>,
    ) -> Chi2Report {
        let n = self.samples as f64;
        let mut counts = vec![0u64; nx * ny];
        let (mut missed, mut outside) = (0, 0);
        for _ in 0..self.samples {
            let Some(p) = draw() else {
                missed += 1;
                continue;
            };
            let t = [(p[0] - low[0]) / (high[0] - low[0]), (p[1] - low[1]) / (high[1] - low[1])];
            // Rounding may put a draw an ulp outside; anything farther is an error.
            if !t.iter().all(|t| (-1e-6..=1.0 + 1e-6).contains(t)) {
                outside += 1;
                continue;
            }
            let cell = |t: f64, n: usize| ((t.max(0.0) * n as f64) as usize).min(n - 1);
            counts[cell(t[1], ny) * nx + cell(t[0], nx)] += 1;
        }
        let pdf: &dyn Fn(f64, f64) -> f64 = &pdf;
        let at = |i: usize, n: usize, d: usize| low[d] + (high[d] - low[d]) * i as f64 / n as f64;
        // Tolerance: a small part of the standard deviation of a cell's count, so that quadrature adds nothing visible.
        let mut expected = Vec::with_capacity(nx * ny);
        for y in 0..ny {
            for x in 0..nx {
                let (l, h) = ([at(x, nx, 0), at(y, ny, 1)], [at(x + 1, nx, 0), at(y + 1, ny, 1)]);
                let coarse = integrate_rectangle(pdf, l, h, f64::INFINITY, 0);
                let deviation = (coarse.max(1.0 / n) / n).sqrt();
                expected.push(integrate_rectangle(pdf, l, h, self.tolerance * deviation, self.depth));
            }
        }
        judge(&counts, &expected, self.samples, missed, outside)
    }

    /// Tests a sampler of unit directions in `n` by 2n cells of equal solid angle; `pdf` per steradian. Panics when a draw
    /// is not of unit length (1e-4), which angles alone would not show.
    #[track_caller]
    pub fn sphere(
        self,
        n: usize,
        pdf: impl Fn([f64; 3]) -> f64,
        mut draw: impl FnMut() -> Option<[f32; 3]>,
    ) -> Chi2Report {
        let location = std::panic::Location::caller();
        // An even number of rows keeps the equator on an edge.
        let n = n.next_multiple_of(2);
        self.grid(
            [-1.0, 0.0],
            [1.0, std::f64::consts::TAU],
            [n, 2 * n],
            |z, phi| pdf(direction(z, phi)),
            || {
                draw().map(|d| {
                    let [x, y, z] = d.map(|c| c as f64);
                    let length = (x * x + y * y + z * z).sqrt();
                    assert!((length - 1.0).abs() < 1e-4, "{location}: direction {d:?} has length {length}");
                    [z / length, y.atan2(x).rem_euclid(std::f64::consts::TAU)]
                })
            },
        )
    }
}

/// Tests a sampler of unit directions with `n` draws in 20 by 40 cells: [`Chi2::sphere`] with its defaults.
#[track_caller]
pub fn chi2_sphere(pdf: impl Fn([f64; 3]) -> f64, sample: impl FnMut() -> Option<[f32; 3]>, n: u64) -> Chi2Report {
    Chi2::new(n).sphere(20, pdf, sample)
}

/// Tests counts against probabilities (which sum to 1, or less when the rest was not counted).
pub fn chi2_counts(counts: &[u64], probabilities: &[f64]) -> Chi2Report {
    judge(counts, probabilities, counts.iter().sum(), 0, 0)
}

fn judge(counts: &[u64], probabilities: &[f64], samples: u64, missed: u64, outside: u64) -> Chi2Report {
    let n = samples as f64;
    let integral: f64 = probabilities.iter().sum();
    let mut impossible = 0;
    let (mut statistic, mut cells) = (0.0, 0u64);
    let mut worst = (usize::MAX, 0.0, 0.0);
    let mut worst_excess = -1.0;
    let (mut pool_count, mut pool_expected) = (0.0, 0.0);
    let mut score = |index: usize, count: f64, expected: f64| {
        let excess = (count - expected) * (count - expected) / expected;
        statistic += excess;
        cells += 1;
        if excess > worst_excess {
            worst_excess = excess;
            worst = (index, count, expected);
        }
    };
    for (i, (&count, &p)) in counts.iter().zip(probabilities).enumerate() {
        let expected = n * p;
        // NaN lands here as well, and is then reported as impossible draws.
        if !(expected > 1e-9) {
            impossible += count;
            continue;
        }
        if expected < 5.0 {
            pool_count += count as f64;
            pool_expected += expected;
            // Close a pool once it is large enough, so that the tail keeps its shape.
            if pool_expected >= 10.0 {
                score(i, pool_count, pool_expected);
                (pool_count, pool_expected) = (0.0, 0.0);
            }
        } else {
            score(i, count as f64, expected);
        }
    }
    // Draws that gave nothing are one more cell, whose chance is what the density lacks to 1.
    let rest = n * (1.0 - integral);
    if rest >= 5.0 {
        score(counts.len(), missed as f64, rest);
    } else {
        pool_count += missed as f64;
        pool_expected += rest.max(0.0);
    }
    if pool_expected >= 5.0 {
        score(counts.len(), pool_count, pool_expected);
    } else if pool_count > 0.0 {
        // Too few to be a cell: judge by the Poisson tail, i.e. the chance of so many or more.
        let p = 1.0 - crate::special::gamma_q(pool_count, pool_expected);
        if p < 1e-9 {
            impossible += pool_count as u64;
        }
    }
    let degrees_of_freedom = (cells.max(2) - 1) as f64;
    let mut p_value = chi2_survival(statistic, degrees_of_freedom);
    // A stray draw per hundred thousand may sit on the rim of the density's support; more, or an integral above 1, are wrong.
    let strays = (n * 1e-5).max(1.0) as u64;
    if impossible > strays || outside > 0 || !(integral < 1.0 + 0.01) {
        p_value = 0.0;
    }
    Chi2Report { p_value, statistic, degrees_of_freedom, integral, missed, outside, impossible, samples, worst }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rng;

    fn cosine(rng: &mut Rng) -> [f32; 3] {
        let (r, phi) = (rng.next_f64().sqrt(), std::f64::consts::TAU * rng.next_f64());
        [(r * phi.cos()) as f32, (r * phi.sin()) as f32, (1.0 - r * r).sqrt() as f32]
    }

    const INV_PI: f64 = std::f64::consts::FRAC_1_PI;

    #[test]
    fn right_samplers_pass_with_uniform_p_values() {
        let p_values: Vec<f64> = (0..40)
            .map(|seed| {
                let mut rng = Rng::new(seed);
                chi2_sphere(|d| d[2].max(0.0) * INV_PI, || Some(cosine(&mut rng)), 20_000).p_value
            })
            .collect();
        // Uniform p-values: mean 0.5, standard error 0.046; the least of 40 above 1e-4 but for 0.4 %.
        let mean = p_values.iter().sum::<f64>() / 40.0;
        assert!((mean - 0.5).abs() < 0.2 && p_values.iter().all(|p| *p > 1e-4), "{mean} {p_values:?}");
    }

    #[test]
    fn samplers_that_miss_sometimes_pass_and_those_that_hide_it_fail() {
        let mut rng = Rng::new(1);
        let mut half = || (rng.next_f64() < 0.75).then(|| cosine(&mut rng));
        let right = chi2_sphere(|d| 0.75 * d[2].max(0.0) * INV_PI, &mut half, 50_000);
        assert!(right.p_value > 1e-4, "{right:?}");
        assert!(chi2_sphere(|d| d[2].max(0.0) * INV_PI, &mut half, 50_000).p_value < 1e-12);
    }

    #[test]
    fn wrong_densities_are_caught() {
        type Density = fn([f64; 3]) -> f64;
        let wrong: [(&str, Density); 5] = [
            ("10 % low", |d| 0.9 * d[2].max(0.0) * INV_PI),
            ("no cosine", |d| if d[2] > 0.0 { 0.5 * INV_PI } else { 0.0 }),
            ("twice", |d| 2.0 * d[2].max(0.0) * INV_PI),
            ("other side", |d| (-d[2]).max(0.0) * INV_PI),
            ("5 % lopsided", |d| d[2].max(0.0) * INV_PI * (1.0 + 0.05 * d[0].signum())),
        ];
        for (name, pdf) in wrong {
            let mut rng = Rng::new(7);
            let report = chi2_sphere(pdf, || Some(cosine(&mut rng)), 100_000);
            assert!(report.p_value < 1e-6, "{name}: {report:?}");
        }
    }

    #[test]
    #[should_panic(expected = "has length")]
    fn directions_that_are_not_unit_are_caught() {
        let mut rng = Rng::new(1);
        chi2_sphere(|d| d[2].max(0.0) * INV_PI, || Some(cosine(&mut rng).map(|c| 1.01 * c)), 100);
    }

    #[test]
    fn draws_outside_are_caught_and_power_is_told() {
        let mut rng = Rng::new(1);
        let report = Chi2::new(10_000).line(0.0, 1.0, 20, |_| 1.0, || Some(1.1 * rng.next_f64()));
        assert!(report.p_value == 0.0 && report.outside > 0);
        let report = Chi2::new(10_000).line(0.0, 1.0, 20, |_| 1.0, || Some(rng.next_f64()));
        let ratio = report.detectable_ratio(1e-6);
        assert!(ratio > 0.05 && ratio < 0.2, "{ratio}");
        // A sharp edge inside of cells is integrated well enough not to be an alarm.
        let report = Chi2::new(100_000).line(
            0.0,
            1.0,
            20,
            |x| if x < 0.777 { 1.0 / 0.777 } else { 0.0 },
            || Some(0.777 * rng.next_f64()),
        );
        assert!(report.p_value > 1e-4, "{report:?}");
    }

    #[test]
    fn spikes_in_nearly_empty_cells_are_caught() {
        let mut counts = [1000u64; 10];
        let mut p = [0.1; 10];
        assert!(chi2_counts(&counts, &p).p_value > 0.9);
        p[9] = 1e-7;
        counts[9] = 40;
        assert!(chi2_counts(&counts, &p).p_value < 1e-6);
    }
}
