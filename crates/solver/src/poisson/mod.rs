//! Direct solver for the constant-coefficient Poisson equation on cell centres.
//!
//! Along x and y the second difference is diagonalised (cosine modes between impermeable faces,
//! Fourier modes on a periodic axis); along z a tridiagonal system is left for each pair of modes.
//! Every scaling of the transforms is hidden in here.

mod transform;
mod tridiagonal;

use crate::grid::{Centre, Field, Layout, Mesh, for_planes_with, for_row_columns};
use transform::{LineScratch, Lines, Transform};
use tridiagonal::{ColumnScratch, Tridiagonal};

/// The pair of conditions at the two ends of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// The ends are neighbours.
    Periodic,
    /// Zero normal derivative at both ends.
    Neumann,
}

/// Solver for lap(phi) = f. Planned once for a mesh; solving allocates nothing.
pub struct Poisson {
    layout: Layout,
    along_x: Transform,
    along_y: Transform,
    along_z: Tridiagonal,
    lines: Vec<LineScratch>,
    columns: Vec<ColumnScratch>,
}

/// Slots of scratch memory: enough to keep many threads busy, independent of their number.
const SLOTS: usize = 32;

impl Poisson {
    /// Plans the solver for `mesh` with the given ends along x, y, z.
    pub fn new(mesh: &Mesh, ends: [Ends; 3]) -> Poisson {
        let [nx, ny, nz] = mesh.cells;
        let along_x = Transform::new(nx, ends[0], mesh.spacing.x);
        let along_y = Transform::new(ny, ends[1], mesh.spacing.y);
        let along_z = Tridiagonal::new(
            nz,
            ends[2],
            mesh.spacing.z,
            1.0 / (along_x.norm() * along_y.norm()),
        );
        let lines = (0..SLOTS.min(nz))
            .map(|_| LineScratch::new([&along_x, &along_y]))
            .collect();
        let columns = (0..SLOTS.min(ny))
            .map(|_| ColumnScratch::new(nx, nz))
            .collect();
        Poisson {
            layout: mesh.layout(),
            along_x,
            along_y,
            along_z,
            lines,
            columns,
        }
    }

    /// Replaces the right-hand side in the interior of `field` by the solution. Where the solution
    /// is defined up to a constant, the mean of the right-hand side is taken to be zero and one
    /// value of the mean mode is pinned. Ghosts are not touched.
    pub fn solve(&mut self, field: &mut Field<Centre>) {
        let layout = self.layout;
        let [nx, ny, _] = layout.cells;
        let first = layout.index(1, 1, 0);
        let rows = Lines {
            first,
            count: ny,
            apart: layout.row(),
            step: 1,
        };
        let cols = Lines {
            first,
            count: nx,
            apart: 1,
            step: layout.row(),
        };
        let (along_x, along_y, along_z) = (&self.along_x, &self.along_y, &self.along_z);
        for_planes_with(layout, field, &mut self.lines, |_, plane, scratch| {
            along_x.forward(plane, rows, scratch);
            along_y.forward(plane, cols, scratch);
        });
        for_row_columns(layout, field, &mut self.columns, |j, column, scratch| {
            along_z.solve(
                column,
                &along_x.eigenvalues,
                along_y.eigenvalues[j - 1],
                scratch,
            );
        });
        for_planes_with(layout, field, &mut self.lines, |_, plane, scratch| {
            along_y.inverse(plane, cols, scratch);
            along_x.inverse(plane, rows, scratch);
        });
    }

    /// Memory held besides the field [bytes].
    pub fn bytes(&self) -> usize {
        let lines: usize = self.lines.iter().map(LineScratch::bytes).sum();
        let columns: usize = self.columns.iter().map(ColumnScratch::bytes).sum();
        lines + columns
    }
}

#[cfg(test)]
mod tests;
