//! Means with their standard errors, for what is estimated outside of a film.

/// A running mean and variance of `N` quantities (Welford 1962), in `f64`. Merging is exact up to rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tally<const N: usize> {
    count: u64,
    mean: [f64; N],
    squares: [f64; N],
}

impl<const N: usize> Default for Tally<N> {
    fn default() -> Self {
        Self { count: 0, mean: [0.0; N], squares: [0.0; N] }
    }
}

impl<const N: usize> Tally<N> {
    /// Adds one sample of each quantity.
    pub fn add(&mut self, values: [f64; N]) {
        self.count += 1;
        for i in 0..N {
            let delta = values[i] - self.mean[i];
            self.mean[i] += delta / self.count as f64;
            self.squares[i] += delta * (values[i] - self.mean[i]);
        }
    }

    /// Both together (Chan, Golub and LeVeque 1979).
    pub fn merge(&mut self, other: &Self) {
        let n = (self.count + other.count) as f64;
        if n == 0.0 {
            return;
        }
        let share = other.count as f64 / n;
        for i in 0..N {
            let delta = other.mean[i] - self.mean[i];
            self.mean[i] += delta * share;
            self.squares[i] += other.squares[i] + delta * delta * self.count as f64 * share;
        }
        self.count += other.count;
    }

    /// Number of samples.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Means; 0 of nothing.
    pub fn mean(&self) -> [f64; N] {
        self.mean
    }

    /// Standard errors of the means, samples taken for independent; infinite below two samples.
    pub fn error(&self) -> [f64; N] {
        let n = self.count as f64;
        self.squares.map(|s| if self.count < 2 { f64::INFINITY } else { (s / ((n - 1.0) * n)).sqrt() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_merge_to_the_whole() {
        let value = |i: u64| [(i * i % 17) as f64, 1e6 + (i % 5) as f64];
        let (mut whole, mut a, mut b) = (Tally::default(), Tally::default(), Tally::default());
        for i in 0..100 {
            whole.add(value(i));
            if i < 37 { &mut a } else { &mut b }.add(value(i));
        }
        a.merge(&b);
        assert_eq!(a.count(), 100);
        for i in 0..2 {
            assert!((a.mean()[i] - whole.mean()[i]).abs() < 1e-9);
            assert!((a.error()[i] / whole.error()[i] - 1.0).abs() < 1e-9);
        }
        // By the definition: 0..4 equally often has variance 2 (n / (n - 1)).
        assert!((whole.error()[1] - (2.0f64 * 100.0 / 99.0 / 100.0).sqrt()).abs() < 1e-9);
        assert_eq!(Tally::<1>::default().error(), [f64::INFINITY]);
    }
}
