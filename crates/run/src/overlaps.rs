//! Overlaps of the contacts of a run, relative to the smaller equivalent diameter of each pair.

use serde::{Deserialize, Serialize};

use grainwake_solver::dem::RelativeOverlap;
use grainwake_solver::sim::Simulation;

/// Overlaps so far. Part of the checkpoint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Overlaps {
    /// Largest overlap of the run.
    pub largest: f64,
    /// Largest overlap since the last row of the tables.
    pub largest_since_row: f64,
    /// Mean overlap of the contacts of the last step.
    pub mean_now: f64,
    /// Sum of the overlaps of all contacts after every step.
    sum: f64,
    /// Number of overlaps in `sum`.
    count: u64,
}

impl Overlaps {
    /// Adds the contacts of the last step.
    pub fn add(&mut self, sim: &Simulation) {
        let deepest = sim.largest_overlap().map_or(0.0, |overlap| overlap.relative);
        self.largest = self.largest.max(deepest);
        self.largest_since_row = self.largest_since_row.max(deepest);
        let touching = sim.contacts().iter().filter(|contact| contact.overlap > 0.0);
        let (mut sum, mut count) = (0.0, 0);
        for contact in touching {
            let (grain, partner) = (contact.grain, contact.partner);
            sum += RelativeOverlap::of(sim.grains(), grain, partner, contact.overlap).relative;
            count += 1;
        }
        self.mean_now = if count > 0 { sum / count as f64 } else { 0.0 };
        (self.sum, self.count) = (self.sum + sum, self.count + count);
    }

    /// Returns the mean over all contacts and steps; zero without contact.
    pub fn mean(&self) -> f64 {
        if self.count > 0 { self.sum / self.count as f64 } else { 0.0 }
    }
}
