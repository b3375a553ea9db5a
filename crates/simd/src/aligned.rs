//! Numbers that start on a cache line.

use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicUsize, Ordering};

use super::Real;

/// A fixed number of numbers, one of which, the first unless said, lies at the start of a cache line. Nothing
/// is touched when it is made: a page belongs to the thread that first writes to it.
#[derive(Debug, Default)]
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
        let apart = R::LANES * lines_apart(R::BYTES * len);
        let values: Vec<R> = zeros(len + 2 * R::LANES - 1 + apart);
        // The buffer is never reallocated, so the start stays where it is.
        let line = values.as_ptr().align_offset(R::LANES * R::BYTES);
        let start = line + R::LANES - head + apart;
        Aligned { values, start, len }
    }
    /// Makes it at least so long; what it held is lost where it was not.
    pub fn make_room(&mut self, len: usize) {
        if self.len < len {
            *self = Aligned::zeros(len);
        }
    }
}

/// How many cache lines after the first of its memory a list of so many bytes starts. The system maps large lists
/// one by one, each at the start of a page; they start at different places in turn: a processor tells loads from
/// stores before them by the place within the page, so without that it waits for what it has stored to one field
/// before it loads from another at the same place.
fn lines_apart(bytes: usize) -> usize {
    const SMALL: usize = 1 << 16;
    static LARGE: AtomicUsize = AtomicUsize::new(0);
    if bytes < SMALL {
        return 0;
    }
    // Seven places, nine of the 64 lines of a page apart.
    9 * (LARGE.fetch_add(1, Ordering::Relaxed) % 7)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_lists_start_on_cache_lines_at_different_places_of_a_page() {
        let fields = [0; 4].map(|_| Aligned::<f64>::with_head(1, 1 << 15));
        let starts = fields.each_ref().map(|field| {
            assert_eq!((field.len(), field[1 << 14]), (1 << 15, 0.0));
            field[1..].as_ptr().addr()
        });
        let mut places = starts.map(|start| {
            assert_eq!(start % 64, 0);
            start % 4096
        });
        places.sort();
        // Other tests take places too, at the same time.
        assert!(places[0] != places[3], "{places:?}");
        let mut short = Aligned::<f32>::zeros(20);
        short[19] = 1.0;
        short.make_room(20);
        assert_eq!((short[19], short.as_ptr().addr() % 64), (1.0, 0));
        short.make_room(21);
        assert_eq!(short[..], [0.0; 21]);
    }
}
