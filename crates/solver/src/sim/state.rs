//! Exact state of a simulation as bytes.

use std::io::{self, Read, Write};

use grainwake_formats::codec::{Decoder, Encoder, invalid};

use glam::DVec3;

use super::Simulation;
use crate::grid::Mesh;
use crate::math::{Load, Pose, RigidVelocity};

/// Begins the state of grains at open sides of the box.
const OPEN_SIDES: u64 = u64::from_le_bytes(*b"OPENSIDE");

impl Simulation {
    /// Writes the full state; a simulation restored from it continues bitwise identically.
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn save(&self, writer: &mut dyn Write) -> io::Result<()> {
        let mut out = Encoder::new(writer);
        out.u64(self.clock.steps)?;
        out.reals(&[self.clock.time, self.clock.last_step])?;
        out.u64(self.setup.grains.len() as u64)?;
        let grains = self.setup.grains.iter();
        for ((grain, load), previous) in grains.zip(&self.data.loads).zip(&self.data.previous) {
            save_pose(&grain.pose, &mut out)?;
            save_rates(grain.rigid_velocity(), &mut out)?;
            out.vector(load.force)?;
            out.vector(load.torque)?;
            save_rates(previous.acceleration, &mut out)?;
            save_rates(previous.pending_added_mass_velocity, &mut out)?;
            save_rates(previous.added_mass_uptake, &mut out)?;
            out.vector(previous.change)?;
            save_rates(previous.velocity, &mut out)?;
        }
        if let Some(fluid) = &self.fluid {
            out.vector(self.data.momentum_residual)?;
            self.data.located.iter().try_for_each(|pose| save_pose(pose, &mut out))?;
            fluid.save(&mut out)?;
        }
        if let Some(open_sides) = &self.data.open_sides {
            out.u64(OPEN_SIDES)?;
            let mut accelerations = open_sides.earlier_accelerations.iter();
            accelerations.try_for_each(|acceleration| save_rates(*acceleration, &mut out))?;
        }
        self.data.dynamics.save(writer)
    }

    /// Restores a state written by [`Simulation::save`] from the same set-up. Prescribed motions
    /// are those of the set-up again, and no external load acts.
    ///
    /// # Errors
    /// `InvalidData` if the state does not fit this set-up; the simulation is then unusable. Errors
    /// of the reader.
    pub fn restore(&mut self, reader: &mut dyn Read) -> io::Result<()> {
        let mut input = Decoder::new(reader);
        self.clock.steps = input.u64()?;
        [self.clock.time, self.clock.last_step] = input.numbers()?;
        // Only the first step is limited from rest.
        self.clock.longest_next =
            if self.clock.steps == 0 { self.clock.longest_first } else { f64::INFINITY };
        input.expect(self.setup.grains.len(), "grains")?;
        let data = &mut self.data;
        // A grain that has left in the meantime may move again.
        data.initial_control.apply(&mut self.setup);
        data.external.fill(Load::default());
        let grains = self.setup.grains.iter_mut();
        for ((grain, load), previous) in grains.zip(&mut data.loads).zip(&mut data.previous) {
            grain.pose = restore_pose(&mut input, &self.setup.mesh)?;
            grain.velocity = input.vector()?;
            grain.angular_velocity = input.vector()?;
            if grain.has_left() {
                grain.leave();
            }
            *load = Load { force: input.vector()?, torque: input.vector()? };
            previous.acceleration = restore_rates(&mut input)?;
            previous.pending_added_mass_velocity = restore_rates(&mut input)?;
            previous.added_mass_uptake = restore_rates(&mut input)?;
            previous.change = input.vector()?;
            previous.velocity = restore_rates(&mut input)?;
        }
        if let Some(fluid) = &mut self.fluid {
            data.momentum_residual = input.vector()?;
            // Faces are found at the poses before contact was resolved.
            let mut grains = self.setup.grains.clone();
            for (grain, pose) in grains.iter_mut().zip(&mut data.located) {
                *pose = restore_pose(&mut input, &self.setup.mesh)?;
                grain.pose = *pose;
            }
            fluid.restore(&mut input, self.clock.last_step, &grains)?;
        }
        if let Some(open_sides) = &mut data.open_sides {
            if input.u64()? != OPEN_SIDES {
                return Err(invalid(
                    "it was written by a version without grains that leave the box",
                ));
            }
            for acceleration in &mut open_sides.earlier_accelerations {
                *acceleration = restore_rates(&mut input)?;
            }
        }
        data.dynamics.restore(reader)
    }
}

/// Largest distance of a grain from the box, in diagonals of the box. Positions of grains in
/// periodic boxes are not wrapped.
const FAR: f64 = 1e6;

fn save_pose(pose: &Pose, out: &mut Encoder) -> io::Result<()> {
    out.vector(pose.position)?;
    out.quaternion(pose.orientation)
}

/// Reads a pose. One that no simulation reaches is refused, since locating it would take any amount
/// of memory.
fn restore_pose(input: &mut Decoder, mesh: &Mesh) -> io::Result<Pose> {
    let pose = Pose { position: input.vector()?, orientation: input.quaternion()? };
    let distance = (pose.position - mesh.origin).length();
    let left = pose.position.cmpeq(DVec3::INFINITY).all();
    let near = distance < FAR * mesh.extent().length();
    if !left && !near {
        return Err(invalid(format!("a grain is at {} m", pose.position)));
    }
    if !pose.orientation.is_normalized() {
        return Err(invalid(format!("the quaternion {} has no unit length", pose.orientation)));
    }
    Ok(pose)
}

fn save_rates(rates: RigidVelocity, out: &mut Encoder) -> io::Result<()> {
    out.vector(rates.linear)?;
    out.vector(rates.angular)
}

fn restore_rates(input: &mut Decoder) -> io::Result<RigidVelocity> {
    Ok(RigidVelocity { linear: input.vector()?, angular: input.vector()? })
}
