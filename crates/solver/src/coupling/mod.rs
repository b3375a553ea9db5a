//! Where the flow meets the grains: rigidity imposed on the grid, loads on the grains (Eq. 5).

mod advection;
mod aperture;
mod forced;
mod hold;
mod locate;
mod measure;
mod near;
mod newton;
mod places;
mod rigidity;
mod rivals;
mod samples;

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::dem::{Grain, Response};
use crate::flow::{Flow, FlowMeasures};
use crate::math::{Load, Real};

use advection::Push;
use locate::{Body, Locator};
use measure::Scratch;
use newton::Motion;
use rigidity::Impulse;

/// How rigidity is imposed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Smoothed ghost-Dirichlet drag with aperture-corrected advection (the default).
    #[default]
    Aperture,
    /// The paper's own: solve without the grain, blend by solid fraction, project again.
    Paper,
}

/// How a grain moved at the start of a step: velocity and angular velocity.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Past {
    /// [m/s] and [rad/s], space frame.
    pub velocity: [DVec3; 2],
    /// Their change over the step before, divided by its length [1/s].
    pub acceleration: [DVec3; 2],
    /// What of them came of contact in the step before, and goes to the fluid around the grain in this.
    pub owed: [DVec3; 2],
}

/// The grains on the grid.
pub(crate) struct Coupling {
    scheme: Scheme,
    fluid_density: f64,
    locator: Locator,
    bodies: Vec<Body>,
    pushes: Vec<Push>,
    /// Of each grain in the present step.
    coupled: Vec<(Impulse, Motion)>,
}

impl Coupling {
    /// For the grains of a simulation on the grid of `flow`.
    pub fn new<R: Real>(
        flow: &Flow<R>,
        scheme: Scheme,
        fluid_density: f64,
        kinematic_viscosity: f64,
        grains: &[Grain],
    ) -> Coupling {
        let (mesh, boundaries) = (flow.mesh(), flow.boundaries());
        let locator = Locator::new(mesh, boundaries, scheme, kinematic_viscosity, grains);
        let mut coupling = Coupling {
            scheme,
            fluid_density,
            locator,
            bodies: vec![Body::default(); grains.len()],
            pushes: vec![Push::default(); grains.len()],
            coupled: Vec::new(),
        };
        coupling.locate(grains, 1.0);
        coupling
    }

    /// Finds the faces near the grains at their present poses, for a step of length `dt` [s].
    pub fn locate(&mut self, grains: &[Grain], dt: f64) {
        self.locator.find_neighbours(grains);
        let locator = &self.locator;
        let each = self.bodies.par_iter_mut().enumerate();
        each.for_each_init(Scratch::default, |scratch, (index, body)| {
            locator.locate(grains, index, dt, body, scratch);
        });
    }

    /// Corrects the advection just predicted where grains close part of a link.
    pub fn correct_advection<R: Real>(&mut self, flow: &mut Flow<R>, grains: &[Grain]) {
        if self.scheme == Scheme::Aperture {
            let band = self.locator.band();
            advection::correct(band, flow, grains, &self.bodies, &mut self.pushes);
        }
    }

    /// Time over which the closed part of a face takes the acceleration of the grains.
    fn relief(&self, dt: f64) -> f64 {
        if self.scheme == Scheme::Aperture {
            dt
        } else {
            0.0
        }
    }

    /// Finds the faces near the grains at their present poses, and what the fluid will take from the grains as
    /// they go on from `before` under the `other` loads (weight less buoyancy), as equations for their new
    /// velocities. One grain after the other, while its lists are near.
    pub fn couple<R: Real>(
        &mut self,
        flow: &Flow<R>,
        grains: &[Grain],
        before: &[Past],
        other: &[Load],
        dt: f64,
    ) {
        self.locator.find_neighbours(grains);
        let (locator, relief, density) = (&self.locator, self.relief(dt), self.fluid_density);
        let each = self.bodies.par_iter_mut().zip(grains).enumerate();
        let coupled = each.map_init(Scratch::default, |scratch, (index, (body, grain))| {
            locator.locate(grains, index, dt, body, scratch);
            let past = &before[index];
            let impulse = rigidity::gather(flow, density, body, past, relief);
            let motion = Motion::new(grain, past, &impulse, density, other[index], dt);
            (impulse, motion)
        });
        coupled.collect_into_vec(&mut self.coupled);
    }

    /// How the grains answer contact in this step, after [`Coupling::couple`].
    pub fn responses(
        &self,
        grains: &[Grain],
        before: &[Past],
        added_density: f64,
        dt: f64,
    ) -> Vec<Response> {
        let each = self.coupled.iter().zip(grains).zip(before);
        each.map(|(((_, motion), grain), past)| motion.response(grain, past, added_density, dt))
            .collect()
    }

    /// Gives the grains their new velocities, under the mean `contact` loads too, and imposes rigidity on
    /// the predicted velocity; after [`Coupling::couple`]. `loads` receives the hydrodynamic load on each
    /// grain.
    pub fn impose_rigidity<R: Real>(
        &mut self,
        flow: &mut Flow<R>,
        grains: &mut [Grain],
        before: &[Past],
        contact: &[Load],
        dt: f64,
        loads: &mut [Load],
    ) {
        let density = self.fluid_density;
        let each = self.coupled.par_iter().zip(&mut *grains).zip(loads);
        each.enumerate()
            .for_each(|(index, (((impulse, motion), grain), load))| {
                let (past, contact) = (&before[index], contact[index]);
                *load = newton::advance(grain, past, impulse, motion, density, contact, dt);
            });
        rigidity::impose(flow, grains, &self.bodies, before, self.relief(dt));
    }

    /// Gives the fluid inside and next to the grains their rigid velocity, for initial states.
    pub fn start<R: Real>(&mut self, flow: &mut Flow<R>, grains: &[Grain]) -> FlowMeasures {
        for axis in 0..3 {
            let (from, to) = (
                flow.velocity.component(axis),
                flow.predicted.component_mut(axis),
            );
            to.copy_from_slice(from);
        }
        // A step this long closes every face of the band.
        self.locate(grains, f64::MAX.sqrt());
        let still = vec![Past::default(); grains.len()];
        for (body, still) in self.bodies.iter_mut().zip(&still) {
            rigidity::gather(flow, self.fluid_density, body, still, 0.0);
        }
        rigidity::impose(flow, grains, &self.bodies, &still, 0.0);
        for axis in 0..3 {
            let (from, to) = (
                flow.predicted.component(axis),
                flow.velocity.component_mut(axis),
            );
            to.copy_from_slice(from);
        }
        flow.make_solenoidal()
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        let coupled = size_of::<(Impulse, Motion)>() * self.coupled.capacity();
        let pushes = self.pushes.iter().flatten().map(Vec::capacity);
        self.bodies.iter().map(Body::bytes).sum::<usize>()
            + size_of::<f64>() * pushes.sum::<usize>()
            + self.locator.bytes()
            + coupled
    }
}
