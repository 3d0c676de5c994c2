//! Which instructions a query may use.

use std::sync::OnceLock;

/// An instruction set for traversal. Results are identical at every level; only speed differs.
///
/// Asking for a level this machine lacks gives the best one it has, so any value is safe anywhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Level {
    /// Plain scalar code: the specification.
    Scalar,
    /// Four lanes through the portable wrapper, which compiles to NEON on aarch64 and to whatever the target has elsewhere.
    Neon,
    /// The x86-64 baseline (SSE2).
    Sse,
    /// AVX2 with FMA, BMI and LZCNT.
    Avx2,
    /// AVX-512 F, DQ and VL: sixteen rays of a packet in one register, single rays on 256-bit vectors.
    Avx512,
}

impl Level {
    /// The fastest level of this machine. Detected once; the same for the life of the process.
    #[inline]
    pub fn detect() -> Self {
        static BEST: OnceLock<Level> = OnceLock::new();
        *BEST.get_or_init(Self::best)
    }

    /// Every level this machine can run, slowest first.
    pub fn available() -> Vec<Self> {
        let mut levels = vec![Self::Scalar, Self::Neon];
        if cfg!(target_arch = "x86_64") {
            levels.extend([Self::Sse, Self::Avx2, Self::Avx512].into_iter().filter(|&level| level <= Self::detect()));
        }
        levels
    }

    #[cfg(target_arch = "x86_64")]
    fn best() -> Self {
        let avx2 = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        let avx512 = avx2
            && is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl");
        match (avx2, avx512) {
            (_, true) => Self::Avx512,
            (true, false) => Self::Avx2,
            (false, false) => Self::Sse,
        }
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn best() -> Self {
        Self::Neon
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_detected_level_is_the_best_available() {
        let levels = Level::available();
        assert_eq!(levels.last(), Some(&Level::detect()));
        assert!(levels.is_sorted());
        assert!(levels.contains(&Level::Scalar));
    }
}
