//! Events and stop condition of a simulation.

use grainwake_formats::events::Event;
use grainwake_formats::summary::EndReason;
use grainwake_solver::dem::{Enclosure, surface_gap};
use grainwake_solver::sim::events::{EventParams, StopWhen, Tracker};
use grainwake_solver::sim::{Setup, Simulation};

use crate::plan::Stop;

/// Watches a simulation step by step for events and for its stop condition.
pub struct Watch {
    enclosure: Enclosure,
    /// Event tracker; its state is part of a checkpoint.
    pub tracker: Tracker,
    stop: Option<Stop>,
    /// Time without contact after which grains are separated [s].
    pub(crate) separation_hold: f64,
}

impl Watch {
    /// Watch of a simulation from its present state on. `start` is its set-up at t = 0: a grain
    /// that has left since no longer moves freely, and must not change the settling direction.
    pub fn new(start: &Setup, sim: &Simulation, stop: Option<Stop>) -> Watch {
        let enclosure = start.enclosure();
        let fluid_density = start.fluid.map_or(0.0, |fluid| fluid.density);
        let params =
            EventParams::for_grains(&start.grains, start.gravity, fluid_density, enclosure);
        let tracker = Tracker::new(params, sim.grains(), pair_gap(sim, &enclosure));
        Watch { enclosure, tracker, stop, separation_hold: params.separation_hold }
    }

    /// Processes the state after a step and returns its events, oldest first.
    pub fn update(&mut self, sim: &Simulation) -> Vec<Event> {
        let gap = pair_gap(sim, &self.enclosure);
        let velocity = |grain| sim.grain_velocity(grain);
        self.tracker.update(sim.time(), sim.grains(), velocity, sim.contacts(), gap)
    }

    /// Returns the stop condition, if it has held for its time.
    pub fn stopped(&self, sim: &Simulation) -> Option<EndReason> {
        let stop = self.stop?;
        let since = self.tracker.holds_since(stop.when, sim.grains())?;
        (sim.time() - since >= stop.hold).then_some(match stop.when {
            StopWhen::Landing => EndReason::Landing,
            StopWhen::Rest => EndReason::Rest,
            StopWhen::Separation => EndReason::Separation,
        })
    }
}

/// Returns the gap between the surfaces of a pair [m].
fn pair_gap(sim: &Simulation, enclosure: &Enclosure) -> Option<f64> {
    match sim.grains() {
        [a, b] if !a.has_left() && !b.has_left() => Some(surface_gap(a, b, enclosure)),
        _ => None,
    }
}
