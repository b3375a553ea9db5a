//! Flow on the grid of the whole box, and on a box of half the spacing inside it.
//!
//! Both grids take the same time step. A step predicts both flows, and the grains act on the
//! refined prediction. Then:
//!
//! 1. On the faces inside the refined box its prediction replaces that of the whole box.
//! 2. The projection of the whole box gives the normal velocity on the sides of the refined box.
//! 3. A projection inside the refined box makes its velocity divergence-free.
//! 4. Velocity and pressure of the refined box replace those of the whole box there.
//!
//! Both velocities are divergence-free to rounding, because the sides of the refined box have the
//! same flux on both grids. Momentum is conserved up to the difference of the two grids in the
//! stresses on these sides (`docs/decisions/0027-refined-box.md`).

use super::nesting::{Nesting, RefinedBox};
use super::{Flow, FlowMeasures, FluidParams};
use crate::math::Real;
use crate::poisson::PoissonTimes;
use glam::DVec3;

/// Flow on the whole box, and on a refined box if there is one.
pub struct NestedFlow<R = f64> {
    /// Flow on the whole box.
    pub whole: Flow<R>,
    refined: Option<Refined<R>>,
    params: FluidParams,
    /// Time of the Poisson solvers of past refined boxes.
    past_times: PoissonTimes,
}

/// Flow on a refined box.
struct Refined<R> {
    flow: Flow<R>,
    nesting: Nesting,
}

impl<R: Real> NestedFlow<R> {
    /// Flow without a refined box.
    pub fn new(whole: Flow<R>, params: &FluidParams) -> NestedFlow<R> {
        let params = FluidParams { initial_velocity: DVec3::ZERO, ..*params };
        NestedFlow { whole, refined: None, params, past_times: PoissonTimes::default() }
    }

    /// The refined box, if there is one.
    pub fn refined_box(&self) -> Option<RefinedBox> {
        self.refined.as_ref().map(|refined| refined.nesting.place)
    }

    /// Flow on the finest grid, on which the grains act.
    pub fn finest(&self) -> &Flow<R> {
        self.refined.as_ref().map_or(&self.whole, |refined| &refined.flow)
    }
    /// Mutable [`Self::finest`].
    pub fn finest_mut(&mut self) -> &mut Flow<R> {
        self.refined.as_mut().map_or(&mut self.whole, |refined| &mut refined.flow)
    }

    /// Refines the box `place`. Where the last refined box overlaps it, the values stay. Elsewhere
    /// the velocity has the divergence of the whole grid; tendency and pressure are interpolated.
    pub fn refine(&mut self, place: RefinedBox) {
        let whole = &self.whole;
        let nesting = Nesting::new(&whole.mesh, &whole.boundaries, place);
        let (mesh, boundaries) = (place.mesh(&whole.mesh), nesting.boundaries(&whole.boundaries));
        // A box of the same size keeps its memory and its Poisson solver.
        let (mut reused, mut replaced, mut of_old) = (None, None, None);
        if let Some(Refined { flow, nesting: of_flow }) = self.refined.take() {
            if flow.mesh.cells == mesh.cells && flow.boundaries == boundaries {
                reused = Some(Flow { mesh, ..flow });
            } else {
                self.past_times = self.past_times + flow.poisson_times();
                replaced = Some(flow.state().0.map(<[R]>::to_vec));
            }
            of_old = Some(of_flow);
        }
        let mut flow = reused.unwrap_or_else(|| Flow::new(&mesh, boundaries, &self.params));
        let last_step = whole.previous_step.unwrap_or(0.0);
        let ((from, _), (to, _)) = (whole.state(), flow.state_mut(last_step));
        let mut copy = Vec::new();
        for (field, (from, to)) in from.into_iter().zip(to).enumerate() {
            let (is_velocity, component) = (field < 3, (field < 6).then_some(field % 3));
            let old_values = match &replaced {
                Some(fields) => fields[field].as_slice(),
                None => {
                    copy.clear();
                    copy.extend_from_slice(to);
                    &copy
                }
            };
            let old = of_old.as_ref().map(|of_old| (of_old, old_values));
            nesting.transfer(component, old, (!is_velocity).then_some(from), to);
        }
        let is_new = nesting.new_cells(of_old.as_ref());
        nesting.prolong_velocity(&whole.velocity, &mut flow.velocity, is_new);
        flow.fill_ghosts();
        flow.fill_pressure_ghosts();
        nesting.fill_ghosts(&whole.velocity, &mut flow.velocity);
        self.refined = Some(Refined { flow, nesting });
    }

