//! Work on one grain in a step: the whole update of an isolated grain; location and equations of
//! motion of any other. Buffers of the threads, and in debug builds a log of the faces that they
//! use.

use std::sync::{Mutex, MutexGuard, PoisonError};

use super::Scheme;
use super::advection::{AdvectionCorrection, AdvectionScratch, add_correction, find_correction};
use super::forcing::{ForcedFaces, ForcingParams};
use super::geometry::{LocateScratch, LocatedBody, Locator, NeighbourGrain};
use super::open_sides::Crossing;
use super::rigid_body::{PreviousStep, RigidBodySystem};
use super::rigidity::{add_rigid_gain, sum_impulse};
use super::shared_faces::share_faces;
use crate::dem::{Grain, GrainKinematics};
use crate::flow::{OldState, Prediction};
use crate::grid::BorrowedRow;
use crate::math::{Load, Pose, Real, RigidVelocity};

/// Lists of the faces near one grain, kept from one step to the next.
#[derive(Default)]
pub struct ImmersedGrain {
    /// Faces within reach and their distances.
    pub body: LocatedBody,
    /// Forced faces; unused while the grain is isolated, as it then uses [`ThreadScratch`].
    pub forced: ForcedFaces,
    /// Correction of the advection; unused while the grain is isolated.
    pub correction: AdvectionCorrection,
    /// Pose of the grain and step for which its lists were made; none if they must be made again.
    pub located_for: Option<(Pose, f64)>,
    /// Neighbours for which the lists were made.
    located_beside: Vec<NeighbourGrain>,
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
pub struct CouplingInput<'a> {
    /// Grains at their new poses.
    pub grains: &'a [Grain],
    /// Kinematics when the flow was predicted.
    pub kinematics: &'a [GrainKinematics],
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
            let (kinematics, eps) = (&self.input.kinematics[index], self.locator.eps());
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
            Some(Crossing::Departing(_)) => {
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
    share_faces(params, &scratch.band, locator.neighbours(index), locator.shapes(), forced);
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

/// Rows of the prediction that the grains have borrowed in a step, to assert that no thread writes
/// a face that another one uses; empty in release builds.
#[derive(Default)]
pub struct AccessLog(Mutex<Vec<(usize, BorrowedRow)>>);

impl AccessLog {
    /// Records the rows that a grain has borrowed.
    pub fn record(&self, grain: usize, rows: Vec<BorrowedRow>) {
        if !rows.is_empty() {
            let entries = rows.into_iter().map(|row| (grain, row));
            self.0.lock().expect("no thread panicked").extend(entries);
        }
    }

    /// Panics if one grain writes a face that another one uses; clears the log.
    pub fn assert_no_conflict(&mut self) {
        let entries = self.0.get_mut().expect("no thread panicked");
        entries.sort_unstable_by_key(|(grain, row)| (row.addresses.start, *grain));
        // Earlier rows that contain the start of the present one.
        let mut open: Vec<(usize, BorrowedRow)> = Vec::new();
        for (grain, row) in entries.drain(..) {
            open.retain(|(_, earlier)| earlier.addresses.end > row.addresses.start);
            let conflict = open
                .iter()
                .find(|(other, earlier)| *other != grain && (earlier.mutable || row.mutable));
            if let Some((other, _)) = conflict {
                panic!("grains {other} and {grain} use the same faces at once");
            }
            open.push((grain, row));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::*;

    /// Log of entries: grain, faces, whether they are written.
    fn log(entries: &[(usize, Range<usize>, bool)]) -> AccessLog {
        let log = AccessLog::default();
        for (grain, addresses, mutable) in entries {
            let row = BorrowedRow { addresses: addresses.clone(), mutable: *mutable };
            log.record(*grain, vec![row]);
        }
        log
    }

    #[test]
    fn faces_read_by_several_grains_are_accepted() {
        let (write, read) = (true, false);
        log(&[(0, 10..20, write), (0, 12..18, write), (1, 20..30, read), (2, 25..40, read)])
            .assert_no_conflict();
    }

    #[test]
    #[should_panic(expected = "use the same faces")]
    fn a_face_written_by_one_grain_and_read_by_another_is_refused() {
        log(&[(0, 10..20, true), (1, 0..50, false), (2, 48..60, false)]).assert_no_conflict();
    }

    #[test]
    #[should_panic(expected = "grains 2 and 1 use the same faces")]
    fn a_reader_is_found_behind_a_longer_row_of_the_writer() {
        log(&[(2, 1..10, false), (1, 2..20, false), (1, 5..6, true)]).assert_no_conflict();
    }
}
