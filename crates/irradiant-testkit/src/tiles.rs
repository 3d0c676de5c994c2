//! Do two images agree within their noise?

use crate::mean::{holm, sidak, two_sided, z_for_two_sided_rate};

/// Two single-channel images with the variances of their pixel *means*, compared tile by tile.
///
/// Means over tiles are nearly normal even where pixels are not; the false-alarm rate is for the whole image (Sidak over
/// tiles). A relative `slack` is granted on top, for references that are themselves only good to that.
#[derive(Clone, Copy, Debug)]
pub struct Tiles<'a> {
    /// Pixels per row.
    pub width: usize,
    /// One image, row after row.
    pub a: &'a [f64],
    /// The variance of each of its pixel values.
    pub variance_a: &'a [f64],
    /// The other image.
    pub b: &'a [f64],
    /// The variance of each of its pixel values.
    pub variance_b: &'a [f64],
    /// Side of a tile in pixels.
    pub tile: usize,
    /// Granted difference, relative to the mean of `b` in the tile.
    pub slack: f64,
}

/// What the comparison found.
#[derive(Clone, Debug, PartialEq)]
pub struct TileReport {
    /// Each tile's z-score beyond the slack (0 within it), row after row.
    pub z: Vec<f64>,
    /// Tiles per row.
    pub columns: usize,
    /// The tile of largest |z|.
    pub worst: usize,
    /// The chance that right images would have a tile as bad as the worst.
    pub p_value: f64,
    /// Tiles that are significantly off at the overall rate that was asked for (Holm).
    pub failed: Vec<usize>,
    /// Share of tiles in which a relative bias of 2 % beyond the slack would have been seen (half of the time).
    pub power_at_2_percent: f64,
    /// Mean of `a` over mean of `b`; 1 when both are zero.
    pub mean_ratio: f64,
}

impl Tiles<'_> {
    /// Compares at an overall false-alarm rate. `None` when sizes do not fit.
    pub fn compare(&self, overall_rate: f64) -> Option<TileReport> {
        let n = self.a.len();
        let fits = n > 0 && [self.b.len(), self.variance_a.len(), self.variance_b.len()].iter().all(|l| *l == n);
        if !fits || self.tile == 0 || self.width == 0 || !n.is_multiple_of(self.width) {
            return None;
        }
        let height = n / self.width;
        let (columns, rows) = (self.width.div_ceil(self.tile), height.div_ceil(self.tile));
        // Tile sums of a, of b and of both variances.
        let mut sums = vec![[0f64; 4]; columns * rows];
        for i in 0..n {
            let tile = (i / self.width / self.tile) * columns + i % self.width / self.tile;
            let terms = [self.a[i], self.b[i], self.variance_a[i] + self.variance_b[i], 1.0];
            sums[tile].iter_mut().zip(terms).for_each(|(s, t)| *s += t);
        }
        let critical = z_for_two_sided_rate(sidak(overall_rate, sums.len()));
        let mut visible = 0usize;
        let z: Vec<f64> = sums
            .iter()
            .map(|[a, b, variance, _]| {
                let (difference, se) = (a - b, variance.sqrt());
                visible += (0.02 * b.abs() > critical * se) as usize;
                let excess = difference.abs() - self.slack * b.abs();
                if excess <= 0.0 {
                    0.0
                } else if excess.is_nan() || se.is_nan() {
                    f64::INFINITY
                } else {
                    (excess / se).copysign(difference)
                }
            })
            .collect();
        let worst = (0..z.len()).max_by(|i, j| z[*i].abs().total_cmp(&z[*j].abs()))?;
        let p_values: Vec<f64> = z.iter().map(|z| if z.is_infinite() { 0.0 } else { two_sided(*z) }).collect();
        let failed = holm(&p_values, overall_rate).iter().enumerate().filter(|(_, f)| **f).map(|(i, _)| i).collect();
        let total = |k: usize| sums.iter().map(|s| s[k]).sum::<f64>();
        let (total_a, total_b) = (total(0), total(1));
        Some(TileReport {
            columns,
            worst,
            // Sidak: the chance that the least of so many p-values is as small.
            p_value: -(z.len() as f64 * (-p_values[worst]).ln_1p()).exp_m1(),
            failed,
            power_at_2_percent: visible as f64 / z.len() as f64,
            mean_ratio: if total_a == total_b { 1.0 } else { total_a / total_b },
            z,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rng;

    fn noisy(seed: u64, bias: impl Fn(usize) -> f64) -> (Vec<f64>, Vec<f64>) {
        let mut rng = Rng::new(seed);
        // Sums of 12 uniforms: standard deviation 1, scaled to 0.1.
        let image = (0..4096).map(|i| bias(i) + 0.1 * ((0..12).map(|_| rng.next_f64()).sum::<f64>() - 6.0)).collect();
        (image, vec![0.01; 4096])
    }

    #[test]
    fn right_images_agree_and_a_biased_tile_is_found() {
        let (b, vb) = noisy(1, |_| 1.0);
        let compare = |a: &[f64], va: &[f64], slack| {
            Tiles { width: 64, a, variance_a: va, b: &b, variance_b: &vb, tile: 16, slack }.compare(1e-3).unwrap()
        };
        let (a, va) = noisy(2, |_| 1.0);
        let report = compare(&a, &va, 0.0);
        assert!(report.failed.is_empty() && report.p_value > 1e-3 && report.z.len() == 16, "{report:?}");
        // 256 pixels of error 0.14: standard error 0.0088 a tile; 6 % is 7 sigma.
        let (a, va) = noisy(3, |i| if i % 64 < 16 && i / 64 < 16 { 1.06 } else { 1.0 });
        let report = compare(&a, &va, 0.0);
        assert_eq!((report.failed.clone(), report.worst), (vec![0], 0), "{report:?}");
        assert!(compare(&a, &va, 0.06).failed.is_empty());
        assert!((report.mean_ratio - 1.004).abs() < 0.01);
        let mut broken = a.clone();
        broken[4095] = f64::NAN;
        assert!(compare(&broken, &va, 0.0).failed.contains(&15));
        assert!(
            Tiles { width: 63, a: &a, variance_a: &va, b: &b, variance_b: &vb, tile: 16, slack: 0.0 }
                .compare(0.1)
                .is_none()
        );
    }
}
