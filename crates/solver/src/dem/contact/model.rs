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

use super::law::{ContactCoefficients, ContactLaw, PairProperties};
use super::parameters::ContactParams;
use super::{ContactRecord, PairLoads, TangentialHistory};
use crate::dem::search::{ClosestPoint, ContactPoint};
use crate::math::{Load, RigidVelocity};

/// Exponent p of the overlaps in the weights of a patch. A larger one brings D closer to the
/// deepest overlap and makes a flat patch stiffer against tilting, which needs shorter sub-steps.
const EXPONENT: i32 = 8;

/// Effective overlap of a patch, and means over its points with the weights w_i.
#[derive(Clone, Copy, Debug)]
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
        let mut mean = PatchMean {
            overlap,
            effective_overlap: 0.0,
            total: 0.0,
            gain: 0.0,
            normal: DVec3::ZERO,
            lever_arm: DVec3::ZERO,
            approach: 0.0,
        };
        for point in points {
            let weight = point.area * (point.overlap / overlap).powi(EXPONENT);
            let velocity = relative_velocity(&pair.end_of_step, point, pair.branch);
            mean.total += weight;
            mean.effective_overlap += weight * point.overlap;
            mean.normal += weight * point.normal;
            mean.lever_arm += weight * point.lever_arm;
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
    /// Parameters.
    pub params: ContactParams,
    law: Arc<dyn ContactLaw>,
}

impl ContactModel {
    /// Model with these parameters.
    pub fn new(params: ContactParams) -> ContactModel {
        ContactModel { params, law: params.force_law() }
    }

    /// Largest gap at which a pair interacts [m], by lubrication; zero without it.
    pub fn range(&self) -> f64 {
        let ContactParams { lubrication_viscosity, lubrication_gap, .. } = self.params;
        if lubrication_viscosity > 0.0 { lubrication_gap.max(0.0) } else { 0.0 }
    }

    /// Duration of an undamped contact [s] that is closing at `speed` [m/s] at `overlap` [m].
    pub fn contact_time(&self, pair: &PairProperties, speed: f64, overlap: f64) -> f64 {
        self.law.contact_time(pair, speed, overlap)
    }

    /// Evaluates the loads of a pair with the coefficient `friction` at the end of a sub-step of
    /// `step` [s] into `record.loads` and advances the friction history; a step of zero evaluates
    /// the present state.
    pub fn evaluate(
        &self,
        record: &mut ContactRecord,
        closest: Option<ClosestPoint>,
        properties: &PairProperties,
        friction: f64,
        pair: &PairKinematics,
        step: f64,
    ) {
        let Some(mean) = PatchMean::of(&record.patch.points, pair) else {
            record.end_contact();
            if let Some(closest) = closest {
                record.loads = self.lubrication(&closest, properties, pair, step);
            }
            return;
        };
        let at = self.law.coefficients(properties, mean.effective_overlap);
        let time_in_contact = begin_or_continue(record, &mean, step);
        // A patch of many points is softer than the spring of its law.
        let damping = record.dashpot_fraction * at.normal_damping * mean.gain.clamp(0.0, 1.0);
        let friction = FrictionStep {
            coefficient: friction,
            stiffness: at.tangential_stiffness,
            history_scale: history_scale(record.tangential_stiffness, at.tangential_stiffness),
            damping: damping * at.tangential_damping_ratio,
            time_in_contact,
            step,
        };
        self.sum_over_points(record, &mean, &at, damping, &friction, pair);
        record.tangential_stiffness = at.tangential_stiffness;
        record.in_contact = true;
    }

    /// Distributes the pair's force over the penetrating points and sums loads and history.
    fn sum_over_points(
        &self,
        record: &mut ContactRecord,
        mean: &PatchMean,
        at: &ContactCoefficients,
        damping: f64,
        friction: &FrictionStep,
        pair: &PairKinematics,
    ) {
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
            let approach =
                relative_velocity(&pair.end_of_step, point, pair.branch).dot(point.normal);
            let damping =
                pair.stable_damping(damping, point.lever_arm, point.normal, friction.step);
            let normal_force = self.law.normal_force(elastic_force, damping, approach);
            let dashpot_force = share * (normal_force - elastic_force);
            let mut force =
                -(at.normal_force * derivative * point.slope + dashpot_force) * point.normal;
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
                record.next_history.push(TangentialHistory {
                    id: point.id,
                    normal: point.normal,
                    displacement,
                });
            }
            loads.on_grain += Load { force, torque: point.lever_arm.cross(force) };
            loads.on_partner +=
                Load { force: -force, torque: -(point.lever_arm + pair.branch).cross(force) };
        }
        std::mem::swap(&mut record.history, &mut record.next_history);
        record.mean_history = TangentialHistory { id: 0, normal, displacement: mean_displacement };
        record.loads = loads;
    }

    /// Leading-order squeeze-film force between the equal-volume spheres,
    /// 6 pi mu R*^2 v_n (1/h - 1/h_0), with h at least the height of the asperities.
    fn lubrication(
        &self,
        closest: &ClosestPoint,
        properties: &PairProperties,
        pair: &PairKinematics,
        step: f64,
    ) -> PairLoads {
        let (params, range) = (&self.params, self.range());
        if closest.gap.max(0.0) >= range {
            return PairLoads::default();
        }
        let strength = 6.0
            * std::f64::consts::PI
            * params.lubrication_viscosity
            * properties.reduced_radius.powi(2);
        let film = closest.gap.max(params.roughness).min(range);
        let resistance = strength * (1.0 / film - 1.0 / range);
        let resistance = pair.stable_damping(resistance, closest.lever_arm, closest.normal, step);
        let lever_arm_b = closest.lever_arm + pair.branch;
        let [a, b] = &pair.end_of_step;
        let approach = (a.at(closest.lever_arm) - b.at(lever_arm_b)).dot(closest.normal);
        let force = -resistance * approach * closest.normal;
        PairLoads {
            overlap: -closest.gap,
            on_grain: Load { force, torque: closest.lever_arm.cross(force) },
            on_partner: Load { force: -force, torque: -lever_arm_b.cross(force) },
            lever_arm: closest.lever_arm,
            normal: closest.normal,
            elastic_energy: 0.0,
        }
    }
}

