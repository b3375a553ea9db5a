//! Parallel loops over planes and columns, and rows that several threads share.
//!
//! Every plane's result depends on nothing but its inputs, so it does not depend on the number of
//! threads. Reductions run in the order of the planes.

use std::marker::PhantomData;
use std::ops::Range;

use rayon::prelude::*;

use super::Layout;
use super::borrowed::record;

/// Interior planes k = 1..=nz of several fields, each with its index k and its partial result.
pub fn planes_of<'a, const N: usize, R: Send, T: Send>(
    layout: Layout,
    fields: [&'a mut [R]; N],
    partial: &'a mut [T],
) -> impl IndexedParallelIterator<Item = (usize, [&'a mut [R]; N], &'a mut T)> {
    let (plane, nz) = (layout.plane(), layout.cells[2]);
    assert_eq!(partial.len(), nz);
    let mut interior = fields.map(|field| &mut field[plane..(nz + 1) * plane]);
    let planes: Vec<_> = partial
        .iter_mut()
        .zip(1..)
        .map(|(partial, k)| (k, split_off(&mut interior, plane), partial))
        .collect();
    planes.into_par_iter()
}

/// Splits the first `len` entries off each list.
fn split_off<'a, const N: usize, R>(lists: &mut [&'a mut [R]; N], len: usize) -> [&'a mut [R]; N] {
    lists
        .each_mut()
        .map(|list| list.split_off_mut(..len).expect("lists have at least `len` entries"))
}

/// Calls `f(component, start, parts)` in parallel for slabs of whole planes, ghosts included, of
/// the fields of three components; `start` is where the slab begins in memory.
pub fn for_slabs<const N: usize, R: Send>(
    layout: Layout,
    components: [[&mut [R]; N]; 3],
    f: impl Fn(usize, usize, [&mut [R]; N]) + Sync,
) {
    // More slabs than threads balance the load where grains cluster.
    let slabs = 4 * rayon::current_num_threads();
    let length = (layout.cells[2] + 2).div_ceil(slabs) * layout.plane();
    let mut tasks = Vec::with_capacity(3 * slabs);
    for (component, mut fields) in components.into_iter().enumerate() {
        for start in (0..layout.len()).step_by(length) {
            let size = length.min(layout.len() - start);
            tasks.push((component, start, split_off(&mut fields, size)));
        }
    }
    tasks.into_par_iter().for_each(|(component, start, parts)| f(component, start, parts));
}

/// Neighbouring columns through all planes of a list.
pub struct Columns<'a, R> {
    range: Range<usize>,
    list: SharedRows<'a, R>,
    stride: usize,
}

impl<R> Columns<'_, R> {
    /// Positions of the columns in a plane.
    pub fn range(&self) -> Range<usize> {
        self.range.clone()
    }
    /// Entries of the columns in plane `k`, counted from 0.
    #[inline(always)]
    pub fn row(&mut self, k: usize) -> &mut [R] {
        self.list.row_mut(k * self.stride + self.range.start, self.range.len())
    }
}

/// Cuts the first `len` entries of the planes of `values`, `stride` apart, into blocks of `width`
/// columns; the last block may have fewer.
pub fn columns_of<R>(
    values: &mut [R],
    stride: usize,
    len: usize,
    width: usize,
) -> Vec<Columns<'_, R>> {
    assert!(len <= stride, "columns lie within a plane");
    let list = SharedRows::new(0, values);
    let block = |first: usize| {
        // SAFETY: the blocks have no column in common, and columns lie within a plane.
        let list = unsafe { list.alias() };
        Columns { range: first..len.min(first + width), list, stride }
    };
    (0..len).step_by(width).map(block).collect()
}

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
        let first = self.find(at, count);
        record(first, count, false);
        // SAFETY: `find` checked the bounds. No other handle writes the entries, see `alias`.
        unsafe { std::slice::from_raw_parts(first, count) }
    }

    /// Mutable row of `count` entries from position `at` on. Panics outside the entries.
    #[inline(always)]
    pub fn row_mut(&mut self, at: usize, count: usize) -> &mut [R] {
        let first = self.find(at, count);
        record(first, count, true);
        // SAFETY: `find` checked the bounds. No other handle borrows the entries, see `alias`; the
        // row borrows this handle exclusively.
        unsafe { std::slice::from_raw_parts_mut(first, count) }
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
