//! Coupling of flow and grains: the grid takes the rigid velocities, the grains take their loads
//! (Eq. 5).
//!
//! `ImmersedGrains::couple` and `ImmersedGrains::impose_rigidity` in `schedule.rs` do in a step for
//! each grain:
//!
//! 1. `advection.rs` corrects the prediction u* next to the last pose of the grain.
//! 2. `geometry/mod.rs` finds the neighbours of the grain and the box of cells around its new pose.
//!    `geometry/distances.rs` lists the faces in this box with their signed distances d, which
//!    `narrow_band.rs` and `samples.rs` interpolate; `lists.rs` defines the lists.
//! 3. `forcing.rs` computes the weights of the forced faces: the drag, and the weight P of the
//!    pressure gradient; `shared_faces.rs` those next to several grains.
//! 4. `rigidity.rs` sums the impulse J on the fluid as an affine function of the six new
//!    velocities of the grain. The impulse on the grain is -J.
//! 5. `rigid_body.rs` solves for these velocities, contact load included.
//! 6. `rigidity.rs` imposes the velocities on the forced faces.
//!
//! An isolated grain passes from 1 to 6 at once. Grains that touch or are close to others are
//! processed in passes: 1 for all of them, then 2 to 4, then 5 and 6. If a contact or a lubrication
//! film loads a grain, the caller (`sim/stages.rs`) repeats the contact sub-steps between 4 and 5,
//! with `CoupledGrains::responses`.
//!
//! `links.rs` has the links of item 1, `update.rs` the work on one grain. `open_sides.rs` and
//! `emerged.rs` treat grains that leave the box or float in a free surface, `initial.rs` sets the
//! flow at t = 0. Every kernel has a plain scalar form in `reference/`, against which it is tested.

mod access_log;
mod advection;
mod emerged;
mod forcing;
mod geometry;
mod initial;
mod links;
mod memory;
mod open_sides;
#[cfg(test)]
mod reference;
mod rigid_body;
mod rigidity;
mod schedule;
mod shared_faces;
#[cfg(test)]
mod tests;
mod update;

pub use geometry::narrow_band_bytes;
pub use initial::Start;
pub(crate) use open_sides::{Crossing, OpenSides, departing_load};
pub(crate) use rigid_body::PreviousStep;
pub(crate) use schedule::{CoupledGrains, RigidityInput};
pub(crate) use update::CouplingInput;

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::dem::Grain;
use crate::flow::Flow;
use crate::math::Real;
use access_log::AccessLog;
use forcing::ForcedFaces;
use geometry::Locator;
use update::{GrainUpdate, ImmersedGrain, ScratchPool, ThreadScratch, locate_and_compute_weights};

/// Scheme by which the coupling imposes rigidity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Smoothed ghost-Dirichlet drag with aperture-corrected advection (the default).
    #[default]
    Aperture,
    /// Scheme of the paper: solve without the grain, blend by solid fraction, project again.
    Paper,
}

/// The grains of a simulation on the grid of its flow.
pub struct ImmersedGrains<R> {
    scheme: Scheme,
    fluid_density: f64,
    locator: Locator,
    grains: Vec<ImmersedGrain>,
    scratch: ScratchPool<ThreadScratch<R>>,
    /// Allocation of the updates, kept from one step to the next.
    updates: Vec<GrainUpdate>,
    /// Accesses to the prediction in this step.
    access: AccessLog,
    /// Spacing of the grid [m].
    spacing: DVec3,
    kinematic_viscosity: f64,
}

impl<R: Real> ImmersedGrains<R> {
    /// Locates `grains` on the grid of `flow`.
    pub fn new(
        flow: &Flow<R>,
        scheme: Scheme,
        fluid_density: f64,
        kinematic_viscosity: f64,
        grains: &[Grain],
    ) -> ImmersedGrains<R> {
        let mut immersed = ImmersedGrains {
            scheme,
            fluid_density,
            locator: Locator::new(flow.mesh(), flow.boundaries(), grains),
            grains: grains.iter().map(|_| ImmersedGrain::default()).collect(),
            scratch: ScratchPool::new(),
            updates: Vec::with_capacity(grains.len()),
            access: AccessLog::default(),
            spacing: flow.mesh().spacing,
            kinematic_viscosity,
        };
        immersed.locate(grains);
        immersed
    }

    /// Moves the grains to the grid of `flow`, with the same spacing as the last one, and lists the
    /// faces near them at their present poses.
    pub fn move_to_grid(&mut self, flow: &Flow<R>, grains: &[Grain]) {
        self.locator.set_grid(flow.mesh(), flow.boundaries());
        self.locate(grains);
    }

    /// Lists the faces near the grains at their present poses.
    pub fn locate(&mut self, grains: &[Grain]) {
        self.locator.find_neighbours(grains, |_| 0.0);
        // The weights of the forced faces, which depend on the length of the step, are not used.
        let params = self.forcing_params(1.0);
        let (locator, scratch) = (&self.locator, &self.scratch);
        let each = self.grains.par_iter_mut().enumerate();
        each.for_each(|(index, ImmersedGrain { body, forced, located_for, .. })| {
            *located_for = None;
            let (grain, scratch) = (&grains[index], &mut scratch.borrow().locate);
            locate_and_compute_weights(locator, &params, index, grain, body, forced, scratch);
        });
        self.release_forcing();
    }

    /// Releases the lists of forced faces, which isolated grains do not need.
    fn release_forcing(&mut self) {
        for grain in &mut self.grains {
            grain.forced = ForcedFaces::default();
        }
    }
}
