//! Loads of a pair from its penetrating points (Eqs 9-18).
//!
//! The force law acts on the deepest overlap of the pair. Its force is distributed over the
//! penetrating points in proportion to area times overlap, so that the stiffness does not depend on
//! the number of nodes; a single point receives Eq. 9.

use glam::DVec3;

use super::friction::{FrictionStep, rotate_tangential};
use super::kinematics::{PairKinematics, relative_velocity};
use super::law::{ContactCoefficients, ContactLaw, PairProperties};
use super::lubrication::{lubrication, range};
use super::params::ContactParams;
use super::record::{ContactRecord, PairLoads, TangentialHistory};
use super::selected::SelectedLaw;
use crate::dem::search::{ClosestPoint, ContactPoint};
use crate::math::Load;

/// Averages over a contact patch, weighted with area times overlap.
#[derive(Clone, Copy, Debug)]
struct PatchMean {
    /// Deepest overlap [m].
    overlap: f64,
    /// Sum of area times overlap [m^3].
    total: f64,
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
        let total: f64 = points.iter().map(|p| p.area * p.overlap).sum();
        if overlap <= 0.0 || total <= 0.0 {
            return None;
        }
        let mut mean = PatchMean {
            overlap,
            total,
            normal: DVec3::ZERO,
            lever_arm: DVec3::ZERO,
            approach: 0.0,
        };
        for point in points {
            let share = point.area * point.overlap / total;
            let velocity = relative_velocity(&pair.end_of_step, point, pair.branch);
            mean.normal += share * point.normal;
            mean.lever_arm += share * point.lever_arm;
            mean.approach += share * velocity.dot(point.normal);
        }
        Some(mean)
    }
}

/// Contact model: the force law, Coulomb friction and lubrication.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct ContactModel {
    /// Parameters.
    pub params: ContactParams,
    law: SelectedLaw,
}

impl ContactModel {
    /// Model with these parameters.
    pub fn new(params: ContactParams) -> ContactModel {
        ContactModel { params, law: SelectedLaw::new(&params) }
    }

    /// Largest gap at which a pair interacts [m].
    pub fn range(&self) -> f64 {
        range(&self.params)
    }

    /// Duration of an undamped contact [s] that is closing at `speed` [m/s] at `overlap` [m].
    pub fn contact_time(&self, pair: &PairProperties, speed: f64, overlap: f64) -> f64 {
        self.law.contact_time(pair, speed, overlap)
    }

    /// Evaluates the loads of a pair at the end of a sub-step of `step` [s] into `record.loads` and
    /// advances the friction history; a step of zero evaluates the present state.
    pub fn evaluate(
        &self,
        record: &mut ContactRecord,
        closest: Option<ClosestPoint>,
        properties: &PairProperties,
        pair: &PairKinematics,
        step: f64,
    ) {
        let Some(mean) = PatchMean::of(&record.patch.points, pair) else {
            record.end_contact();
            if let Some(closest) = closest {
                record.loads = lubrication(&self.params, &closest, properties, pair, step);
            }
            return;
        };
        let at = self.law.coefficients(properties, mean.overlap);
        let time_in_contact = begin_or_continue(record, &mean, step);
        let damping = record.dashpot_fraction * at.normal_damping;
        let friction = FrictionStep {
            coefficient: if properties.partner_is_wall {
                self.params.wall_friction
            } else {
                self.params.friction
            },
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
        // The normals of a patch hardly differ. On opposite flanks they may cancel; the length of
        // their mean then bounds the amplification of the remaining force.
        let scale = 1.0 / mean.normal.length().max(0.9);
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
            let share = point.area * point.overlap / mean.total;
            // The local closing speed also damps rocking on a flat face.
            let approach =
                relative_velocity(&pair.end_of_step, point, pair.branch).dot(point.normal);
            let normal_force = self.law.normal_force(at, damping, approach);
            let mut force = -(normal_force * share * scale) * point.normal;
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
