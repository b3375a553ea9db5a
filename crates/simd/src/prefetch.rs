//! Prefetching of list entries.

/// Prefetches entries `at` to `at + count` of a list into the first cache; entries beyond its end
/// are skipped. Short rows end before the hardware prefetcher detects them.
#[inline(always)]
pub fn prefetch<T>(list: &[T], at: usize, count: usize) {
    #[cfg(target_arch = "x86_64")]
    prefetch_to::<{ std::arch::x86_64::_MM_HINT_T0 }, T>(list, at, count);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (list, at, count);
}

/// Prefetches entries into the second cache, for reads that come later.
#[inline(always)]
pub fn prefetch_ahead<T>(list: &[T], at: usize, count: usize) {
    #[cfg(target_arch = "x86_64")]
    prefetch_to::<{ std::arch::x86_64::_MM_HINT_T1 }, T>(list, at, count);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (list, at, count);
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn prefetch_to<const HINT: i32, T>(list: &[T], at: usize, count: usize) {
    use std::arch::x86_64::_mm_prefetch;
    const LINE: usize = 64;
    let end = at.wrapping_add(count).min(list.len());
    if at >= end {
        return;
    }
    let mut line = list.as_ptr().wrapping_add(at);
    let end = list.as_ptr().wrapping_add(end);
    line = line.wrapping_byte_sub(line.addr() % LINE);
    while line < end {
        // SAFETY: a prefetch of any address has no effect on memory.
        unsafe { _mm_prefetch::<HINT>(line.cast()) };
        line = line.wrapping_byte_add(LINE);
    }
}
