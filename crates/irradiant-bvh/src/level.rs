//! Which instructions a query may use.

use std::sync::OnceLock;

/// An instruction set for traversal. Results are identical at every level; only speed differs.
///
/// Asking for a level this machine lacks gives the best one it has, so any value is safe anywhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Level {
    /// Plain scalar code: the specification.
    Scalar,
    /// Four lanes: NEON, which every aarch64 machine has; elsewhere arrays and loops.
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

/// A piece of work that is compiled once for each instruction set, such as a plain loop over slices that the compiler turns into vector
/// code. Its bits are the same everywhere: arithmetic stays as written, only several at a time.
pub trait Kernel {
    /// What it gives.
    type Output;
    /// Does it. To be `#[inline(always)]`, with all that it calls; what is not inlined is compiled for the baseline.
    fn run(self) -> Self::Output;
}

impl Level {
    /// Does a piece of work with the widest vectors of this level that the machine has.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[cfg(target_arch = "x86_64")]
        {
            let level = self.min(Self::detect());
            if level == Self::Avx512 && is_x86_feature_detected!("avx512bw") {
                return wide::run_avx512(kernel);
            }
            if level >= Self::Avx2 {
                return wide::run_avx2(kernel);
            }
        }
        kernel.run()
    }
}

#[cfg(target_arch = "x86_64")]
mod wide {
    use super::{Kernel, Level};

    /// To be called at [`Level::Avx512`] on machines that have AVX-512 BW besides.
    #[inline]
    #[allow(unsafe_code)]
    pub fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
        #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn compiled<K: Kernel>(kernel: K) -> K::Output {
            kernel.run()
        }
        debug_assert!(Level::detect() == Level::Avx512);
        // SAFETY: the one caller, `Level::run`, has just asked for these features. Guarded by `kernels_run_at_every_level`.
        unsafe { compiled(kernel) }
    }

    /// To be called where [`Level::detect`] is at least [`Level::Avx2`].
    #[inline]
    #[allow(unsafe_code)]
    pub fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn compiled<K: Kernel>(kernel: K) -> K::Output {
            kernel.run()
        }
        debug_assert!(Level::detect() >= Level::Avx2);
        // SAFETY: the one caller, `Level::run`, has just asked for these features. Guarded by `kernels_run_at_every_level`.
        unsafe { compiled(kernel) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sums<'a>(&'a [f32], &'a mut [f32]);

    impl Kernel for Sums<'_> {
        type Output = usize;
        #[inline(always)]
        fn run(self) -> usize {
            // A product and a sum that must not be fused.
            self.1.iter_mut().zip(self.0).for_each(|(out, x)| *out = x * x + 0.1);
            self.0.len()
        }
    }

    #[test]
    fn kernels_run_at_every_level() {
        let numbers: Vec<f32> = (0..100).map(|i| i as f32 / 7.0).collect();
        let mut expected = vec![0.0; 100];
        Sums(&numbers, &mut expected).run();
        // Levels that the machine lacks too.
        for level in [Level::Scalar, Level::Neon, Level::Sse, Level::Avx2, Level::Avx512] {
            let mut found = vec![0.0; 100];
            assert_eq!(level.run(Sums(&numbers, &mut found)), 100);
            assert_eq!(found, expected, "{level:?}");
        }
    }

    #[test]
    fn the_detected_level_is_the_best_available() {
        let levels = Level::available();
        assert_eq!(levels.last(), Some(&Level::detect()));
        assert!(levels.is_sorted());
        assert!(levels.contains(&Level::Scalar));
    }
}
