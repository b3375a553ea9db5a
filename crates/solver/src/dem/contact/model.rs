//! Loads of a pair: normal force and friction of its penetrating points (Eqs 9-18), or lubrication
//! across a gap.
//!
//! The energy of the normal force is a function of one effective overlap D of the pair, a smooth
//! mean of the overlaps d_i of its penetrating points with areas a_i, so that the contact conserves
//! energy:
//!
//! ```text
//! w_i = a_i d_i^p / sum_j a_j d_j^p      weights
//! D   = sum_i w_i d_i                    effective overlap
//! F_i = -F(D) dD/dd_i grad d_i           force at point i
//! ```
//!
//! A single point receives Eq. 9. Dashpot and friction are shared by the weights. Friction is an
//! incremental spring with Coulomb's bound (Eqs 12-15).

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};

use super::law::{BodyProperties, ContactLaw, PairProperties};
use super::parameters::ContactParams;
use super::{ContactRecord, PairLoads, TangentialHistory};
use crate::dem::search::ContactPoint;
use crate::math::{Load, RigidVelocity};

/// Exponent p of the overlaps in the weights of a patch. A larger one brings D closer to the
/// deepest overlap and makes a flat patch stiffer against tilting, which needs shorter sub-steps.
const EXPONENT: i32 = 8;
/// Effective overlap of a patch, and means over its points with the weights w_i.
#[derive(Clone, Copy, Debug, Default)]
struct PatchMean {
    /// Deepest overlap [m].
    overlap: f64,
    /// Effective overlap D [m].
    effective_overlap: f64,
    /// Sum of a_i r_i^p, where r_i is d_i over the deepest overlap [node areas].
    total: f64,
    /// Effective overlap gained per distance that the patch moves inwards.
    gain: f64,
    /// Mean of the unit normals; shorter than one if they differ.
    normal: DVec3,
    /// Mean lever arm [m].
    lever_arm: DVec3,
    /// Closing speed along the normals [m/s].
    approach: f64,
}

impl PatchMean {
    fn of(points: &[ContactPoint], pair: &PairKinematics) -> Option<PatchMean> {
        let overlap = points.iter().map(|p| p.overlap).fold(0.0, f64::max);
        if overlap <= 0.0 || points.iter().all(|p| p.area <= 0.0) {
            return None;
        }
        let mut mean = PatchMean { overlap, ..Default::default() };
        for point in points {
            let weight = point.area * (point.overlap / overlap).powi(EXPONENT);
            mean.total += weight;
            mean.effective_overlap += weight * point.overlap;
            mean.normal += weight * point.normal;
            mean.lever_arm += weight * point.lever_arm;
            let velocity = pair.relative_velocity(point.lever_arm, |v| v.end);
            mean.approach += weight * velocity.dot(point.normal);
        }
        let scale = 1.0 / mean.total;
        mean.effective_overlap *= scale;
        mean.normal *= scale;
        mean.lever_arm *= scale;
        mean.approach *= scale;
        mean.gain = points.iter().map(|p| p.slope * mean.weight_and_derivative(p).1).sum();
        Some(mean)
    }

    /// Weight w_i of a point and dD/dd_i.
    fn weight_and_derivative(&self, point: &ContactPoint) -> (f64, f64) {
        let ratio = point.overlap / self.overlap;
        let p = f64::from(EXPONENT);
        let slope = point.area / self.total * ratio.powi(EXPONENT - 1);
        let derivative = slope * ((p + 1.0) * ratio - p * self.effective_overlap / self.overlap);
        (slope * ratio, derivative)
    }
}

/// Contact model: the force law, Coulomb friction and lubrication.
#[derive(Clone, Debug)]
pub(in crate::dem) struct ContactModel {
    pub params: ContactParams,
    /// Force law.
    pub law: Arc<dyn ContactLaw>,
    /// Properties of the walls.
    pub wall: BodyProperties,
}

