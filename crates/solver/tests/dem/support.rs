//! Helpers of the contact tests.

use glam::{DQuat, DVec3};
use grainwake_shape::Shape;
use grainwake_solver::dem::{ContactParams, Enclosure, Grain, Side};

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

/// Kinetic energy [J].
pub fn kinetic(grains: &[Grain]) -> f64 {
    grains.iter().map(Grain::kinetic_energy).sum()
}
