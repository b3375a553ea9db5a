//! Incompressible Navier-Stokes on the staggered grid (Eqs 1-4), without grains: prediction without
//! the divergence constraint, projection onto it.
//!
//! Adams-Bashforth for advection and diffusion, incremental pressure correction, one direct
//! Poisson solve a step.
//!
//! Legend: u velocity, p dynamic pressure over density, f its increment, H tendency.

mod boundary;
mod nested;
mod nesting;
mod open_boundary;
mod prediction;
mod project;
mod prolongation;
mod restriction;
#[cfg(test)]
mod tests;

pub use boundary::{Boundaries, Boundary};
pub(crate) use nested::NestedFlow;
pub(crate) use nesting::RefinedBox;
pub(crate) use open_boundary::{BoxSide, CoveredFace};
pub(crate) use prediction::{OldState, Prediction};
pub(crate) use project::FlowMeasures;

use glam::DVec3;
use rayon::prelude::*;

use crate::grid::{Axis, Centre, FaceVector, Field, FieldView, Mesh, planes_of};
use crate::math::{Real, last_cache};
use crate::poisson::{Plane, Poisson, PoissonTimes, Solution};
use grainwake_simd::dispatch;
use prediction::{Coefficients, PredictPlane};
use project::{Correct, Divergence, FacePlanes, PlaneMeasures};

/// Properties of the fluid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluidParams {
    /// Density [kg/m^3].
    pub density: f64,
    /// Kinematic viscosity [m^2/s].
    pub kinematic_viscosity: f64,
    /// Uniform acceleration that drives the flow (a mean pressure gradient over density) [m/s^2].
    pub body_acceleration: DVec3,
    /// Uniform velocity at the start [m/s].
    pub initial_velocity: DVec3,
}

impl FluidParams {
    /// Fluid at rest of `density` [kg/m^3] and `kinematic_viscosity` [m^2/s].
    pub fn new(density: f64, kinematic_viscosity: f64) -> FluidParams {
        FluidParams {
            density,
            kinematic_viscosity,
            body_acceleration: DVec3::ZERO,
            initial_velocity: DVec3::ZERO,
        }
    }
}

/// State of the fluid.
pub struct Flow<R = f64> {
    /// Grid of the box.
    mesh: Mesh,
    /// Conditions on the faces of the box.
    boundaries: Boundaries,
    coefficients: Coefficients,
    /// Velocity u^n [m/s].
    pub velocity: FaceVector<R>,
    /// Predicted velocity u* [m/s].
    pub predicted: FaceVector<R>,
    /// Dynamic pressure over density p^n [m^2/s^2].
    pub pressure: Field<Centre, R>,
    /// Tendency H of the last prediction [m/s^2].
    tendency: FaceVector<R>,
    poisson: Poisson<R>,
    /// Whether fields are written with non-temporal stores.
    non_temporal: bool,
    /// Measures of each plane.
    partial: Vec<PlaneMeasures>,
    /// Length of the last step [s]; none before the first.
    previous_step: Option<f64>,
    /// Sums of H over the unknown faces: three of the previous step, then three of the last one.
    tendency_sums: [f64; 6],
    /// Sum over the unknown faces of the weighted tendencies of the last prediction [m/s].
    impulse: DVec3,
    /// Pressure difference between upper and lower end, summed over the lines along each axis.
    pressure_rise: DVec3,
    /// Outward speed of the fastest grain close to each side [m/s].
    crossing_speeds: [[f64; 2]; 3],
}

impl<R: Real> Flow<R> {
    /// Fluid at the initial velocity, projected onto the divergence-free fields.
    pub fn new(mesh: &Mesh, boundaries: Boundaries, params: &FluidParams) -> Flow<R> {
        let mut flow = Flow {
            mesh: *mesh,
            boundaries,
            coefficients: Coefficients::new(mesh, params),
            velocity: FaceVector::zeros(mesh),
            predicted: FaceVector::zeros(mesh),
            pressure: Field::zeros(mesh),
            tendency: FaceVector::zeros(mesh),
            poisson: Poisson::new(mesh, boundaries.pressure_ends()),
            non_temporal: false,
            partial: vec![PlaneMeasures::default(); mesh.cells[2]],
            previous_step: None,
            tendency_sums: [0.0; 6],
            impulse: DVec3::ZERO,
            pressure_rise: DVec3::ZERO,
            crossing_speeds: [[0.0; 2]; 3],
        };
        flow.non_temporal = flow.bytes() > last_cache() / 4 * 3;
        flow.velocity.fill(params.initial_velocity);
        flow.make_solenoidal();
        flow
    }

    /// Sets the velocity to `component(axis, position)` [m/s, m] and projects.
    pub fn start_from(&mut self, component: impl Fn(usize, DVec3) -> f64) {
        self.velocity.fill_with(&self.mesh, component);
        self.make_solenoidal();
    }

    /// Fills the ghosts of the velocity by the present conditions on the sides.
    pub fn fill_ghosts(&mut self) {
        for axis in 0..3 {
            let component = self.velocity.component_mut(axis);
            self.boundaries.fill_ghosts(self.mesh.layout(), Some(axis), 0..3, component);
        }
    }

