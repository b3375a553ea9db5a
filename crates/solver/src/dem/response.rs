//! How a grain answers contact while a fluid holds it.

use glam::DVec3;

use crate::math::{Load, Matrix6, Vector6};

/// Change of a grain's velocities by what acts on it, over one step.
#[derive(Clone, Copy, Debug)]
pub struct Response {
    /// Velocity [m/s] and angular velocity [rad/s] that it starts from, space frame.
    pub(super) start: [DVec3; 2],
    /// Acceleration without contact [m/s^2] and angular acceleration [rad/s^2], space frame.
    free: [DVec3; 2],
    /// One over mass and inertia, those of the fluid it moves included, by columns: what a unit force
    /// along x, ... a unit torque about z give.
    inverse: Matrix6,
}

impl Response {
    /// From the loads that act all the time [N] and [N m], and the columns of the inverse of the 6 x 6 mass.
    pub fn new(start: [DVec3; 2], drive: Vector6, inverse: Matrix6) -> Response {
        let mut response = Response {
            start,
            free: Default::default(),
            inverse,
        };
        response.free = response.to(&Load {
            force: DVec3::from_slice(&drive[..3]),
            torque: DVec3::from_slice(&drive[3..]),
        });
        response
    }

    /// Acceleration [m/s^2] and angular acceleration [rad/s^2] under a contact load.
    pub(super) fn to(&self, contact: &Load) -> [DVec3; 2] {
        let mut sum = self.free;
        let loads = [contact.force, contact.torque];
        for (n, column) in self.inverse.iter().enumerate() {
            let load = loads[n / 3][n % 3];
            sum[0] += load * DVec3::from_slice(&column[..3]);
            sum[1] += load * DVec3::from_slice(&column[3..]);
        }
        sum
    }

    /// One over the mass that resists a force of any direction, in the mean [1/kg].
    pub(super) fn inverse_mass(&self) -> f64 {
        (self.inverse[0][0] + self.inverse[1][1] + self.inverse[2][2]) / 3.0
    }
}
