//! Rows of a field handed out one by one, so that several may write where no other does.

use std::marker::PhantomData;
use std::ops::Range;

/// Neighbouring entries of a field, all of them or some planes, of which rows are read and written.
pub struct Part<'a, R> {
    range: Range<usize>,
    first: *mut R,
    entries: PhantomData<&'a mut [R]>,
}

// SAFETY: it is the slice it was made of, or one of several to whose makers it was promised that they
// never hand out what another one writes.
unsafe impl<R: Send> Send for Part<'_, R> {}
unsafe impl<R: Sync> Sync for Part<'_, R> {}

impl<'a, R> Part<'a, R> {
    /// Of the entries of a field from `start` on.
    pub fn new(start: usize, entries: &'a mut [R]) -> Part<'a, R> {
        Part {
            range: start..start + entries.len(),
            first: entries.as_mut_ptr(),
            entries: PhantomData,
        }
    }

    /// The same entries once more.
    ///
    /// # Safety
    /// As long as both are in use, no entry of a row that one gives for writing is in a row that the other
    /// gives.
    pub unsafe fn again(&self) -> Part<'a, R> {
        Part {
            range: self.range.clone(),
            ..*self
        }
    }

    /// Where in memory it lies.
    pub fn range(&self) -> &Range<usize> {
        &self.range
    }

    /// `count` entries from position `at` on. Panics if they are not all here.
    #[inline(always)]
    pub fn row(&self, at: usize, count: usize) -> &[R] {
        // SAFETY: the entries are here, and nobody else writes them: see `again`.
        unsafe { std::slice::from_raw_parts(self.find(at, count), count) }
    }

    /// The same for writing.
    #[inline(always)]
    pub fn row_mut(&mut self, at: usize, count: usize) -> &mut [R] {
        // SAFETY: the entries are here, and nobody else has them: see `again`.
        unsafe { std::slice::from_raw_parts_mut(self.find(at, count), count) }
    }

    #[inline(always)]
    fn find(&self, at: usize, count: usize) -> *mut R {
        let Range { start, end } = self.range;
        assert!(
            start <= at && at <= end && count <= end - at,
            "a row lies within its part"
        );
        // SAFETY: the entry is here, or is the end.
        unsafe { self.first.add(at - start) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_those_of_the_field() {
        let mut field: Vec<usize> = (0..40).collect();
        let mut part = Part::new(20, &mut field[20..]);
        assert_eq!(part.row(22, 3), [22, 23, 24]);
        assert!(part.row(40, 0).is_empty());
        part.row_mut(38, 2).fill(7);
        // SAFETY: the rows that are written are not the same.
        let mut again = unsafe { part.again() };
        std::thread::scope(|scope| {
            scope.spawn(|| again.row_mut(21, 4).fill(8));
            part.row_mut(25, 4).fill(9);
        });
        assert_eq!(field[20..30], [20, 8, 8, 8, 8, 9, 9, 9, 9, 29]);
        assert_eq!(field[37..], [37, 7, 7]);
    }

    #[test]
    fn a_row_beyond_the_part_is_refused() {
        let mut field = [0; 40];
        let part = Part::new(10, &mut field[10..30]);
        for (at, count) in [(9, 1), (29, 2), (31, 0), (12, usize::MAX), (usize::MAX, 2)] {
            let row = || part.row(at, count).len();
            assert!(
                std::panic::catch_unwind(std::panic::AssertUnwindSafe(row)).is_err(),
                "{at}"
            );
        }
    }
}
