//! The sweeps of the projection: the divergence of the prediction, and the correction by the
//! pressure increment with everything that it measures, each a plane at a time while that plane is
//! in cache.
//!
//! Legend: u, v, w components along x, y, z; f pressure increment phi over density.

use glam::DVec3;

use super::FlowMeasures;
use crate::grid::{FaceVector, Layout, Run};
use crate::math::lanes::{Kernel, Partial, RowWork, Single, Vector, along_row, dispatch};
use crate::poisson::{Plane, Solution};

/// What one plane contributes to the measures.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlaneMeasures {
    pub flow: FlowMeasures,
    /// Sum of the tendencies over the unknown faces [m/s^2].
    pub tendency: DVec3,
    /// Pressure at the upper end less that at the lower end, summed over the lines along x and y.
    pub pressure_rise: [f64; 2],
    /// Whether `flow.max_divergence` still has to be measured, from the plane above.
    pub open: bool,
}

/// Divergence of one plane of the prediction over dt, the right-hand side of the Poisson equation.
pub struct Divergence<'a> {
    pub layout: Layout,
    pub periodic: [bool; 3],
    pub predicted: &'a FaceVector,
    pub k: usize,
    /// 1/h along each axis [1/m].
    pub inverse: [f64; 3],
    pub dt: f64,
    pub out: &'a mut Plane,
}

impl Kernel for Divergence<'_> {
    #[inline(always)]
    fn run<V: Vector>(self) {
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
        let cut = |values: &'_ [f64], j: usize, k: usize| -> std::ops::Range<usize> {
            let at = layout.index(0, j, k);
            debug_assert!(at + layout.row() <= values.len());
            at..at + layout.row()
        };
        let (above_k, above_y) = (next(k, nz, periodic[2]), |j| next(j, ny, periodic[1]));
        for j in 1..=ny {
            let u = &predicted.x[cut(&predicted.x, j, k)];
            let mut work = DivergenceRow {
                u,
                v: &predicted.y[cut(&predicted.y, j, k)],
                vp: &predicted.y[cut(&predicted.y, above_y(j), k)],
                w: &predicted.z[cut(&predicted.z, j, k)],
                wp: &predicted.z[cut(&predicted.z, j, above_k)],
                inverse,
                dt,
                out: out.row_mut(j),
            };
            if periodic[0] {
                // The upper face of the last cell is the lower face of the first.
                along_row::<V>(n - 1, &mut work);
                let last = [u[n], u[1]];
                work.u = &last;
                work.one(n, 0);
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

struct DivergenceRow<'a> {
    u: &'a [f64],
    v: &'a [f64],
    vp: &'a [f64],
    w: &'a [f64],
    wp: &'a [f64],
    inverse: [f64; 3],
    dt: f64,
    out: &'a mut [f64],
}

impl DivergenceRow<'_> {
    /// Entries from `i` on, the x faces from place `at` of `u` on.
    #[inline(always)]
    fn value<V: Vector>(&mut self, i: usize, at: usize) {
        let load = |row: &[f64]| V::load(&row[i..]);
        let [x, y, z] = self.inverse.map(V::splat);
        let u = [V::load(&self.u[at..]), V::load(&self.u[at + 1..])];
        let sum = (u[1] - u[0]) * x
            + (load(self.vp) - load(self.v)) * y
            + (load(self.wp) - load(self.w)) * z;
        sum.over(V::splat(self.dt)).store(&mut self.out[i..]);
    }
    #[inline(always)]
    fn one(&mut self, i: usize, at: usize) {
        self.value::<Single>(i, at);
    }
}

impl RowWork for DivergenceRow<'_> {
    #[inline(always)]
    fn at<V: Vector>(&mut self, i: usize) {
        self.value::<V>(i, i);
    }
}

/// One plane of u = u* - dt grad f and p += f; ghosts are left to the caller.
pub struct Correct<'a> {
    pub layout: Layout,
    pub predicted: &'a FaceVector,
    pub solution: Solution<'a>,
    pub walled: [bool; 3],
    pub k: usize,
    pub inverse: [f64; 3],
    /// dt/h along each axis [s/m].
    pub pull: [f64; 3],
    pub velocity: [&'a mut [f64]; 3],
    pub pressure: &'a mut [f64],
    pub measures: &'a mut PlaneMeasures,
}