    /// Sets the uniform acceleration that drives the flow [m/s^2].
    pub fn set_body_acceleration(&mut self, acceleration: DVec3) {
        self.params.body_acceleration = acceleration;
        self.flows_mut().for_each(|flow| flow.set_body_acceleration(acceleration));
    }

    /// Predicts u* over `dt` [s] on both grids.
    pub fn predict(&mut self, dt: f64) {
        self.flows_mut().for_each(|flow| flow.predict(dt));
    }

    /// Makes the velocity divergence-free on both grids.
    pub fn project(&mut self, dt: f64) -> FlowMeasures {
        let Some(Refined { flow, nesting }) = &mut self.refined else {
            return self.whole.project(dt);
        };
        let whole = &mut self.whole;
        for axis in 0..3 {
            let (from, to) = (flow.predicted.component(axis), whole.predicted.component_mut(axis));
            nesting.average_faces(axis, from, to);
        }
        let mut measures = whole.project(dt);
        nesting.set_sides(&whole.velocity, &mut flow.predicted);
        let refined = flow.project(dt);
        for axis in 0..3 {
            let (from, to) = (flow.velocity.component(axis), whole.velocity.component_mut(axis));
            let [momentum, energy] = nesting.average_faces(axis, from, to);
            measures.momentum[axis] += momentum;
            measures.kinetic_energy += energy;
        }
        nesting.average_cells(&mut flow.pressure, &mut whole.pressure);
        whole.fill_ghosts_after(nesting.inside(2));
        nesting.fill_ghosts(&whole.velocity, &mut flow.velocity);
        measures.max_divergence = measures.max_divergence.max(refined.max_divergence);
        measures.max_rate = measures.max_rate.max(refined.max_rate);
        measures.max_velocity = measures.max_velocity.max(refined.max_velocity);
        measures
    }

    /// Projects the velocity onto the divergence-free fields and keeps the pressure; for initial
    /// states.
    pub fn make_solenoidal(&mut self) -> FlowMeasures {
        let pressures = self.flows_mut().map(|flow| flow.pressure.to_vec()).collect::<Vec<_>>();
        for flow in self.flows_mut() {
            flow.predict_present();
        }
        let measures = self.project(1.0);
        for (flow, pressure) in self.flows_mut().zip(pressures) {
            flow.pressure.copy_from_slice(&pressure);
        }
        measures
    }

    /// Fills the ghosts of the velocity on both grids.
    pub fn fill_ghosts(&mut self) {
        self.whole.fill_ghosts();
        if let Some(Refined { flow, nesting }) = &mut self.refined {
            flow.fill_ghosts();
            nesting.fill_ghosts(&self.whole.velocity, &mut flow.velocity);
        }
    }

    /// Time that the Poisson solvers of both grids have spent in each of their stages.
    pub fn poisson_times(&self) -> PoissonTimes {
        self.flows().fold(self.past_times, |sum, flow| sum + flow.poisson_times())
    }

    /// The flow on the whole box, then that on the refined one.
    pub fn flows(&self) -> impl Iterator<Item = &Flow<R>> {
        std::iter::once(&self.whole).chain(self.refined.as_ref().map(|refined| &refined.flow))
    }
    /// Mutable [`Self::flows`].
    pub fn flows_mut(&mut self) -> impl Iterator<Item = &mut Flow<R>> {
        let refined = self.refined.as_mut().map(|refined| &mut refined.flow);
        std::iter::once(&mut self.whole).chain(refined)
    }
}

#[cfg(test)]
mod tests;