/// Updates the dashpot fraction and returns the part of the sub-step in contact [s].
///
/// A new contact begins inside the sub-step. Its dashpot force does not start from zero, so only
/// the part of the sub-step in contact counts.
fn begin_or_continue(record: &mut ContactRecord, mean: &PatchMean, step: f64) -> f64 {
    let begins = !record.in_contact && mean.approach * step > mean.overlap;
    let time_in_contact = if begins { mean.overlap / mean.approach } else { step };
    record.dashpot_fraction = match (begins, step > 0.0 && record.in_contact) {
        (true, _) => 0.5 + time_in_contact / step,
        (false, true) => 1.0,
        // Second evaluation at the same time, or an overlap from the start.
        (false, false) => record.dashpot_fraction,
    };
    time_in_contact
}

/// Factor on the tangential displacement after a change of the tangential stiffness (Thornton,
/// Cummins & Cleary 2013).
///
/// The force stays as it is when the stiffness grows (loading), and shrinks with the stiffness when
/// it falls (unloading); otherwise a closed cycle could create energy.
fn history_scale(before: f64, now: f64) -> f64 {
    if now > before && before > 0.0 { before / now } else { 1.0 }
}

/// Relative position and velocities of the two bodies of a pair, space frame.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct PairKinematics {
    /// Branch vector from the centroid of the partner (its image) to that of the first grain [m].
    pub branch: DVec3,
    /// Velocities in the middle of the sub-step, for the displacement increment (Eqs 12-13).
    pub mid_step: [RigidVelocity; 2],
    /// Velocities expected at the end of the sub-step, for the dashpots.
    pub end_of_step: [RigidVelocity; 2],
    /// Mobilities of both bodies.
    pub mobility: [Mobility; 2],
}

/// Response of a body to an impulse.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct Mobility {
    /// Inverse mass, with added mass [1/kg].
    pub inverse_mass: f64,
    /// Rotation from the body frame to the space frame.
    pub rotation: DMat3,
    /// Principal moments of inertia [kg m^2]; infinite where the rotation is prescribed.
    pub moments: DVec3,
}

impl Mobility {
    /// Mobility of a wall.
    pub const NONE: Mobility =
        Mobility { inverse_mass: 0.0, rotation: DMat3::IDENTITY, moments: DVec3::INFINITY };

    /// Velocity along `direction` per impulse along it, at a point with this lever arm [1/kg].
    fn along(&self, lever_arm: DVec3, direction: DVec3) -> f64 {
        let torque = self.rotation.transpose() * lever_arm.cross(direction);
        self.inverse_mass + torque.dot(torque / self.moments)
    }
}

impl PairKinematics {
    /// Limits the coefficient of a dashpot [N s/m] that acts along the unit vector `direction` at a
    /// point: within a sub-step of `step` [s], an explicit dashpot must not reverse the velocity of
    /// the point, which follows a force at the edge of a flat grain more easily than the centroid.
    fn stable_damping(&self, damping: f64, lever_arm: DVec3, direction: DVec3, step: f64) -> f64 {
        if damping == 0.0 {
            return 0.0;
        }
        let [a, b] = &self.mobility;
        let mobility = a.along(lever_arm, direction) + b.along(lever_arm + self.branch, direction);
        if step * mobility * damping > 0.5 { 0.5 / (step * mobility) } else { damping }
    }
}

/// Velocity of the first body relative to the second at a contact point (Eq. 12) [m/s].
fn relative_velocity(motion: &[RigidVelocity; 2], point: &ContactPoint, branch: DVec3) -> DVec3 {
    motion[0].at(point.lever_arm) - motion[1].at(point.lever_arm + branch)
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
        let sliding = tangential(sliding);
        let direction = sliding.normalize_or_zero();
        let damping = pair.stable_damping(self.damping, point.lever_arm, direction, self.step);
        let viscous = damping * sliding;
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
        let backwards = displacement.dot(force) > 0.0;
        (force, if backwards { DVec3::ZERO } else { displacement })
    }
}

/// Rotates `v` by the smallest rotation from the normal `from` to the normal `to` (R of Eq. 14) and
/// removes the component along `to`.
fn rotate_tangential(v: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    let rotated = DQuat::from_rotation_arc(from, to) * v;
    rotated - rotated.dot(to) * to
}