impl Kernel for Correct<'_> {
    #[inline(always)]
    fn run<V: Vector>(self) {
        let (layout, k) = (self.layout, self.k);
        let (row, n, ny) = (layout.row(), layout.cells[0], layout.cells[1]);
        let [x, y, z] = self.velocity;
        let predicted = self.predicted;
        let mut partial = CorrectPartial::default();
        let mut rise = [0.0; 2];
        for j in 1..=ny {
            let (at, here) = (layout.index(0, j, k), j * row..(j + 1) * row);
            let mut work = CorrectRow {
                q: [0, 1, 2].map(|axis| &predicted.component(axis)[at..][..row]),
                f: self.solution.here.row(j),
                lower: [self.solution.here.row(j - 1), self.solution.below.row(j)],
                inverse: self.inverse,
                pull: self.pull,
                out: [
                    &mut x[here.clone()],
                    &mut y[here.clone()],
                    &mut z[here.clone()],
                ],
                pressure: &mut self.pressure[here],
                partial: &mut partial,
                given: [false, self.walled[1] && j == 1, self.walled[2] && k == 1],
            };
            along_row::<V>(n, &mut work);
            if self.walled[0] {
                partial.momentum[0].add(1, Single::splat(-x[j * row + 1]));
            }
            rise[0] += self.pressure[j * row + n] - self.pressure[j * row + 1];
        }
        for i in 1..=n {
            rise[1] += self.pressure[ny * row + i] - self.pressure[row + i];
        }
        *self.measures = PlaneMeasures {
            flow: FlowMeasures {
                max_divergence: 0.0,
                max_rate: partial.rate.largest(),
                max_velocity: partial.square.largest(),
                kinetic_energy: 0.5 * partial.kinetic.sum(),
                momentum: DVec3::from_array(partial.momentum.map(|sum| sum.sum())),
            },
            pressure_rise: rise,
            open: true,
            ..*self.measures
        };
    }
}

#[derive(Default)]
struct CorrectPartial {
    rate: Partial,
    square: Partial,
    kinetic: Partial,
    momentum: [Partial; 3],
}

struct CorrectRow<'a> {
    q: [&'a [f64]; 3],
    f: &'a [f64],
    /// The increment one row down in y and in z.
    lower: [&'a [f64]; 2],
    inverse: [f64; 3],
    pull: [f64; 3],
    out: [&'a mut [f64]; 3],
    pressure: &'a mut [f64],
    partial: &'a mut CorrectPartial,
    given: [bool; 3],
}

impl RowWork for CorrectRow<'_> {
    #[inline(always)]
    fn at<V: Vector>(&mut self, i: usize) {
        let f = V::load(&self.f[i..]);
        let lower = [
            V::load(&self.f[i - 1..]),
            V::load(&self.lower[0][i..]),
            V::load(&self.lower[1][i..]),
        ];
        let (mut square, mut rate) = (V::splat(0.0), V::splat(0.0));
        for axis in 0..3 {
            let q = V::load(&self.q[axis][i..]);
            let q = q - V::splat(self.pull[axis]) * (f - lower[axis]);
            q.store(&mut self.out[axis][i..]);
            square = square + q * q;
            rate = rate + q.magnitude() * V::splat(self.inverse[axis]);
            if !self.given[axis] {
                self.partial.momentum[axis].add(i, q);
            }
        }
        let p = &mut self.pressure[i..];
        (V::load(p) + f).store(p);
        self.partial.rate.keep_larger(i, rate);
        self.partial.square.keep_larger(i, square);
        self.partial.kinetic.add(i, square);
    }
}

/// Largest |div u| of one plane, given its x and y faces and both layers of z faces around it.
pub struct Largest<'a> {
    pub layout: Layout,
    pub inverse: [f64; 3],
    pub x: &'a [f64],
    pub y: &'a [f64],
    pub z: [&'a [f64]; 2],
    pub found: &'a mut f64,
}

impl Kernel for Largest<'_> {
    #[inline(always)]
    fn run<V: Vector>(self) {
        let row = self.layout.row();
        let mut partial = Partial::default();
        for j in 1..=self.layout.cells[1] {
            let here = j * row..(j + 1) * row;
            let mut work = LargestRow {
                u: &self.x[here.clone()],
                v: &self.y[here.clone()],
                vp: &self.y[(j + 1) * row..(j + 2) * row],
                w: &self.z[0][here.clone()],
                wp: &self.z[1][here],
                inverse: self.inverse,
                partial: &mut partial,
            };
            along_row::<V>(self.layout.cells[0], &mut work);
        }
        *self.found = partial.largest();
    }
}

struct LargestRow<'a> {
    u: &'a [f64],
    v: &'a [f64],
    vp: &'a [f64],
    w: &'a [f64],
    wp: &'a [f64],
    inverse: [f64; 3],
    partial: &'a mut Partial,
}

impl RowWork for LargestRow<'_> {
    #[inline(always)]
    fn at<V: Vector>(&mut self, i: usize) {
        let load = |row: &[f64]| V::load(&row[i..]);
        let [x, y, z] = self.inverse.map(V::splat);
        let divergence = (V::load(&self.u[i + 1..]) - load(self.u)) * x
            + (load(self.vp) - load(self.v)) * y
            + (load(self.wp) - load(self.w)) * z;
        self.partial.keep_larger(i, divergence.magnitude());
    }
}

/// Measures plane k - 1 of a run, now that plane k is there.
pub fn measure_below(layout: Layout, inverse: [f64; 3], k: usize, run: &mut Run<4, PlaneMeasures>) {
    if !run.range().contains(&(k - 1)) {
        return;
    }
    let ([[x, _], [y, _], [z, above], _], measures) = run.two_planes(k);
    measures.open = false;
    dispatch(Largest {
        layout,
        inverse,
        x,
        y,
        z: [z, above],
        found: &mut measures.flow.max_divergence,
    });
}
