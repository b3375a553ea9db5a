//! Helpers of the contact tests.
#![allow(dead_code)]

use std::sync::Arc;

use glam::{DQuat, DVec3};
use grainwake_shape::Shape;
use grainwake_solver::dem::{ContactDynamics, ContactParams, Enclosure, Grain, Side};
use grainwake_solver::math::Load;

/// A sphere at rest.
pub fn sphere(radius: f64, density: f64, nodes: usize, position: DVec3) -> Grain {
    // Rotated so that no node lies on an axis.
    let orientation = DQuat::from_scaled_axis(DVec3::new(0.4, -0.9, 0.3));
    Grain::new(Shape::sphere(radius, nodes), density)
        .with_position(position)
        .with_orientation(orientation)
}

/// A box of half width `half` about the origin without walls.
pub fn open_box(half: f64) -> Enclosure {
    Enclosure {
        lower: DVec3::splat(-half),
        upper: DVec3::splat(half),
        periodic: [false; 3],
        sides: Default::default(),
    }
}

/// A floor at z = 0 in an otherwise open box.
pub fn floor() -> Enclosure {
    Enclosure {
        lower: DVec3::new(-10.0, -10.0, 0.0),
        upper: DVec3::splat(10.0),
        periodic: [false; 3],
        sides: [[Side::Open; 2], [Side::Open; 2], [Side::WALL, Side::Open]],
    }
}

/// Frictionless and elastic, with this stiffness.
pub fn smooth(stiffness: f64) -> ContactParams {
    ContactParams {
        normal_stiffness: stiffness,
        friction: 0.0,
        wall_friction: 0.0,
        ..Default::default()
    }
}

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

/// Bits of the state of all grains.
pub fn bits(grains: &[Grain]) -> Vec<u64> {
    let vector = |v: DVec3| v.to_array().map(f64::to_bits);
    grains
        .iter()
        .flat_map(|g| {
            let turn = g.pose.orientation.to_array().map(f64::to_bits);
            let motion = [vector(g.pose.position), vector(g.velocity), vector(g.angular_velocity)];
            turn.into_iter().chain(motion.into_iter().flatten()).collect::<Vec<_>>()
        })
        .collect()
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

/// Kinetic energy [J].
pub fn kinetic(grains: &[Grain]) -> f64 {
    grains.iter().map(Grain::kinetic_energy).sum()
}
