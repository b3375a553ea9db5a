//! Grains at open sides of the box: they leave through an outflow as if the domain went on, and
//! float in a free surface as Archimedes found.

use std::f64::consts::PI;
use std::path::Path;

use glam::{DQuat, DVec3};
use grainwake_shape::{Shape, ShapeOptions, analytic};
use grainwake_solver::dem::{ContactParams, Grain, MotionConstraint};
use grainwake_solver::flow::{Boundary, FluidParams};
use grainwake_solver::grid::Mesh;
use grainwake_solver::sim::events::{EventKind, EventParams, StopWhen, Tracker};
use grainwake_solver::sim::{Setup, Simulation, StepRule};

const WALLS: [Boundary; 2] = [Boundary::WALL; 2];
const H: f64 = 1.0 / 8.0;

/// Grains in a fluid of density 1 and kinematic viscosity `nu` in a box of `cells`, with gravity 1
/// along -z and the sides `z` below and above.
fn setup(cells: [usize; 3], z: [Boundary; 2], nu: f64, grains: Vec<Grain>) -> Setup {
    Setup::new(Mesh::cubic(cells, H))
        .with_boundaries([WALLS, WALLS, z])
        .with_fluid(FluidParams::new(1.0, nu))
        .with_gravity(DVec3::NEG_Z)
        .with_grains(grains)
        .with_contact(ContactParams { normal_stiffness: 50.0, ..ContactParams::default() })
        .with_step(StepRule::Limits { cfl: 0.3, viscous: 0.2, max_step: 0.1 })
}

fn grain(shape: Shape, density: f64, position: [f64; 3]) -> Grain {
    Grain::new(shape, density).with_position(DVec3::from_array(position))
}

fn sphere(density: f64, position: [f64; 3]) -> Grain {
    grain(Shape::sphere(0.5, 600), density, position)
}

fn step(sim: &mut Simulation) {
    sim.step(f64::INFINITY).expect("a stable step");
}

/// Sphere of density 2.65, `across` cells across, that falls from `above` over the lower side of a
/// box of this `height`, an outflow; Galileo number 100.
fn falling_out(across: usize, height: usize, above: f64) -> Simulation {
    let nu = 1.65f64.sqrt() / 100.0;
    let grain = sphere(2.65, [2.0, 2.02, above]);
    let sides = [Boundary::Outflow, Boundary::WALL];
    let mut case = setup([0; 3], sides, nu, vec![grain]);
    case.mesh = Mesh::cubic([4, 4, height].map(|n| n * across), 1.0 / across as f64);
    Simulation::new(case).unwrap()
}

/// A sphere `across` cells across leaves through an outflow: its speed when its centre crosses the
/// plane, relative to that in a box 4 diameters longer; the simulation; its largest momentum
/// residual.
fn at_the_plane(across: usize) -> (f64, Simulation, f64) {
    let (mut short, mut long) = (falling_out(across, 7, 5.5), falling_out(across, 11, 9.5));
    let mut balance: f64 = 0.0;
    while short.grains()[0].pose.position.z > 0.0 {
        step(&mut short);
        long.advance_to(short.time()).unwrap();
        balance = balance.max(short.diagnostics().momentum_residual);
    }
    let [short_speed, long_speed] = [&short, &long].map(|sim| sim.grains()[0].velocity.z);
    (short_speed / long_speed, short, balance)
}

#[test]
fn a_grain_of_four_cells_leaves_through_an_outflow_as_if_the_domain_went_on() {
    let (speed, mut sim, _) = at_the_plane(4);
    assert!((speed - 1.0).abs() < 0.015, "speed at the plane: {speed} of that in a longer box");
    for _ in 0..200 {
        step(&mut sim);
    }
    assert!(sim.grains()[0].has_left());
}

/// Set-up without gravity of a sphere of density 1.2 that moves at `speed` towards an outflow.
fn towards_an_outflow(speed: f64) -> Simulation {
    let grain = sphere(1.2, [2.0, 2.0, 2.0]).with_velocity(DVec3::new(0.0, 0.0, -speed));
    let start = setup([32, 32, 32], [Boundary::Outflow, Boundary::WALL], 0.02, vec![grain]);
    Simulation::new(start.with_gravity(DVec3::ZERO)).unwrap()
}

