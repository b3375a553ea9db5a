//! CFL numbers, and detection of failed steps: states that are not finite, unstable flow, soft
//! contacts.

use super::Simulation;
use super::failure::{Remedy, StepError};
use crate::dem::{Grain, MotionConstraint, RelativeOverlap};
use crate::immersed::OpenSides;

/// CFL number above which a step counts as unstable.
const MAX_CFL: f64 = 10.0;
/// Largest sum of |u_a| next to a sphere set in motion at once, over that of the sphere: 1.6 with 8
/// cells across.
const FLUID_BESIDE: f64 = 1.6;

impl Simulation {
    /// CFL number of the last step; zero without fluid.
    pub fn cfl(&self) -> f64 {
        self.fluid.as_ref().map_or(0.0, |fluid| fluid.measures().max_rate * self.clock.last_step)
    }
    /// max(sum |u_a| / h_a) [1/s] that the fluid will have next to grains whose velocities were set
    /// or prescribed since the last step.
    pub(super) fn rate_of_set_velocities(&self) -> f64 {
        let set = self.setup.grains.iter().zip(&self.data.previous).filter(|(grain, previous)| {
            !grain.has_left() && grain.rigid_velocity() != previous.velocity
        });
        let rate = |(grain, _): (&Grain, _)| {
            let rotation = grain.angular_velocity.length() * grain.shape.bounding_radius();
            (FLUID_BESIDE * grain.velocity.abs() + rotation).dot(self.clock.per_spacing)
        };
        set.map(rate).fold(0.0, f64::max)
    }
    /// Checks that the state is finite, the overlaps are within their limit, the CFL number is
    /// below its bound, and no grain of a run with a refined box reaches a free surface.
    pub(super) fn check_stability(&self) -> Result<(), StepError> {
        let unstable = |what: String, remedy: Remedy| {
            Err(StepError { time: self.clock.time, step: self.clock.steps, what, remedy })
        };
        for (i, grain) in self.setup.grains.iter().enumerate() {
            let finite = (grain.pose.position.is_finite() || grain.has_left())
                && grain.velocity.is_finite()
                && grain.angular_velocity.is_finite()
                && grain.pose.orientation.is_finite();
            if !finite {
                let what = format!("the motion of grain {i} is not finite");
                return unstable(what, Remedy::StepOrContact);
            }
        }
        // No contact resists a prescribed motion, so a pair without a free grain does not count.
        let grains = &self.setup.grains;
        let is_free = |grain: usize| grains[grain].translation == MotionConstraint::Free;
        let counts =
            |it: &RelativeOverlap| is_free(it.grain) || it.partner.grain().is_some_and(is_free);
        let overlap = self.data.dynamics.largest_overlap(grains, counts);
        if let Some(overlap) = overlap.filter(|it| it.relative > self.setup.contact.overlap_limit) {
            let (what, remedy) = self.describe_overlap(overlap);
            return unstable(what, remedy);
        }
        let emerged = self.data.open_sides.as_ref().and_then(OpenSides::emerged);
        if let Some(grain) = emerged.filter(|_| self.setup.refinement > 1) {
            let what =
                format!("grain {grain} reaches the free surface, where the grid cannot be refined");
            return unstable(what, Remedy::Unrefined);
        }
        if let Some(fluid) = &self.fluid {
            let measures = fluid.measures();
            let cfl = self.cfl();
            let what =
                if !(measures.kinetic_energy.is_finite() && measures.max_divergence.is_finite()) {
                    "the velocity is not finite".to_owned()
                } else if cfl > MAX_CFL {
                    format!("the CFL number jumped to {cfl:.1}")
                } else {
                    return Ok(());
                };
            let (what, remedy) = self.with_cause(what, Remedy::StepOrGrid);
            return unstable(what, remedy);
        }
        Ok(())
    }
}
