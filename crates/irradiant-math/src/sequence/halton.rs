//! Radical inverses in prime bases: Halton's sequence, plain, with permuted digits, and Owen-scrambled.

use crate::elementary::ONE_MINUS_EPSILON;
use crate::hash::{hash3, mix32, permutation_element};

/// The first 128 primes.
pub const PRIMES: [u32; 128] = first_primes();

const fn first_primes() -> [u32; 128] {
    let mut primes = [0; 128];
    let (mut n, mut candidate) = (0, 2);
    while n < 128 {
        let (mut i, mut prime) = (0, true);
        while i < n && prime {
            prime = candidate % primes[i] != 0;
            i += 1;
        }
        if prime {
            primes[n] = candidate;
            n += 1;
        }
        candidate += 1;
    }
    primes
}

/// The digits of `a` in base `PRIMES[base_index]`, mirrored at the point: in [0, 1). Halton 1964.
#[inline]
pub fn radical_inverse(base_index: usize, mut a: u64) -> f32 {
    let base = PRIMES[base_index] as u64;
    let inverse = 1.0 / base as f64;
    let (mut reversed, mut scale) = (0u64, 1.0f64);
    // Digits beyond the 18 significant decimals of u64 cannot show in f32.
    while a != 0 && reversed < u64::MAX / 2 / base {
        let next = a / base;
        reversed = reversed * base + (a - next * base);
        scale *= inverse;
        a = next;
    }
    ((reversed as f64 * scale) as f32).min(ONE_MINUS_EPSILON)
}

/// The integer whose `n_digits` digits in `base` are those of `inverse`, mirrored: undoes the integer part of
/// [`radical_inverse`], to find which index falls into a given interval.
pub fn inverse_radical_inverse(mut inverse: u64, base: u32, n_digits: u32) -> u64 {
    let base = base as u64;
    let mut index = 0;
    for _ in 0..n_digits {
        index = index * base + inverse % base;
        inverse /= base;
    }
    index
}

/// How many digits of a base show in an `f32`: until base^-n < 2^-25.
fn visible_digits(base: u32) -> usize {
    let (mut n, mut reach) = (0, 1u64);
    while reach <= 1 << 25 {
        reach *= base as u64;
        n += 1;
    }
    n
}

/// Random permutations of the digits of one base, one per digit place.
#[derive(Clone, Debug, PartialEq)]
pub struct DigitPermutations {
    base_index: usize,
    digits: usize,
    table: Vec<u16>,
}

impl DigitPermutations {
    /// For base `PRIMES[base_index]` and a seed.
    pub fn new(base_index: usize, seed: u32) -> Self {
        let base = PRIMES[base_index];
        let digits = visible_digits(base);
        let mut table = Vec::with_capacity(digits * base as usize);
        for place in 0..digits {
            let place_seed = (hash3(base as u64, place as u64, seed as u64) >> 32) as u32;
            table.extend((0..base).map(|d| permutation_element(d, base, place_seed) as u16));
        }
        Self { base_index, digits, table }
    }

    /// The base's place among the [`PRIMES`].
    pub fn base_index(&self) -> usize {
        self.base_index
    }
}

/// [`radical_inverse`] with each digit (leading zeros too) permuted by its place: in [0, 1).
#[inline]
pub fn scrambled_radical_inverse(permutations: &DigitPermutations, mut a: u64) -> f32 {
    let base = PRIMES[permutations.base_index] as u64;
    let inverse = 1.0 / base as f64;
    let (mut reversed, mut scale) = (0u64, 1.0f64);
    for place in permutations.table.chunks_exact(base as usize).take(permutations.digits) {
        let next = a / base;
        reversed = reversed * base + place[(a - next * base) as usize] as u64;
        scale *= inverse;
        a = next;
    }
    ((reversed as f64 * scale) as f32).min(ONE_MINUS_EPSILON)
}

/// [`radical_inverse`], Owen-scrambled: each digit permuted by a hash of those before it. In [0, 1).
#[inline]
pub fn owen_scrambled_radical_inverse(base_index: usize, mut a: u64, seed: u32) -> f32 {
    let base = PRIMES[base_index] as u64;
    let inverse = 1.0 / base as f64;
    let (mut reversed, mut scale) = (0u64, 1.0f64);
    while scale > 1.0 / 33_554_432.0 {
        let next = a / base;
        // The place enters too, so that a prefix of zeros is not the same prefix at every length.
        let prefix = mix32(seed ^ mix32((reversed as u32).wrapping_add((scale * 4e9) as u32)));
        let digit = permutation_element((a - next * base) as u32, base as u32, prefix);
        reversed = reversed * base + digit as u64;
        scale *= inverse;
        a = next;
    }
    ((reversed as f64 * scale) as f32).min(ONE_MINUS_EPSILON)
}

#[cfg(test)]
mod tests {
    use super::*;
    use irradiant_testkit::chi2_counts;

    #[test]
    fn primes_and_first_inverses() {
        assert_eq!(PRIMES[..6], [2, 3, 5, 7, 11, 13]);
        assert_eq!(PRIMES[127], 719);
        let base2: Vec<f32> = (0..5).map(|i| radical_inverse(0, i)).collect();
        assert_eq!(base2, [0.0, 0.5, 0.25, 0.75, 0.125]);
        assert!((radical_inverse(1, 5) - (2.0 / 3.0 + 1.0 / 9.0)).abs() < 1e-7);
        assert_eq!(radical_inverse(0, u64::MAX), ONE_MINUS_EPSILON);
        assert!(radical_inverse(127, u64::MAX) < 1.0);
        assert_eq!(inverse_radical_inverse(6, 2, 3), 3);
        for i in 0..81 {
            let digits = (radical_inverse(1, i) as f64 * 81.0).round() as u64;
            assert_eq!(inverse_radical_inverse(digits, 3, 4), i);
        }
    }

    #[test]
    fn every_form_is_stratified_in_its_base() {
        for base_index in 0..PRIMES.len() {
            let base = PRIMES[base_index] as u64;
            let n = if base < 25 { base * base } else { base };
            let permutations = DigitPermutations::new(base_index, 17);
            let forms: [&dyn Fn(u64) -> f32; 3] =
                [&|i| radical_inverse(base_index, i), &|i| scrambled_radical_inverse(&permutations, i), &|i| {
                    owen_scrambled_radical_inverse(base_index, i, 99)
                }];
            for (k, form) in forms.iter().enumerate() {
                let mut seen = vec![false; n as usize];
                for i in 0..n {
                    let x = form(3 * n + i);
                    assert!((0.0..1.0).contains(&x));
                    // The plain form sits exactly on edges: a hair up.
                    let hair = if k == 0 { 1e-4 } else { 0.0 };
                    seen[(x as f64 * n as f64 + hair) as usize] = true;
                }
                assert!(seen.iter().all(|s| *s), "base {base}, form {k}");
            }
        }
    }

    #[test]
    fn owen_scrambled_points_are_uniform_over_seeds() {
        for base_index in [0, 1, 5, 40] {
            for index in [0, 1, 1234] {
                let mut counts = [0u64; 64];
                (0..20_000).for_each(|seed| {
                    counts[(owen_scrambled_radical_inverse(base_index, index, mix32(seed + 1)) * 64.0) as usize] += 1;
                });
                // 1e-7 each; a 15 % bias in half of the bins would be seen.
                let report = chi2_counts(&counts, &[1.0 / 64.0; 64]);
                assert!(report.p_value > 1e-7, "{base_index} {index} {report:?}");
            }
        }
    }
}
