//! Kernels of the projection, one plane at a time: divergence of the prediction; correction of
//! velocity and pressure by the increment, with the measures of the flow.
//!
//! Legend: u, v, w components along x, y, z; q any of them; f pressure increment over density;
//! suffixes as in `prediction.rs`: l/r left and right in x, m/p down and up in y, b/t in z.

use std::ops::Range;

use glam::DVec3;

use super::prediction::undo_prescribed;
use crate::grid::{FaceVector, Layout, Mesh};
use crate::math::Real;
use crate::poisson::{Plane, Solution};
use grainwake_simd::{
    Kernel, Maximum, Partial, RowWork, Scalar, Vector, along_row, inner_lines, store_in_rows,
    window, window_mut,
};

/// Measures of the flow over the whole grid after a projection.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlowMeasures {
    /// Largest |div u| [1/s].
    pub max_divergence: f64,
    /// Largest sum of |u_a| / h_a of a cell [1/s].
    pub max_rate: f64,
    /// Square root of the largest u^2 + v^2 + w^2 of a cell, with the velocities of its three lower
    /// faces [m/s].
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

/// Planes of the prediction u* on the faces of one plane of cells [m/s].
pub struct FacePlanes<'a, R> {
    pub layout: Layout,
    /// Whether each axis is periodic.
    pub periodic: [bool; 3],
    /// [`Mesh::per_spacing`] [1/m].
    pub inverse: [f64; 3],
    /// Lower faces of the cells along each axis.
    lower: [&'a [R]; 3],
    /// Upper faces along z.
    above: &'a [R],
}

impl<'a, R: Real> FacePlanes<'a, R> {
    /// Faces of the plane `k` of cells.
    pub fn new(
        mesh: &Mesh,
        periodic: [bool; 3],
        predicted: &'a FaceVector<R>,
        k: usize,
    ) -> FacePlanes<'a, R> {
        let layout = mesh.layout();
        let FaceVector { x, y, z } = predicted;
        FacePlanes {
            layout,
            periodic,
            inverse: mesh.per_spacing().to_array(),
            lower: [layout.plane_of(x, k), layout.plane_of(y, k), layout.plane_of(z, k)],
            above: layout.plane_of(z, next(k, layout.cells[2], periodic[2])),
        }
    }

    /// Faces of row `j` of the cells.
    #[inline(always)]
    fn row(&self, j: usize) -> FaceRows<'a, R> {
        let (layout, [n, ny, _]) = (self.layout, self.layout.cells);
        FaceRows {
            lower: layout.rows_of(self.lower, j),
            vp: layout.row_of(self.lower[1], next(j, ny, self.periodic[1])),
            wt: layout.row_of(self.above, j),
            wrapped: if self.periodic[0] { n } else { 0 },
            inverse: self.inverse,
        }
    }

    /// Computes a row of cells. The last cell of a periodic row is computed alone.
    #[inline(always)]
    fn along_row<V: Vector<Number = R>>(&self, work: &mut impl RowWork<Number = R>) {
        let n = self.layout.cells[0];
        if self.periodic[0] {
            along_row::<V>(n - 1, work);
            work.at::<Scalar<R>>(n);
        } else {
            along_row::<V>(n, work);
        }
    }
}

/// Index of the layer above layer `at` of an axis with `n` layers.
#[inline(always)]
fn next(at: usize, n: usize, periodic: bool) -> usize {
    if at == n && periodic { 1 } else { at + 1 }
}

/// Rows of the prediction on the faces of one row of cells. All slices of the rows here and below
/// have one length, so that one bounds check serves all of them.
struct FaceRows<'a, R> {
    /// Lower faces of the cells along each axis.
    lower: [&'a [R]; 3],
    /// Upper faces along y and along z.
    vp: &'a [R],
    wt: &'a [R],
    /// Last cell of a periodic row, else 0.
    wrapped: usize,
    inverse: [f64; 3],
}

impl<R: Real> FaceRows<'_, R> {
    /// Prediction on the lower and on the upper faces of the cells from `i` on, along each axis.
    #[inline(always)]
    fn load<V: Vector<Number = R>>(&self, i: usize) -> [[V; 3]; 2] {
        let here = |row: &[R]| V::load(&window::<V>(row, i)[1..]);
        let [u, v, w] = self.lower;
        let ur = if V::WIDTH == 1 && i == self.wrapped {
            // The upper face of the last cell is the lower face of the first.
            V::splat(u[1])
        } else {
            V::load(&window::<V>(u, i)[2..])
        };
        [[here(u), here(v), here(w)], [ur, here(self.vp), here(self.wt)]]
    }
}

/// Divergence of one plane of the prediction over dt, the right-hand side of the Poisson equation.
pub struct Divergence<'a, R> {
    pub faces: FacePlanes<'a, R>,
    /// Time step [s].
    pub dt: f64,
    /// Divergence over dt [1/s^2], overwritten.
    pub out: &'a mut Plane<R>,
}

impl<R: Real> Kernel for Divergence<'_, R> {
    type Number = R;
    #[inline(always)]
    fn run<V: Vector<Number = R>>(self) {
        let Divergence { faces, dt, out } = self;
        let [n, ny, _] = faces.layout.cells;
        for j in 1..=ny {
            let out = &mut out.row_mut(j)[..n + 2];
            faces.along_row::<V>(&mut DivergenceRow { faces: faces.row(j), dt, out });
        }
    }
}

