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
    advise(vec.as_ptr().cast(), n * size_of::<T>(), Advice::LargePages);
    vec
}

/// Moves what an array holds onto large pages, if it is large and the system grants them (Linux 6.1). What the allocator has used before is on small ones,
/// whatever [`vec_on_large_pages`] asked for: a tree there took 1.04 to 1.06 of the time in a street of 250,000 triangles. Linux does it at once, and also
/// where large pages are switched off for those who only advise. Only speed depends on it.
pub fn move_to_large_pages<T>(array: &[T]) {
    advise(array.as_ptr().cast(), size_of_val(array), Advice::Collapse);
}

/// Numbers of Linux's `madvise`.
#[cfg_attr(not(target_os = "linux"), allow(dead_code))]
#[derive(Clone, Copy)]
enum Advice {
    /// `MADV_HUGEPAGE`: large pages for what is touched from now on.
    LargePages = 14,
    /// `MADV_COLLAPSE`: large pages for what is there.
    Collapse = 25,
}

#[cfg(target_os = "linux")]
#[allow(unsafe_code)]
fn advise(start: *const u8, bytes: usize, advice: Advice) {
    const PAGE: usize = 2 << 20;
    unsafe extern "C" {
        fn madvise(start: *mut core::ffi::c_void, bytes: usize, advice: i32) -> i32;
    }
    if bytes < WORTH {
        return;
    }
    let skip = start.align_offset(PAGE);
    let whole = bytes.saturating_sub(skip) / PAGE * PAGE;
    if whole > 0 {
        // SAFETY: the range is whole pages inside one allocation; neither advice changes contents or access, and
        // a refusal is no harm. Guard: `large_arrays_hold_what_is_put_in`.
        unsafe {
            madvise(start.wrapping_add(skip).cast_mut().cast(), whole, advice as i32);
        }
    }
}

#[cfg(not(target_os = "linux"))]
fn advise(_start: *const u8, _bytes: usize, _advice: Advice) {
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
            move_to_large_pages(&numbers);
            assert!(numbers.iter().copied().eq((0..n as u64).chain(0..n as u64)));
        }
    }
}
