//! Stages of a time step. Each is a value that the next one consumes, so that they can only be
//! called in order.

use glam::DVec3;

use super::fluid::Fluid;
use super::{Setup, Simulation, StepData};
use crate::dem::{ContactDynamics, Grain, MotionConstraint, RigidState, TrialStep};
use crate::immersed::{
    CoupledGrains, CouplingInput, Crossing, PreviousStep, RigidityInput, Scheme, departing_load,
};
use crate::math::{Load, RigidVelocity, timed};

/// Grains of a step, with or without fluid.
pub(super) struct GrainContext<'a> {
    setup: &'a mut Setup,
    data: &'a mut StepData,
    /// Time at the start of the step [s].
    time: f64,
    /// Length of the step [s].
    dt: f64,
}

/// State that all stages of a coupled step work on.
pub(super) struct Context<'a> {
    solid: GrainContext<'a>,
    fluid: &'a mut dyn Fluid,
}

/// Step about to begin.
pub(super) enum Start<'a> {
    /// Step of fluid and grains.
    Coupled(Context<'a>),
    /// Step without fluid.
    Dry(GrainContext<'a>),
}

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
/// Flow with a divergence-free velocity; momentum of the fluid over its density before the
/// projection [m^4/s].
pub(super) struct Projected<'a>(Context<'a>, DVec3);

impl<'a> Start<'a> {
    /// Records the state before the step of `dt` [s] and sets weight, buoyancy, external
    /// loads and prescribed motion.
    pub fn prepare(sim: &'a mut Simulation, dt: f64) -> Start<'a> {
        let Simulation { setup, clock, fluid, data } = sim;
        let fluid_density = setup.fluid.map_or(0.0, |params| params.density);
        if let Some(open_sides) = &mut data.open_sides {
            open_sides.update(&mut setup.grains, dt);
            open_sides.extrapolate_accelerations(&mut data.previous);
        }
        for (i, grain) in setup.grains.iter().enumerate() {
            let crossing =
                data.open_sides.as_ref().map_or(&Crossing::Inside, |o| &o.crossings()[i]);
            // Weight less buoyancy.
            let force = setup.gravity * (grain.density - fluid_density) * grain.shape.volume();
            data.applied[i] = Load { force, torque: DVec3::ZERO };
            if let Some(load) = crossing.lost_buoyancy(setup.gravity, fluid_density) {
                data.applied[i] += load;
            }
            if let Crossing::Departing(..) | Crossing::Airborne(_) = crossing {
                // These grains move under their last load: no added mass takes up a velocity.
                data.previous[i].pending_added_mass_velocity = RigidVelocity::default();
            }
            if let Crossing::Airborne(_) = crossing {
                data.previous[i].added_mass_uptake = RigidVelocity::default();
                data.loads[i] = Load::default();
            }
            if let Crossing::Left = crossing {
                data.applied[i] = Load::default();
                (data.previous[i], data.loads[i]) = (PreviousStep::default(), Load::default());
            } else if !data.external[i].is_zero() {
                // A zero load is not added: it would turn -0.0 into 0.0.
                data.applied[i] += data.external[i];
            }
            if setup.fluid.is_some() && setup.contact.global_damping > 0.0 {
                data.applied[i] += damping_load(grain, setup.contact.global_damping, dt);
            }
            let previous = &mut data.previous[i];
            previous.inertia = grain.inertia();
            previous.set_change = grain.rigid_velocity() - previous.velocity;
            data.kinematics[i] = RigidState { pose: grain.pose, velocity: previous.velocity };
        }
        let time = clock.time;
        // Midpoint rule: the sub-steps take the prescribed velocities at the middle of the step.
        setup.prescription.prescribe_motion(&mut setup.grains, time + 0.5 * dt);
        let Some(fluid) = fluid.as_deref_mut() else {
            return Start::Dry(GrainContext { setup, data, time, dt });
        };
        if let Some(acceleration) = setup.prescription.body_acceleration(time) {
            fluid.set_body_acceleration(acceleration);
        }
        if let Some(open_sides) = &data.open_sides {
            fluid.set_crossing_speeds(open_sides.speeds(&setup.grains));
        }
        Start::Coupled(Context { solid: GrainContext { setup, data, time, dt }, fluid })
    }
}

impl GrainContext<'_> {
    /// Moves the grains by the sub-steps `take` under weight, buoyancy and the hydrodynamic load of
    /// the last step (Eqs 6 to 36).
    fn take_substeps<T>(
        &mut self,
        take: impl FnOnce(&mut ContactDynamics, &mut [Grain], &[Load], f64, &mut [Load]) -> T,
    ) -> T {
        let (data, grains) = (&mut *self.data, &mut self.setup.grains);
        for (i, driving) in data.driving.iter_mut().enumerate() {
            *driving = data.applied[i] + data.loads[i];
            if let Some(load) = data.previous[i].uptake_load(&grains[i]) {
                *driving += load;
            }
        }
        let taken = timed(&mut data.times.contact, || {
            take(&mut data.dynamics, grains, &data.driving, self.dt, &mut data.contact)
        });
        self.setup.prescription.set_velocities(grains, self.time + self.dt);
        taken
    }

