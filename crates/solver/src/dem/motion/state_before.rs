//! State before a trial step, and the state of each grain after it.

use glam::DVec3;

use crate::dem::contact::ContactRecord;
use crate::dem::grain::Grain;
use crate::math::Pose;

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
        RigidState { pose: grain.pose, velocities: [grain.velocity, grain.angular_velocity] }
    }

    /// Gives a grain this state.
    pub(super) fn apply_to(&self, grain: &mut Grain) {
        grain.pose = self.pose;
        [grain.velocity, grain.angular_velocity] = self.velocities;
    }
}

/// Contact history and poses before a trial step.
///
/// [`super::ContactDynamics`] keeps the buffers between steps.
#[derive(Clone, Debug, Default)]
pub(super) struct StateBefore {
    pub records: Vec<ContactRecord>,
    pub last_positions: Vec<DVec3>,
    pub poses: Vec<Pose>,
    /// End of the trial step; filled while the step is resolved with the response of the fluid.
    pub trial_ends: Vec<TrialEnd>,
}

/// End of a trial step for one grain.
#[derive(Clone, Copy, Debug)]
pub(super) struct TrialEnd {
    pub state: RigidState,
    /// Whether a contact or lubrication load acted on the grain.
    pub touched: bool,
}
