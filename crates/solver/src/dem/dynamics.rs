//! Sub-steps of contact and motion.

use glam::{DVec3, IVec3};
use rayon::prelude::*;

use super::actor::{Actor, look_at};
use super::again::Start;
use super::broad_phase::{Ball, BroadPhase};
use super::enclosure::Enclosure;
use super::grain::{Dof, Grain};
use super::history::{PairKey, Slot, renew};
use super::law::Law;
use super::motion::{kick, kick_and_drift};
use super::params::ContactParams;
use super::{Contact, Partner};
use crate::math::Load;

/// Part of its bounding radius that a grain may always move before the pairs are searched again.
const SKIN: f64 = 0.01;
/// Fewer pairs than this are not worth a second thread.
const WORTH_THREADS: usize = 16;
/// More sub-steps than this in one step are a mistake in the input.
const MOST_SUBSTEPS: f64 = 1e7;

/// Contact law, history and integrator.
#[derive(Clone, Debug)]
pub struct Dynamics {
    pub(super) law: Law,
    pub(super) enclosure: Enclosure,
    pub(super) contacts: Vec<Contact>,
    pub(super) slots: Vec<Slot>,
    /// Where every grain was at the end of the last step [m].
    pub(super) last: Vec<DVec3>,
    pub(super) actors: Vec<Actor>,
    broad: BroadPhase,
    balls: Vec<Ball>,
    old_slots: Vec<Slot>,
    spare_slots: Vec<Slot>,
    pub(super) start: Start,
}

