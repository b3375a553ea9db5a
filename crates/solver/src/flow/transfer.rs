//! Values of the grid of the whole box on a refined box, and back.
//!
//! Legend: c index of a cell of the whole grid counted from the lower corner of the refined box,
//! from 0; f index on the refined grid from 0; i, j, k positions in the arrays, from 1.

use rayon::prelude::*;

use super::{Boundaries, Boundary, BoxSide};
use crate::grid::{FaceVector, Layout, Mesh};
use crate::math::Real;

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

/// Momentum per density [m^4/s] and kinetic energy per density [m^5/s^2] that the whole grid has
/// gained by the transfer of one velocity component.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gain {
    /// Momentum along the component.
    pub momentum: f64,
    /// Kinetic energy.
    pub energy: f64,
}

/// Place of a refined box in the grid of the whole box.
pub struct Nesting {
    /// The refined box.
    pub place: RefinedBox,
    whole: Layout,
    refined: Layout,
    cell_volume: f64,
    /// Sides of the refined box on a wall of the whole box, or periodic with the opposite one.
    shared: [[bool; 2]; 3],
    /// Periodic axes along which the refined box spans the whole box.
    spanned: [bool; 3],
    /// Positions on the whole grid along each axis of the cells c from -1 to the number of cells.
    positions: [Vec<usize>; 3],
}