impl ContactModel {
    /// Model with these parameters.
    pub fn new(params: ContactParams) -> ContactModel {
        ContactModel { params, law: params.force_law(), wall: params.wall() }
    }

    /// Largest gap at which a pair interacts [m], by lubrication; zero without it.
    pub fn range(&self) -> f64 {
        if self.params.lubrication_viscosity > 0.0 { self.params.lubrication_gap } else { 0.0 }
    }

    /// Evaluates the loads of a pair with the coefficient `friction` at the end of a sub-step of
    /// `step` [s] into `record.loads` and advances the friction history; a step of zero evaluates
    /// the present state.
    pub fn evaluate(
        &self,
        record: &mut ContactRecord,
        friction: f64,
        pair: &PairKinematics,
        step: f64,
    ) {
        let [a, b] = &pair.bodies;
        let properties = PairProperties::new(&a.properties, &b.properties);
        let Some(mean) = PatchMean::of(&record.patch.points, pair) else {
            record.end_contact();
            if let Some(closest) = record.closest {
                record.loads = self.lubrication(&closest, &properties, pair);
            }
            return;
        };
        let at = self.law.coefficients(&properties, mean.effective_overlap);
        let time_in_contact = begin_or_continue(record, &mean, step);
        // A patch of many points is softer than the spring of its law.
        let damping = record.dashpot_fraction * at.normal_damping * mean.gain.clamp(0.0, 1.0);
        // The tangential force stays as it is when the stiffness grows (loading), and shrinks with
        // the stiffness when it falls (unloading); otherwise a closed cycle could create energy
        // (Thornton, Cummins & Cleary 2013).
        let (before, now) = (record.tangential_stiffness, at.tangential_stiffness);
        let friction = FrictionStep {
            coefficient: friction,
            stiffness: at.tangential_stiffness,
            history_scale: if now > before && before > 0.0 { before / now } else { 1.0 },
            damping: damping * at.tangential_damping_ratio,
            time_in_contact,
            step,
        };
        // Elastic force of the whole pair.
        let elastic_force = (at.normal_force * mean.gain).max(0.0);
        let normal = mean.normal.normalize_or(record.patch.points[0].normal);
        let mut loads = PairLoads {
            overlap: mean.overlap,
            lever_arm: mean.lever_arm,
            normal,
            elastic_energy: at.normal_energy,
            ..Default::default()
        };
        let (mut mean_displacement, mut known) = (DVec3::ZERO, 0);
        record.next_history.clear();
        for point in &record.patch.points {
            let (share, derivative) = mean.weight_and_derivative(point);
            // The local closing speed also damps rocking on a flat face.
            let approach = pair.relative_velocity(point.lever_arm, |v| v.end).dot(point.normal);
            let damping = pair.stable_damping(damping, point.lever_arm, point.normal);
            let normal_force = self.law.normal_force(elastic_force, damping, approach);
            let dashpot = share * (normal_force - elastic_force);
            let mut force = -(at.normal_force * derivative * point.slope + dashpot) * point.normal;
            if friction.stiffness > 0.0 && friction.coefficient > 0.0 {
                while record.history.get(known).is_some_and(|h| h.id < point.id) {
                    known += 1;
                }
                let own = record.history.get(known).filter(|h| h.id == point.id);
                let history = own.or(record.in_contact.then_some(&record.mean_history));
                let (tangential_force, displacement) =
                    friction.tangential_force(point, normal_force, history, pair);
                force += share * tangential_force;
                mean_displacement += share * rotate_tangential(displacement, point.normal, normal);
                loads.elastic_energy +=
                    0.5 * share * friction.stiffness * displacement.length_squared();
                let entry = TangentialHistory { id: point.id, normal: point.normal, displacement };
                record.next_history.push(entry);
            }
            let [on_grain, on_partner] = pair.loads(force, point.lever_arm);
            loads.on_grain += on_grain;
            loads.on_partner += on_partner;
        }
        std::mem::swap(&mut record.history, &mut record.next_history);
        record.mean_history = TangentialHistory { id: 0, normal, displacement: mean_displacement };
        record.loads = loads;
        record.tangential_stiffness = at.tangential_stiffness;
        record.in_contact = true;
    }
}

