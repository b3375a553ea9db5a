//! Kernels of the projection, one plane at a time: divergence of the prediction; correction of
//! velocity and pressure by the increment, with the measures of the flow.
//!
//! Legend: u, v, w components along x, y, z; q any of them; f pressure increment over density;
//! suffixes as in `prediction.rs`: l/r left and right in x, m/p down and up in y, b/t in z.

use std::ops::Range;

use glam::DVec3;

use crate::grid::{FaceVector, Layout};
use crate::math::Real;
use crate::poisson::{Plane, Solution};
use grainwake_simd::{
    Kernel, Maximum, Partial, RowWork, Scalar, Vector, along_row, inner_lines, window, window_mut,
};

/// Measures of the flow over the whole grid after a projection.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlowMeasures {
    /// Largest |div u| [1/s].
    pub max_divergence: f64,
    /// Largest sum of |u_a| / h_a of a cell [1/s].
    pub max_rate: f64,
    /// Largest speed of a face [m/s].
    pub max_velocity: f64,
    /// Kinetic energy of the box per density [m^5/s^2].
    pub kinetic_energy: f64,
    /// Momentum of all unknown faces per density [m^4/s].
    pub momentum: DVec3,
}

/// Contribution of one plane to the measures of the flow.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlaneMeasures {
    /// Measures of the plane alone; `max_velocity` is squared, integrals are sums over cells.
    pub flow: FlowMeasures,
    /// Sum of the tendencies over the unknown faces [m/s^2].
    pub tendency: DVec3,
    /// Pressure difference between upper and lower end, summed over the lines along x and along y.
    pub pressure_rise: [f64; 2],
}

/// Divergence of one plane of the prediction over dt, the right-hand side of the Poisson equation.
pub struct Divergence<'a, R> {
    /// Layout of all fields.
    pub layout: Layout,
    /// Whether each axis is periodic.
    pub periodic: [bool; 3],
    /// Prediction u* [m/s].
    pub predicted: &'a FaceVector<R>,
    /// Index of the plane.
    pub k: usize,
    /// 1/h along each axis [1/m].
    pub inverse: [f64; 3],
    /// Time step [s].
    pub dt: f64,
    /// Divergence over dt [1/s^2], overwritten.
    pub out: &'a mut Plane<R>,
}

impl<R: Real> Kernel for Divergence<'_, R> {
    type Number = R;
    #[inline(always)]
    fn run<V: Vector<Number = R>>(self) {
        let Divergence { layout, periodic, predicted, k, inverse, dt, out } = self;
        let [n, ny, nz] = layout.cells;
        let u = layout.plane_of(&predicted.x, k);
        let v = layout.plane_of(&predicted.y, k);
        let w = layout.plane_of(&predicted.z, k);
        let wt = layout.plane_of(&predicted.z, next(k, nz, periodic[2]));
        for j in 1..=ny {
            let mut work = DivergenceRow {
                u: layout.row_of(u, j),
                v: layout.row_of(v, j),
                vp: layout.row_of(v, next(j, ny, periodic[1])),
                w: layout.row_of(w, j),
                wt: layout.row_of(wt, j),
                inverse,
                dt,
                out: &mut out.row_mut(j)[..n + 2],
            };
            if periodic[0] {
                // The upper face of the last cell is the lower face of the first.
                along_row::<V>(n - 1, &mut work);
                work.value(n, Scalar(work.u[1]));
            } else {
                along_row::<V>(n, &mut work);
            }
        }
    }
}

/// Index of the layer above layer `at` of an axis with `n` layers.
#[inline(always)]
fn next(at: usize, n: usize, periodic: bool) -> usize {
    if at == n && periodic { 1 } else { at + 1 }
}

/// One row of cells. All slices have one length, so that one bounds check serves all of them.
struct DivergenceRow<'a, R> {
    u: &'a [R],
    v: &'a [R],
    vp: &'a [R],
    w: &'a [R],
    wt: &'a [R],
    inverse: [f64; 3],
    dt: f64,
    out: &'a mut [R],
}

