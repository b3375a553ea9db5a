//! Cost of runs that are not done yet, from those that are and from timed steps.

use std::path::Path;

use super::record::RunRecord;
use crate::plan::{Plan, Run};
use crate::run::step_time::StepTime;

/// Runs whose memory differs by less than this factor have about the same grid.
const SIMILAR: f64 = 1.25;

/// Expected cost of some runs together.
#[derive(Clone, Debug, PartialEq)]
pub struct Cost {
    /// Wall-clock time on one thread [s].
    pub wall_s: f64,
    /// Size of their folders without checkpoints [bytes].
    pub disk_bytes: f64,
    /// Number of finished runs from which the size follows, and the time without timed steps. If
    /// 0, they follow from the case files alone.
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
/// Timed steps, if there are any, give the ratio of the times in place of the finished runs.
pub fn expected_cost(
    to_do: &[&Run],
    plan: &Plan,
    records: &[RunRecord],
    study: &Path,
    timed: &[StepTime],
) -> Cost {
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
        let like = similar(&done, run, |done| done.run.memory_bytes);
        let steps = similar(timed, run, |step| step.memory_bytes);
        let time_ratio = if steps.is_empty() {
            ratio(like.iter().map(|d| (d.time, d.run.wall_s)))
        } else {
            ratio(steps.iter().map(|step| (step.measured_s, step.estimated_s)))
        };
        cost.wall_s += run.wall_s * time_ratio;
        let sizes = like.iter().filter_map(|d| Some((d.disk?, d.run.disk_bytes as f64)));
        cost.disk_bytes += run.disk_bytes as f64 * ratio(sizes);
    }
    cost
}

/// Returns one of the runs for each size of grid. The timed steps of these are enough for the cost
/// of all.
pub fn one_per_grid<'a>(runs: &[&'a Run]) -> Vec<&'a Run> {
    let mut chosen: Vec<&Run> = Vec::new();
    for run in runs {
        if !chosen.iter().any(|other| is_similar(other.memory_bytes, run.memory_bytes)) {
            chosen.push(run);
        }
    }
    chosen
}

/// Returns the samples with about the grid of a run, or all if there are none.
fn similar<'a, T>(samples: &'a [T], run: &Run, memory_bytes: fn(&T) -> u64) -> Vec<&'a T> {
    let like: Vec<&T> =
        samples.iter().filter(|t| is_similar(memory_bytes(t), run.memory_bytes)).collect();
    if like.is_empty() { samples.iter().collect() } else { like }
}

/// Returns whether two runs with this memory have about the same grid.
fn is_similar(one: u64, other: u64) -> bool {
    (one as f64 / other as f64).ln().abs() < SIMILAR.ln()
}

/// Returns the sum of measured values over that of the estimated ones, 1 if there are none.
fn ratio(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (measured, estimated) = pairs.fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
    if estimated > 0.0 { measured / estimated } else { 1.0 }
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
        let expected = expected_cost(&to_do, &plan, &none, nowhere, &[]);
        assert_eq!(expected, Cost { wall_s: 20.0, disk_bytes: 200.0, basis: 0 });
        // 12 s on one thread and 4 s on two threads where 40 s were expected: a half.
        let mut some = none.clone();
        some[0] = record(Some((12.0, 1)));
        some[1] = record(Some((4.0, 2)));
        some[2] = record(Some((90.0, 1)));
        let like = expected_cost(&to_do, &plan, &some, nowhere, &[]);
        assert_eq!((like.wall_s, like.basis), (10.0, 3));
        // Only another grid is known.
        let coarse = [none[0].clone(), none[1].clone(), some[2].clone(), none[3].clone()];
        let other = expected_cost(&to_do, &plan, &coarse, nowhere, &[]);
        assert_eq!((other.wall_s, other.basis), (20.0, 1));
        // Folders of finished runs give the size: 300 bytes where 200 were expected.
        let outputs = plan.runs[0].folder(nowhere).join("fields");
        std::fs::create_dir_all(&outputs).unwrap();
        std::fs::write(outputs.join("a"), [0; 300]).unwrap();
        let sized = expected_cost(&to_do, &plan, &some, nowhere, &[]);
        assert_eq!(sized.disk_bytes, 300.0);
        // A step of each grid was timed: they count, the finished runs do not.
        let step =
            |memory_bytes, measured_s| StepTime { memory_bytes, measured_s, estimated_s: 0.2 };
        let both = [&plan.runs[3], &plan.runs[2]];
        let timed = expected_cost(&both, &plan, &some, nowhere, &[step(100, 0.3), step(800, 0.1)]);
        assert_eq!((timed.wall_s, timed.disk_bytes), (30.0 + 45.0, 300.0 + 200.0));
        let all: Vec<&Run> = plan.runs.iter().collect();
        assert_eq!(one_per_grid(&all), [&plan.runs[0], &plan.runs[2]]);
    }
}
