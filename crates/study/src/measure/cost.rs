//! Cost of runs that are not done yet, from those that are.

use std::path::Path;

use super::record::RunRecord;
use crate::plan::{Plan, Run};

/// Runs whose memory differs by less than this factor have about the same grid.
const SIMILAR: f64 = 1.25;

/// Expected cost of some runs together.
#[derive(Clone, Debug, PartialEq)]
pub struct Cost {
    /// Wall-clock time on one thread [s].
    pub wall_s: f64,
    /// Size of their folders without checkpoints [bytes].
    pub disk_bytes: f64,
    /// Number of finished runs from which the cost follows. If 0, it follows from the case files
    /// alone.
    pub basis: usize,
}

/// One finished run.
struct Done<'a> {
    run: &'a Run,
    /// Measured wall-clock time times threads [s].
    time: f64,
    /// Size of the run folder [bytes], if it exists.
    disk: Option<f64>,
}

/// Estimates the cost of runs. The time and size estimated from a case file are scaled by the ratio
/// of measured to estimated values of the finished runs, if possible of those with a similar grid.
pub fn expected_cost(to_do: &[&Run], plan: &Plan, records: &[RunRecord], study: &Path) -> Cost {
    let runs = plan.runs.iter().zip(records).filter(|(_, record)| record.finished());
    let done: Vec<Done> = runs
        .filter_map(|(run, record)| {
            Some(Done {
                run,
                time: record.wall_s? * record.threads? as f64,
                disk: folder_size(&run.folder(study)),
            })
        })
        .collect();
    let mut cost = Cost { wall_s: 0.0, disk_bytes: 0.0, basis: done.len() };
    for run in to_do {
        let ratio = |d: &&Done| (run.memory_bytes as f64 / d.run.memory_bytes as f64).ln().abs();
        let similar: Vec<&Done> = done.iter().filter(|d| ratio(d) < SIMILAR.ln()).collect();
        let like = if similar.is_empty() { done.iter().collect() } else { similar };
        let scale = |pairs: &mut dyn Iterator<Item = (f64, f64)>| {
            let (measured, estimated) = pairs.fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
            if estimated > 0.0 { measured / estimated } else { 1.0 }
        };
        cost.wall_s += run.wall_s * scale(&mut like.iter().map(|d| (d.time, d.run.wall_s)));
        let sizes = |d: &&Done| Some((d.disk?, d.run.disk_bytes as f64));
        cost.disk_bytes += run.disk_bytes as f64 * scale(&mut like.iter().filter_map(sizes));
    }
    cost
}

/// Returns the size of all files in a folder [bytes], or none if it does not exist.
fn folder_size(folder: &Path) -> Option<f64> {
    let mut size = 0.0;
    for entry in std::fs::read_dir(folder).ok()?.flatten() {
        let Ok(metadata) = entry.metadata() else { continue };
        size += if metadata.is_dir() {
            folder_size(&entry.path()).unwrap_or(0.0)
        } else {
            metadata.len() as f64
        };
    }
    Some(size)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::state::StateKind;

    fn run(memory: u64, wall_s: f64) -> Run {
        Run {
            name: format!("{memory}-{wall_s}"),
            model: String::new(),
            member: 0,
            levels: Default::default(),
            factors: Default::default(),
            base: Default::default(),
            set: Vec::new(),
            id: String::new(),
            accepted_ids: Vec::new(),
            case_sha256: String::new(),
            ending: String::new(),
            end_s: 1.0,
            memory_bytes: memory,
            disk_bytes: 200,
            checkpoint_bytes: 0,
            wall_s,
        }
    }

    fn record(finished: Option<(f64, usize)>) -> RunRecord {
        let state = if finished.is_some() { StateKind::Finished } else { StateKind::Missing };
        let wall_s = finished.map(|(wall_s, _)| wall_s);
        let threads = finished.map(|(_, threads)| threads);
        RunRecord { state, wall_s, threads, ..RunRecord::default() }
    }

    #[test]
    fn the_cost_follows_from_finished_runs_of_the_same_grid() {
        let runs = vec![run(100, 10.0), run(110, 30.0), run(800, 90.0), run(105, 20.0)];
        let plan = Plan {
            grainwake_study: 1,
            study: Default::default(),
            title: String::new(),
            version: String::new(),
            commit: None,
            accepted: Vec::new(),
            analysis: Default::default(),
            runs,
        };
        let folder = tempfile::tempdir().unwrap();
        let nowhere = folder.path();
        let to_do = [&plan.runs[3]];
        let none: Vec<RunRecord> = (0..4).map(|_| record(None)).collect();
        let expected = expected_cost(&to_do, &plan, &none, nowhere);
        assert_eq!(expected, Cost { wall_s: 20.0, disk_bytes: 200.0, basis: 0 });
        // 12 s on one thread and 4 s on two threads where 40 s were expected: a half.
        let mut some = none.clone();
        some[0] = record(Some((12.0, 1)));
        some[1] = record(Some((4.0, 2)));
        some[2] = record(Some((90.0, 1)));
        let like = expected_cost(&to_do, &plan, &some, nowhere);
        assert_eq!((like.wall_s, like.basis), (10.0, 3));
        // Only another grid is known.
        let coarse = [none[0].clone(), none[1].clone(), some[2].clone(), none[3].clone()];
        let other = expected_cost(&to_do, &plan, &coarse, nowhere);
        assert_eq!((other.wall_s, other.basis), (20.0, 1));
        // Folders of finished runs give the size: 300 bytes where 200 were expected.
        let outputs = plan.runs[0].folder(nowhere).join("fields");
        std::fs::create_dir_all(&outputs).unwrap();
        std::fs::write(outputs.join("a"), [0; 300]).unwrap();
        let sized = expected_cost(&to_do, &plan, &some, nowhere);
        assert_eq!(sized.disk_bytes, 300.0);
    }
}