#[test]
fn a_grain_that_slows_down_at_an_outflow_is_not_thrown_back() {
    let mut sim = towards_an_outflow(1.0);
    while !sim.grains()[0].has_left() {
        step(&mut sim);
        let speed = -sim.grains()[0].velocity.z;
        assert!(sim.grains()[0].has_left() || speed > 0.1, "{speed} at t = {}", sim.time());
        assert!(sim.time() < 12.0, "it leaves");
    }
}

#[test]
fn a_grain_that_falls_along_an_outflow_reaches_its_settling_speed() {
    // 1.2 cells from the outflow: it departs from the start.
    let mut case = setup([32, 32, 56], WALLS, 0.05, vec![sphere(1.2, [3.35, 2.0, 6.0])]);
    case.boundaries.0[0][1] = Boundary::Outflow;
    let mut sim = Simulation::new(case).unwrap();
    sim.advance_to(15.0).unwrap();
    let grain = &sim.grains()[0];
    let speed = -grain.velocity.z;
    // Weight less buoyancy equals the drag of Schiller and Naumann.
    let drag = 3.0 * PI * 0.05 * (1.0 + 0.15 * (speed / 0.05).powf(0.687)) * speed;
    let weight = 0.2 * grain.shape.volume();
    assert!((drag / weight - 1.0).abs() < 0.01, "speed {speed}: drag {drag}, weight {weight}");
}

#[test]
fn a_grain_leaves_through_an_outflow_as_if_the_domain_went_on() {
    let (speed, mut short, mut balance) = at_the_plane(8);
    assert!((speed - 1.0).abs() < 0.015, "speed at the plane: {speed} of that in a longer box");
    let velocity = short.grains()[0].velocity;
    let sideways = velocity.truncate().length() / velocity.z.abs();
    assert!(sideways < 0.01, "{sideways}");
    // The grain leaves within a few steps after it is beyond the plane, and is gone for good.
    let params =
        EventParams::for_grains(short.grains(), DVec3::NEG_Z, 1.0, short.setup().enclosure());
    let mut tracker = Tracker::new(params, short.grains(), None);
    for _ in 0..200 {
        step(&mut short);
        let velocity = |grain| short.grain_velocity(grain);
        tracker.update(short.time(), short.grains(), velocity, short.contacts(), None);
        balance = balance.max(short.diagnostics().momentum_residual);
    }
    assert!(short.grains()[0].has_left());
    assert_eq!(tracker.events().len(), 1);
    assert_eq!(
        (tracker.events()[0].kind, &tracker.events()[0].grains[..]),
        (EventKind::Left, &[0][..])
    );
    assert!(tracker.holds_since(StopWhen::Landing, short.grains()).is_none());
    assert_eq!(short.loads()[0], Default::default());
    assert!(balance < 1e-13, "momentum residual {balance:e}");
    let after = short.diagnostics();
    assert!(after.grain_kinetic_energy == 0.0 && after.slip == 0.0, "{after:?}");
    assert!(after.max_divergence < 1e-10 * after.max_velocity / H, "{after:?}");
}

/// A sphere pushes another one out of the box. Both leave as if the domain went on, and the contact
/// between them keeps their momentum.
#[test]
fn touching_grains_leave_through_an_outflow_one_after_the_other() {
    let pair = |height: usize, above: f64| {
        let nu = 1.65f64.sqrt() / 100.0;
        let grains = [0.0, 1.0].map(|z| sphere(2.65, [2.0, 2.02, above + z]));
        let case = setup([32, 32, height], [Boundary::Outflow, Boundary::WALL], nu, grains.into());
        Simulation::new(case).unwrap()
    };
    let (mut short, mut long) = (pair(56, 4.5), pair(88, 8.5));
    // In the long box the first sphere is still in front of the second when that one leaves.
    let (mut contacts, mut enough) = (0, 50);
    for (grain, bound) in [(0, 0.015), (1, 0.06)] {
        while short.grains()[grain].pose.position.z > 0.0 {
            step(&mut short);
            contacts += usize::from(!short.contacts().is_empty());
            let balance = short.diagnostics().momentum_residual;
            assert!(balance < 1e-13, "momentum residual {balance:e}");
        }
        long.advance_to(short.time()).unwrap();
        let [short_speed, long_speed] = [&short, &long].map(|sim| sim.grains()[grain].velocity.z);
        let difference = short_speed / long_speed - 1.0;
        assert!(difference.abs() < bound, "speed of {grain}: {short_speed} and {long_speed}");
        assert!(contacts > enough, "{contacts} steps with contact");
        (contacts, enough) = (0, 0);
    }
}

