//! The sweeps of the projection: the divergence of the prediction, and the correction by the
//! pressure increment with everything that it measures, each a plane at a time while that plane is
//! in cache.
//!
//! Legend: u, v, w components along x, y, z; f pressure increment phi over density.

use glam::DVec3;

use super::FlowMeasures;
use crate::grid::{FaceVector, Layout};
use crate::math::Real;
use crate::poisson::{Plane, Solution};
use grainwake_simd::{Kernel, One, Partial, RowWork, Vector, along_row};

/// What one plane contributes to the measures.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlaneMeasures {
    pub flow: FlowMeasures,
    /// Sum of the tendencies over the unknown faces [m/s^2].
    pub tendency: DVec3,
    /// Pressure at the upper end less that at the lower end, summed over the lines along x and y.
    pub pressure_rise: [f64; 2],
}

/// Divergence of one plane of the prediction over dt, the right-hand side of the Poisson equation.
pub struct Divergence<'a, R> {
    pub layout: Layout,
    pub periodic: [bool; 3],
    pub predicted: &'a FaceVector<R>,
    pub k: usize,
    /// 1/h along each axis [1/m].
    pub inverse: [f64; 3],
    pub dt: f64,
    pub out: &'a mut Plane<R>,
}

impl<R: Real> Kernel for Divergence<'_, R> {
    type Number = R;
    #[inline(always)]
    fn run<V: Vector<Number = R>>(self) {
        let Divergence {
            layout,
            periodic,
            predicted,
            k,
            inverse,
            dt,
            out,
        } = self;
        let [n, ny, nz] = layout.cells;
        let row = layout.row();
        for j in 1..=ny {
            let at = layout.index(0, j, k);
            let up = layout.index(0, next(j, ny, periodic[1]), k);
            let above = layout.index(0, j, next(k, nz, periodic[2]));
            let mut work = DivergenceRow {
                u: &predicted.x[at..][..row],
                v: &predicted.y[at..][..row],
                vp: &predicted.y[up..][..row],
                w: &predicted.z[at..][..row],
                wp: &predicted.z[above..][..row],
                inverse,
                dt,
                out: out.row_mut(j),
            };
            if periodic[0] {
                // The upper face of the last cell is the lower face of the first.
                along_row::<V>(n - 1, &mut work);
                let last = [work.u[n], work.u[1]];
                work.u = &last;
                work.value::<One<R>>(n, 0);
            } else {
                along_row::<V>(n, &mut work);
            }
        }
    }
}

/// The layer above layer `at` of an axis.
#[inline(always)]
fn next(at: usize, n: usize, periodic: bool) -> usize {
    if at == n && periodic { 1 } else { at + 1 }
}

struct DivergenceRow<'a, R> {
    u: &'a [R],
    v: &'a [R],
    vp: &'a [R],
    w: &'a [R],
    wp: &'a [R],
    inverse: [f64; 3],
    dt: f64,
    out: &'a mut [R],
}

impl<R: Real> DivergenceRow<'_, R> {
    /// Entries from `i` on, the x faces from place `at` of `u` on.
    #[inline(always)]
    fn value<V: Vector<Number = R>>(&mut self, i: usize, at: usize) {
        let load = |row: &[R]| V::load(&row[i..]);
        let [x, y, z] = self.inverse.map(V::constant);
        let u = [V::load(&self.u[at..]), V::load(&self.u[at + 1..])];
        let sum = (u[1] - u[0]) * x
            + (load(self.vp) - load(self.v)) * y
            + (load(self.wp) - load(self.w)) * z;
        sum.over(V::constant(self.dt)).store(&mut self.out[i..]);
    }
}

impl<R: Real> RowWork for DivergenceRow<'_, R> {
    type Number = R;
    #[inline(always)]
    fn at<V: Vector<Number = R>>(&mut self, i: usize) {
        self.value::<V>(i, i);
    }
}

/// One plane of u = u* - dt grad f and p += f; ghosts are left to the caller.
pub struct Correct<'a, R> {
    pub layout: Layout,
    pub predicted: &'a FaceVector<R>,
    pub solution: Solution<'a, R>,
    pub periodic: [bool; 3],
    pub k: usize,
    pub inverse: [f64; 3],
    /// dt/h along each axis [s/m].
    pub pull: [f64; 3],
    /// Whether the velocity is written past the caches.
    pub past_caches: bool,
    pub velocity: [&'a mut [R]; 3],
    pub pressure: &'a mut [R],
    pub measures: &'a mut PlaneMeasures,
}

