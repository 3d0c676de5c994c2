//! Indices by weight in constant time.

use crate::elementary::ONE_MINUS_EPSILON;

/// Draws an index with probability proportional to its weight, in constant time.
///
/// Vose 1991, "A linear algorithm for generating random numbers with a given distribution".
#[derive(Clone, Debug, PartialEq)]
pub struct AliasTable {
    bins: Vec<Bin>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Bin {
    /// Chance to stay in this bin.
    stay: f32,
    /// Where to go otherwise.
    alias: u32,
    /// Probability of this index.
    pmf: f32,
}

/// An index drawn from an [`AliasTable`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AliasSample {
    /// The index.
    pub index: usize,
    /// Its probability.
    pub pmf: f32,
    /// A number uniform in [0, 1), made of what the choice left over of `u` (24 bits less those of the table's size).
    pub u: f32,
}

impl AliasTable {
    /// From weights; `None` when there are none or all are zero. Negative and non-finite weights count as zero.
    pub fn new(weights: &[f32]) -> Option<Self> {
        let n = weights.len();
        let weight = |w: f32| if w.is_finite() && w > 0.0 { w as f64 } else { 0.0 };
        let total: f64 = weights.iter().map(|w| weight(*w)).sum();
        if n == 0 || n > u32::MAX as usize || !(total > 0.0) {
            return None;
        }
        // Scaled so that the mean is 1; shares below 1 are topped up by those above.
        let mut share: Vec<f64> = weights.iter().map(|w| weight(*w) / total * n as f64).collect();
        let mut bins: Vec<Bin> =
            (0..n).map(|i| Bin { stay: 1.0, alias: i as u32, pmf: (share[i] / n as f64) as f32 }).collect();
        let (mut poor, mut rich): (Vec<usize>, Vec<usize>) = (0..n).partition(|i| share[*i] < 1.0);
        while let (Some(p), Some(&r)) = (poor.pop(), rich.last()) {
            bins[p].stay = share[p] as f32;
            bins[p].alias = r as u32;
            share[r] -= 1.0 - share[p];
            if share[r] < 1.0 {
                rich.pop();
                poor.push(r);
            }
        }
        // What is left over on either side is 1 up to rounding and stays; a weightless one must not.
        if let Some(heaviest) = (0..n).max_by(|a, b| weight(weights[*a]).total_cmp(&weight(weights[*b]))) {
            for i in poor.into_iter().filter(|i| weight(weights[*i]) == 0.0) {
                bins[i] = Bin { stay: 0.0, alias: heaviest as u32, pmf: 0.0 };
            }
        }
        Some(Self { bins })
    }

    /// Number of indices.
    pub fn len(&self) -> usize {
        self.bins.len()
    }

    /// Never true: a table has at least one index.
    pub fn is_empty(&self) -> bool {
        self.bins.is_empty()
    }

    /// Probability of an index.
    #[inline]
    pub fn pmf(&self, index: usize) -> f32 {
        self.bins[index].pmf
    }

    /// Draws an index. Those of weight zero are never drawn.
    #[inline]
    pub fn sample(&self, u: f32) -> AliasSample {
        let scaled = u as f64 * self.bins.len() as f64;
        let here = (scaled as usize).min(self.bins.len() - 1);
        let left = (scaled - here as f64) as f32;
        let bin = self.bins[here];
        let (index, left) = if left < bin.stay {
            (here, left / bin.stay)
        } else {
            (bin.alias as usize, (left - bin.stay) / (1.0 - bin.stay))
        };
        AliasSample { index, pmf: self.bins[index].pmf, u: left.clamp(0.0, ONE_MINUS_EPSILON) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use irradiant_testkit::{Rng, chi2_counts};

    #[test]
    fn indices_come_by_weight_and_leftovers_are_uniform() {
        let weights = [0.0, 1.0, 5.0, 0.0, 0.3, 2.0, 0.0, 7.0, 1e-3];
        let t = AliasTable::new(&weights).unwrap();
        let total: f64 = weights.iter().map(|w| *w as f64).sum();
        let mut rng = Rng::new(1);
        let (mut counts, mut leftovers) = ([0u64; 9], [0u64; 32]);
        for _ in 0..200_000 {
            let s = t.sample(rng.next_f32());
            counts[s.index] += 1;
            leftovers[(s.u * 32.0) as usize] += 1;
            assert!((s.pmf as f64 - weights[s.index] as f64 / total).abs() < 1e-7);
        }
        // 1e-6 false alarms; a weight 3 % off would be seen.
        let report = chi2_counts(&counts, &weights.map(|w| w as f64 / total));
        assert!(report.p_value > 1e-6, "{report:?}");
        let report = chi2_counts(&leftovers, &[1.0 / 32.0; 32]);
        assert!(report.p_value > 1e-6, "{report:?}");
        assert_eq!((counts[0], counts[3], counts[6]), (0, 0, 0));
    }

    #[test]
    fn weightless_tables_are_refused_and_ends_stay_inside() {
        assert!(AliasTable::new(&[]).is_none() && AliasTable::new(&[0.0, -1.0, f32::NAN]).is_none());
        let t = AliasTable::new(&[0.0, 1.0, 0.0]).unwrap();
        for u in [0.0, 0.34, 0.99, ONE_MINUS_EPSILON] {
            let s = t.sample(u);
            assert!(s.index == 1 && s.pmf == 1.0 && s.u < 1.0);
        }
        let t = AliasTable::new(&vec![1.0 / 3.0; 100_003]).unwrap();
        assert_eq!(t.len(), 100_003);
        assert_eq!(t.sample(ONE_MINUS_EPSILON).index, 100_002);
    }
}