impl<R: Real> DivergenceRow<'_, R> {
    /// Cells from `i` on, whose upper x faces have the velocity `ur`.
    #[inline(always)]
    fn value<V: Vector<Number = R>>(&mut self, i: usize, ur: V) {
        let here = |row: &[R]| V::load(&window::<V>(row, i)[1..]);
        let [x, y, z] = self.inverse.map(V::constant);
        let sum = (ur - here(self.u)) * x
            + (here(self.vp) - here(self.v)) * y
            + (here(self.wt) - here(self.w)) * z;
        sum.div(V::constant(self.dt)).store(window_mut::<V>(self.out, i));
    }
}

impl<R: Real> RowWork for DivergenceRow<'_, R> {
    type Number = R;
    #[inline(always)]
    fn at<V: Vector<Number = R>>(&mut self, i: usize) {
        let ur = V::load(&window::<V>(self.u, i)[2..]);
        self.value(i, ur);
    }
}

/// Correction of one plane: u = u* - dt grad f, p += f; the caller fills the ghosts.
pub struct Correct<'a, R> {
    /// Layout of all fields.
    pub layout: Layout,
    /// Prediction u* [m/s].
    pub predicted: &'a FaceVector<R>,
    /// Pressure increment over density f [m^2/s^2].
    pub solution: Solution<'a, R>,
    /// Whether each axis is periodic.
    pub periodic: [bool; 3],
    /// Index of the plane.
    pub k: usize,
    /// 1/h along each axis [1/m].
    pub inverse: [f64; 3],
    /// dt/h along each axis [s/m].
    pub dt_per_h: [f64; 3],
    /// Whether the velocity is written with non-temporal stores.
    pub non_temporal: bool,
    /// Plane of the corrected velocity [m/s], overwritten.
    pub velocity: [&'a mut [R]; 3],
    /// Plane of the pressure over density [m^2/s^2], to which f is added.
    pub pressure: &'a mut [R],
    /// Measures of the plane, overwritten except for `tendency`.
    pub measures: &'a mut PlaneMeasures,
}

impl<R: Real> Kernel for Correct<'_, R> {
    type Number = R;
    #[inline(always)]
    fn run<V: Vector<Number = R>>(self) {
        let (layout, k, periodic) = (self.layout, self.k, self.periodic);
        let [n, ny, nz] = layout.cells;
        let u = layout.plane_of(&self.predicted.x, k);
        let v = layout.plane_of(&self.predicted.y, k);
        let w = layout.plane_of(&self.predicted.z, k);
        let wt = layout.plane_of(&self.predicted.z, next(k, nz, periodic[2]));
        let [x, y, z] = self.velocity.map(|plane| &mut plane[..layout.plane()]);
        let p = &mut self.pressure[..layout.plane()];
        let Solution { here: f, below: fb, above: ft } = self.solution;
        let mut partial = CorrectPartial::<R>::default();
        let mut rise = [0.0; 2];
        for j in 1..=ny {
            let out = [layout.row_of_mut(x, j), layout.row_of_mut(y, j), layout.row_of_mut(z, j)];
            let streamed = if self.non_temporal { inner_lines::<V>(out[0], n) } else { 0..0 };
            let mut work = CorrectRow {
                q: [layout.row_of(u, j), layout.row_of(v, j), layout.row_of(w, j)],
                vp: layout.row_of(v, next(j, ny, periodic[1])),
                wt: layout.row_of(wt, j),
                f: &f.row(j)[..n + 2],
                lower: [&f.row(j - 1)[..n + 2], &fb.row(j)[..n + 2]],
                upper: [&f.row(j + 1)[..n + 2], &ft.row(j)[..n + 2]],
                inverse: self.inverse,
                dt_per_h: self.dt_per_h,
                out,
                pressure: layout.row_of_mut(p, j),
                streamed,
                partial: &mut partial,
                prescribed: [false, !periodic[1] && j == 1, !periodic[2] && k == 1],
            };
            if periodic[0] {
                // The upper face of the last cell is the lower face of the first.
                along_row::<V>(n - 1, &mut work);
                work.value(n, Scalar(work.q[0][1]));
            } else {
                along_row::<V>(n, &mut work);
                // The sum contains the lower boundary face, which is no unknown.
                let prescribed = -work.out[0][1].wide();
                work.partial.momentum[0].add(1, Scalar::<R>::constant(prescribed));
            }
            rise[0] += work.pressure[n].wide() - work.pressure[1].wide();
        }
        let (first, last) = (layout.row_of(p, 1), layout.row_of(p, ny));
        for i in 1..=n {
            rise[1] += last[i].wide() - first[i].wide();
        }
        V::fence();
        *self.measures = PlaneMeasures {
            flow: FlowMeasures {
                max_divergence: partial.divergence.get(),
                max_rate: partial.rate.get(),
                max_velocity: partial.square.get(),
                kinetic_energy: 0.5 * partial.kinetic.sum(),
                momentum: DVec3::from_array(partial.momentum.map(|sum| sum.sum())),
            },
            pressure_rise: rise,
            ..*self.measures
        };
    }
}

