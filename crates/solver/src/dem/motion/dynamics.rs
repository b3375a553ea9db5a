//! Contact dynamics of all grains: state, one step, and the contacts that it reports.

use glam::{DVec3, IVec3};

use super::contact_body::ContactBody;
use super::state_before::StateBefore;
use crate::dem::contact::{Contact, ContactMaterial, ContactModel, ContactParams, ContactRecord};
use crate::dem::enclosure::Enclosure;
use crate::dem::grain::{Grain, MotionConstraint};
use crate::dem::search::{BoundingSphere, BroadPhase, Partner};
use crate::math::Load;

/// Contact model, contact history and integrator of all grains.
#[derive(Clone, Debug)]
pub struct ContactDynamics {
    pub(super) model: ContactModel,
    pub(super) wall: ContactMaterial,
    pub(super) enclosure: Enclosure,
    pub(super) contacts: Vec<Contact>,
    /// Pairs that may touch, in ascending key.
    pub(super) records: Vec<ContactRecord>,
    /// Position of every grain at the end of the last step [m].
    pub(super) last_positions: Vec<DVec3>,
    pub(super) bodies: Vec<ContactBody>,
    pub(super) broad_phase: BroadPhase,
    pub(super) spheres: Vec<BoundingSphere>,
    pub(super) old_records: Vec<ContactRecord>,
    pub(super) spare_records: Vec<ContactRecord>,
    pub(super) state_before: StateBefore,
}

impl ContactDynamics {
    /// Contact dynamics in `enclosure` of grains that have not touched yet. The grains themselves
    /// are passed to each step.
    pub fn new(params: ContactParams, enclosure: Enclosure) -> ContactDynamics {
        ContactDynamics {
            model: ContactModel::new(params),
            wall: ContactMaterial::new(&params.wall_material),
            enclosure,
            contacts: Vec::new(),
            records: Vec::new(),
            last_positions: Vec::new(),
            bodies: Vec::new(),
            broad_phase: BroadPhase::default(),
            spheres: Vec::new(),
            old_records: Vec::new(),
            spare_records: Vec::new(),
            state_before: StateBefore::default(),
        }
    }
    /// Contacts of the last step, ordered by grain, then partner.
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }
    /// Contact parameters.
    pub fn params(&self) -> &ContactParams {
        &self.model.params
    }
    /// Box of the grains.
    pub fn enclosure(&self) -> &Enclosure {
        &self.enclosure
    }
    /// Energy of the contact springs at the end of the last step [J].
    pub fn elastic_energy(&self) -> f64 {
        (self.records.iter()).map(|record| record.loads.elastic_energy).sum()
    }

    /// Advances poses and velocities by `dt` [s] in sub-steps under constant `loads` (space frame,
    /// about the centroids) and contact; returns the number of sub-steps.
    ///
    /// `mean_contact` receives the contact impulse on each grain divided by `dt`. A missing load
    /// counts as zero. Positions are not wrapped into the box; a caller may wrap them between
    /// steps.
    pub fn advance(
        &mut self,
        grains: &mut [Grain],
        loads: &[Load],
        dt: f64,
        mean_contact: &mut [Load],
    ) -> usize {
        mean_contact.fill(Load::default());
        if dt.is_nan() || dt <= 0.0 {
            return 0;
        }
        self.begin_step(grains);
        self.bodies.iter_mut().for_each(|body| body.response = None);
        let substeps = self.integrate(grains, loads, dt, mean_contact);
        self.end_step(grains);
        substeps
    }

    /// Applies prescribed velocities, updates the contact bodies, and shifts the images of pairs
    /// whose grains were wrapped by whole periods since the last step.
    pub(super) fn begin_step(&mut self, grains: &mut [Grain]) {
        for grain in grains.iter_mut() {
            if let MotionConstraint::Prescribed(velocity) = grain.translation {
                grain.velocity = velocity;
            }
            if let MotionConstraint::Prescribed(omega) = grain.rotation {
                grain.angular_velocity = omega;
            }
        }
        ContactBody::synchronise(&mut self.bodies, grains);
        let period = self.enclosure.period();
        let periods_moved = |i: usize| -> IVec3 {
            let (Some(last), Some(grain)) = (self.last_positions.get(i), grains.get(i)) else {
                return IVec3::ZERO;
            };
            let displacement = grain.pose.position - *last;
            IVec3::from_array([0, 1, 2].map(|axis| {
                if period[axis] > 0.0 {
                    let periods = (displacement[axis] / period[axis]).round();
                    periods.clamp(-1e6, 1e6) as i32
                } else {
                    0
                }
            }))
        };
        let mut shifted = false;
        for record in &mut self.records {
            record.begin_step();
            if let Partner::Grain(j) = record.key.partner {
                let shift = periods_moved(record.key.grain as usize) - periods_moved(j);
                record.key.image = record.key.image.wrapping_add(shift);
                shifted |= shift != IVec3::ZERO;
            }
        }
        if shifted {
            self.records.sort_by_key(|record| record.key);
        }
    }

    /// Records the positions and the contacts at the end of a step.
    pub(super) fn end_step(&mut self, grains: &[Grain]) {
        self.last_positions.clear();
        self.last_positions.extend(grains.iter().map(|grain| grain.pose.position));
        self.contacts.clear();
        for record in self.records.iter().filter(|r| r.in_contact_during_step) {
            let grain = record.key.grain as usize;
            self.contacts.push(Contact {
                grain,
                partner: record.key.partner,
                overlap: record.loads.overlap.max(0.0),
                load: record.loads.on_grain,
                point: grains[grain].pose.position + record.loads.lever_arm,
                normal: record.loads.normal,
            });
        }
    }
}
