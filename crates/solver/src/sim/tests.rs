use std::sync::Arc;

use glam::{DQuat, DVec3};
use grainwake_shape::{Shape, ShapeOptions, analytic};

use super::{Setup, Simulation, StepRule};
use crate::dem::{ContactParams, Dof, Grain};
use crate::flow::{Advection, Boundaries, Boundary, FluidParams};
use crate::grid::Mesh;
use crate::immersed::Scheme;
use crate::math::{Pose, Precision};
use grainwake_simd::{InstructionSet, limit_instructions};

/// A turned ellipsoid beside a wall and a sphere across the edges of a periodic box, which move.
fn two_grains(precision: Precision) -> Setup {
    let grain = |shape, position, velocity| Grain {
        shape: Arc::new(shape),
        density: 2.0,
        pose: Pose {
            position,
            orientation: DQuat::from_scaled_axis(DVec3::new(0.4, 0.7, -0.3)),
        },
        velocity,
        angular_velocity: DVec3::new(1.0, -2.0, 0.5),
        translation: Dof::Free,
        rotation: Dof::Free,
    };
    let ellipsoid = analytic::ellipsoid(0.5, 0.4, 0.35, &ShapeOptions::default()).unwrap();
    let along = |x, y, z| DVec3::new(x, y, z);
    Setup {
        prescription: Default::default(),
        mesh: Mesh {
            cells: [21, 18, 17],
            spacing: DVec3::splat(0.125),
            origin: DVec3::ZERO,
        },
        boundaries: Boundaries([
            [Boundary::Periodic; 2],
            [Boundary::Periodic; 2],
            [Boundary::WALL; 2],
        ]),
        fluid: Some(FluidParams {
            density: 1.0,
            kinematic_viscosity: 0.01,
            body_acceleration: DVec3::ZERO,
            initial_velocity: along(0.2, 0.1, 0.0),
            advection: Advection::Central,
        }),
        precision,
        scheme: Scheme::Aperture,
        gravity: along(0.0, 0.0, -1.0),
        grains: vec![
            grain(ellipsoid, along(1.3, 1.1, 0.52), along(0.5, 0.2, 0.1)),
            grain(
                Shape::sphere(0.4, 600),
                along(0.1, 0.2, 1.5),
                along(-0.3, 0.4, 0.2),
            ),
        ],
        contact: ContactParams::default(),
        step: StepRule::Fixed(0.02),
    }
}

#[test]
fn bits_of_coupled_steps_do_not_depend_on_the_instruction_set() {
    fn bits(precision: Precision) -> Vec<u64> {
        let mut sim = Simulation::new(two_grains(precision)).unwrap();
        for _ in 0..4 {
            sim.step(f64::INFINITY).unwrap();
        }
        let fluid = sim.fluid.as_ref().unwrap();
        let faces = sim.setup.mesh.layout().len();
        let velocity = (0..3).flat_map(|axis| (0..faces).map(move |at| fluid.velocity(axis, at)));
        let of = |grain: &Grain| [grain.pose.position, grain.velocity, grain.angular_velocity];
        let grains = sim.setup.grains.iter().flat_map(of);
        let all = velocity.chain(grains.flat_map(|v| v.to_array()));
        all.map(f64::to_bits).collect()
    }
    for precision in [Precision::Double, Precision::Single] {
        let [widest, middle, common] = [
            InstructionSet::Avx512,
            InstructionSet::Avx2,
            InstructionSet::Baseline,
        ]
        .map(|level| {
            limit_instructions(level);
            bits(precision)
        });
        limit_instructions(InstructionSet::Avx512);
        assert!(widest == middle && widest == common, "{precision}");
    }
}