impl Dynamics {
    /// A system at rest without contact history.
    pub fn new(params: ContactParams, enclosure: Enclosure) -> Dynamics {
        Dynamics {
            law: Law::new(params),
            enclosure,
            contacts: Vec::new(),
            slots: Vec::new(),
            last: Vec::new(),
            actors: Vec::new(),
            broad: BroadPhase::default(),
            balls: Vec::new(),
            old_slots: Vec::new(),
            spare_slots: Vec::new(),
            start: Start::default(),
        }
    }
    /// Contacts at the end of the last step, ordered by grain, then partner.
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }
    /// The parameters it was built with.
    pub fn params(&self) -> &ContactParams {
        &self.law.params
    }
    /// The box it was built with.
    pub fn enclosure(&self) -> &Enclosure {
        &self.enclosure
    }
    /// Energy in the contact springs at the end of the last step [J].
    pub fn elastic_energy(&self) -> f64 {
        self.slots
            .iter()
            .map(|slot| slot.outcome.elastic_energy)
            .sum()
    }

    /// Advances poses and velocities by `dt` [s] in sub-steps under constant `loads` (space frame,
    /// about the centroids) plus contact. Returns the number of sub-steps, and in `mean_contact`
    /// the contact impulse on each grain over the step, divided by `dt`.
    ///
    /// A missing load counts as zero. Positions are not wrapped into the box; a caller may wrap them
    /// between steps.
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
        self.follow(grains);
        self.actors
            .iter_mut()
            .for_each(|actor| actor.response = None);
        let done = self.go(grains, loads, dt, mean_contact);
        self.finish(grains);
        done
    }

    /// The step, once the actors are there.
    pub(super) fn go(
        &mut self,
        grains: &mut [Grain],
        loads: &[Load],
        dt: f64,
        mean_contact: &mut [Load],
    ) -> usize {
        self.search(grains, loads, dt);
        if self.slots.len() < WORTH_THREADS {
            self.run(grains, loads, dt, mean_contact)
        } else {
            // Into the pool once, not once for each sub-step: a caller outside it would have to wait
            // for a worker to wake every time.
            rayon::scope(|_| self.run(grains, loads, dt, mean_contact))
        }
    }

    /// The sub-steps of one step.
    fn run(
        &mut self,
        grains: &mut [Grain],
        loads: &[Load],
        dt: f64,
        mean_contact: &mut [Load],
    ) -> usize {
        let load_of = |i: usize| loads.get(i).copied().unwrap_or_default();
        let damping = self.law.params.global_damping;
        self.touch(grains, 0.0);
        let (mut done, mut left) = (0, dt);
        let mut ahead = self.substeps(left);
        while ahead > 0 {
            let step = left / ahead as f64;
            let half_mean = 0.5 * step / dt;
            for (i, (grain, actor)) in grains.iter_mut().zip(&mut self.actors).enumerate() {
                if let Some(mean) = mean_contact.get_mut(i) {
                    *mean += actor.contact * half_mean;
                }
                let load = load_of(i) + actor.contact;
                actor.mid = kick_and_drift(grain, &load, actor.inertia(), damping, step);
            }
            ahead -= 1;
            done += 1;
            left -= step;
            if self.has_strayed(grains) {
                self.search(grains, loads, left.max(step));
                ahead = if ahead > 0 { self.substeps(left) } else { 0 };
            }
            self.touch(grains, step);
            for (i, (grain, actor)) in grains.iter_mut().zip(&self.actors).enumerate() {
                if let Some(mean) = mean_contact.get_mut(i) {
                    *mean += actor.contact * half_mean;
                }
                kick(
                    grain,
                    &actor.mid,
                    &(load_of(i) + actor.contact),
                    actor.inertia(),
                    damping,
                    step,
                );
            }
        }
        done
    }

    /// Brings the actors in line with the grains: prescribed velocities, shapes, and jumps by whole
    /// periods.
    pub(super) fn follow(&mut self, grains: &mut [Grain]) {
        for grain in grains.iter_mut() {
            if let Dof::Prescribed(velocity) = grain.translation {
                grain.velocity = velocity;
            }
            if let Dof::Prescribed(omega) = grain.rotation {
                grain.angular_velocity = omega;
            }
        }
        Actor::cast(&mut self.actors, grains);
        let period = self.enclosure.period();
        let jumps = |i: usize| -> IVec3 {
            let (Some(last), Some(grain)) = (self.last.get(i), grains.get(i)) else {
                return IVec3::ZERO;
            };
            let moved = grain.pose.position - *last;
            IVec3::from_array([0, 1, 2].map(|axis| {
                if period[axis] > 0.0 {
                    (moved[axis] / period[axis]).round().clamp(-1e6, 1e6) as i32
                } else {
                    0
                }
            }))
        };
        let mut jumped = false;
        for slot in &mut self.slots {
            slot.begin_step();
            if let Partner::Grain(j) = slot.key.partner {
                let jump = jumps(slot.key.grain as usize) - jumps(j);
                slot.key.image = slot.key.image.wrapping_add(jump);
                jumped |= jump != IVec3::ZERO;
            }
        }
        if jumped {
            self.slots.sort_by_key(|slot| slot.key);
        }
    }

    /// Lists the pairs that may touch within `dt` [s].
    fn search(&mut self, grains: &[Grain], loads: &[Load], dt: f64) {
        self.balls.clear();
        let reach = 0.5 * self.law.reach();
        for (i, (grain, actor)) in grains.iter().zip(&mut self.actors).enumerate() {
            let load = loads.get(i).copied().unwrap_or_default() + actor.contact;
            actor.own_inverse_mass = grain.inverse_mass(0.0);
            let acceleration = match &actor.response {
                Some(response) => response.to(&load)[0].length(),
                None => load.force.length() * actor.own_inverse_mass,
            };
            actor.inverse_mass = match &actor.response {
                Some(response) => response.inverse_mass(),
                None => grain.inverse_mass(self.law.params.added_density),
            };
            let speed = match grain.translation {
                Dof::Free => grain.velocity.length() + 0.5 * dt * acceleration,
                Dof::Prescribed(velocity) => velocity.length(),
            };
            let radius = grain.shape.bounding_radius();
            actor.searched = grain.pose.position;
            actor.margin = speed * dt + SKIN * radius;
            self.balls.push(Ball {
                center: grain.pose.position,
                radius: radius + actor.margin + reach,
            });
        }
        self.broad.search(&self.balls, &self.enclosure);
        renew(
            &mut self.slots,
            &mut self.old_slots,
            &mut self.spare_slots,
            &self.broad.pairs,
        );
    }

    /// Whether a grain has left the ball in which the pairs were searched.
    fn has_strayed(&self, grains: &[Grain]) -> bool {
        grains.iter().zip(&self.actors).any(|(grain, actor)| {
            grain.pose.position.distance_squared(actor.searched) > actor.margin * actor.margin
        })
    }

    /// Sub-steps for a time `dt` [s], from the shortest contact of the listed pairs.
    fn substeps(&self, dt: f64) -> usize {
        let largest = self
            .slots
            .iter()
            .map(|slot| self.inverse_mass(&slot.key))
            .fold(0.0, f64::max);
        if largest <= 0.0 {
            return 1;
        }
        let longest =
            self.law.params.contact_time(1.0 / largest) / self.law.params.substeps_per_contact;
        let count = (dt / longest.min(self.film_time())).ceil();
        if count.is_finite() {
            count.clamp(1.0, MOST_SUBSTEPS) as usize
        } else {
            1
        }
    }

    /// Time in which no listed pair closes its lubrication film by more than half the asperities [s].
    fn film_time(&self) -> f64 {
        if self.law.reach() <= 0.0 {
            return f64::INFINITY;
        }
        let fastest = self
            .slots
            .iter()
            .map(|slot| match slot.key.partner {
                Partner::Grain(j) => {
                    self.actors[slot.key.grain as usize].speed_relative_to(&self.actors[j])
                }
                Partner::Wall { .. } => self.actors[slot.key.grain as usize].speed(),
            })
            .fold(0.0, f64::max);
        0.5 * self.law.params.roughness / fastest
    }

    fn inverse_mass(&self, key: &PairKey) -> f64 {
        let other = match key.partner {
            Partner::Grain(j) => self.actors[j].inverse_mass,
            Partner::Wall { .. } => 0.0,
        };
        self.actors[key.grain as usize].inverse_mass + other
    }

    /// Contact loads for the poses as they are; `step` [s] is the time since the last look.
    fn touch(&mut self, grains: &[Grain], step: f64) {
        for (grain, actor) in grains.iter().zip(&mut self.actors) {
            actor.observe(grain, step);
        }
        let (actors, law, enclosure) = (&self.actors, &self.law, &self.enclosure);
        let look = |slot: &mut Slot| {
            look_at(slot, grains, actors, law, enclosure, step);
            slot.touched |= slot.outcome.overlap > 0.0;
        };
        // Each pair writes its own slot, and the slots are summed in order: the same bits for any
        // number of threads.
        if self.slots.len() < WORTH_THREADS {
            self.slots.iter_mut().for_each(look);
        } else {
            self.slots.par_iter_mut().with_min_len(4).for_each(look);
        }
        for slot in &self.slots {
            self.actors[slot.key.grain as usize].contact += slot.outcome.first;
            if let Partner::Grain(j) = slot.key.partner {
                self.actors[j].contact += slot.outcome.second;
            }
        }
    }

    /// Keeps where the grains are and what touches at the end of a step.
    pub(super) fn finish(&mut self, grains: &[Grain]) {
        self.last.clear();
        self.last
            .extend(grains.iter().map(|grain| grain.pose.position));
        self.contacts.clear();
        for slot in self.slots.iter().filter(|slot| slot.touched) {
            let grain = slot.key.grain as usize;
            self.contacts.push(Contact {
                grain,
                partner: slot.key.partner,
                overlap: slot.outcome.overlap.max(0.0),
                load: slot.outcome.first,
                point: grains[grain].pose.position + slot.outcome.arm,
                normal: slot.outcome.normal,
            });
        }
    }
}
