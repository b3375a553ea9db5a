//! Conditions on the six faces of the box (Eq. 4a).
//!
//! Velocity: prescribed normal components, ghost layers. Pressure: periodic, or zero normal
//! gradient. The normal velocity of every face that is not periodic is known before the projection:
//! walls and inflows prescribe it, `open_boundary.rs` has that of outflows and free surfaces. The
//! projection must not change it, hence the zero normal gradient of the pressure increment, and of
//! the pressure.

use std::ops::Range;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::grid::{FaceVector, Layout};
use crate::math::Real;
use crate::poisson::Ends;

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

    /// Sets the normal velocity on every face where it is prescribed, and the upper faces of
    /// periodic axes; outflow faces keep theirs.
    pub(crate) fn set_normal<R: Real>(&self, velocity: &mut FaceVector<R>) {
        let layout = velocity.x.layout();
        for axis in 0..3 {
            let normal = velocity.component_mut(axis);
            if self.is_periodic(axis) {
                layout.wrap(normal, axis);
            }
            self.set_prescribed(layout, axis, normal);
        }
    }

    /// Sets the prescribed velocity on the faces normal to `axis` of a field, or of a plane for x
    /// and y.
    pub(crate) fn set_prescribed<R: Real>(&self, layout: Layout, axis: usize, normal: &mut [R]) {
        for (face, value) in self.prescribed_faces(axis, layout.cells[axis]) {
            layout.map_layer(normal, axis, face, face, |_| R::of(value));
        }
    }

    /// Fills the ghosts along `axes` of a velocity `component`, or of the pressure if none.
    /// `values` are a field, or whole planes of it for the axes x and y.
    pub(crate) fn fill_ghosts<R: Real>(
        &self,
        layout: Layout,
        component: Option<usize>,
        axes: Range<usize>,
        values: &mut [R],
    ) {
        for axis in axes {
            let rules = self.ghost_rules(axis, component);
            let part = if axis == 1 { layout.plane() } else { values.len() };
            values.chunks_exact_mut(part).for_each(|part| fill_ghosts(part, layout, axis, rules));
        }
    }

    /// Rules for the lower and upper ghosts along `axis` of a velocity `component`, or of the
    /// pressure if none.
    fn ghost_rules(&self, axis: usize, component: Option<usize>) -> [GhostRule; 2] {
        [0, 1].map(|side| match (self.0[axis][side], component) {
            (Boundary::Periodic, _) => GhostRule::Periodic,
            // The boundary face itself is set; only the lower side has a ghost beyond it, and no
            // interior face reads that.
            (_, Some(normal)) if normal == axis => {
                [GhostRule::ZeroGradient, GhostRule::Unused][side]
            }
            (Boundary::Wall { velocity } | Boundary::Inflow { velocity }, Some(component)) => {
                GhostRule::Wall(velocity[component])
            }
            // The pressure on every side, `Outflow` included; the velocity along slip, outflow and
            // free surface.
            _ => GhostRule::ZeroGradient,
        })
    }

    /// Conditions on the pressure at the ends of each axis: outflows too have a zero normal
    /// gradient.
    pub(crate) fn pressure_ends(&self) -> [Ends; 3] {
        self.periodic().map(|periodic| if periodic { Ends::Periodic } else { Ends::Neumann })
    }
}

/// Rule by which a ghost layer follows from the interior.
#[derive(Clone, Copy)]
enum GhostRule {
    /// No stencil reads the ghost layer.
    Unused,
    /// Copy of the outermost layer at the opposite end of the box.
    Periodic,
    /// Copy of the adjacent interior layer.
    ZeroGradient,
    /// Extrapolation through this velocity at the wall [m/s].
    Wall(f64),
}

/// Fills the ghosts at the lower and upper end of an axis, of a plane (x, y) or of a field (z), by
/// the rule of each end.
fn fill_ghosts<R: Real>(values: &mut [R], layout: Layout, axis: usize, rules: [GhostRule; 2]) {
    let (n, step) = (layout.cells[axis], layout.strides()[axis]);
    let ends = [(0, 1, 2.min(n)), (n + 1, n, n.max(2) - 1)];
    for ((ghost, near, next), rule) in ends.into_iter().zip(rules) {
        let (from, wall) = match rule {
            GhostRule::Unused => continue,
            GhostRule::Periodic => (n + 1 - near, None),
            GhostRule::ZeroGradient => (near, None),
            GhostRule::Wall(velocity) => (near, Some(velocity)),
        };
        let value = |near: R, next: R| match wall {
            None => near,
            Some(wall) if n == 1 => R::of(2.0 * wall - near.wide()),
            // The parabola through the wall and the two nearest values makes the shear at the wall
            // second-order.
            Some(wall) => R::of((8.0 * wall - 6.0 * near.wide() + next.wide()) / 3.0),
        };
        if axis == 0 {
            for row in values.chunks_exact_mut(layout.row()) {
                row[ghost] = value(row[from], row[next]);
            }
            continue;
        }
        // A whole row or plane of ghosts.
        let layer = |index: usize| index * step..(index + 1) * step;
        values.copy_within(layer(from), ghost * step);
        if wall.is_some() {
            let layers = values.get_disjoint_mut([layer(ghost), layer(next)]);
            let [ghosts, next] = layers.expect("a ghost layer is no interior layer");
            ghosts.iter_mut().zip(next).for_each(|(ghost, next)| *ghost = value(*ghost, *next));
        }
    }
}
