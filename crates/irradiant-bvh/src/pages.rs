//! Large arrays on large pages.
//!
//! A tree of 50 MB is ten thousand pages of 4 KB, more than any processor's table of translations holds, and rays jump
//! about in it. On Linux we ask for pages of 2 MB, as Embree does.

/// Smaller arrays are left alone.
const WORTH: usize = 4 << 20;

/// An empty vector with room for `n` elements, on large pages if they are many and the system grants them. Only speed
/// depends on it.
pub fn vec_on_large_pages<T>(n: usize) -> Vec<T> {
    let vec = Vec::<T>::with_capacity(n);
    advise(vec.as_ptr().cast(), n * size_of::<T>());
    vec
}

#[cfg(target_os = "linux")]
#[allow(unsafe_code)]
fn advise(start: *const u8, bytes: usize) {
    const PAGE: usize = 2 << 20;
    const MADV_HUGEPAGE: i32 = 14;
    unsafe extern "C" {
        fn madvise(start: *mut core::ffi::c_void, bytes: usize, advice: i32) -> i32;
    }
    if bytes < WORTH {
        return;
    }
    let skip = start.align_offset(PAGE);
    let whole = bytes.saturating_sub(skip) / PAGE * PAGE;
    if whole > 0 {
        // SAFETY: the range is whole pages inside one allocation; this advice changes neither contents nor access, and
        // a refusal is no harm. Guard: `large_arrays_hold_what_is_put_in`.
        unsafe {
            madvise(start.wrapping_add(skip).cast_mut().cast(), whole, MADV_HUGEPAGE);
        }
    }
}

#[cfg(not(target_os = "linux"))]
fn advise(_start: *const u8, _bytes: usize) {
    let _ = WORTH;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_arrays_hold_what_is_put_in() {
        for n in [0, 1, 1000, 3 << 20] {
            let mut numbers = vec_on_large_pages::<u64>(n);
            assert!(numbers.capacity() >= n);
            numbers.extend(0..n as u64);
            assert_eq!(numbers.iter().sum::<u64>(), (n as u64 * (n as u64).saturating_sub(1)) / 2);
            // Growing past what was asked for moves the memory.
            numbers.extend(0..n as u64);
            assert_eq!(numbers.len(), 2 * n);
        }
    }
}
