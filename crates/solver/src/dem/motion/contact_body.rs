//! Grain as a body of the contact search, and the evaluation of one pair.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DMat3, DVec3, IVec3};
use grainwake_shape::Shape;
use rayon::prelude::*;

use super::integrator::{EffectiveInertia, GrainResponse, HalfStepVelocity};
use crate::dem::contact::{
    BodyProperties, ContactMaterial, ContactModel, ContactRecord, Mobility, PairKinematics,
    PairProperties,
};
use crate::dem::enclosure::{Enclosure, PairKey, Partner, Side};
use crate::dem::grain::{Grain, MotionConstraint};
use crate::dem::material::Material;
use crate::dem::search::{PatchTree, PosedShape};
use crate::math::{Load, RigidVelocity};

/// Safety factor on the motion that reduces the known separation of a pair.
const MOTION_MARGIN: f64 = 1.01;

/// State of one grain in the contact sub-steps.
#[derive(Clone, Debug)]
pub(super) struct ContactBody {
    shape: Arc<Shape>,
    tree: Arc<PatchTree>,
    material: Material,
    contact_material: ContactMaterial,
    rotation: DMat3,
    mid_step: RigidVelocity,
    end_of_step: RigidVelocity,
    /// Upper bound of the displacement of any surface point since the last evaluation [m].
    displacement: f64,
    /// Velocities in the middle of the sub-step.
    pub half_step: HalfStepVelocity,
    /// Contact load at the last evaluation.
    pub contact: Load,
    /// Response to contact with the fluid of the present step, if known.
    pub response: Option<GrainResponse>,
    /// Inverse of the mass in a contact, added mass included [1/kg].
    pub inverse_mass: f64,
    /// Inverse of the grain's mass [1/kg].
    pub own_inverse_mass: f64,
    /// Largest speed gained from the known loads in the rest of the step [m/s].
    pub speed_gain: f64,
    /// Position at the last search of pairs [m].
    pub search_position: DVec3,
    /// Displacement after which the pairs are searched again [m].
    pub search_margin: f64,
}

impl ContactBody {
    /// Updates the list to one body a grain, reusing bodies of equal shape and material.
    ///
    /// Only quantities of the checkpoint may affect the next step, so contact loads are cleared.
    pub fn synchronise(bodies: &mut Vec<ContactBody>, grains: &[Grain]) {
        bodies.truncate(grains.len());
        for body in &mut *bodies {
            body.contact = Load::default();
        }
        let is_current = |body: &ContactBody, grain: &Grain| {
            Arc::ptr_eq(&body.shape, &grain.shape) && body.material == grain.material
        };
        let same_length = bodies.len() == grains.len();
        if same_length && bodies.iter().zip(grains).all(|(body, grain)| is_current(body, grain)) {
            return;
        }
        let trees = ContactBody::trees(bodies, grains);
        for (i, grain) in grains.iter().enumerate() {
            let new = || ContactBody::new(grain, trees[&Arc::as_ptr(&grain.shape)].clone());
            match bodies.get_mut(i) {
                Some(body) if is_current(body, grain) => {}
                Some(body) => *body = new(),
                None => bodies.push(new()),
            }
        }
    }

    /// Trees of the shapes of `grains`, those of new shapes built in parallel.
    fn trees(bodies: &[ContactBody], grains: &[Grain]) -> HashMap<*const Shape, Arc<PatchTree>> {
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

    fn new(grain: &Grain, tree: Arc<PatchTree>) -> ContactBody {
        ContactBody {
            shape: grain.shape.clone(),
            tree,
            material: grain.material,
            contact_material: ContactMaterial::new(&grain.material),
            rotation: DMat3::IDENTITY,
            mid_step: RigidVelocity::default(),
            end_of_step: RigidVelocity::default(),
            displacement: 0.0,
            half_step: HalfStepVelocity::default(),
            contact: Load::default(),
            response: None,
            inverse_mass: 0.0,
            own_inverse_mass: 0.0,
            speed_gain: 0.0,
            search_position: DVec3::ZERO,
            search_margin: 0.0,
        }
    }

    /// Inertia against the present loads.
    pub fn inertia(&self) -> EffectiveInertia<'_> {
        match &self.response {
            Some(response) => EffectiveInertia::WithFluid(response),
            None if self.contact.force == DVec3::ZERO => {
                EffectiveInertia::Grain(self.own_inverse_mass)
            }
            None => EffectiveInertia::Grain(self.inverse_mass),
        }
    }

    /// Upper bound of the speed of any surface point [m/s].
    pub fn surface_speed(&self) -> f64 {
        let motion = &self.end_of_step;
        motion.linear.length() + motion.angular.length() * self.shape.bounding_radius()
    }