impl<R: Real> Kernel for Correct<'_, R> {
    type Number = R;
    #[inline(always)]
    fn run<V: Vector<Number = R>>(self) {
        let (layout, k, periodic) = (self.layout, self.k, self.periodic);
        let (row, [n, ny, nz]) = (layout.row(), layout.cells);
        let [x, y, z] = self.velocity;
        let (predicted, solution) = (self.predicted, self.solution);
        let mut partial = CorrectPartial::default();
        let mut rise = [0.0; 2];
        for j in 1..=ny {
            let (at, here) = (layout.index(0, j, k), j * row..(j + 1) * row);
            let up = layout.index(0, next(j, ny, periodic[1]), k);
            let above = layout.index(0, j, next(k, nz, periodic[2]));
            let mut work = CorrectRow {
                q: [0, 1, 2].map(|axis| &predicted.component(axis)[at..][..row]),
                u: &predicted.x[at..][..row],
                vp: &predicted.y[up..][..row],
                wp: &predicted.z[above..][..row],
                f: solution.here.row(j),
                lower: [solution.here.row(j - 1), solution.below.row(j)],
                upper: [solution.here.row(j + 1), solution.above.row(j)],
                inverse: self.inverse,
                pull: self.pull,
                out: [
                    &mut x[here.clone()],
                    &mut y[here.clone()],
                    &mut z[here.clone()],
                ],
                pressure: &mut self.pressure[here],
                n,
                past_caches: self.past_caches,
                partial: &mut partial,
                given: [false, !periodic[1] && j == 1, !periodic[2] && k == 1],
            };
            if periodic[0] {
                along_row::<V>(n - 1, &mut work);
                let last = [work.u[n], work.u[1]];
                work.u = &last;
                work.value::<One<R>>(n, 0);
            } else {
                along_row::<V>(n, &mut work);
                // The lower boundary face was summed with the others.
                let given = -x[j * row + 1].wide();
                partial.momentum[0].add(1, One::<R>::constant(given));
            }
            rise[0] += self.pressure[j * row + n].wide() - self.pressure[j * row + 1].wide();
        }
        for i in 1..=n {
            rise[1] += self.pressure[ny * row + i].wide() - self.pressure[row + i].wide();
        }
        V::fence();
        *self.measures = PlaneMeasures {
            flow: FlowMeasures {
                max_divergence: partial.divergence.largest(),
                max_rate: partial.rate.largest(),
                max_velocity: partial.square.largest(),
                kinetic_energy: 0.5 * partial.kinetic.sum(),
                momentum: DVec3::from_array(partial.momentum.map(|sum| sum.sum())),
            },
            pressure_rise: rise,
            ..*self.measures
        };
    }
}

#[derive(Default)]
struct CorrectPartial {
    divergence: Partial,
    rate: Partial,
    square: Partial,
    kinetic: Partial,
    momentum: [Partial; 3],
}

struct CorrectRow<'a, R> {
    q: [&'a [R]; 3],
    /// Prediction on the upper faces: from place `at` + 1, one row up in y and in z.
    u: &'a [R],
    vp: &'a [R],
    wp: &'a [R],
    f: &'a [R],
    /// The increment one row down in y and in z, and one up.
    lower: [&'a [R]; 2],
    upper: [&'a [R]; 2],
    inverse: [f64; 3],
    pull: [f64; 3],
    out: [&'a mut [R]; 3],
    pressure: &'a mut [R],
    n: usize,
    past_caches: bool,
    partial: &'a mut CorrectPartial,
    given: [bool; 3],
}

impl<R: Real> CorrectRow<'_, R> {
    /// Entries from `i` on, the upper x faces from place `at` + 1 of `u` on.
    #[inline(always)]
    fn value<V: Vector<Number = R>>(&mut self, i: usize, at: usize) {
        let load = |row: &[R]| V::load(&row[i..]);
        let f = load(self.f);
        let lower = [
            V::load(&self.f[i - 1..]),
            load(self.lower[0]),
            load(self.lower[1]),
        ];
        let upper = [
            V::load(&self.f[i + 1..]),
            load(self.upper[0]),
            load(self.upper[1]),
        ];
        let above = [V::load(&self.u[at + 1..]), load(self.vp), load(self.wp)];
        let zero = V::constant(0.0);
        let (mut square, mut rate, mut divergence) = (zero, zero, zero);
        // The ends of a row are looked at again for the ghosts.
        let past = self.past_caches && i > 1 && i + V::WIDTH <= self.n;
        for axis in 0..3 {
            let (pull, inverse) = (
                V::constant(self.pull[axis]),
                V::constant(self.inverse[axis]),
            );
            let q = load(self.q[axis]) - pull * (f - lower[axis]);
            let next = above[axis] - pull * (upper[axis] - f);
            let to = &mut self.out[axis][i..];
            if past {
                q.store_past(to);
            } else {
                q.store(to);
            }
            square = square + q * q;
            rate = rate + q.magnitude() * inverse;
            divergence = divergence + (next - q) * inverse;
            if !self.given[axis] {
                self.partial.momentum[axis].add(i, q);
            }
        }
        let p = &mut self.pressure[i..];
        (V::load(p) + f).store(p);
        let partial = &mut *self.partial;
        partial.divergence.keep_larger(i, divergence.magnitude());
        partial.rate.keep_larger(i, rate);
        partial.square.keep_larger(i, square);
        partial.kinetic.add(i, square);
    }
}

impl<R: Real> RowWork for CorrectRow<'_, R> {
    type Number = R;
    #[inline(always)]
    fn at<V: Vector<Number = R>>(&mut self, i: usize) {
        self.value::<V>(i, i);
    }
}
