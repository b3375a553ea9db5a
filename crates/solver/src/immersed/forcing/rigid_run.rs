//! Rigid velocity along a run of faces, and the weight of its change.

use glam::DVec3;

use crate::immersed::kinematics::RigidVelocity;
use grainwake_simd::Vector;

/// Rigid velocity V + Omega x r along a run of faces: linear in the index of the face.
#[derive(Clone, Copy)]
pub struct RigidRun {
    /// Velocity at the first face [m/s].
    first: DVec3,
    /// Change from a face to the next [m/s].
    change: DVec3,
}

impl RigidRun {
    /// Velocity along the run of faces that begins at `lever_arm` from the centroid [m].
    #[inline(always)]
    pub fn new(velocity: RigidVelocity, lever_arm: DVec3, spacing: DVec3) -> RigidRun {
        RigidRun {
            first: velocity.at(lever_arm),
            change: velocity.angular.cross(DVec3::X * spacing.x),
        }
    }
    /// Velocity along a parallel line, on which the velocity differs by `offset` [m/s].
    #[inline(always)]
    pub fn shifted(self, offset: DVec3) -> RigidRun {
        RigidRun { first: self.first + offset, ..self }
    }
    /// Component `axis` of the velocity at the faces `index` of the run [m/s].
    #[inline(always)]
    pub fn component<V: Vector<Number = f64>>(&self, axis: usize, index: V) -> V {
        let [first, change] = [self.first, self.change].map(|u| V::constant(u[axis]));
        index.mul_add(change, first)
    }
}

/// Indices of the faces in the lanes of a register that begins at face `n` of a run.
#[inline(always)]
pub fn lane_indices<V: Vector<Number = f64>>(n: usize) -> V {
    V::constant(n as f64) + V::ramp()
}

/// Weight f = (1 - s) phi of the change U - U_old of the rigid velocity, with the weight s of the
/// velocity and the solid fraction phi.
#[inline(always)]
pub fn change_weight<V: Vector<Number = f64>>(weight: V, solid_fraction: V) -> V {
    (V::constant(1.0) - weight) * solid_fraction
}
