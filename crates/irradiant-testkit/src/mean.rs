//! Means with confidence, z-tests, and corrections for many tests.

use crate::special::{normal_survival, normal_survival_inverse};

/// A running mean and variance (Welford 1962), in `f64`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mean {
    n: u64,
    mean: f64,
    m2: f64,
}

impl Mean {
    /// Of nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Of `n` draws.
    pub fn of(n: u64, mut draw: impl FnMut() -> f64) -> Self {
        let mut mean = Self::new();
        (0..n).for_each(|_| mean.add(draw()));
        mean
    }

    /// Adds a value.
    pub fn add(&mut self, x: f64) {
        self.n += 1;
        let delta = x - self.mean;
        self.mean += delta / self.n as f64;
        self.m2 += delta * (x - self.mean);
    }

    /// Both together (Chan, Golub and LeVeque 1979).
    pub fn merge(&self, other: &Self) -> Self {
        let n = self.n + other.n;
        if n == 0 {
            return Self::new();
        }
        let delta = other.mean - self.mean;
        let share = other.n as f64 / n as f64;
        Self { n, mean: self.mean + delta * share, m2: self.m2 + other.m2 + delta * delta * self.n as f64 * share }
    }

    /// How many values.
    pub fn count(&self) -> u64 {
        self.n
    }

    /// Their mean.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Their sample variance; 0 for fewer than two.
    pub fn variance(&self) -> f64 {
        if self.n < 2 { 0.0 } else { self.m2 / (self.n - 1) as f64 }
    }

    /// Standard error of the mean.
    pub fn standard_error(&self) -> f64 {
        if self.n == 0 { f64::INFINITY } else { (self.variance() / self.n as f64).sqrt() }
    }

    /// The bias, relative to the mean, that a test at `sigmas` would have seen with a chance of 98 %: `sigmas` + 2
    /// standard errors.
    pub fn detectable_bias(&self, sigmas: f64) -> f64 {
        (sigmas + 2.0) * self.standard_error() / self.mean.abs()
    }
}

/// The difference of two means in units of its standard error; 0 when both are constant and equal.
pub fn z_score(a: &Mean, b: &Mean) -> f64 {
    let se = (a.standard_error().powi(2) + b.standard_error().powi(2)).sqrt();
    ratio(a.mean - b.mean, se)
}

/// The distance of a mean from an exact value in units of its standard error.
pub fn z_score_exact(a: &Mean, exact: f64) -> f64 {
    ratio(a.mean - exact, a.standard_error())
}

fn ratio(difference: f64, se: f64) -> f64 {
    if difference == 0.0 { 0.0 } else { difference / se }
}

/// Panics unless an estimate lies within `sigmas` standard errors (and 1e-12 of its size) of the exact value. At 4.9
/// sigmas the false-alarm rate is 1e-6.
#[track_caller]
pub fn assert_mean_close(estimate: &Mean, exact: f64, sigmas: f64) {
    let difference = (estimate.mean - exact).abs();
    let allowed = sigmas * estimate.standard_error() + 1e-12 * exact.abs();
    assert!(
        difference <= allowed,
        "mean {} differs from {exact} by {:.2} standard errors ({} samples; a bias of {:.2} % would be seen)",
        estimate.mean,
        z_score_exact(estimate, exact),
        estimate.n,
        100.0 * estimate.detectable_bias(sigmas)
    );
}

/// Panics unless two estimates agree within `sigmas` joint standard errors (and 1e-12 of their size).
#[track_caller]
pub fn assert_means_agree(a: &Mean, b: &Mean, sigmas: f64) {
    let se = (a.standard_error().powi(2) + b.standard_error().powi(2)).sqrt();
    let allowed = sigmas * se + 1e-12 * a.mean.abs().max(b.mean.abs());
    assert!(
        (a.mean - b.mean).abs() <= allowed,
        "means {} and {} differ by {:.2} standard errors ({} and {} samples)",
        a.mean,
        b.mean,
        z_score(a, b),
        a.n,
        b.n
    );
}

/// The per-test rate at which `tests` independent tests have the given overall false-alarm rate (Sidak 1967).
pub fn sidak(overall: f64, tests: usize) -> f64 {
    // 1 - (1 - r)^(1/m) by expm1 and log1p, since r is small.
    -((-overall).ln_1p() / tests.max(1) as f64).exp_m1()
}

/// Which of some p-values are significant at an overall false-alarm rate, whatever their dependence (Holm 1979).
pub fn holm(p_values: &[f64], overall: f64) -> Vec<bool> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|a, b| p_values[*a].total_cmp(&p_values[*b]));
    let mut significant = vec![false; p_values.len()];
    for (rank, &i) in order.iter().enumerate() {
        if p_values[i] > overall / (p_values.len() - rank) as f64 {
            break;
        }
        significant[i] = true;
    }
    significant
}

/// The |z| that a right program exceeds with chance `rate`: 4.89 for 1e-6.
pub fn z_for_two_sided_rate(rate: f64) -> f64 {
    normal_survival_inverse(0.5 * rate)
}

/// The two-sided p-value of a z-score.
pub(crate) fn two_sided(z: f64) -> f64 {
    2.0 * normal_survival(z.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rng;

    #[test]
    fn means_and_merges_agree_with_the_definition() {
        let mut rng = Rng::new(4);
        let values: Vec<f64> = (0..1000).map(|_| 1e6 + rng.next_f64()).collect();
        let whole = Mean::of(1000, {
            let mut i = 0;
            let v = values.clone();
            move || {
                i += 1;
                v[i - 1]
            }
        });
        let (mut a, mut b) = (Mean::new(), Mean::new());
        values[..300].iter().for_each(|x| a.add(*x));
        values[300..].iter().for_each(|x| b.add(*x));
        let merged = a.merge(&b);
        let mean = values.iter().sum::<f64>() / 1000.0;
        let variance = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / 999.0;
        for m in [whole, merged] {
            assert!((m.mean() - mean).abs() < 1e-8 && (m.variance() - variance).abs() < 1e-8 && m.count() == 1000);
        }
        assert_eq!(Mean::new().merge(&a), a);
        // Uniform: variance 1/12, standard error of 1000 draws 0.0091.
        assert!((whole.standard_error() - 0.0091).abs() < 5e-4);
        assert!((z_score_exact(&whole, 1e6 + 0.5)).abs() < 4.0);
    }

    #[test]
    fn a_five_percent_bias_is_seen() {
        let mut rng = Rng::new(5);
        let m = Mean::of(100_000, || rng.next_f64());
        assert_mean_close(&m, 0.5, 4.9);
        assert!(m.detectable_bias(4.9) < 0.02);
        assert!(z_score_exact(&m, 0.525).abs() > 20.0);
        let n = Mean::of(100_000, || rng.next_f64());
        assert_means_agree(&m, &n, 4.9);
    }

    #[test]
    fn corrections_for_many_tests() {
        assert!((sidak(0.01, 1) - 0.01).abs() < 1e-15);
        assert!((1.0 - (1.0 - sidak(0.01, 500)).powi(500) - 0.01).abs() < 1e-12);
        assert_eq!(holm(&[0.01, 0.04, 0.03, 0.005], 0.05), [true, false, false, true]);
        assert!((z_for_two_sided_rate(1e-6) - 4.8916).abs() < 1e-3);
        assert!((two_sided(1.959_963_985) - 0.05).abs() < 1e-9);
    }
}
