//! Control of grains between steps.

use grainwake_solver::dem::{ContactLawKind, ContactParams, Grain, MotionConstraint};
use grainwake_solver::flow::{Boundary, FluidParams};
use grainwake_solver::glam::DVec3;
use grainwake_solver::grid::{Axis, Mesh};
use grainwake_solver::math::{Formula, Load};
use grainwake_solver::shape::Shape;
use grainwake_solver::sim::{
    AdvanceError, AnyFieldView, ControlError, MotionComponent, PrescribedMotion, Setup, Simulation,
    StepRule,
};

const TRANSLATION: MotionComponent = MotionComponent::Translation;
const ROTATION: MotionComponent = MotionComponent::Rotation;
const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);

fn setup() -> Setup {
    let sphere = Grain::new(Shape::sphere(0.5e-3, 300), 2500.0);
    Setup::new(Mesh::cubic([16, 16, 24], 0.125e-3))
        .with_fluid(FluidParams::new(1000.0, 1e-6))
        .with_gravity(GRAVITY)
        .with_step(StepRule::Fixed(1e-4))
        .with_grains([sphere.with_position(DVec3::new(1e-3, 1e-3, 2e-3))])
}

fn state(sim: &Simulation) -> Vec<u8> {
    let mut bytes = Vec::new();
    sim.save(&mut bytes).unwrap();
    bytes
}

fn advance(sim: &mut Simulation, steps: usize) {
    for _ in 0..steps {
        sim.step(f64::INFINITY).unwrap();
    }
}

#[test]
fn a_zero_load_changes_no_bit() {
    let (mut plain, mut loaded) =
        (Simulation::new(setup()).unwrap(), Simulation::new(setup()).unwrap());
    loaded.set_external_load(0, Load::default()).unwrap();
    advance(&mut plain, 5);
    advance(&mut loaded, 5);
    assert_eq!(state(&plain), state(&loaded));
}

#[test]
fn a_load_that_carries_the_weight_keeps_the_grain_at_rest() {
    let mut sim = Simulation::new(setup()).unwrap();
    let grain = &sim.grains()[0];
    let weight = (grain.density - 1000.0) * grain.shape.volume() * GRAVITY;
    sim.set_external_load(0, Load { force: -weight, torque: DVec3::ZERO }).unwrap();
    advance(&mut sim, 20);
    assert!(sim.grains()[0].velocity.length() < 1e-12, "{}", sim.grains()[0].velocity);
    sim.set_external_load(0, Load::default()).unwrap();
    advance(&mut sim, 20);
    assert!(sim.grains()[0].velocity.z < -5e-3, "{}", sim.grains()[0].velocity);
    assert!(sim.diagnostics().momentum_residual < 1e-10);
}

#[test]
fn a_torque_turns_the_grain_and_leaves_the_momentum_balanced() {
    let mut sim = Simulation::new(setup()).unwrap();
    let torque = DVec3::new(0.0, 1e-9, 0.0);
    sim.set_external_load(0, Load { force: DVec3::ZERO, torque }).unwrap();
    advance(&mut sim, 10);
    assert!(sim.grains()[0].angular_velocity.y > 0.0);
    assert!(sim.diagnostics().momentum_residual < 1e-10);
}

#[test]
fn a_prescribed_grain_moves_as_told_and_falls_after_its_release() {
    let mut sim = Simulation::new(setup()).unwrap();
    let (start, velocity) = (sim.grains()[0].pose.position, DVec3::new(2e-3, 0.0, 0.0));
    sim.prescribe_velocity(0, TRANSLATION, velocity).unwrap();
    sim.prescribe_velocity(0, ROTATION, DVec3::Z).unwrap();
    advance(&mut sim, 10);
    let grain = &sim.grains()[0];
    assert!((grain.pose.position - start - velocity * sim.time()).length() < 1e-15);
    assert_eq!((grain.velocity, grain.angular_velocity), (velocity, DVec3::Z));
    let refused = sim.set_velocity(0, TRANSLATION, DVec3::ZERO).unwrap_err();
    assert_eq!(refused, ControlError::Prescribed { grain: 0, quantity: "velocity" });
    sim.release(0, TRANSLATION).unwrap();
    advance(&mut sim, 10);
    let grain = &sim.grains()[0];
    assert!(grain.velocity.z < -1e-3, "{}", grain.velocity);
    assert_eq!(grain.angular_velocity, DVec3::Z);
}