#[test]
fn a_grain_that_leaves_is_restored_with_the_same_bits() {
    let bits = |sim: &Simulation| {
        let mut bytes = Vec::new();
        sim.save(&mut bytes).unwrap();
        bytes
    };
    let mut sim = falling_out(8, 4, 1.2);
    let mut saved = Vec::new();
    // States with the grain inside, close to the plane, across it, and gone.
    for n in 0..160 {
        if n % 40 == 20 {
            saved.push((bits(&sim), sim.steps()));
        }
        step(&mut sim);
    }
    assert!(sim.grains()[0].has_left());
    let end = bits(&sim);
    // Returns to each state from that with the grain gone.
    let mut rewound = falling_out(8, 4, 1.2);
    rewound.restore(&mut &end[..]).unwrap();
    for (state, at) in saved {
        let mut restored = falling_out(8, 4, 1.2);
        restored.restore(&mut &state[..]).unwrap();
        assert_eq!(restored.steps(), at);
        while restored.steps() < sim.steps() {
            step(&mut restored);
        }
        assert!(bits(&restored) == end, "restored at step {at}");
        rewound.restore(&mut &state[..]).unwrap();
        while rewound.steps() < sim.steps() {
            step(&mut rewound);
        }
        assert!(bits(&rewound) == end, "rewound to step {at}");
    }
}

#[test]
fn a_dry_grain_leaves_too_and_its_neighbour_stays() {
    let case = setup(
        [32, 32, 32],
        [Boundary::Outflow, Boundary::WALL],
        0.1,
        vec![sphere(2.0, [1.0, 1.0, 1.0]), sphere(2.0, [3.0, 3.0, 3.0]).held()],
    );
    let case = case.with_fluid(None).with_step(StepRule::Fixed(0.01));
    let mut sim = Simulation::new(case).unwrap();
    sim.advance_to(2.5).unwrap();
    assert!(sim.grains()[0].has_left() && !sim.grains()[1].has_left());
}

/// Fraction of the volume of a grain below the height `surface`, by summation over points.
fn immersed_fraction(grain: &Grain, surface: f64) -> f64 {
    let n = 80;
    let (lower, size) = (grain.shape.lower(), grain.shape.upper() - grain.shape.lower());
    let (mut below, mut all) = (0.0, 0.0);
    for index in 0..n * n * n {
        let [i, j, k] =
            [index % n, index / n % n, index / (n * n)].map(|i| (i as f64 + 0.5) / n as f64);
        let x = lower + size * DVec3::new(i, j, k);
        if grain.shape.distance(x) <= 0.0 {
            all += 1.0;
            below += f64::from(u8::from(grain.pose.to_space(x).z <= surface));
        }
    }
    below / all
}

/// Releases a grain of equivalent diameter 1 tilted and out of equilibrium, and checks its immersed
/// fraction at rest for several ratios of the densities.
fn floats_as_archimedes_found(name: &str, shape: &Shape) {
    let surface = 3.0;
    for ratio in [0.2, 0.5, 0.8, 0.9] {
        // Viscous enough to come to rest soon.
        let tilt = DQuat::from_scaled_axis(DVec3::new(0.5, 0.3, 0.1));
        let position = [2.0, 2.02, surface - 0.15];
        let grain = grain(shape.clone(), ratio, position).with_orientation(tilt);
        let sides = [Boundary::WALL, Boundary::FreeSurface];
        let mut sim = Simulation::new(setup([32, 32, 24], sides, 0.05, vec![grain])).unwrap();
        sim.advance_to(60.0).unwrap();
        let grain = &sim.grains()[0];
        let found = immersed_fraction(grain, surface);
        let speed = grain.velocity.length();
        assert!(speed < 2e-3, "{name} of {ratio} moves at {speed}");
        assert!((found / ratio - 1.0).abs() < 0.005, "{name} of {ratio}: {found} immersed");
    }
}

