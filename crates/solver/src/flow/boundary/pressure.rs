//! Pressure at the boundary: periodic, or zero normal gradient.
//!
//! The normal velocity of every face that is not periodic is known before the projection: walls and
//! inflows prescribe it, outflows get it by convection (`outflow.rs`). The projection must not
//! change it, hence the zero normal gradient of the pressure increment, and of the pressure.

use super::ghosts::{GhostRule, fill_ghost_layer};
use super::{Boundaries, Boundary};
use crate::grid::{Centre, Field, Layout};
use crate::math::Real;
use crate::poisson::Ends;

/// Condition on the pressure at a face of the box; an outflow has a zero normal gradient.
fn pressure_condition(boundary: &Boundary) -> Ends {
    match boundary {
        Boundary::Periodic => Ends::Periodic,
        Boundary::Wall { .. }
        | Boundary::Slip
        | Boundary::FreeSurface
        | Boundary::Inflow { .. }
        | Boundary::Outflow => Ends::Neumann,
    }
}

impl Boundaries {
    /// Conditions on the pressure at the ends of each axis.
    pub(crate) fn pressure_ends(&self) -> [Ends; 3] {
        [0, 1, 2].map(|axis| pressure_condition(&self.0[axis][0]))
    }

    /// Fills the ghosts along x and y of one plane of the pressure.
    pub(crate) fn fill_pressure_of_plane<R: Real>(&self, layout: Layout, plane: &mut [R]) {
        let (row, [nx, ny, _]) = (layout.row(), layout.cells);
        let periodic = self.is_periodic(0);
        for row in plane.chunks_exact_mut(row) {
            let ends = [row[1], row[nx]];
            [row[0], row[nx + 1]] = if periodic { [ends[1], ends[0]] } else { ends };
        }
        self.fill_pressure_ends(plane, row, 1, ny);
    }

    /// Fills the ghost planes of the pressure.
    pub(crate) fn fill_pressure_planes<R: Real>(&self, pressure: &mut Field<Centre, R>) {
        let layout = pressure.layout();
        self.fill_pressure_ends(pressure, layout.plane(), 2, layout.cells[2]);
    }

    fn fill_pressure_ends<R: Real>(&self, values: &mut [R], layer: usize, axis: usize, n: usize) {
        for (ghost, inner) in [(0, 1), (n + 1, n)] {
            let rule =
                if self.is_periodic(axis) { GhostRule::Periodic } else { GhostRule::ZeroGradient };
            fill_ghost_layer(values, layer, rule, ghost, inner, n);
        }
    }
}

#[cfg(test)]
impl Boundaries {
    /// Fills all ghosts of the pressure.
    pub(crate) fn fill_pressure<R: Real>(&self, pressure: &mut Field<Centre, R>) {
        let layout = pressure.layout();
        for plane in pressure.chunks_exact_mut(layout.plane()) {
            self.fill_pressure_of_plane(layout, plane);
        }
        self.fill_pressure_planes(pressure);
    }
}
