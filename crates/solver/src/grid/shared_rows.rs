//! Part of a field whose disjoint rows several threads may write.

use std::marker::PhantomData;
use std::ops::Range;

/// Contiguous part of a field, read and written by rows; aliases share its entries.
pub struct SharedRows<'a, R> {
    range: Range<usize>,
    first: *mut R,
    entries: PhantomData<&'a mut [R]>,
}

// SAFETY: the only handle to a slice acts as the exclusive borrow it was made of, which may move to
// another thread if its entries may. The maker of an alias guarantees that no entry written through
// one handle is used through the other, so two threads never access an entry that one of them
// writes. Entries that both read are shared; the numbers of fields are `Sync`.
unsafe impl<R: Send + Sync> Send for SharedRows<'_, R> {}
// SAFETY: a shared handle only reads (`row`), and `row_mut` borrows the handle exclusively. Hence
// sharing a handle shares entries for reading, as `&[R]` does, which is `Sync` if `R` is.
unsafe impl<R: Sync> Sync for SharedRows<'_, R> {}

impl<'a, R> SharedRows<'a, R> {
    /// Rows of `entries`, which start at position `start` of their field.
    pub fn new(start: usize, entries: &'a mut [R]) -> SharedRows<'a, R> {
        SharedRows {
            range: start..start + entries.len(),
            first: entries.as_mut_ptr(),
            entries: PhantomData,
        }
    }

    /// Second handle to the same entries.
    ///
    /// # Safety
    /// While both exist, no entry of a mutable row of one is in a row of the other.
    pub unsafe fn alias(&self) -> SharedRows<'a, R> {
        SharedRows { range: self.range.clone(), ..*self }
    }

    /// Positions of the entries in the memory of the field.
    pub fn range(&self) -> &Range<usize> {
        &self.range
    }

    /// Row of `count` entries from position `at` on. Panics outside the entries.
    #[inline(always)]
    pub fn row(&self, at: usize, count: usize) -> &[R] {
        // SAFETY: `find` checked the bounds. No other handle writes the entries, see `alias`.
        unsafe { std::slice::from_raw_parts(self.find(at, count), count) }
    }

    /// Mutable row of `count` entries from position `at` on. Panics outside the entries.
    #[inline(always)]
    pub fn row_mut(&mut self, at: usize, count: usize) -> &mut [R] {
        // SAFETY: `find` checked the bounds. No other handle borrows the entries, see `alias`; the
        // row borrows this handle exclusively.
        unsafe { std::slice::from_raw_parts_mut(self.find(at, count), count) }
    }

    #[inline(always)]
    fn find(&self, at: usize, count: usize) -> *mut R {
        let Range { start, end } = self.range;
        assert!(start <= at && at <= end && count <= end - at, "a row lies within its entries");
        // SAFETY: the position lies in the slice or at its end.
        unsafe { self.first.add(at - start) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_those_of_the_field() {
        let mut field: Vec<usize> = (0..40).collect();
        let mut shared = SharedRows::new(20, &mut field[20..]);
        assert_eq!(shared.row(22, 3), [22, 23, 24]);
        assert!(shared.row(40, 0).is_empty());
        shared.row_mut(38, 2).fill(7);
        // SAFETY: the mutable rows are disjoint.
        let mut alias = unsafe { shared.alias() };
        std::thread::scope(|scope| {
            scope.spawn(|| alias.row_mut(21, 4).fill(8));
            shared.row_mut(25, 4).fill(9);
        });
        assert_eq!(field[20..30], [20, 8, 8, 8, 8, 9, 9, 9, 9, 29]);
        assert_eq!(field[37..], [37, 7, 7]);
    }

    #[test]
    fn a_row_beyond_the_part_is_refused() {
        let mut field = [0; 40];
        let shared = SharedRows::new(10, &mut field[10..30]);
        for (at, count) in [(9, 1), (29, 2), (31, 0), (12, usize::MAX), (usize::MAX, 2)] {
            let row = || shared.row(at, count).len();
            assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(row)).is_err(), "{at}");
        }
    }
}
