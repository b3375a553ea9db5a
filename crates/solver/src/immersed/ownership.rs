//! Check, in debug builds, that grains processed at the same time use different faces.

use std::ops::Range;
use std::sync::Mutex;

use super::forcing::ForcedFaces;
use super::geometry::LocatedBody;

/// Rows of faces that the grains of a step use; empty in release builds.
#[derive(Default)]
pub struct RowClaims(Mutex<Vec<Claim>>);

#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Claim {
    component: usize,
    start: usize,
    end: usize,
    grain: usize,
    /// Whether the grain writes the row, not only reads it.
    exclusive: bool,
}

impl RowClaims {
    /// Claims the faces that a grain corrects.
    pub fn claim_corrected(&self, grain: usize, body: &LocatedBody) {
        if cfg!(debug_assertions) {
            let rows = body.rows.iter().enumerate();
            let rows = rows.flat_map(|(component, rows)| rows.iter().map(move |r| (component, r)));
            let rows = rows.map(|(component, row)| (component, row.at..row.at + row.count));
            self.claim(grain, true, rows);
        }
    }

    /// Claims the faces that a grain forces.
    pub fn claim_forced(&self, grain: usize, exclusive: bool, forced: &ForcedFaces) {
        if cfg!(debug_assertions) {
            let runs = forced.runs.iter().enumerate();
            let runs = runs.flat_map(|(component, runs)| runs.iter().map(move |r| (component, r)));
            let runs = runs.map(|(component, run)| (component, run.at..run.at + run.count));
            self.claim(grain, exclusive, runs);
        }
    }

    fn claim(
        &self,
        grain: usize,
        exclusive: bool,
        rows: impl Iterator<Item = (usize, Range<usize>)>,
    ) {
        let claims = rows.map(|(component, row)| Claim {
            component,
            start: row.start,
            end: row.end,
            grain,
            exclusive,
        });
        self.0.lock().expect("no thread panicked").extend(claims);
    }

    /// Panics if a face that one grain writes is used by another; then forgets all claims.
    pub fn assert_disjoint(&mut self) {
        let claims = self.0.get_mut().expect("no thread panicked");
        claims.sort_unstable();
        // Row with the largest end so far, of any grain and of those that write.
        for exclusive_only in [false, true] {
            let mut last: Option<&Claim> = None;
            for claim in claims.iter() {
                if let Some(last) = last.filter(|last| last.component == claim.component) {
                    assert!(
                        last.end <= claim.start
                            || last.grain == claim.grain
                            || !(last.exclusive || claim.exclusive),
                        "grains {} and {} use the same faces at once",
                        last.grain,
                        claim.grain
                    );
                }
                let extends = last
                    .is_none_or(|last| last.component != claim.component || last.end < claim.end);
                if extends && (claim.exclusive || !exclusive_only) {
                    last = Some(claim);
                }
            }
        }
        claims.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claims(rows: &[(usize, Range<usize>, bool)]) -> RowClaims {
        let claims = RowClaims::default();
        for (grain, row, exclusive) in rows {
            claims.claim(*grain, *exclusive, [(0, row.clone())].into_iter());
        }
        claims
    }

    #[test]
    fn rows_read_by_several_grains_are_accepted() {
        claims(&[
            (0, 10..20, true),
            (0, 12..18, true),
            (1, 20..30, false),
            (2, 25..40, false),
        ])
        .assert_disjoint();
    }

    #[test]
    #[should_panic(expected = "use the same faces")]
    fn a_row_written_by_one_grain_and_read_by_another_is_refused() {
        claims(&[(0, 10..20, true), (1, 0..50, false), (2, 48..60, false)]).assert_disjoint();
    }
}
