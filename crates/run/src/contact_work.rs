//! Contact sub-steps and contact pairs of a run.

use serde::{Deserialize, Serialize};

use grainwake_formats::summary::{PairCounts, SubstepCounts};
use grainwake_solver::sim::Simulation;

/// Sub-steps and pairs so far. Part of the checkpoint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactWork {
    steps: u64,
    substeps: u64,
    largest_substeps: u64,
    /// Sum of the touching pairs over all steps.
    pairs: u64,
    largest_pairs: u64,
}

impl ContactWork {
    /// Adds the last step.
    pub fn add(&mut self, sim: &Simulation) {
        let (substeps, pairs) = (sim.substeps() as u64, sim.contacts().len() as u64);
        self.steps += 1;
        self.substeps += substeps;
        self.largest_substeps = self.largest_substeps.max(substeps);
        self.pairs += pairs;
        self.largest_pairs = self.largest_pairs.max(pairs);
    }

    /// Returns the number of sub-steps.
    pub fn substeps(&self) -> SubstepCounts {
        SubstepCounts { total: self.substeps, largest_per_step: self.largest_substeps }
    }

    /// Returns the number of touching pairs per step.
    pub fn pairs(&self) -> PairCounts {
        let mean = if self.steps > 0 { self.pairs as f64 / self.steps as f64 } else { 0.0 };
        PairCounts { mean, largest: self.largest_pairs }
    }
}