#[test]
fn a_set_velocity_is_slowed_by_the_fluid() {
    let mut sim = Simulation::new(setup().with_gravity(DVec3::ZERO)).unwrap();
    let velocity = DVec3::new(5e-3, 0.0, 0.0);
    sim.set_velocity(0, TRANSLATION, velocity).unwrap();
    assert_eq!(sim.grains()[0].velocity, velocity);
    advance(&mut sim, 1);
    let first = sim.grains()[0].velocity.x;
    advance(&mut sim, 20);
    let later = sim.grains()[0].velocity.x;
    assert!(0.0 < later && later < first && first < velocity.x, "{first} {later}");
}

/// The added mass of an impact takes up no part of a velocity that is set after it.
#[test]
fn a_velocity_set_after_an_impact_is_that_at_the_start_of_the_next_step() {
    let mut setup = setup();
    setup.grains[0].pose.position.z = 0.51e-3;
    setup.grains[0].velocity.z = -0.05;
    // The contact lasts a fifth of a step.
    setup.contact.normal_stiffness = 5e4;
    setup.contact.added_density = 800.0;
    let mut sim = Simulation::new(setup).unwrap();
    while sim.grains()[0].velocity.z <= 0.0 {
        sim.step(f64::INFINITY).unwrap();
        assert!(sim.steps() < 20, "no impact");
    }
    let height = sim.grains()[0].pose.position.z;
    sim.set_velocity(0, TRANSLATION, DVec3::ZERO).unwrap();
    sim.step(f64::INFINITY).unwrap();
    let moved = sim.grains()[0].pose.position.z - height;
    let expected = 0.5 * 1e-4 * sim.grains()[0].velocity.z;
    // With the pending velocity of the impact the grain moves 2.7 times as far.
    assert!((moved / expected - 1.0).abs() < 0.05, "{moved:e} m, {expected:e} m");
}

#[test]
fn velocities_stay_in_the_plane_of_a_flat_flow() {
    let sphere = Grain::new(Shape::sphere(0.5e-3, 300), 2500.0);
    let flat = Setup::new(Mesh::cubic([16, 1, 24], 0.125e-3))
        .with_boundaries([[Boundary::WALL; 2], [Boundary::Periodic; 2], [Boundary::WALL; 2]])
        .with_fluid(FluidParams::new(1000.0, 1e-6))
        .with_grains([sphere.with_position(DVec3::new(1e-3, 0.0625e-3, 2e-3))]);
    let mut sim = Simulation::new(flat).unwrap();
    for (component, velocity, quantity) in [
        (TRANSLATION, DVec3::new(0.0, 0.1, 0.0), "velocity"),
        (ROTATION, DVec3::new(5.0, 1.0, 0.0), "angular velocity"),
    ] {
        let refused = sim.set_velocity(0, component, velocity).unwrap_err();
        assert_eq!(refused, ControlError::OutOfPlane { grain: 0, quantity, normal: 1 });
    }
    sim.set_velocity(0, TRANSLATION, DVec3::new(0.1, 0.0, -0.1)).unwrap();
    sim.set_velocity(0, ROTATION, DVec3::new(0.0, -5.0, 0.0)).unwrap();
}

#[test]
fn a_time_closer_than_a_thousandth_of_a_step_is_reached() {
    let mut sim = Simulation::new(setup()).unwrap();
    sim.advance_to(1e-3).unwrap();
    let steps = sim.steps();
    sim.advance_to(1e-3 + 0.9 * sim.least_horizon()).unwrap();
    assert_eq!(sim.steps(), steps);
    sim.advance_to(1e-3 + 1.1 * sim.least_horizon()).unwrap();
    assert_eq!(sim.steps(), steps + 1);
}

