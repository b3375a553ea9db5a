//! Stages of a time step. Each is a value that the next one consumes, so that they can only be
//! called in order.

use glam::DVec3;

use super::fluid::Fluid;
use super::prescription::Prescription;
use super::timing::PassTimes;
use super::{GrainData, Simulation};
use crate::dem::{
    ContactDynamics, Grain, GrainKinematics, MotionConstraint, RigidState, TrialStep,
};
use crate::immersed::{
    CoupledGrains, CouplingInput, Crossing, OpenSides, PreviousStep, RigidityInput, Scheme,
};
use crate::math::{Load, RigidVelocity, timed};

/// Grains of a step, with or without fluid.
struct GrainContext<'a> {
    grains: &'a mut [Grain],
    dynamics: &'a mut ContactDynamics,
    /// Hydrodynamic loads; zero without fluid.
    loads: &'a mut [Load],
    data: &'a mut GrainData,
    prescription: &'a Prescription,
    open_sides: Option<&'a mut OpenSides>,
    times: &'a mut PassTimes,
    /// Time at the start of the step [s].
    time: f64,
    /// Length of the step [s].
    dt: f64,
}

/// Fluid of a step.
struct FluidContext<'a> {
    fluid: &'a mut dyn Fluid,
    scheme: Scheme,
    /// Density [kg/m^3].
    density: f64,
    momentum_residual: &'a mut DVec3,
}

/// State that all stages of a coupled step work on.
struct Context<'a> {
    solid: GrainContext<'a>,
    flow: FluidContext<'a>,
}

/// Step about to begin.
pub(super) enum Start<'a> {
    Coupled(CoupledStart<'a>),
    Dry(DryStart<'a>),
}

/// Coupled step about to begin.
pub(super) struct CoupledStart<'a>(Context<'a>);
/// Step without fluid about to begin.
pub(super) struct DryStart<'a>(GrainContext<'a>);
/// Flow predicted without the grains.
pub(super) struct Predicted<'a>(Context<'a>);
/// Grains at their new poses, by a trial step of contact.
pub(super) struct Moved<'a>(Context<'a>, TrialStep);
/// Grains located, with their equations of motion.
pub(super) struct Coupled<'a>(Context<'a>, CoupledGrains, TrialStep);
/// Contact loads and the poses at the end of the step known.
pub(super) struct Resolved<'a>(Context<'a>, CoupledGrains);
/// Rigid velocities imposed on the prediction.
pub(super) struct Rigid<'a>(Context<'a>);
/// Flow with a divergence-free velocity.
pub(super) struct Projected<'a> {
    context: Context<'a>,
    /// Momentum of the fluid over its density before the projection [m^4/s].
    momentum_before: DVec3,
}

