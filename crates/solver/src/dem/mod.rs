//! Image-based discrete element method (iDEM): grains, contact (Eqs 7-18) and rigid-body motion
//! (Eqs 19-37). This module knows no grid and no fluid field.
//!
//! Imports point downwards in this list only:
//! 1. `motion`: sub-steps, integrator, rotation, response of the fluid, checkpoint of the contacts;
//! 2. `contact`: force laws, friction history, lubrication;
//! 3. `search`: broad phase, narrow phase, gaps between surfaces;
//! 4. `grain`, with `grain_setup` and `grain_momentum`, `ranges` of parameters, `enclosure`: the
//!    bodies and the box.
//!
//! [`ContactDynamics::advance`] takes one step: list the pairs that may touch, find their
//! penetrating points, evaluate the contact forces and integrate the motion, in sub-steps of the
//! contact time.

mod contact;
mod enclosure;
mod grain;
mod grain_momentum;
mod grain_setup;
mod motion;
mod ranges;
mod search;

pub use contact::{Contact, ContactLawKind, ContactParams};
pub use enclosure::{Enclosure, Partner, Side};
pub use grain::{Grain, Material, MotionConstraint};
pub use motion::{
    ContactDynamics, GrainResponse, RelativeOverlap, RigidState, TrialStep, rotation,
};
pub use search::gap::{
    Gap, Outside, Overlap, gaps, initial_overlaps, near_pairs, outside, surface_gap, wall_gap,
};
pub(crate) use search::{BoundingSphere, BroadPhase, is_sphere};
