//! Fluid side of a simulation, behind one interface for both precisions.

use std::io;

use glam::DVec3;
use grainwake_formats::codec::{Decoder, Encoder, invalid};

use super::fields::AnyFieldView;
use super::probe::{Probe, SampledGrid};
use super::refinement::{box_around, is_possible};
use super::setup::Setup;
use crate::dem::Grain;
use crate::flow::{CoveredFace, Flow, FlowMeasures, FluidParams, NestedFlow, RefinedBox};
use crate::grid::{Axis, FieldView};
use crate::immersed::{CoupledGrains, CouplingInput, ImmersedGrains, RigidityInput};
use crate::math::{Precision, Real};
use crate::poisson::PoissonTimes;

/// Flow and coupling in either precision; called in order by the stages of a step (`stages.rs`).
pub(super) trait Fluid: Send + Sync {
    /// Replaces the body acceleration [m/s^2].
    fn set_body_acceleration(&mut self, acceleration: DVec3);
    /// Predicts u* over `dt` [s] without the grains.
    fn predict(&mut self, dt: f64);
    /// First projection of the paper's scheme.
    fn project_prediction(&mut self, dt: f64);
    /// Locates the grains and assembles their equations of motion; isolated grains impose their
    /// velocities at once.
    fn couple(&mut self, input: CouplingInput) -> CoupledGrains;
    /// Gives the grains their new velocities and imposes those of the other grains.
    fn impose_rigidity(&mut self, coupled: CoupledGrains, step: RigidityInput);
    /// Sets the outward speeds [m/s] of the fastest grains close to each side.
    fn set_crossing_speeds(&mut self, speeds: [[f64; 2]; 3]);
    /// Kinematic pressure [m^2/s^2] below covered faces of one side, relative to the open ones.
    fn pressure_below(&self, covered: &[CoveredFace]) -> Vec<f64>;
    /// Gives the boundary faces that grains cover the velocities of these.
    fn cover_boundary(&mut self, covered: &[CoveredFace]);
    /// Makes the velocity divergence-free.
    fn project(&mut self, dt: f64);
    /// Measures of the last projection.
    fn measures(&self) -> &FlowMeasures;
    /// Momentum per density gained through the boundaries in a step of `dt` [s] [m^4/s].
    fn boundary_impulse(&self, dt: f64) -> DVec3;
    /// Velocity component along `axis` on its faces [m/s].
    fn velocity(&self, axis: Axis) -> AnyFieldView<'_>;
    /// Dynamic pressure over density at the cell centres [m^2/s^2].
    fn kinematic_pressure(&self) -> AnyFieldView<'_>;
    /// Velocity [m/s] at the centre of cell (i, j, k), counted from 0.
    fn velocity_at(&self, cell: [usize; 3]) -> DVec3;
    /// Vorticity [1/s] at the centre of cell (i, j, k), counted from 0.
    fn vorticity_at(&self, cell: [usize; 3]) -> DVec3;
    /// Velocity [m/s] at a point; `None` outside the box.
    fn interpolate_velocity(&self, x: DVec3) -> Option<DVec3>;
    /// Wall time that the Poisson solvers have spent in each of their stages.
    fn poisson_times(&self) -> PoissonTimes;
    /// Memory held [bytes].
    fn bytes(&self) -> usize;
    /// Writes measures and fields.
    fn save(&self, out: &mut Encoder) -> io::Result<()>;
    /// Restores the state written by `save` and finds the faces near `grains`; `last_step` [s] is
    /// the length of the last step.
    fn restore(&mut self, input: &mut Decoder, last_step: f64, grains: &[Grain]) -> io::Result<()>;
}

/// Builds the fluid of a set-up at t = 0; released grains get their new velocities.
pub(super) fn start(setup: &mut Setup, params: &FluidParams) -> Box<dyn Fluid> {
    match setup.precision {
        Precision::Single => Box::new(FluidOf::<f32>::start(setup, params)),
        Precision::Double => Box::new(FluidOf::<f64>::start(setup, params)),
    }
}

