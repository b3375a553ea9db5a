//! Initial velocity of the fluid in and next to the grains.

use super::forcing::sum_impulse;
use super::grains::ImmersedGrains;
use super::kinematics::RigidVelocity;
use super::update::{GrainUpdate, PendingRigidity};
use crate::dem::Grain;
use crate::flow::{Flow, FlowMeasures};
use crate::math::Real;

impl<R: Real> ImmersedGrains<R> {
    /// Imposes the rigid velocities of the grains on the forced faces and makes the flow
    /// solenoidal.
    pub fn initialise(&mut self, flow: &mut Flow<R>, grains: &[Grain]) -> FlowMeasures {
        flow.predicted.copy_from(&flow.velocity);
        // In the limit of a long step every forced face takes the rigid velocity.
        self.locate_with_forcing(grains, f64::MAX.sqrt());
        let (known, predictions) = flow.prediction();
        let (rest, density) = (RigidVelocity::default(), self.fluid_density);
        let mut updates = std::mem::take(&mut self.updates);
        updates.clear();
        for (immersed, grain) in self.grains.iter_mut().zip(grains) {
            let forced = &mut immersed.forced;
            sum_impulse(&known, &predictions, density, forced, [rest; 2], 0.0);
            let velocity = RigidVelocity::of(grain);
            updates.push(GrainUpdate {
                pending: Some(PendingRigidity {
                    velocity,
                    // The change has a weight only if the pressure gradient is removed, in a step.
                    change: RigidVelocity::default(),
                }),
                ..Default::default()
            });
        }
        self.impose_pending(flow, &updates);
        self.updates = updates;
        self.release_forcing();
        flow.velocity.copy_from(&flow.predicted);
        flow.make_solenoidal()
    }
}
