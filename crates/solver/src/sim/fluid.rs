//! The fluid side of a simulation: what the time step asks of it, in whichever precision.

use std::io;

use glam::DVec3;

use super::Setup;
use super::state::{Reader, Writer};
use crate::dem::{Grain, Response};
use crate::flow::{Flow, FlowMeasures, FluidParams};
use crate::immersed::{Coupling, Past};
use crate::math::{Load, Precision, Real};
use crate::poisson::Stages;

/// Flow and coupling. Every step has its place in `step.rs`; what each does is said where it lies.
pub(super) trait Fluid: Send + Sync {
    fn set_body_acceleration(&mut self, acceleration: DVec3);
    fn predict(&mut self, dt: f64);
    fn remember(&mut self, grains: &[Grain]);
    /// Finds the faces near restored grains; in a step [`Fluid::couple`] does.
    fn locate(&mut self, grains: &[Grain], dt: f64);
    fn project_prediction(&mut self, dt: f64);
    fn couple(
        &mut self,
        grains: &[Grain],
        before: &[Past],
        contact: &[Load],
        other: &[Load],
        dt: f64,
    );
    fn responses(
        &self,
        grains: &[Grain],
        before: &[Past],
        added_density: f64,
        dt: f64,
    ) -> Vec<Response>;
    fn impose_rigidity(
        &mut self,
        grains: &mut [Grain],
        before: &[Past],
        contact: &[Load],
        dt: f64,
        loads: &mut [Load],
    );
    fn project(&mut self, dt: f64);
    /// Of the last projection.
    fn measures(&self) -> &FlowMeasures;
    fn boundary_impulse(&self, dt: f64) -> DVec3;
    /// Velocity component of the face at a place in memory [m/s].
    fn velocity(&self, component: usize, at: usize) -> f64;
    /// Dynamic pressure over density of the cell at a place in memory [m^2/s^2].
    fn pressure(&self, at: usize) -> f64;
    fn poisson_stages(&self) -> Stages;
    /// Memory held [bytes].
    fn bytes(&self) -> usize;
    fn save(&self, out: &mut Writer) -> io::Result<()>;
    /// Reads what `save` wrote; `last_step` [s] is the length of the step before.
    fn restore(&mut self, input: &mut Reader, last_step: f64) -> io::Result<()>;
}

/// The fluid of a set-up at t = 0.
pub(super) fn start(setup: &Setup, params: &FluidParams) -> Box<dyn Fluid> {
    match setup.precision {
        Precision::Single => Box::new(FluidOf::<f32>::start(setup, params)),
        Precision::Double => Box::new(FluidOf::<f64>::start(setup, params)),
    }
}

struct FluidOf<R> {
    flow: Flow<R>,
    coupling: Coupling,
    measures: FlowMeasures,
}

impl<R: Real> FluidOf<R> {
    fn start(setup: &Setup, params: &FluidParams) -> FluidOf<R> {
        let mut flow = Flow::new(&setup.mesh, setup.boundaries, params);
        if let Some(velocity) = &setup.prescription.initial_velocity {
            flow.start_from(|axis, at| velocity.component(axis, &at.to_array()));
        }
        let (density, nu) = (params.density, params.kinematic_viscosity);
        let mut coupling = Coupling::new(&flow, setup.scheme, density, nu, &setup.grains);
        let measures = coupling.start(&mut flow, &setup.grains);
        FluidOf {
            flow,
            coupling,
            measures,
        }
    }
}

impl<R: Real> Fluid for FluidOf<R> {
    fn set_body_acceleration(&mut self, acceleration: DVec3) {
        self.flow.set_body_acceleration(acceleration);
    }
    fn predict(&mut self, dt: f64) {
        self.flow.predict(dt);
    }
    fn remember(&mut self, grains: &[Grain]) {
        self.coupling.remember(grains);
    }
    fn locate(&mut self, grains: &[Grain], dt: f64) {
        self.coupling.locate(grains, dt);
    }
    fn project_prediction(&mut self, dt: f64) {
        self.flow.project_prediction(dt);
    }
    fn couple(
        &mut self,
        grains: &[Grain],
        before: &[Past],
        contact: &[Load],
        other: &[Load],
        dt: f64,
    ) {
        let flow = &mut self.flow;
        self.coupling
            .couple(flow, grains, before, contact, other, dt);
    }
    fn responses(
        &self,
        grains: &[Grain],
        before: &[Past],
        added_density: f64,
        dt: f64,
    ) -> Vec<Response> {
        self.coupling.responses(grains, before, added_density, dt)
    }
    fn impose_rigidity(
        &mut self,
        grains: &mut [Grain],
        before: &[Past],
        contact: &[Load],
        dt: f64,
        loads: &mut [Load],
    ) {
        let flow = &mut self.flow;
        self.coupling
            .impose_rigidity(flow, grains, before, contact, dt, loads);
    }
    fn project(&mut self, dt: f64) {
        self.measures = self.flow.project(dt);
    }
    fn measures(&self) -> &FlowMeasures {
        &self.measures
    }
    fn boundary_impulse(&self, dt: f64) -> DVec3 {
        self.flow.boundary_impulse(dt)
    }
    fn velocity(&self, component: usize, at: usize) -> f64 {
        self.flow.velocity.component(component)[at].wide()
    }
    fn pressure(&self, at: usize) -> f64 {
        self.flow.pressure[at].wide()
    }
    fn poisson_stages(&self) -> Stages {
        self.flow.poisson_stages()
    }
    fn bytes(&self) -> usize {
        self.flow.bytes() + self.coupling.bytes()
    }
    fn save(&self, out: &mut Writer) -> io::Result<()> {
        out.count(R::BYTES as u64)?;
        let m = &self.measures;
        out.numbers(&[
            m.max_divergence,
            m.max_rate,
            m.max_velocity,
            m.kinetic_energy,
        ])?;
        out.numbers(&m.momentum.to_array())?;
        let (fields, sums) = self.flow.state();
        let layout = self.flow.mesh().layout();
        for values in fields {
            out.count(layout.entries() as u64)?;
            for row in layout.rows(values) {
                out.numbers(row)?;
            }
        }
        out.count(sums.len() as u64)?;
        out.numbers(sums)
    }
    fn restore(&mut self, input: &mut Reader, last_step: f64) -> io::Result<()> {
        input.expect(R::BYTES, "bytes a number")?;
        let m = &mut self.measures;
        [
            m.max_divergence,
            m.max_rate,
            m.max_velocity,
            m.kinetic_energy,
        ] = input.numbers()?;
        m.momentum = DVec3::from_array(input.numbers()?);
        let layout = self.flow.mesh().layout();
        let (fields, sums) = self.flow.state_mut(last_step);
        for values in fields {
            input.expect(layout.entries(), "field entries")?;
            for row in layout.rows_mut(values) {
                input.fill(row)?;
            }
        }
        input.expect(sums.len(), "sums")?;
        input.fill(sums)
    }
}
