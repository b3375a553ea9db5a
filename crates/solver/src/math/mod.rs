//! Mathematics shared by all layers: poses, loads, dense 6 x 6 systems, prime factors, formulas.

mod cache;
mod formula;
#[cfg(all(target_os = "linux", not(miri)))]
mod pool_clock;
mod precedence;
mod prime;
mod time_spent;

pub(crate) use cache::last_cache;
pub use formula::Formula;
pub(crate) use grainwake_simd::{Aligned, Real};
pub use grainwake_simd::{InstructionSet, Precision, instructions, limit_instructions};
pub use prime::largest_prime_factor;
pub(crate) use time_spent::timed;
pub use time_spent::{Stopwatch, TimeSpent};

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// Position of the centroid and orientation (rotates body vectors into the space frame).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Centroid in the space frame [m].
    pub position: DVec3,
    /// Unit quaternion, body -> space.
    pub orientation: DQuat,
}

impl Pose {
    /// Transforms a point from the space frame to the body frame [m].
    pub fn to_body(&self, x: DVec3) -> DVec3 {
        self.orientation.conjugate() * (x - self.position)
    }
    /// Transforms a point from the body frame to the space frame [m].
    pub fn to_space(&self, x: DVec3) -> DVec3 {
        self.position + self.orientation * x
    }
}

/// A force [N] and a torque about the centroid [N m], both in the space frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Load {
    /// Force [N].
    pub force: DVec3,
    /// Torque about the centroid [N m].
    pub torque: DVec3,
}

impl Load {
    /// Whether force and torque are both zero.
    pub fn is_zero(&self) -> bool {
        *self == Load::default()
    }
}

impl std::ops::Add for Load {
    type Output = Load;
    fn add(self, other: Load) -> Load {
        Load { force: self.force + other.force, torque: self.torque + other.torque }
    }
}
impl std::ops::AddAssign for Load {
    fn add_assign(&mut self, other: Load) {
        *self = *self + other;
    }
}
impl std::ops::Mul<f64> for Load {
    type Output = Load;
    fn mul(self, factor: f64) -> Load {
        Load { force: self.force * factor, torque: self.torque * factor }
    }
}

/// Velocity and angular velocity of a body in the space frame, or a change or rate of change of
/// both.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RigidVelocity {
    /// Velocity of the centroid [m/s].
    pub linear: DVec3,
    /// Angular velocity [rad/s].
    pub angular: DVec3,
}

impl RigidVelocity {
    /// Velocity V + Omega x r [m/s] at the vector `lever_arm` r [m] from the centroid.
    #[inline(always)]
    pub fn at(self, lever_arm: DVec3) -> DVec3 {
        self.linear + self.angular.cross(lever_arm)
    }
    /// Pose of a body after it has moved from `pose` at this constant velocity for `dt` [s].
    pub fn advance(self, pose: Pose, dt: f64) -> Pose {
        let turn = DQuat::from_scaled_axis(dt * self.angular);
        Pose {
            position: pose.position + dt * self.linear,
            orientation: (turn * pose.orientation).normalize(),
        }
    }
    /// Vector (V, Omega) of the six unknowns of the equations of motion.
    pub fn to_vector(self) -> Vector6 {
        let ([a, b, c], [d, e, f]) = (self.linear.to_array(), self.angular.to_array());
        [a, b, c, d, e, f]
    }
    /// Inverse of [`Self::to_vector`].
    pub fn from_vector(x: &Vector6) -> RigidVelocity {
        RigidVelocity { linear: DVec3::from_slice(&x[..3]), angular: DVec3::from_slice(&x[3..]) }
    }
}

impl std::ops::Add for RigidVelocity {
    type Output = RigidVelocity;
    fn add(self, other: RigidVelocity) -> RigidVelocity {
        RigidVelocity { linear: self.linear + other.linear, angular: self.angular + other.angular }
    }
}

impl std::ops::Sub for RigidVelocity {
    type Output = RigidVelocity;
    fn sub(self, other: RigidVelocity) -> RigidVelocity {
        RigidVelocity { linear: self.linear - other.linear, angular: self.angular - other.angular }
    }
}

impl std::ops::Div<f64> for RigidVelocity {
    type Output = RigidVelocity;
    fn div(self, dt: f64) -> RigidVelocity {
        RigidVelocity { linear: self.linear / dt, angular: self.angular / dt }
    }
}

/// Six generalised components: translation, then rotation.
pub type Vector6 = [f64; 6];
/// Row-major 6 x 6 matrix.
pub type Matrix6 = [[f64; 6]; 6];

/// Product of a matrix and a vector.
pub fn multiply6(a: &Matrix6, x: &Vector6) -> Vector6 {
    a.map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>())
}

/// Solves `a x = b` by Gaussian elimination with partial pivoting; `None` if singular.
pub fn solve6(mut a: Matrix6, mut b: Vector6) -> Option<Vector6> {
    for column in 0..6 {
        let pivot =
            (column..6).max_by(|&i, &j| a[i][column].abs().total_cmp(&a[j][column].abs()))?;
        if a[pivot][column] == 0.0 || !a[pivot][column].is_finite() {
            return None;
        }
        a.swap(column, pivot);
        b.swap(column, pivot);
        for row in column + 1..6 {
            let factor = a[row][column] / a[column][column];
            for k in column..6 {
                a[row][k] -= factor * a[column][k];
            }
            b[row] -= factor * b[column];
        }
    }
    for row in (0..6).rev() {
        let known: f64 = (row + 1..6).map(|k| a[row][k] * b[k]).sum();
        b[row] = (b[row] - known) / a[row][row];
    }
    Some(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_system_with_a_zero_on_the_diagonal() {
        let mut a = [[0.0; 6]; 6];
        for (i, row) in a.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                *value = ((3 * i + 5 * j) % 7) as f64 - 2.5;
            }
        }
        a[0][0] = 0.0;
        let x = [1.0, -2.0, 3.0, 0.5, -0.25, 4.0];
        let b = a.map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum());
        let found = solve6(a, b).unwrap();
        for (found, x) in found.iter().zip(x) {
            assert!((found - x).abs() < 1e-12, "{found} {x}");
        }
        assert_eq!(solve6([[0.0; 6]; 6], b), None);
    }
}