#[test]
fn spheres_float_as_archimedes_found() {
    floats_as_archimedes_found("sphere", &Shape::sphere(0.5, 600));
}

#[test]
fn cubes_float_as_archimedes_found() {
    let edge = (PI / 6.0f64).cbrt();
    let options = ShapeOptions::default();
    let cube = analytic::rounded_box(edge, edge, edge, 0.05 * edge, &options).unwrap();
    floats_as_archimedes_found("cube", &cube);
}

#[test]
fn a_rock_floats_as_archimedes_found() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/grains/tsquare_rock.grain");
    let rock = Shape::load(&file).unwrap().scaled_to_equivalent_diameter(1.0).unwrap();
    floats_as_archimedes_found("rock", &rock);
}

#[test]
fn a_floating_sphere_heaves_with_the_period_of_potential_flow() {
    // A half-immersed sphere under a rigid lid has the added mass of zero frequency, 0.831 of the
    // displaced mass: T = 2 pi sqrt((1 + 0.831) (2/3) a / g).
    let expected = 2.0 * PI * (1.831 * 2.0 / 3.0 * 0.5f64).sqrt();
    let surface = 4.0;
    let grain = sphere(0.5, [3.0, 3.0, surface - 0.1]);
    let sides = [Boundary::WALL, Boundary::FreeSurface];
    let mut sim = Simulation::new(setup([48, 48, 32], sides, 1e-4, vec![grain])).unwrap();
    let (mut turns, mut last, mut extremes) = (Vec::new(), 0.0, Vec::new());
    let mut balance: f64 = 0.0;
    while turns.len() < 7 {
        step(&mut sim);
        balance = balance.max(sim.diagnostics().momentum_residual);
        let speed = sim.grains()[0].velocity.z;
        if last * speed < 0.0 {
            turns.push(sim.time() - sim.time_step() * speed / (speed - last));
            extremes.push((sim.grains()[0].pose.position.z - surface).abs());
        }
        last = speed;
    }
    let period = (turns[6] - turns[0]) / 3.0;
    assert!(balance < 1e-13, "momentum residual {balance:e}");
    assert!((period / expected - 1.0).abs() < 0.04, "period {period}, expected {expected}");
    let decays = extremes.windows(2).all(|pair| pair[1] < pair[0]);
    assert!(decays, "a heave gains no energy: {extremes:?}");
}

/// A floating sphere in hydrostatic balance that drifts towards an outflow keeps floating: the part
/// out of the fluid has no buoyancy there either.
#[test]
fn a_floating_grain_floats_on_next_to_an_outflow() {
    let mut floating = sphere(0.5, [0.0, 2.0, 4.0]);
    floating.velocity = DVec3::new(0.1, 0.0, 0.0);
    // Its surface is within two cells of the side at x = 4.
    floating.pose.position.x = 3.3;
    let mut case = setup([32; 3], [Boundary::WALL, Boundary::FreeSurface], 0.05, vec![floating]);
    let inflow = Boundary::Inflow { velocity: DVec3::new(0.1, 0.0, 0.0) };
    case.boundaries.0[0] = [inflow, Boundary::Outflow];
    let mut sim = Simulation::new(case).unwrap();
    while sim.time() < 0.5 {
        step(&mut sim);
        let rise = sim.grains()[0].velocity.z;
        assert!(rise.abs() < 1e-10, "speed {rise} at t = {}", sim.time());
    }
}