#[test]
fn unknown_grains_and_infinite_values_are_refused() {
    let mut sim = Simulation::new(setup()).unwrap();
    let no_grain = ControlError::NoGrain { grain: 1, count: 1 };
    assert_eq!(sim.set_velocity(1, TRANSLATION, DVec3::ZERO), Err(no_grain));
    let nan = DVec3::new(0.0, f64::NAN, 0.0);
    assert!(matches!(sim.set_velocity(0, ROTATION, nan), Err(ControlError::NotFinite { .. })));
    let load = Load { force: nan, torque: DVec3::ZERO };
    assert!(matches!(sim.set_external_load(0, load), Err(ControlError::NotFinite { .. })));
    let mut gone = setup();
    gone.grains[0].leave();
    let mut sim = Simulation::new(gone).unwrap();
    assert_eq!(sim.release(0, TRANSLATION), Err(ControlError::HasLeft { grain: 0 }));
}

/// Grains of this density are refused by the set-up too, unless their velocity is prescribed.
#[test]
fn a_grain_too_light_for_free_motion_is_not_released() {
    let light = |velocity| {
        let mut setup = setup();
        (setup.grains[0].density, setup.grains[0].translation) = (1.0, velocity);
        Simulation::new(setup)
    };
    assert!(light(MotionConstraint::Free).is_err());
    let held = MotionConstraint::Prescribed(DVec3::ZERO);
    let mut sim = light(held).unwrap();
    assert_eq!(sim.release(0, TRANSLATION), Err(ControlError::TooLight { grain: 0 }));
    assert_eq!(sim.grains()[0].translation, held);
    sim.release(0, ROTATION).unwrap();
}

#[test]
fn a_time_that_is_not_finite_is_refused() {
    let mut sim = Simulation::new(setup()).unwrap();
    for time in [f64::NAN, f64::INFINITY] {
        assert!(matches!(sim.advance_to(time), Err(AdvanceError::NotFinite { .. })));
    }
    assert_eq!(sim.steps(), 0);
}

/// Contact with a stiffness of -50 N/m let a grain fall through the floor.
#[test]
fn contact_and_walls_without_a_meaning_are_refused() {
    let message = |setup: Setup| Simulation::new(setup).err().unwrap().to_string();
    let contact = ContactParams { normal_stiffness: -50.0, ..ContactParams::default() };
    assert!(message(setup().with_contact(contact)).contains("normal stiffness"));
    let hertz = ContactLawKind::HertzMindlin;
    let mut soft = setup().with_contact(ContactParams { law: hertz, ..ContactParams::default() });
    soft.grains[0].material.youngs_modulus = f64::NAN;
    assert!(message(soft).contains("grain 0: the Young's modulus"));
    for velocity in [1e-3 * DVec3::X, f64::NAN * DVec3::Y] {
        let walls = [Boundary::WALL, Boundary::Wall { velocity }];
        let boundaries = [walls, [Boundary::WALL; 2], [Boundary::WALL; 2]];
        assert!(message(setup().with_boundaries(boundaries)).contains("a wall normal to x"));
    }
}

/// A restored simulation goes on as a new one that is restored, whatever was set before.
#[test]
fn a_restored_simulation_has_the_control_of_its_set_up() {
    let velocity = ["1e-3 * t / 1e-3", "0", "0"].map(String::from);
    let by_formula = || {
        let mut setup = setup();
        let mut second = setup.grains[0].clone();
        second.pose.position.z = 1e-3;
        setup.grains.push(second);
        setup.prescription.motions.push(PrescribedMotion {
            grain: 1,
            velocity: Some(Formula::parse(velocity.clone(), &["t"]).unwrap()),
            angular_velocity: None,
        });
        Simulation::new(setup).unwrap()
    };
    let (mut used, mut new) = (by_formula(), by_formula());
    advance(&mut used, 2);
    let saved = state(&used);
    used.set_external_load(0, Load { force: 1e-5 * DVec3::X, torque: DVec3::ZERO }).unwrap();
    used.prescribe_velocity(0, ROTATION, DVec3::Z).unwrap();
    used.release(1, TRANSLATION).unwrap();
    advance(&mut used, 2);
    for sim in [&mut used, &mut new] {
        sim.restore(&mut &saved[..]).unwrap();
        advance(sim, 3);
    }
    assert!(state(&used) == state(&new));
}

