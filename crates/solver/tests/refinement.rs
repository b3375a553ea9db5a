//! Grains in a refined box that moves with them.

use std::sync::Arc;

use glam::DVec3;
use grainwake_shape::{Shape, ShapeOptions, analytic};
use grainwake_solver::dem::{ContactParams, Grain, MotionConstraint};
use grainwake_solver::flow::{Boundary, FluidParams};
use grainwake_solver::grid::Mesh;
use grainwake_solver::immersed::Scheme;
use grainwake_solver::math::Precision;
use grainwake_solver::sim::{Setup, Simulation, StepRule};

const WALLS: [Boundary; 2] = [Boundary::WALL; 2];
const PERIODIC: [Boundary; 2] = [Boundary::Periodic; 2];

/// Fluid of density 1 in a box of `edges`, with `across` cells per unit length and gravity 1 along
/// -z.
fn setup(edges: [usize; 3], across: usize, nu: f64, grains: Vec<Grain>) -> Setup {
    Setup::new(Mesh::cubic(edges.map(|n| n * across), 1.0 / across as f64))
        .with_fluid(FluidParams::new(1.0, nu))
        .with_gravity(DVec3::NEG_Z)
        .with_grains(grains)
        .with_contact(ContactParams { normal_stiffness: 50.0, ..ContactParams::default() })
        .with_step(StepRule::Limits { cfl: 0.4, viscous: 0.2, max_step: 0.1 })
}

fn sphere(density: f64, position: [f64; 3]) -> Grain {
    Grain::new(Shape::sphere(0.5, 600), density).with_position(DVec3::from_array(position))
}

fn ellipsoid(density: f64, position: [f64; 3]) -> Grain {
    let shape = analytic::ellipsoid(0.65, 0.5, 0.4, &ShapeOptions::default()).unwrap();
    Grain::new(Arc::new(shape), density).with_position(DVec3::from_array(position))
}

fn step(sim: &mut Simulation) {
    sim.step(f64::INFINITY).expect("a stable step");
}

fn bits(sim: &Simulation) -> Vec<u8> {
    let mut bytes = Vec::new();
    sim.save(&mut bytes).unwrap();
    bytes
}

/// Speeds of a sphere along -z and x, and its spin about y, after it has settled from rest at a
/// Galileo number of 100, beside the axis of the box.
fn settling(across: usize, refinement: usize) -> [f64; 3] {
    let nu = 0.5f64.sqrt() / 100.0;
    let grain = sphere(1.5, [1.3, 1.5, 6.0]);
    let case = setup([3, 3, 7], across, nu, vec![grain]).with_refinement(refinement);
    let mut sim = Simulation::new(case).unwrap();
    sim.advance_to(6.0).unwrap();
    let grain = &sim.grains()[0];
    [-grain.velocity.z, grain.velocity.x, grain.angular_velocity.y]
}

#[test]
fn motion_in_a_refined_box_is_that_of_the_fine_grid() {
    let [coarse, refined, fine] = [settling(6, 1), settling(6, 2), settling(12, 1)];
    println!("{coarse:?}\n{refined:?}\n{fine:?}");
    let errors = |found: [f64; 3]| [0, 1, 2].map(|i| (found[i] - fine[i]).abs() / fine[0]);
    let (without, with) = (errors(coarse), errors(refined));
    for quantity in 0..3 {
        assert!(with[quantity] < 0.002, "{with:?}");
    }
    assert!(without[0] > 5.0 * with[0], "{without:?} and {with:?}");
}

#[test]
fn the_margin_is_kept_while_the_box_follows_a_grain() {
    // Sizes of the state with the fields of the box, at the start and after a fall of 2 diameters.
    let sizes = |margin: Option<DVec3>| {
        let case = setup([3, 3, 9], 6, 0.02, vec![sphere(2.0, [1.5, 1.5, 6.0])]).with_refinement(2);
        let mut sim = Simulation::new(case.with_refinement_margin(margin)).unwrap();
        let start = bits(&sim).len() as f64;
        while sim.grains()[0].pose.position.z > 4.0 {
            step(&mut sim);
        }
        (start, bits(&sim).len() as f64)
    };
    let (default, wide) = (sizes(None), sizes(Some(DVec3::new(0.5, 0.5, 1.5))));
    println!("{default:?} and {wide:?} bytes");
    // 54 cells along z instead of 30.
    assert!(wide.0 > 1.2 * default.0);
    assert!((wide.1 / wide.0 - 1.0).abs() < 0.02);
}

