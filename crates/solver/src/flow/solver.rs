//! The flow: predict without the divergence constraint, project onto it.
//!
//! Legend: u velocity, p dynamic pressure over density, phi its increment, H tendency.

use glam::DVec3;

use crate::grid::{Centre, FaceVector, Field, Layout, Mesh, for_planes_of};
use crate::poisson::Poisson;

use super::tendency::{self, Coefficients};
use super::{Boundaries, FluidParams};

/// What a projection measures on the way, over the whole grid.
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

/// State of the fluid.
pub struct Flow {
    mesh: Mesh,
    boundaries: Boundaries,
    coefficients: Coefficients,
    /// Velocity u^n [m/s].
    pub velocity: FaceVector,
    /// Predicted velocity u* [m/s].
    pub predicted: FaceVector,
    /// Dynamic pressure over density p^n [m^2/s^2].
    pub pressure: Field<Centre>,
    tendency: FaceVector,
    increment: Field<Centre>,
    poisson: Poisson,
    partial: Vec<FlowMeasures>,
    previous_step: Option<f64>,
    weight: f64,
    /// Sums of H over the unknown faces, of the last step and of the one before, three each.
    tendency_sums: [f64; 6],
    impulse: DVec3,
}

impl Flow {
    /// Fluid at its initial velocity, made free of divergence.
    pub fn new(mesh: &Mesh, boundaries: Boundaries, params: &FluidParams) -> Flow {
        let mut flow = Flow {
            mesh: *mesh,
            boundaries,
            coefficients: Coefficients::new(
                mesh,
                params.kinematic_viscosity,
                params.body_acceleration,
            ),
            velocity: FaceVector::zeros(mesh),
            predicted: FaceVector::zeros(mesh),
            pressure: Field::zeros(mesh),
            tendency: FaceVector::zeros(mesh),
            increment: Field::zeros(mesh),
            poisson: Poisson::new(mesh, boundaries.pressure_ends()),
            partial: vec![FlowMeasures::default(); mesh.cells[2]],
            previous_step: None,
            weight: 0.0,
            tendency_sums: [0.0; 6],
            impulse: DVec3::ZERO,
        };
        flow.velocity.x.fill(params.initial_velocity.x);
        flow.velocity.y.fill(params.initial_velocity.y);
        flow.velocity.z.fill(params.initial_velocity.z);
        flow.make_solenoidal();
        flow
    }

    /// Projects the present velocity onto the divergence-free fields with the given boundaries;
    /// the pressure is left alone. For initial states.
    pub fn make_solenoidal(&mut self) -> FlowMeasures {
        for axis in 0..3 {
            self.predicted
                .component_mut(axis)
                .copy_from_slice(self.velocity.component(axis));
        }
        self.boundaries.set_normal(&mut self.predicted);
        self.boundaries
            .convect_outflow(&self.mesh, &self.velocity, &mut self.predicted, 0.0);
        let pressure = self.pressure.clone();
        let measures = self.project(1.0);
        self.pressure.copy_from_slice(&pressure);
        measures
    }

