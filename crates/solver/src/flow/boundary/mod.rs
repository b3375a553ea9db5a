//! Conditions on the six faces of the box (Eq. 4a).
//!
//! `velocity.rs`: prescribed normal velocities and ghosts of the velocity. `pressure.rs`:
//! conditions on the pressure. `outflow.rs`: convective outflow. `ghosts.rs`: rules by which a
//! ghost layer follows from the interior.

mod ghosts;
mod outflow;
mod pressure;
mod velocity;

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Condition on one face of the box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Boundary {
    /// Periodic with the opposite face, which must be periodic too.
    Periodic,
    /// No-slip wall moving in its own plane at `velocity` [m/s] (zero: a wall at rest).
    Wall {
        /// Velocity of the wall [m/s]; its normal component must be zero.
        velocity: DVec3,
    },
    /// Frictionless wall.
    Slip,
    /// Flat stress-free lid: `Slip` for the flow, no contact for grains.
    FreeSurface,
    /// Inflow of prescribed velocity.
    Inflow {
        /// Velocity of the entering fluid [m/s].
        velocity: DVec3,
    },
    /// Convective outflow, corrected so that the volume of fluid in the box is conserved.
    Outflow,
}

impl Boundary {
    /// A no-slip wall at rest.
    pub const WALL: Boundary = Boundary::Wall { velocity: DVec3::ZERO };

    /// Whether grains collide with this face.
    pub fn is_solid(&self) -> bool {
        matches!(self, Boundary::Wall { .. } | Boundary::Slip)
    }
}

/// Conditions on the six faces: `[axis][0]` lower, `[axis][1]` upper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Boundaries(pub [[Boundary; 2]; 3]);

impl Boundaries {
    /// Whether `axis` is periodic.
    pub fn is_periodic(&self, axis: usize) -> bool {
        self.0[axis][0] == Boundary::Periodic
    }

    /// Whether each axis is periodic. On the other axes the normal velocity of the boundary faces
    /// is known before the projection.
    pub fn periodic(&self) -> [bool; 3] {
        [0, 1, 2].map(|axis| self.is_periodic(axis))
    }

    /// Layers of faces normal to `axis` with `n` cells whose normal velocity is prescribed, and
    /// that velocity [m/s].
    pub fn prescribed_faces(&self, axis: usize, n: usize) -> impl Iterator<Item = (usize, f64)> {
        let sides = self.0[axis];
        [1, n + 1].into_iter().zip(sides).filter_map(move |(face, boundary)| match boundary {
            Boundary::Periodic | Boundary::Outflow => None,
            Boundary::Wall { .. } | Boundary::Slip | Boundary::FreeSurface => Some((face, 0.0)),
            Boundary::Inflow { velocity } => Some((face, velocity[axis])),
        })
    }
}