struct FluidOf<R> {
    flow: NestedFlow<R>,
    grains: ImmersedGrains<R>,
    measures: FlowMeasures,
    /// Grains when they were located last, if a refined box follows them.
    followed: Vec<Grain>,
    /// Least distance from these grains to the sides of that box [m].
    refinement_margin: Option<DVec3>,
}

impl<R: Real> FluidOf<R> {
    fn probe(&self) -> Probe<'_, R> {
        let whole = &self.flow.whole;
        let grid = SampledGrid { mesh: whole.mesh(), boundaries: whole.boundaries() };
        Probe { velocity: &whole.velocity, grid }
    }
    fn start(setup: &mut Setup, params: &FluidParams) -> FluidOf<R> {
        let mut whole = Flow::new(&setup.mesh, setup.boundaries, params);
        if let Some(velocity) = &setup.prescription.initial_velocity {
            whole.start_from(|axis, at| velocity.component(axis, &at.to_array()));
        }
        let mut flow = NestedFlow::new(whole, params);
        let mut followed = Vec::new();
        if let Some(place) = setup.refined_box() {
            flow.refine(place);
            followed = setup.grains.clone();
        }
        let (density, nu) = (params.density, params.kinematic_viscosity);
        let mut grains =
            ImmersedGrains::new(flow.finest(), setup.scheme, density, nu, &setup.grains);
        let measures = grains.initialise(&mut flow, &mut setup.grains, setup.start);
        let refinement_margin = setup.refinement_margin;
        FluidOf { flow, grains, measures, followed, refinement_margin }
    }

    /// Moves the refined box if it no longer holds the grains and their margins.
    fn follow_grains(&mut self) {
        let present @ Some(_) = self.flow.refined_box() else { return };
        let whole = &self.flow.whole;
        let (mesh, boundaries) = (whole.mesh(), whole.boundaries());
        let margin = self.refinement_margin;
        let place = box_around(mesh, boundaries, &self.followed, margin, present);
        if let Some(place) = place.filter(|place| Some(*place) != present) {
            self.flow.refine(place);
            self.grains.move_to_grid(self.flow.finest(), &self.followed);
        }
    }
}