    /// u* = u + dt (3/2 H^n - 1/2 H^{n-1}) - dt grad p^n, with the weights of a changing step;
    /// the first step is Euler's. Boundary faces of u* are those of the new time.
    pub fn predict(&mut self, dt: f64) {
        let ratio = self.previous_step.map_or(0.0, |previous| dt / previous);
        let (now, before) = (dt * (1.0 + 0.5 * ratio), -dt * 0.5 * ratio);
        let (velocity, pressure, coefficients) =
            (&self.velocity, &self.pressure, &self.coefficients);
        let layout = self.mesh.layout();
        let walled = self.boundaries.walled();
        let push = self.mesh.spacing.to_array().map(|h| dt / h);
        let (row, plane) = (layout.row(), layout.plane());
        let FaceVector {
            x: tx,
            y: ty,
            z: tz,
        } = &mut self.tendency;
        let FaceVector {
            x: px,
            y: py,
            z: pz,
        } = &mut self.predicted;
        for_planes_of(
            layout,
            [tx, ty, tz, px, py, pz],
            &mut self.partial,
            |k, [tx, ty, tz, px, py, pz], partial| {
                partial.momentum = DVec3::ZERO;
                for j in 1..=layout.cells[1] {
                    let (first, at) = (j * row, layout.index(0, j, k));
                    let cut = first..first + row;
                    // The old tendency is spent before the new one takes its place.
                    for (axis, (old, new)) in [
                        (&mut *tx, &mut *px),
                        (&mut *ty, &mut *py),
                        (&mut *tz, &mut *pz),
                    ]
                    .into_iter()
                    .enumerate()
                    {
                        let u = &velocity.component(axis)[at..at + row];
                        let p = &pressure[at..at + row];
                        let stride = [1, row, plane][axis];
                        let lower = &pressure[at + 1 - stride..at + row - stride];
                        let (old, new) = (&old[cut.clone()], &mut new[cut.clone()]);
                        for i in 1..row - 1 {
                            new[i] = u[i] + before * old[i] - push[axis] * (p[i] - lower[i - 1]);
                        }
                    }
                    tendency::row(
                        coefficients,
                        velocity,
                        j,
                        k,
                        [
                            &mut tx[cut.clone()],
                            &mut ty[cut.clone()],
                            &mut tz[cut.clone()],
                        ],
                    );
                    for (axis, (tendency, new)) in
                        [(&*tx, &mut *px), (&*ty, &mut *py), (&*tz, &mut *pz)]
                            .into_iter()
                            .enumerate()
                    {
                        let (tendency, new) = (&tendency[cut.clone()], &mut new[cut.clone()]);
                        for i in 1..row - 1 {
                            new[i] += now * tendency[i];
                        }
                        if let Some(from) = first_unknown(walled, axis, j, k) {
                            partial.momentum[axis] += tendency[from..row - 1].iter().sum::<f64>();
                        }
                    }
                }
            },
        );
        let sum = self
            .partial
            .iter()
            .fold(DVec3::ZERO, |sum, m| sum + m.momentum);
        let [_, _, _, x, y, z] = self.tendency_sums;
        self.tendency_sums = [x, y, z, sum.x, sum.y, sum.z];
        self.impulse = now * sum + before * DVec3::new(x, y, z);
        self.boundaries.set_normal(&mut self.predicted);
        self.boundaries
            .convect_outflow(&self.mesh, &self.velocity, &mut self.predicted, dt);
        self.previous_step = Some(dt);
        self.weight = now;
    }

    /// Adds `extra` [m/s^2] to the tendency of one face after `predict`, as if it had been part of
    /// H^n. Only for faces that are unknowns.
    #[inline]
    pub fn add_tendency(&mut self, axis: usize, at: usize, extra: f64) {
        self.tendency.component_mut(axis)[at] += extra;
        self.predicted.component_mut(axis)[at] += self.weight * extra;
    }

    /// Solves lap(phi) = div(u*)/dt, sets u = u* - dt grad(phi), p += phi, and fills the ghosts.
    pub fn project(&mut self, dt: f64) -> FlowMeasures {
        let layout = self.mesh.layout();
        let [row, plane] = [layout.row(), layout.plane()];
        let inverse = self.mesh.spacing.to_array().map(|h| 1.0 / h);
        for axis in 0..3 {
            if self.boundaries.is_periodic(axis) {
                layout.wrap(self.predicted.component_mut(axis), axis);
            }
        }
        let predicted = &self.predicted;
        for_planes_of(
            layout,
            [&mut self.increment],
            &mut self.partial,
            |k, [f], _| {
                for j in 1..=layout.cells[1] {
                    let (at, out) = (layout.index(0, j, k), &mut f[j * row..(j + 1) * row]);
                    let (u, v, w) = (
                        &predicted.x[at..at + row],
                        &predicted.y[at..at + row],
                        &predicted.z[at..at + row],
                    );
                    let (vp, wp) = (
                        &predicted.y[at + row..at + 2 * row],
                        &predicted.z[at + plane..at + plane + row],
                    );
                    for i in 1..row - 1 {
                        out[i] = ((u[i + 1] - u[i]) * inverse[0]
                            + (vp[i] - v[i]) * inverse[1]
                            + (wp[i] - w[i]) * inverse[2])
                            / dt;
                    }
                }
            },
        );
        self.poisson.solve(&mut self.increment);
        self.boundaries.fill_pressure(&mut self.increment);
        let measures = self.correct(dt, layout);
        self.boundaries.fill_pressure(&mut self.pressure);
        self.copy_upper_faces();
        self.boundaries.fill_ghosts(&mut self.velocity);
        measures
    }

