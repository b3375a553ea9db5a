//! Stages of a coupled time step. Each is a value that the next one consumes, so that they can only
//! be called in order.

use glam::DVec3;

use super::fluid::Fluid;
use super::prescription::Prescription;
use super::timing::{PassTimes, timed};
use super::{GrainData, Simulation};
use crate::dem::{Dof, Dynamics, Grain, RigidState, TrialStep};
use crate::immersed::{
    CoupledGrains, GrainKinematics, PreviousStep, RigidStep, RigidVelocity, Scheme, StepInput,
};
use crate::math::Load;

/// State that all stages work on.
struct Context<'a> {
    grains: &'a mut [Grain],
    fluid: &'a mut dyn Fluid,
    dynamics: &'a mut Dynamics,
    loads: &'a mut [Load],
    data: &'a mut GrainData,
    times: &'a mut PassTimes,
    momentum_residual: &'a mut DVec3,
    prescription: &'a Prescription,
    scheme: Scheme,
    fluid_density: f64,
    /// Time at the start of the step [s].
    time: f64,
    /// Length of the step [s].
    dt: f64,
}

/// Step about to begin.
pub(super) struct Start<'a>(Context<'a>);
/// Flow predicted without the grains.
pub(super) struct Predicted<'a>(Context<'a>);
/// Grains at their new poses, by a trial step of contact.
pub(super) struct Moved<'a>(Context<'a>, TrialStep);
/// Grains located, with their equations of motion.
pub(super) struct Coupled<'a>(Context<'a>, CoupledGrains, TrialStep);
/// Contact loads known.
pub(super) struct Resolved<'a>(Context<'a>, CoupledGrains);
/// Rigid velocities imposed on the prediction.
pub(super) struct Rigid<'a>(Context<'a>);
/// Divergence-free velocity; with the momentum of the fluid before the projection.
pub(super) struct Projected<'a>(Context<'a>, DVec3);

impl<'a> Start<'a> {
    /// Records the state before the step of `dt` [s] and applies what is prescribed; `None` without
    /// fluid.
    pub fn new(sim: &'a mut Simulation, dt: f64) -> Option<Start<'a>> {
        let Simulation {
            setup,
            clock,
            fluid,
            dynamics,
            loads,
            data,
            times,
            momentum_residual,
        } = sim;
        let (fluid, params) = (fluid.as_deref_mut()?, setup.fluid?);
        let (grains, time) = (&mut setup.grains[..], clock.time);
        for (i, grain) in grains.iter().enumerate() {
            data.previous[i].velocity = RigidVelocity::of(grain);
            data.applied[i] = weight_less_buoyancy(grain, setup.gravity, params.density);
        }
        // Prescribed velocities during the sub-steps are those of the middle of the step.
        setup.prescription.drive(grains, time + 0.5 * dt);
        for (kinematics, grain) in data.kinematics.iter_mut().zip(&*grains) {
            *kinematics = GrainKinematics::of(grain);
        }
        if let Some(acceleration) = setup.prescription.body_acceleration(time) {
            fluid.set_body_acceleration(acceleration);
        }
        Some(Start(Context {
            grains,
            fluid,
            dynamics,
            loads,
            data,
            times,
            momentum_residual,
            prescription: &setup.prescription,
            scheme: setup.scheme,
            fluid_density: params.density,
            time,
            dt,
        }))
    }

    /// Predicts the flow without the grains.
    pub fn predict(self) -> Predicted<'a> {
        let Start(step) = self;
        timed(&mut step.times.predict, || step.fluid.predict(step.dt));
        Predicted(step)
    }
}

impl<'a> Predicted<'a> {
    /// Moves the grains in contact sub-steps under the hydrodynamic load of the last step.
    pub fn move_grains(self) -> Moved<'a> {
        let Predicted(step) = self;
        let (grains, data) = (&mut *step.grains, &mut *step.data);
        for (i, driving) in data.driving.iter_mut().enumerate() {
            *driving = data.applied[i] + step.loads[i];
        }
        let trial = timed(&mut step.times.contact, || {
            (step.dynamics).trial_step(grains, &data.driving, step.dt, &mut data.contact)
        });
        step.prescription.drive(grains, step.time + step.dt);
        for (i, applied) in data.applied.iter_mut().enumerate() {
            *applied = data.driving[i] + step.loads[i] * -1.0;
        }
        Moved(step, trial)
    }
}

