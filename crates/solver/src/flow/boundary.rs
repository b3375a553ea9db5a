//! What happens at each of the six faces of the box (Eq. 4a).

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Condition on one face of the box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Boundary {
    /// The opposite face is its neighbour; both faces of the axis must say so.
    Periodic,
    /// No-slip wall moving in its own plane at `velocity` [m/s] (zero: a wall at rest).
    Wall {
        /// Velocity of the wall [m/s]; its normal component must be zero.
        velocity: DVec3,
    },
    /// Frictionless wall.
    Slip,
    /// Flat stress-free lid; for the flow the same as `Slip`, but grains may not lean on it.
    FreeSurface,
    /// Fluid enters at this velocity [m/s].
    Inflow {
        /// Velocity of the entering fluid [m/s].
        velocity: DVec3,
    },
    /// Convective outflow, corrected so that the box keeps its mass.
    Outflow,
}

/// The six faces: `[axis][0]` lower, `[axis][1]` upper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Boundaries(pub [[Boundary; 2]; 3]);

impl Boundaries {
    /// Whether `axis` is periodic.
    pub fn is_periodic(&self, axis: usize) -> bool {
        self.0[axis][0] == Boundary::Periodic
    }
}
