//! Velocity at the boundary: given normal components and ghost layers.

use super::ghosts::{Mirror, beyond_wall, reflect, second};
use super::{Boundaries, Boundary};
use crate::grid::{FaceVector, Layout};
use crate::math::Real;

impl Boundaries {
    /// Sets the normal velocity on every face where it is given, and the upper faces of periodic
    /// axes; outflow faces keep theirs.
    pub(crate) fn set_normal<R: Real>(&self, velocity: &mut FaceVector<R>) {
        let layout = velocity.x.layout();
        for axis in 0..3 {
            let normal = velocity.component_mut(axis);
            if self.is_periodic(axis) {
                layout.wrap(normal, axis);
            }
            for (face, value) in self.given_faces(axis, layout.cells[axis]) {
                layout.map_layer(normal, axis, face, face, |_| R::of(value));
            }
        }
    }

    /// Sets the given x and y faces of one plane.
    pub(crate) fn set_normal_of_plane<R: Real>(&self, layout: Layout, [x, y]: [&mut [R]; 2]) {
        let row = layout.row();
        for (face, value) in self.given_faces(0, layout.cells[0]) {
            x.chunks_exact_mut(row)
                .for_each(|row| row[face] = R::of(value));
        }
        for (face, value) in self.given_faces(1, layout.cells[1]) {
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
            match self.mirror(0, side, component) {
                Mirror::None => {}
                Mirror::Wrap => plane.chunks_exact_mut(row).for_each(|row| {
                    (row[0], row[nx + 1]) = (row[nx], row[1]);
                }),
                Mirror::Copy => plane
                    .chunks_exact_mut(row)
                    .for_each(|row| row[ghost] = row[inner]),
                Mirror::About(wall) => {
                    let next = second(inner, nx);
                    plane
                        .chunks_exact_mut(row)
                        .for_each(|row| row[ghost] = beyond_wall(wall, row[inner], row[next], nx));
                }
            }
        }
        for side in 0..2 {
            let (ghost, inner) = if side == 0 { (0, 1) } else { (ny + 1, ny) };
            reflect(
                plane,
                row,
                self.mirror(1, side, component),
                ghost,
                inner,
                ny,
            );
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
                let mirror = self.mirror(2, side, component);
                let q = velocity.component_mut(component);
                reflect(q, plane, mirror, ghost, inner, nz);
            }
        }
    }

    /// Rule for the ghosts of a velocity component on one side of the box.
    fn mirror(&self, axis: usize, side: usize, component: usize) -> Mirror {
        match self.0[axis][side] {
            Boundary::Periodic => Mirror::Wrap,
            // The boundary face itself is set; only the lower side has a ghost beyond it, and no
            // interior face reads that.
            _ if component == axis && side == 1 => Mirror::None,
            _ if component == axis => Mirror::Copy,
            Boundary::Wall { velocity } | Boundary::Inflow { velocity } => {
                Mirror::About(velocity[component])
            }
            Boundary::Slip | Boundary::FreeSurface | Boundary::Outflow => Mirror::Copy,
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