/// A simulation restored in a box with other wall velocities sees them in its first step: its state
/// is that of a simulation that had these walls from the start.
#[test]
fn a_restored_simulation_sees_the_velocities_of_its_walls() {
    let walls = |speed: f64| {
        let wall = |velocity: DVec3| Boundary::Wall { velocity };
        let still = [wall(DVec3::ZERO); 2];
        let [along_x, along_y] = [DVec3::X, DVec3::Y].map(|axis| speed * axis);
        let boundaries =
            [[wall(along_y); 2], [wall(along_x), wall(DVec3::ZERO)], [wall(along_x), still[1]]];
        Simulation::new(setup().with_boundaries(boundaries)).unwrap()
    };
    let (mut moving, mut restored) = (walls(0.01), walls(0.01));
    let still = state(&walls(0.0));
    restored.restore(&mut &still[..]).unwrap();
    for _ in 0..2 {
        advance(&mut moving, 1);
        advance(&mut restored, 1);
        for axis in [Axis::X, Axis::Y, Axis::Z] {
            let values = |sim: &Simulation| match sim.velocity(axis).unwrap() {
                AnyFieldView::Double(view) => view.values().to_vec(),
                AnyFieldView::Single(_) => unreachable!("double precision"),
            };
            let (one, two) = (values(&moving), values(&restored));
            assert!(one == two, "the velocities differ along {axis:?}");
            assert!(one.iter().any(|v| *v != 0.0));
        }
    }
}

/// A set velocity is a blow: the fluid takes its part by the added mass, whatever the step.
#[test]
fn the_loss_of_a_set_velocity_does_not_depend_on_the_step() {
    let after = |step: f64| {
        let mut setup = setup().with_gravity(DVec3::ZERO).with_step(StepRule::Fixed(step));
        setup.grains[0].density = 1000.0;
        let mut sim = Simulation::new(setup).unwrap();
        sim.advance_to(1e-3).unwrap();
        let [linear, angular] = [DVec3::X, DVec3::Z];
        sim.set_velocity(0, TRANSLATION, 5e-3 * linear).unwrap();
        sim.set_velocity(0, ROTATION, 5.0 * angular).unwrap();
        sim.advance_to(2e-3).unwrap();
        let grain = &sim.grains()[0];
        [grain.velocity.x / 5e-3, grain.angular_velocity.z / 5.0]
    };
    let [long, short] = [1e-4, 2e-5].map(after);
    for (a, b) in long.into_iter().zip(short) {
        assert!((a - b).abs() < 0.01, "{long:?} {short:?}");
    }
    // Without viscosity a sphere as dense as the fluid keeps two thirds.
    assert!(0.5 < long[0] && long[0] < 2.0 / 3.0, "{long:?}");
}

/// A prescribed velocity that jumps between two steps acts as one that a formula prescribes.
#[test]
fn a_jump_of_a_prescribed_velocity_is_that_of_a_formula() {
    let held = || {
        let mut setup = setup();
        setup.grains[0].translation = MotionConstraint::Prescribed(DVec3::ZERO);
        setup
    };
    let mut by_formula = held();
    let jump = ["2e-3 * min(1, t / 1e-9)", "0", "0"].map(String::from);
    by_formula.prescription.motions.push(PrescribedMotion {
        grain: 0,
        velocity: Some(Formula::parse(jump, &["t"]).unwrap()),
        angular_velocity: None,
    });
    let mut by_formula = Simulation::new(by_formula).unwrap();
    let mut by_control = Simulation::new(held()).unwrap();
    by_control.prescribe_velocity(0, TRANSLATION, 2e-3 * DVec3::X).unwrap();
    advance(&mut by_formula, 1);
    advance(&mut by_control, 1);
    let forces = [&by_formula, &by_control].map(|sim| sim.loads()[0].force);
    assert!((forces[0] - forces[1]).length() < 1e-12 * forces[0].length(), "{forces:?}");
}

