//! Clouds of spheres, and their steps under gravity.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use grainwake_shape::Shape;
use grainwake_solver::dem::{ContactDynamics, Grain};
use grainwake_solver::math::Load;

/// Weight of every grain.
pub fn weights(grains: &[Grain], gravity: DVec3) -> Vec<Load> {
    grains.iter().map(|g| Load { force: g.mass() * gravity, torque: DVec3::ZERO }).collect()
}

/// One step under gravity.
pub fn step(
    dynamics: &mut ContactDynamics,
    grains: &mut [Grain],
    gravity: DVec3,
    dt: f64,
) -> usize {
    let loads = weights(grains, gravity);
    let mut mean = vec![Load::default(); grains.len()];
    dynamics.advance(grains, &loads, dt, &mut mean)
}

/// Pseudo-random numbers in 0..1.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
    pub fn vector(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }
}

/// `count` separate spheres in a cube of half width `half` [m] that move inwards at about `speed`
/// [m/s].
pub fn cloud(count: usize, half: f64, radius: f64, speed: f64, seed: u64) -> Vec<Grain> {
    let mut random = Random(seed);
    let shape = Arc::new(Shape::sphere(radius, 150));
    let mut grains: Vec<Grain> = Vec::new();
    while grains.len() < count {
        let position = random.vector() * half;
        if grains.iter().all(|g| g.pose.position.distance(position) > 2.0 * radius) {
            let grain = Grain::new(shape.clone(), 1000.0 + 500.0 * random.next())
                .with_position(position)
                .with_orientation(DQuat::from_scaled_axis(random.vector() * 3.0))
                .with_velocity((random.vector() - position / half) * speed)
                .with_angular_velocity(random.vector() * speed / radius);
            grains.push(grain);
        }
    }
    grains
}
