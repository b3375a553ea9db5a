//! Sub-steps of contact and motion.

use std::sync::Arc;

use glam::{DMat3, DVec3, IVec3};
use grainwake_shape::Shape;
use rayon::prelude::*;

use super::broad_phase::{Ball, BroadPhase};
use super::enclosure::Enclosure;
use super::grain::{Dof, Grain};
use super::history::{PairKey, Slot, renew};
use super::law::{Law, Motion, Pair};
use super::motion::{MidStep, kick, kick_and_drift};
use super::narrow_phase::Body;
use super::node_tree::NodeTree;
use super::params::ContactParams;
use super::{Contact, Partner};
use crate::math::Load;

/// Part of its bounding radius that a grain may always move before the pairs are searched again.
const SKIN: f64 = 0.01;
/// A pair that is known to be apart is looked at again when this many times its motion could close it.
const MOVED_SLACK: f64 = 1.01;
/// Fewer pairs than this are not worth a second thread.
const WORTH_THREADS: usize = 16;
/// More sub-steps than this in one step are a mistake in the input.
const MOST_SUBSTEPS: f64 = 1e7;

/// A grain's part in the contact search.
#[derive(Clone, Debug)]
struct Actor {
    shape: Arc<Shape>,
    tree: Arc<NodeTree>,
    rotation: DMat3,
    during: Motion,
    now: Motion,
    mid: MidStep,
    contact: Load,
    /// No point of the surface has moved further than this since the last look [m].
    moved: f64,
    inverse_mass: f64,
    /// Where it was when the pairs were searched [m], and how far it may go from there.
    searched: DVec3,
    margin: f64,
}

/// Contact law, history and integrator.
#[derive(Clone, Debug)]
pub struct Dynamics {
    pub(super) law: Law,
    pub(super) enclosure: Enclosure,
    pub(super) contacts: Vec<Contact>,
    pub(super) slots: Vec<Slot>,
    /// Where every grain was at the end of the last step [m].
    pub(super) last: Vec<DVec3>,
    actors: Vec<Actor>,
    broad: BroadPhase,
    balls: Vec<Ball>,
    old_slots: Vec<Slot>,
    spare_slots: Vec<Slot>,
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
        self.search(grains, loads, dt);
        let done = if self.slots.len() < WORTH_THREADS {
            self.run(grains, loads, dt, mean_contact)
        } else {
            // Into the pool once, not once for each sub-step: a caller outside it would have to wait
            // for a worker to wake every time.
            rayon::scope(|_| self.run(grains, loads, dt, mean_contact))
        };
        self.last.clear();
        self.last
            .extend(grains.iter().map(|grain| grain.pose.position));
        self.report(grains);
        done
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
                actor.mid = kick_and_drift(grain, &(load_of(i) + actor.contact), damping, step);
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
                    damping,
                    step,
                );
            }
        }
        done
    }

    /// Brings the actors in line with the grains: prescribed velocities, shapes, and jumps by whole
    /// periods.
    fn follow(&mut self, grains: &mut [Grain]) {
        for grain in grains.iter_mut() {
            if let Dof::Prescribed(velocity) = grain.translation {
                grain.velocity = velocity;
            }
            if let Dof::Prescribed(omega) = grain.rotation {
                grain.angular_velocity = omega;
            }
        }
        self.actors.truncate(grains.len());
        // Nothing of the last step may steer this one but what a checkpoint holds.
        self.actors
            .iter_mut()
            .for_each(|actor| actor.contact = Load::default());
        for (i, grain) in grains.iter().enumerate() {
            if self
                .actors
                .get(i)
                .is_some_and(|actor| Arc::ptr_eq(&actor.shape, &grain.shape))
            {
                continue;
            }
            let known = self
                .actors
                .iter()
                .find(|actor| Arc::ptr_eq(&actor.shape, &grain.shape));
            let tree = known.map_or_else(
                || Arc::new(NodeTree::new(&grain.shape)),
                |actor| actor.tree.clone(),
            );
            let actor = Actor {
                shape: grain.shape.clone(),
                tree,
                rotation: DMat3::IDENTITY,
                during: Motion::default(),
                now: Motion::default(),
                mid: MidStep::default(),
                contact: Load::default(),
                moved: 0.0,
                inverse_mass: 0.0,
                searched: DVec3::ZERO,
                margin: 0.0,
            };
            match self.actors.get_mut(i) {
                Some(old) => *old = actor,
                None => self.actors.push(actor),
            }
        }
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
            slot.patch.forget();
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
            actor.inverse_mass = grain.inverse_mass();
            let speed = match grain.translation {
                Dof::Free => {
                    grain.velocity.length() + 0.5 * dt * load.force.length() * actor.inverse_mass
                }
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
        let count = (dt / longest).ceil();
        if count.is_finite() {
            count.clamp(1.0, MOST_SUBSTEPS) as usize
        } else {
            1
        }
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
            actor.contact = Load::default();
            actor.rotation = DMat3::from_quat(grain.pose.orientation);
            let radius = grain.shape.bounding_radius();
            actor.moved = step * (actor.mid.velocity.length() + radius * actor.mid.spin.length());
            (actor.during, actor.now) = if step > 0.0 {
                (
                    Motion {
                        velocity: actor.mid.velocity,
                        spin: actor.mid.spin,
                    },
                    Motion {
                        velocity: actor.mid.predicted_velocity,
                        spin: actor.mid.predicted_spin,
                    },
                )
            } else {
                let motion = Motion {
                    velocity: grain.velocity,
                    spin: grain.angular_velocity,
                };
                (motion, motion)
            };
        }
        let (actors, law, enclosure) = (&self.actors, &self.law, &self.enclosure);
        let look = |slot: &mut Slot| look_at(slot, grains, actors, law, enclosure, step);
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

    fn report(&mut self, grains: &[Grain]) {
        self.contacts.clear();
        for slot in self.slots.iter().filter(|slot| slot.outcome.overlap > 0.0) {
            let grain = slot.key.grain as usize;
            self.contacts.push(Contact {
                grain,
                partner: slot.key.partner,
                overlap: slot.outcome.overlap,
                load: slot.outcome.first,
                point: grains[grain].pose.position + slot.outcome.arm,
                normal: slot.outcome.normal,
            });
        }
    }
}