/// Updates the dashpot fraction and returns the part of the sub-step in contact [s].
///
/// A new contact begins inside the sub-step. Its dashpot force does not start from zero, so only
/// the part of the sub-step in contact counts.
fn begin_or_continue(record: &mut ContactRecord, mean: &PatchMean, step: f64) -> f64 {
    if !record.in_contact && step > 0.0 && mean.approach > 0.0 {
        let time_in_contact = step.min(mean.overlap / mean.approach);
        record.dashpot_fraction = 0.5 + time_in_contact / step;
        return time_in_contact;
    }
    // A second evaluation at the same time and an overlap from the start keep the fraction.
    if step > 0.0 && record.in_contact {
        record.dashpot_fraction = 1.0;
    }
    step
}

/// Velocities of a body in a sub-step, space frame.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::dem) struct SubstepVelocity {
    /// v^(n+1/2) and omega^(n+1/2), for the displacement increment (Eqs 12-13).
    pub middle: RigidVelocity,
    /// v^(n+1) and omega^(n+1), predicted with the load at n, for the dashpots.
    pub end: RigidVelocity,
}

/// Properties, velocities and rotational inertia of a body in a sub-step.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct BodyState {
    /// Mass, radius and elastic constants.
    pub properties: BodyProperties,
    /// Velocities, space frame.
    pub velocity: SubstepVelocity,
    /// Rotation from the body frame to the space frame.
    pub rotation: DMat3,
    /// Principal moments of inertia [kg m^2]; infinite where the rotation is prescribed.
    pub moments: DVec3,
}

impl BodyState {
    /// Body that translates at `velocity` [m/s] and cannot rotate, such as a wall.
    pub fn translating(properties: BodyProperties, velocity: DVec3) -> BodyState {
        let velocity = RigidVelocity { linear: velocity, angular: DVec3::ZERO };
        let velocity = SubstepVelocity { middle: velocity, end: velocity };
        BodyState { properties, velocity, rotation: DMat3::IDENTITY, moments: DVec3::INFINITY }
    }

    /// Velocity along `direction` per impulse along it, at a point with this lever arm [1/kg].
    fn mobility(&self, lever_arm: DVec3, direction: DVec3) -> f64 {
        let torque = self.rotation.transpose() * lever_arm.cross(direction);
        self.properties.inverse_mass + torque.dot(torque / self.moments)
    }
}

/// Surfaces between which a lubrication film lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::dem) enum Film {
    BetweenGrains,
    AtWall,
    AtSlipWall,
}

/// Relative position and states of the two bodies of a pair, space frame.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct PairKinematics {
    /// Branch vector from the centroid of the partner (its image) to that of the first grain [m].
    pub branch: DVec3,
    /// First grain and its partner.
    pub bodies: [BodyState; 2],
    /// Surfaces of the lubrication film.
    pub film: Film,
    /// Sub-step in which dashpots must be stable [s].
    pub stable_step: f64,
}

impl PairKinematics {
    /// Velocity of the first body relative to the second at a point (Eq. 12) [m/s]; `of` selects
    /// the middle or the end of the sub-step.
    pub(super) fn relative_velocity(
        &self,
        lever_arm: DVec3,
        of: impl Fn(&SubstepVelocity) -> RigidVelocity,
    ) -> DVec3 {
        let [a, b] = &self.bodies;
        of(&a.velocity).at(lever_arm) - of(&b.velocity).at(lever_arm + self.branch)
    }

    /// Loads on both bodies of a force [N] on the first one at a point.
    pub(super) fn loads(&self, force: DVec3, lever_arm: DVec3) -> [Load; 2] {
        let on_partner = Load { force: -force, torque: -(lever_arm + self.branch).cross(force) };
        [Load { force, torque: lever_arm.cross(force) }, on_partner]
    }

