//! Exact state of a simulation as bytes.

use std::io::{self, Read, Write};

use grainwake_formats::codec::{Decoder, Encoder, invalid};

use glam::DVec3;

use super::Simulation;

use crate::grid::Mesh;
use crate::math::{Load, Pose};

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
        for ((grain, load), previous) in grains.zip(&self.loads).zip(&self.data.previous) {
            out.vector(grain.pose.position)?;
            out.quaternion(grain.pose.orientation)?;
            for v in [
                grain.velocity,
                grain.angular_velocity,
                load.force,
                load.torque,
                previous.acceleration.linear,
                previous.acceleration.angular,
                previous.pending_added_mass_velocity.linear,
                previous.pending_added_mass_velocity.angular,
                previous.added_mass_uptake.linear,
                previous.added_mass_uptake.angular,
            ] {
                out.vector(v)?;
            }
        }
        if let Some(fluid) = &self.fluid {
            out.vector(self.momentum_residual)?;
            for pose in &self.data.located {
                out.vector(pose.position)?;
                out.quaternion(pose.orientation)?;
            }
            fluid.save(&mut out)?;
        }
        if let Some(open_sides) = &self.open_sides {
            out.u64(OPEN_SIDES)?;
            for acceleration in &open_sides.earlier_accelerations {
                out.vector(acceleration.linear)?;
                out.vector(acceleration.angular)?;
            }
        }
        self.dynamics.save(writer)
    }

    /// Restores a state written by [`Simulation::save`] from the same set-up.
    ///
    /// # Errors
    /// `InvalidData` if the state does not fit this set-up; the simulation is then unusable. Errors
    /// of the reader.
    pub fn restore(&mut self, reader: &mut dyn Read) -> io::Result<()> {
        let mut input = Decoder::new(reader);
        self.clock.steps = input.u64()?;
        [self.clock.time, self.clock.last_step] = input.numbers()?;
        input.expect(self.setup.grains.len(), "grains")?;
        let grains = self.setup.grains.iter_mut();
        for ((grain, load), previous) in grains.zip(&mut self.loads).zip(&mut self.data.previous) {
            grain.pose.position = input.vector()?;
            grain.pose.orientation = input.quaternion()?;
            check_pose(&grain.pose, &self.setup.mesh)?;
            grain.velocity = input.vector()?;
            grain.angular_velocity = input.vector()?;
            if grain.has_left() {
                grain.leave();
            }
            *load = Load { force: input.vector()?, torque: input.vector()? };
            let pending = &mut previous.pending_added_mass_velocity;
            for rates in [&mut previous.acceleration, pending, &mut previous.added_mass_uptake] {
                rates.linear = input.vector()?;
                rates.angular = input.vector()?;
            }
        }
        if let Some(fluid) = &mut self.fluid {
            self.momentum_residual = input.vector()?;
            // Faces are found at the poses before contact was resolved.
            let mut grains = self.setup.grains.clone();
            for (grain, pose) in grains.iter_mut().zip(&mut self.data.located) {
                pose.position = input.vector()?;
                pose.orientation = input.quaternion()?;
                check_pose(pose, &self.setup.mesh)?;
                grain.pose = *pose;
            }
            fluid.restore(&mut input, self.clock.last_step)?;
            fluid.locate(&grains);
        }
        if let Some(open_sides) = &mut self.open_sides {
            if input.u64()? != OPEN_SIDES {
                return Err(invalid(
                    "it was written by a version without grains that leave the box",
                ));
            }
            for acceleration in &mut open_sides.earlier_accelerations {
                acceleration.linear = input.vector()?;
                acceleration.angular = input.vector()?;
            }
        }
        self.dynamics.restore(reader)
    }
}

/// Largest distance of a grain from the box, in diagonals of the box. Positions of grains in
/// periodic boxes are not wrapped.
const FAR: f64 = 1e6;

/// Refuses a pose that no simulation reaches. Locating it would take any amount of memory.
fn check_pose(pose: &Pose, mesh: &Mesh) -> io::Result<()> {
    let distance = (pose.position - mesh.origin).length();
    let left = pose.position.cmpeq(DVec3::INFINITY).all();
    let near = distance < FAR * mesh.extent().length();
    if !left && !near {
        return Err(invalid(format!("a grain is at {} m", pose.position)));
    }
    if !pose.orientation.is_normalized() {
        return Err(invalid(format!("the quaternion {} has no unit length", pose.orientation)));
    }
    Ok(())
}
