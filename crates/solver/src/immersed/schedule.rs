//! Order in which the grains of a step are processed, and on which threads.
//!
//! A grain is isolated if no other grain uses faces near its last or its present pose and no
//! contact load acts on it. An isolated grain is updated at once from advection to rigidity, while
//! its faces are in the cache. The others are processed in passes over all of them, for two
//! reasons:
//!
//! - the advection next to a grain must be corrected before the impulse of its neighbour is summed;
//! - contact must be resolved before rigidity is imposed.
//!
//! Both orders give bitwise identical results
//! (`docs/decisions/0016-isolated-grains-in-one-traversal.md`).

use glam::DVec3;
use rayon::prelude::*;

use super::advection::{add_correction, find_correction};
use super::forcing::ForcingParams;
use super::rigid_body::PreviousStep;
use super::rigidity::add_rigid_gain;
use super::update::{
    CouplingContext, CouplingInput, GrainUpdate, ImmersedGrain, PendingRigidity,
    locate_and_compute_weights,
};
use super::{ImmersedGrains, Scheme};
use crate::dem::{Grain, GrainResponse};
use crate::flow::Flow;
use crate::grid::{ROWS_RECORDED, borrowed_rows};
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
        contact: &[Load],
        added_density: f64,
        dt: f64,
        responses: &mut Vec<GrainResponse>,
    ) {
        responses.clear();
        let each = self.updates.iter().zip(grains).zip(previous).zip(contact);
        let each = each.map(|(((update, grain), previous), contact)| {
            let leaves_contact = previous.has_pending_velocity() && contact.is_zero();
            // No added mass takes up the impact of a grain that moves under a given load.
            let is_alone = leaves_contact || update.system.last_load.is_some();
            let added_density = if is_alone { 0.0 } else { added_density };
            (update.system).response(grain, previous, added_density, dt)
        });
        responses.extend(each);
    }

    /// Returns for each grain whether it was updated as an isolated one.
    #[cfg(test)]
    pub fn isolated(&self) -> Vec<bool> {
        self.updates.iter().map(|update| update.isolated).collect()
    }
}

/// Input and output of [`ImmersedGrains::impose_rigidity`], one entry per grain.
pub struct RigidityInput<'a> {
    /// Grains, which get their new velocities.
    pub grains: &'a mut [Grain],
    /// State carried over from the previous step.
    pub previous: &'a [PreviousStep],
    /// Mean contact loads over the step.
    pub contact: &'a [Load],
    /// Length of the step [s].
    pub dt: f64,
    /// Receives the hydrodynamic loads (Eq. 5).
    pub loads: &'a mut [Load],
    /// Receives the impulses on the fluid [N s]; empty if they are not needed.
    pub fluid_impulses: &'a mut [DVec3],
}

impl<R: Real> ImmersedGrains<R> {
    /// Parameters of the forcing in a step of `dt` [s].
    pub(super) fn forcing_params(&self, dt: f64) -> ForcingParams {
        let (eps, nu) = (self.locator.eps, self.kinematic_viscosity);
        ForcingParams::new(self.scheme, eps, self.spacing, nu, dt)
    }

    /// Corrects the advection next to the last poses of the grains, locates the grains at their
    /// present poses, and assembles their equations of motion. Imposes rigidity on isolated grains.
    pub fn couple(&mut self, flow: &mut Flow<R>, input: CouplingInput) -> CoupledGrains {
        let mut updates = std::mem::take(&mut self.updates);
        self.find_isolated(&input, &mut updates);
        self.couple_marked(flow, input, updates)
    }

    /// Couples grains whose isolated ones are marked in `updates`. With [`ROWS_RECORDED`], panics
    /// if a face that one grain writes is used by another while both are coupled.
    pub(super) fn couple_marked(
        &mut self,
        flow: &mut Flow<R>,
        input: CouplingInput,
        mut updates: Vec<GrainUpdate>,
    ) -> CoupledGrains {
        if self.scheme == Scheme::Aperture && updates.iter().any(|update| !update.isolated) {
            self.correct_advection(flow, &input, &updates);
        }
        let (known, predictions) = flow.prediction();
        let step = CouplingContext {
            locator: &self.locator,
            params: self.forcing_params(input.dt),
            input,
            known,
            fluid_density: self.fluid_density,
            kinematic_viscosity: self.kinematic_viscosity,
        };
        let (scratch, access) = (&self.scratch, &self.access);
        let each = self.grains.par_iter_mut().zip(&mut updates).enumerate();
        each.for_each(|(index, (grain, update))| {
            let scratch = &mut *scratch.borrow();
            let rows = borrowed_rows(|| {
                if update.isolated {
                    // SAFETY: `find_isolated` found no other grain that uses the faces which this
                    // grain reads or writes. The access log asserts it below in tests.
                    // `SharedRows` checks the bounds of every row.
                    let mut aliases = predictions.each_ref().map(|one| unsafe { one.alias() });
                    step.update_isolated(index, grain, update, &mut aliases, scratch);
                } else {
                    let locate = &mut scratch.locate;
                    step.locate_and_assemble(index, grain, update, &predictions, locate);
                }
            });
            access.record(index, rows);
        });
        if ROWS_RECORDED {
            self.access.assert_no_conflict();
        }
        CoupledGrains { updates }
    }