    /// Limits the coefficient of a dashpot [N s/m] that acts along the unit vector `direction` at a
    /// point: within a sub-step, an explicit dashpot must not reverse the velocity of the point,
    /// which follows a force at the edge of a flat grain more easily than the centroid.
    pub(super) fn stable_damping(&self, damping: f64, lever_arm: DVec3, direction: DVec3) -> f64 {
        if damping == 0.0 {
            return 0.0;
        }
        let ([a, b], step) = (&self.bodies, self.stable_step);
        let mobility =
            a.mobility(lever_arm, direction) + b.mobility(lever_arm + self.branch, direction);
        if step * mobility * damping > 0.5 { 0.5 / (step * mobility) } else { damping }
    }
}

/// Quantities of one sub-step that the friction of all points of a patch shares.
#[derive(Clone, Copy, Debug)]
struct FrictionStep {
    /// Friction coefficient mu.
    coefficient: f64,
    /// Tangential stiffness k_zeta [N/m].
    stiffness: f64,
    /// Factor on earlier displacements after a change of the stiffness.
    history_scale: f64,
    /// Tangential dashpot [N s/m].
    damping: f64,
    /// Part of the sub-step in contact [s].
    time_in_contact: f64,
    /// Sub-step [s].
    step: f64,
}

impl FrictionStep {
    /// Tangential force [N] on the first grain as if this point carried the whole pair, and the
    /// tangential displacement [m] (Eqs 13-15).
    ///
    /// Coulomb's bound and the stiffness scale alike with the share of the point in the pair, so
    /// the bound on the displacement does not depend on the share.
    fn tangential_force(
        &self,
        point: &ContactPoint,
        normal_force: f64,
        history: Option<&TangentialHistory>,
        pair: &PairKinematics,
    ) -> (DVec3, DVec3) {
        let tangential = |v: DVec3| v - v.dot(point.normal) * point.normal;
        let earlier = history.map_or(DVec3::ZERO, |history| {
            // The spring turns with the mean spin of the pair about the normal.
            let [a, b] = &pair.bodies;
            let spin = a.velocity.middle.angular + b.velocity.middle.angular;
            let twist = 0.5 * self.step * spin.dot(point.normal);
            let displacement = self.history_scale * history.displacement;
            DQuat::from_axis_angle(point.normal, twist)
                * rotate_tangential(displacement, history.normal, point.normal)
        });
        // Eq. 13 with the relative velocity of Eq. 12 at the middle of the sub-step.
        let velocity = pair.relative_velocity(point.lever_arm, |v| v.middle);
        let displacement = earlier + self.time_in_contact * tangential(velocity);
        let sliding = tangential(pair.relative_velocity(point.lever_arm, |v| v.end));
        let direction = sliding.normalize_or_zero();
        let viscous = pair.stable_damping(self.damping, point.lever_arm, direction) * sliding;
        let force = -(self.stiffness * displacement + viscous);
        // Coulomb's bound (Eq. 15); an attractive normal force carries no friction.
        let limit = self.coefficient * normal_force.max(0.0);
        if force.length_squared() <= limit * limit {
            return (force, displacement);
        }
        let force = force * (limit / force.length());
        let displacement = -(force + viscous) / self.stiffness;
        // A dashpot that reaches the bound alone must not wind the spring backwards: the friction
        // would lag behind a normal force that grows.
        (force, if displacement.dot(force) > 0.0 { DVec3::ZERO } else { displacement })
    }
}

/// Rotates `v` by the smallest rotation from the normal `from` to the normal `to` (R of Eq. 14) and
/// removes the component along `to`.
fn rotate_tangential(v: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    let rotated = DQuat::from_rotation_arc(from, to) * v;
    rotated - rotated.dot(to) * to
}