    /// Fills the ghosts of the pressure.
    fn fill_pressure_ghosts(&mut self) {
        self.boundaries.fill_ghosts(self.mesh.layout(), None, 0..3, &mut self.pressure);
    }

    /// Fills the ghosts of velocity and pressure after values changed in the planes `changed`.
    fn fill_ghosts_after(&mut self, changed: &[usize]) {
        let (layout, boundaries) = (self.mesh.layout(), &self.boundaries);
        let fill = |component, values: &mut [R]| {
            for k in changed {
                let plane = &mut values[k * layout.plane()..(k + 1) * layout.plane()];
                boundaries.fill_ghosts(layout, component, 0..2, plane);
            }
            boundaries.fill_ghosts(layout, component, 2..3, values);
        };
        for axis in 0..3 {
            fill(Some(axis), self.velocity.component_mut(axis));
        }
        fill(None, &mut self.pressure);
    }

    /// Sets the uniform acceleration that drives the flow [m/s^2].
    pub fn set_body_acceleration(&mut self, acceleration: DVec3) {
        self.coefficients.acceleration = acceleration;
    }

    /// Projects the velocity onto the divergence-free fields and keeps the pressure; for initial
    /// states.
    pub fn make_solenoidal(&mut self) -> FlowMeasures {
        self.predict_present();
        let pressure = self.pressure.to_vec();
        let measures = self.project(1.0);
        self.pressure.copy_from_slice(&pressure);
        measures
    }

    /// Makes the present velocity, with the conditions on the sides, the prediction.
    fn predict_present(&mut self) {
        self.predicted.copy_from(&self.velocity);
        self.boundaries.set_normal(&mut self.predicted);
        self.convect_outflow(0.0);
    }

    /// Predicts u* = u + dt (3/2 H^n - 1/2 H^{n-1}) - dt grad p^n, with the weights of a variable
    /// time step; the first step is forward Euler. Boundary faces of u* have the new velocity.
    pub fn predict(&mut self, dt: f64) {
        let ratio = self.previous_step.map_or(0.0, |previous| dt / previous);
        let (now, before) = (dt * (1.0 + 0.5 * ratio), -dt * 0.5 * ratio);
        (self.coefficients.now, self.coefficients.before) = (now, before);
        self.coefficients.dt_per_h = self.mesh.spacing.to_array().map(|h| dt / h);
        let (layout, periodic) = (self.mesh.layout(), self.boundaries.periodic());
        let (velocity, pressure, boundaries) = (&self.velocity, &self.pressure, &self.boundaries);
        let (coefficients, non_temporal) = (&self.coefficients, self.non_temporal);
        let [x, y, z] = self.tendency.components_mut();
        let [px, py, pz] = self.predicted.components_mut();
        let planes = planes_of(layout, [x, y, z, px, py, pz], &mut self.partial);
        planes.for_each(|(k, [x, y, z, px, py, pz], partial)| {
            dispatch(PredictPlane {
                layout,
                coefficients,
                velocity,
                pressure,
                periodic,
                k,
                non_temporal,
                tendency: [x, y, z],
                predicted: [&mut *px, &mut *py, pz],
                sum: &mut partial.tendency,
            });
            boundaries.set_prescribed(layout, 0, px);
            boundaries.set_prescribed(layout, 1, py);
        });
        boundaries.set_prescribed(layout, 2, &mut self.predicted.z);
        let sum = self.partial.iter().fold(DVec3::ZERO, |sum, plane| sum + plane.tendency);
        let [_, _, _, x, y, z] = self.tendency_sums;
        self.tendency_sums = [x, y, z, sum.x, sum.y, sum.z];
        self.impulse = now * sum + before * DVec3::new(x, y, z);
        self.convect_outflow(dt);
        self.previous_step = Some(dt);
    }

    /// Solves lap(f) = div(u*)/dt, sets u = u* - dt grad(f), p += f, and fills the ghosts.
    pub fn project(&mut self, dt: f64) -> FlowMeasures {
        let (mesh, layout) = (&self.mesh, self.mesh.layout());
        let (periodic, non_temporal) = (self.boundaries.periodic(), self.non_temporal);
        let (predicted, boundaries) = (&self.predicted, &self.boundaries);
        let divergence = |k: usize, out: &mut Plane<R>| {
            let faces = FacePlanes::new(mesh, periodic, predicted, k);
            dispatch(Divergence { faces, dt, out });
        };
        let [x, y, z] = self.velocity.components_mut();
        let correct = |k: usize, solution: Solution<R>, fields: [&mut [R]; 4], measures: &mut _| {
            let [x, y, z, p] = fields;
            dispatch(Correct {
                faces: FacePlanes::new(mesh, periodic, predicted, k),
                solution,
                k,
                dt,
                non_temporal,
                velocity: [&mut *x, &mut *y, &mut *z],
                pressure: &mut *p,
                measures,
            });
            let components = [Some(0), Some(1), Some(2), None];
            for (component, field) in components.into_iter().zip([x, y, z, p]) {
                boundaries.fill_ghosts(layout, component, 0..2, field);
            }
        };
        let fields = [x, y, z, &mut self.pressure];
        self.poisson.solve(non_temporal, divergence, fields, &mut self.partial, correct);
        if !periodic[2] {
            // The upper boundary faces keep the predicted velocity.
            let upper = (layout.cells[2] + 1) * layout.plane()..;
            let faces = &mut self.velocity.z[upper.clone()];
            faces.copy_from_slice(&predicted.z[upper]);
            boundaries.fill_ghosts(layout, Some(2), 0..2, faces);
        }
        boundaries.fill_ghosts(layout, None, 2..3, &mut self.pressure);
        for axis in 0..3 {
            boundaries.fill_ghosts(layout, Some(axis), 2..3, self.velocity.component_mut(axis));
        }
        self.total()
    }

