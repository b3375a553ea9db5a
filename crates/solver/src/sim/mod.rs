//! The coupled simulation: set-up, clock, time step, events, diagnostics and state.

mod clock;
mod control;
mod diagnostics;
pub mod events;
mod failure;
mod fields;
mod fluid;
mod prescription;
mod probe;
mod refinement;
mod sample;
mod setup;
mod solid_fraction;
mod stability;
mod stages;
mod state;
mod step;
#[cfg(test)]
mod tests;
mod timing;

use glam::DVec3;

use crate::dem::{
    Contact, ContactDynamics, ContactParams, Grain, GrainResponse, RelativeOverlap, RigidState,
};
use crate::grid::Mesh;
use crate::immersed::{OpenSides, PreviousStep};
use crate::math::{Load, Pose, RigidVelocity};

use clock::Clock;
use control::InitialControl;
use fluid::Fluid;
use timing::PassTimes;

pub use control::{ControlError, MotionComponent};
pub use diagnostics::Diagnostics;
pub use failure::{AdvanceError, Remedy, RemedyTerms, StepError};
pub use fields::{AnyFieldView, CELL_FIELDS, CellField};
pub use prescription::{PrescribedMotion, Prescription};
pub use refinement::LEAST_REFINEMENT_MARGIN;
pub use sample::{PlaneSample, PointSample};
pub use setup::{LIGHTEST_FREE_GRAIN, Setup, SetupError, StepRule};
pub use step::SAME_TIME;

/// Simulation of grains in a fluid, or of grains alone.
///
/// Units are SI. Positions, velocities and loads are in the space frame, angular velocities and
/// torques too; torques are about the centroid of their grain. State refers to the end of the last
/// step. Built by [`Simulation::new`], advanced by [`Simulation::step`], and stored exactly by
/// [`Simulation::save`] and [`Simulation::restore`]. Results do not depend on the number of
/// threads.
pub struct Simulation {
    setup: Setup,
    clock: Clock,
    fluid: Option<Box<dyn Fluid>>,
    data: StepData,
}

/// Data of a step besides those of the fluid; each list has one entry per grain.
struct StepData {
    dynamics: ContactDynamics,
    /// Open sides of the box; none if all are walls or periodic.
    open_sides: Option<OpenSides>,
    times: PassTimes,
    /// Change of momentum in the last step not explained by forces [kg m/s].
    momentum_residual: DVec3,
    /// Mean hydrodynamic loads over the last step; zero without fluid.
    loads: Vec<Load>,
    previous: Vec<PreviousStep>,
    /// Poses at the start of the step, and the velocities that the fluid has there.
    kinematics: Vec<RigidState>,
    initial_control: InitialControl,
    /// Loads set between steps.
    external: Vec<Load>,
    /// Weight less buoyancy, and external load.
    applied: Vec<Load>,
    /// Load during the sub-steps: applied load and hydrodynamic load of the last step.
    driving: Vec<Load>,
    /// Mean contact loads over the step.
    contact: Vec<Load>,
    responses: Vec<GrainResponse>,
    /// States at the end of the contact sub-steps with the fluid's response.
    ends: Vec<RigidState>,
    /// Poses at which the grains were located on the grid.
    located: Vec<Pose>,
}

impl StepData {
    fn new(setup: &Setup) -> StepData {
        let (grains, count) = (&setup.grains, setup.grains.len());
        // With fluid the equations of the grains contain the damping (`Start::prepare`).
        let in_substeps = if setup.fluid.is_some() { 0.0 } else { setup.contact.global_damping };
        let contact = ContactParams { global_damping: in_substeps, ..setup.contact };
        StepData {
            dynamics: ContactDynamics::new(contact, setup.enclosure()),
            open_sides: OpenSides::new(&setup.mesh, &setup.boundaries, grains),
            times: PassTimes::default(),
            momentum_residual: DVec3::ZERO,
            loads: vec![Load::default(); count],
            previous: grains.iter().map(PreviousStep::of).collect(),
            kinematics: grains.iter().map(RigidState::of).collect(),
            initial_control: InitialControl::of(setup),
            external: vec![Load::default(); count],
            applied: vec![Load::default(); count],
            driving: vec![Load::default(); count],
            contact: vec![Load::default(); count],
            responses: Vec::with_capacity(count),
            ends: grains.iter().map(RigidState::of).collect(),
            located: grains.iter().map(|grain| grain.pose).collect(),
        }
    }
}