    /// The last stage of the projection, one sweep over the grid.
    fn correct(&mut self, dt: f64, layout: Layout) -> FlowMeasures {
        let [row, plane] = [layout.row(), layout.plane()];
        let inverse = self.mesh.spacing.to_array().map(|h| 1.0 / h);
        let pull = inverse.map(|inverse| dt * inverse);
        let walled = self.boundaries.walled();
        let (predicted, phi) = (&self.predicted, &self.increment);
        let FaceVector { x, y, z } = &mut self.velocity;
        for_planes_of(
            layout,
            [x, y, z, &mut self.pressure],
            &mut self.partial,
            |k, [x, y, z, p], partial| {
                let mut m = FlowMeasures::default();
                let mut kinetic = 0.0;
                let mut momentum = DVec3::ZERO;
                for j in 1..=layout.cells[1] {
                    let (at, cut) = (layout.index(0, j, k), j * row..(j + 1) * row);
                    let (x, y, z, p) = (
                        &mut x[cut.clone()],
                        &mut y[cut.clone()],
                        &mut z[cut.clone()],
                        &mut p[cut],
                    );
                    let (u, v, w) = (
                        &predicted.x[at..at + row],
                        &predicted.y[at..at + row],
                        &predicted.z[at..at + row],
                    );
                    let (vp, wp) = (
                        &predicted.y[at + row..at + 2 * row],
                        &predicted.z[at + plane..at + plane + row],
                    );
                    let f = &phi[at..at + row];
                    let (fym, fyp) = (&phi[at - row..at], &phi[at + row..at + 2 * row]);
                    let (fzm, fzp) = (
                        &phi[at - plane..at - plane + row],
                        &phi[at + plane..at + plane + row],
                    );
                    for i in 1..row - 1 {
                        let lower = [
                            u[i] - pull[0] * (f[i] - f[i - 1]),
                            v[i] - pull[1] * (f[i] - fym[i]),
                            w[i] - pull[2] * (f[i] - fzm[i]),
                        ];
                        let upper = [
                            u[i + 1] - pull[0] * (f[i + 1] - f[i]),
                            vp[i] - pull[1] * (fyp[i] - f[i]),
                            wp[i] - pull[2] * (fzp[i] - f[i]),
                        ];
                        let divergence = (upper[0] - lower[0]) * inverse[0]
                            + (upper[1] - lower[1]) * inverse[1]
                            + (upper[2] - lower[2]) * inverse[2];
                        let square =
                            lower[0] * lower[0] + lower[1] * lower[1] + lower[2] * lower[2];
                        let rate = lower[0].abs() * inverse[0]
                            + lower[1].abs() * inverse[1]
                            + lower[2].abs() * inverse[2];
                        m.max_divergence = larger(m.max_divergence, divergence.abs());
                        m.max_rate = larger(m.max_rate, rate);
                        m.max_velocity = larger(m.max_velocity, square);
                        kinetic += square;
                        x[i] = lower[0];
                        y[i] = lower[1];
                        z[i] = lower[2];
                        p[i] += f[i];
                    }
                    for (axis, component) in [&*x, &*y, &*z].into_iter().enumerate() {
                        if let Some(from) = first_unknown(walled, axis, j, k) {
                            momentum[axis] += component[from..row - 1].iter().sum::<f64>();
                        }
                    }
                }
                m.momentum = momentum;
                m.kinetic_energy = 0.5 * kinetic;
                *partial = m;
            },
        );
        let mut total = FlowMeasures::default();
        for m in &self.partial {
            total.max_divergence = larger(total.max_divergence, m.max_divergence);
            total.max_rate = larger(total.max_rate, m.max_rate);
            total.max_velocity = larger(total.max_velocity, m.max_velocity);
            total.kinetic_energy += m.kinetic_energy;
            total.momentum += m.momentum;
        }
        total.max_velocity = total.max_velocity.sqrt();
        total.kinetic_energy *= self.mesh.cell_volume();
        total.momentum *= self.mesh.cell_volume();
        total
    }