    /// Sums and maxima over all planes, in the order of the planes.
    fn total(&mut self) -> FlowMeasures {
        let mut total = FlowMeasures::default();
        let mut rise = DVec3::ZERO;
        for plane in &self.partial {
            let m = &plane.flow;
            total.max_divergence = total.max_divergence.max(m.max_divergence);
            total.max_rate = total.max_rate.max(m.max_rate);
            total.max_velocity = total.max_velocity.max(m.max_velocity);
            total.kinetic_energy += m.kinetic_energy;
            total.momentum += m.momentum;
            rise += DVec3::new(plane.pressure_rise[0], plane.pressure_rise[1], 0.0);
        }
        let layout = self.mesh.layout();
        let (plane, nz) = (layout.plane(), layout.cells[2]);
        for j in 1..=layout.cells[1] {
            for at in layout.index(1, j, 0)..=layout.index(layout.cells[0], j, 0) {
                rise.z += self.pressure[nz * plane + at].wide() - self.pressure[plane + at].wide();
            }
        }
        self.pressure_rise = rise;
        total.max_velocity = total.max_velocity.sqrt();
        total.kinetic_energy *= self.mesh.cell_volume();
        total.momentum *= self.mesh.cell_volume();
        if total.kinetic_energy.is_nan() {
            // `max` ignores NaN, a sum does not.
            total.max_divergence = f64::NAN;
            total.max_rate = f64::NAN;
            total.max_velocity = f64::NAN;
        }
        total
    }

    /// Impulse per density [m^4/s] on the fluid from walls, open faces and body force in the step
    /// just projected.
    pub fn boundary_impulse(&self, dt: f64) -> DVec3 {
        let mut sum = self.impulse;
        for axis in (0..3).filter(|&axis| !self.boundaries.is_periodic(axis)) {
            // The sum of a gradient over the inner faces is the difference of the outermost cells.
            sum[axis] -= dt * self.pressure_rise[axis] / self.mesh.spacing[axis];
        }
        sum * self.mesh.cell_volume()
    }

    /// First projection of the paper's scheme: u* becomes the divergence-free flow without grains,
    /// and p is incremented.
    pub fn project_prediction(&mut self, dt: f64) {
        self.project(dt);
        self.predicted.copy_from(&self.velocity);
    }

    /// State on which later steps depend: fields, and sums over them.
    pub fn state(&self) -> ([&[R]; 7], &[f64]) {
        let (u, h) = (&self.velocity, &self.tendency);
        let fields = [&*u.x, &u.y, &u.z, &h.x, &h.y, &h.z, &self.pressure];
        (fields, &self.tendency_sums)
    }
    /// Mutable [`Self::state`], to be overwritten by a state whose last step took `last_step` [s].
    pub fn state_mut(&mut self, last_step: f64) -> ([&mut [R]; 7], &mut [f64]) {
        self.previous_step = (last_step > 0.0).then_some(last_step);
        let (u, h) = (&mut self.velocity, &mut self.tendency);
        let fields =
            [&mut *u.x, &mut u.y, &mut u.z, &mut h.x, &mut h.y, &mut h.z, &mut self.pressure];
        (fields, &mut self.tendency_sums)
    }

    /// View of the velocity component along `axis` on its faces [m/s].
    pub fn velocity_view(&self, axis: Axis) -> FieldView<'_, R> {
        FieldView::new(self.velocity.component(axis as usize), &self.mesh, Some(axis))
    }
    /// View of the dynamic pressure over density at the cell centres [m^2/s^2].
    pub fn pressure_view(&self) -> FieldView<'_, R> {
        FieldView::new(&self.pressure, &self.mesh, None)
    }
    /// Grid of the box.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }
    /// Conditions on the faces of the box.
    pub fn boundaries(&self) -> &Boundaries {
        &self.boundaries
    }
    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        R::BYTES * 10 * self.mesh.layout().len() + self.poisson.bytes()
    }
    /// Time spent in each stage of the Poisson solves, divergence and correction included.
    pub fn poisson_times(&self) -> PoissonTimes {
        self.poisson.times
    }
}
