//! Contact sub-steps of one step: pair list, number of sub-steps, contact loads and integration.

use glam::{DVec3, IVec3};
use rayon::prelude::*;

use super::ContactDynamics;
use super::contact_body::ContactBody;
use crate::dem::contact::{
    BodyState, ContactParams, ContactRecord, Film, PairKinematics, PairProperties, update_records,
};
use crate::dem::enclosure::{PairKey, Partner, Side};
use crate::dem::grain::{Grain, MotionConstraint};
use crate::dem::search::BoundingSphere;

/// Safety factor on the motion that reduces the known separation of a pair.
const MOTION_MARGIN: f64 = 1.01;

/// Skin of the pair list: displacement that is always allowed before the next search
/// [bounding radii].
const SKIN: f64 = 0.01;
/// Number of pairs below which the evaluation stays on one thread.
const PARALLEL_PAIRS: usize = 16;
/// Largest angle by which a free grain turns in a sub-step [rad]. At 8 cells per diameter the CFL
/// number limits steps with fluid to this angle.
const LARGEST_TURN: f64 = 0.1;
/// Largest number of sub-steps for the spin of grains in a step.
const MAX_TURNS: f64 = 1e3;
/// Largest number of sub-steps in a step; more indicate an error in the input.
const MAX_SUBSTEPS: f64 = 1e7;

impl ContactDynamics {
    /// Integrates poses and velocities over `dt` [s].
    pub(super) fn integrate(&mut self, grains: &mut [Grain], dt: f64) {
        self.search_pairs(grains, dt);
        self.substeps = if self.records.len() < PARALLEL_PAIRS {
            self.run_substeps(grains, dt)
        } else {
            // The thread pool is entered once per step. A caller outside the pool would otherwise
            // wait for a worker thread at every sub-step.
            rayon::scope(|_| self.run_substeps(grains, dt))
        };
    }

    /// Returns the number of sub-steps.
    fn run_substeps(&mut self, grains: &mut [Grain], dt: f64) -> usize {
        let damping = self.model.params.global_damping;
        // The number of sub-steps follows from the overlaps, and the dashpots from the sub-step.
        self.update_kinematics(grains, 0.0);
        self.for_each_record(|contacts, record| contacts.find_points(record, grains));
        let (mut done, mut time_left) = (0, dt);
        let mut substeps_left = self.substeps_for(grains, time_left);
        let stable_step = dt / substeps_left as f64;
        self.for_each_record(|contacts, record| {
            contacts.evaluate_pair(record, grains, [0.0, stable_step]);
        });
        self.sum_loads();
        while substeps_left > 0 {
            let step = time_left / substeps_left as f64;
            let half_mean = 0.5 * step / dt;
            for (grain, body) in grains.iter_mut().zip(&mut self.bodies) {
                body.mean_contact += body.contact * half_mean;
                body.first_half_step(grain, damping, step);
            }
            substeps_left -= 1;
            done += 1;
            time_left -= step;
            if self.pair_list_expired(grains) {
                self.search_pairs(grains, time_left.max(step));
                if substeps_left > 0 {
                    substeps_left = self.substeps_for(grains, time_left);
                }
            }
            self.update_kinematics(grains, step);
            self.for_each_record(|contacts, record| {
                contacts.find_points(record, grains);
                contacts.evaluate_pair(record, grains, [step; 2]);
            });
            self.sum_loads();
            for (grain, body) in grains.iter_mut().zip(&mut self.bodies) {
                body.mean_contact += body.contact * half_mean;
                body.second_half_step(grain, damping, step);
            }
        }
        done
    }

