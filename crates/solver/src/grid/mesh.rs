//! Geometry of the uniform grid: cells of constant spacing, axis order x, y, z, x fastest.

use glam::DVec3;

use super::Layout;

/// One of the three space axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// First axis, fastest in memory.
    X = 0,
    /// Second axis.
    Y = 1,
    /// Third axis, slowest in memory.
    Z = 2,
}

/// Cells, spacing and lower corner of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mesh {
    /// Cells along x, y, z; 1 makes a flat (two-dimensional) axis.
    pub cells: [usize; 3],
    /// Cell edge along x, y, z [m].
    pub spacing: DVec3,
    /// Lower corner of the box [m].
    pub origin: DVec3,
}

impl Mesh {
    /// Mesh of cubic cells of edge `spacing` [m] with its lower corner at the origin.
    pub fn cubic(cells: [usize; 3], spacing: f64) -> Mesh {
        Mesh {
            cells,
            spacing: DVec3::splat(spacing),
            origin: DVec3::ZERO,
        }
    }
    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.cells.iter().product()
    }
    /// Volume of one cell [m^3].
    pub fn cell_volume(&self) -> f64 {
        self.spacing.element_product()
    }
    /// Edge lengths of the box [m].
    pub fn extent(&self) -> DVec3 {
        self.spacing
            * DVec3::new(
                self.cells[0] as f64,
                self.cells[1] as f64,
                self.cells[2] as f64,
            )
    }
    /// Upper corner of the box [m].
    pub fn upper(&self) -> DVec3 {
        self.origin + self.extent()
    }
    /// Memory layout of its fields.
    pub(crate) fn layout(&self) -> Layout {
        Layout { cells: self.cells }
    }
    /// Position [m] of the point `offset` (in spacings from the lower corner) of cell `index`,
    /// counted from 1.
    #[inline]
    pub fn position(&self, offset: [f64; 3], index: [usize; 3]) -> DVec3 {
        self.origin
            + self.spacing
                * DVec3::new(
                    index[0] as f64 - 1.0 + offset[0],
                    index[1] as f64 - 1.0 + offset[1],
                    index[2] as f64 - 1.0 + offset[2],
                )
    }
}
