//! Velocity at the boundary: prescribed normal components and ghost layers.

use super::ghosts::{GhostRule, beyond_wall, fill_ghost_layer, second};
use super::{Boundaries, Boundary};
use crate::grid::{FaceVector, Layout};
use crate::math::Real;

impl Boundaries {
    /// Sets the normal velocity on every face where it is prescribed, and the upper faces of
    /// periodic axes; outflow faces keep theirs.
    pub(crate) fn set_normal<R: Real>(&self, velocity: &mut FaceVector<R>) {
        let layout = velocity.x.layout();
        for axis in 0..3 {
            let normal = velocity.component_mut(axis);
            if self.is_periodic(axis) {
                layout.wrap(normal, axis);
            }
            for (face, value) in self.prescribed_faces(axis, layout.cells[axis]) {
                layout.map_layer(normal, axis, face, face, |_| R::of(value));
            }
        }
    }

    /// Sets the normal velocity on the prescribed x and y faces of one plane.
    pub(crate) fn set_normal_of_plane<R: Real>(&self, layout: Layout, [x, y]: [&mut [R]; 2]) {
        let row = layout.row();
        for (face, value) in self.prescribed_faces(0, layout.cells[0]) {
            x.chunks_exact_mut(row).for_each(|row| row[face] = R::of(value));
        }
        for (face, value) in self.prescribed_faces(1, layout.cells[1]) {
            y[face * row..(face + 1) * row].fill(R::of(value));
        }
    }

    /// Fills the ghosts along x and y of one plane of a velocity component.
    pub(crate) fn fill_ghosts_of_plane<R: Real>(
        &self,
        layout: Layout,
        component: usize,
        plane: &mut [R],
    ) {
        let (row, [nx, ny, _]) = (layout.row(), layout.cells);
        for side in 0..2 {
            let (ghost, inner) = if side == 0 { (0, 1) } else { (nx + 1, nx) };
            match self.ghost_rule(0, side, component) {
                GhostRule::Unused => {}
                GhostRule::Periodic => plane.chunks_exact_mut(row).for_each(|row| {
                    (row[0], row[nx + 1]) = (row[nx], row[1]);
                }),
                GhostRule::ZeroGradient => {
                    plane.chunks_exact_mut(row).for_each(|row| row[ghost] = row[inner])
                }
                GhostRule::Wall(wall) => {
                    let next = second(inner, nx);
                    plane
                        .chunks_exact_mut(row)
                        .for_each(|row| row[ghost] = beyond_wall(wall, row[inner], row[next], nx));
                }
            }
        }
        for side in 0..2 {
            let (ghost, inner) = if side == 0 { (0, 1) } else { (ny + 1, ny) };
            fill_ghost_layer(plane, row, self.ghost_rule(1, side, component), ghost, inner, ny);
        }
    }

    /// Fills the ghost planes below and above, and the ghosts of the upper boundary faces.
    pub(crate) fn fill_ghost_planes<R: Real>(&self, velocity: &mut FaceVector<R>) {
        let layout = velocity.x.layout();
        let (plane, nz) = (layout.plane(), layout.cells[2]);
        if !self.is_periodic(2) {
            self.fill_ghosts_of_plane(layout, 2, &mut velocity.z[(nz + 1) * plane..]);
        }
        for component in 0..3 {
            for side in 0..2 {
                let (ghost, inner) = if side == 0 { (0, 1) } else { (nz + 1, nz) };
                let rule = self.ghost_rule(2, side, component);
                let q = velocity.component_mut(component);
                fill_ghost_layer(q, plane, rule, ghost, inner, nz);
            }
        }
    }

    /// Rule for the ghosts of a velocity component on one side of the box.
    fn ghost_rule(&self, axis: usize, side: usize, component: usize) -> GhostRule {
        match self.0[axis][side] {
            Boundary::Periodic => GhostRule::Periodic,
            // The boundary face itself is set; only the lower side has a ghost beyond it, and no
            // interior face reads that.
            _ if component == axis && side == 1 => GhostRule::Unused,
            _ if component == axis => GhostRule::ZeroGradient,
            Boundary::Wall { velocity } | Boundary::Inflow { velocity } => {
                GhostRule::Wall(velocity[component])
            }
            Boundary::Slip | Boundary::FreeSurface | Boundary::Outflow => GhostRule::ZeroGradient,
        }
    }
}

#[cfg(test)]
impl Boundaries {
    /// Fills the ghost layers of a velocity whose interior and boundary faces are set.
    pub(crate) fn fill_ghosts<R: Real>(&self, velocity: &mut FaceVector<R>) {
        let layout = velocity.x.layout();
        for component in 0..3 {
            let planes = velocity.component_mut(component);
            for plane in planes.chunks_exact_mut(layout.plane()) {
                self.fill_ghosts_of_plane(layout, component, plane);
            }
        }
        self.fill_ghost_planes(velocity);
    }
}
