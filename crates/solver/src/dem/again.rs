//! The sub-steps of a step taken a second time, with what the fluid answers in that step
//! (`docs/decisions/0014-contact-with-the-fluid-response.md`).

use glam::DVec3;

use super::Dynamics;
use super::grain::Grain;
use super::history::Slot;
use super::response::Response;
use crate::math::{Load, Pose};

/// Where a grain is and how it moves.
#[derive(Clone, Copy, Debug)]
pub struct State {
    /// Position and orientation.
    pub pose: Pose,
    /// Velocity [m/s] and angular velocity [rad/s], space frame.
    pub velocities: [DVec3; 2],
}

impl State {
    /// Of a grain as it is now.
    pub fn of(grain: &Grain) -> State {
        State {
            pose: grain.pose,
            velocities: [grain.velocity, grain.angular_velocity],
        }
    }

    fn give(&self, grain: &mut Grain) {
        grain.pose = self.pose;
        [grain.velocity, grain.angular_velocity] = self.velocities;
    }
}

/// What a step started from.
#[derive(Clone, Debug, Default)]
pub(super) struct Start {
    slots: Vec<Slot>,
    last: Vec<DVec3>,
    poses: Vec<Pose>,
}

impl Dynamics {
    /// Keeps what [`Dynamics::again`] goes back to.
    pub fn remember(&mut self, grains: &[Grain]) {
        self.start.slots.clone_from(&self.slots);
        self.start.last.clone_from(&self.last);
        self.start.poses.clear();
        self.start
            .poses
            .extend(grains.iter().map(|grain| grain.pose));
    }

    /// Takes the step of [`Dynamics::advance`] again from [`Dynamics::remember`] on, with grains that answer
    /// contact by `responses`: with the fluid of the same step in them. The grains stay as they were after the
    /// first time, and `ends` receives how the second one leaves them; one that touches nothing has the
    /// pose of the first. `mean_contact` has the contact of the first on entry and of the second on return.
    pub fn again(
        &mut self,
        grains: &mut [Grain],
        responses: &[Response],
        dt: f64,
        mean_contact: &mut [Load],
        ends: &mut [State],
    ) {
        let touches = |load: &Load| *load != Load::default();
        let first = grains.iter().zip(&*mean_contact);
        let first: Vec<_> = first
            .map(|(grain, load)| (State::of(grain), touches(load)))
            .collect();
        mean_contact.fill(Load::default());
        self.slots.clone_from(&self.start.slots);
        self.last.clone_from(&self.start.last);
        let starts = self.start.poses.iter().zip(responses);
        for (grain, (pose, response)) in grains.iter_mut().zip(starts) {
            let [velocity, angular_velocity] = response.start;
            (grain.pose, grain.velocity, grain.angular_velocity) =
                (*pose, velocity, angular_velocity);
        }
        self.follow(grains);
        for (actor, response) in self.actors.iter_mut().zip(responses) {
            actor.response = Some(*response);
        }
        self.go(grains, &[], dt, mean_contact);
        for (n, grain) in grains.iter_mut().enumerate() {
            let (state, touched) = &first[n];
            if !(*touched || touches(&mean_contact[n])) {
                grain.pose = state.pose;
            }
            ends[n] = State::of(grain);
        }
        self.finish(grains);
        for (grain, (state, _)) in grains.iter_mut().zip(&first) {
            state.give(grain);
        }
    }
}
