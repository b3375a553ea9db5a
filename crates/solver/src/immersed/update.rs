//! Work on one grain in a step: all of it at once for an isolated grain, else up to the equations of
//! motion.

use super::advection::{
    AdvectionCorrection, AdvectionScratch, add_correction, find_correction, prefetch_velocity,
};
use super::forcing::{ForcedFaces, ForcingParams, impose_rigidity, sum_impulse};
use super::geometry::{LocateScratch, LocatedBody, Locator};
use super::kinematics::{GrainKinematics, PreviousStep, RigidVelocity};
use super::ownership::RowClaims;
use super::rigid_body::RigidBodySystem;
use crate::dem::Grain;
use crate::flow::{Known, Prediction};
use crate::math::{Load, Real};

/// Faces near one grain, kept from one step to the next.
#[derive(Default)]
pub struct ImmersedGrain {
    pub body: LocatedBody,
    /// Forced faces; empty for an isolated grain, whose lists are buffers of the thread.
    pub forced: ForcedFaces,
    /// Correction of the advection; likewise.
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
    /// Whether no other grain uses the same faces and nothing touched the grain.
    pub isolated: bool,
    /// Equations for its new velocities.
    pub system: RigidBodySystem,
    /// New velocities with which its faces have been forced already.
    pub imposed: Option<RigidVelocity>,
    /// Velocities with which its faces still have to be forced.
    pub pending: Option<PendingRigidity>,
}

/// Rigid velocity to be imposed, and the change of the grain's velocity that goes with it.
#[derive(Clone, Copy)]
pub struct PendingRigidity {
    pub velocity: RigidVelocity,
    pub change: RigidVelocity,
}

/// Inputs of a step, one entry per grain.
#[derive(Clone, Copy)]
pub struct StepInput<'a> {
    /// Grains at their new poses.
    pub grains: &'a [Grain],
    /// Kinematics when the flow was predicted.
    pub kinematics: &'a [GrainKinematics],
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
    pub advection: AdvectionScratch<R>,
    pub locate: LocateScratch,
    correction: AdvectionCorrection,
    forced: ForcedFaces,
}

/// Fields and parameters of a step, shared by all grains.
pub struct IsolatedUpdate<'a, R> {
    pub locator: &'a Locator,
    pub params: ForcingParams,
    pub input: StepInput<'a>,
    pub known: Known<'a, R>,
    pub predictions: [Prediction<'a, R>; 3],
    pub corrects_advection: bool,
    pub fluid_density: f64,
    /// See [`sum_impulse`].
    pub closure_dt: f64,
    pub claims: &'a RowClaims,
}

impl<R: Real> IsolatedUpdate<'_, R> {
    /// Updates an isolated grain: corrects the advection where it was, locates it, solves for its
    /// velocities and imposes them.
    ///
    /// # Safety
    /// No grain updated at the same time uses faces that this one uses, where it was or where it is.
    pub unsafe fn run(
        &self,
        index: usize,
        grain: &mut ImmersedGrain,
        update: &mut GrainUpdate,
        scratch: &mut ThreadScratch<R>,
    ) {
        // SAFETY: the faces of this grain are used by no other, as the caller guarantees.
        let mut own = (self.predictions.each_ref()).map(|one| unsafe { one.alias() });
        let ThreadScratch {
            advection,
            locate,
            correction,
            forced,
        } = scratch;
        let body = &mut grain.body;
        if self.corrects_advection {
            let kinematics = &self.input.kinematics[index];
            let eps = self.locator.eps();
            find_correction(eps, &self.known, kinematics, body, advection, correction);
            self.claims.claim_corrected(index, body);
            for (component, prediction) in own.iter_mut().enumerate() {
                add_correction(body, correction, component, prediction);
            }
        }
        self.locate(index, body, forced, locate);
        self.claims.claim_forced(index, true, forced);
        update.system = self.assemble(index, &own, forced);
        let (grain, previous) = (&self.input.grains[index], &self.input.previous[index]);
        let system = &update.system;
        let now = system.velocities(grain, previous, Load::default(), self.input.dt);
        let change = now - previous.velocity;
        let spacing = self.known.mesh.spacing;
        for (axis, prediction) in own.iter_mut().enumerate() {
            impose_rigidity(
                axis,
                spacing,
                forced,
                now,
                change,
                self.closure_dt,
                prediction,
            );
        }
        update.imposed = Some(now);
    }

    /// Locates a grain that is not isolated and assembles its equations of motion.
    pub fn locate_and_assemble(
        &self,
        index: usize,
        grain: &mut ImmersedGrain,
        update: &mut GrainUpdate,
        scratch: &mut LocateScratch,
    ) {
        self.locate(index, &mut grain.body, &mut grain.forced, scratch);
        self.claims.claim_forced(index, false, &grain.forced);
        update.system = self.assemble(index, &self.predictions, &mut grain.forced);
    }

    /// Prefetches the velocity around a grain that is updated next.
    pub fn prefetch(&self, grain: &ImmersedGrain) {
        prefetch_velocity(&self.known, &grain.body);
    }

    fn locate(
        &self,
        index: usize,
        body: &mut LocatedBody,
        forced: &mut ForcedFaces,
        scratch: &mut LocateScratch,
    ) {
        let grain = &self.input.grains[index];
        locate_and_weigh(
            self.locator,
            &self.params,
            index,
            grain,
            body,
            forced,
            scratch,
        );
    }

    fn assemble(
        &self,
        index: usize,
        predictions: &[Prediction<R>; 3],
        forced: &mut ForcedFaces,
    ) -> RigidBodySystem {
        let (previous, density) = (&self.input.previous[index], self.fluid_density);
        let impulse = sum_impulse(
            &self.known,
            predictions,
            density,
            forced,
            previous.velocity,
            self.closure_dt,
        );
        let (grain, applied) = (&self.input.grains[index], self.input.applied[index]);
        RigidBodySystem::new(grain, previous, impulse, density, applied, self.input.dt)
    }
}

/// Locates a grain and weighs the faces that it forces.
pub fn locate_and_weigh(
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
    forced.weigh(params, &mut scratch.band, neighbours, locator.shapes());
}