/// A step much shorter than the last one disturbs the pressure; the steps after it grow gently, and
/// the disturbance fades.
#[test]
fn a_very_short_step_is_forgotten() {
    let (mut disturbed, mut undisturbed) =
        (Simulation::new(setup()).unwrap(), Simulation::new(setup()).unwrap());
    advance(&mut disturbed, 60);
    advance(&mut undisturbed, 60);
    disturbed.step(1e-10).unwrap();
    while disturbed.time() < 8e-3 {
        disturbed.step(f64::INFINITY).unwrap();
    }
    undisturbed.advance_to(disturbed.time()).unwrap();
    let speed = |sim: &Simulation| sim.grains()[0].velocity.z;
    let ratio = speed(&disturbed) / speed(&undisturbed);
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
}

/// The first step is limited by gravity, from rest; one after a restored state is not.
#[test]
fn a_restored_simulation_takes_the_same_next_step() {
    let limits = StepRule::Limits { cfl: 0.4, viscous: 1e9, max_step: f64::INFINITY };
    let mut setup = setup().with_step(limits);
    setup.grains.iter_mut().for_each(|grain| *grain = grain.clone().held());
    let [mut sim, mut again] = [(); 2].map(|()| Simulation::new(setup.clone()).unwrap());
    advance(&mut sim, 5);
    let mut state = Vec::new();
    sim.save(&mut state).unwrap();
    again.restore(&mut &state[..]).unwrap();
    let first = Simulation::new(setup).map(|mut sim| (advance(&mut sim, 1), sim.time_step()));
    advance(&mut sim, 1);
    advance(&mut again, 1);
    assert!(sim.time_step() > 1.5 * first.unwrap().1, "the state is at rest");
    assert_eq!(sim.time_step(), again.time_step());
}

/// The fluid does not yet have the velocity that was set, so its CFL number does not limit the next
/// step.
#[test]
fn the_step_after_a_set_velocity_or_load_keeps_the_cfl_number() {
    let limits = StepRule::Limits { cfl: 0.4, viscous: 0.2, max_step: f64::INFINITY };
    // A load goes on to accelerate the grain, which each step notices one step late.
    type Control = fn(&mut Simulation);
    let controls: [(&str, f64, Control); 4] = [
        ("set", 0.45, |sim| sim.set_velocity(0, TRANSLATION, DVec3::new(0.2, 0.0, 0.2)).unwrap()),
        ("prescribed", 0.45, |sim| sim.prescribe_velocity(0, TRANSLATION, DVec3::X * 0.3).unwrap()),
        ("turned", 0.45, |sim| sim.prescribe_velocity(0, ROTATION, DVec3::Z * 300.0).unwrap()),
        ("loaded", 0.9, |sim| {
            let force = DVec3::new(5e-4, 0.0, 0.0);
            sim.set_external_load(0, Load { force, torque: DVec3::ZERO }).unwrap();
        }),
    ];
    for (name, largest, control) in controls {
        let mut setup = setup().with_step(limits);
        setup.gravity = DVec3::ZERO;
        let mut sim = Simulation::new(setup).unwrap();
        advance(&mut sim, 1);
        let at_rest = sim.time_step();
        control(&mut sim);
        for _ in 0..3 {
            advance(&mut sim, 1);
            assert!(sim.cfl() < largest, "{name}: {}", sim.cfl());
        }
        assert!(sim.time_step() < 0.5 * at_rest, "{name}: {} after {at_rest}", sim.time_step());
    }
}