/// Overlap and loads of one pair.
fn look_at(
    slot: &mut Slot,
    grains: &[Grain],
    actors: &[Actor],
    law: &Law,
    enclosure: &Enclosure,
    step: f64,
) {
    let body = |i: usize, shift: DVec3| Body {
        shape: &grains[i].shape,
        tree: &actors[i].tree,
        rotation: actors[i].rotation,
        position: grains[i].pose.position + shift,
    };
    let i = slot.key.grain as usize;
    let other_moved = match slot.key.partner {
        Partner::Grain(j) => actors[j].moved,
        Partner::Wall { .. } => 0.0,
    };
    slot.patch.apart -= MOVED_SLACK * (actors[i].moved + other_moved);
    if slot.patch.apart > 0.0 {
        return;
    }
    let a = body(i, DVec3::ZERO);
    let (own, radius) = (&actors[i], 0.5 * a.shape.equivalent_diameter());
    let mut pair = Pair {
        apart: DVec3::ZERO,
        during: [own.during, Motion::default()],
        now: [own.now, Motion::default()],
        inverse_mass: own.inverse_mass,
        radius,
        wall: true,
    };
    let closest = match slot.key.partner {
        Partner::Grain(j) => {
            let b = body(j, slot.key.image.as_dvec3() * enclosure.period());
            let other = 0.5 * b.shape.equivalent_diameter();
            pair.apart = a.position - b.position;
            pair.during[1] = actors[j].during;
            pair.now[1] = actors[j].now;
            pair.inverse_mass += actors[j].inverse_mass;
            pair.radius = radius * other / (radius + other);
            pair.wall = false;
            slot.patch.of_grains(&a, &b, law.reach())
        }
        Partner::Wall { axis, side } => {
            let face = enclosure.plane(axis as usize, side as usize);
            let offset = face.distance(a.position);
            slot.patch.of_wall(&a, face.inward, offset, law.reach())
        }
    };
    law.apply(slot, closest, &pair, step);
}
