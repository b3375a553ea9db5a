//! Everything a simulation is built from, validated.

use glam::DVec3;

use crate::coupling::Scheme;
use crate::dem::{ContactParams, Grain};
use crate::flow::{Boundaries, FluidParams};
use crate::grid::Mesh;

/// How the time step is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepRule {
    /// The same step always [s].
    Fixed(f64),
    /// The largest step that keeps both limits.
    Limits {
        /// dt * max(sum |u_a| / h_a) at most this.
        cfl: f64,
        /// nu dt sum 1/h_a^2 at most this.
        viscous: f64,
        /// Never above this [s].
        max_step: f64,
    },
}

/// A validated set-up.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The grid.
    pub mesh: Mesh,
    /// Conditions on the faces of the box.
    pub boundaries: Boundaries,
    /// The fluid; none for a dry run (contact only).
    pub fluid: Option<FluidParams>,
    /// Coupling scheme.
    pub scheme: Scheme,
    /// Gravity [m/s^2].
    pub gravity: DVec3,
    /// The grains at t = 0.
    pub grains: Vec<Grain>,
    /// Contact law.
    pub contact: ContactParams,
    /// Time step.
    pub step: StepRule,
}

/// A set-up that cannot be simulated.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// Some values contradict each other.
    #[error("{0}")]
    Inconsistent(String),
}
