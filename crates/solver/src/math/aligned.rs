//! Numbers that start on a cache line.

use std::ops::{Deref, DerefMut};

use super::Real;

/// A fixed number of numbers, one of which, the first unless said, lies at the start of a cache line. Nothing
/// is touched when it is made: a page belongs to the thread that first writes to it.
#[derive(Debug)]
pub struct Aligned<R> {
    values: Vec<R>,
    start: usize,
    len: usize,
}

impl<R: Real> Aligned<R> {
    /// `len` zeros.
    pub fn zeros(len: usize) -> Aligned<R> {
        Aligned::with_head(0, len)
    }
    /// `len` zeros, of which entry `head` lies at the start of a cache line.
    pub fn with_head(head: usize, len: usize) -> Aligned<R> {
        assert!(head <= R::LANES);
        let values: Vec<R> = zeros(len + 2 * R::LANES - 1);
        // The buffer is never reallocated, so the start stays where it is.
        let line = values.as_ptr().align_offset(R::LANES * R::BYTES);
        let start = line + R::LANES - head;
        Aligned { values, start, len }
    }
}

impl<R> Deref for Aligned<R> {
    type Target = [R];
    #[inline]
    fn deref(&self) -> &[R] {
        &self.values[self.start..self.start + self.len]
    }
}
impl<R> DerefMut for Aligned<R> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [R] {
        &mut self.values[self.start..self.start + self.len]
    }
}

/// `len` zeros, not touched yet, in large pages where the system has them.
fn zeros<R: Real>(len: usize) -> Vec<R> {
    let values = vec![R::default(); len];
    #[cfg(target_os = "linux")]
    ask_for_large_pages(&values);
    values
}

/// Asks for pages of 2 MiB instead of 4 KiB for a long list before it is touched. What lies about a grain
/// is on a page of its own for every row or two; the processor does not remember where so many small ones are.
#[cfg(target_os = "linux")]
fn ask_for_large_pages<R>(values: &[R]) {
    const SMALL: usize = 4096;
    const LARGE: usize = 2 << 20;
    let first = values.as_ptr().addr();
    let ahead = first.next_multiple_of(SMALL) - first;
    let bytes = size_of_val(values).saturating_sub(ahead) / SMALL * SMALL;
    if bytes >= 2 * LARGE {
        // SAFETY: the pages lie within the list, and the advice changes no byte of it. Where it is not
        // taken the pages are small.
        unsafe {
            let pages = values.as_ptr().byte_add(ahead).cast_mut().cast();
            libc::madvise(pages, bytes, libc::MADV_HUGEPAGE);
        }
    }
}
