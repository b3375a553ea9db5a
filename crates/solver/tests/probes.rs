//! Samples at points and on planes: fluxes are those that the projection conserves, points agree
//! with exact flows, and cross-sections with spheres.

use std::f64::consts::PI;

use glam::DVec3;
use grainwake_shape::Shape;
use grainwake_solver::dem::{Grain, MotionConstraint};
use grainwake_solver::flow::{Boundary, FluidParams};
use grainwake_solver::grid::{Axis, Mesh};
use grainwake_solver::sim::{Setup, Simulation, StepRule};

const WALLS: [Boundary; 2] = [Boundary::WALL; 2];
const PERIODIC: [Boundary; 2] = [Boundary::Periodic; 2];
const SLIP: [Boundary; 2] = [Boundary::Slip; 2];
const H: f64 = 1.0 / 8.0;

/// Fluid of density 2 and kinematic viscosity 0.05 in a box of 16 x 12 x 20 cells.
fn fluid(sides: [[Boundary; 2]; 3], grains: Vec<Grain>) -> Setup {
    Setup::new(Mesh { cells: [16, 12, 20], spacing: DVec3::splat(H), origin: DVec3::splat(-0.3) })
        .with_boundaries(sides)
        .with_fluid(FluidParams::new(2.0, 0.05))
        .with_grains(grains)
        .with_step(StepRule::Limits { cfl: 0.3, viscous: 0.2, max_step: 0.05 })
}

fn fixed_sphere(position: [f64; 3]) -> Grain {
    let mut sphere =
        Grain::new(Shape::sphere(0.4, 600), 2.0).with_position(DVec3::from_array(position));
    sphere.translation = MotionConstraint::Prescribed(DVec3::ZERO);
    sphere.rotation = MotionConstraint::Prescribed(DVec3::ZERO);
    sphere
}

fn advance(sim: &mut Simulation, steps: usize) {
    for _ in 0..steps {
        sim.step(f64::INFINITY).expect("a stable step");
    }
}

/// Volume fluxes on planes along `axis`: on every layer of faces, and between them.
fn fluxes(sim: &Simulation, axis: Axis) -> Vec<f64> {
    let (lower, length) = (sim.mesh().origin[axis as usize], sim.mesh().extent()[axis as usize]);
    let cells = sim.mesh().cells[axis as usize];
    (0..=3 * cells)
        .map(|n| {
            let at = lower + length * n as f64 / (3 * cells) as f64;
            sim.sample_plane(axis, at).expect("the plane lies in the box").volume_flux
        })
        .collect()
}

fn assert_equal(fluxes: &[f64], expected: f64, scale: f64) {
    for (n, flux) in fluxes.iter().enumerate() {
        assert!((flux - expected).abs() < 1e-12 * scale, "plane {n}: {flux:e}, not {expected:e}");
    }
}

#[test]
fn the_flux_of_an_inflow_passes_every_plane() {
    let inflow = Boundary::Inflow { velocity: DVec3::new(0.0, 0.0, 0.7) };
    let sides = [SLIP, WALLS, [inflow, Boundary::Outflow]];
    let mut sim = Simulation::new(fluid(sides, vec![fixed_sphere([0.5, 0.4, 0.6])])).unwrap();
    advance(&mut sim, 12);
    let exact = 0.7 * (16.0 * H) * (12.0 * H);
    assert_equal(&fluxes(&sim, Axis::Z), exact, exact);
    assert!(sim.sample_plane(Axis::Z, -0.31).is_none());
    assert!(sim.sample_plane(Axis::Z, 20.0 * H - 0.29).is_none());
}

#[test]
fn a_periodic_flow_has_one_flux_and_so_has_single_precision() {
    let mut params = FluidParams::new(2.0, 0.05);
    params.body_acceleration = DVec3::new(0.0, 0.0, 2.0);
    for (precision, tolerance) in [("f64", 1e-12), ("f32", 1e-5)] {
        let setup = fluid([PERIODIC, WALLS, PERIODIC], vec![fixed_sphere([0.5, 0.4, 0.6])])
            .with_fluid(params)
            .with_precision(match precision {
                "f32" => grainwake_solver::math::Precision::Single,
                _ => grainwake_solver::math::Precision::Double,
            });
        let mut sim = Simulation::new(setup).unwrap();
        advance(&mut sim, 12);
        let fluxes = fluxes(&sim, Axis::Z);
        assert!(fluxes[0] > 0.05, "{}", fluxes[0]);
        for flux in &fluxes {
            assert!((flux / fluxes[0] - 1.0).abs() < tolerance, "{precision}: {flux:e}");
        }
    }
}

#[test]
fn grains_carry_their_cross_section_through_a_plane() {
    // The sphere crosses the periodic sides along x and z.
    let mut sphere =
        Grain::new(Shape::sphere(0.4, 600), 2.0).with_position(DVec3::new(-0.25, 0.4, -0.2));
    sphere.velocity = DVec3::new(0.1, 0.0, -0.3);
    let sim = Simulation::new(fluid([PERIODIC, WALLS, PERIODIC], vec![sphere])).unwrap();
    let box_area = (16.0 * H) * (12.0 * H);
    for height in [0.0, 0.15, -0.3] {
        let area = PI * (0.4f64.powi(2) - f64::powi(height, 2));
        let mut at = -0.2 + height;
        if at < -0.3 {
            at += 20.0 * H;
        }
        let sample = sim.sample_plane(Axis::Z, at).unwrap();
        assert!((sample.solid_fraction * box_area / area - 1.0).abs() < 3e-3, "{height}");
        assert!((sample.grain_flux / (-0.3 * area) - 1.0).abs() < 3e-3, "{height}");
    }
    assert_eq!(sim.sample_plane(Axis::Z, 0.9).unwrap().solid_fraction, 0.0);
    let inside = sim.sample_point(DVec3::new(-0.25, 0.4, -0.2)).unwrap();
    assert_eq!(inside.solid_fraction, 1.0);
    assert!((inside.velocity - DVec3::new(0.1, 0.0, -0.3)).length() < 1e-3, "{}", inside.velocity);
}

#[test]
fn points_and_planes_have_the_pressure_of_a_hydrostatic_column() {
    // A body force against walls gives a linear pressure, which is exact up to the walls.
    let mut params = FluidParams::new(2.0, 0.05);
    params.body_acceleration = DVec3::new(0.0, 0.0, -3.0);
    let mut sim = Simulation::new(fluid([SLIP, WALLS, WALLS], vec![]).with_fluid(params)).unwrap();
    advance(&mut sim, 3);
    let slope = -2.0 * 3.0;
    let top = -0.3 + 20.0 * H;
    let pressure = |z: f64| sim.sample_point(DVec3::new(0.51, 0.02, z)).unwrap().pressure;
    for z in [-0.3, -0.27, 0.4, top - 0.01, top] {
        let exact = slope * (z - 1.0);
        assert!((pressure(z) - pressure(1.0) - exact).abs() < 1e-11, "at {z}");
        let plane = sim.sample_plane(Axis::Z, z).unwrap().pressure;
        assert!((plane - pressure(1.0) - exact).abs() < 1e-11, "plane at {z}");
    }
    assert!(sim.sample_point(DVec3::new(0.51, 0.02, top + 1e-6)).is_none());
}
