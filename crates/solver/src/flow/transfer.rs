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
    periodic: [bool; 3],
    /// Periodic axes along which the refined box spans the whole box.
    spanned: [bool; 3],
    /// Positions on the whole grid along each axis of the cells c from -1 to the number of cells.
    positions: [Vec<usize>; 3],
}

/// Lower and upper halves along two axes.
const HALVES: [[usize; 2]; 4] = [[0, 0], [1, 0], [0, 1], [1, 1]];

/// Calls `f` for all cells of a box, counted from 0.
fn for_cells(cells: [usize; 3], mut f: impl FnMut([usize; 3])) {
    for k in 0..cells[2] {
        for j in 0..cells[1] {
            for i in 0..cells[0] {
                f([i, j, k]);
            }
        }
    }
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
    /// refined grid along `axis`, from 1 on; `on_faces` includes the upper side. Beyond the ends of
    /// an axis that is not periodic, ghosts are used or, if `extrapolated`, the two nearest unknown
    /// values.
    fn interpolation(&self, axis: usize, on_faces: bool, extrapolated: bool) -> Vec<Pair> {
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
        let n = self.whole.cells[axis];
        let unknown = 1 + usize::from(on_faces)..=n;
        let pairs = (0..count + isize::from(on_faces)).map(pair);
        if !extrapolated || self.periodic[axis] || unknown.clone().count() < 2 {
            return pairs.collect();
        }
        let extrapolate = |pair: Pair| {
            if pair.iter().all(|(at, _)| unknown.contains(at)) {
                return pair;
            }
            let at: f64 = pair.iter().map(|(at, weight)| *at as f64 * weight).sum();
            let lower = if pair[0].0 + pair[1].0 < n { *unknown.start() } else { n - 1 };
            let upper_weight = at - lower as f64;
            [(lower, 1.0 - upper_weight), (lower + 1, upper_weight)]
        };
        pairs.map(extrapolate).collect()
    }

    /// Fills a refined field by linear interpolation; `component` is that of a field on faces.
    /// Entries that `kept` gives take its value instead. A field without ghosts on the sides of the
    /// whole box is `extrapolated` there.
    pub fn interpolate<R: Real>(
        &self,
        component: Option<usize>,
        extrapolated: bool,
        from: &[R],
        to: &mut [R],
        kept: impl Fn([usize; 3]) -> Option<R> + Sync,
    ) {
        let pairs =
            [0, 1, 2].map(|axis| self.interpolation(axis, component == Some(axis), extrapolated));
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

    /// Normal velocities of the four refined faces on the lower face of cell `c` along `axis`, by
    /// lower and upper half along the two axes after it. They are linear in the position and have
    /// the flux of the face.
    fn quarters<R: Real>(&self, axis: usize, from: &FaceVector<R>, c: [usize; 3]) -> [[f64; 2]; 2] {
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
        let value = |da: isize, db: isize| {
            let mut at = [0; 3];
            at[axis] = self.position(axis, c[axis] as isize);
            at[a] = self.position(a, c[a] as isize + da);
            at[b] = self.position(b, c[b] as isize + db);
            from.component(axis)[self.whole.index(at[0], at[1], at[2])].wide()
        };
        let mean = value(0, 0);
        let along_a = 0.125 * (value(1, 0) - value(-1, 0));
        let along_b = 0.125 * (value(0, 1) - value(0, -1));
        [
            [mean - along_a - along_b, mean - along_a + along_b],
            [mean + along_a - along_b, mean + along_a + along_b],
        ]
    }

    /// Position in memory of the refined face `half` along the two axes after `axis` on the lower
    /// face of cell `c`.
    fn quarter_position(&self, axis: usize, c: [usize; 3], half: [usize; 2]) -> usize {
        let mut at = c.map(|c| RATIO * c + 1);
        at[(axis + 1) % 3] += half[0];
        at[(axis + 2) % 3] += half[1];
        self.refined.index(at[0], at[1], at[2])
    }

    /// Sets the normal velocity of `to` on the inner sides from that of the whole grid.
    pub fn set_sides<R: Real>(&self, from: &FaceVector<R>, to: &mut FaceVector<R>) {
        for side in self.inner_sides() {
            let axis = side.axis;
            let mut layer = self.place.cells;
            layer[axis] = 1;
            for_cells(layer, |mut c| {
                c[axis] = if side.side == 0 { 0 } else { self.place.cells[axis] };
                self.set_quarters(axis, from, to, c);
            });
        }
    }

    /// Sets the refined faces on the lower face of cell `c` and returns their values.
    fn set_quarters<R: Real>(
        &self,
        axis: usize,
        from: &FaceVector<R>,
        to: &mut FaceVector<R>,
        c: [usize; 3],
    ) -> [[f64; 2]; 2] {
        let values = self.quarters(axis, from, c);
        for half in HALVES {
            let at = self.quarter_position(axis, c, half);
            to.component_mut(axis)[at] = R::of(values[half[0]][half[1]]);
        }
        values
    }

    /// Sets the velocity of `to` in the cells of the refined box that `is_new` selects. On the faces
    /// of the whole grid it is that of [`Self::quarters`]. Inside its cells it is the one by Toth and
    /// Roe (2002), whose divergence is that of the whole grid in all eight refined cells. The
    /// spacing must be the same along all axes.
    pub fn divide_velocity<R: Real>(
        &self,
        from: &FaceVector<R>,
        to: &mut FaceVector<R>,
        is_new: impl Fn([usize; 3]) -> bool,
    ) {
        let sign = |half: usize| 2.0 * half as f64 - 1.0;
        for_cells(self.place.cells, |c| {
            if !is_new(c) {
                return;
            }
            // q[axis][side][half along axis + 1][half along axis + 2].
            let q = [0, 1, 2].map(|axis| {
                let mut upper = c;
                upper[axis] += 1;
                [c, upper].map(|c| self.set_quarters(axis, from, to, c))
            });
            // Sums of q over its faces, weighted with the signs of side and of one half or both.
            let sum = |axis: usize, weight: &dyn Fn(f64, f64) -> f64| {
                let mut sum = 0.0;
                for side in 0..2 {
                    for [a, b] in HALVES {
                        sum += sign(side) * weight(sign(a), sign(b)) * q[axis][side][a][b];
                    }
                }
                0.125 * sum
            };
            let with_first = [0, 1, 2].map(|axis| sum(axis, &|a, _| a));
            let with_second = [0, 1, 2].map(|axis| sum(axis, &|_, b| b));
            let with_both = [0, 1, 2].map(|axis| 0.5 * sum(axis, &|a, b| a * b));
            for axis in 0..3 {
                let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
                for [ha, hb] in HALVES {
                    let mean = 0.5 * (q[axis][0][ha][hb] + q[axis][1][ha][hb]);
                    let curved = with_second[a] + with_first[b];
                    let twisted = sign(hb) * with_both[a] + sign(ha) * with_both[b];
                    let at =
                        self.quarter_position(axis, c, [ha, hb]) + self.refined.strides()[axis];
                    to.component_mut(axis)[at] = R::of(mean + curved + twisted);
                }
            }
        });
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
                let along = self.interpolation(component, true, false);
                for (row, across) in self.interpolation(third, false, false).iter().enumerate() {
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
    /// cells at inner sides as it was.
    pub fn average_cells<R: Real>(&self, from: &mut [R], to: &mut [R]) {
        let [_, a, b] = self.refined.strides();
        let at_inner_side = |axis: usize, c: usize| {
            let ends = [c == 0, c + 1 == self.place.cells[axis]];
            (0..2).any(|side| ends[side] && !self.shared[axis][side])
        };
        let differences = self.for_planes(to, |k, plane| {
            let (mut sum, mut count) = (0.0, 0.0);
            for (j, y) in self.inside(1).iter().enumerate() {
                let row = &mut plane[y * self.whole.row()..];
                let cells = self.rows([0, j, k], [0, a, b, a + b], from);
                for (i, (pairs, x)) in cells.zip(self.inside(0)).enumerate() {
                    let [p, q, r, s] = pairs.map(|[lower, upper]| lower.wide() + upper.wide());
                    let mean = 0.125 * ((p + q) + (r + s));
                    if at_inner_side(0, i) || at_inner_side(1, j) || at_inner_side(2, k) {
                        sum += row[*x].wide() - mean;
                        count += 1.0;
                    }
                    row[*x] = R::of(mean);
                }
            }
            [sum, count]
        });
        let [sum, count] = differences.iter().fold([0.0; 2], |[s, c], [t, d]| [s + t, c + d]);
        let shift = sum / f64::max(count, 1.0);
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

    /// Entry of this refined grid at the position `at` of another refined grid in the same box; none
    /// outside it. A component on faces includes those on the sides if `with_sides` is set.
    pub fn common_entry(
        &self,
        other: &Nesting,
        component: Option<usize>,
        with_sides: bool,
        at: [usize; 3],
    ) -> Option<usize> {
        let mut here = [0; 3];
        for axis in 0..3 {
            let shift = other.place.corner[axis] - self.place.corner[axis];
            let mut index = at[axis] as isize + RATIO as isize * shift;
            let n = self.refined.cells[axis] as isize;
            if self.periodic[axis] {
                let period = (RATIO * self.whole.cells[axis]) as isize;
                index = 1 + (index - 1).rem_euclid(period);
            }
            let range = match (component == Some(axis) && !self.spanned[axis], with_sides) {
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
