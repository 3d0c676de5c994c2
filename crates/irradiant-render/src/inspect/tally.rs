//! Means with their standard errors, for what is estimated outside of a film. As in a film, what is not finite is left out and counted.

/// A running mean and variance of `N` quantities (Welford 1962), in `f64`. Merging is exact up to rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tally<const N: usize> {
    count: u64,
    refused: u64,
    mean: [f64; N],
    squares: [f64; N],
}

impl<const N: usize> Default for Tally<N> {
    fn default() -> Self {
        Self { count: 0, refused: 0, mean: [0.0; N], squares: [0.0; N] }
    }
}

impl<const N: usize> Tally<N> {
    /// Adds one sample of each quantity. Where any of them is not finite all are left out, and counted by [`Tally::refused`]: one NaN
    /// would make the means NaN, and no comparison with a NaN raises an alarm.
    pub fn add(&mut self, values: [f64; N]) {
        if !values.iter().all(|v| v.is_finite()) {
            self.refuse();
            return;
        }
        self.count += 1;
        for i in 0..N {
            let delta = values[i] - self.mean[i];
            self.mean[i] += delta / self.count as f64;
            self.squares[i] += delta * (values[i] - self.mean[i]);
        }
    }

    /// Counts a sample that is left out.
    pub fn refuse(&mut self) {
        self.refused += 1;
    }

    /// Both together (Chan, Golub and LeVeque 1979).
    pub fn merge(&mut self, other: &Self) {
        self.refused += other.refused;
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

    /// Number of samples, without those that were refused.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Number of samples that were left out because they were not finite. Whoever shows the means must tell of them.
    pub fn refused(&self) -> u64 {
        self.refused
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

    /// All of a sample or nothing of it; also where nothing else is.
    #[test]
    fn what_is_not_finite_is_left_out_and_counted() {
        let (mut good, mut mixed, mut bad) = (Tally::default(), Tally::default(), Tally::default());
        for i in 0..10 {
            good.add([f64::from(i), 1.0]);
            mixed.add([f64::from(i), 1.0]);
        }
        mixed.add([f64::NAN, 1.0]);
        mixed.add([1.0, f64::INFINITY]);
        bad.add([1.0, f64::NEG_INFINITY]);
        assert_eq!((mixed.count(), mixed.mean(), mixed.error()), (10, good.mean(), good.error()));
        assert_eq!((mixed.refused(), bad.refused(), bad.count(), bad.mean()), (2, 1, 0, [0.0; 2]));
        let mut both = Tally::default();
        both.merge(&bad);
        assert_eq!(both.refused(), 1);
        both.merge(&mixed);
        assert_eq!((both.count(), both.refused(), both.mean()), (10, 3, good.mean()));
    }
}
