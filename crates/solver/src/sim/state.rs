//! The full state, written and read bit for bit.

use std::io::{self, Read, Write};

use glam::{DQuat, DVec3};

use super::Simulation;
use crate::math::{Load, Real};

impl Simulation {
    /// Writes the full state; reading it back continues with the same bits.
    pub fn save(&self, writer: &mut dyn Write) -> io::Result<()> {
        let mut out = Writer(writer);
        out.count(self.clock.steps)?;
        out.numbers(&[self.clock.time, self.clock.last_step])?;
        out.count(self.setup.grains.len() as u64)?;
        let grains = self.setup.grains.iter();
        for ((grain, load), previous) in grains.zip(&self.loads).zip(&self.data.previous) {
            out.numbers(&grain.pose.position.to_array())?;
            out.numbers(&grain.pose.orientation.to_array())?;
            for v in [
                grain.velocity,
                grain.angular_velocity,
                load.force,
                load.torque,
                previous.acceleration.linear,
                previous.acceleration.angular,
                previous.pending_added_mass_velocity.linear,
                previous.pending_added_mass_velocity.angular,
            ] {
                out.numbers(&v.to_array())?;
            }
        }
        if let Some(fluid) = &self.fluid {
            out.numbers(&self.momentum_residual.to_array())?;
            for pose in &self.data.located {
                out.numbers(&pose.position.to_array())?;
                out.numbers(&pose.orientation.to_array())?;
            }
            fluid.save(&mut out)?;
        }
        self.dynamics.save(out.0)
    }

    /// Restores a state written by [`Simulation::save`] from the same set-up.
    ///
    /// # Errors
    /// `InvalidData` where the data do not fit this set-up; the simulation is then not to be used.
    pub fn restore(&mut self, reader: &mut dyn Read) -> io::Result<()> {
        let mut input = Reader(reader);
        self.clock.steps = input.count()?;
        [self.clock.time, self.clock.last_step] = input.numbers()?;
        input.expect(self.setup.grains.len(), "grains")?;
        let grains = self.setup.grains.iter_mut();
        for ((grain, load), previous) in grains.zip(&mut self.loads).zip(&mut self.data.previous) {
            grain.pose.position = DVec3::from_array(input.numbers()?);
            grain.pose.orientation = DQuat::from_array(input.numbers()?);
            grain.velocity = DVec3::from_array(input.numbers()?);
            grain.angular_velocity = DVec3::from_array(input.numbers()?);
            *load = Load {
                force: DVec3::from_array(input.numbers()?),
                torque: DVec3::from_array(input.numbers()?),
            };
            let pending = &mut previous.pending_added_mass_velocity;
            for rates in [&mut previous.acceleration, pending] {
                rates.linear = DVec3::from_array(input.numbers()?);
                rates.angular = DVec3::from_array(input.numbers()?);
            }
        }
        if let Some(fluid) = &mut self.fluid {
            self.momentum_residual = DVec3::from_array(input.numbers()?);
            // The faces belong to the poses at which the grains were located, before contact was resolved.
            let mut grains = self.setup.grains.clone();
            for (grain, pose) in grains.iter_mut().zip(&mut self.data.located) {
                pose.position = DVec3::from_array(input.numbers()?);
                pose.orientation = DQuat::from_array(input.numbers()?);
                grain.pose = *pose;
            }
            fluid.restore(&mut input, self.clock.last_step)?;
            fluid.locate(&grains);
        }
        self.dynamics.restore(input.0)
    }
}

pub(super) struct Writer<'a>(&'a mut dyn Write);

impl Writer<'_> {
    pub fn count(&mut self, value: u64) -> io::Result<()> {
        self.0.write_all(&value.to_le_bytes())
    }
    pub fn numbers<R: Real>(&mut self, values: &[R]) -> io::Result<()> {
        let mut bytes = [0; 8 * 512];
        for chunk in values.chunks(512) {
            for (out, value) in bytes.chunks_exact_mut(R::BYTES).zip(chunk) {
                value.write_to(out);
            }
            self.0.write_all(&bytes[..R::BYTES * chunk.len()])?;
        }
        Ok(())
    }
}

pub(super) struct Reader<'a>(&'a mut dyn Read);

impl Reader<'_> {
    pub fn count(&mut self) -> io::Result<u64> {
        let mut bytes = [0; 8];
        self.0.read_exact(&mut bytes)?;
        Ok(u64::from_le_bytes(bytes))
    }
    pub fn numbers<const N: usize>(&mut self) -> io::Result<[f64; N]> {
        let mut values = [0.0; N];
        self.fill(&mut values)?;
        Ok(values)
    }
    pub fn fill<R: Real>(&mut self, values: &mut [R]) -> io::Result<()> {
        let mut bytes = [0; 8 * 512];
        for chunk in values.chunks_mut(512) {
            let bytes = &mut bytes[..R::BYTES * chunk.len()];
            self.0.read_exact(bytes)?;
            for (value, bytes) in chunk.iter_mut().zip(bytes.chunks_exact(R::BYTES)) {
                *value = R::read_from(bytes);
            }
        }
        Ok(())
    }
    pub fn expect(&mut self, count: usize, what: &str) -> io::Result<()> {
        let found = self.count()?;
        if found == count as u64 {
            return Ok(());
        }
        let message = format!("the checkpoint has {found} {what}, this case has {count}");
        Err(io::Error::new(io::ErrorKind::InvalidData, message))
    }
}