    /// Moves the grains in contact sub-steps; nothing else happens without fluid.
    pub fn move_grains(mut self) {
        self.take_substeps(ContactDynamics::advance);
    }
}

impl<'a> Context<'a> {
    /// Predicts the flow without the grains.
    pub fn predict(self) -> Predicted<'a> {
        let Context { solid, fluid } = self;
        timed(&mut solid.data.times.predict, || fluid.predict(solid.dt));
        Predicted(Context { solid, fluid })
    }
}

impl<'a> Predicted<'a> {
    /// Moves the grains in contact sub-steps under the hydrodynamic load of the last step.
    pub fn move_grains(self) -> Moved<'a> {
        let Predicted(mut step) = self;
        let trial = step.solid.take_substeps(ContactDynamics::trial_step);
        Moved(step, trial)
    }
}

impl<'a> Moved<'a> {
    /// Locates the grains and assembles their equations of motion with the impulse of the fluid.
    /// The paper's scheme projects the prediction first.
    pub fn couple(self) -> Coupled<'a> {
        let Moved(mut step, trial) = self;
        let Context { solid: GrainContext { setup, data, dt, .. }, fluid } = &mut step;
        let (grains, dt) = (&setup.grains, *dt);
        if setup.scheme == Scheme::Paper {
            timed(&mut data.times.project, || fluid.project_prediction(dt));
        }
        let (mut crossings, mut surface_loads) = (&[][..], Vec::new());
        if let Some(open_sides) = &mut data.open_sides {
            open_sides.list_covered_faces(grains);
            surface_loads = open_sides.surface_loads(|faces| fluid.pressure_below(faces));
            crossings = open_sides.crossings();
        }
        let input = CouplingInput {
            grains,
            kinematics: &data.kinematics,
            previous: &data.previous,
            contact: &data.contact,
            applied: &data.applied,
            last_loads: &data.loads,
            crossings,
            surface_loads: &surface_loads,
            dt,
        };
        let coupled = timed(&mut data.times.coupling, || fluid.couple(input));
        Coupled(step, coupled, trial)
    }
}

impl<'a> Coupled<'a> {
    /// Repeats the contact sub-steps with the 6 x 6 mass of grain and fluid if a contact or
    /// lubrication load acts, walls included, or acted in the step before.
    pub fn resolve_contact(self) -> Resolved<'a> {
        let Coupled(mut step, coupled, trial) = self;
        let GrainContext { setup, data, dt, .. } = &mut step.solid;
        let grains = &mut setup.grains;
        let pending = data.previous.iter().any(PreviousStep::has_pending_velocity);
        if data.contact.iter().all(Load::is_zero) && !pending {
            data.dynamics.accept(trial);
            for (end, grain) in data.ends.iter_mut().zip(grains) {
                end.pose = grain.pose;
            }
            return Resolved(step, coupled);
        }
        let added_density = data.dynamics.params().added_density;
        let (previous, responses) = (&data.previous, &mut data.responses);
        coupled.responses(grains, previous, &data.contact, added_density, *dt, responses);
        timed(&mut data.times.contact, || {
            let (contact, ends) = (&mut data.contact, &mut data.ends);
            (data.dynamics).resolve_with_response(trial, grains, &data.responses, contact, ends)
        });
        Resolved(step, coupled)
    }
}

