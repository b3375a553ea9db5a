//! Order in which the grains of a step are processed, and by how many threads.
//!
//! A grain is isolated if no other grain uses faces near it, where it was or where it is, and nothing
//! touches it. Isolated grains are updated one at a time from advection to rigidity, while their
//! faces are in the cache. The others are processed in passes over all of them: the advection next
//! to one must be corrected before the impulse of its neighbour is summed, and contact is resolved
//! before rigidity is imposed. Both orders give the same bits (decision 0016).

use rayon::prelude::*;

use super::advection::{add_correction, find_correction, prefetch_velocity};
use super::forcing::impose_rigidity;
use super::grains::ImmersedGrains;
use super::kinematics::PreviousStep;
use super::scheme::Scheme;
use super::scratch::ScratchPool;
use super::update::{
    GrainUpdate, ImmersedGrain, IsolatedUpdate, PendingRigidity, StepInput, locate_and_weigh,
};
use crate::dem::{Grain, Response};
use crate::flow::Flow;
use crate::math::{Load, Real};

/// Grains located and coupled to the prediction: made by [`ImmersedGrains::couple`], consumed by
/// [`ImmersedGrains::impose_rigidity`].
pub struct CoupledGrains {
    updates: Vec<GrainUpdate>,
}

impl CoupledGrains {
    /// Fills `responses` with the responses of the grains to contact in this step.
    pub fn responses(
        &self,
        grains: &[Grain],
        previous: &[PreviousStep],
        added_density: f64,
        dt: f64,
        responses: &mut Vec<Response>,
    ) {
        responses.clear();
        let each = self.updates.iter().zip(grains).zip(previous);
        let each = each.map(|((update, grain), previous)| {
            (update.system).response(grain, previous, added_density, dt)
        });
        responses.extend(each);
    }

    /// Whether each grain was updated as an isolated one.
    #[cfg(test)]
    pub fn isolated(&self) -> Vec<bool> {
        self.updates.iter().map(|update| update.isolated).collect()
    }
}

/// Grains whose new velocities a step determines, one entry per grain.
pub struct RigidStep<'a> {
    pub grains: &'a mut [Grain],
    pub previous: &'a [PreviousStep],
    /// Mean contact loads over the step.
    pub contact: &'a [Load],
    /// Length of the step [s].
    pub dt: f64,
    /// Receives the hydrodynamic loads (Eq. 5).
    pub loads: &'a mut [Load],
}

impl<R: Real> ImmersedGrains<R> {
    /// Corrects the advection next to the grains where they were, locates them where they are, and
    /// assembles their equations of motion with the impulse of the fluid. Imposes rigidity on
    /// isolated grains at once.
    pub fn couple(&mut self, flow: &mut Flow<R>, input: StepInput) -> CoupledGrains {
        let mut updates = std::mem::take(&mut self.updates);
        self.find_isolated(&input, &mut updates);
        let corrects_advection = self.scheme == Scheme::Aperture;
        if corrects_advection && updates.iter().any(|update| !update.isolated) {
            self.correct_advection(flow, &input, &mut updates);
        }
        let (known, predictions) = flow.prediction();
        let step = IsolatedUpdate {
            locator: &self.locator,
            params: self.forcing_params(input.dt),
            input,
            known,
            predictions,
            corrects_advection,
            fluid_density: self.fluid_density,
            closure_dt: self.closure_dt(input.dt),
            claims: &self.claims,
        };
        let (grains, scratch) = (&mut self.grains, &self.scratch);
        for_each_grain(grains, &mut updates, scratch, |item, scratch| {
            let GrainItem {
                index,
                grain,
                update,
                next,
            } = item;
            if let Some((next, _)) = next.filter(|(_, update)| update.isolated) {
                step.prefetch(next);
            }
            if update.isolated {
                // SAFETY: `find_isolated` found no other grain that uses its faces.
                unsafe { step.run(index, grain, update, scratch) };
            } else {
                step.locate_and_assemble(index, grain, update, &mut scratch.locate);
            }
        });
        self.claims.assert_disjoint();
        CoupledGrains { updates }
    }

    /// Resets the updates and marks the isolated grains.
    fn find_isolated(&mut self, input: &StepInput, updates: &mut Vec<GrainUpdate>) {
        let (immersed, grains) = (&self.grains, input.grains);
        let reach = self.locator.reach();
        let travel = |index: usize| {
            let last = immersed[index].body.position;
            grains[index].pose.position.distance(last)
        };
        // A grain that crossed a periodic edge was located elsewhere.
        let stayed = |index: usize| travel(index) <= reach;
        // The margin covers rounding: rows end where single-precision distances do.
        let margin = 0.01 * reach;
        self.locator.find_neighbours(grains, |index| {
            margin + if stayed(index) { travel(index) } else { 0.0 }
        });
        let locator = &self.locator;
        updates.clear();
        updates.extend((0..grains.len()).map(|index| GrainUpdate {
            isolated: stayed(index)
                && input.contact[index] == Load::default()
                && locator.neighbours(index).is_empty(),
            ..Default::default()
        }));
    }