/// One row of cells.
struct DivergenceRow<'a, R> {
    faces: FaceRows<'a, R>,
    dt: f64,
    out: &'a mut [R],
}

impl<R: Real> RowWork for DivergenceRow<'_, R> {
    type Number = R;
    #[inline(always)]
    fn at<V: Vector<Number = R>>(&mut self, i: usize) {
        let [[u, v, w], [ur, vp, wt]] = self.faces.load::<V>(i);
        let [x, y, z] = self.faces.inverse.map(V::constant);
        let sum = (ur - u) * x + (vp - v) * y + (wt - w) * z;
        sum.div(V::constant(self.dt)).store(window_mut::<V>(self.out, i));
    }
}

/// Correction of one plane: u = u* - dt grad f, p += f; the caller fills the ghosts.
pub struct Correct<'a, R> {
    pub faces: FacePlanes<'a, R>,
    /// Pressure increment over density f [m^2/s^2].
    pub solution: Solution<'a, R>,
    pub k: usize,
    /// Time step [s].
    pub dt: f64,
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
        let FacePlanes { layout, periodic, inverse, .. } = self.faces;
        let [n, ny, _] = layout.cells;
        let mut velocity = self.velocity.map(|plane| &mut plane[..layout.plane()]);
        let p = &mut self.pressure[..layout.plane()];
        let Solution { here: f, below: fb, above: ft } = self.solution;
        let mut partial = CorrectPartial::<R>::default();
        let mut rise = [0.0; 2];
        for j in 1..=ny {
            let prescribed = [false, !periodic[1] && j == 1, !periodic[2] && self.k == 1];
            let before = prescribed.contains(&true).then_some(partial.momentum);
            let out = layout.rows_of_mut(&mut velocity, j);
            let streamed = if self.non_temporal { inner_lines::<V>(out[0], n) } else { 0..0 };
            let mut work = CorrectRow {
                faces: self.faces.row(j),
                f: &f.row(j)[..n + 2],
                lower: [&f.row(j - 1)[..n + 2], &fb.row(j)[..n + 2]],
                upper: [&f.row(j + 1)[..n + 2], &ft.row(j)[..n + 2]],
                dt_per_h: inverse.map(|inverse| self.dt * inverse),
                out,
                pressure: layout.row_of_mut(p, j),
                streamed,
                partial: &mut partial,
            };
            self.faces.along_row::<V>(&mut work);
            if !periodic[0] {
                // The sum contains the lower boundary face, which is no unknown.
                let prescribed = -work.out[0][1].wide();
                work.partial.momentum[0].add(1, Scalar::<R>::constant(prescribed));
                // The upper boundary face keeps the predicted velocity.
                work.out[0][n + 1] = work.faces.lower[0][n + 1];
            }
            undo_prescribed(&mut work.partial.momentum, before, prescribed);
            rise[0] += work.pressure[n].wide() - work.pressure[1].wide();
        }
        if !periodic[1] {
            let predicted = layout.row_of(self.faces.lower[1], ny + 1);
            layout.row_of_mut(velocity[1], ny + 1).copy_from_slice(predicted);
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

/// One row of cells.
struct CorrectRow<'a, R> {
    faces: FaceRows<'a, R>,
    f: &'a [R],
    /// Increment one row down in y and in z, and one row up.
    lower: [&'a [R]; 2],
    upper: [&'a [R]; 2],
    dt_per_h: [f64; 3],
    out: [&'a mut [R]; 3],
    pressure: &'a mut [R],
    /// Entries of the row that are written with non-temporal stores.
    streamed: Range<usize>,
    partial: &'a mut CorrectPartial<R>,
}

impl<R: Real> RowWork for CorrectRow<'_, R> {
    type Number = R;
    #[inline(always)]
    fn at<V: Vector<Number = R>>(&mut self, i: usize) {
        let left = |row: &[R]| V::load(window::<V>(row, i));
        let here = |row: &[R]| V::load(&window::<V>(row, i)[1..]);
        let right = |row: &[R]| V::load(&window::<V>(row, i)[2..]);
        let f = here(self.f);
        let lower = [left(self.f), here(self.lower[0]), here(self.lower[1])];
        let upper = [right(self.f), here(self.upper[0]), here(self.upper[1])];
        let [predicted, above] = self.faces.load::<V>(i);
        let zero = V::constant(0.0);
        let (mut square, mut rate, mut divergence) = (zero, zero, zero);
        let mut corrected = [zero; 3];
        for axis in 0..3 {
            let (dt_per_h, inverse) =
                (V::constant(self.dt_per_h[axis]), V::constant(self.faces.inverse[axis]));
            let q = predicted[axis] - dt_per_h * (f - lower[axis]);
            let next = above[axis] - dt_per_h * (upper[axis] - f);
            corrected[axis] = q;
            square = square + q * q;
            rate = rate + q.abs() * inverse;
            divergence = divergence + (next - q) * inverse;
            self.partial.momentum[axis].add(i, q);
        }
        store_in_rows(&self.streamed, i, corrected, &mut self.out);
        let p = window_mut::<V>(self.pressure, i);
        (V::load(p) + f).store(p);
        let partial = &mut *self.partial;
        partial.divergence.include(i, divergence.abs());
        partial.rate.include(i, rate);
        partial.square.include(i, square);
        partial.kinetic.add(i, square);
    }
}