#[test]
fn a_grain_carried_by_a_uniform_stream_feels_no_force() {
    // The box follows the grain across all periodic sides.
    let stream = DVec3::new(1.0, 0.6, -0.8);
    let mut grain = ellipsoid(1.0, [1.0, 2.0, 1.5]);
    grain.velocity = stream;
    let mut case = setup([4, 4, 4], 6, 0.01, vec![grain]).with_refinement(2);
    case = case.with_boundaries([PERIODIC; 3]);
    case.fluid.as_mut().unwrap().initial_velocity = stream;
    let mut sim = Simulation::new(case).unwrap();
    while sim.time() < 9.0 {
        step(&mut sim);
        let after = sim.diagnostics();
        let grain = &sim.grains()[0];
        assert!((grain.velocity - stream).length() < 1e-11, "{:?}", grain.velocity);
        assert!(grain.angular_velocity.length() < 1e-11);
        assert!(after.momentum_residual < 1e-10 && after.slip < 1e-11, "{after:?}");
    }
    let travelled = sim.grains()[0].pose.position - DVec3::new(1.0, 2.0, 1.5);
    assert!((travelled - 9.0 * stream).length() < 0.2, "{travelled}");
}

/// Mean and largest momentum that a step gains or loses, over its length and the weight of the
/// grain in the fluid.
fn residual(across: usize) -> [f64; 2] {
    let nu = 0.5f64.sqrt() / 100.0;
    let case = setup([4, 4, 5], across, nu, vec![ellipsoid(1.5, [1.9, 2.0, 3.5])]);
    let case = case.with_refinement(2).with_boundaries([PERIODIC; 3]);
    let weight = 0.5 * case.grains[0].shape.volume();
    let box_volume = case.mesh.extent().element_product();
    let mut sim = Simulation::new(case).unwrap();
    let (mut sum, mut start, mut largest) = (0.0, 0.0, 0.0_f64);
    while sim.time() < 5.0 {
        step(&mut sim);
        if sim.time() < 1.0 {
            start = sim.time();
            continue;
        }
        // The column is relative to the momentum of the box at the largest velocity.
        let relative = sim.diagnostics().momentum_residual;
        let momentum = relative * sim.diagnostics().max_velocity * box_volume;
        sum += momentum;
        largest = largest.max(momentum / (weight * sim.time_step()));
    }
    [sum / (weight * (sim.time() - start)), largest]
}

#[test]
fn a_collision_keeps_the_momentum_up_to_the_sides_of_the_box() {
    let mut grains = vec![sphere(2.5, [1.4, 2.0, 2.0]), sphere(1.5, [2.6, 2.1, 1.95])];
    grains[0].velocity = DVec3::X;
    let case = setup([5, 4, 4], 8, 0.01, grains).with_refinement(2);
    let case = case.with_boundaries([PERIODIC; 3]).with_gravity(DVec3::ZERO);
    let mut sim = Simulation::new(case).unwrap();
    let first = sim.diagnostics().momentum;
    let (mut touched, mut before, mut largest) = (false, first, 0.0_f64);
    while sim.time() < 1.0 {
        step(&mut sim);
        touched |= !sim.contacts().is_empty();
        let momentum = sim.diagnostics().momentum;
        largest = largest.max(momentum.distance(before));
        before = momentum;
    }
    let [lost, largest] = [before.distance(first), largest].map(|p| p / first.length());
    println!("momentum lost: {lost:.2e}, at most {largest:.2e} in a step");
    assert!(touched && lost < 0.004 && largest < 0.002, "{lost}, {largest}");
}

#[test]
fn momentum_is_conserved_up_to_the_sides_of_the_box() {
    let [[coarse, largest], [fine, _]] = [6, 12].map(residual);
    println!(
        "residual over weight: {coarse:.2e}, at most {largest:.2e}, at 6 cells, {fine:.2e} at 12"
    );
    assert!(coarse < 5e-3 && largest < 0.02, "{coarse}, at most {largest}");
    assert!(fine < 0.4 * coarse, "{coarse} and {fine}");
}

#[test]
fn a_refined_run_is_restored_with_the_same_bits_on_any_threads() {
    let outflow = [Boundary::Outflow, Boundary::WALL];
    for (precision, sides) in
        [(Precision::Double, WALLS), (Precision::Single, WALLS), (Precision::Double, outflow)]
    {
        let case = || {
            let grains = vec![sphere(2.0, [1.0, 1.1, 3.2]), ellipsoid(2.0, [1.2, 1.0, 1.9])];
            let mut case = setup([2, 2, 4], 6, 0.02, grains).with_refinement(2);
            case = case.with_boundaries([PERIODIC, WALLS, sides]).with_precision(precision);
            Simulation::new(case).unwrap()
        };
        let run = || {
            let mut sim = case();
            let mut states = Vec::new();
            for n in 0..90 {
                if n % 30 == 10 {
                    states.push(bits(&sim));
                }
                step(&mut sim);
            }
            (bits(&sim), states)
        };
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (end, states) = pool(1).install(run);
        assert!(pool(3).install(run) == (end.clone(), states.clone()), "the same on 3 threads");
        for state in states {
            let mut sim = case();
            sim.restore(&mut &state[..]).unwrap();
            while sim.steps() < 90 {
                step(&mut sim);
            }
            assert!(bits(&sim) == end);
        }
    }
}