    /// Upper bound of the relative speed of any two surface points [m/s].
    pub fn surface_speed_relative_to(&self, other: &ContactBody) -> f64 {
        (self.end_of_step.linear - other.end_of_step.linear).length()
            + self.end_of_step.angular.length() * self.shape.bounding_radius()
            + other.end_of_step.angular.length() * other.shape.bounding_radius()
    }

    /// Takes pose and velocities of the grain and clears the contact load; `step` [s] is the time
    /// since the last evaluation.
    pub fn update_kinematics(&mut self, grain: &Grain, step: f64) {
        self.contact = Load::default();
        self.rotation = DMat3::from_quat(grain.pose.orientation);
        let HalfStepVelocity { middle, end } = self.half_step;
        let radius = grain.shape.bounding_radius();
        self.displacement = step * (middle.linear.length() + radius * middle.angular.length());
        [self.mid_step, self.end_of_step] =
            if step > 0.0 { [middle, end] } else { [grain.rigid_velocity(); 2] };
    }

    /// Properties in a pair.
    fn properties(&self) -> BodyProperties {
        BodyProperties {
            inverse_mass: self.inverse_mass,
            radius: 0.5 * self.shape.equivalent_diameter(),
            material: self.contact_material,
        }
    }

    /// Response to an impulse.
    fn mobility(&self, grain: &Grain) -> Mobility {
        let moments = match grain.rotation {
            MotionConstraint::Free => grain.principal_inertia(),
            MotionConstraint::Prescribed(_) => DVec3::INFINITY,
        };
        Mobility { inverse_mass: self.inverse_mass, rotation: self.rotation, moments }
    }

    fn posed_shape(&self, position: DVec3) -> PosedShape<'_> {
        PosedShape { shape: &self.shape, tree: &self.tree, rotation: self.rotation, position }
    }
}

/// Properties of the pair `key`; `wall` is the material of the walls.
pub(super) fn pair_properties(
    key: &PairKey,
    bodies: &[ContactBody],
    wall: &ContactMaterial,
) -> PairProperties {
    let partner = match key.partner {
        Partner::Grain(j) => Some(bodies[j].properties()),
        Partner::Wall { .. } => None,
    };
    PairProperties::new(&bodies[key.grain as usize].properties(), partner.as_ref(), wall)
}

/// Quantities that the evaluation of all pairs shares.
pub(super) struct PairContext<'a> {
    pub grains: &'a [Grain],
    pub bodies: &'a [ContactBody],
    pub model: &'a ContactModel,
    pub wall: &'a ContactMaterial,
    pub enclosure: &'a Enclosure,
    /// Time since the last evaluation [s].
    pub step: f64,
}

/// Finds the penetrating points of a pair and evaluates its loads (Eqs 7-18).
pub(super) fn evaluate_pair(record: &mut ContactRecord, context: &PairContext) {
    let PairContext { grains, bodies, .. } = *context;
    let i = record.key.grain as usize;
    let partner_displacement = match record.key.partner {
        Partner::Grain(j) => bodies[j].displacement,
        Partner::Wall { .. } => 0.0,
    };
    record.patch.approach(MOTION_MARGIN * (bodies[i].displacement + partner_displacement));
    if record.patch.separation > 0.0 {
        return;
    }
    let a = bodies[i].posed_shape(grains[i].pose.position);
    let reach = context.model.range();
    let mut pair = PairKinematics {
        branch: DVec3::ZERO,
        mid_step: [bodies[i].mid_step, RigidVelocity::default()],
        end_of_step: [bodies[i].end_of_step, RigidVelocity::default()],
        mobility: [bodies[i].mobility(&grains[i]), Mobility::NONE],
    };
    let params = &context.model.params;
    let (friction, closest) = match record.key.partner {
        Partner::Grain(j) => {
            let image = IVec3::from(record.key.image).as_dvec3() * context.enclosure.period();
            let b = bodies[j].posed_shape(grains[j].pose.position + image);
            pair.branch = a.position - b.position;
            pair.mid_step[1] = bodies[j].mid_step;
            pair.end_of_step[1] = bodies[j].end_of_step;
            pair.mobility[1] = bodies[j].mobility(&grains[j]);
            (params.friction, record.patch.find_grain_contact(&a, &b, reach))
        }
        Partner::Wall { axis, side } => {
            let (axis, side) = (axis as usize, side as usize);
            let wall = context.enclosure.sides[axis][side];
            let motion = RigidVelocity { linear: wall.velocity(), angular: DVec3::ZERO };
            (pair.mid_step[1], pair.end_of_step[1]) = (motion, motion);
            let rough = wall != Side::Frictionless;
            let friction = if rough { params.wall_friction } else { 0.0 };
            let face = context.enclosure.plane(axis, side);
            let offset = face.distance(a.position);
            let patch = &mut record.patch;
            (friction, patch.find_wall_contact(&a, face.inward, offset, reach))
        }
    };
    let properties = pair_properties(&record.key, bodies, context.wall);
    (context.model).evaluate(record, closest, &properties, friction, &pair, context.step);
}