impl<'a> Resolved<'a> {
    /// Gives the grains their new velocities and imposes them on the forced faces.
    pub fn impose_rigidity(self) -> Rigid<'a> {
        let Resolved(mut step, coupled) = self;
        let Context { solid: GrainContext { setup, data, dt, .. }, fluid } = &mut step;
        let open_sides = &mut data.open_sides;
        let rigid = RigidityInput {
            grains: &mut setup.grains,
            previous: &data.previous,
            contact: &data.contact,
            dt: *dt,
            loads: &mut data.loads,
            fluid_impulses: open_sides.as_mut().map_or(&mut [][..], |o| &mut o.fluid_impulses),
        };
        timed(&mut data.times.coupling, || fluid.impose_rigidity(coupled, rigid));
        if let Some(open_sides) = open_sides {
            fluid.cover_boundary(&open_sides.covered_faces(&setup.grains));
        }
        Rigid(step)
    }
}

impl<'a> Rigid<'a> {
    /// Projects the velocity onto the divergence-free fields.
    pub fn project(self) -> Projected<'a> {
        let Rigid(Context { solid, fluid }) = self;
        let momentum_before = fluid.measures().momentum;
        timed(&mut solid.data.times.project, || fluid.project(solid.dt));
        Projected(Context { solid, fluid }, momentum_before)
    }
}

impl Projected<'_> {
    /// Balances the momentum and records what the next step needs.
    pub fn finish(self) {
        let Projected(Context { solid, fluid }, momentum_before) = self;
        let GrainContext { setup, data, dt, .. } = solid;
        let density = setup.fluid.map_or(0.0, |params| params.density);
        let gain = fluid.measures().momentum - momentum_before;
        let mut residual = density * (gain - fluid.boundary_impulse(dt));
        for (i, (grain, load)) in setup.grains.iter_mut().zip(&mut data.loads).enumerate() {
            data.located[i] = grain.pose;
            grain.pose = data.ends[i].pose;
            let previous = &mut data.previous[i];
            let change = grain.rigid_velocity() - previous.velocity;
            // The fluid lost what it gave the grain, the displaced fluid included.
            residual -= match data.open_sides.as_ref().and_then(|o| o.impulse_across(i)) {
                None => density * grain.shape.volume() * change.linear - dt * load.force,
                Some(impulse) => impulse,
            };
            previous.change = change.linear;
            let touched = !data.contact[i].is_zero();
            let crossing = data.open_sides.as_ref().map(|o| &o.crossings()[i]);
            if let (Some(Crossing::Departing(normals, _)), Some(fluid)) = (crossing, &setup.fluid) {
                *load = departing_load(*load, grain, *normals, previous.velocity, fluid);
            }
            // The acceleration of an impact, or of a velocity that was set, does not continue in
            // the next step; the added mass of an impact does.
            let taken_up = previous.pending_added_mass_velocity;
            previous.added_mass_uptake = taken_up / dt;
            (previous.acceleration, previous.pending_added_mass_velocity) = if touched {
                (RigidVelocity::default(), beyond_substeps(grain, &data.ends[i]))
            } else if previous.was_set() {
                Default::default()
            } else {
                ((change + taken_up) / dt, RigidVelocity::default())
            };
            previous.velocity = grain.rigid_velocity();
        }
        data.momentum_residual = residual;
    }
}

/// Load of the global damping xi [1/s] (Eqs 6 and 24). Without other loads it gives the velocities
/// of Eq. 22; steady speeds under a load are too high by the factor 1 + xi dt / 2.
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