    /// Lists the pairs that may touch within `dt` [s] (Verlet list): a bounding sphere grows by the
    /// displacement of its grain under the present loads, a skin and the range of lubrication.
    fn search_pairs(&mut self, grains: &[Grain], dt: f64) {
        self.spheres.clear();
        for (grain, body) in grains.iter().zip(&mut self.bodies) {
            let load = body.load + body.contact;
            body.own_inverse_mass = grain.inverse_mass(0.0);
            let acceleration = match &body.response {
                Some(response) => response.acceleration(&load)[0].length(),
                None => load.force.length() * body.own_inverse_mass,
            };
            let inverse_mass = match &body.response {
                Some(response) => response.inverse_mass(),
                None => grain.inverse_mass(self.model.params.added_density),
            };
            let turns_only = inverse_mass == 0.0 && grain.rotation == MotionConstraint::Free;
            body.state.properties.inverse_mass =
                if turns_only { inverse_mass_of_turning(grain) } else { inverse_mass };
            body.speed_gain = dt * acceleration;
            let speed = match grain.translation {
                MotionConstraint::Free => grain.velocity.length() + 0.5 * dt * acceleration,
                MotionConstraint::Prescribed(velocity) => velocity.length(),
            };
            let radius = grain.shape.bounding_radius();
            body.search_position = grain.pose.position;
            body.search_margin = speed * dt + SKIN * radius;
            self.spheres.push(BoundingSphere {
                centre: grain.pose.position,
                radius: radius + body.search_margin + self.model.range(),
            });
        }
        self.broad_phase.search(&self.spheres, &self.enclosure);
        update_records(&mut self.records, &self.broad_phase.pairs);
    }

    /// Whether a grain has moved farther than the pair list allows.
    fn pair_list_expired(&self, grains: &[Grain]) -> bool {
        grains.iter().zip(&self.bodies).any(|(grain, body)| {
            let distance = grain.pose.position.distance_squared(body.search_position);
            distance > body.search_margin * body.search_margin
        })
    }

    /// Number of sub-steps for `dt` [s], from the shortest contact time of the listed pairs and the
    /// fastest spin.
    fn substeps_for(&self, grains: &[Grain], dt: f64) -> usize {
        let turning = grains.iter().filter(|grain| grain.rotation == MotionConstraint::Free);
        let fastest = turning.map(|grain| grain.angular_velocity.length()).fold(0.0, f64::max);
        let turns = (fastest * dt / LARGEST_TURN).min(MAX_TURNS);
        let substeps = turns.max(self.contact_substeps(dt)).ceil();
        if substeps.is_nan() { 1 } else { substeps.clamp(1.0, MAX_SUBSTEPS) as usize }
    }

    /// Number of sub-steps for `dt` [s] that the shortest contact time asks for.
    fn contact_substeps(&self, dt: f64) -> f64 {
        let ContactParams { substeps_per_contact, roughness, .. } = self.model.params;
        let (mut shortest, mut fastest, mut film_rate) = (f64::INFINITY, 0.0_f64, 0.0_f64);
        for record in &self.records {
            let (body, partner) = self.bodies_of(&record.key);
            let speed = body.surface_speed_relative_to(partner);
            fastest = fastest.max(speed);
            let other = partner.map_or(&self.model.wall, |partner| &partner.state.properties);
            let pair = PairProperties::new(&body.state.properties, other);
            if pair.inverse_mass > 0.0 {
                // The pair gains speed from the known loads.
                let gain = body.speed_gain + partner.map_or(0.0, |partner| partner.speed_gain);
                let overlap = record.loads.overlap.max(0.0);
                shortest = shortest.min(self.model.law.contact_time(&pair, speed + gain, overlap));
                let closest = record.closest.filter(|_| record.may_interact);
                let film = closest.map_or(f64::INFINITY, |point| roughness.max(-point.overlap));
                let resistance = self.model.film_resistance(&pair, film);
                film_rate = film_rate.max(resistance * pair.inverse_mass);
            }
        }
        let mut longest_step = shortest / substeps_per_contact;
        if self.model.range() > 0.0 && roughness > 0.0 {
            // No pair closes its lubrication film by more than half the height of the asperities,
            // and no film takes more than half of a speed.
            longest_step = longest_step.min(0.5 * roughness / fastest).min(0.5 / film_rate);
        }
        dt / longest_step
    }

    /// First body of a pair, and its partner if that is a grain.
    fn bodies_of(&self, key: &PairKey) -> (&ContactBody, Option<&ContactBody>) {
        (&self.bodies[key.grain as usize], key.partner.grain().map(|j| &self.bodies[j]))
    }

    /// Takes the present poses and velocities of the grains, and clears their contact loads; `step`
    /// [s] is the time since the last evaluation.
    fn update_kinematics(&mut self, grains: &[Grain], step: f64) {
        for (grain, body) in grains.iter().zip(&mut self.bodies) {
            body.update_kinematics(grain, step);
        }
    }