/// Loads on grains with prescribed velocities in fluid at rest, in every step from t = 1 on.
fn loads_on_moved(case: Setup, velocities: &[DVec3], end: f64) -> Vec<Vec<DVec3>> {
    let mut case = case.with_gravity(DVec3::ZERO).with_step(StepRule::Fixed(0.008));
    for (grain, velocity) in case.grains.iter_mut().zip(velocities) {
        grain.translation = MotionConstraint::Prescribed(*velocity);
    }
    let mut sim = Simulation::new(case).unwrap();
    let mut loads = Vec::new();
    while sim.time() < end {
        step(&mut sim);
        if sim.time() > 1.0 {
            loads.push(sim.loads().iter().map(|load| load.force).collect());
        }
    }
    loads
}

/// Largest second difference of the force on the first grain.
fn roughness(loads: &[Vec<DVec3>]) -> f64 {
    let second = |three: &[Vec<DVec3>]| (three[0][0] - 2.0 * three[1][0] + three[2][0]).length();
    loads.windows(3).map(second).fold(0.0, f64::max)
}

/// Two grains that part along a periodic axis: the box grows until it spans the axis, when they
/// have travelled most of a period.
#[test]
fn a_box_that_begins_to_span_a_periodic_axis_keeps_the_flow() {
    let velocities = [DVec3::new(0.0, 0.0, -1.0), DVec3::new(0.0, 0.0, -1.4)];
    let case = |across| {
        let grains = vec![sphere(2.0, [1.5, 1.5, 4.0]), sphere(2.0, [1.5, 1.5, 2.6])];
        setup([3, 3, 5], across, 0.05, grains).with_boundaries([WALLS, WALLS, PERIODIC])
    };
    let refined = loads_on_moved(case(6).with_refinement(2), &velocities, 4.0);
    let fine = loads_on_moved(case(12), &velocities, 4.0);
    let pairs = refined.iter().flatten().zip(fine.iter().flatten());
    let differences = pairs.map(|(refined, fine)| (*refined - *fine).length() / fine.length());
    let largest = differences.fold(0.0, f64::max);
    println!("largest difference of a force from the fine grid: {largest:.2e}");
    assert!(largest < 0.005, "{largest}");
}

#[test]
fn a_box_as_wide_as_a_periodic_box_pushes_no_grain_sideways() {
    let velocity = [DVec3::new(0.0, 0.0, -1.0)];
    // The grain lies on the sides of the box, and the refined box moves along z.
    let case = setup([2, 2, 7], 6, 0.02, vec![sphere(2.0, [0.0, 1.0, 6.0])]).with_refinement(2);
    let loads = loads_on_moved(case.with_boundaries([PERIODIC, PERIODIC, WALLS]), &velocity, 4.0);
    for load in &loads {
        let force = load[0];
        assert!(force.truncate().length() < 1e-6 * force.z, "{force}");
    }
    assert!(roughness(&loads) < 6e-3 * loads[0][0].z, "{}", roughness(&loads) / loads[0][0].z);
}

#[test]
fn the_force_is_smooth_when_the_box_slides_along_a_wall() {
    let velocity = [DVec3::new(0.0, 0.0, -1.0)];
    let roughness_at = |x: f64| {
        let case = setup([3, 3, 7], 6, 0.02, vec![sphere(2.0, [x, 1.5, 6.0])]).with_refinement(2);
        let loads = loads_on_moved(case, &velocity, 4.0);
        roughness(&loads) / loads[0][0].length()
    };
    let (beside, middle) = (roughness_at(0.6), roughness_at(1.5));
    println!("second difference over the force: {beside:.1e} beside a wall, {middle:.1e} away");
    assert!(beside < 6e-3 && middle < 6e-3, "{beside} and {middle}");
}

