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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nesting {
    /// The refined box.
    pub place: RefinedBox,
    whole: Layout,
    refined: Layout,
    cell_volume: f64,
    periodic: [bool; 3],
    /// Sides of the refined box on a wall of the whole box, or periodic with the opposite one.
    shared: [[bool; 2]; 3],
}

/// Two positions along an axis and their weights.
type Pair = [(usize, f64); 2];

impl Nesting {
    /// Places the refined box in a grid with the given sides.
    pub fn new(whole: &Mesh, boundaries: &Boundaries, place: RefinedBox) -> Nesting {
        let mut nesting = Nesting {
            place,
            whole: whole.layout(),
            refined: place.mesh(whole).layout(),
            cell_volume: whole.cell_volume(),
            periodic: boundaries.periodic(),
            shared: [[false; 2]; 3],
        };
        for side in BoxSide::all() {
            let (axis, n) = (side.axis, whole.cells[side.axis] as isize);
            let (lower, cells) = (place.corner[axis], place.cells[axis] as isize);
            nesting.shared[axis][side.side] = match side.boundary(boundaries) {
                Boundary::Periodic => cells == n,
                Boundary::Wall { .. } | Boundary::Slip => {
                    if side.side == 0 { lower == 0 } else { lower + cells == n }
                }
                _ => false,
            };
        }
        nesting
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

    /// Position on the whole grid of the cell `c`, -1 and `cells` included.
    fn position(&self, axis: usize, c: isize) -> usize {
        let (at, n) = (self.place.corner[axis] + c, self.whole.cells[axis] as isize);
        let at = if self.periodic[axis] { at.rem_euclid(n) } else { at };
        (at + 1) as usize
    }

    /// Index c of position `at` on the whole grid; none outside the refined box.
    fn relative(&self, axis: usize, at: usize) -> Option<usize> {
        let (c, n) = (at as isize - 1 - self.place.corner[axis], self.whole.cells[axis] as isize);
        let c = if self.periodic[axis] { c.rem_euclid(n) } else { c };
        usize::try_from(c).ok().filter(|c| *c < self.place.cells[axis] && (1..=n as usize).contains(&at))
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
        let planes = to.par_chunks_exact_mut(self.refined.plane()).skip(1).zip(&pairs[2]).enumerate();
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
        for side in self.inner_sides() {
            let axis = side.axis;
            let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
            let from = from.component(axis);
            let to = to.component_mut(axis);
            let c = if side.side == 0 { 0 } else { self.place.cells[axis] };
            let at_face = |da: isize, db: isize| {
                let mut at = [0; 3];
                at[axis] = self.position(axis, c as isize);
                at[a] = self.position(a, da);
                at[b] = self.position(b, db);
                from[self.whole.index(at[0], at[1], at[2])].wide()
            };
            for cb in 0..self.place.cells[b] {
                for ca in 0..self.place.cells[a] {
                    let (ia, ib) = (ca as isize, cb as isize);
                    let mean = at_face(ia, ib);
                    let along_a = 0.125 * (at_face(ia + 1, ib) - at_face(ia - 1, ib));
                    let along_b = 0.125 * (at_face(ia, ib + 1) - at_face(ia, ib - 1));
                    for (half_a, half_b) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                        let mut at = [0; 3];
                        at[axis] = RATIO * c + 1;
                        at[a] = RATIO * ca + half_a + 1;
                        at[b] = RATIO * cb + half_b + 1;
                        let sign = |half: usize| 2.0 * half as f64 - 1.0;
                        let value = mean + sign(half_a) * along_a + sign(half_b) * along_b;
                        to[self.refined.index(at[0], at[1], at[2])] = R::of(value);
                    }
                }
            }
        }
    }

    /// Fills the ghosts of the tangential velocities of `to` beyond the inner sides: on the parabola
    /// through the value of the whole grid, half a cell of it outside, and the two nearest inside.
    pub fn fill_ghosts<R: Real>(&self, from: &FaceVector<R>, to: &mut FaceVector<R>) {
        for side in self.inner_sides() {
            let axis = side.axis;
            let (n, cells) = (self.refined.cells[axis], self.place.cells[axis] as isize);
            let [c, ghost, near, next] =
                if side.side == 0 { [-1, 0, 1, 2] } else { [cells, n as isize + 1, n as isize, n as isize - 1] };
            for component in (0..3).filter(|component| *component != axis) {
                let third = 3 - axis - component;
                let (from, to) = (from.component(component), to.component_mut(component));
                let along = self.interpolation(component, true);
                let across = self.interpolation(third, false);
                for (it, pairs) in across.iter().enumerate() {
                    for (ic, faces) in along.iter().enumerate() {
                        let mut outside = 0.0;
                        for (t, by_t) in pairs {
                            for (s, by_s) in faces {
                                let mut at = [0; 3];
                                at[axis] = self.position(axis, c);
                                at[third] = *t;
                                at[component] = *s;
                                outside += by_t * by_s * from[self.whole.index(at[0], at[1], at[2])].wide();
                            }
                        }
                        let entry = |layer: isize| {
                            let mut at = [0; 3];
                            at[axis] = layer as usize;
                            at[third] = it + 1;
                            at[component] = ic + 1;
                            self.refined.index(at[0], at[1], at[2])
                        };
                        let (near, next) = (to[entry(near)].wide(), to[entry(next)].wide());
                        // Nodes at 2, -1 and -3 from the side, ghost at 1, in halves of a cell.
                        to[entry(ghost)] = R::of((8.0 * outside + 10.0 * near - 3.0 * next) / 15.0);
                    }
                }
            }
        }
    }

