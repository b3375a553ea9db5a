//! Record of the rows that a thread borrows.

use std::cell::RefCell;
use std::ops::Range;

/// True where borrowed rows are recorded: in unit tests of this crate and in debug builds.
pub const ROWS_RECORDED: bool = cfg!(any(test, debug_assertions));

/// Row that was borrowed from [`SharedRows`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BorrowedRow {
    /// Addresses in memory.
    pub addresses: Range<usize>,
    /// True if the row may be written.
    pub mutable: bool,
}

thread_local! {
    /// Rows that this thread has borrowed; none unless they are recorded.
    static BORROWED: RefCell<Option<Vec<BorrowedRow>>> = const { RefCell::new(None) };
}

/// Calls `work` and returns the rows that it borrows on this thread; none unless [`ROWS_RECORDED`].
pub fn borrowed_rows(work: impl FnOnce()) -> Vec<BorrowedRow> {
    if !ROWS_RECORDED {
        work();
        return Vec::new();
    }
    let outer = BORROWED.replace(Some(Vec::new()));
    work();
    BORROWED.replace(outer).unwrap_or_default()
}

/// Records a row of `count` entries from `first` on; does nothing unless [`ROWS_RECORDED`].
#[inline(always)]
pub(super) fn record<R>(first: *mut R, count: usize, mutable: bool) {
    if ROWS_RECORDED && count > 0 {
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
    use super::super::SharedRows;
    use super::*;

    #[test]
    fn borrowed_rows_are_recorded() {
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
        assert_eq!(rows, vec![row(5, 6, false), row(2, 5, true)]);
    }
}
