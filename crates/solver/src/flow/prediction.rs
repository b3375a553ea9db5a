//! Prediction without the divergence constraint: tendency (advection, diffusion and body
//! acceleration of Eq. 1b), one row at a time, and access of the coupling to the prediction.
//!
//! Advection and diffusion are differences of fluxes through the six links to the neighbouring
//! faces of the same component. The advective flux of a link is the mean of its two ends times the
//! velocity through the link, which conserves momentum and kinetic energy if the velocity is
//! divergence-free.
//!
//! Legend: H tendency; q velocity component, c velocity through a link; u, v, w components along
//! x, y, z, p pressure, a body acceleration. Suffixes: c here, l/r left and right in x, m/p one row
//! down and up in y, b/t one plane down and up in z; `umr` is u one row down, right.

use std::ops::Range;

use glam::DVec3;

use super::{Boundaries, Flow, FluidParams};
use crate::grid::{Centre, FaceVector, Field, Layout, Mesh, SharedRows, for_slabs};
use crate::math::Real;
use grainwake_simd::{
    Kernel, Partial, RowWork, Scalar, Vector, along_row, inner_lines, store_in_rows, window,
    window_mut,
};

/// Coefficients of the tendency H and of the prediction u* = u + now H + before H_old - dt grad p.
#[derive(Clone, Copy)]
pub struct Coefficients {
    /// 1/(4 h) along each axis [1/m]: value and velocity of a link are means of two.
    quarter_inverse: [f64; 3],
    /// nu/h^2 along each axis [1/s].
    nu_inverse_square: [f64; 3],
    /// Uniform acceleration that drives the flow [m/s^2].
    pub(super) acceleration: DVec3,
    /// Weight of H [s].
    pub(super) now: f64,
    /// Weight of H_old [s].
    pub(super) before: f64,
    /// Weight dt/h of the pressure difference along each axis [s/m].
    pub(super) dt_per_h: [f64; 3],
}

impl Coefficients {
    /// Coefficients for a mesh and the properties of a fluid, before the first time step.
    pub fn new(mesh: &Mesh, params: &FluidParams) -> Coefficients {
        let h = mesh.spacing.to_array();
        Coefficients {
            quarter_inverse: h.map(|h| 0.25 / h),
            nu_inverse_square: h.map(|h| params.kinematic_viscosity / (h * h)),
            acceleration: params.body_acceleration,
            now: 0.0,
            before: 0.0,
            dt_per_h: [0.0; 3],
        }
    }

    /// -div(c q) + nu lap(q) + a of `component` at a face with value `q`, neighbours and link
    /// velocities (twice the mean) `[axis][minus, plus]`.
    #[inline(always)]
    fn at_face<V: Vector>(
        &self,
        component: usize,
        q: V,
        neighbour: [[V; 2]; 3],
        link: [[V; 2]; 3],
    ) -> V {
        let twice = q + q;
        let mut sum = V::constant(self.acceleration.to_array()[component]);
        for axis in 0..3 {
            let ([qm, qp], [cm, cp]) = (neighbour[axis], link[axis]);
            let diffusion = V::constant(self.nu_inverse_square[axis]) * (qm + qp - twice);
            let carried = cp * (q + qp) - cm * (qm + q);
            sum = sum + (diffusion - V::constant(self.quarter_inverse[axis]) * carried);
        }
        sum
    }
}

/// One plane of the prediction.
pub struct PredictPlane<'a, R> {
    pub layout: Layout,
    pub coefficients: &'a Coefficients,
    /// Velocity u^n with ghosts [m/s].
    pub velocity: &'a FaceVector<R>,
    /// Pressure over density p^n with ghosts [m^2/s^2].
    pub pressure: &'a [R],
    /// Whether each axis is periodic; boundary faces normal to the others are not unknown.
    pub periodic: [bool; 3],
    pub k: usize,
    /// Whether the prediction is written with non-temporal stores.
    pub non_temporal: bool,
    /// H_old, overwritten by H.
    pub tendency: [&'a mut [R]; 3],
    /// Plane of u* [m/s], overwritten.
    pub predicted: [&'a mut [R]; 3],
    /// Sum of H over the unknown faces of the plane [m/s^2], to be set.
    pub sum: &'a mut DVec3,
}

impl<R: Real> Kernel for PredictPlane<'_, R> {
    type Number = R;
    #[inline(always)]
    fn run<V: Vector<Number = R>>(self) {
        let (layout, k, n) = (self.layout, self.k, self.layout.cells[0]);
        let coefficients = *self.coefficients;
        let u = planes(layout, &self.velocity.x, k);
        let v = planes(layout, &self.velocity.y, k);
        let w = planes(layout, &self.velocity.z, k);
        let p = planes(layout, self.pressure, k);
        let mut tendency = self.tendency.map(|plane| &mut plane[..layout.plane()]);
        let mut predicted = self.predicted.map(|plane| &mut plane[..layout.plane()]);
        let mut sums = [Partial::default(); 3];
        for j in 1..=layout.cells[1] {
            let prescribed = [false, !self.periodic[1] && j == 1, !self.periodic[2] && k == 1];
            let before = prescribed.contains(&true).then_some(sums);
            let predicted = layout.rows_of_mut(&mut predicted, j);
            let streamed = if self.non_temporal { inner_lines::<V>(predicted[0], n) } else { 0..0 };
            let mut work = PredictRow {
                coefficients,
                u: rows(layout, u, j),
                v: rows(layout, v, j),
                w: rows(layout, w, j),
                p: rows(layout, p, j),
                tendency: layout.rows_of_mut(&mut tendency, j),
                predicted,
                sums: &mut sums,
                streamed,
            };
            along_row::<V>(n, &mut work);
            if !self.periodic[0] {
                // The sum contains the lower boundary face, which is no unknown.
                let prescribed = -work.tendency[0][1].wide();
                work.sums[0].add(1, Scalar::<R>::constant(prescribed));
            }
            undo_prescribed(&mut sums, before, prescribed);
        }
        V::fence();
        *self.sum = DVec3::from_array(sums.map(|sum| sum.sum()));
    }
}

