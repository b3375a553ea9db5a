//! Trial step of the contact sub-steps, and its repetition with the response of the fluid
//! (`docs/decisions/0014-contact-with-the-fluid-response.md`).

use glam::DVec3;

use super::dynamics::Dynamics;
use super::response::Response;
use crate::dem::contact::ContactRecord;
use crate::dem::grain::Grain;
use crate::math::{Load, Pose};

/// Pose and velocities of a grain.
#[derive(Clone, Copy, Debug)]
pub struct RigidState {
    /// Position and orientation.
    pub pose: Pose,
    /// Velocity [m/s] and angular velocity [rad/s], space frame.
    pub velocities: [DVec3; 2],
}

impl RigidState {
    /// Present state of a grain.
    pub fn of(grain: &Grain) -> RigidState {
        RigidState {
            pose: grain.pose,
            velocities: [grain.velocity, grain.angular_velocity],
        }
    }

    fn apply_to(&self, grain: &mut Grain) {
        grain.pose = self.pose;
        [grain.velocity, grain.angular_velocity] = self.velocities;
    }
}

/// Step that [`Dynamics::trial_step`] has taken, with the state from before it.
///
/// Either [`Dynamics::accept`] or [`Dynamics::resolve_with_response`] consumes it.
#[must_use = "accept the step or resolve it with the response of the fluid"]
#[derive(Debug)]
pub struct TrialStep {
    dt: f64,
    before: StateBefore,
}

/// Contact history and poses before a step.
#[derive(Clone, Debug, Default)]
pub(super) struct StateBefore {
    records: Vec<ContactRecord>,
    last_positions: Vec<DVec3>,
    poses: Vec<Pose>,
}

impl Dynamics {
    /// Takes a step as [`Dynamics::advance`] does, and keeps the state from before it.
    pub fn trial_step(
        &mut self,
        grains: &mut [Grain],
        loads: &[Load],
        dt: f64,
        mean_contact: &mut [Load],
    ) -> TrialStep {
        // The buffers return with the accepted or resolved step: no allocation after the first.
        let mut before = std::mem::take(&mut self.state_before);
        before.records.clone_from(&self.records);
        before.last_positions.clone_from(&self.last_positions);
        before.poses.clear();
        before.poses.extend(grains.iter().map(|grain| grain.pose));
        self.advance(grains, loads, dt, mean_contact);
        TrialStep { dt, before }
    }

    /// Accepts a trial step as it is.
    pub fn accept(&mut self, trial: TrialStep) {
        self.state_before = trial.before;
    }

    /// Repeats a trial step from its start, with the response of the fluid of this step to contact.
    ///
    /// The grains keep the state of the trial step; `ends` receives the state after the repetition.
    /// A grain without contact keeps the pose of the trial step. On entry `mean_contact` holds the
    /// contact loads of the trial step, on return the loads of the repetition.
    pub fn resolve_with_response(
        &mut self,
        trial: TrialStep,
        grains: &mut [Grain],
        responses: &[Response],
        mean_contact: &mut [Load],
        ends: &mut [RigidState],
    ) {
        let TrialStep { dt, before } = trial;
        let touches = |load: &Load| *load != Load::default();
        let trial_states = grains.iter().zip(&*mean_contact);
        let trial_states: Vec<_> = trial_states
            .map(|(grain, load)| (RigidState::of(grain), touches(load)))
            .collect();
        mean_contact.fill(Load::default());
        self.records.clone_from(&before.records);
        self.last_positions.clone_from(&before.last_positions);
        let starts = before.poses.iter().zip(responses);
        for (grain, (pose, response)) in grains.iter_mut().zip(starts) {
            let [velocity, angular_velocity] = response.start;
            (grain.pose, grain.velocity, grain.angular_velocity) =
                (*pose, velocity, angular_velocity);
        }
        self.state_before = before;
        self.begin_step(grains);
        for (body, response) in self.bodies.iter_mut().zip(responses) {
            body.response = Some(*response);
        }
        self.integrate(grains, &[], dt, mean_contact);
        for (n, grain) in grains.iter_mut().enumerate() {
            let (state, touched) = &trial_states[n];
            if !(*touched || touches(&mean_contact[n])) {
                grain.pose = state.pose;
            }
            ends[n] = RigidState::of(grain);
        }
        self.end_step(grains);
        for (grain, (state, _)) in grains.iter_mut().zip(&trial_states) {
            state.apply_to(grain);
        }
    }
}