    /// Finds the neighbours of all grains, resets the updates and marks the isolated grains.
    pub(super) fn find_isolated(&mut self, input: &CouplingInput, updates: &mut Vec<GrainUpdate>) {
        let (immersed, grains) = (&self.grains, input.grains);
        let reach = self.locator.reach;
        let displacement = |i: usize| grains[i].pose.position.distance(immersed[i].body.position);
        // A caller may have wrapped a grain into the box: its last faces are elsewhere.
        let stayed = |index: usize| displacement(index) <= reach;
        // The margin covers the rounding of distances, which are in single precision.
        let margin = 0.01 * reach;
        self.locator.find_neighbours(grains, |index| {
            margin + if stayed(index) { displacement(index) } else { 0.0 }
        });
        let locator = &self.locator;
        updates.clear();
        updates.extend((0..grains.len()).map(|index| GrainUpdate {
            isolated: stayed(index)
                && input.contact[index].is_zero()
                && locator.neighbours(index).is_empty(),
            ..Default::default()
        }));
    }

    /// Corrects the advection next to grains that are not isolated.
    fn correct_advection(
        &mut self,
        flow: &mut Flow<R>,
        input: &CouplingInput,
        updates: &[GrainUpdate],
    ) {
        let (known, _) = flow.prediction();
        let (eps, nu) = (self.locator.eps, self.kinematic_viscosity);
        let scratch = &self.scratch;
        let each = self.grains.par_iter_mut().zip(updates).enumerate();
        let each = each.filter(|(_, (_, update))| !update.isolated);
        each.for_each(|(index, (grain, _))| {
            let (kinematics, scratch) = (&input.kinematics[index], &mut *scratch.borrow());
            if input.grains[index].has_left() {
                *grain = ImmersedGrain::default();
                return;
            }
            let (body, correction) = (&grain.body, &mut grain.correction);
            find_correction(eps, nu, &known, kinematics, body, &mut scratch.advection, correction);
        });
        let (layout, grains) = (flow.mesh().layout(), &self.grains);
        flow.for_predictions(|component, mut prediction| {
            for (grain, update) in grains.iter().zip(updates) {
                if !update.isolated && grain.body.overlaps(prediction.range(), layout) {
                    add_correction(&grain.body, &grain.correction, component, &mut prediction);
                }
            }
        });
    }

    /// Gives the grains their new velocities under the mean contact loads, and imposes the
    /// velocities on the faces that have not been forced yet.
    pub fn impose_rigidity(
        &mut self,
        flow: &mut Flow<R>,
        coupled: CoupledGrains,
        step: RigidityInput,
    ) {
        let mut updates = coupled.updates;
        let RigidityInput { dt, .. } = step;
        let density = self.fluid_density;
        let each = (updates.par_iter_mut().zip(&mut *step.grains)).zip(step.loads);
        each.enumerate().for_each(|(index, ((update, grain), load))| {
            let (previous, contact) = (&step.previous[index], step.contact[index]);
            update.set_velocities(grain, previous, contact, dt);
            *load = (update.system).hydrodynamic_load(grain, previous, density, dt);
        });
        let each = step.fluid_impulses.iter_mut().zip(&updates).zip(&*step.grains);
        each.for_each(|((impulse, update), grain)| *impulse = update.system.fluid_impulse(grain));
        // A contact load found in the repeated sub-steps changes the velocity of an isolated grain
        // after its rigidity was imposed: its faces are listed again and take the difference.
        let params = self.forcing_params(dt);
        for (index, update) in updates.iter().enumerate() {
            if update.isolated && update.pending.is_some() {
                let ImmersedGrain { body, forced, .. } = &mut self.grains[index];
                let (locator, grain) = (&self.locator, &step.grains[index]);
                let scratch = &mut self.scratch.borrow().locate;
                locate_and_compute_weights(locator, &params, index, grain, body, forced, scratch);
                forced.rest_gain.clear();
                forced.rest_gain.resize(forced.weight.len(), 0.0);
            }
        }
        self.impose_pending(flow, &updates);
        self.updates = updates;
    }

    /// Imposes the pending rigid velocities, by slabs of the grid.
    pub(super) fn impose_pending(&self, flow: &mut Flow<R>, updates: &[GrainUpdate]) {
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
                    let (h, forced) = (mesh.spacing, &grain.forced);
                    add_rigid_gain(axis, h, forced, velocity, change, &mut prediction);
                }
            }
        });
    }
}
