//! Input of a run: the simulation with its outputs, and the options of the command.

use std::sync::Arc;

use grainwake_solver::sim::Setup;

use crate::plan::RunPlan;
use crate::run_folder::{Existing, Parent};

/// Simulation to run, with its outputs.
#[derive(Clone, Debug)]
pub struct Job {
    /// Set-up of the simulation.
    pub setup: Setup,
    /// Outputs and end.
    pub plan: RunPlan,
    /// Text of `case.resolved.toml`.
    pub resolved: String,
    /// Hash of everything that affects the results.
    pub digest: String,
    /// Files of the resolved case: path in the run folder, and content.
    pub files: Vec<(String, Arc<Vec<u8>>)>,
}

/// Options of a run.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Treatment of an existing run in the folder.
    pub existing: Existing,
    /// Command line, for the provenance.
    pub command: Vec<String>,
    /// Number of threads, for the provenance; the caller configures the thread pool.
    pub threads: usize,
    /// Checkpoint that a new run starts from; none for a start at t = 0. The case is valid for it
    /// ([`Case::check_parent`](crate::case::Case::check_parent)).
    pub parent: Option<Parent>,
    /// Name of the program that steps the simulation and may control its grains; none for a run of
    /// the case alone.
    pub controlled_from: Option<String>,
}
