//! The time step. It reads like the paper: predict, move the grains (contact sub-steps), locate
//! the solid, impose rigidity (after contact with the fluid's answer of this step, where there is some), project.

use std::time::{Duration, Instant};

use glam::DVec3;

use super::Simulation;
use crate::dem::{Dof, Grain, State};
use crate::immersed::{Past, Scheme};
use crate::math::Load;

/// Why a step could not be taken.
#[derive(Debug, thiserror::Error)]
pub enum StepError {
    /// The numerics failed.
    #[error("the run became unstable at t = {time:.6e} s (step {step}): {what}; try {remedy}")]
    Unstable {
        /// Time [s].
        time: f64,
        /// Step number.
        step: u64,
        /// What was seen.
        what: String,
        /// What to try.
        remedy: String,
    },
}

impl Simulation {
    /// One time step; `limit` [s] caps it so that output times are met exactly.
    pub fn step(&mut self, limit: f64) -> Result<(), StepError> {
        let rate = self
            .fluid
            .as_ref()
            .map_or(0.0, |fluid| fluid.measures().max_rate);
        let dt = self.clock.choose(rate, limit);
        let Simulation {
            setup,
            fluid,
            dynamics,
            loads,
            work,
            passes,
            ..
        } = self;
        let (grains, prescription) = (&mut setup.grains, &setup.prescription);
        let (now, end) = (self.clock.time, self.clock.time + dt);
        let fluid_density = setup.fluid.map_or(0.0, |fluid| fluid.density);
        for (i, grain) in grains.iter().enumerate() {
            work.before[i].velocity = [grain.velocity, grain.angular_velocity];
            let weight = setup.gravity * (grain.density - fluid_density) * grain.shape.volume();
            work.driving[i] = Load {
                force: weight,
                torque: DVec3::ZERO,
            } + loads[i];
        }
        prescription.drive(grains, now + 0.5 * dt);
        match fluid {
            None => timed(&mut passes.contact, || {
                dynamics.advance(grains, &work.driving, dt, &mut work.contact);
                prescription.drive(grains, end);
            }),
            Some(fluid) => {
                if let Some(acceleration) = prescription.body_acceleration(now) {
                    fluid.set_body_acceleration(acceleration);
                }
                timed(&mut passes.predict, || fluid.predict(dt));
                // The advection beside the grains is corrected when they are visited, for how they move now.
                fluid.remember(grains);
                timed(&mut passes.contact, || {
                    dynamics.remember(grains);
                    dynamics.advance(grains, &work.driving, dt, &mut work.contact)
                });
                prescription.drive(grains, end);
                if setup.scheme == Scheme::Paper {
                    timed(&mut passes.project, || fluid.project_prediction(dt));
                }
                for (driving, load) in work.driving.iter_mut().zip(&*loads) {
                    *driving += *load * -1.0;
                }
                timed(&mut passes.coupling, || {
                    let (contact, driving) = (&work.contact, &work.driving);
                    fluid.couple(grains, &work.before, contact, driving, dt)
                });
                // Contact again where there was some, now that the fluid's answer of this step is known.
                let again = work.contact.iter().any(|load| *load != Load::default());
                if again {
                    let added = dynamics.params().added_density;
                    let responses = fluid.responses(grains, &work.before, added, dt);
                    prescription.drive(grains, now + 0.5 * dt);
                    timed(&mut passes.contact, || {
                        dynamics.again(grains, &responses, dt, &mut work.contact, &mut work.ends)
                    });
                    prescription.drive(grains, end);
                }
                timed(&mut passes.coupling, || {
                    fluid.impose_rigidity(grains, &work.before, &work.contact, dt, loads);
                });
                let momentum = fluid.measures().momentum;
                timed(&mut passes.project, || fluid.project(dt));
                let gain = fluid.measures().momentum - momentum;
                self.momentum_residual = fluid_density * (gain - fluid.boundary_impulse(dt));
                for (i, (grain, load)) in grains.iter_mut().zip(&*loads).enumerate() {
                    // The faces were found for the poses of the first time.
                    work.located[i] = grain.pose;
                    if again {
                        grain.pose = work.ends[i].pose;
                    }
                    let before = &mut work.before[i];
                    before.acceleration = acceleration(grain, before, &work.contact[i], dt);
                    before.owed = owed(grain, &work.ends[i], &work.contact[i]);
                    // What the fluid gave the grain, the fluid inside it included, it lost.
                    let displaced = fluid_density * grain.shape.volume();
                    self.momentum_residual -=
                        displaced * (grain.velocity - before.velocity[0]) - dt * load.force;
                }
            }
        }
        self.clock.advance(dt);
        self.check()
    }

    /// Stops a run whose state is no longer finite or whose speed has left all reason.
    fn check(&self) -> Result<(), StepError> {
        let unstable = |what: String, remedy: &str| {
            Err(StepError::Unstable {
                time: self.clock.time,
                step: self.clock.steps,
                what,
                remedy: remedy.into(),
            })
        };
        for (i, grain) in self.setup.grains.iter().enumerate() {
            let finite = grain.pose.position.is_finite()
                && grain.velocity.is_finite()
                && grain.angular_velocity.is_finite()
                && grain.pose.orientation.is_finite();
            if !finite {
                return unstable(
                    format!("the motion of grain {i} is not finite"),
                    "a smaller time step or a softer contact",
                );
            }
        }
        if let Some(fluid) = &self.fluid {
            let m = fluid.measures();
            if !(m.kinetic_energy.is_finite() && m.max_divergence.is_finite()) {
                return unstable(
                    "the velocity is not finite".into(),
                    "a smaller [time] cfl or a finer grid",
                );
            }
            let cfl = m.max_rate * self.clock.last_step;
            if cfl > 10.0 {
                return unstable(
                    format!("the CFL number jumped to {cfl:.1}"),
                    "a smaller [time] cfl, a smaller fixed step or a finer grid",
                );
            }
        }
        Ok(())
    }
}

/// Change of a grain's velocities over a step of `dt` [s] that goes on in the next: that of an impact does
/// not.
fn acceleration(grain: &Grain, before: &Past, contact: &Load, dt: f64) -> [DVec3; 2] {
    if *contact != Load::default() {
        return Default::default();
    }
    let [velocity, omega] = before.velocity;
    [grain.velocity - velocity, grain.angular_velocity - omega].map(|change| change / dt)
}

/// What contact gave a grain beyond the velocities it leaves its sub-steps with.
fn owed(grain: &Grain, end: &State, contact: &Load) -> [DVec3; 2] {
    if *contact == Load::default() {
        return Default::default();
    }
    let [velocity, omega] = end.velocities;
    // A velocity that is given owes nothing.
    let of = |dof: Dof, change: DVec3| {
        if dof == Dof::Free {
            change
        } else {
            DVec3::ZERO
        }
    };
    [
        of(grain.translation, grain.velocity - velocity),
        of(grain.rotation, grain.angular_velocity - omega),
    ]
}

fn timed<T>(total: &mut Duration, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *total += start.elapsed();
    result
}
