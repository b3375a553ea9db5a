//! Motion of the grains (Eqs 19-37): contact dynamics of all grains. A step is taken at once, or as
//! a trial step that is accepted or repeated with the response of the fluid
//! (`docs/decisions/0014-contact-with-the-fluid-response.md`).
//!
//! `substeps.rs` has the contact sub-steps, `contact_body.rs` the state of one grain in them,
//! `new_bodies.rs` that of new grains, `integrator.rs` and `rotation.rs` its motion,
//! `checkpoint.rs` the stored state.

mod checkpoint;
mod contact_body;
mod integrator;
mod new_bodies;
pub mod rotation;
mod substeps;

pub use contact_body::GrainResponse;
use integrator::move_at_constant_acceleration;

use glam::{DVec3, IVec3};

use super::contact::{Contact, ContactModel, ContactParams, ContactRecord};
use super::enclosure::{Enclosure, Partner};
use super::grain::Grain;
use super::search::{BoundingSphere, BroadPhase};
use crate::math::{Load, Pose, RigidVelocity};
use contact_body::ContactBody;

/// Contact model, contact history and integrator of all grains.
#[derive(Clone, Debug)]
pub struct ContactDynamics {
    model: ContactModel,
    enclosure: Enclosure,
    contacts: Vec<Contact>,
    /// Sub-steps of the last step.
    substeps: usize,
    /// Pairs that may touch, in ascending key.
    records: Vec<ContactRecord>,
    /// Position of every grain at the end of the last step [m].
    last_positions: Vec<DVec3>,
    bodies: Vec<ContactBody>,
    broad_phase: BroadPhase,
    spheres: Vec<BoundingSphere>,
    before: StateBefore,
}

/// Contact history and poses before the last trial step, in buffers that are kept between steps.
#[derive(Clone, Debug, Default)]
struct StateBefore {
    records: Vec<ContactRecord>,
    last_positions: Vec<DVec3>,
    poses: Vec<Pose>,
}