/// Two positions along an axis and their weights.
type Pair = [(usize, f64); 2];

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
    fn inner_sides(&self) -> impl Iterator<Item = BoxSide> + use<> {
        let shared = self.shared;
        BoxSide::all().filter(move |side| !shared[side.axis][side.side])
    }

    /// Position on the whole grid of the cell `c`, -1 and the number of cells included.
    fn position(&self, axis: usize, c: isize) -> usize {
        self.positions[axis][(c + 1) as usize]
    }

    /// Positions on the whole grid of the cells of the refined box.
    fn inside(&self, axis: usize) -> &[usize] {
        &self.positions[axis][1..=self.place.cells[axis]]
    }

    /// Positions on the whole grid and weights of the linear interpolation to each position of the
    /// refined grid along `axis`, from 1 on; `on_faces` includes the upper side.
    fn interpolation(&self, axis: usize, on_faces: bool) -> Vec<Pair> {
        let count = self.refined.cells[axis] as isize;
        let whole = |c| self.position(axis, c);
        let pair = |f: isize| {
            let (c, odd) = (f / 2, f % 2 == 1);
            match (on_faces, odd) {
                (true, false) => [(whole(c), 1.0), (whole(c), 0.0)],
                (true, true) => [(whole(c), 0.5), (whole(c + 1), 0.5)],
                (false, false) => [(whole(c), 0.75), (whole(c - 1), 0.25)],
                (false, true) => [(whole(c), 0.75), (whole(c + 1), 0.25)],
            }
        };
        (0..count + isize::from(on_faces)).map(pair).collect()
    }

    /// Fills a refined field by linear interpolation; `component` is that of a field on faces.
    /// Entries that `kept` gives take its value instead.
    pub fn interpolate<R: Real>(
        &self,
        component: Option<usize>,
        from: &[R],
        to: &mut [R],
        kept: impl Fn([usize; 3]) -> Option<R> + Sync,
    ) {
        let pairs = [0, 1, 2].map(|axis| self.interpolation(axis, component == Some(axis)));
        let (whole, row) = (self.whole, self.refined.row());
        let planes =
            to.par_chunks_exact_mut(self.refined.plane()).skip(1).zip(&pairs[2]).enumerate();
        planes.for_each(|(k, (plane, zs))| {
            for (j, ys) in pairs[1].iter().enumerate() {
                for (i, xs) in pairs[0].iter().enumerate() {
                    let value = kept([i + 1, j + 1, k + 1]).unwrap_or_else(|| {
                        let mut sum = 0.0;
                        for (z, by_z) in zs {
                            for (y, by_y) in ys {
                                for (x, by_x) in xs {
                                    let value = from[whole.index(*x, *y, *z)].wide();
                                    sum += by_x * by_y * by_z * value;
                                }
                            }
                        }
                        R::of(sum)
                    });
                    plane[(j + 1) * row + i + 1] = value;
                }
            }
        });
    }

    /// Sets the normal velocity of `to` on the inner sides. Each face of the whole grid is divided
    /// into four faces with the same flux in all, linear in the position.
    pub fn set_sides<R: Real>(&self, from: &FaceVector<R>, to: &mut FaceVector<R>) {
        let (whole, refined) = (self.whole.strides(), self.refined.strides());
        for side in self.inner_sides() {
            let axis = side.axis;
            let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
            let (from, to) = (from.component(axis), to.component_mut(axis));
            let c = if side.side == 0 { 0 } else { self.place.cells[axis] };
            let layer = whole[axis] * self.position(axis, c as isize);
            let lowest = refined[axis] * (RATIO * c + 1) + refined[a] + refined[b];
            for (cb, at_b) in self.positions[b].windows(3).enumerate() {
                for (ca, at_a) in self.positions[a].windows(3).enumerate() {
                    let value = |i: usize, j: usize| {
                        from[layer + whole[a] * at_a[i] + whole[b] * at_b[j]].wide()
                    };
                    let mean = value(1, 1);
                    let along_a = 0.125 * (value(2, 1) - value(0, 1));
                    let along_b = 0.125 * (value(1, 2) - value(1, 0));
                    let at = lowest + RATIO * (refined[a] * ca + refined[b] * cb);
                    to[at] = R::of(mean - along_a - along_b);
                    to[at + refined[a]] = R::of(mean + along_a - along_b);
                    to[at + refined[b]] = R::of(mean - along_a + along_b);
                    to[at + refined[a] + refined[b]] = R::of(mean + along_a + along_b);
                }
            }
        }
    }

    /// Fills the ghosts of the tangential velocities of `to` beyond the inner sides: on the parabola
    /// through the value of the whole grid, half a cell of it outside, and the two nearest inside.
    pub fn fill_ghosts<R: Real>(&self, from: &FaceVector<R>, to: &mut FaceVector<R>) {
        let (whole, refined) = (self.whole.strides(), self.refined.strides());
        for side in self.inner_sides() {
            let axis = side.axis;
            let n = self.refined.cells[axis];
            let [ghost, near, next] =
                [[0, 1, 2], [n + 1, n, n - 1]][side.side].map(|i| i * refined[axis]);
            let c = if side.side == 0 { -1 } else { self.place.cells[axis] as isize };
            let layer = whole[axis] * self.position(axis, c);
            for component in (0..3).filter(|component| *component != axis) {
                let third = 3 - axis - component;
                let (from, to) = (from.component(component), to.component_mut(component));
                let along = self.interpolation(component, true);
                for (row, across) in self.interpolation(third, false).iter().enumerate() {
                    let [low, high] =
                        across.map(|(at, weight)| (&from[layer + whole[third] * at..], weight));
                    let row = refined[third] * (row + 1);
                    for (face, [first, second]) in along.iter().enumerate() {
                        let at = |(position, weight): (usize, f64)| {
                            let at = whole[component] * position;
                            weight * (low.1 * low.0[at].wide() + high.1 * high.0[at].wide())
                        };
                        let outside = at(*first) + at(*second);
                        let entry = row + refined[component] * (face + 1);
                        let (near, next) = (to[entry + near].wide(), to[entry + next].wide());
                        // Nodes at 2, -1 and -3 from the side, ghost at 1, in halves of a cell.
                        to[entry + ghost] =
                            R::of((8.0 * outside + 10.0 * near - 3.0 * next) / 15.0);
                    }
                }
            }
        }
    }

    /// Replaces the values of `to` on the faces inside the refined box by the means over the four
    /// refined faces on each. Faces on inner sides and walls keep theirs.
    pub fn average_faces<R: Real>(&self, axis: usize, from: &[R], to: &mut [R]) -> Gain {
        let first = [0, 1, 2].map(|along| usize::from(along == axis && !self.spanned[axis]));
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3].map(|axis| self.refined.strides()[axis]);
        let gains = self.for_planes(to, |k, plane| {
            let mut gain = Gain::default();
            if k < first[2] {
                return gain;
            }
            for (j, y) in self.inside(1).iter().enumerate().skip(first[1]) {
                let row = &mut plane[y * self.whole.row()..];
                let faces = self.rows([0, j, k], [0, a, b, a + b], from).zip(self.inside(0));
                for (pairs, x) in faces.skip(first[0]) {
                    let [p, q, r, s] = pairs.map(|pair| pair[0].wide());
                    let mean = R::of(0.25 * ((p + q) + (r + s)));
                    let (old, new) = (row[*x].wide(), mean.wide());
                    gain.momentum += new - old;
                    gain.energy += 0.5 * (new * new - old * old);
                    row[*x] = mean;
                }
            }
            gain
        });
        let mut total = Gain::default();
        for gain in gains {
            total.momentum += self.cell_volume * gain.momentum;
            total.energy += self.cell_volume * gain.energy;
        }
        total
    }

    /// Replaces the cells of `to` inside the refined box by the means over the eight refined cells
    /// in each, after a shift of `from` by one value. The shift leaves the mean of `to` over the
    /// outermost of these cells as it was.
    pub fn average_cells<R: Real>(&self, from: &mut [R], to: &mut [R]) {
        let [_, a, b] = self.refined.strides();
        let is_end = |axis: usize, c: usize| c == 0 || c + 1 == self.place.cells[axis];
        let differences = self.for_planes(to, |k, plane| {
            let (mut sum, mut count) = (0.0, 0.0);
            for (j, y) in self.inside(1).iter().enumerate() {
                let row = &mut plane[y * self.whole.row()..];
                let cells = self.rows([0, j, k], [0, a, b, a + b], from);
                for (i, (pairs, x)) in cells.zip(self.inside(0)).enumerate() {
                    let [p, q, r, s] = pairs.map(|[lower, upper]| lower.wide() + upper.wide());
                    let mean = 0.125 * ((p + q) + (r + s));
                    if is_end(0, i) || is_end(1, j) || is_end(2, k) {
                        sum += row[*x].wide() - mean;
                        count += 1.0;
                    }
                    row[*x] = R::of(mean);
                }
            }
            [sum, count]
        });
        let [sum, count] = differences.iter().fold([0.0; 2], |[s, c], [t, d]| [s + t, c + d]);
        let shift = sum / count;
        let shifted = |value: &mut R| *value = R::of(value.wide() + shift);
        from.par_chunks_mut(self.refined.plane()).for_each(|plane| {
            plane.iter_mut().for_each(shifted);
        });
        self.for_planes(to, |_, plane| {
            for y in self.inside(1) {
                let row = &mut plane[y * self.whole.row()..];
                self.inside(0).iter().for_each(|x| shifted(&mut row[*x]));
            }
        });
    }

    /// Calls `f(k, plane)` for the planes of a field of the whole grid inside the refined box,
    /// counted from 0. Returns the results in the order of the planes in memory.
    fn for_planes<R: Real, T: Send>(
        &self,
        values: &mut [R],
        f: impl Fn(usize, &mut [R]) -> T + Sync,
    ) -> Vec<T> {
        let mut order = vec![None; self.whole.cells[2] + 2];
        for (k, at) in self.inside(2).iter().enumerate() {
            order[*at] = Some(k);
        }
        let planes = values.par_chunks_exact_mut(self.whole.plane()).zip(order);
        planes.filter_map(|(plane, k)| Some(f(k?, plane))).collect()
    }

    /// Pairs of refined entries along x, one pair for each cell in the row that begins with `cell`,
    /// in four rows at the given offsets in memory.
    fn rows<R: Real>(
        &self,
        cell: [usize; 3],
        offsets: [usize; 4],
        from: &[R],
    ) -> impl Iterator<Item = [[R; RATIO]; 4]> {
        let [i, j, k] = cell.map(|c| RATIO * c + 1);
        let (start, count) = (self.refined.index(i, j, k), RATIO * self.place.cells[0]);
        let [p, q, r, s] = offsets.map(|offset| from[start + offset..][..count].as_chunks().0);
        p.iter().zip(q).zip(r).zip(s).map(|(((p, q), r), s)| [*p, *q, *r, *s])
    }

    /// Entry of this refined grid at the position `at` of another refined grid; none outside it.
    /// For a component on faces its own axis includes the sides if `sides` is set.
    pub fn common_entry(
        &self,
        other: &Nesting,
        component: Option<usize>,
        sides: bool,
        at: [usize; 3],
    ) -> Option<usize> {
        let mut here = [0; 3];
        for axis in 0..3 {
            let shift = RATIO as isize * (other.place.corner[axis] - self.place.corner[axis]);
            let index = at[axis] as isize + shift;
            let (n, normal) = (self.refined.cells[axis] as isize, component == Some(axis));
            let range = match (normal, sides) {
                (true, true) => 1..=n + 1,
                (true, false) => 2..=n,
                (false, _) => 1..=n,
            };
            if !range.contains(&index) {
                return None;
            }
            here[axis] = index as usize;
        }
        Some(self.refined.index(here[0], here[1], here[2]))
    }
}
