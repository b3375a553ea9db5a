//! Tangential force of a contact point: incremental spring with Coulomb's bound (Eqs 12-15).

use glam::{DQuat, DVec3};

use super::kinematics::{PairKinematics, relative_velocity};
use super::record::TangentialHistory;
use crate::dem::search::ContactPoint;

/// Quantities of one sub-step that the friction of all points of a patch shares.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrictionStep {
    /// Friction coefficient mu.
    pub coefficient: f64,
    /// Tangential stiffness k_zeta [N/m].
    pub stiffness: f64,
    /// Factor on earlier displacements after a change of the stiffness.
    pub history_scale: f64,
    /// Tangential dashpot [N s/m].
    pub damping: f64,
    /// Part of the sub-step in contact [s].
    pub time_in_contact: f64,
    /// Sub-step [s].
    pub step: f64,
}

impl FrictionStep {
    /// Tangential force [N] on the first grain as if this point carried the whole pair, and the
    /// tangential displacement [m] (Eqs 13-15).
    ///
    /// Coulomb's bound and the stiffness scale alike with the share of the point in the pair, so
    /// the bound on the displacement does not depend on the share.
    pub fn tangential_force(
        &self,
        point: &ContactPoint,
        normal_force: f64,
        history: Option<&TangentialHistory>,
        pair: &PairKinematics,
    ) -> (DVec3, DVec3) {
        let tangential = |v: DVec3| v - v.dot(point.normal) * point.normal;
        let earlier = history.map_or(DVec3::ZERO, |history| {
            // The spring turns with the mean spin of the pair about the normal.
            let spin = pair.mid_step[0].angular + pair.mid_step[1].angular;
            let twist = 0.5 * self.step * spin.dot(point.normal);
            let displacement = self.history_scale * history.displacement;
            DQuat::from_axis_angle(point.normal, twist)
                * rotate_tangential(displacement, history.normal, point.normal)
        });
        // Eq. 13 with the relative velocity of Eq. 12 at the middle of the sub-step.
        let velocity = relative_velocity(&pair.mid_step, point, pair.branch);
        let displacement = earlier + self.time_in_contact * tangential(velocity);
        let sliding = relative_velocity(&pair.end_of_step, point, pair.branch);
        let viscous = self.damping * tangential(sliding);
        let force = -(self.stiffness * displacement + viscous);
        // Coulomb's bound (Eq. 15); an attractive normal force carries no friction.
        let limit = self.coefficient * normal_force.max(0.0);
        if force.length_squared() <= limit * limit {
            return (force, displacement);
        }
        let force = force * (limit / force.length());
        (force, -(force + viscous) / self.stiffness)
    }
}

/// Rotates `v` by the smallest rotation from the normal `from` to the normal `to` (R of Eq. 14) and
/// removes the component along `to`.
pub(super) fn rotate_tangential(v: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    let rotated = DQuat::from_rotation_arc(from, to) * v;
    rotated - rotated.dot(to) * to
}