impl<R: Real> Fluid for FluidOf<R>
where
    for<'a> AnyFieldView<'a>: From<FieldView<'a, R>>,
{
    fn set_body_acceleration(&mut self, acceleration: DVec3) {
        self.flow.set_body_acceleration(acceleration);
    }
    fn predict(&mut self, dt: f64) {
        self.follow_grains();
        self.flow.predict(dt);
    }
    fn project_prediction(&mut self, dt: f64) {
        self.flow.whole.project_prediction(dt);
    }
    fn couple(&mut self, input: CouplingInput) -> CoupledGrains {
        self.followed.iter_mut().zip(input.grains).for_each(|(kept, grain)| kept.clone_from(grain));
        self.grains.couple(self.flow.finest_mut(), input)
    }
    fn impose_rigidity(&mut self, coupled: CoupledGrains, step: RigidityInput) {
        self.grains.impose_rigidity(self.flow.finest_mut(), coupled, step);
    }
    fn set_crossing_speeds(&mut self, speeds: [[f64; 2]; 3]) {
        self.flow.whole.set_crossing_speeds(speeds);
    }
    fn pressure_below(&self, covered: &[CoveredFace]) -> Vec<f64> {
        self.flow.whole.pressure_below(covered)
    }
    fn cover_boundary(&mut self, covered: &[CoveredFace]) {
        self.flow.whole.cover_boundary(covered);
    }
    fn project(&mut self, dt: f64) {
        self.measures = self.flow.project(dt);
    }
    fn measures(&self) -> &FlowMeasures {
        &self.measures
    }
    fn boundary_impulse(&self, dt: f64) -> DVec3 {
        self.flow.whole.boundary_impulse(dt)
    }
    fn velocity(&self, axis: Axis) -> AnyFieldView<'_> {
        self.flow.whole.velocity_view(axis).into()
    }
    fn kinematic_pressure(&self) -> AnyFieldView<'_> {
        self.flow.whole.pressure_view().into()
    }
    fn velocity_at(&self, cell: [usize; 3]) -> DVec3 {
        self.probe().velocity_at(cell)
    }
    fn vorticity_at(&self, cell: [usize; 3]) -> DVec3 {
        self.probe().vorticity_at(cell)
    }
    fn interpolate_velocity(&self, x: DVec3) -> Option<DVec3> {
        self.probe().interpolate_velocity(x)
    }
    fn poisson_times(&self) -> PoissonTimes {
        self.flow.poisson_times()
    }
    fn bytes(&self) -> usize {
        self.flow.flows().map(Flow::bytes).sum::<usize>() + self.grains.bytes()
    }
    fn save(&self, out: &mut Encoder) -> io::Result<()> {
        out.u64(R::BYTES as u64)?;
        let m = &self.measures;
        out.reals(&[m.max_divergence, m.max_rate, m.max_velocity, m.kinetic_energy])?;
        out.vector(m.momentum)?;
        save_flow(&self.flow.whole, out)?;
        if let Some(place) = self.flow.refined_box() {
            for axis in 0..3 {
                out.u64(place.corner[axis] as u64)?;
                out.u64(place.cells[axis] as u64)?;
            }
            save_flow(self.flow.finest(), out)?;
        }
        Ok(())
    }
    fn restore(&mut self, input: &mut Decoder, last_step: f64, grains: &[Grain]) -> io::Result<()> {
        input.expect(R::BYTES, "bytes a number")?;
        let m = &mut self.measures;
        [m.max_divergence, m.max_rate, m.max_velocity, m.kinetic_energy] = input.numbers()?;
        m.momentum = input.vector()?;
        restore_flow(&mut self.flow.whole, input, last_step)?;
        if self.flow.refined_box().is_some() {
            let mut place = RefinedBox { corner: [0; 3], cells: [0; 3] };
            for axis in 0..3 {
                place.corner[axis] = input.u64()? as isize;
                place.cells[axis] = input.u64()? as usize;
            }
            let whole = &self.flow.whole;
            if !is_possible(whole.mesh(), whole.boundaries(), place) {
                return Err(invalid(format!("the refined box {place:?} does not fit the grid")));
            }
            self.flow.refine(place);
            restore_flow(self.flow.finest_mut(), input, last_step)?;
        }
        // The saved ghosts belong to the walls of the saved run, whose velocities may differ.
        self.flow.fill_ghosts();
        self.followed.iter_mut().zip(grains).for_each(|(kept, grain)| kept.clone_from(grain));
        self.grains.move_to_grid(self.flow.finest(), grains);
        Ok(())
    }
}

/// Writes the state of a flow.
fn save_flow<R: Real>(flow: &Flow<R>, out: &mut Encoder) -> io::Result<()> {
    let (fields, sums) = flow.state();
    let layout = flow.mesh().layout();
    for values in fields {
        out.u64(layout.entries() as u64)?;
        for row in layout.rows(values) {
            out.reals(row)?;
        }
    }
    out.u64(sums.len() as u64)?;
    out.reals(sums)
}

/// Reads the state written by [`save_flow`].
fn restore_flow<R: Real>(
    flow: &mut Flow<R>,
    input: &mut Decoder,
    last_step: f64,
) -> io::Result<()> {
    let layout = flow.mesh().layout();
    let (fields, sums) = flow.state_mut(last_step);
    for values in fields {
        input.expect(layout.entries(), "field entries")?;
        for row in layout.rows_mut(values) {
            input.fill(row)?;
        }
    }
    input.expect(sums.len(), "sums")?;
    input.fill(sums)
}
