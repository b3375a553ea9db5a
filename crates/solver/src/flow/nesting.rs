//! Place of a refined box in the grid of the whole box.
//!
//! Legend: c index of a cell of the whole grid, counted from 0 at the lower corner of the refined
//! box.

use super::{Boundaries, Boundary, BoxSide};
use crate::grid::{Layout, Mesh};

/// Cells of the refined grid along the edge of a cell of the whole grid.
pub const RATIO: usize = 2;

/// Box of cells of the whole grid that is refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RefinedBox {
    /// Cells of the whole grid below the box along each axis; any number on a periodic axis.
    pub corner: [isize; 3],
    /// Cells of the whole grid inside the box along each axis.
    pub cells: [usize; 3],
}

impl RefinedBox {
    /// Grid of the box.
    pub fn mesh(&self, whole: &Mesh) -> Mesh {
        let corner = glam::DVec3::from_array(self.corner.map(|c| c as f64));
        Mesh {
            cells: self.cells.map(|n| n * RATIO),
            spacing: whole.spacing / RATIO as f64,
            origin: whole.origin + whole.spacing * corner,
        }
    }
}

/// Place of a refined box in the grid of the whole box.
pub struct Nesting {
    /// The refined box.
    pub place: RefinedBox,
    /// Layout of the whole grid.
    pub(super) whole: Layout,
    /// Layout of the refined grid.
    pub(super) refined: Layout,
    /// Volume of a cell of the whole grid [m^3].
    pub(super) cell_volume: f64,
    /// Sides of the refined box on a wall of the whole box, or periodic with the opposite one.
    pub(super) shared: [[bool; 2]; 3],
    /// Periodic axes.
    pub(super) periodic: [bool; 3],
    /// Periodic axes along which the refined box spans the whole box.
    pub(super) spanned: [bool; 3],
    /// Positions on the whole grid along each axis of the cells c from -1 to the number of cells.
    pub(super) positions: [Vec<usize>; 3],
}

impl Nesting {
    /// Places the refined box in a grid with the given sides.
    pub fn new(whole: &Mesh, boundaries: &Boundaries, place: RefinedBox) -> Nesting {
        let mut shared = [[false; 2]; 3];
        for side in BoxSide::all() {
            let (axis, n) = (side.axis, whole.cells[side.axis] as isize);
            let (lower, cells) = (place.corner[axis], place.cells[axis] as isize);
            shared[axis][side.side] = match side.boundary(boundaries) {
                Boundary::Periodic => cells == n,
                Boundary::Wall { .. } | Boundary::Slip if side.side == 0 => lower == 0,
                Boundary::Wall { .. } | Boundary::Slip => lower + cells == n,
                Boundary::FreeSurface | Boundary::Inflow { .. } | Boundary::Outflow => false,
            };
        }
        let positions = [0, 1, 2].map(|axis| {
            let n = whole.cells[axis] as isize;
            let cells = -1..=place.cells[axis] as isize;
            let at = cells.map(|c| {
                let at = place.corner[axis] + c;
                (1 + if boundaries.is_periodic(axis) { at.rem_euclid(n) } else { at }) as usize
            });
            at.collect()
        });
        Nesting {
            place,
            whole: whole.layout(),
            refined: place.mesh(whole).layout(),
            cell_volume: whole.cell_volume(),
            shared,
            periodic: boundaries.periodic(),
            spanned: [0, 1, 2].map(|axis| boundaries.is_periodic(axis) && shared[axis][0]),
            positions,
        }
    }

    /// Conditions on the sides of the refined box: those of the whole box on shared sides. On the
    /// others a wall stands for the flow outside, which [`Self::set_sides`] and
    /// [`Self::fill_ghosts`] transfer.
    pub fn boundaries(&self, whole: &Boundaries) -> Boundaries {
        let mut sides = whole.0;
        for side in self.inner_sides() {
            sides[side.axis][side.side] = Boundary::WALL;
        }
        Boundaries(sides)
    }

    /// Sides of the refined box that lie inside the whole box or on its open sides.
    pub(super) fn inner_sides(&self) -> impl Iterator<Item = BoxSide> + use<> {
        let shared = self.shared;
        BoxSide::all().filter(move |side| !shared[side.axis][side.side])
    }

    /// Position on the whole grid of the cell `c`, -1 and the number of cells included.
    pub(super) fn position(&self, axis: usize, c: isize) -> usize {
        self.positions[axis][(c + 1) as usize]
    }

    /// Positions on the whole grid of the cells of the refined box.
    pub(super) fn inside(&self, axis: usize) -> &[usize] {
        &self.positions[axis][1..=self.place.cells[axis]]
    }

    /// Positions on this refined grid along `axis` by the positions on another refined grid in the
    /// same box; none outside it. Those of faces along the axis include the sides if `with_sides`
    /// is set.
    pub fn common_positions(
        &self,
        other: &Nesting,
        axis: usize,
        on_faces: bool,
        with_sides: bool,
    ) -> Vec<Option<usize>> {
        let shift = RATIO as isize * (other.place.corner[axis] - self.place.corner[axis]);
        let n = self.refined.cells[axis] as isize;
        let range = match (on_faces && !self.spanned[axis], with_sides) {
            (true, true) => 1..=n + 1,
            (true, false) => 2..=n,
            (false, _) => 1..=n,
        };
        let period = (RATIO * self.whole.cells[axis]) as isize;
        let here = |at: usize| {
            let at = at as isize + shift;
            let at = if self.periodic[axis] { 1 + (at - 1).rem_euclid(period) } else { at };
            range.contains(&at).then_some(at as usize)
        };
        (0..other.refined.cells[axis] + 2).map(here).collect()
    }
}
