//! All grains of a simulation on its grid.

use rayon::prelude::*;

use super::access::AccessLog;
use super::forcing::{ForcedFaces, ForcingParams};
use super::geometry::Locator;
use super::scheme::Scheme;
use super::scratch::ScratchPool;
use super::update::{GrainUpdate, ImmersedGrain, ThreadScratch, locate_and_compute_weights};
use crate::dem::Grain;
use crate::flow::Flow;
use crate::grid::Mesh;
use crate::math::Real;

/// The grains of a simulation on the grid of its flow.
pub struct ImmersedGrains<R> {
    pub(super) scheme: Scheme,
    pub(super) fluid_density: f64,
    pub(super) locator: Locator,
    pub(super) grains: Vec<ImmersedGrain>,
    pub(super) scratch: ScratchPool<ThreadScratch<R>>,
    /// Allocation of the updates, kept from one step to the next.
    pub(super) updates: Vec<GrainUpdate>,
    /// Accesses to the prediction in this step.
    pub(super) access: AccessLog,
    mesh: Mesh,
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
            scratch: ScratchPool::default(),
            updates: Vec::with_capacity(grains.len()),
            access: AccessLog::default(),
            mesh: *flow.mesh(),
            kinematic_viscosity,
        };
        immersed.locate(grains);
        immersed
    }

    /// Lists the faces near the grains at their present poses.
    pub fn locate(&mut self, grains: &[Grain]) {
        self.locate_with_forcing(grains, 1.0);
        self.release_forcing();
    }

    /// Lists the faces near the grains and computes the weights of the forced faces for a step of
    /// `dt` [s].
    pub(super) fn locate_with_forcing(&mut self, grains: &[Grain], dt: f64) {
        self.locator.find_neighbours(grains, |_| 0.0);
        let params = self.forcing_params(dt);
        let (locator, scratch) = (&self.locator, &self.scratch);
        let each = self.grains.par_iter_mut().enumerate();
        each.for_each(|(index, ImmersedGrain { body, forced, .. })| {
            let (grain, scratch) = (&grains[index], &mut scratch.borrow().locate);
            locate_and_compute_weights(locator, &params, index, grain, body, forced, scratch);
        });
    }

    /// Releases the lists of forced faces, which isolated grains do not need.
    pub(super) fn release_forcing(&mut self) {
        for grain in &mut self.grains {
            grain.forced = ForcedFaces::default();
        }
    }

    /// Parameters of the forcing in a step of `dt` [s].
    pub(super) fn forcing_params(&self, dt: f64) -> ForcingParams {
        let (eps, spacing) = (self.locator.eps(), self.mesh.spacing);
        ForcingParams::new(self.scheme, eps, spacing, self.kinematic_viscosity, dt)
    }

    /// Memory held without the buffers of threads [bytes].
    pub fn bytes(&self) -> usize {
        self.grains.iter().map(ImmersedGrain::bytes).sum::<usize>() + self.locator.bytes()
    }
}
