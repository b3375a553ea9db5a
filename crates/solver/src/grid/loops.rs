//! Parallel loops over planes and columns, and rows that several threads share.
//!
//! Every plane's result depends on nothing but its inputs, so it does not depend on the number of
//! threads. Reductions run in the order of the planes.

use std::cell::RefCell;
use std::marker::PhantomData;
use std::ops::Range;

use rayon::prelude::*;

use super::Layout;

/// Calls `f(k, plane, partial)` for the interior planes k = 1..=nz of several fields in parallel,
/// with one partial result per plane.
pub fn for_planes_of<const N: usize, R: Send, T: Send>(
    layout: Layout,
    fields: [&mut [R]; N],
    partial: &mut [T],
    f: impl Fn(usize, [&mut [R]; N], &mut T) + Sync,
) {
    let fields = fields.map(|field| Pieces::interior(layout, field));
    assert_eq!(partial.len(), layout.cells[2]);
    partial.par_iter_mut().enumerate().for_each(|(k, partial)| {
        // SAFETY: each k occurs once, so no two threads hold the same plane.
        let slabs = fields.each_ref().map(|field| unsafe { field.get(k) });
        f(k + 1, slabs, partial);
    });
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
            let parts = fields.each_mut().map(|field| {
                let part = field.split_off_mut(..size);
                part.expect("fields have the entries of their layout")
            });
            tasks.push((component, start, parts));
        }
    }
    tasks.into_par_iter().for_each(|(component, start, parts)| f(component, start, parts));
}

/// Consecutive planes of several fields that one thread holds during [`for_plane_ranges`].
pub struct PlaneRange<'a, const N: usize, R, T> {
    range: Range<usize>,
    fields: &'a [Pieces<'a, R>; N],
    partial: &'a Pieces<'a, T>,
}

impl<const N: usize, R, T> PlaneRange<'_, N, R, T> {
    /// Indices k of the planes.
    pub fn range(&self) -> Range<usize> {
        self.range.clone()
    }
    /// Plane k of each field and its partial result.
    #[inline]
    pub fn plane(&mut self, k: usize) -> ([&mut [R]; N], &mut T) {
        assert!(self.range.contains(&k));
        // SAFETY: `for_plane_ranges` makes disjoint ranges, and the result borrows this range as a
        // whole, so each plane is borrowed once.
        unsafe {
            let fields = self.fields.each_ref().map(|field| field.get(k - 1));
            (fields, &mut self.partial.get(k - 1)[0])
        }
    }
}

/// Calls `f(range, scratch)` for one range of consecutive interior planes per scratch slot, in
/// parallel.
pub fn for_plane_ranges<const N: usize, R: Send, T: Send, S: Send>(
    layout: Layout,
    fields: [&mut [R]; N],
    partial: &mut [T],
    scratch: &mut [S],
    f: impl Fn(&mut PlaneRange<N, R, T>, &mut S) + Sync,
) {
    let fields = fields.map(|field| Pieces::interior(layout, field));
    let (planes, slots) = (layout.cells[2], scratch.len());
    assert_eq!(partial.len(), planes);
    let partial = Pieces::new(partial, 1);
    let slots_with_ends = scratch.par_iter_mut().enumerate();
    slots_with_ends.for_each(|(slot, scratch)| {
        let mut range = PlaneRange {
            range: 1 + planes * slot / slots..1 + planes * (slot + 1) / slots,
            fields: &fields,
            partial: &partial,
        };
        f(&mut range, scratch);
    });
}

/// Calls `f(k, chunk, scratch)` for the chunks k = 0.. of `values` in parallel; each scratch slot
/// serves a range of k.
pub fn for_chunks<R: Send, S: Send>(
    values: &mut [R],
    chunk: usize,
    scratch: &mut [S],
    f: impl Fn(usize, &mut [R], &mut S) + Sync,
) {
    let slots = scratch.len();
    let chunks = Pieces::new(values, chunk);
    scratch.par_iter_mut().enumerate().for_each(|(slot, scratch)| {
        let chunks = &chunks;
        for k in chunks.count * slot / slots..chunks.count * (slot + 1) / slots {
            // SAFETY: every k belongs to one slot.
            f(k, unsafe { chunks.get(k) }, scratch);
        }
    });
}

/// Neighbouring columns through all planes that one thread holds during [`for_columns`].
pub struct Columns<'a, R> {
    start: *mut R,
    stride: usize,
    planes: usize,
    width: usize,
    borrow: PhantomData<&'a mut [R]>,
}

impl<R> Columns<'_, R> {
    /// Number of columns.
    pub fn width(&self) -> usize {
        self.width
    }
    /// Entries of the columns in plane `k`, counted from 0.
    #[inline(always)]
    pub fn row(&mut self, k: usize) -> &mut [R] {
        assert!(k < self.planes);
        // SAFETY: `for_columns` makes disjoint blocks of columns inside the planes, and the result
        // borrows `self` as a whole.
        unsafe { std::slice::from_raw_parts_mut(self.start.add(k * self.stride), self.width) }
    }
}

