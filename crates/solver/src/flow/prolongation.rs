//! Prolongation: values of the whole grid on a refined box.
//!
//! Legend: c index of a cell of the whole grid, f of a cell or face of the refined grid, both
//! counted from 0 at the lower corner of the refined box; i, j, k positions in the arrays, from 1.

use rayon::prelude::*;

use super::nesting::{Nesting, RATIO};
use crate::grid::FaceVector;
use crate::math::Real;

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

    /// Sets a refined field. Where an old refined box overlaps this one, its values are kept.
    /// Elsewhere `from`, a field of the whole grid, is interpolated linearly. Without `from`, as
    /// for the velocity, the values stay. A field on faces has a `component`, and includes the
    /// upper side.
    pub fn transfer<R: Real>(
        &self,
        component: Option<usize>,
        old: Option<(&Nesting, &[R])>,
        from: Option<&[R]>,
        to: &mut [R],
    ) {
        let layout = self.refined;
        let last = [0, 1, 2].map(|axis| layout.cells[axis] + usize::from(component == Some(axis)));
        let interpolated = from.map(|from| self.interpolated(component, from));
        let old = old.map(|(old, values)| {
            // Only the velocity is known on the sides of the old box.
            let with_sides = from.is_none();
            let common =
                |axis| old.common_positions(self, axis, component == Some(axis), with_sides);
            (old.refined, values, [0, 1, 2].map(common))
        });
        let planes = to.par_chunks_exact_mut(layout.plane()).enumerate();
        planes.filter(|(k, _)| (1..=last[2]).contains(k)).for_each(|(k, plane)| {
            for j in 1..=last[1] {
                let old_row = old.as_ref().and_then(|(layout, values, [at_x, at_y, at_z])| {
                    let start = layout.index(0, at_y[j]?, at_z[k]?);
                    Some((&values[start..][..layout.row()], at_x))
                });
                let row = &mut plane[j * layout.row()..][..=last[0]];
                for (i, value) in row.iter_mut().enumerate().skip(1) {
                    if let Some(kept) = old_row.and_then(|(old, at_x)| Some(old[at_x[i]?])) {
                        *value = kept;
                    } else if let Some(interpolated) = &interpolated {
                        *value = interpolated([i, j, k]);
                    }
                }
            }
        });
    }

    /// Returns whether a cell of the whole grid lies outside an old refined box. Cells are counted
    /// from 0 at the lower corner of this box.
    pub fn new_cells(&self, old: Option<&Nesting>) -> impl Fn([usize; 3]) -> bool + use<> {
        let common =
            old.map(|old| [0, 1, 2].map(|axis| old.common_positions(self, axis, false, false)));
        move |c| {
            let is_common = |at: &[Vec<Option<usize>>; 3]| {
                (0..3).all(|axis| at[axis][RATIO * c[axis] + 1].is_some())
            };
            !common.as_ref().is_some_and(is_common)
        }
    }

    /// Value at each entry of a refined field by linear interpolation. At walls and open sides of
    /// the whole box the nearest values inside are extrapolated, because the tendency has no ghosts
    /// and the pressure has no slope there.
    fn interpolated<R: Real>(
        &self,
        component: Option<usize>,
        from: &[R],
    ) -> impl Fn([usize; 3]) -> R {
        let pairs = [0, 1, 2].map(|axis| self.interpolation(axis, component == Some(axis), true));
        move |[i, j, k]| {
            let mut sum = 0.0;
            for (z, by_z) in pairs[2][k - 1] {
                for (y, by_y) in pairs[1][j - 1] {
                    for (x, by_x) in pairs[0][i - 1] {
                        sum += by_x * by_y * by_z * from[self.whole.index(x, y, z)].wide();
                    }
                }
            }
            R::of(sum)
        }
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

    /// Sets the normal velocities of the four refined faces on the lower face of cell `c` along
    /// `axis`: linear in the position, with the flux of the face. Returns them by lower and upper
    /// half along the two axes after it.
    fn set_quarters<R: Real>(
        &self,
        axis: usize,
        from: &FaceVector<R>,
        to: &mut FaceVector<R>,
        c: [usize; 3],
    ) -> [[f64; 2]; 2] {
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
        let values = [
            [mean - along_a - along_b, mean - along_a + along_b],
            [mean + along_a - along_b, mean + along_a + along_b],
        ];
        for half in HALVES {
            let at = self.quarter_position(axis, c, half);
            to.component_mut(axis)[at] = R::of(values[half[0]][half[1]]);
        }
        values
    }

    /// Sets the velocity of `to` in the cells of the refined box that `is_new` selects. On the
    /// faces of the whole grid it is that of [`Self::set_quarters`]. Inside its cells it is the one
    /// by Toth and Roe (2002): all eight refined cells of a cubic cell have its divergence.
    pub fn prolong_velocity<R: Real>(
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

    /// Fills the ghosts of the tangential velocities of `to` beyond the inner sides: on the
    /// parabola through the value of the whole grid, half a cell of it outside, and the two nearest
    /// inside.
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
}
