//! Bits of coupled steps with every instruction set. The set in use belongs to the whole program,
//! and a change of it within a step changes the bits. This file has a single test, so that no other
//! test runs beside it.

use grainwake_shape::{ShapeOptions, analytic};
use grainwake_solver::dem::Grain;
use grainwake_solver::flow::{Boundary, FluidParams};
use grainwake_solver::glam::{DQuat, DVec3};
use grainwake_solver::grid::Mesh;
use grainwake_solver::immersed::Scheme;
use grainwake_solver::math::{InstructionSet, Precision, limit_instructions};
use grainwake_solver::shape::Shape;
use grainwake_solver::sim::{Setup, Simulation, StepRule};

const WALLS: [Boundary; 2] = [Boundary::WALL; 2];
const PERIODIC: [Boundary; 2] = [Boundary::Periodic; 2];

/// Rotated ellipsoid beside a wall and sphere across the edges of the box, both moving.
fn two_grains(cells: [usize; 3], boundaries: [[Boundary; 2]; 3]) -> Setup {
    let orientation = DQuat::from_scaled_axis(DVec3::new(0.4, 0.7, -0.3));
    let grain = |shape, position, velocity| {
        Grain::new(shape, 2.0)
            .with_position(position)
            .with_orientation(orientation)
            .with_velocity(velocity)
            .with_angular_velocity(DVec3::new(1.0, -2.0, 0.5))
    };
    let ellipsoid = analytic::ellipsoid(0.5, 0.4, 0.35, &ShapeOptions::default()).unwrap();
    let along = |x, y, z| DVec3::new(x, y, z);
    let mut fluid = FluidParams::new(1.0, 0.01);
    fluid.initial_velocity = along(0.2, 0.1, 0.0);
    Setup::new(Mesh::cubic(cells, 0.125))
        .with_boundaries(boundaries)
        .with_fluid(fluid)
        .with_gravity(along(0.0, 0.0, -1.0))
        .with_grains([
            grain(ellipsoid, along(1.3, 1.1, 0.52), along(0.5, 0.2, 0.1)),
            grain(Shape::sphere(0.4, 600), along(0.45, 0.45, 1.5), along(-0.3, 0.4, 0.2)),
        ])
        .with_step(StepRule::Fixed(0.02))
}

#[test]
fn bits_of_coupled_steps_do_not_depend_on_the_instruction_set() {
    let bits = |setup: Setup| {
        let mut sim = Simulation::new(setup).unwrap();
        for _ in 0..4 {
            sim.step(f64::INFINITY).unwrap();
        }
        let mut state = Vec::new();
        sim.save(&mut state).unwrap();
        state
    };
    for (cells, boundaries) in [
        ([21, 18, 17], [PERIODIC, PERIODIC, WALLS]),
        ([37, 39, 18], [WALLS; 3]),
        ([29, 22, 16], [PERIODIC; 3]),
    ] {
        for (precision, scheme) in [
            (Precision::Double, Scheme::Aperture),
            (Precision::Single, Scheme::Aperture),
            (Precision::Double, Scheme::Paper),
        ] {
            let levels = [InstructionSet::Avx512, InstructionSet::Avx2, InstructionSet::Baseline];
            let [widest, middle, common] = levels.map(|level| {
                limit_instructions(level);
                let setup = two_grains(cells, boundaries);
                bits(setup.with_precision(precision).with_scheme(scheme))
            });
            let same = widest == middle && widest == common;
            assert!(same, "{cells:?} cells, {precision}, {scheme:?}");
        }
    }
}