    /// Replaces the values of `to` on the faces inside the refined box by the means over the four
    /// refined faces on each. Faces on inner sides and walls keep theirs.
    pub fn average_faces<R: Real>(&self, axis: usize, from: &[R], to: &mut [R]) -> Gain {
        let spans = self.periodic[axis] && self.shared[axis][0];
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3].map(|axis| self.refined.strides()[axis]);
        let is_inside = |axis_of: usize, c: usize| axis_of != axis || spans || c > 0;
        let gains: Vec<Gain> = self
            .planes(to)
            .filter(|(k, _)| is_inside(2, *k))
            .map(|(k, plane)| {
                let mut gain = Gain::default();
                for j in (0..self.place.cells[1]).filter(|j| is_inside(1, *j)) {
                    for i in (0..self.place.cells[0]).filter(|i| is_inside(0, *i)) {
                        let at = self.refined_position([i, j, k]);
                        let sum = from[at].wide() + from[at + a].wide() + from[at + b].wide()
                            + from[at + a + b].wide();
                        let (value, mean) = (&mut plane[self.in_plane(i, j)], R::of(0.25 * sum));
                        let (old, new) = (value.wide(), mean.wide());
                        gain.momentum += new - old;
                        gain.energy += 0.5 * (new * new - old * old);
                        *value = mean;
                    }
                }
                gain
            })
            .collect();
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
        let strides = self.refined.strides();
        let mean = |from: &[R], at: usize| {
            let mut sum = 0.0;
            for corner in 0..8 {
                let steps = [corner & 1, corner >> 1 & 1, corner >> 2];
                let offset: usize = (0..3).map(|axis| steps[axis] * strides[axis]).sum();
                sum += from[at + offset].wide();
            }
            0.125 * sum
        };
        let last = self.place.cells.map(|n| n - 1);
        let differences: Vec<[f64; 2]> = self
            .planes(to)
            .map(|(k, plane)| {
                let (mut sum, mut count) = (0.0, 0.0);
                for j in 0..=last[1] {
                    for i in 0..=last[0] {
                        let outermost = [i, j, k].iter().zip(last).any(|(c, last)| *c == 0 || *c == last);
                        if outermost {
                            let refined = mean(from, self.refined_position([i, j, k]));
                            sum += plane[self.in_plane(i, j)].wide() - refined;
                            count += 1.0;
                        }
                    }
                }
                [sum, count]
            })
            .collect();
        let [sum, count] = differences.iter().fold([0.0; 2], |[s, c], [t, d]| [s + t, c + d]);
        let shift = R::of(sum / count);
        from.par_chunks_mut(self.refined.plane()).for_each(|plane| {
            plane.iter_mut().for_each(|value| *value = *value + shift);
        });
        let from = &*from;
        self.planes(to).for_each(|(k, plane)| {
            for j in 0..=last[1] {
                for i in 0..=last[0] {
                    plane[self.in_plane(i, j)] = R::of(mean(from, self.refined_position([i, j, k])));
                }
            }
        });
    }

    /// Planes of a field of the whole grid inside the refined box, with their index c.
    fn planes<'a, R: Real>(
        &self,
        values: &'a mut [R],
    ) -> impl ParallelIterator<Item = (usize, &'a mut [R])> + use<'a, '_, R> {
        let planes = values.par_chunks_exact_mut(self.whole.plane()).enumerate();
        planes.filter_map(|(k, plane)| Some((self.relative(2, k)?, plane)))
    }

    /// Position of cell (i, j) of the refined box in a plane of the whole grid.
    fn in_plane(&self, i: usize, j: usize) -> usize {
        let (i, j) = (self.position(0, i as isize), self.position(1, j as isize));
        j * self.whole.row() + i
    }

    /// Position in memory of the lowest refined cell in cell (i, j, k) of the refined box.
    fn refined_position(&self, cell: [usize; 3]) -> usize {
        let [i, j, k] = cell.map(|c| RATIO * c + 1);
        self.refined.index(i, j, k)
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