impl Simulation {
    /// Builds the simulation at t = 0. Grains that start with a velocity set the fluid in motion at
    /// once: it starts with the irrotational flow around them (its added mass), inside a grain with
    /// the velocity of the grain. Released grains ([`Start`](crate::immersed::Start)) lose the
    /// momentum that the fluid gains.
    ///
    /// # Errors
    /// [`SetupError::Inconsistent`] if values of the set-up contradict each other.
    pub fn new(mut setup: Setup) -> Result<Simulation, SetupError> {
        setup.validate()?;
        (setup.prescription).prescribe_motion(&mut setup.grains, 0.0);
        let plane_normal = setup.flat_axis();
        setup.grains.iter_mut().for_each(|grain| grain.plane_normal = plane_normal);
        let fluid = setup.fluid.map(|params| fluid::start(&mut setup, &params));
        let (clock, mut data) = (Clock::new(&setup), StepData::new(&setup));
        if let Some(fluid) = &fluid {
            data.times.initial = fluid.poisson_times();
        }
        Ok(Simulation { setup, clock, fluid, data })
    }
    /// Limits the length of the next step as that of the first one, for a run that begins with the
    /// state of another, whose gravity may differ.
    pub fn limit_next_step(&mut self) {
        self.clock.longest_next = self.clock.longest_first;
    }
    /// Simulated time [s].
    pub fn time(&self) -> f64 {
        self.clock.time
    }
    /// Number of steps taken.
    pub fn steps(&self) -> u64 {
        self.clock.steps
    }
    /// Length of the last step [s]; zero before the first.
    pub fn time_step(&self) -> f64 {
        self.clock.last_step
    }
    /// The grid.
    pub fn mesh(&self) -> &Mesh {
        &self.setup.mesh
    }
    /// The set-up; its grains are in their present state.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }
    /// Grains in their present state.
    pub fn grains(&self) -> &[Grain] {
        &self.setup.grains
    }
    /// Velocities with which a grain moves. In the step of an impact in a fluid those of
    /// [`Simulation::grains`] are larger: they contain a part that the added mass takes up in the
    /// next step (decision 0014).
    pub fn grain_velocity(&self, grain: usize) -> RigidVelocity {
        let pending = self.data.previous[grain].pending_added_mass_velocity;
        self.setup.grains[grain].rigid_velocity() - pending
    }
    /// Mean hydrodynamic load on each grain over the last step (Eq. 5), without buoyancy: force [N]
    /// and torque about the centroid [N m], space frame.
    pub fn loads(&self) -> &[Load] {
        &self.data.loads
    }
    /// Pairs that touched during the last step.
    pub fn contacts(&self) -> &[Contact] {
        self.data.dynamics.contacts()
    }
    /// Largest overlap at any sub-step of the last step; `None` without contact.
    pub fn largest_overlap(&self) -> Option<RelativeOverlap> {
        self.data.dynamics.largest_overlap(&self.setup.grains, |_| true)
    }
    /// Contact sub-steps of the last step; of a step repeated with the response of the fluid, those
    /// of the repetition.
    pub fn substeps(&self) -> usize {
        self.data.dynamics.substeps()
    }
    /// Memory held by fields, solver and grains on the grid [bytes].
    pub fn bytes(&self) -> usize {
        self.fluid.as_ref().map_or(0, |fluid| fluid.bytes())
    }
}
