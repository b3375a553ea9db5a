//! Everything a simulation is built from, validated.

use glam::DVec3;

use crate::dem::{ContactParams, Enclosure, Grain};
use crate::flow::{Boundaries, Boundary, FluidParams};
use crate::grid::Mesh;
use crate::immersed::Scheme;
use crate::math::Precision;

use super::Prescription;

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
    /// Numbers that the fields are made of.
    pub precision: Precision,
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
    /// What formulas give.
    pub prescription: Prescription,
}

/// A set-up that cannot be simulated.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// Some values contradict each other.
    #[error("{0}")]
    Inconsistent(String),
}

impl Setup {
    /// The box as the grains see it.
    pub fn enclosure(&self) -> Enclosure {
        Enclosure {
            lower: self.mesh.origin,
            upper: self.mesh.upper(),
            periodic: [0, 1, 2].map(|axis| self.boundaries.is_periodic(axis)),
            solid: self
                .boundaries
                .0
                .map(|sides| sides.map(|boundary| boundary.is_solid())),
        }
    }

    /// Checks what the parts cannot check alone.
    ///
    /// # Errors
    /// [`SetupError::Inconsistent`] with what contradicts what.
    pub fn validate(&self) -> Result<(), SetupError> {
        let fail = |message: String| Err(SetupError::Inconsistent(message));
        let open = |side: &Boundary| matches!(side, Boundary::Outflow);
        let flux = |side: &Boundary| matches!(side, Boundary::Inflow { .. });
        let sides = || self.boundaries.0.iter().flatten();
        for (axis, [lower, upper]) in self.boundaries.0.iter().enumerate() {
            let name = ["x", "y", "z"][axis];
            if (*lower == Boundary::Periodic) != (*upper == Boundary::Periodic) {
                return fail(format!("axis {name} is periodic on one side only"));
            }
            if self.fluid.is_some() && self.mesh.cells[axis] == 1 && *lower != Boundary::Periodic {
                return fail(format!(
                    "axis {name} has one cell, so both its faces must be periodic"
                ));
            }
        }
        if sides().any(flux) && !sides().any(open) {
            return fail(
                "fluid enters the box but no face lets it out: make one face an outflow".into(),
            );
        }
        let bounded = |x: f64| x.is_finite() && x > 0.0;
        if !self.mesh.spacing.to_array().into_iter().all(bounded) || self.mesh.cells.contains(&0) {
            return fail(
                "the grid needs at least one cell of positive size along each axis".into(),
            );
        }
        if self
            .fluid
            .is_some_and(|fluid| !bounded(fluid.density) || !bounded(fluid.kinematic_viscosity))
        {
            return fail("density and viscosity of the fluid must be positive".into());
        }
        if let Some(i) = self.grains.iter().position(|grain| !bounded(grain.density)) {
            return fail(format!("the density of grain {i} must be positive"));
        }
        Ok(())
    }
}