/// Partial measures of a plane.
#[derive(Default)]
struct CorrectPartial<R> {
    divergence: Maximum<R>,
    rate: Maximum<R>,
    square: Maximum<R>,
    kinetic: Partial,
    momentum: [Partial; 3],
}

/// One row of cells. All slices have one length, so that one bounds check serves all of them.
struct CorrectRow<'a, R> {
    /// Prediction on the lower faces, and on the upper ones along y and z.
    q: [&'a [R]; 3],
    vp: &'a [R],
    wt: &'a [R],
    f: &'a [R],
    /// Increment one row down in y and in z, and one row up.
    lower: [&'a [R]; 2],
    upper: [&'a [R]; 2],
    inverse: [f64; 3],
    dt_per_h: [f64; 3],
    out: [&'a mut [R]; 3],
    pressure: &'a mut [R],
    /// Entries of the row that are written with non-temporal stores.
    streamed: Range<usize>,
    partial: &'a mut CorrectPartial<R>,
    /// Components whose faces on the whole row have a prescribed velocity.
    prescribed: [bool; 3],
}

impl<R: Real> CorrectRow<'_, R> {
    /// Cells from `i` on, whose upper x faces have the predicted velocity `ur`.
    #[inline(always)]
    fn value<V: Vector<Number = R>>(&mut self, i: usize, ur: V) {
        let left = |row: &[R]| V::load(window::<V>(row, i));
        let here = |row: &[R]| V::load(&window::<V>(row, i)[1..]);
        let right = |row: &[R]| V::load(&window::<V>(row, i)[2..]);
        let f = here(self.f);
        let lower = [left(self.f), here(self.lower[0]), here(self.lower[1])];
        let upper = [right(self.f), here(self.upper[0]), here(self.upper[1])];
        let above = [ur, here(self.vp), here(self.wt)];
        let zero = V::constant(0.0);
        let (mut square, mut rate, mut divergence) = (zero, zero, zero);
        // The ghosts are filled from the ends of a row, which therefore stay in the cache.
        let streamed = self.streamed.contains(&i);
        for axis in 0..3 {
            let (dt_per_h, inverse) =
                (V::constant(self.dt_per_h[axis]), V::constant(self.inverse[axis]));
            let q = here(self.q[axis]) - dt_per_h * (f - lower[axis]);
            let next = above[axis] - dt_per_h * (upper[axis] - f);
            let to = window_mut::<V>(self.out[axis], i);
            if streamed {
                q.store_non_temporal(to);
            } else {
                q.store(to);
            }
            square = square + q * q;
            rate = rate + q.abs() * inverse;
            divergence = divergence + (next - q) * inverse;
            if !self.prescribed[axis] {
                self.partial.momentum[axis].add(i, q);
            }
        }
        let p = window_mut::<V>(self.pressure, i);
        (V::load(p) + f).store(p);
        let partial = &mut *self.partial;
        partial.divergence.include(i, divergence.abs());
        partial.rate.include(i, rate);
        partial.square.include(i, square);
        partial.kinetic.add(i, square);
    }
}

impl<R: Real> RowWork for CorrectRow<'_, R> {
    type Number = R;
    #[inline(always)]
    fn at<V: Vector<Number = R>>(&mut self, i: usize) {
        let ur = V::load(&window::<V>(self.q[0], i)[2..]);
        self.value(i, ur);
    }
}