    /// What walls, open faces and body force have given the box in the step just projected, per
    /// density [m^4/s]: its momentum changes by this and by the impulse of grains.
    pub fn boundary_impulse(&self, dt: f64) -> DVec3 {
        let layout = self.mesh.layout();
        let mut sum = self.impulse;
        for axis in (0..3).filter(|&axis| !self.boundaries.is_periodic(axis)) {
            // The sum of a gradient over the inner faces leaves the two outermost cells.
            let n = layout.cells[axis];
            let mut difference = 0.0;
            let stride = layout.strides()[axis] as isize;
            layout.each_inside_layer(axis, n, |at| {
                difference += self.pressure[at]
                    - self.pressure[at.wrapping_add_signed((1 - n as isize) * stride)];
            });
            sum[axis] -= dt * difference / self.mesh.spacing[axis];
        }
        sum * self.mesh.cell_volume()
    }

    /// The upper boundary faces lie outside the sweep; the projection leaves them as predicted.
    fn copy_upper_faces(&mut self) {
        let layout = self.mesh.layout();
        for axis in 0..3 {
            let (from, to) = (
                self.predicted.component(axis),
                self.velocity.component_mut(axis),
            );
            layout.each_of_layer(axis, layout.cells[axis] + 1, |at| to[at] = from[at]);
        }
    }

    /// Projects the prediction in place: u* becomes the flow without grains, and the pressure takes
    /// its increment (the first of the two projections of the paper's scheme).
    pub fn project_prediction(&mut self, dt: f64) {
        self.project(dt);
        for axis in 0..3 {
            self.predicted
                .component_mut(axis)
                .copy_from_slice(self.velocity.component(axis));
        }
    }

    /// Everything that a later step depends on.
    pub fn state(&self) -> [&[f64]; 8] {
        let (u, h) = (&self.velocity, &self.tendency);
        [
            &u.x,
            &u.y,
            &u.z,
            &h.x,
            &h.y,
            &h.z,
            &self.pressure,
            &self.tendency_sums,
        ]
    }
    /// The same to be overwritten by a state whose last step was `last_step` [s] long.
    pub fn state_mut(&mut self, last_step: f64) -> [&mut [f64]; 8] {
        self.previous_step = (last_step > 0.0).then_some(last_step);
        let (u, h) = (&mut self.velocity, &mut self.tendency);
        [
            &mut u.x,
            &mut u.y,
            &mut u.z,
            &mut h.x,
            &mut h.y,
            &mut h.z,
            &mut self.pressure,
            &mut self.tendency_sums,
        ]
    }

    /// The grid.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }
    /// Conditions on the faces of the box.
    pub fn boundaries(&self) -> &Boundaries {
        &self.boundaries
    }
    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        8 * 11 * self.mesh.layout().len() + self.poisson.bytes()
    }
}

/// First unknown entry of row (j, k) of a component, if the row has any: the lower boundary face of
/// an axis that is not periodic is given.
#[inline(always)]
fn first_unknown(walled: [bool; 3], axis: usize, j: usize, k: usize) -> Option<usize> {
    match axis {
        0 => Some(1 + usize::from(walled[0])),
        1 => (j > 1 || !walled[1]).then_some(1),
        _ => (k > 1 || !walled[2]).then_some(1),
    }
}

/// Maximum that keeps a NaN, so that a broken field cannot pass for a quiet one.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}

#[cfg(test)]
mod tests;
