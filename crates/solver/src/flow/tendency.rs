//! Advection and diffusion (the right side of Eq. 1b without the pressure) and the explicit step,
//! a row at a time.
//!
//! Both are differences of fluxes through the six links to the neighbouring faces of the same
//! component. A link carries the mean of its two ends times the velocity through it: with a
//! divergence-free velocity this conserves momentum and kinetic energy.
//!
//! Legend: q velocity component, c velocity through a link; u, v, w components along x, y, z; the
//! letters after them: m/p one row down/up in y, b/t one down/up in z.

use std::ops::Range;

use glam::DVec3;

use crate::grid::{FaceVector, Layout, Mesh};
use crate::math::Real;
use grainwake_simd::{Kernel, One, Partial, RowWork, Vector, along_row};

/// Constants of the tendency.
#[derive(Clone, Copy)]
pub struct Coefficients {
    /// 1/4h: a quarter, as both the carried value and the velocity that carries it are means.
    quarter_inverse: [f64; 3],
    nu_inverse_square: [f64; 3],
    pub(super) acceleration: DVec3,
}

impl Coefficients {
    /// For a mesh, kinematic viscosity [m^2/s] and body acceleration [m/s^2].
    pub fn new(mesh: &Mesh, kinematic_viscosity: f64, acceleration: DVec3) -> Coefficients {
        let h = mesh.spacing.to_array();
        Coefficients {
            quarter_inverse: h.map(|h| 0.25 / h),
            nu_inverse_square: h.map(|h| kinematic_viscosity / (h * h)),
            acceleration,
        }
    }

    /// -div(c q) + nu lap(q) + g of `component` at a face with value `q`, neighbours and link
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

/// What a step multiplies by.
#[derive(Clone, Copy)]
pub struct Weights {
    /// Of the new tendency [s].
    pub now: f64,
    /// Of the old one [s].
    pub before: f64,
    /// Of the pressure difference along each axis [s/m].
    pub push: [f64; 3],
}

/// Planes that the prediction has in hand: three of each component, two of the pressure, six to be written.
pub const PLANES_AT_ONCE: usize = 17;

/// Rows of a plane of the prediction u* = u + now H + before H_old - dt grad p.
pub struct PredictPlane<'a, R> {
    pub layout: Layout,
    pub coefficients: &'a Coefficients,
    pub weights: Weights,
    pub velocity: &'a FaceVector<R>,
    pub pressure: &'a [R],
    /// Axes whose lower boundary face is given.
    pub walled: [bool; 3],
    pub k: usize,
    /// Whether the prediction is written past the caches.
    pub past_caches: bool,
    /// The rows of the plane to treat, one part of it after the other.
    pub rows: Range<usize>,
    /// H_old, to be replaced by H.
    pub tendency: [&'a mut [R]; 3],
    pub predicted: [&'a mut [R]; 3],
    /// The sum of H over the unknown faces of the plane is added to it.
    pub sum: &'a mut DVec3,
}

impl<R: Real> Kernel for PredictPlane<'_, R> {
    type Number = R;
    #[inline(always)]
    fn run<V: Vector<Number = R>>(self) {
        let (layout, k) = (self.layout, self.k);
        let (row, plane, n) = (layout.row(), layout.plane(), layout.cells[0]);
        let FaceVector { x, y, z } = self.velocity;
        let [tx, ty, tz] = self.tendency;
        let [px, py, pz] = self.predicted;
        let mut sums = [Partial::default(); 3];
        for j in self.rows {
            let (at, here) = (layout.index(0, j, k), j * row..(j + 1) * row);
            let mut work = PredictRow {
                coefficients: self.coefficients,
                weights: self.weights,
                u: around(x, at, row, plane),
                v: around(y, at, row, plane),
                w: around(z, at, row, plane),
                vpb: &y[at + row - plane..][..row],
                wmt: &z[at + plane - row..][..row],
                p: &self.pressure[at..][..row],
                pm: &self.pressure[at - row..][..row],
                pb: &self.pressure[at - plane..][..row],
                tendency: [
                    &mut tx[here.clone()],
                    &mut ty[here.clone()],
                    &mut tz[here.clone()],
                ],
                predicted: [&mut px[here.clone()], &mut py[here.clone()], &mut pz[here]],
                sums: &mut sums,
                n,
                past_caches: self.past_caches,
                given: [false, self.walled[1] && j == 1, self.walled[2] && k == 1],
            };
            along_row::<V>(n, &mut work);
            if self.walled[0] {
                // The lower boundary face was summed with the others.
                let given = -tx[j * row + 1].wide();
                sums[0].add(1, One::<R>::constant(given));
            }
        }
        V::fence();
        *self.sum += DVec3::from_array(sums.map(|sum| sum.sum()));
    }
}

/// A row and its four neighbours: here, one row down and up in y, one down and up in z.
type Around<'a, R> = [&'a [R]; 5];

