//! Asking for memory before it is needed.

/// Asks for the cache line on which `value` starts. Changes nothing that a program can see but the time that the next
/// read of it takes; does nothing where the target has no such instruction.
///
/// Worth it when at least 50 ns of other work lie between this and the read.
#[inline(always)]
pub fn prefetch_read<T: ?Sized>(value: &T) {
    lines::<1>(std::ptr::from_ref(value).cast());
}

/// As [`prefetch_read`], for the lines on which `value`, of at most 64 bytes, starts and ends.
#[inline(always)]
pub fn prefetch_whole<T>(value: &T) {
    const { assert!(size_of::<T>() > 0 && size_of::<T>() <= 64) };
    let start: *const u8 = std::ptr::from_ref(value).cast();
    lines::<1>(start);
    lines::<1>(start.wrapping_add(size_of::<T>() - 1));
}

/// Asks for `N` consecutive lines, the one at `start` first. `start` may be any address.
#[inline(always)]
#[allow(unsafe_code)]
pub(crate) fn lines<const N: usize>(start: *const u8) {
    #[cfg(target_arch = "x86_64")]
    for i in 0..N {
        use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a prefetch reads nothing that the program can see and faults at no address; SSE is baseline.
        // Guard: `prefetching_anything_is_harmless`.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(64 * i).cast()) }
    }
    #[cfg(target_arch = "aarch64")]
    for i in 0..N {
        // SAFETY: as above; the instruction is part of every aarch64.
        unsafe {
            core::arch::asm!(
                "prfm pldl1keep, [{}]",
                in(reg) start.wrapping_add(64 * i),
                options(nostack, readonly, preserves_flags)
            );
        }
    }
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    let _ = start;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prefetching_anything_is_harmless() {
        let numbers = vec![1.0f32; 1000];
        numbers.iter().for_each(prefetch_read);
        prefetch_read(&numbers[..]);
        prefetch_read::<[f32]>(&[]);
        prefetch_read(&());
        numbers.iter().for_each(prefetch_whole);
        lines::<3>(std::ptr::null());
        lines::<3>(usize::MAX as *const u8);
        assert_eq!(numbers.iter().sum::<f32>(), 1000.0);
    }
}
