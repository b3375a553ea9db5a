//! Trial step of the contact sub-steps, and its repetition with the response of the fluid
//! (`docs/decisions/0014-contact-with-the-fluid-response.md`).

use super::dynamics::ContactDynamics;
use super::response::GrainResponse;
use super::state_before::{RigidState, StateBefore, TrialEnd};
use crate::dem::grain::Grain;
use crate::math::Load;

/// Step that [`ContactDynamics::trial_step`] has taken, with the state from before it.
///
/// Either [`ContactDynamics::accept`] or [`ContactDynamics::resolve_with_response`] consumes it.
#[must_use = "accept the step or resolve it with the response of the fluid"]
#[derive(Debug)]
pub struct TrialStep {
    dt: f64,
    before: StateBefore,
}

impl ContactDynamics {
    /// Takes a step as [`ContactDynamics::advance`] does, and keeps the state from before it.
    pub fn trial_step(
        &mut self,
        grains: &mut [Grain],
        loads: &[Load],
        dt: f64,
        mean_contact: &mut [Load],
    ) -> TrialStep {
        // The buffers return with the accepted or resolved step.
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
        responses: &[GrainResponse],
        mean_contact: &mut [Load],
        ends: &mut [RigidState],
    ) {
        let TrialStep { dt, mut before } = trial;
        before.trial_ends.clear();
        let trial_ends = grains.iter().zip(&*mean_contact);
        (before.trial_ends).extend(trial_ends.map(|(grain, load)| TrialEnd {
            state: RigidState::of(grain),
            touched: !load.is_zero(),
        }));
        mean_contact.fill(Load::default());
        self.records.clone_from(&before.records);
        self.last_positions.clone_from(&before.last_positions);
        let starts = before.poses.iter().zip(responses);
        for (grain, (pose, response)) in grains.iter_mut().zip(starts) {
            let [velocity, angular_velocity] = response.start;
            (grain.pose, grain.velocity, grain.angular_velocity) =
                (*pose, velocity, angular_velocity);
        }
        self.begin_step(grains);
        for (body, response) in self.bodies.iter_mut().zip(responses) {
            body.response = Some(*response);
        }
        self.integrate(grains, &[], dt, mean_contact);
        for (n, grain) in grains.iter_mut().enumerate() {
            let trial_end = &before.trial_ends[n];
            if !trial_end.touched && mean_contact[n].is_zero() {
                grain.pose = trial_end.state.pose;
            }
            ends[n] = RigidState::of(grain);
        }
        self.end_step(grains);
        for (grain, trial_end) in grains.iter_mut().zip(&before.trial_ends) {
            trial_end.state.apply_to(grain);
        }
        self.state_before = before;
    }
}
