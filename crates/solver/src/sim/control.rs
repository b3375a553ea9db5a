//! Control of grains between steps: velocities, prescribed motion and external loads.
//!
//! Control is not part of the saved state: [`Simulation::restore`] returns to the control of the
//! set-up, and prescribed motions and external loads have to be set again.

use glam::DVec3;

use super::setup::LIGHTEST_FREE_GRAIN;
use super::{PrescribedMotion, Setup, Simulation};
use crate::dem::{Grain, MotionConstraint};
use crate::math::Load;

/// Reason why a grain cannot be controlled.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum ControlError {
    /// There is no grain with this index.
    #[error("there is no grain {grain}: the simulation has {count} grains, counted from 0")]
    NoGrain {
        /// Index.
        grain: usize,
        /// Number of grains.
        count: usize,
    },
    /// The grain has left the box.
    #[error("grain {grain} has left the box")]
    HasLeft {
        /// Index of the grain.
        grain: usize,
    },
    /// A component is not a finite number.
    #[error("the {quantity} of grain {grain} is not finite")]
    NotFinite {
        /// Index of the grain.
        grain: usize,
        /// "velocity", "angular velocity", "external load".
        quantity: &'static str,
    },
    /// The velocity is prescribed, so that a present velocity would have no effect.
    #[error(
        "the {quantity} of grain {grain} is prescribed; release the grain first, or prescribe another one"
    )]
    Prescribed {
        /// Index of the grain.
        grain: usize,
        /// "velocity", "angular velocity".
        quantity: &'static str,
    },
    /// The velocity leads out of the plane of a flow that has one cell along an axis.
    #[error(
        "the {quantity} of grain {grain} leads out of the plane of the flow, which has one cell along {}",
        ["x", "y", "z"][*normal]
    )]
    OutOfPlane {
        /// Index of the grain.
        grain: usize,
        /// "velocity", "angular velocity".
        quantity: &'static str,
        /// Axis of one cell.
        normal: usize,
    },
    /// A grain so light would become unstable if it moved freely.
    #[error(
        "grain {grain} is lighter than {LIGHTEST_FREE_GRAIN} times the fluid and would become unstable; keep its velocity prescribed"
    )]
    TooLight {
        /// Index of the grain.
        grain: usize,
    },
}

/// Control at the start of a run, in force again in a simulation that is restored.
pub(super) struct InitialControl {
    /// Constraints of translation and rotation of each grain.
    constraints: Vec<[MotionConstraint; 2]>,
    motions: Vec<PrescribedMotion>,
}

impl InitialControl {
    pub fn of(setup: &Setup) -> InitialControl {
        let constraints = setup.grains.iter().map(|grain| [grain.translation, grain.rotation]);
        InitialControl {
            constraints: constraints.collect(),
            motions: setup.prescription.motions.clone(),
        }
    }
    pub fn apply(&self, setup: &mut Setup) {
        for (grain, constraints) in setup.grains.iter_mut().zip(&self.constraints) {
            [grain.translation, grain.rotation] = *constraints;
        }
        setup.prescription.motions.clone_from(&self.motions);
    }
}

/// Component of the motion of a grain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotionComponent {
    /// Velocity of the centroid [m/s].
    Translation,
    /// Angular velocity, space frame [rad/s].
    Rotation,
}

impl MotionComponent {
    fn quantity(self) -> &'static str {
        match self {
            MotionComponent::Translation => "velocity",
            MotionComponent::Rotation => "angular velocity",
        }
    }
    /// Constraint and present velocity of a grain.
    fn of(self, grain: &mut Grain) -> (&mut MotionConstraint, &mut DVec3) {
        match self {
            MotionComponent::Translation => (&mut grain.translation, &mut grain.velocity),
            MotionComponent::Rotation => (&mut grain.rotation, &mut grain.angular_velocity),
        }
    }
}

impl Simulation {
    /// Sets the present velocity of a free grain: [m/s] or [rad/s], space frame. The grain gets the
    /// momentum of the change, and shares it with its added mass in the next step, as after a blow.
    ///
    /// # Errors
    /// [`ControlError`] for a grain that is unknown or has left, or a velocity that is not finite,
    /// prescribed, or out of the plane of a flat flow.
    pub fn set_velocity(
        &mut self,
        grain: usize,
        component: MotionComponent,
        velocity: DVec3,
    ) -> Result<(), ControlError> {
        let quantity = component.quantity();
        self.check_control(grain, velocity.is_finite(), quantity)?;
        if *component.of(&mut self.setup.grains[grain]).0 != MotionConstraint::Free {
            return Err(ControlError::Prescribed { grain, quantity });
        }
        let in_plane = |normal: &usize| match component {
            MotionComponent::Translation => velocity[*normal] == 0.0,
            MotionComponent::Rotation => velocity == velocity.project_onto(DVec3::AXES[*normal]),
        };
        if let Some(normal) = self.setup.flat_axis().filter(|normal| !in_plane(normal)) {
            return Err(ControlError::OutOfPlane { grain, quantity, normal });
        }
        self.replace_velocity(grain, component, velocity);
        Ok(())
    }