impl<'a> Start<'a> {
    /// Records the state before the step of `dt` [s] and sets weight, buoyancy, external
    /// loads and prescribed motion.
    pub fn prepare(sim: &'a mut Simulation, dt: f64) -> Start<'a> {
        let (setup, time) = (&mut sim.setup, sim.clock.time);
        let mut solid = GrainContext {
            grains: &mut setup.grains,
            dynamics: &mut sim.dynamics,
            loads: &mut sim.loads,
            data: &mut sim.data,
            prescription: &setup.prescription,
            open_sides: sim.open_sides.as_mut(),
            times: &mut sim.times,
            time,
            dt,
        };
        let fluid_density = setup.fluid.map_or(0.0, |params| params.density);
        let data = &mut *solid.data;
        if let Some(open_sides) = &mut solid.open_sides {
            open_sides.update(solid.grains, dt);
            open_sides.extrapolate_accelerations(&mut data.previous);
        }
        for (i, grain) in solid.grains.iter().enumerate() {
            let crossing =
                solid.open_sides.as_ref().map_or(&Crossing::Inside, |o| &o.crossings()[i]);
            data.previous[i].velocity = grain.rigid_velocity();
            data.applied[i] = crossing.weight_less_buoyancy(grain, setup.gravity, fluid_density);
            if let Crossing::Departing(_) = crossing {
                // Departing grains move under their last load: no added mass takes up a velocity.
                data.previous[i].pending_added_mass_velocity = RigidVelocity::default();
            }
            if let Crossing::Left = crossing {
                (data.previous[i], solid.loads[i]) = (PreviousStep::default(), Load::default());
            } else if !data.external[i].is_zero() {
                // A zero load is not added: it would turn -0.0 into 0.0.
                data.applied[i] += data.external[i];
            }
            if setup.fluid.is_some() && setup.contact.global_damping > 0.0 {
                data.applied[i] += damping_load(grain, setup.contact.global_damping, dt);
            }
        }
        // Midpoint rule: the sub-steps take the prescribed velocities at the middle of the step.
        (setup.prescription).prescribe_motion(solid.grains, time + 0.5 * dt);
        let Some(fluid) = sim.fluid.as_deref_mut() else {
            return Start::Dry(DryStart(solid));
        };
        for (kinematics, grain) in data.kinematics.iter_mut().zip(&*solid.grains) {
            *kinematics = GrainKinematics::of(grain);
        }
        if let Some(acceleration) = setup.prescription.body_acceleration(time) {
            fluid.set_body_acceleration(acceleration);
        }
        if let Some(open_sides) = &solid.open_sides {
            fluid.set_crossing_speeds(open_sides.speeds(solid.grains));
        }
        let flow = FluidContext {
            fluid,
            scheme: setup.scheme,
            density: fluid_density,
            momentum_residual: &mut sim.momentum_residual,
        };
        Start::Coupled(CoupledStart(Context { solid, flow }))
    }
}

impl GrainContext<'_> {
    /// Moves the grains by `take_substeps` under weight, buoyancy and the hydrodynamic load of the
    /// last step (Eqs 6 to 36).
    fn move_grains<T>(
        &mut self,
        take_substeps: impl FnOnce(&mut ContactDynamics, &mut [Grain], &[Load], f64, &mut [Load]) -> T,
    ) -> T {
        let data = &mut *self.data;
        for (i, driving) in data.driving.iter_mut().enumerate() {
            *driving = data.applied[i] + self.loads[i];
            if let Some(load) = data.previous[i].uptake_load(&self.grains[i]) {
                *driving += load;
            }
        }
        let taken = timed(&mut self.times.contact, || {
            take_substeps(self.dynamics, self.grains, &data.driving, self.dt, &mut data.contact)
        });
        let end = self.time + self.dt;
        self.prescription.set_velocities(self.grains, end);
        taken
    }
}

impl DryStart<'_> {
    /// Moves the grains in contact sub-steps; nothing else happens without fluid.
    pub fn move_grains(self) {
        let DryStart(mut step) = self;
        step.move_grains(ContactDynamics::advance);
    }
}

impl<'a> CoupledStart<'a> {
    /// Predicts the flow without the grains.
    pub fn predict(self) -> Predicted<'a> {
        let CoupledStart(mut step) = self;
        let Context { solid, flow } = &mut step;
        timed(&mut solid.times.predict, || flow.fluid.predict(solid.dt));
        Predicted(step)
    }
}

impl<'a> Predicted<'a> {
    /// Moves the grains in contact sub-steps under the hydrodynamic load of the last step.
    pub fn move_grains(self) -> Moved<'a> {
        let Predicted(mut step) = self;
        let trial = step.solid.move_grains(ContactDynamics::trial_step);
        Moved(step, trial)
    }
}

impl<'a> Moved<'a> {
    /// Locates the grains and assembles their equations of motion with the impulse of the fluid.
    /// The paper's scheme projects the prediction first.
    pub fn couple(self) -> Coupled<'a> {
        let Moved(mut step, trial) = self;
        let Context { solid, flow } = &mut step;
        let dt = solid.dt;
        if flow.scheme == Scheme::Paper {
            timed(&mut solid.times.project, || flow.fluid.project_prediction(dt));
        }
        let (mut crossings, mut surface_loads) = (&[][..], Vec::new());
        if let Some(open_sides) = &mut solid.open_sides {
            open_sides.list_covered_faces(solid.grains);
            surface_loads = open_sides.surface_loads(|faces| flow.fluid.pressure_below(faces));
            crossings = open_sides.crossings();
        }
        let input = CouplingInput {
            grains: solid.grains,
            kinematics: &solid.data.kinematics,
            previous: &solid.data.previous,
            contact: &solid.data.contact,
            applied: &solid.data.applied,
            last_loads: solid.loads,
            crossings,
            surface_loads: &surface_loads,
            dt,
        };
        let coupled = timed(&mut solid.times.coupling, || flow.fluid.couple(input));
        Coupled(step, coupled, trial)
    }
}

