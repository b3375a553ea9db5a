//! The coupled simulation: set-up, the time step, the clock and diagnostics.

mod clock;
mod diagnostics;
pub mod events;
mod fluid;
mod prescription;
mod probe;
mod setup;
mod state;
mod step;
#[cfg(test)]
mod tests;

use std::time::Duration;

use crate::dem::{Contact, Dynamics, Grain, State};
use crate::grid::Mesh;
use crate::immersed::Past;
use crate::math::{Load, Pose};
use crate::poisson::Stages;

use fluid::Fluid;

pub use clock::Clock;
pub use diagnostics::Diagnostics;
pub use prescription::{Drive, Prescription};
pub use setup::{Setup, SetupError, StepRule};
pub use step::StepError;

/// A running simulation.
pub struct Simulation {
    setup: Setup,
    clock: Clock,
    fluid: Option<Box<dyn Fluid>>,
    dynamics: Dynamics,
    /// Hydrodynamic load on each grain over the last step.
    loads: Vec<Load>,
    /// Momentum of the fluid that the last step cannot account for [kg m/s].
    momentum_residual: glam::DVec3,
    work: Work,
    passes: Passes,
}

/// Per-grain scratch of a step.
struct Work {
    before: Vec<Past>,
    driving: Vec<Load>,
    contact: Vec<Load>,
    /// Where the sub-steps of contact leave the grains.
    ends: Vec<State>,
    /// Where the faces near the grains were last found.
    located: Vec<Pose>,
}

/// Time spent in each stage since the start.
#[derive(Clone, Copy, Debug, Default)]
struct Passes {
    predict: Duration,
    contact: Duration,
    coupling: Duration,
    project: Duration,
    /// What the Poisson solver had spent before the first step.
    initial: Stages,
}

impl Simulation {
    /// Builds the simulation at t = 0; the fluid next to moving grains starts at their velocity.
    pub fn new(setup: Setup) -> Result<Simulation, SetupError> {
        setup.validate()?;
        let enclosure = setup.enclosure();
        let fluid = setup.fluid.map(|params| fluid::start(&setup, &params));
        let count = setup.grains.len();
        Ok(Simulation {
            dynamics: Dynamics::new(setup.contact, enclosure),
            clock: Clock::new(&setup),
            loads: vec![Load::default(); count],
            momentum_residual: glam::DVec3::ZERO,
            work: Work {
                before: vec![Default::default(); count],
                driving: vec![Load::default(); count],
                contact: vec![Load::default(); count],
                ends: setup.grains.iter().map(State::of).collect(),
                located: setup.grains.iter().map(|grain| grain.pose).collect(),
            },
            passes: Passes {
                initial: fluid
                    .as_ref()
                    .map_or(Stages::default(), |fluid| fluid.poisson_stages()),
                ..Passes::default()
            },
            fluid,
            setup,
        })
    }
    /// Simulated time [s].
    pub fn time(&self) -> f64 {
        self.clock.time
    }
    /// Steps taken.
    pub fn steps(&self) -> u64 {
        self.clock.steps
    }
    /// Length of the last step [s]; zero before the first.
    pub fn time_step(&self) -> f64 {
        self.clock.last_step
    }
    /// The grid.
    pub fn mesh(&self) -> &Mesh {
        &self.setup.mesh
    }
    /// The set-up it was built from (grains as they are now).
    pub fn setup(&self) -> &Setup {
        &self.setup
    }
    /// The grains.
    pub fn grains(&self) -> &[Grain] {
        &self.setup.grains
    }
    /// Hydrodynamic load on each grain over the last step (Eq. 5), buoyancy excluded.
    pub fn loads(&self) -> &[Load] {
        &self.loads
    }
    /// Pairs that touched during the last step.
    pub fn contacts(&self) -> &[Contact] {
        self.dynamics.contacts()
    }
    /// Seconds spent since the start in each pass of the step. The projection is split into the
    /// right-hand side with its transforms, the tridiagonal columns, the transforms back with the
    /// correction, and the ghosts and sums that remain.
    pub fn pass_times(&self) -> [(&'static str, f64); 7] {
        let p = &self.passes;
        let stages = self
            .fluid
            .as_ref()
            .map_or(p.initial, |fluid| fluid.poisson_stages());
        let [forward, columns, inverse] = [
            stages.forward - p.initial.forward,
            stages.columns - p.initial.columns,
            stages.inverse - p.initial.inverse,
        ];
        [
            ("predict", p.predict),
            ("contact", p.contact),
            ("coupling", p.coupling),
            ("divergence", forward),
            ("columns", columns),
            ("correct", inverse),
            (
                "ghosts",
                p.project.saturating_sub(forward + columns + inverse),
            ),
        ]
        .map(|(name, time)| (name, time.as_secs_f64()))
    }
    /// Memory held by fields, solver and grains on the grid [bytes].
    pub fn bytes(&self) -> usize {
        self.fluid.as_ref().map_or(0, |fluid| fluid.bytes())
    }
}
