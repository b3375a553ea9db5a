//! Restriction: means over a refined box on the whole grid.
//!
//! Legend: i, j, k cell of the whole grid, counted from 0 at the lower corner of the refined box.

use rayon::prelude::*;

use super::nesting::{Nesting, RATIO};
use crate::math::Real;

impl Nesting {
    /// Replaces the values of `to` on the faces inside the refined box by the means over the four
    /// refined faces on each. Faces on inner sides and walls keep theirs. Returns the momentum
    /// [m^4/s] and the kinetic energy [m^5/s^2] per density that the whole grid gains.
    pub fn average_faces<R: Real>(&self, axis: usize, from: &[R], to: &mut [R]) -> [f64; 2] {
        let first = [0, 1, 2].map(|along| usize::from(along == axis && !self.spanned[axis]));
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3].map(|axis| self.refined.strides()[axis]);
        let gains = self.for_planes(to, |k, plane| {
            let mut gain = [0.0; 2];
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
                    gain[0] += new - old;
                    gain[1] += 0.5 * (new * new - old * old);
                    row[*x] = mean;
                }
            }
            gain
        });
        let v = self.cell_volume;
        gains.iter().fold([0.0; 2], |[p, e], [dp, de]| [p + v * dp, e + v * de])
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
}
