//! Bodies of new grains in the contact sub-steps, and the trees of new shapes.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use grainwake_shape::Shape;
use rayon::prelude::*;

use super::contact_body::ContactBody;
use crate::dem::contact::{BodyProperties, BodyState, SubstepVelocity};
use crate::dem::grain::Grain;
use crate::dem::search::PatchTree;
use crate::math::Load;

impl ContactBody {
    /// Trees of the shapes of `grains`, those of new shapes built in parallel.
    pub fn trees(
        bodies: &[ContactBody],
        grains: &[Grain],
    ) -> HashMap<*const Shape, Arc<PatchTree>> {
        let known = bodies.iter().map(|body| (Arc::as_ptr(&body.shape), body.tree.clone()));
        let mut trees: HashMap<_, _> = known.collect();
        let mut new: Vec<&Arc<Shape>> = grains.iter().map(|grain| &grain.shape).collect();
        new.retain(|shape| !trees.contains_key(&Arc::as_ptr(shape)));
        new.sort_by_key(|shape| Arc::as_ptr(shape));
        new.dedup_by_key(|shape| Arc::as_ptr(shape));
        let built: Vec<_> = new.par_iter().map(|shape| Arc::new(PatchTree::new(shape))).collect();
        trees.extend(new.iter().map(|shape| Arc::as_ptr(shape)).zip(built));
        trees
    }

    /// Body of a grain with the tree of its shape, before its first step.
    pub fn new(grain: &Grain, tree: Arc<PatchTree>) -> ContactBody {
        ContactBody {
            shape: grain.shape.clone(),
            tree,
            material: grain.material,
            state: BodyState::translating(BodyProperties::of(grain), DVec3::ZERO),
            displacement: 0.0,
            velocity: SubstepVelocity::default(),
            load: Load::default(),
            contact: Load::default(),
            mean_contact: Load::default(),
            response: None,
            own_inverse_mass: 0.0,
            speed_gain: 0.0,
            search_position: DVec3::ZERO,
            search_margin: 0.0,
        }
    }
}
