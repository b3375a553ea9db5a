//! Velocities of the two bodies of a pair, and their relative velocity at a contact point.

use glam::DVec3;

use crate::dem::search::ContactPoint;

/// Velocities of a body that give the velocity of a material point.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::dem) struct PointMotion {
    /// Velocity of the centroid [m/s].
    pub linear: DVec3,
    /// Angular velocity [rad/s].
    pub angular: DVec3,
}

impl PointMotion {
    /// Velocity at a lever arm from the centroid [m/s].
    pub fn at(&self, lever_arm: DVec3) -> DVec3 {
        self.linear + self.angular.cross(lever_arm)
    }
}

/// Relative position and velocities of the two bodies of a pair, space frame.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct PairKinematics {
    /// Branch vector from the centroid of the partner (its image) to that of the first grain [m].
    pub branch: DVec3,
    /// Velocities in the middle of the sub-step, for the displacement increment (Eqs 12-13).
    pub mid_step: [PointMotion; 2],
    /// Velocities expected at the end of the sub-step, for the dashpots.
    pub end_of_step: [PointMotion; 2],
}

/// Velocity of the first body relative to the second at a contact point (Eq. 12) [m/s].
pub(super) fn relative_velocity(
    motion: &[PointMotion; 2],
    point: &ContactPoint,
    branch: DVec3,
) -> DVec3 {
    motion[0].at(point.lever_arm) - motion[1].at(point.lever_arm + branch)
}