#[inline(always)]
fn around<R>(values: &[R], at: usize, row: usize, plane: usize) -> Around<'_, R> {
    [
        &values[at..][..row],
        &values[at - row..][..row],
        &values[at + row..][..row],
        &values[at - plane..][..row],
        &values[at + plane..][..row],
    ]
}

struct PredictRow<'a, R> {
    coefficients: &'a Coefficients,
    weights: Weights,
    u: Around<'a, R>,
    v: Around<'a, R>,
    w: Around<'a, R>,
    vpb: &'a [R],
    wmt: &'a [R],
    p: &'a [R],
    pm: &'a [R],
    pb: &'a [R],
    tendency: [&'a mut [R]; 3],
    predicted: [&'a mut [R]; 3],
    sums: &'a mut [Partial; 3],
    n: usize,
    past_caches: bool,
    /// Components that are given on the whole row.
    given: [bool; 3],
}

impl<R: Real> RowWork for PredictRow<'_, R> {
    type Number = R;
    #[inline(always)]
    fn at<V: Vector<Number = R>>(&mut self, i: usize) {
        // Entries i - 1, i, i + 1 of a row.
        macro_rules! three {
            ($row:expr) => {{
                let cut = &$row[i - 1..i + V::WIDTH + 1];
                [V::load(cut), V::load(&cut[1..]), V::load(&cut[2..])]
            }};
        }
        macro_rules! two {
            ($row:expr) => {{
                let cut = &$row[i - 1..i + V::WIDTH];
                [V::load(cut), V::load(&cut[1..])]
            }};
        }
        let c = self.coefficients;
        let [ul, uc, ur] = three!(self.u[0]);
        let [_, um, umr] = three!(self.u[1]);
        let up = V::load(&self.u[2][i..]);
        let [_, ub, ubr] = three!(self.u[3]);
        let ut = V::load(&self.u[4][i..]);
        let [vl, vc, vr] = three!(self.v[0]);
        let vm = V::load(&self.v[1][i..]);
        let [vpl, vp] = two!(self.v[2]);
        let vb = V::load(&self.v[3][i..]);
        let vt = V::load(&self.v[4][i..]);
        let [wl, wc, wr] = three!(self.w[0]);
        let wm = V::load(&self.w[1][i..]);
        let wp = V::load(&self.w[2][i..]);
        let wb = V::load(&self.w[3][i..]);
        let [wtl, wt] = two!(self.w[4]);
        let (vpb, wmt) = (V::load(&self.vpb[i..]), V::load(&self.wmt[i..]));

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
        let [pl, pc] = two!(self.p);
        let lower = [pl, V::load(&self.pm[i..]), V::load(&self.pb[i..])];
        let (now, before) = (
            V::constant(self.weights.now),
            V::constant(self.weights.before),
        );
        // The ends of a row are looked at again for the boundaries.
        let past = self.past_caches && i > 1 && i + V::WIDTH <= self.n;
        for (axis, (h, q)) in [(hx, uc), (hy, vc), (hz, wc)].into_iter().enumerate() {
            let old = &mut self.tendency[axis][i..];
            let push = V::constant(self.weights.push[axis]) * (pc - lower[axis]);
            // What is small is summed first: in singles q would swallow it part by part.
            let gain = now * h + before * V::load(old) - push;
            let to = &mut self.predicted[axis][i..];
            if past {
                (q + gain).store_past(to);
            } else {
                (q + gain).store(to);
            }
            h.store(old);
            if !self.given[axis] {
                self.sums[axis].add(i, h);
            }
        }
    }
}
