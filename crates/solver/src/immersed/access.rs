//! Log of the faces that grains read and write at the same time, kept in debug builds to assert
//! that no thread writes a face that another one uses.

use std::ops::Range;
use std::sync::Mutex;

use super::forcing::ForcedFaces;
use super::geometry::LocatedBody;

/// Kind of an access to faces.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Access {
    Read,
    Write,
}

/// Accesses of all grains to the prediction in a step; empty in release builds.
#[derive(Default)]
pub struct AccessLog(Mutex<Vec<Entry>>);

/// Access of one grain to adjacent faces.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    component: usize,
    start: usize,
    end: usize,
    grain: usize,
    access: Access,
}

impl AccessLog {
    /// Records that a grain corrects the advection of its faces.
    pub fn record_rows(&self, grain: usize, body: &LocatedBody) {
        for (component, rows) in body.rows.iter().enumerate() {
            let rows = rows.iter().map(|row| row.at..row.at + row.count);
            self.record(grain, Access::Write, component, rows);
        }
    }

    /// Records that a grain reads or writes the faces that it forces.
    pub fn record_forced(&self, grain: usize, access: Access, forced: &ForcedFaces) {
        for (component, runs) in forced.runs.iter().enumerate() {
            let runs = runs.iter().map(|run| run.at..run.at + run.count);
            self.record(grain, access, component, runs);
        }
    }

    fn record(
        &self,
        grain: usize,
        access: Access,
        component: usize,
        faces: impl Iterator<Item = Range<usize>>,
    ) {
        if cfg!(debug_assertions) {
            let entries =
                faces.map(|Range { start, end }| Entry { component, start, end, grain, access });
            self.0.lock().expect("no thread panicked").extend(entries);
        }
    }

    /// Panics if one grain writes a face that another one uses; clears the log.
    pub fn assert_no_conflict(&mut self) {
        let entries = self.0.get_mut().expect("no thread panicked");
        entries.sort_unstable();
        // Compares each entry with the preceding one that ends last, of all entries and of writes.
        for writes_only in [false, true] {
            let mut last: Option<&Entry> = None;
            for entry in entries.iter() {
                let same_component = last.filter(|last| last.component == entry.component);
                if let Some(last) = same_component {
                    assert!(
                        last.end <= entry.start
                            || last.grain == entry.grain
                            || last.access == Access::Read && entry.access == Access::Read,
                        "grains {} and {} use the same faces at once",
                        last.grain,
                        entry.grain
                    );
                }
                let extends = same_component.is_none_or(|last| last.end < entry.end);
                if extends && (entry.access == Access::Write || !writes_only) {
                    last = Some(entry);
                }
            }
        }
        entries.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::Access::{Read, Write};
    use super::*;

    fn log(entries: &[(usize, Range<usize>, Access)]) -> AccessLog {
        let log = AccessLog::default();
        for (grain, faces, access) in entries {
            log.record(*grain, *access, 0, [faces.clone()].into_iter());
        }
        log
    }

    #[test]
    fn faces_read_by_several_grains_are_accepted() {
        log(&[(0, 10..20, Write), (0, 12..18, Write), (1, 20..30, Read), (2, 25..40, Read)])
            .assert_no_conflict();
    }

    #[test]
    #[cfg_attr(debug_assertions, should_panic(expected = "use the same faces"))]
    fn a_face_written_by_one_grain_and_read_by_another_is_refused() {
        log(&[(0, 10..20, Write), (1, 0..50, Read), (2, 48..60, Read)]).assert_no_conflict();
    }
}
