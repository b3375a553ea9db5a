//! Work on one grain in a step: the whole update of an isolated grain; location and equations of
//! motion of any other.

use super::access::{Access, AccessLog};
use super::advection::{AdvectionCorrection, AdvectionScratch, add_correction, find_correction};
use super::forcing::{ForcedFaces, ForcingParams, impose_rigidity, sum_impulse};
use super::geometry::{LocateScratch, LocatedBody, Locator};
use super::kinematics::{GrainKinematics, PreviousStep, RigidVelocity};
use super::rigid_body::RigidBodySystem;
use crate::dem::Grain;
use crate::flow::{OldState, Prediction};
use crate::math::{Load, Real};

/// Lists of the faces near one grain, kept from one step to the next.
#[derive(Default)]
pub struct ImmersedGrain {
    /// Faces within reach and their distances.
    pub body: LocatedBody,
    /// Forced faces; empty for an isolated grain, which uses [`ThreadScratch`].
    pub forced: ForcedFaces,
    /// Correction of the advection; empty for an isolated grain.
    pub correction: AdvectionCorrection,
}

impl ImmersedGrain {
    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        let correction: usize = self.correction.iter().map(Vec::capacity).sum();
        size_of::<ImmersedGrain>()
            + self.body.bytes()
            + self.forced.bytes()
            + size_of::<f64>() * correction
    }
}

/// Progress of one grain in a step.
#[derive(Clone, Copy, Default)]
pub struct GrainUpdate {
    /// Whether no other grain uses the same faces and no contact load acts on the grain.
    pub isolated: bool,
    /// Equations for the new velocities.
    pub system: RigidBodySystem,
    /// Velocities that the forced faces have taken already.
    pub imposed: Option<RigidVelocity>,
    /// Velocities that the forced faces have yet to take.
    pub pending: Option<PendingRigidity>,
}

/// Rigid velocity to be imposed, and the change of the grain's velocity that goes with it.
#[derive(Clone, Copy)]
pub struct PendingRigidity {
    /// U, or its part that has not been imposed yet.
    pub velocity: RigidVelocity,
    /// U - U_old, or its part that has not been imposed yet.
    pub change: RigidVelocity,
}

impl GrainUpdate {
    /// Gives the grain its new velocities under the mean `contact` load over `dt` [s]; the part
    /// that its faces have not taken becomes pending.
    pub fn set_velocities(
        &mut self,
        grain: &mut Grain,
        previous: &PreviousStep,
        contact: Load,
        dt: f64,
    ) {
        let touched = !contact.is_zero();
        let velocity = match self.imposed {
            Some(imposed) if !touched => imposed,
            _ => self.system.velocities(grain, previous, contact, dt),
        };
        grain.velocity = velocity.linear;
        grain.angular_velocity = velocity.angular;
        self.pending = match self.imposed {
            None => Some(PendingRigidity { velocity, change: velocity - previous.velocity }),
            Some(imposed) => touched.then_some(PendingRigidity {
                velocity: velocity - imposed,
                change: velocity - imposed,
            }),
        };
    }
}

/// Inputs of a step, one entry per grain.
#[derive(Clone, Copy)]
pub struct StepInput<'a> {
    /// Grains at their new poses.
    pub grains: &'a [Grain],
    /// Kinematics when the flow was predicted.
    pub kinematics: &'a [GrainKinematics],
    /// State carried over from the previous step.
    pub previous: &'a [PreviousStep],
    /// Mean contact loads in the sub-steps so far.
    pub contact: &'a [Load],
    /// Weight less buoyancy.
    pub applied: &'a [Load],
    /// Length of the step [s].
    pub dt: f64,
}

/// Buffers of one thread.
#[derive(Default)]
pub struct ThreadScratch<R> {
    /// Buffers of the advection correction.
    pub advection: AdvectionScratch<R>,
    /// Buffers of the location of a grain.
    pub locate: LocateScratch,
    /// Correction of the advection next to an isolated grain.
    correction: AdvectionCorrection,
    /// Forced faces of an isolated grain.
    forced: ForcedFaces,
}

