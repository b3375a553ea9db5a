//! A grain as the contact search sees it, and the look at one pair.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use grainwake_shape::Shape;

use super::Partner;
use super::enclosure::Enclosure;
use super::grain::Grain;
use super::history::Slot;
use super::law::{Law, Motion, Pair};
use super::motion::{Inertia, MidStep};
use super::narrow_phase::Body;
use super::node_tree::NodeTree;
use super::response::Response;
use crate::math::Load;

/// A pair that is known to be apart is looked at again when this many times its motion could close it.
const MOVED_SLACK: f64 = 1.01;

/// A grain's part in the contact search.
#[derive(Clone, Debug)]
pub(super) struct Actor {
    shape: Arc<Shape>,
    tree: Arc<NodeTree>,
    rotation: DMat3,
    during: Motion,
    now: Motion,
    /// No point of the surface has moved further than this since the last look [m].
    moved: f64,
    /// Velocities in the middle of the sub-step.
    pub mid: MidStep,
    /// Contact load at the last look.
    pub contact: Load,
    /// How it answers contact, where that is known.
    pub response: Option<Response>,
    /// One over the mass that resists a contact, added mass included [1/kg].
    pub inverse_mass: f64,
    /// The same of the grain alone [1/kg].
    pub own_inverse_mass: f64,
    /// Where it was when the pairs were searched [m].
    pub searched: DVec3,
    /// How far it may go from there before they are searched again [m].
    pub margin: f64,
}

impl Actor {
    /// Makes one actor a grain, keeping those whose grain has the same shape as before. Nothing of
    /// the last step may steer the next but what a checkpoint holds, so their loads are dropped.
    pub fn cast(actors: &mut Vec<Actor>, grains: &[Grain]) {
        actors.truncate(grains.len());
        actors
            .iter_mut()
            .for_each(|actor| actor.contact = Load::default());
        for (i, grain) in grains.iter().enumerate() {
            let same = |actor: &Actor| Arc::ptr_eq(&actor.shape, &grain.shape);
            if actors.get(i).is_some_and(same) {
                continue;
            }
            let tree = match actors.iter().find(|actor| same(actor)) {
                Some(known) => known.tree.clone(),
                None => Arc::new(NodeTree::new(&grain.shape)),
            };
            let actor = Actor::new(grain.shape.clone(), tree);
            match actors.get_mut(i) {
                Some(old) => *old = actor,
                None => actors.push(actor),
            }
        }
    }

    fn new(shape: Arc<Shape>, tree: Arc<NodeTree>) -> Actor {
        Actor {
            shape,
            tree,
            rotation: DMat3::IDENTITY,
            during: Motion::default(),
            now: Motion::default(),
            moved: 0.0,
            mid: MidStep::default(),
            contact: Load::default(),
            response: None,
            inverse_mass: 0.0,
            own_inverse_mass: 0.0,
            searched: DVec3::ZERO,
            margin: 0.0,
        }
    }

    /// What resists the present loads.
    pub fn inertia(&self) -> Inertia<'_> {
        match &self.response {
            Some(response) => Inertia::InFluid(response),
            None if self.contact.force == DVec3::ZERO => Inertia::Own(self.own_inverse_mass),
            None => Inertia::Own(self.inverse_mass),
        }
    }

    /// No point of the surface is faster [m/s].
    pub fn speed(&self) -> f64 {
        self.now.velocity.length() + self.now.spin.length() * self.shape.bounding_radius()
    }

    /// No two points of the surfaces part or meet faster [m/s].
    pub fn speed_relative_to(&self, other: &Actor) -> f64 {
        (self.now.velocity - other.now.velocity).length()
            + self.now.spin.length() * self.shape.bounding_radius()
            + other.now.spin.length() * other.shape.bounding_radius()
    }

    /// Takes over the grain's pose and motion; `step` [s] is the time since the last look.
    pub fn observe(&mut self, grain: &Grain, step: f64) {
        self.contact = Load::default();
        self.rotation = DMat3::from_quat(grain.pose.orientation);
        let mid = &self.mid;
        let radius = grain.shape.bounding_radius();
        self.moved = step * (mid.velocity.length() + radius * mid.spin.length());
        if step > 0.0 {
            self.during = Motion {
                velocity: mid.velocity,
                spin: mid.spin,
            };
            self.now = Motion {
                velocity: mid.predicted_velocity,
                spin: mid.predicted_spin,
            };
        } else {
            self.during = Motion {
                velocity: grain.velocity,
                spin: grain.angular_velocity,
            };
            self.now = self.during;
        }
    }
}

/// Overlap and loads of one pair.
pub(super) fn look_at(
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