/// Takes a row out of the sums of the components that are `prescribed` on all its faces, which are
/// not unknown: sets them back to their values `before` the row. The loop along the row thus needs
/// no branch.
#[inline(always)]
pub fn undo_prescribed(
    sums: &mut [Partial; 3],
    before: Option<[Partial; 3]>,
    prescribed: [bool; 3],
) {
    let Some(before) = before else { return };
    for axis in 0..3 {
        if prescribed[axis] {
            sums[axis] = before[axis];
        }
    }
}

/// Planes k - 1, k, k + 1 of a field.
#[inline(always)]
fn planes<R>(layout: Layout, field: &[R], k: usize) -> [&[R]; 3] {
    [layout.plane_of(field, k - 1), layout.plane_of(field, k), layout.plane_of(field, k + 1)]
}

/// Rows j - 1, j, j + 1, each of the planes k - 1, k, k + 1. All have one length, so that one
/// bounds check serves all of them.
type Rows<'a, R> = [[&'a [R]; 3]; 3];

#[inline(always)]
fn rows<'a, R>(layout: Layout, planes: [&'a [R]; 3], j: usize) -> Rows<'a, R> {
    [layout.rows_of(planes, j - 1), layout.rows_of(planes, j), layout.rows_of(planes, j + 1)]
}

/// One row of the prediction.
struct PredictRow<'a, R> {
    coefficients: Coefficients,
    u: Rows<'a, R>,
    v: Rows<'a, R>,
    w: Rows<'a, R>,
    p: Rows<'a, R>,
    tendency: [&'a mut [R]; 3],
    predicted: [&'a mut [R]; 3],
    sums: &'a mut [Partial; 3],
    /// Entries of the row that are written with non-temporal stores.
    streamed: Range<usize>,
}

impl<R: Real> RowWork for PredictRow<'_, R> {
    type Number = R;
    #[inline(always)]
    fn at<V: Vector<Number = R>>(&mut self, i: usize) {
        // The vectors that start at entries i - 1, i and i + 1 of a row.
        let left = |row: &[R]| V::load(window::<V>(row, i));
        let here = |row: &[R]| V::load(&window::<V>(row, i)[1..]);
        let right = |row: &[R]| V::load(&window::<V>(row, i)[2..]);
        let c = &self.coefficients;
        let [[_, um, _], [ub, u, ut], [_, up, _]] = self.u;
        let (ul, uc, ur) = (left(u), here(u), right(u));
        let (umr, ubr) = (right(um), right(ub));
        let (um, up, ub, ut) = (here(um), here(up), here(ub), here(ut));
        let [[_, vm, _], [vb, v, vt], [vpb, vp, _]] = self.v;
        let (vl, vc, vr) = (left(v), here(v), right(v));
        let (vpl, vpb) = (left(vp), here(vpb));
        let (vm, vp, vb, vt) = (here(vm), here(vp), here(vb), here(vt));
        let [[_, wm, wmt], [wb, w, wt], [_, wp, _]] = self.w;
        let (wl, wc, wr) = (left(w), here(w), right(w));
        let (wtl, wmt) = (left(wt), here(wmt));
        let (wm, wp, wb, wt) = (here(wm), here(wp), here(wb), here(wt));

        let hx = c.at_face(
            0,
            uc,
            [[ul, ur], [um, up], [ub, ut]],
            [[ul + uc, uc + ur], [vl + vc, vpl + vp], [wl + wc, wtl + wt]],
        );
        let hy = c.at_face(
            1,
            vc,
            [[vl, vr], [vm, vp], [vb, vt]],
            [[um + uc, umr + ur], [vm + vc, vc + vp], [wm + wc, wmt + wt]],
        );
        let hz = c.at_face(
            2,
            wc,
            [[wl, wr], [wm, wp], [wb, wt]],
            [[ub + uc, ubr + ur], [vb + vc, vpb + vp], [wb + wc, wc + wt]],
        );
        let [[_, pm, _], [pb, p, _], _] = self.p;
        let pc = here(p);
        let lower = [left(p), here(pm), here(pb)];
        let (now, before) = (V::constant(c.now), V::constant(c.before));
        let mut predicted = [V::constant(0.0); 3];
        for (axis, (h, q)) in [(hx, uc), (hy, vc), (hz, wc)].into_iter().enumerate() {
            let old = window_mut::<V>(self.tendency[axis], i);
            let pressure = V::constant(c.dt_per_h[axis]) * (pc - lower[axis]);
            // Small terms are summed before q is added: fewer of their digits are lost.
            let gain = now * h + before * V::load(old) - pressure;
            predicted[axis] = q + gain;
            h.store(old);
            self.sums[axis].add(i, h);
        }
        store_in_rows(&self.streamed, i, predicted, &mut self.predicted);
    }
}