#[test]
fn a_state_with_an_impossible_box_is_refused() {
    let case = |refinement| {
        let case = setup([2, 2, 4], 6, 0.02, vec![sphere(2.0, [1.0, 1.0, 3.0])]);
        Simulation::new(case.with_refinement(refinement)).unwrap()
    };
    let state = bits(&case(2));
    let mut restored = case(2);
    restored.restore(&mut &state[..]).unwrap();
    // The box follows the fields of the whole grid, of 12 x 12 x 24 cells.
    let (corner, cells) = (0u64.to_le_bytes(), 12u64.to_le_bytes());
    let here = [corner, cells, corner, cells].concat();
    let at = state.windows(here.len()).position(|window| window == here).expect("the box");
    for number in [at, at + 8] {
        for wrong in [u64::MAX, 1 << 63, 13, 1 << 40] {
            let mut damaged = state.clone();
            damaged[number..number + 8].copy_from_slice(&wrong.to_le_bytes());
            let error = case(2).restore(&mut &damaged[..]).unwrap_err();
            assert_eq!(error.kind(), std::io::ErrorKind::InvalidData, "{error}");
        }
    }
    assert!(case(1).restore(&mut &state[..]).is_err(), "another refinement");
}

#[test]
fn a_grain_lands_on_a_wall_and_rests() {
    let case = setup([2, 2, 3], 6, 0.05, vec![sphere(2.5, [1.0, 1.0, 1.2])]).with_refinement(2);
    let mut sim = Simulation::new(case).unwrap();
    sim.advance_to(8.0).unwrap();
    let grain = &sim.grains()[0];
    println!("speed {:.1e} at z = {:.4}", grain.velocity.length(), grain.pose.position.z);
    assert!(grain.velocity.length() < 1e-5, "{}", grain.velocity);
    assert!((grain.pose.position.z - 0.5).abs() < 0.02, "{}", grain.pose.position.z);
}

#[test]
fn a_grain_leaves_through_an_outflow_as_if_the_domain_went_on() {
    let falling = |height: usize, above: f64| {
        let nu = 1.65f64.sqrt() / 100.0;
        let case = setup([4, 4, height], 6, nu, vec![sphere(2.65, [2.0, 2.02, above])]);
        let sides = [Boundary::Outflow, Boundary::WALL];
        Simulation::new(case.with_refinement(2).with_boundaries([WALLS, WALLS, sides])).unwrap()
    };
    let (mut short, mut long) = (falling(6, 4.5), falling(9, 7.5));
    while short.grains()[0].pose.position.z > 0.0 {
        step(&mut short);
    }
    long.advance_to(short.time()).unwrap();
    let [short_speed, long_speed] = [&short, &long].map(|sim| sim.grains()[0].velocity.z);
    let ratio = short_speed / long_speed;
    println!("speed at the outflow over that in a longer box: {ratio:.4}");
    assert!((ratio - 1.0).abs() < 0.015, "{short_speed} and {long_speed}");
    for _ in 0..200 {
        step(&mut short);
    }
    assert!(short.grains()[0].has_left());
    assert!(short.diagnostics().max_divergence < 1e-9);
}

#[test]
fn a_grain_that_reaches_a_free_surface_stops_the_run() {
    let case = setup([2, 2, 3], 6, 0.05, vec![sphere(0.8, [1.0, 1.0, 2.2])]);
    let sides = [Boundary::WALL, Boundary::FreeSurface];
    let case = case.with_refinement(2).with_boundaries([WALLS, WALLS, sides]);
    let mut sim = Simulation::new(case).unwrap();
    let error = loop {
        match sim.step(f64::INFINITY) {
            Ok(()) => assert!(sim.time() < 30.0, "the sphere rises through the surface"),
            Err(error) => break error.to_string(),
        }
    };
    let top = sim.grains()[0].pose.position.z + 0.5;
    assert!((top - 3.0).abs() < 0.1, "stopped at {top}");
    assert!(error.contains("grain 0 reaches the free surface") && error.contains("smaller cells"));
}

#[test]
fn set_ups_that_cannot_be_refined_are_refused() {
    let case = || setup([2, 2, 2], 6, 0.05, vec![sphere(2.5, [1.0, 1.0, 1.0])]);
    let message = |case: Setup| match Simulation::new(case) {
        Ok(_) => panic!("accepted"),
        Err(error) => error.to_string(),
    };
    assert!(message(case().with_refinement(3)).contains("1 or 2"));
    let margin = case().with_refinement(2).with_refinement_margin(DVec3::new(0.3, 0.0, 0.3));
    assert!(message(margin).contains("margin"));
    let paper = case().with_refinement(2).with_scheme(Scheme::Paper);
    assert!(message(paper).contains("one grid"));
    let mut flat = case().with_refinement(2).with_boundaries([WALLS, PERIODIC, WALLS]);
    flat.mesh.cells[1] = 1;
    assert!(message(flat).contains("flat"));
}