    /// Replaces a velocity. The added mass takes up no part of the new one.
    fn replace_velocity(&mut self, grain: usize, component: MotionComponent, velocity: DVec3) {
        *component.of(&mut self.setup.grains[grain]).1 = velocity;
        let pending = &mut self.data.previous[grain].pending_added_mass_velocity;
        match component {
            MotionComponent::Translation => pending.linear = DVec3::ZERO,
            MotionComponent::Rotation => pending.angular = DVec3::ZERO,
        }
    }

    /// Prescribes a velocity from now on: [m/s] or [rad/s], space frame. A formula of the set-up
    /// for this motion is removed.
    ///
    /// # Errors
    /// [`ControlError`] for a grain that is unknown or has left, or a velocity that is not finite.
    pub fn prescribe_velocity(
        &mut self,
        grain: usize,
        component: MotionComponent,
        velocity: DVec3,
    ) -> Result<(), ControlError> {
        self.check_control(grain, velocity.is_finite(), component.quantity())?;
        self.remove_formula(grain, component);
        let (constraint, _) = component.of(&mut self.setup.grains[grain]);
        *constraint = MotionConstraint::Prescribed(velocity);
        self.replace_velocity(grain, component, velocity);
        Ok(())
    }

    /// Lets a motion follow Newton's or Euler's equation from now on, starting from the present
    /// velocity. A formula of the set-up for this motion is removed.
    ///
    /// # Errors
    /// [`ControlError`] for a grain that is unknown, has left or is too light to translate freely.
    pub fn release(
        &mut self,
        grain: usize,
        component: MotionComponent,
    ) -> Result<(), ControlError> {
        self.check_control(grain, true, component.quantity())?;
        let is_translation = component == MotionComponent::Translation;
        if is_translation && self.setup.is_too_light(&self.setup.grains[grain]) {
            return Err(ControlError::TooLight { grain });
        }
        self.remove_formula(grain, component);
        *component.of(&mut self.setup.grains[grain]).0 = MotionConstraint::Free;
        Ok(())
    }

    /// Sets the external load on a grain, which acts in every step until it is replaced: force [N]
    /// and torque about the centroid [N m], space frame. Weight, buoyancy, contact and fluid act
    /// besides. In a fluid the next step is so short that the change of the load moves the surface
    /// of the grain by at most the CFL number.
    ///
    /// # Errors
    /// [`ControlError`] for a grain that is unknown or has left, or a load that is not finite.
    pub fn set_external_load(&mut self, grain: usize, load: Load) -> Result<(), ControlError> {
        let finite = load.force.is_finite() && load.torque.is_finite();
        self.check_control(grain, finite, "external load")?;
        let change = load + std::mem::replace(&mut self.data.external[grain], load) * -1.0;
        let grain = &self.setup.grains[grain];
        let lever_arm = grain.shape.bounding_radius() / grain.principal_inertia().min_element();
        let acceleration =
            change.force.length() / grain.mass() + lever_arm * change.torque.length();
        if self.fluid.is_some() {
            let longest = self.setup.longest_step_from_rest(acceleration);
            self.clock.longest_next = self.clock.longest_next.min(longest);
        }
        Ok(())
    }

    fn check_control(
        &self,
        grain: usize,
        finite: bool,
        quantity: &'static str,
    ) -> Result<(), ControlError> {
        let count = self.setup.grains.len();
        if grain >= count {
            return Err(ControlError::NoGrain { grain, count });
        }
        if self.setup.grains[grain].has_left() {
            return Err(ControlError::HasLeft { grain });
        }
        if finite { Ok(()) } else { Err(ControlError::NotFinite { grain, quantity }) }
    }

    fn remove_formula(&mut self, grain: usize, component: MotionComponent) {
        for motion in self.setup.prescription.motions.iter_mut().filter(|m| m.grain == grain) {
            match component {
                MotionComponent::Translation => motion.velocity = None,
                MotionComponent::Rotation => motion.angular_velocity = None,
            }
        }
    }
}