impl ContactDynamics {
    /// Contact dynamics in `enclosure` of grains that have not touched yet. The grains themselves
    /// are passed to each step.
    pub fn new(params: ContactParams, enclosure: Enclosure) -> ContactDynamics {
        ContactDynamics {
            model: ContactModel::new(params),
            enclosure,
            contacts: Vec::new(),
            substeps: 0,
            records: Vec::new(),
            last_positions: Vec::new(),
            bodies: Vec::new(),
            broad_phase: BroadPhase::default(),
            spheres: Vec::new(),
            before: StateBefore::default(),
        }
    }
    /// Contacts of the last step, ordered by grain, then partner.
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }
    /// Largest overlap at any sub-step of the last step, relative to the smaller equal-volume
    /// diameter of the pair, among the overlaps that `counts` accepts. `None` without contact, and
    /// after [`ContactDynamics::restore`].
    pub fn largest_overlap(
        &self,
        grains: &[Grain],
        counts: impl Fn(&RelativeOverlap) -> bool,
    ) -> Option<RelativeOverlap> {
        let deep = self.records.iter().filter(|record| record.deepest_overlap > 0.0);
        let overlaps = deep.map(|ContactRecord { key, deepest_overlap, .. }| {
            RelativeOverlap::of(grains, key.grain as usize, key.partner, *deepest_overlap)
        });
        overlaps
            .filter(counts)
            .reduce(|most, other| if other.relative > most.relative { other } else { most })
    }
    /// Number of sub-steps of the last step; of a step repeated with the response of the fluid,
    /// those of the repetition.
    pub fn substeps(&self) -> usize {
        self.substeps
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
    /// `mean_contact` receives the impulse of contact and lubrication on each grain over `dt`, as a
    /// mean load. Grains beyond the end of `loads` have none. Positions are not wrapped into the
    /// box; a caller may wrap them between steps.
    pub fn advance(
        &mut self,
        grains: &mut [Grain],
        loads: &[Load],
        dt: f64,
        mean_contact: &mut [Load],
    ) -> usize {
        mean_contact.fill(Load::default());
        self.substeps = 0;
        if dt.is_nan() || dt <= 0.0 {
            return 0;
        }
        self.begin_step(grains, loads, &[]);
        self.integrate(grains, dt);
        for (mean, body) in mean_contact.iter_mut().zip(&self.bodies) {
            *mean = body.mean_contact;
        }
        self.end_step(grains);
        self.substeps
    }

    /// Applies prescribed velocities, updates the contact bodies, and renumbers the periodic image
    /// of a pair if one of its grains was wrapped into the box since the last step.
    fn begin_step(&mut self, grains: &mut [Grain], loads: &[Load], responses: &[GrainResponse]) {
        for grain in grains.iter_mut() {
            grain.velocity = grain.translation.velocity(grain.velocity);
            grain.angular_velocity = grain.rotation.velocity(grain.angular_velocity);
        }
        ContactBody::synchronise(&mut self.bodies, grains);
        for (i, (grain, body)) in grains.iter().zip(&mut self.bodies).enumerate() {
            let load = loads.get(i).copied().unwrap_or_default();
            body.begin_step(grain, load, responses.get(i).copied());
        }
        let (last, enclosure) = (&self.last_positions, &self.enclosure);
        let periods_moved = |i: usize| match (last.get(i), grains.get(i)) {
            (Some(last), Some(grain)) => enclosure.periods(grain.pose.position - *last, f64::round),
            _ => IVec3::ZERO,
        };
        let mut shifted = false;
        for record in &mut self.records {
            record.begin_step();
            if let Partner::Grain(j) = record.key.partner {
                let shift = periods_moved(record.key.grain as usize) - periods_moved(j);
                let image = IVec3::from(record.key.image).wrapping_add(shift);
                record.key.image = image.to_array();
                shifted |= shift != IVec3::ZERO;
            }
        }
        if shifted {
            self.records.sort_by_key(|record| record.key);
        }
    }

    /// Records the positions and the contacts at the end of a step.
    fn end_step(&mut self, grains: &[Grain]) {
        self.last_positions.clear();
        self.last_positions.extend(grains.iter().map(|grain| grain.pose.position));
        self.contacts.clear();
        for record in self.records.iter().filter(|record| record.deepest_overlap > 0.0) {
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

/// Overlap of a pair, also relative to the smaller equivalent diameter of its grains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeOverlap {
    /// First grain.
    pub grain: usize,
    /// Second body.
    pub partner: Partner,
    /// Depth of the overlap [m].
    pub depth: f64,
    /// Depth over the smaller equivalent diameter.
    pub relative: f64,
}

impl RelativeOverlap {
    /// Relates the overlap `depth` [m] of a pair to the diameters of its grains.
    pub fn of(grains: &[Grain], grain: usize, partner: Partner, depth: f64) -> RelativeOverlap {
        let diameter = |index: usize| grains[index].shape.equivalent_diameter();
        let smaller = partner.grain().map_or(f64::INFINITY, diameter).min(diameter(grain));
        RelativeOverlap { grain, partner, depth, relative: depth / smaller }
    }
}

/// Step that [`ContactDynamics::trial_step`] has taken.
///
/// Either [`ContactDynamics::accept`] or [`ContactDynamics::resolve_with_response`] consumes it.
#[must_use = "accept the step or resolve it with the response of the fluid"]
#[derive(Debug)]
pub struct TrialStep {
    dt: f64,
}

impl ContactDynamics {
    /// Takes a step as [`ContactDynamics::advance`] does, and keeps the state from before it.
    pub fn trial_step(
        &mut self,
        grains: &mut [Grain],
        loads: &[Load],
        dt: f64,
        mean_contact: &mut [Load],
    ) -> TrialStep {
        self.before.records.clone_from(&self.records);
        self.before.last_positions.clone_from(&self.last_positions);
        self.before.poses.clear();
        self.before.poses.extend(grains.iter().map(|grain| grain.pose));
        self.advance(grains, loads, dt, mean_contact);
        TrialStep { dt }
    }

    /// Accepts a trial step as it is.
    pub fn accept(&mut self, _trial: TrialStep) {}

    /// Repeats a trial step from its start, with the response of the fluid of this step to contact.
    ///
    /// The grains keep the state of the trial step; `ends` receives the state after the repetition.
    /// A grain on which no contact or lubrication load acts in either pass keeps the pose of the
    /// trial step, or, in the step after a contact, moves at a constant acceleration. On entry
    /// `mean_contact` holds the contact loads of the trial step, on return the loads of the
    /// repetition.
    pub fn resolve_with_response(
        &mut self,
        trial: TrialStep,
        grains: &mut [Grain],
        responses: &[GrainResponse],
        mean_contact: &mut [Load],
        ends: &mut [RigidState],
    ) {
        for (end, grain) in ends.iter_mut().zip(&*grains) {
            *end = RigidState::of(grain);
        }
        self.records.clone_from(&self.before.records);
        self.last_positions.clone_from(&self.before.last_positions);
        let starts = self.before.poses.iter().zip(responses);
        for (grain, (pose, response)) in grains.iter_mut().zip(starts) {
            RigidState { pose: *pose, velocity: response.start }.apply_to(grain);
        }
        // The responses contain all other loads.
        self.begin_step(grains, &[], responses);
        self.integrate(grains, trial.dt);
        for (n, grain) in grains.iter_mut().enumerate() {
            let touched_in_trial = !mean_contact[n].is_zero();
            mean_contact[n] = self.bodies[n].mean_contact;
            if mean_contact[n].is_zero() {
                if let Some(end) = responses[n].end_without_contact {
                    grain.pose = self.before.poses[n];
                    move_at_constant_acceleration(grain, [responses[n].start, end], trial.dt);
                } else if !touched_in_trial {
                    grain.pose = ends[n].pose;
                }
            }
        }
        self.end_step(grains);
        for (grain, end) in grains.iter_mut().zip(ends) {
            let trial_end = std::mem::replace(end, RigidState::of(grain));
            trial_end.apply_to(grain);
        }
    }
}

/// Pose and velocities of a grain.
#[derive(Clone, Copy, Debug)]
pub struct RigidState {
    /// Position and orientation.
    pub pose: Pose,
    /// Velocity and angular velocity, space frame.
    pub velocity: RigidVelocity,
}

impl RigidState {
    /// Present state of a grain.
    pub fn of(grain: &Grain) -> RigidState {
        RigidState { pose: grain.pose, velocity: grain.rigid_velocity() }
    }

    /// Velocity [m/s] of the grain's material point at `x` [m].
    pub fn velocity_at(&self, x: DVec3) -> DVec3 {
        self.velocity.at(x - self.pose.position)
    }

    /// Gives a grain this state.
    pub fn apply_to(&self, grain: &mut Grain) {
        grain.pose = self.pose;
        grain.velocity = self.velocity.linear;
        grain.angular_velocity = self.velocity.angular;
    }
}
