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
mod site;

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::dem::{Grain, Response};
use crate::flow::{Flow, FlowMeasures};
use crate::math::{Load, Real};

use locate::Locator;
use site::{Nearby, Site, Visit, in_turn};

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
    sites: Vec<Site>,
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
            sites: grains.iter().map(|_| Site::default()).collect(),
        };
        coupling.locate(grains, 1.0);
        coupling
    }

    /// Finds the faces near the grains at their present poses, for a step of length `dt` [s].
    pub fn locate(&mut self, grains: &[Grain], dt: f64) {
        self.find(grains, dt);
        self.let_go();
    }

    /// The same with the faces that they force.
    fn find(&mut self, grains: &[Grain], dt: f64) {
        self.locator.find_neighbours(grains, |_| 0.0);
        let locator = &self.locator;
        let each = self.sites.par_iter_mut().enumerate();
        each.for_each_init(Default::default, |scratch, (index, site)| {
            locator.locate(grains, index, dt, site.found(), scratch, |_, _| {});
        });
    }

    /// Gives up the lists of forced faces, which grains that stand alone never need again.
    fn let_go(&mut self) {
        for site in &mut self.sites {
            site.forced = Default::default();
        }
    }

    /// Keeps how the grains stand and move as the flow is predicted, for [`Coupling::couple`].
    pub fn remember(&mut self, grains: &[Grain]) {
        for (site, grain) in self.sites.iter_mut().zip(grains) {
            site.remember(grain);
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

    /// Corrects the advection of the prediction next to the grains where they were; finds the faces near
    /// them at their present poses, and what the fluid will take from them as they go on from `before` under
    /// the loads `other` (weight less buoyancy), as equations for their new velocities. Whatever had a `contact`
    /// load in this step, or others near, waits for [`Coupling::impose_rigidity`]; the others are done at once,
    /// one after the other, while what is known of them is near the processor.
    pub fn couple<R: Real>(
        &mut self,
        flow: &mut Flow<R>,
        grains: &[Grain],
        before: &[Past],
        contact: &[Load],
        other: &[Load],
        dt: f64,
    ) {
        self.find_alone(grains, contact);
        self.correct_advection(flow);
        let (known, predictions) = flow.prediction();
        let visit = Visit {
            locator: &self.locator,
            grains,
            known,
            predictions,
            corrects: self.scheme == Scheme::Aperture,
            fluid_density: self.fluid_density,
            relief: self.relief(dt),
            dt,
        };
        in_turn(&mut self.sites, |index, site, next, nearby| {
            let next = next.filter(|next| next.alone);
            visit.run(index, site, next, nearby, &before[index], other[index]);
        });
    }

    /// Finds the grains that no other one has faces near of, where they are and where they were.
    fn find_alone(&mut self, grains: &[Grain], contact: &[Load]) {
        let (sites, reach) = (&self.sites, self.locator.reach());
        let travel = |index: usize| {
            let from: &Site = &sites[index];
            grains[index].pose.position.distance(from.body.position)
        };
        // One that came across a periodic edge is elsewhere altogether.
        let near = |index: usize| travel(index) <= reach;
        // Rows end where singles say; what no two grains may share must not hang on their rounding.
        let spare = 0.01 * reach;
        let about = |index: usize| spare + if near(index) { travel(index) } else { 0.0 };
        self.locator.find_neighbours(grains, about);
        let alone: Vec<bool> = (0..grains.len())
            .map(|i| near(i) && contact[i] == Load::default() && self.locator.is_alone(i))
            .collect();
        for (site, alone) in self.sites.iter_mut().zip(alone) {
            site.alone = alone;
        }
    }

    /// Corrects the advection just predicted where grains that do not stand alone close part of a link.
    fn correct_advection<R: Real>(&mut self, flow: &mut Flow<R>) {
        if self.scheme != Scheme::Aperture || self.sites.iter().all(|site| site.alone) {
            return;
        }
        let (known, _) = flow.prediction();
        let band = self.locator.band();
        in_turn(&mut self.sites, |_, site, next, nearby: &mut Nearby<R>| {
            if !site.alone {
                let Site {
                    stand, body, push, ..
                } = site;
                let ahead = |component, share| {
                    if let Some(next) = next.filter(|next| !next.alone) {
                        advection::ask(&known, &next.body, component, share);
                    }
                };
                let scratch = &mut nearby.advection;
                advection::find(band, &known, stand, body, scratch, push, ahead);
            }
        });
        let (layout, sites) = (flow.mesh().layout(), &self.sites);
        flow.for_predictions(|component, mut prediction| {
            for Site { body, push, .. } in sites.iter().filter(|site| !site.alone) {
                if body.lies_in(prediction.range(), layout) {
                    advection::add(body, push, component, &mut prediction);
                }
            }
        });
    }

    /// How the grains answer contact in this step, after [`Coupling::couple`].
    pub fn responses(
        &self,
        grains: &[Grain],
        before: &[Past],
        added_density: f64,
        dt: f64,
    ) -> Vec<Response> {
        let each = self.sites.iter().zip(grains).zip(before);
        each.map(|((site, grain), past)| site.motion.response(grain, past, added_density, dt))
            .collect()
    }

    /// Gives the grains their new velocities, under the mean `contact` loads too, and imposes rigidity on
    /// the predicted velocity where that is still to be done; after [`Coupling::couple`]. `loads` receives
    /// the hydrodynamic load on each grain.
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
        let each = self.sites.par_iter_mut().zip(&mut *grains).zip(loads);
        each.enumerate().for_each(|(index, ((site, grain), load))| {
            *load = site.advance(grain, &before[index], contact[index], density, dt);
        });
        for (index, site) in self.sites.iter_mut().enumerate() {
            if site.alone && site.due.is_some() {
                // It met something after all: what it has beyond what it was thought to have comes on top.
                let scratch = &mut Default::default();
                (self.locator).locate(grains, index, dt, site.found(), scratch, |_, _| {});
                site.forced.taken.clear();
                site.forced.taken.resize(site.forced.share.len(), 0.0);
            }
        }
        self.impose(flow, self.relief(dt));
    }

    /// Gives the faces what is due to them.
    fn impose<R: Real>(&self, flow: &mut Flow<R>, relief: f64) {
        let (mesh, sites) = (*flow.mesh(), &self.sites);
        if sites.iter().all(|site| site.due.is_none()) {
            return;
        }
        flow.for_predictions(|axis, mut prediction| {
            for site in sites {
                let Some(motions) = site.due else {
                    continue;
                };
                if site.body.lies_in(prediction.range(), mesh.layout()) {
                    let forced = &site.forced;
                    rigidity::impose(axis, mesh.spacing, forced, motions, relief, &mut prediction);
                }
            }
        });
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
        self.find(grains, f64::MAX.sqrt());
        let (known, predictions) = flow.prediction();
        let still = Past::default();
        for (site, grain) in self.sites.iter_mut().zip(grains) {
            let forced = &mut site.forced;
            rigidity::gather(
                &known,
                &predictions,
                self.fluid_density,
                forced,
                &still,
                0.0,
            );
            site.due = Some([still.velocity, [grain.velocity, grain.angular_velocity]]);
        }
        self.impose(flow, 0.0);
        self.let_go();
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
        self.sites.iter().map(Site::bytes).sum::<usize>() + self.locator.bytes()
    }
}
