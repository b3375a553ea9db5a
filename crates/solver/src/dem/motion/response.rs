//! Response of a grain to contact, with the fluid of the same step.

use glam::DVec3;

use crate::math::{Load, Matrix6, Vector6};

/// Acceleration of a grain in a fluid as an affine function of the contact load, over one step.
#[derive(Clone, Copy, Debug)]
pub struct GrainResponse {
    /// Velocity [m/s] and angular velocity [rad/s] at the start, space frame.
    pub(super) start: [DVec3; 2],
    /// Acceleration [m/s^2] and angular acceleration [rad/s^2] without contact, space frame.
    free: [DVec3; 2],
    /// Columns of the inverse 6 x 6 mass of grain and entrained fluid: accelerations under a unit
    /// force along x, y, z and a unit torque about x, y, z.
    inverse: Matrix6,
}

impl GrainResponse {
    /// Response from the velocities at the start, the loads without contact [N] and [N m], and the
    /// columns of the inverse 6 x 6 mass.
    pub fn new(start: [DVec3; 2], load: Vector6, inverse: Matrix6) -> GrainResponse {
        let mut response = GrainResponse { start, free: Default::default(), inverse };
        response.free = response.acceleration(&Load {
            force: DVec3::from_slice(&load[..3]),
            torque: DVec3::from_slice(&load[3..]),
        });
        response
    }

    /// Acceleration [m/s^2] and angular acceleration [rad/s^2] under a contact load.
    pub(super) fn acceleration(&self, contact: &Load) -> [DVec3; 2] {
        let mut sum = self.free;
        let loads = [contact.force, contact.torque];
        for (n, column) in self.inverse.iter().enumerate() {
            let load = loads[n / 3][n % 3];
            sum[0] += load * DVec3::from_slice(&column[..3]);
            sum[1] += load * DVec3::from_slice(&column[3..]);
        }
        sum
    }

    /// Inverse of the mass against a force, averaged over directions [1/kg].
    pub(super) fn inverse_mass(&self) -> f64 {
        (self.inverse[0][0] + self.inverse[1][1] + self.inverse[2][2]) / 3.0
    }
}
