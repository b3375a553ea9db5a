//! Lists of numbers aligned to cache lines.

use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicUsize, Ordering};

use super::Real;

/// List of fixed length, one entry of which, the first by default, starts a cache line. Creation
/// writes no entry: the operating system places a page near the thread that first writes to it.
#[derive(Debug, Default)]
pub struct Aligned<R> {
    values: Vec<R>,
    start: usize,
}

impl<R: Real> Aligned<R> {
    /// List of `len` zeros.
    pub fn zeros(len: usize) -> Aligned<R> {
        Aligned::with_head(0, len)
    }
    /// List of `len` zeros, entry `head` of which starts a cache line.
    pub fn with_head(head: usize, len: usize) -> Aligned<R> {
        assert!(head <= R::LANES);
        let offset = R::LANES * page_offset(R::BYTES * len);
        let mut values = vec![R::default(); len + 2 * R::LANES - 1 + offset];
        #[cfg(target_os = "linux")]
        advise_large_pages(&values);
        // The buffer is never reallocated, so the start stays where it is.
        let line = values.as_ptr().align_offset(R::LANES * R::BYTES);
        let start = line + R::LANES - head + offset;
        values.truncate(start + len);
        Aligned { values, start }
    }
    /// Replaces a list shorter than `len` by `len` zeros.
    pub fn make_room(&mut self, len: usize) {
        if self.len() < len {
            *self = Aligned::zeros(len);
        }
    }
}

/// Offset of a list of `bytes` in its first page [cache lines]; successive long lists differ.
///
/// The system maps each long list at the start of a page. Processors compare loads with earlier
/// stores by the address within a page, so fields at equal offsets delay each other's loads: up to
/// 9 % of a step in single precision.
fn page_offset(bytes: usize) -> usize {
    const SHORT: usize = 1 << 16;
    static LONG_LISTS: AtomicUsize = AtomicUsize::new(0);
    if bytes < SHORT {
        return 0;
    }
    // Seven offsets, nine of the 64 lines of a page apart.
    9 * (LONG_LISTS.fetch_add(1, Ordering::Relaxed) % 7)
}

impl<R> Deref for Aligned<R> {
    type Target = [R];
    #[inline]
    fn deref(&self) -> &[R] {
        &self.values[self.start..]
    }
}
impl<R> DerefMut for Aligned<R> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [R] {
        &mut self.values[self.start..]
    }
}

/// Advises pages of 2 MiB instead of 4 KiB for a long list before its first use. Consecutive rows
/// about a grain lie on different small pages, more than the processor's page table cache holds.
#[cfg(target_os = "linux")]
fn advise_large_pages<R>(values: &[R]) {
    const SMALL: usize = 4096;
    const LARGE: usize = 2 << 20;
    let first = values.as_ptr().addr();
    let ahead = first.next_multiple_of(SMALL) - first;
    let bytes = size_of_val(values).saturating_sub(ahead) / SMALL * SMALL;
    if bytes >= 2 * LARGE {
        // SAFETY: the pages lie within the list, and the advice changes no byte of it. A system
        // that ignores the advice uses small pages.
        unsafe {
            let pages = values.as_ptr().byte_add(ahead).cast_mut().cast();
            libc::madvise(pages, bytes, libc::MADV_HUGEPAGE);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lists_have_a_head_on_a_cache_line_and_different_page_offsets() {
        let fields = [0; 4].map(|_| Aligned::<f64>::with_head(1, 1 << 15));
        let offsets = fields.each_ref().map(|field| {
            assert_eq!((field.len(), field[1 << 14]), (1 << 15, 0.0));
            let start = field[1..].as_ptr().addr();
            assert_eq!(start % 64, 0);
            start % 4096
        });
        // Tests that run at the same time take offsets too.
        assert!(offsets.iter().any(|offset| *offset != offsets[0]), "{offsets:?}");
        let mut short = Aligned::<f32>::zeros(20);
        short[19] = 1.0;
        short.make_room(20);
        assert_eq!((short[19], short.as_ptr().addr() % 64), (1.0, 0));
        short.make_room(21);
        assert_eq!(short[..], [0.0; 21]);
    }
}