/// State at t^n from which the prediction was computed.
pub struct OldState<'a, R> {
    /// Grid of the box.
    pub mesh: &'a Mesh,
    /// Conditions on the faces of the box.
    pub boundaries: &'a Boundaries,
    /// Velocity u^n [m/s].
    pub velocity: &'a FaceVector<R>,
    /// Dynamic pressure over density p^n [m^2/s^2].
    pub pressure: &'a Field<Centre, R>,
    /// Uniform acceleration that drives the flow [m/s^2].
    pub body_acceleration: DVec3,
}

/// One component of the predicted velocity u* and of the tendency H^n, of the box or of a slab.
pub struct Prediction<'a, R> {
    /// Weight of H^n in u* [s].
    weight: f64,
    tendency: SharedRows<'a, R>,
    velocity: SharedRows<'a, R>,
}

impl<R: Real> Flow<R> {
    /// State at t^n, and the prediction of each component.
    pub fn prediction(&mut self) -> (OldState<'_, R>, [Prediction<'_, R>; 3]) {
        let weight = self.coefficients.now;
        let old = OldState {
            mesh: &self.mesh,
            boundaries: &self.boundaries,
            velocity: &self.velocity,
            pressure: &self.pressure,
            body_acceleration: self.coefficients.acceleration,
        };
        let fields = fields(&mut self.tendency, &mut self.predicted);
        (old, fields.map(|fields| Prediction::new(weight, 0, fields)))
    }

    /// Calls `each(component, prediction)` for slabs of all components in parallel.
    pub fn for_predictions(&mut self, each: impl Fn(usize, Prediction<R>) + Sync) {
        let weight = self.coefficients.now;
        let fields = fields(&mut self.tendency, &mut self.predicted);
        for_slabs(self.mesh.layout(), fields, |component, start, fields| {
            each(component, Prediction::new(weight, start, fields));
        });
    }
}

/// Components of two vector fields, paired by axis.
fn fields<'a, R: Real>(
    one: &'a mut FaceVector<R>,
    other: &'a mut FaceVector<R>,
) -> [[&'a mut [R]; 2]; 3] {
    let ([x, y, z], [ox, oy, oz]) = (one.components_mut(), other.components_mut());
    [[x, ox], [y, oy], [z, oz]]
}

impl<'a, R: Real> Prediction<'a, R> {
    /// Prediction of slabs of tendency and velocity that start at position `start` of their fields.
    fn new(weight: f64, start: usize, slabs: [&'a mut [R]; 2]) -> Prediction<'a, R> {
        let [tendency, velocity] = slabs.map(|slab| SharedRows::new(start, slab));
        Prediction { weight, tendency, velocity }
    }

    /// Second handle to the same faces.
    ///
    /// # Safety
    /// While both exist, no face that one handle changes is read or changed through the other.
    pub unsafe fn alias(&self) -> Prediction<'a, R> {
        // SAFETY: guaranteed by the caller.
        unsafe {
            Prediction {
                weight: self.weight,
                tendency: self.tendency.alias(),
                velocity: self.velocity.alias(),
            }
        }
    }

    /// Positions of the faces in the memory of the field.
    pub fn range(&self) -> &Range<usize> {
        self.velocity.range()
    }

    /// u* of `count` faces from position `at` on [m/s].
    #[inline(always)]
    pub fn velocity(&self, at: usize, count: usize) -> &[R] {
        self.velocity.row(at, count)
    }

    /// Mutable u* of `count` faces from position `at` on [m/s].
    #[inline(always)]
    pub fn velocity_mut(&mut self, at: usize, count: usize) -> &mut [R] {
        self.velocity.row_mut(at, count)
    }

    /// Adds the first `count` entries of `extra` [m/s^2] to H^n of the faces from position `at` on,
    /// and updates u*. `extra` must be padded to whole vectors.
    #[inline(always)]
    pub fn add_tendency<V: Vector<Number = f64>>(
        &mut self,
        at: usize,
        count: usize,
        extra: &[f64],
    ) {
        let (tendency, velocity) =
            (self.tendency.row_mut(at, count), self.velocity.row_mut(at, count));
        let weight = V::constant(self.weight);
        for n in (0..count).step_by(V::WIDTH) {
            let extra = V::load(&extra[n..]);
            extra.add_partial(&mut tendency[n..]);
            (weight * extra).add_partial(&mut velocity[n..]);
        }
    }
}