    /// Corrects the advection next to grains that are not isolated.
    fn correct_advection(
        &mut self,
        flow: &mut Flow<R>,
        input: &StepInput,
        updates: &mut [GrainUpdate],
    ) {
        let (known, _) = flow.prediction();
        let eps = self.locator.eps();
        let (grains, scratch) = (&mut self.grains, &self.scratch);
        for_each_grain(grains, updates, scratch, |item, scratch| {
            if let Some((next, _)) = item.next.filter(|(_, update)| !update.isolated) {
                prefetch_velocity(&known, &next.body);
            }
            if !item.update.isolated {
                let ImmersedGrain {
                    body, correction, ..
                } = item.grain;
                let kinematics = &input.kinematics[item.index];
                let scratch = &mut scratch.advection;
                find_correction(eps, &known, kinematics, body, scratch, correction);
            }
        });
        let (layout, grains) = (flow.mesh().layout(), &self.grains);
        flow.for_predictions(|component, mut prediction| {
            for (grain, update) in grains.iter().zip(&*updates) {
                if !update.isolated && grain.body.overlaps(prediction.range(), layout) {
                    add_correction(&grain.body, &grain.correction, component, &mut prediction);
                }
            }
        });
    }

    /// Gives the grains their new velocities under the mean contact loads, and imposes them on the
    /// faces that have not been forced yet.
    pub fn impose_rigidity(&mut self, flow: &mut Flow<R>, coupled: CoupledGrains, step: RigidStep) {
        let mut updates = coupled.updates;
        let RigidStep { dt, .. } = step;
        let density = self.fluid_density;
        let each = updates
            .par_iter_mut()
            .zip(&mut *step.grains)
            .zip(step.loads);
        each.enumerate()
            .for_each(|(index, ((update, grain), load))| {
                let (previous, contact) = (&step.previous[index], step.contact[index]);
                update.set_velocities(grain, previous, contact, dt);
                *load = update
                    .system
                    .hydrodynamic_load(grain, previous, density, dt);
            });
        // Contact reached isolated grains after all: they are located again for the remaining change.
        let params = self.forcing_params(dt);
        for (index, update) in updates.iter().enumerate() {
            if update.isolated && update.pending.is_some() {
                let ImmersedGrain { body, forced, .. } = &mut self.grains[index];
                let (grain, scratch) = (&step.grains[index], &mut self.scratch.borrow().locate);
                locate_and_weigh(&self.locator, &params, index, grain, body, forced, scratch);
                forced.rest_gain.clear();
                forced.rest_gain.resize(forced.weight.len(), 0.0);
            }
        }
        self.impose_pending(flow, &updates, self.closure_dt(dt));
        self.updates = updates;
    }

    /// Imposes the pending rigid velocities, by slabs of the grid.
    pub(super) fn impose_pending(
        &self,
        flow: &mut Flow<R>,
        updates: &[GrainUpdate],
        closure_dt: f64,
    ) {
        if updates.iter().all(|update| update.pending.is_none()) {
            return;
        }
        let (mesh, grains) = (*flow.mesh(), &self.grains);
        flow.for_predictions(|axis, mut prediction| {
            for (grain, update) in grains.iter().zip(updates) {
                let Some(PendingRigidity { velocity, change }) = update.pending else {
                    continue;
                };
                if grain.body.overlaps(prediction.range(), mesh.layout()) {
                    impose_rigidity(
                        axis,
                        mesh.spacing,
                        &grain.forced,
                        velocity,
                        change,
                        closure_dt,
                        &mut prediction,
                    );
                }
            }
        });
    }
}

impl GrainUpdate {
    /// Gives the grain its new velocities; those that its faces lack become pending.
    fn set_velocities(
        &mut self,
        grain: &mut Grain,
        previous: &PreviousStep,
        contact: Load,
        dt: f64,
    ) {
        let untouched = contact == Load::default();
        let now = match self.imposed {
            Some(imposed) if untouched => imposed,
            _ => self.system.velocities(grain, previous, contact, dt),
        };
        grain.velocity = now.linear;
        grain.angular_velocity = now.angular;
        self.pending = match self.imposed {
            None => Some(PendingRigidity {
                velocity: now,
                change: now - previous.velocity,
            }),
            Some(_) if untouched => None,
            Some(imposed) => Some(PendingRigidity {
                velocity: now - imposed,
                change: now - imposed,
            }),
        };
    }
}

/// A grain in a parallel loop.
struct GrainItem<'a> {
    index: usize,
    grain: &'a mut ImmersedGrain,
    update: &'a mut GrainUpdate,
    /// Grain that the same thread processes next.
    next: Option<(&'a ImmersedGrain, &'a GrainUpdate)>,
}

/// Calls `work` for all grains in parallel, with the buffers of the thread.
fn for_each_grain<S: Default + Send>(
    grains: &mut [ImmersedGrain],
    updates: &mut [GrainUpdate],
    scratch: &ScratchPool<S>,
    work: impl Fn(GrainItem, &mut S) + Sync,
) {
    // Several chunks per thread balance the load.
    let chunk = (grains.len() / (8 * rayon::current_num_threads())).clamp(1, 16);
    let chunks = grains
        .par_chunks_mut(chunk)
        .zip(updates.par_chunks_mut(chunk));
    chunks.enumerate().for_each(|(number, (grains, updates))| {
        let mut scratch = scratch.borrow();
        for n in 0..grains.len() {
            let (grain, next_grains) = grains[n..].split_first_mut().expect("n is an index");
            let (update, next_updates) = updates[n..].split_first_mut().expect("one per grain");
            let item = GrainItem {
                index: number * chunk + n,
                grain,
                update,
                next: next_grains.first().zip(next_updates.first()),
            };
            work(item, &mut scratch);
        }
    });
}