impl<'a> Moved<'a> {
    /// Locates the grains and assembles their equations of motion with the impulse of the fluid. The
    /// paper's scheme projects the prediction first.
    pub fn couple(self) -> Coupled<'a> {
        let Moved(step, trial) = self;
        if step.scheme == Scheme::Paper {
            timed(&mut step.times.project, || {
                step.fluid.project_prediction(step.dt)
            });
        }
        let input = StepInput {
            grains: step.grains,
            kinematics: &step.data.kinematics,
            previous: &step.data.previous,
            contact: &step.data.contact,
            applied: &step.data.applied,
            dt: step.dt,
        };
        let coupled = timed(&mut step.times.coupling, || step.fluid.couple(input));
        Coupled(step, coupled, trial)
    }
}

impl<'a> Coupled<'a> {
    /// Repeats the contact sub-steps with the fluid's response of this step if grains touch.
    pub fn resolve_contact(self) -> Resolved<'a> {
        let Coupled(step, coupled, trial) = self;
        let (grains, data, dt) = (&mut *step.grains, &mut *step.data, step.dt);
        data.resolved = data.contact.iter().any(|load| *load != Load::default());
        if data.resolved {
            let added_density = step.dynamics.params().added_density;
            coupled.responses(
                grains,
                &data.previous,
                added_density,
                dt,
                &mut data.responses,
            );
            step.prescription.drive(grains, step.time + 0.5 * dt);
            timed(&mut step.times.contact, || {
                let (contact, ends) = (&mut data.contact, &mut data.ends);
                (step.dynamics).resolve_with_response(trial, grains, &data.responses, contact, ends)
            });
            step.prescription.drive(grains, step.time + dt);
        } else {
            step.dynamics.accept(trial);
        }
        Resolved(step, coupled)
    }
}

impl<'a> Resolved<'a> {
    /// Gives the grains their new velocities and imposes them on the forced faces.
    pub fn impose_rigidity(self) -> Rigid<'a> {
        let Resolved(step, coupled) = self;
        let rigid = RigidStep {
            grains: step.grains,
            previous: &step.data.previous,
            contact: &step.data.contact,
            dt: step.dt,
            loads: step.loads,
        };
        timed(&mut step.times.coupling, || {
            step.fluid.impose_rigidity(coupled, rigid)
        });
        Rigid(step)
    }
}

impl<'a> Rigid<'a> {
    /// Projects the velocity onto the divergence-free fields.
    pub fn project(self) -> Projected<'a> {
        let Rigid(step) = self;
        let momentum = step.fluid.measures().momentum;
        timed(&mut step.times.project, || step.fluid.project(step.dt));
        Projected(step, momentum)
    }
}

impl Projected<'_> {
    /// Balances the momentum and records what the next step needs.
    pub fn finish(self) {
        let Projected(step, momentum) = self;
        let (density, dt, data) = (step.fluid_density, step.dt, step.data);
        let gain = step.fluid.measures().momentum - momentum;
        let mut residual = density * (gain - step.fluid.boundary_impulse(dt));
        for (i, (grain, load)) in step.grains.iter_mut().zip(&*step.loads).enumerate() {
            data.located[i] = grain.pose;
            if data.resolved {
                grain.pose = data.ends[i].pose;
            }
            let touched = data.contact[i] != Load::default();
            let previous = &mut data.previous[i];
            let change = RigidVelocity::of(grain) - previous.velocity;
            // The fluid lost what it gave the grain, the displaced fluid included.
            residual -= density * grain.shape.volume() * change.linear - dt * load.force;
            *previous = PreviousStep {
                velocity: previous.velocity,
                // The acceleration of an impact does not continue in the next step.
                acceleration: if touched {
                    RigidVelocity::default()
                } else {
                    change / dt
                },
                pending_added_mass_velocity: if touched {
                    beyond_substeps(grain, &data.ends[i])
                } else {
                    RigidVelocity::default()
                },
            };
        }
        *step.momentum_residual = residual;
    }
}

/// Velocities of a grain beyond those at the end of its sub-steps; zero where they are prescribed.
fn beyond_substeps(grain: &Grain, end: &RigidState) -> RigidVelocity {
    let [linear, angular] = end.velocities;
    let beyond = RigidVelocity::of(grain) - RigidVelocity { linear, angular };
    let free = |dof: Dof, velocity: DVec3| match dof {
        Dof::Free => velocity,
        Dof::Prescribed(_) => DVec3::ZERO,
    };
    RigidVelocity {
        linear: free(grain.translation, beyond.linear),
        angular: free(grain.rotation, beyond.angular),
    }
}

/// Weight of a grain less its buoyancy in a fluid of `fluid_density` [kg/m^3].
pub(super) fn weight_less_buoyancy(grain: &Grain, gravity: DVec3, fluid_density: f64) -> Load {
    Load {
        force: gravity * (grain.density - fluid_density) * grain.shape.volume(),
        torque: DVec3::ZERO,
    }
}
