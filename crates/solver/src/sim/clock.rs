//! Time, step count and the choice of the time step.

use super::{Setup, StepRule};

/// Where the simulation is in time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    /// Simulated time [s].
    pub time: f64,
    /// Steps taken.
    pub steps: u64,
    /// Length of the last step [s]; zero before the first.
    pub last_step: f64,
    rule: StepRule,
    /// nu * sum 1/h_a^2 over the resolved axes [1/s]; zero without fluid.
    viscous_rate: f64,
    /// First step from rest: gravity moves a grain by `cfl` cells in it at most [s].
    first_step: f64,
}

/// A step grows by this factor at most, which keeps the extrapolation in time tame.
const LARGEST_GROWTH: f64 = 1.2;

impl Clock {
    /// At t = 0.
    pub fn new(setup: &Setup) -> Clock {
        let mesh = &setup.mesh;
        let resolved = (0..3).filter(|&axis| mesh.cells[axis] > 1);
        let inverse_squares: f64 = resolved
            .clone()
            .map(|axis| mesh.spacing[axis].powi(-2))
            .sum();
        let smallest = resolved
            .map(|axis| mesh.spacing[axis])
            .fold(f64::INFINITY, f64::min);
        let fluid_density = setup.fluid.map_or(0.0, |fluid| fluid.density);
        let pull = setup
            .grains
            .iter()
            .map(|grain| setup.gravity.length() * (1.0 - fluid_density / grain.density).abs())
            .chain(setup.fluid.map(|fluid| fluid.body_acceleration.length()))
            .fold(0.0, f64::max);
        let first_step = match setup.step {
            StepRule::Limits { cfl, .. } if pull > 0.0 => (cfl * smallest / pull).sqrt(),
            _ => f64::INFINITY,
        };
        Clock {
            time: 0.0,
            steps: 0,
            last_step: 0.0,
            rule: setup.step,
            viscous_rate: setup
                .fluid
                .map_or(0.0, |fluid| fluid.kinematic_viscosity * inverse_squares),
            first_step,
        }
    }

    /// Next step [s]: by the rule, for a flow that crosses `rate` cells a second, and such that a
    /// whole number of equal steps ends at `limit` [s] from now.
    pub fn choose(&self, rate: f64, limit: f64) -> f64 {
        let wanted = match self.rule {
            StepRule::Fixed(step) => step,
            StepRule::Limits {
                cfl,
                viscous,
                max_step,
            } => {
                let growth = if self.steps == 0 {
                    self.first_step
                } else {
                    LARGEST_GROWTH * self.last_step
                };
                (cfl / rate)
                    .min(viscous / self.viscous_rate)
                    .min(max_step)
                    .min(growth)
            }
        };
        if limit.is_finite() {
            limit / (limit / wanted * (1.0 - 1e-12)).ceil().max(1.0)
        } else {
            wanted
        }
    }

    /// Moves on by `step` [s].
    pub fn advance(&mut self, step: f64) {
        self.time += step;
        self.steps += 1;
        self.last_step = step;
    }
}
