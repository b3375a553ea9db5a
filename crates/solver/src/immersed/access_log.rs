//! Log of the faces that the grains use while they are coupled.

use std::sync::Mutex;

use crate::grid::BorrowedRow;

/// Rows of the prediction that each grain has borrowed, to assert that no grain writes a face that
/// another one uses at once; empty unless rows are recorded.
#[derive(Default)]
pub struct AccessLog(Mutex<Vec<(usize, BorrowedRow)>>);

impl AccessLog {
    /// Records the rows that a grain has borrowed.
    pub fn record(&self, grain: usize, rows: Vec<BorrowedRow>) {
        if !rows.is_empty() {
            let entries = rows.into_iter().map(|row| (grain, row));
            self.0.lock().expect("no thread panicked").extend(entries);
        }
    }

    /// Panics if one grain writes a face that another one uses; clears the log.
    pub fn assert_no_conflict(&mut self) {
        let entries = self.0.get_mut().expect("no thread panicked");
        entries.sort_unstable_by_key(|(grain, row)| (row.addresses.start, *grain));
        // Earlier rows that contain the start of the present one.
        let mut open: Vec<(usize, BorrowedRow)> = Vec::new();
        for (grain, row) in entries.drain(..) {
            open.retain(|(_, earlier)| earlier.addresses.end > row.addresses.start);
            let conflict = open
                .iter()
                .find(|(other, earlier)| *other != grain && (earlier.mutable || row.mutable));
            if let Some((other, _)) = conflict {
                panic!("grains {other} and {grain} use the same faces at once");
            }
            open.push((grain, row));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::*;

    /// Log of entries: grain, faces, whether they are written.
    fn log(entries: &[(usize, Range<usize>, bool)]) -> AccessLog {
        let log = AccessLog::default();
        for (grain, addresses, mutable) in entries {
            let row = BorrowedRow { addresses: addresses.clone(), mutable: *mutable };
            log.record(*grain, vec![row]);
        }
        log
    }

    #[test]
    fn faces_read_by_several_grains_are_accepted() {
        let (write, read) = (true, false);
        log(&[(0, 10..20, write), (0, 12..18, write), (1, 20..30, read), (2, 25..40, read)])
            .assert_no_conflict();
    }

    #[test]
    #[should_panic(expected = "use the same faces")]
    fn a_face_written_by_one_grain_and_read_by_another_is_refused() {
        log(&[(0, 10..20, true), (1, 0..50, false), (2, 48..60, false)]).assert_no_conflict();
    }

    #[test]
    #[should_panic(expected = "grains 2 and 1 use the same faces")]
    fn a_reader_is_found_behind_a_longer_row_of_the_writer() {
        log(&[(2, 1..10, false), (1, 2..20, false), (1, 5..6, true)]).assert_no_conflict();
    }
}
