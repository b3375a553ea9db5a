//! Checkpoint of a run from which another run starts.

use std::path::{Path, PathBuf};

use grainwake_solver::sim::{SAME_TIME, Simulation};

use super::checkpoint::{self, Record};
use super::provenance::{ParentRun, Provenance};
use crate::error::RunError;

/// Checkpoint of a run, the parent, from which another run starts.
#[derive(Clone, Debug)]
pub struct Parent {
    folder: PathBuf,
    provenance: Provenance,
    checkpoint: PathBuf,
    time: f64,
    steps: u64,
    /// Latest time of the checkpoint that was asked for [s].
    at: Option<f64>,
}

impl Parent {
    /// Returns whether a run that started from the checkpoint at `time` [s] can be one from this
    /// parent: not after the time that was asked for.
    pub(crate) fn may_be_at(&self, time: f64) -> bool {
        self.at.is_none_or(|at| time <= at * (1.0 + SAME_TIME))
    }

    /// Finds the newest checkpoint in the run folder `folder` at or before the time `at` [s], or
    /// the newest one of all. `note` receives the faults of newer ones.
    ///
    /// # Errors
    /// [`RunError::NoParent`] if there is no such checkpoint, [`RunError::NoCheckpoint`] if all of
    /// them are damaged.
    pub fn find(
        folder: &Path,
        at: Option<f64>,
        note: &mut dyn FnMut(&str),
    ) -> Result<Parent, RunError> {
        let none = |what: String, remedy: &str| {
            let what = format!("{} {what}", folder.display());
            Err(RunError::NoParent { what, remedy: remedy.into() })
        };
        let Some(provenance) = Provenance::read(folder) else {
            let what = if folder.is_dir() { "holds no run" } else { "is no folder" };
            let remedy = "give the folder of a run, for example --from runs/heap or, with the time \
                          of the checkpoint, --from \"runs/heap@0.5 s\"";
            return none(what.into(), remedy);
        };
        let (mut later, mut faults) = (Vec::new(), Vec::new());
        for path in checkpoint::list(folder) {
            match checkpoint::open(&path) {
                Ok((record, _)) if record.digest != provenance.case_sha256 => {
                    faults.push(format!("{}: it belongs to another case", path.display()));
                }
                Ok((record, _)) if at.is_some_and(|at| record.time > at * (1.0 + SAME_TIME)) => {
                    later.push(format!("{} s", record.time));
                }
                Ok((record, _)) => {
                    for fault in &faults {
                        note(&format!("warning: {fault}; an earlier checkpoint is taken"));
                    }
                    let (time, steps) = (record.time, record.steps);
                    let folder = folder.to_path_buf();
                    return Ok(Parent { folder, provenance, checkpoint: path, time, steps, at });
                }
                Err(fault) => faults.push(format!("{}: {fault}", path.display())),
            }
        }
        match at {
            _ if !faults.is_empty() => Err(RunError::NoCheckpoint {
                folder: folder.join(checkpoint::FOLDER),
                reasons: faults,
                remedy: "Give another time or another run with --from",
            }),
            Some(at) if !later.is_empty() => {
                later.reverse();
                let times = later.join(", ");
                let what =
                    format!("has no checkpoint at or before {at} s: it has those at {times}");
                let remedy = "give one of these times, or run it again with output.checkpoint_keep \
                              and output.checkpoint_steps, which keep more checkpoints";
                none(what, remedy)
            }
            _ => {
                let remedy =
                    "run it again to write one, or place its grains in a new run with [[poses]]";
                none("has no checkpoint".into(), remedy)
            }
        }
    }

    /// Folder of the run.
    pub fn folder(&self) -> &Path {
        &self.folder
    }
    /// Simulated time of the checkpoint [s].
    pub fn time(&self) -> f64 {
        self.time
    }
    /// Hash of the case of the run.
    pub(crate) fn digest(&self) -> &str {
        &self.provenance.case_sha256
    }

    /// Returns the record of the parent in the provenance of a new run.
    pub(crate) fn described(&self) -> ParentRun {
        let absolute = std::fs::canonicalize(&self.folder).unwrap_or_else(|_| self.folder.clone());
        ParentRun {
            folder: absolute.display().to_string(),
            version: self.provenance.version.clone(),
            commit: self.provenance.commit.clone(),
            case_sha256: self.provenance.case_sha256.clone(),
            checkpoint_time: self.time,
            checkpoint_step: self.steps,
            parent: self.provenance.parent.clone().map(Box::new),
        }
    }

    /// Reads the checkpoint into a simulation whose grid, grains and precision are those of the
    /// parent.
    ///
    /// # Errors
    /// [`RunError::NoCheckpoint`] if it has changed since [`Parent::find`] or does not fit.
    pub(crate) fn restore(&self, sim: &mut Simulation) -> Result<Record, RunError> {
        checkpoint::read(&self.checkpoint, self.digest(), sim).map_err(|reason| {
            RunError::NoCheckpoint {
                folder: self.folder.join(checkpoint::FOLDER),
                reasons: vec![format!("{}: {reason}", self.checkpoint.display())],
                remedy: "Run the command again: a running parent replaces its checkpoints",
            }
        })
    }
}