/// Cuts the first `len` entries of the planes of `values`, `stride` apart, into blocks of `width`
/// columns and calls `f(first column, block, scratch)` in parallel; each scratch slot serves a
/// range of blocks.
pub fn for_columns<R: Send, S: Send>(
    values: &mut [R],
    stride: usize,
    len: usize,
    width: usize,
    scratch: &mut [S],
    f: impl Fn(usize, &mut Columns<R>, &mut S) + Sync,
) {
    assert!(
        len <= stride && stride <= values.len(),
        "columns lie within a plane, and one plane within the values"
    );
    let (slots, blocks, planes) = (scratch.len(), len.div_ceil(width), values.len() / stride);
    let whole = Pieces::new(values, stride);
    scratch.par_iter_mut().enumerate().for_each(|(slot, scratch)| {
        let whole = &whole;
        for block in blocks * slot / slots..blocks * (slot + 1) / slots {
            let at = block * width;
            let mut columns = Columns {
                // SAFETY: `at < len <= stride <= values.len()`, so the block starts inside the
                // first plane. Every block belongs to one slot.
                start: unsafe { whole.start.add(at) },
                stride,
                planes,
                width: width.min(len - at),
                borrow: PhantomData,
            };
            f(at, &mut columns, scratch);
        }
    });
}

/// A slice cut into equal pieces, each of which one thread may hold.
struct Pieces<'a, T> {
    start: *mut T,
    size: usize,
    count: usize,
    slice: PhantomData<&'a mut [T]>,
}

// SAFETY: a piece is an exclusive borrow of entries that may move to another thread. The callers of
// `get` guarantee that no piece is borrowed twice, so a shared `Pieces` gives no shared entry.
unsafe impl<T: Send> Send for Pieces<'_, T> {}
// SAFETY: see `Send`.
unsafe impl<T: Send> Sync for Pieces<'_, T> {}

impl<'a, T> Pieces<'a, T> {
    fn new(values: &'a mut [T], size: usize) -> Pieces<'a, T> {
        Pieces { start: values.as_mut_ptr(), size, count: values.len() / size, slice: PhantomData }
    }
    /// Returns piece `k`.
    ///
    /// # Safety
    /// No two live borrows may have the same `k`.
    #[allow(clippy::mut_from_ref)]
    unsafe fn get(&self, k: usize) -> &mut [T] {
        assert!(k < self.count);
        // SAFETY: the first `count * size` entries belong to the slice, which is borrowed for `'a`.
        // The caller guarantees that no other borrow of the piece is live.
        unsafe { std::slice::from_raw_parts_mut(self.start.add(k * self.size), self.size) }
    }
}

impl<'a, R> Pieces<'a, R> {
    /// Cuts a field into its interior planes.
    fn interior(layout: Layout, field: &'a mut [R]) -> Pieces<'a, R> {
        assert_eq!(field.len(), layout.len());
        let plane = layout.plane();
        Pieces::new(&mut field[plane..plane * (layout.cells[2] + 1)], plane)
    }
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

/// Row that was borrowed from [`SharedRows`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BorrowedRow {
    /// Addresses in memory.
    pub addresses: Range<usize>,
    /// Whether the row may be written.
    pub mutable: bool,
}

thread_local! {
    /// Rows that this thread has borrowed; none unless they are recorded.
    static BORROWED: RefCell<Option<Vec<BorrowedRow>>> = const { RefCell::new(None) };
}

/// Calls `work` and returns the rows that it borrows on this thread; none in release builds.
pub fn borrowed_rows(work: impl FnOnce()) -> Vec<BorrowedRow> {
    if !cfg!(debug_assertions) {
        work();
        return Vec::new();
    }
    let outer = BORROWED.replace(Some(Vec::new()));
    work();
    BORROWED.replace(outer).unwrap_or_default()
}

#[inline(always)]
fn record<R>(first: *mut R, count: usize, mutable: bool) {
    if cfg!(debug_assertions) && count > 0 {
        let addresses = first.addr()..first.addr() + count * size_of::<R>();
        BORROWED.with_borrow_mut(|rows| {
            rows.iter_mut().for_each(|rows| {
                rows.push(BorrowedRow { addresses: addresses.clone(), mutable });
            });
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn borrowed_rows_are_recorded_in_debug_builds() {
        let mut field = [0.0_f64; 8];
        let start = field.as_ptr().addr();
        let mut shared = SharedRows::new(0, &mut field);
        assert_eq!(shared.row(0, 8).len(), 8);
        let rows = borrowed_rows(|| {
            shared.row_mut(2, 3)[0] = shared.row(5, 1)[0];
            assert!(shared.row(7, 0).is_empty());
        });
        let row = |from: usize, to: usize, mutable| BorrowedRow {
            addresses: start + 8 * from..start + 8 * to,
            mutable,
        };
        let mut expected = vec![row(5, 6, false), row(2, 5, true)];
        expected.retain(|_| cfg!(debug_assertions));
        assert_eq!(rows, expected);
    }

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
