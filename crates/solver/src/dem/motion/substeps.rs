//! Contact sub-steps of one step: pair list, number of sub-steps, contact loads and integration.

use rayon::prelude::*;

use super::ContactDynamics;
use super::contact_body::{PairContext, evaluate_pair, pair_properties};
use super::integrator::{first_half_step, second_half_step};
use crate::dem::contact::{ContactRecord, update_records};
use crate::dem::enclosure::{PairKey, Partner};
use crate::dem::grain::{Grain, MotionConstraint};
use crate::dem::search::BoundingSphere;
use crate::math::Load;

/// Skin of the pair list: displacement that is always allowed before the next search
/// [bounding radii].
const SKIN: f64 = 0.01;
/// Number of pairs below which the evaluation stays on one thread.
const PARALLEL_PAIRS: usize = 16;
/// Largest number of sub-steps in a step; more indicate an error in the input.
const MAX_SUBSTEPS: f64 = 1e7;

impl ContactDynamics {
    /// Integrates poses and velocities over `dt` [s]; returns the number of sub-steps.
    pub(super) fn integrate(
        &mut self,
        grains: &mut [Grain],
        loads: &[Load],
        dt: f64,
        mean_contact: &mut [Load],
    ) -> usize {
        self.search_pairs(grains, loads, dt);
        if self.records.len() < PARALLEL_PAIRS {
            self.run_substeps(grains, loads, dt, mean_contact)
        } else {
            // The thread pool is entered once per step. A caller outside the pool would otherwise
            // wait for a worker thread at every sub-step.
            rayon::scope(|_| self.run_substeps(grains, loads, dt, mean_contact))
        }
    }

    fn run_substeps(
        &mut self,
        grains: &mut [Grain],
        loads: &[Load],
        dt: f64,
        mean_contact: &mut [Load],
    ) -> usize {
        let load_of = |i: usize| loads.get(i).copied().unwrap_or_default();
        let damping = self.model.params.global_damping;
        self.compute_contacts(grains, 0.0);
        let (mut done, mut time_left) = (0, dt);
        let mut substeps_left = self.substeps_for(time_left);
        while substeps_left > 0 {
            let step = time_left / substeps_left as f64;
            let half_mean = 0.5 * step / dt;
            for (i, (grain, body)) in grains.iter_mut().zip(&mut self.bodies).enumerate() {
                if let Some(mean) = mean_contact.get_mut(i) {
                    *mean += body.contact * half_mean;
                }
                let load = load_of(i) + body.contact;
                body.half_step = first_half_step(grain, &load, body.inertia(), damping, step);
            }
            substeps_left -= 1;
            done += 1;
            time_left -= step;
            if self.pair_list_expired(grains) {
                self.search_pairs(grains, loads, time_left.max(step));
                if substeps_left > 0 {
                    substeps_left = self.substeps_for(time_left);
                }
            }
            self.compute_contacts(grains, step);
            for (i, (grain, body)) in grains.iter_mut().zip(&self.bodies).enumerate() {
                if let Some(mean) = mean_contact.get_mut(i) {
                    *mean += body.contact * half_mean;
                }
                let load = load_of(i) + body.contact;
                let inertia = body.inertia();
                second_half_step(grain, body.half_step.middle, &load, inertia, damping, step);
            }
        }
        done
    }

    /// Lists the pairs that may touch within `dt` [s].
    ///
    /// A bounding sphere grows by the displacement of its grain under the present loads and a skin
    /// (Verlet list).
    fn search_pairs(&mut self, grains: &[Grain], loads: &[Load], dt: f64) {
        self.spheres.clear();
        let reach = 0.5 * self.model.range();
        for (i, (grain, body)) in grains.iter().zip(&mut self.bodies).enumerate() {
            let load = loads.get(i).copied().unwrap_or_default() + body.contact;
            body.own_inverse_mass = grain.inverse_mass(0.0);
            let acceleration = match &body.response {
                Some(response) => response.acceleration(&load)[0].length(),
                None => load.force.length() * body.own_inverse_mass,
            };
            body.inverse_mass = match &body.response {
                Some(response) => response.inverse_mass(),
                None => grain.inverse_mass(self.model.params.added_density),
            };
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
                radius: radius + body.search_margin + reach,
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

    /// Number of sub-steps for `dt` [s], from the shortest contact time of the listed pairs.
    fn substeps_for(&self, dt: f64) -> usize {
        let mut shortest = f64::INFINITY;
        let mut any_movable = false;
        for record in &self.records {
            let pair = pair_properties(&record.key, &self.bodies, &self.wall);
            if pair.inverse_mass > 0.0 {
                let speed = self.relative_speed(&record.key) + self.speed_gain(&record.key);
                let overlap = record.loads.overlap.max(0.0);
                let time = self.model.contact_time(&pair, speed, overlap);
                (shortest, any_movable) = (shortest.min(time), true);
            }
        }
        if !any_movable {
            return 1;
        }
        let longest_step = shortest / self.model.params.substeps_per_contact;
        let count = (dt / longest_step.min(self.film_time())).ceil();
        if count.is_nan() { 1 } else { count.clamp(1.0, MAX_SUBSTEPS) as usize }
    }

    /// Time in which no listed pair closes its lubrication film by more than half the height of the
    /// asperities [s]; infinite without lubrication or asperities.
    fn film_time(&self) -> f64 {
        if self.model.range() <= 0.0 || self.model.params.roughness <= 0.0 {
            return f64::INFINITY;
        }
        let speeds = self.records.iter().map(|r| self.relative_speed(&r.key));
        0.5 * self.model.params.roughness / speeds.fold(0.0, f64::max)
    }

    /// Upper bound of the relative speed of the surfaces of a pair [m/s].
    fn relative_speed(&self, key: &PairKey) -> f64 {
        let body = &self.bodies[key.grain as usize];
        match key.partner {
            Partner::Grain(j) => body.surface_speed_relative_to(&self.bodies[j]),
            Partner::Wall { .. } => body.surface_speed(),
        }
    }

    /// Upper bound of the relative speed that a pair gains from the known loads [m/s].
    fn speed_gain(&self, key: &PairKey) -> f64 {
        let partner = match key.partner {
            Partner::Grain(j) => self.bodies[j].speed_gain,
            Partner::Wall { .. } => 0.0,
        };
        self.bodies[key.grain as usize].speed_gain + partner
    }

    /// Evaluates the contact loads at the present poses; `step` [s] is the time since the last
    /// evaluation.
    fn compute_contacts(&mut self, grains: &[Grain], step: f64) {
        for (grain, body) in grains.iter().zip(&mut self.bodies) {
            body.update_kinematics(grain, step);
        }
        let context = PairContext {
            grains,
            bodies: &self.bodies,
            model: &self.model,
            wall: &self.wall,
            enclosure: &self.enclosure,
            step,
        };
        let evaluate = |record: &mut ContactRecord| {
            evaluate_pair(record, &context);
            record.in_contact_during_step |= record.loads.overlap > 0.0;
            record.deepest_overlap = record.deepest_overlap.max(record.loads.overlap);
        };
        // Each pair writes its own record and the records are summed in order, so results do not
        // depend on the number of threads.
        if self.records.len() < PARALLEL_PAIRS {
            self.records.iter_mut().for_each(evaluate);
        } else {
            let records = self.records.par_iter_mut();
            records.with_min_len(4).for_each(evaluate);
        }
        for record in &self.records {
            self.bodies[record.key.grain as usize].contact += record.loads.on_grain;
            if let Partner::Grain(j) = record.key.partner {
                self.bodies[j].contact += record.loads.on_partner;
            }
        }
    }
}
