//! Work on one grain in a step: the whole update of an isolated grain; location and equations of
//! motion of any other. Buffers of the threads.

use std::sync::{Mutex, MutexGuard, PoisonError};

use super::Scheme;
use super::advection::{AdvectionCorrection, AdvectionScratch, add_correction, find_correction};
use super::forcing::{ForcedFaces, ForcingParams};
use super::geometry::{LocateScratch, LocatedBody, Locator, NeighbourGrain};
use super::open_sides::Crossing;
use super::rigid_body::{PreviousStep, RigidBodySystem};
use super::rigidity::{add_rigid_gain, sum_impulse};
use super::shared_faces::share_faces;
use crate::dem::{Grain, RigidState};
use crate::flow::{OldState, Prediction};
use crate::math::{Load, Pose, Real, RigidVelocity};

/// Lists of the faces near one grain, kept from one step to the next.
#[derive(Default)]
pub struct ImmersedGrain {
    /// Faces within reach and their distances.
    pub body: LocatedBody,
    /// Forced faces; an isolated grain uses those of [`ThreadScratch`], and these only if a contact
    /// load is found in the repeated sub-steps.
    pub forced: ForcedFaces,
    /// Correction of the advection; unused while the grain is isolated.
    pub correction: AdvectionCorrection,
    /// Pose of the grain and step for which its lists were made; none if they must be made again.
    pub located_for: Option<(Pose, f64)>,
    /// Neighbours for which the lists were made.
    pub located_beside: Vec<NeighbourGrain>,
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
pub struct CouplingInput<'a> {
    /// Grains at their new poses.
    pub grains: &'a [Grain],
    /// Poses at the start of the step, and the velocities that the known flow has there.
    pub kinematics: &'a [RigidState],
    /// State carried over from the previous step.
    pub previous: &'a [PreviousStep],
    /// Mean contact loads in the sub-steps so far.
    pub contact: &'a [Load],
    /// Weight less buoyancy, and external loads.
    pub applied: &'a [Load],
    /// Hydrodynamic loads of the last step.
    pub last_loads: &'a [Load],
    /// Crossings of open sides of the box; empty if it has none.
    pub crossings: &'a [Crossing],
    /// Loads of the pressure at free surfaces, per density; empty without open sides.
    pub surface_loads: &'a [Load],
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
pub struct CouplingContext<'a, R> {
    /// Geometry of the grains on the grid.
    pub locator: &'a Locator,
    /// Parameters of the forcing.
    pub params: ForcingParams,
    /// Grains and loads.
    pub input: CouplingInput<'a>,
    /// Fields of the last step.
    pub known: OldState<'a, R>,
    /// Density of the fluid [kg/m^3].
    pub fluid_density: f64,
    /// Kinematic viscosity of the fluid [m^2/s].
    pub kinematic_viscosity: f64,
}

impl<R: Real> CouplingContext<'_, R> {
    /// Updates an isolated grain: corrects the advection at its last pose, locates it, solves for
    /// its velocities and imposes them on `predictions`.
    pub fn update_isolated(
        &self,
        index: usize,
        ImmersedGrain { body, located_for, .. }: &mut ImmersedGrain,
        update: &mut GrainUpdate,
        predictions: &mut [Prediction<R>; 3],
        scratch: &mut ThreadScratch<R>,
    ) {
        let ThreadScratch { advection, locate, correction, forced } = scratch;
        *located_for = None;
        if self.params.scheme == Scheme::Aperture {
            let (kinematics, eps) = (&self.input.kinematics[index], self.locator.eps);
            let (nu, known) = (self.kinematic_viscosity, &self.known);
            find_correction(eps, nu, known, kinematics, body, advection, correction);
            for (component, prediction) in predictions.iter_mut().enumerate() {
                add_correction(body, correction, component, prediction);
            }
        }
        let (grain, previous) = (&self.input.grains[index], &self.input.previous[index]);
        locate_and_compute_weights(self.locator, &self.params, index, grain, body, forced, locate);
        update.system = self.assemble(index, predictions, forced);
        let velocity = update.system.velocities(grain, previous, Load::default(), self.input.dt);
        let change = velocity - previous.velocity;
        let h = self.known.mesh.spacing;
        for (axis, prediction) in predictions.iter_mut().enumerate() {
            add_rigid_gain(axis, h, forced, velocity, change, prediction);
        }
        update.imposed = Some(velocity);
    }

    /// Locates a grain that is not isolated and assembles its equations of motion.
    pub fn locate_and_assemble(
        &self,
        index: usize,
        ImmersedGrain { body, forced, located_for, located_beside, .. }: &mut ImmersedGrain,
        update: &mut GrainUpdate,
        predictions: &[Prediction<R>; 3],
        scratch: &mut LocateScratch,
    ) {
        let (locator, params, grain) = (self.locator, &self.params, &self.input.grains[index]);
        let (now, neighbours) = (Some((grain.pose, self.input.dt)), locator.neighbours(index));
        // The lists of a grain in a bed at rest stay as they are.
        if *located_for != now || *located_beside != neighbours {
            locate_and_compute_weights(locator, params, index, grain, body, forced, scratch);
            *located_for = now;
            neighbours.clone_into(located_beside);
        }
        update.system = self.assemble(index, predictions, forced);
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
        let surface = match self.input.crossings.get(index) {
            Some(Crossing::Departing(..) | Crossing::Airborne(_)) => {
                let loads = [applied, self.input.last_loads[index]];
                return RigidBodySystem::departing(grain, previous, impulse, loads, dt);
            }
            Some(Crossing::Emerged(part)) => {
                Some((&**part, self.input.surface_loads[index] * density))
            }
            _ => None,
        };
        RigidBodySystem::new(grain, previous, impulse, density, applied, surface, dt)
    }
}

/// Locates a grain and computes the weights of the faces that it forces; a grain that has left the
/// box forces none.
pub fn locate_and_compute_weights(
    locator: &Locator,
    params: &ForcingParams,
    index: usize,
    grain: &Grain,
    body: &mut LocatedBody,
    forced: &mut ForcedFaces,
    scratch: &mut LocateScratch,
) {
    if grain.has_left() {
        (*body, *forced) = Default::default();
        return;
    }
    locator.locate(index, grain, body, &mut forced.runs, scratch);
    forced.compute_weights(params, &mut scratch.band);
    share_faces(params, &scratch.band, locator.neighbours(index), &locator.shapes, forced);
}

/// Buffers of the threads, kept from one step to the next.
pub struct ScratchPool<T>(Vec<Mutex<T>>);

impl<T: Default> ScratchPool<T> {
    /// Buffers for the threads of the present pool.
    pub fn new() -> ScratchPool<T> {
        ScratchPool((0..rayon::current_num_threads()).map(|_| Mutex::default()).collect())
    }

    /// Borrows the buffer of this thread. Threads of a larger pool share buffers.
    pub fn borrow(&self) -> MutexGuard<'_, T> {
        let thread = rayon::current_thread_index().unwrap_or(0);
        // A buffer holds nothing from one grain to the next that a panic could damage.
        self.0[thread % self.0.len()].lock().unwrap_or_else(PoisonError::into_inner)
    }
}
