//! Contact search: pairs of grains and walls that may touch, their penetrating points and the gaps
//! between surfaces (Eqs 7-8).
//!
//! Broad phase: bounding spheres in a cell list. Narrow phase: surface nodes of each grain in the
//! distance field of its partner, and the deepest point of the surface.

mod broad_phase;
mod closest_point;
mod gap;
mod narrow_phase;
mod node_tree;
mod pair;
mod partner_field;
mod patch;

pub(crate) use broad_phase::{BoundingSphere, BroadPhase};
pub use gap::{Outside, Overlap, initial_overlaps, outside, surface_gap, wall_gap};
pub(super) use narrow_phase::PosedShape;
pub(super) use node_tree::NodeTree;
pub(crate) use pair::PairKey;
pub use pair::Partner;
pub(super) use patch::{ClosestPoint, ContactPatch, ContactPoint};