    /// Calls `each` for all pairs. Each pair writes its own record, so results do not depend on the
    /// number of threads.
    fn for_each_record(&mut self, each: impl Fn(&ContactDynamics, &mut ContactRecord) + Sync) {
        let mut records = std::mem::take(&mut self.records);
        if records.len() < PARALLEL_PAIRS {
            records.iter_mut().for_each(|record| each(self, record));
        } else {
            records.par_iter_mut().with_min_len(4).for_each(|record| each(self, record));
        }
        self.records = records;
    }

    /// Sums the loads of all pairs over the grains, in the order of the pairs.
    fn sum_loads(&mut self) {
        for record in &self.records {
            self.bodies[record.key.grain as usize].contact += record.loads.on_grain;
            if let Partner::Grain(j) = record.key.partner {
                self.bodies[j].contact += record.loads.on_partner;
            }
        }
    }

    /// Finds the penetrating points of a pair (Eqs 7 and 8).
    fn find_points(&self, record: &mut ContactRecord, grains: &[Grain]) {
        let (body, partner) = self.bodies_of(&record.key);
        let partner_displacement = partner.map_or(0.0, |partner| partner.displacement);
        record.patch.approach(MOTION_MARGIN * (body.displacement + partner_displacement));
        record.may_interact = record.patch.separation <= 0.0;
        if !record.may_interact {
            return;
        }
        let reach = self.model.range();
        let a = body.posed_shape(grains[record.key.grain as usize].pose.position);
        record.closest = match record.key.partner {
            Partner::Grain(j) => {
                let image = IVec3::from(record.key.image).as_dvec3() * self.enclosure.period();
                let b = self.bodies[j].posed_shape(grains[j].pose.position + image);
                record.patch.find_grain_contact(&a, &b, reach)
            }
            Partner::Wall { axis, side } => {
                let face = self.enclosure.plane(axis as usize, side as usize);
                record.patch.find_wall_contact(&a, face.inward, face.distance(a.position), reach)
            }
        };
        let overlaps = record.patch.points.iter().map(|point| point.overlap);
        record.loads.overlap = overlaps.fold(0.0, f64::max);
    }

    /// Evaluates the loads of a pair at the points found (Eqs 9-18). `step` [s] is the time since
    /// the last evaluation, `stable_step` [s] the sub-step in which dashpots must be stable.
    fn evaluate_pair(
        &self,
        record: &mut ContactRecord,
        grains: &[Grain],
        [step, stable_step]: [f64; 2],
    ) {
        if !record.may_interact {
            return;
        }
        let params = &self.model.params;
        let (body, position) = (self.bodies_of(&record.key).0, |i: usize| grains[i].pose.position);
        let (film, friction, other, branch) = match record.key.partner {
            Partner::Grain(j) => {
                let image = IVec3::from(record.key.image).as_dvec3() * self.enclosure.period();
                let branch = position(record.key.grain as usize) - (position(j) + image);
                (Film::BetweenGrains, params.friction, self.bodies[j].state, branch)
            }
            Partner::Wall { axis, side } => {
                let side = self.enclosure.sides[axis as usize][side as usize];
                let (film, friction, velocity) = match side {
                    Side::Wall { velocity } => (Film::AtWall, params.wall_friction, velocity),
                    Side::Open | Side::Frictionless => (Film::AtSlipWall, 0.0, DVec3::ZERO),
                };
                (film, friction, BodyState::translating(self.model.wall, velocity), DVec3::ZERO)
            }
        };
        let pair = PairKinematics { branch, bodies: [body.state, other], film, stable_step };
        self.model.evaluate(record, friction, &pair, step);
        record.deepest_overlap = record.deepest_overlap.max(record.loads.overlap);
    }
}

/// Inverse of the mass that resists a tangential force at the surface of a grain that turns freely
/// about a prescribed centroid [1/kg].
fn inverse_mass_of_turning(grain: &Grain) -> f64 {
    let radius = 0.5 * grain.shape.equivalent_diameter();
    3.0 * radius * radius / grain.principal_inertia().element_sum()
}