/// No horizontal force acts on a box that is periodic along x and has a slip bottom: the momentum
/// of a floating sphere that moves along x stays in the box, its part above the surface included.
#[test]
fn the_momentum_of_a_floating_grain_is_conserved() {
    let mut floating = sphere(0.5, [2.0, 2.0, 3.0]);
    floating.velocity = DVec3::new(0.1, 0.0, 0.0);
    floating.rotation = MotionConstraint::Prescribed(DVec3::ZERO);
    let sides = [Boundary::Slip, Boundary::FreeSurface];
    let mut case = setup([32, 32, 24], sides, 0.02, vec![floating]);
    case.boundaries.0[0] = [Boundary::Periodic; 2];
    case.boundaries.0[1] = [Boundary::Periodic; 2];
    let mut sim = Simulation::new(case).unwrap();
    let start = sim.diagnostics().momentum.x;
    while sim.time() < 1.0 {
        step(&mut sim);
    }
    let (end, speed) = (sim.diagnostics().momentum.x, sim.grains()[0].velocity.x);
    println!("momentum {start:.4e} to {end:.4e}, speed {speed:.3}");
    assert!(speed < 0.08, "the grain gives momentum to the fluid: {speed}");
    assert!((end / start - 1.0).abs() < 0.03, "{start} to {end}");
}

#[test]
fn grains_above_a_free_surface_fall_and_collide_as_without_fluid() {
    let speed = 0.5;
    let surface = [Boundary::WALL, Boundary::FreeSurface];
    for density in [0.5, 2.0] {
        // 4 cells above the surface.
        let first = sphere(density, [1.2, 2.0, 5.0]).with_velocity(DVec3::X * speed);
        let pair = vec![first, sphere(density, [2.5, 2.0, 5.0])];
        let case = setup([32; 3], surface, 0.01, pair).with_gravity(DVec3::ZERO);
        let mut sim = Simulation::new(case).unwrap();
        sim.advance_to(1.5).unwrap();
        let [first, second] = [0, 1].map(|n| sim.grains()[n].velocity.x / speed);
        assert!(first.abs() < 0.01 && (second - 1.0).abs() < 0.01, "{density}: {first} {second}");
        let case = setup([32; 3], surface, 0.01, vec![sphere(density, [2.0, 2.0, 6.0])]);
        let mut sim = Simulation::new(case).unwrap();
        for _ in 0..5 {
            step(&mut sim);
            let (speed, time) = (-sim.grains()[0].velocity.z, sim.time());
            assert!((speed / time - 1.0).abs() < 1e-12, "{density}: {speed} at {time}");
            assert_eq!(sim.loads()[0], Default::default());
        }
        // Into the water: its buoyancy and drag act again.
        sim.advance_to(2.2).unwrap();
        assert!(sim.loads()[0].force.z > 0.0 && -sim.grains()[0].velocity.z < 2.15);
    }
}

#[test]
fn a_grain_that_leaves_gains_no_energy_from_an_impact() {
    let speed = 0.5;
    for density in [0.5, 2.0] {
        // 1.2 cells from the outflow: it departs from the start. The drag is small.
        let grain = sphere(density, [3.3, 2.0, 0.65]).with_velocity(DVec3::X * speed);
        let case = setup([32; 3], [Boundary::Outflow, Boundary::WALL], 1e-6, vec![grain]);
        let mut sim = Simulation::new(case.with_gravity(DVec3::ZERO)).unwrap();
        sim.advance_to(1.0).unwrap();
        let rebound = -sim.grains()[0].velocity.x / speed;
        assert!((0.9..1.005).contains(&rebound), "{density}: {rebound} of the speed");
    }
}

#[test]
fn a_grain_of_prescribed_velocity_is_at_rest_when_it_has_left() {
    let mut moved = sphere(2.0, [2.0, 2.0, 0.7]);
    moved.velocity = DVec3::new(0.0, 0.0, -1.0);
    moved.translation = MotionConstraint::Prescribed(moved.velocity);
    let sides = [Boundary::Outflow, Boundary::WALL];
    let mut sim = Simulation::new(setup([32; 3], sides, 0.05, vec![moved])).unwrap();
    while sim.time() < 2.0 {
        step(&mut sim);
    }
    assert!(sim.grains()[0].has_left());
    assert_eq!(sim.diagnostics().grain_kinetic_energy, 0.0);
}
