//! What is given by formulas: the velocity at the start, and what changes with time.

use glam::DVec3;

use crate::dem::{Dof, Grain};
use crate::grid::Mesh;
use crate::math::Formula;

/// Formulas of a set-up; where one is given it goes before the constant of the same name.
#[derive(Clone, Debug, Default)]
pub struct Prescription {
    /// Velocity of the fluid at the start [m/s], of x, y, z [m].
    pub initial_velocity: Option<Formula>,
    /// Body acceleration of the fluid [m/s^2], of t [s].
    pub body_acceleration: Option<Formula>,
    /// Motions of grains, of t [s].
    pub motions: Vec<Drive>,
}

/// Motion of one grain.
#[derive(Clone, Debug)]
pub struct Drive {
    /// Number of the grain.
    pub grain: usize,
    /// Velocity [m/s].
    pub velocity: Option<Formula>,
    /// Angular velocity, axes of space [rad/s].
    pub angular_velocity: Option<Formula>,
}

impl Prescription {
    /// Sets the prescribed velocities of `grains` to those of `time` [s].
    pub fn drive(&self, grains: &mut [Grain], time: f64) {
        for drive in &self.motions {
            let grain = &mut grains[drive.grain];
            if let Some(formula) = &drive.velocity {
                grain.velocity = formula.at(&[time]);
                grain.translation = Dof::Prescribed(grain.velocity);
            }
            if let Some(formula) = &drive.angular_velocity {
                grain.angular_velocity = formula.at(&[time]);
                grain.rotation = Dof::Prescribed(grain.angular_velocity);
            }
        }
    }

    /// Largest sum of the absolute components of the velocity at the start [m/s], on some thirty
    /// points along each axis of `mesh`; NaN where a formula is not defined.
    pub fn initial_speed(&self, mesh: &Mesh) -> Option<f64> {
        let formula = self.initial_velocity.as_ref()?;
        let points = |axis: usize| {
            let count = mesh.cells[axis].min(30);
            (0..=count).map(move |i| i as f64 / count as f64)
        };
        let mut largest: f64 = 0.0;
        for z in points(2) {
            for y in points(1) {
                for x in points(0) {
                    let at = mesh.origin + mesh.extent() * DVec3::new(x, y, z);
                    let speed = formula.at(&at.to_array()).abs().element_sum();
                    if !speed.is_finite() {
                        return Some(f64::NAN);
                    }
                    largest = largest.max(speed);
                }
            }
        }
        Some(largest)
    }

    /// Body acceleration of the fluid at `time` [s], where a formula gives it [m/s^2].
    pub fn body_acceleration(&self, time: f64) -> Option<DVec3> {
        let formula = self.body_acceleration.as_ref()?;
        Some(formula.at(&[time]))
    }
}
