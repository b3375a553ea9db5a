//! Image-based DEM: grains, contact (Eqs 7-18) and rigid motion (Eqs 19-37). Knows no grid.
//!
//! [`Dynamics::advance`] is the step: pairs that may touch (`broad_phase`), their penetrating nodes
//! (`narrow_phase`), the forces (`law`, with the memory of `history`), and the motion (`motion`,
//! `rotation`) in sub-steps of the contact time.

mod actor;
mod again;
mod broad_phase;
mod deepest;
mod dynamics;
mod enclosure;
mod gap;
mod grain;
mod history;
mod law;
mod motion;
mod narrow_phase;
mod node_tree;
mod params;
mod response;
pub mod rotation;
mod state;
mod target;

use glam::DVec3;

use crate::math::Load;

pub use again::State;
pub(crate) use broad_phase::{Ball, BroadPhase};
pub use dynamics::Dynamics;
pub use enclosure::Enclosure;
pub use gap::{Outside, Overlap, initial_overlaps, outside, surface_gap, wall_gap};
pub use grain::{Dof, Grain};
pub use params::ContactParams;
pub use response::Response;

/// What a grain touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Partner {
    /// Another grain, by index.
    Grain(usize),
    /// A face of the box.
    Wall {
        /// Axis of its normal.
        axis: u8,
        /// 0 lower, 1 upper.
        side: u8,
    },
}

/// A pair that touched during a step; `grain` < partner when the partner is a grain, and equal
/// where a grain touches its own periodic image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// First grain.
    pub grain: usize,
    /// What it touches.
    pub partner: Partner,
    /// Deepest overlap at the end of the step [m]; zero where the pair touched during the step and
    /// has parted again.
    pub overlap: f64,
    /// Load on `grain` (the partner gets the opposite force).
    pub load: Load,
    /// Mean point of contact, beside `grain` as it stands [m].
    pub point: DVec3,
    /// Mean unit normal, out of `grain`.
    pub normal: DVec3,
}
