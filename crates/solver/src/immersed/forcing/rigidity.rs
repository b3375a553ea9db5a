//! Rigid velocity imposed on the forced faces (Eqs 4b, 4c).
//!
//! A face gains r + s U + f (U - U_old). `immersed::reference` has the scalar form.
//!
//! Legend: r gain next to a grain at rest, U and U_old new and old rigid velocity, s and f weights
//! of the velocity and of its change ([`super::impulse`]).

use glam::DVec3;

use super::faces::ForcedFaces;
use super::rigid_run::{RigidRun, change_weight, lane_indices};
use crate::flow::Prediction;
use crate::immersed::kinematics::RigidVelocity;
use crate::math::Real;
use grainwake_simd::{Kernel, Vector, dispatch};

/// Adds the gain of the forced faces to component `axis` of a part of the prediction, for a grain
/// with the new `velocity` that changed by `change` in the step. [`super::sum_impulse`] has filled
/// the lists of `forced`.
pub fn impose_rigidity<R: Real>(
    axis: usize,
    spacing: DVec3,
    forced: &ForcedFaces,
    velocity: RigidVelocity,
    change: RigidVelocity,
    prediction: &mut Prediction<R>,
) {
    dispatch(ImposeRigidity { axis, spacing, forced, velocity, change, prediction });
}

struct ImposeRigidity<'a, 'b, R> {
    axis: usize,
    spacing: DVec3,
    forced: &'a ForcedFaces,
    velocity: RigidVelocity,
    change: RigidVelocity,
    prediction: &'a mut Prediction<'b, R>,
}

impl<R: Real> Kernel for ImposeRigidity<'_, '_, R> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let (axis, forced) = (self.axis, self.forced);
        let part = self.prediction.range().clone();
        let runs = forced.runs[axis].iter();
        for run in runs.filter(|run| part.contains(&run.at)) {
            let velocity = RigidRun::new(self.velocity, run.lever_arm, self.spacing);
            let change = RigidRun::new(self.change, run.lever_arm, self.spacing);
            let predicted = self.prediction.velocity_mut(run.at, run.count);
            for n in (0..run.count).step_by(V::WIDTH) {
                let entry = run.first + n;
                let weight = V::load_from(&forced.weight[entry..]);
                let solid_fraction = V::load_from(&forced.solid_fraction[entry..]);
                let index = lane_indices(n);
                let gain = V::load(&forced.rest_gain[entry..])
                    + weight * velocity.component(axis, index)
                    + change_weight(weight, solid_fraction) * change.component(axis, index);
                gain.add_partial(&mut predicted[n..]);
            }
        }
    }
}