impl<'a> Coupled<'a> {
    /// Repeats the contact sub-steps with the 6 x 6 mass of grain and fluid if a contact or
    /// lubrication load acts, walls included, or acted in the step before.
    pub fn resolve_contact(self) -> Resolved<'a> {
        let Coupled(mut step, coupled, trial) = self;
        let solid = &mut step.solid;
        let (grains, data, dt) = (&mut *solid.grains, &mut *solid.data, solid.dt);
        let pending = data.previous.iter().any(PreviousStep::has_pending_velocity);
        if data.contact.iter().all(Load::is_zero) && !pending {
            solid.dynamics.accept(trial);
            for (end, grain) in data.ends.iter_mut().zip(grains) {
                end.pose = grain.pose;
            }
            return Resolved(step, coupled);
        }
        let added_density = solid.dynamics.params().added_density;
        let (previous, responses) = (&data.previous, &mut data.responses);
        coupled.responses(grains, previous, &data.contact, added_density, dt, responses);
        timed(&mut solid.times.contact, || {
            let (contact, ends) = (&mut data.contact, &mut data.ends);
            (solid.dynamics).resolve_with_response(trial, grains, &data.responses, contact, ends)
        });
        Resolved(step, coupled)
    }
}

impl<'a> Resolved<'a> {
    /// Gives the grains their new velocities and imposes them on the forced faces.
    pub fn impose_rigidity(self) -> Rigid<'a> {
        let Resolved(mut step, coupled) = self;
        let Context { solid, flow } = &mut step;
        let open_sides = &mut solid.open_sides;
        let rigid = RigidityInput {
            grains: solid.grains,
            previous: &solid.data.previous,
            contact: &solid.data.contact,
            dt: solid.dt,
            loads: solid.loads,
            fluid_impulses: open_sides.as_mut().map_or(&mut [][..], |o| &mut o.fluid_impulses),
        };
        timed(&mut solid.times.coupling, || flow.fluid.impose_rigidity(coupled, rigid));
        if let Some(open_sides) = open_sides {
            flow.fluid.cover_boundary(&open_sides.covered_faces(solid.grains));
        }
        Rigid(step)
    }
}

impl<'a> Rigid<'a> {
    /// Projects the velocity onto the divergence-free fields.
    pub fn project(self) -> Projected<'a> {
        let Rigid(mut context) = self;
        let Context { solid, flow } = &mut context;
        let momentum_before = flow.fluid.measures().momentum;
        timed(&mut solid.times.project, || flow.fluid.project(solid.dt));
        Projected { context, momentum_before }
    }
}

impl Projected<'_> {
    /// Balances the momentum and records what the next step needs.
    pub fn finish(self) {
        let Context { solid, flow } = self.context;
        let (density, dt, data) = (flow.density, solid.dt, solid.data);
        let gain = flow.fluid.measures().momentum - self.momentum_before;
        let mut residual = density * (gain - flow.fluid.boundary_impulse(dt));
        for (i, (grain, load)) in solid.grains.iter_mut().zip(&*solid.loads).enumerate() {
            data.located[i] = grain.pose;
            grain.pose = data.ends[i].pose;
            let previous = &mut data.previous[i];
            let change = grain.rigid_velocity() - previous.velocity;
            // The fluid lost what it gave the grain, the displaced fluid included.
            residual -= match solid.open_sides.as_deref().and_then(|o| o.impulse_across(i)) {
                None => density * grain.shape.volume() * change.linear - dt * load.force,
                Some(impulse) => impulse,
            };
            let touched = !data.contact[i].is_zero();
            // The acceleration of an impact does not continue in the next step; its added mass
            // does.
            let taken_up = previous.pending_added_mass_velocity;
            previous.added_mass_uptake = taken_up / dt;
            (previous.acceleration, previous.pending_added_mass_velocity) = if touched {
                (RigidVelocity::default(), beyond_substeps(grain, &data.ends[i]))
            } else {
                ((change + taken_up) / dt, RigidVelocity::default())
            };
        }
        *flow.momentum_residual = residual;
    }
}

/// Load of the global damping xi [1/s] (Eqs 6 and 24) that gives the velocities of Eq. 22 after
/// `dt` [s].
fn damping_load(grain: &Grain, xi: f64, dt: f64) -> Load {
    let rate = -xi / (1.0 + 0.5 * xi * dt);
    Load {
        force: rate * grain.mass() * grain.velocity,
        torque: rate * (grain.inertia() * grain.angular_velocity),
    }
}

/// Velocities of a grain beyond those at the end of its sub-steps; zero where they are prescribed.
fn beyond_substeps(grain: &Grain, end: &RigidState) -> RigidVelocity {
    let beyond = grain.rigid_velocity() - end.velocity;
    let free = |constraint: MotionConstraint, velocity: DVec3| match constraint {
        MotionConstraint::Free => velocity,
        MotionConstraint::Prescribed(_) => DVec3::ZERO,
    };
    RigidVelocity {
        linear: free(grain.translation, beyond.linear),
        angular: free(grain.rotation, beyond.angular),
    }
}