/// Fields and parameters of a step, shared by all grains.
pub struct CouplingStep<'a, R> {
    /// Geometry of the grains on the grid.
    pub locator: &'a Locator,
    /// Parameters of the forcing.
    pub params: ForcingParams,
    /// Grains and loads.
    pub input: StepInput<'a>,
    /// Fields of the last step.
    pub known: OldState<'a, R>,
    /// Whether the advection next to the grains is corrected: in the aperture scheme.
    pub corrects_advection: bool,
    /// Density of the fluid [kg/m^3].
    pub fluid_density: f64,
    /// Log of the faces that the grains read and write.
    pub access: &'a AccessLog,
}

impl<R: Real> CouplingStep<'_, R> {
    /// Updates an isolated grain: corrects the advection at its last pose, locates it, solves for
    /// its velocities and imposes them on `predictions`.
    pub fn update_isolated(
        &self,
        index: usize,
        grain: &mut ImmersedGrain,
        update: &mut GrainUpdate,
        predictions: &mut [Prediction<R>; 3],
        scratch: &mut ThreadScratch<R>,
    ) {
        let ThreadScratch { advection, locate, correction, forced } = scratch;
        let body = &mut grain.body;
        if self.corrects_advection {
            let (kinematics, eps) = (&self.input.kinematics[index], self.locator.eps());
            find_correction(eps, &self.known, kinematics, body, advection, correction);
            self.access.record_rows(index, body);
            for (component, prediction) in predictions.iter_mut().enumerate() {
                add_correction(body, correction, component, prediction);
            }
        }
        self.locate(index, body, forced, locate);
        self.access.record_forced(index, Access::Write, forced);
        update.system = self.assemble(index, predictions, forced);
        let (grain, previous) = (&self.input.grains[index], &self.input.previous[index]);
        let no_contact = Load::default();
        let velocity = (update.system).velocities(grain, previous, no_contact, self.input.dt);
        let change = velocity - previous.velocity;
        let h = self.known.mesh.spacing;
        for (axis, prediction) in predictions.iter_mut().enumerate() {
            impose_rigidity(axis, h, forced, velocity, change, prediction);
        }
        update.imposed = Some(velocity);
    }

    /// Locates a grain that is not isolated and assembles its equations of motion.
    pub fn locate_and_assemble(
        &self,
        index: usize,
        grain: &mut ImmersedGrain,
        update: &mut GrainUpdate,
        predictions: &[Prediction<R>; 3],
        scratch: &mut LocateScratch,
    ) {
        self.locate(index, &mut grain.body, &mut grain.forced, scratch);
        (self.access).record_forced(index, Access::Read, &grain.forced);
        update.system = self.assemble(index, predictions, &mut grain.forced);
    }

    fn locate(
        &self,
        index: usize,
        body: &mut LocatedBody,
        forced: &mut ForcedFaces,
        scratch: &mut LocateScratch,
    ) {
        let (params, grain) = (&self.params, &self.input.grains[index]);
        locate_and_compute_weights(self.locator, params, index, grain, body, forced, scratch);
    }

    /// Sums the impulse of the fluid and assembles the equations of motion.
    fn assemble(
        &self,
        index: usize,
        predictions: &[Prediction<R>; 3],
        forced: &mut ForcedFaces,
    ) -> RigidBodySystem {
        let (known, density, dt) = (&self.known, self.fluid_density, self.input.dt);
        let (grain, previous) = (&self.input.grains[index], &self.input.previous[index]);
        let motion = [previous.velocity, previous.acceleration];
        let impulse = sum_impulse(known, predictions, density, forced, motion, dt);
        let applied = self.input.applied[index];
        RigidBodySystem::new(grain, previous, impulse, density, applied, dt)
    }
}

/// Locates a grain and computes the weights of the faces that it forces.
pub fn locate_and_compute_weights(
    locator: &Locator,
    params: &ForcingParams,
    index: usize,
    grain: &Grain,
    body: &mut LocatedBody,
    forced: &mut ForcedFaces,
    scratch: &mut LocateScratch,
) {
    locator.locate(index, grain, body, &mut forced.runs, scratch);
    let neighbours = locator.neighbours(index);
    forced.compute_weights(params, &mut scratch.band, neighbours, locator.shapes());
}
