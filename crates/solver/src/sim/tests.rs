use glam::{DQuat, DVec3};
use grainwake_shape::{Shape, ShapeOptions, analytic};

use super::{
    CELL_FIELDS, PrescribedMotion, Prescription, Remedy, Setup, Simulation, StepError, StepRule,
};
use crate::dem::{ContactParams, Grain, MotionConstraint, Partner};
use crate::flow::{Boundary, FluidParams};
use crate::grid::{Axis, Mesh};
use crate::math::Precision;

/// Rotated ellipsoid beside a wall and sphere across the edges of a periodic box, both moving.
fn two_grains(precision: Precision) -> Setup {
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
    Setup::new(Mesh::cubic([21, 18, 17], 0.125))
        .with_boundaries([[Boundary::Periodic; 2], [Boundary::Periodic; 2], [Boundary::WALL; 2]])
        .with_fluid(fluid)
        .with_precision(precision)
        .with_gravity(along(0.0, 0.0, -1.0))
        .with_grains([
            grain(ellipsoid, along(1.3, 1.1, 0.52), along(0.5, 0.2, 0.1)),
            grain(Shape::sphere(0.4, 600), along(0.1, 0.2, 1.5), along(-0.3, 0.4, 0.2)),
        ])
        .with_step(StepRule::Fixed(0.02))
}

#[test]
fn views_hold_the_values_of_cells_and_points() {
    for precision in [Precision::Double, Precision::Single] {
        let mut sim = Simulation::new(two_grains(precision)).unwrap();
        sim.step(f64::INFINITY).unwrap();
        let [i, j, k] = [4, 17, 9];
        for (n, axis) in [Axis::X, Axis::Y, Axis::Z].into_iter().enumerate() {
            let view = sim.velocity(axis).unwrap();
            assert_eq!(view.normal(), Some(axis));
            let mut upper = [k, j, i];
            upper[2 - n] += 1;
            let mean = 0.5 * (view.get([k, j, i]) + view.get(upper));
            assert_eq!(sim.velocity_at([i, j, k])[n], mean);
            let at_face = sim.interpolate_velocity(view.position([k, j, i])).unwrap()[n];
            assert!((at_face - view.get([k, j, i])).abs() < 1e-12 * at_face.abs());
        }
        let pressure = sim.kinematic_pressure().unwrap();
        assert_eq!((pressure.normal(), pressure.shape()), (None, [17, 18, 21]));
        let density = sim.setup().fluid.unwrap().density;
        let mut fields = CELL_FIELDS.iter();
        let field = fields.find(|field| field.name == "pressure").unwrap();
        let written = field.at(&sim, [i, j, k]).x;
        assert_eq!(written, density * pressure.get([k, j, i]));
    }
}

#[test]
fn contradictions_in_a_set_up_are_named() {
    let motion = PrescribedMotion { grain: 2, velocity: None, angular_velocity: None };
    let prescription = Prescription { motions: vec![motion], ..Prescription::default() };
    let setup = || two_grains(Precision::Double);
    let (periodic, surface) = ([Boundary::Periodic; 2], [Boundary::WALL, Boundary::FreeSurface]);
    let bad = [
        (setup().with_prescription(prescription), "grain 2"),
        (setup().with_step(StepRule::Fixed(0.0)), "time step"),
        (setup().with_fluid(None).with_step(StepRule::default()), "without a fluid"),
        (setup().with_fluid(FluidParams::new(0.0, 1.0)), "density"),
        (setup().with_fluid(FluidParams::new(201.0, 1.0)), "grain 0 is lighter"),
        (setup().with_boundaries([periodic, surface, surface]), "one free surface"),
    ];
    for (setup, word) in bad {
        let message = Simulation::new(setup).err().expect(word).to_string();
        assert!(message.contains(word), "{message}");
    }
}

#[test]
fn an_instability_beside_an_open_face_names_the_grain_in_it() {
    let with_floor = |floor: Boundary, height: f64| {
        let walls = [Boundary::WALL; 2];
        let grain = Grain::new(Shape::sphere(0.4, 200), 2.0);
        let setup = Setup::new(Mesh::cubic([16, 16, 16], 0.25))
            .with_boundaries([walls, walls, [floor; 2]])
            .with_grains([grain.with_position(DVec3::new(2.0, 2.0, height.min(2.0)))])
            .with_step(StepRule::Fixed(0.01));
        let mut sim = Simulation::new(setup).unwrap();
        if height.is_infinite() {
            sim.setup.grains[0].leave();
        }
        sim.with_cause("the velocity is not finite".into(), Remedy::StepOrGrid)
    };
    let (what, remedy) = with_floor(Boundary::Outflow, 0.3);
    assert!(what.ends_with("while grain 0 crosses the open lower z side"), "{what}");
    assert_eq!(remedy, Remedy::FartherFace);
    assert_eq!(with_floor(Boundary::WALL, 0.3).1, Remedy::StepOrGrid);
    assert_eq!(with_floor(Boundary::Outflow, 2.0).1, Remedy::StepOrGrid);
    // A grain that has left the box is no cause any more.
    assert_eq!(with_floor(Boundary::Outflow, f64::INFINITY).1, Remedy::StepOrGrid);
}

#[test]
fn an_overlap_of_a_free_grain_is_found_beside_a_deeper_one_of_a_prescribed_pair() {
    let shape = std::sync::Arc::new(Shape::sphere(0.4, 200));
    let at = |x, z| Grain::new(shape.clone(), 2.0).with_position(DVec3::new(x, 2.0, z));
    let held = MotionConstraint::Prescribed(DVec3::ZERO);
    let held = |grain: Grain| Grain { translation: held, rotation: held, ..grain };
    // Two held grains overlap by a quarter of their diameter; a third one sinks into the floor.
    let mut contact = ContactParams { normal_stiffness: 8.0, ..ContactParams::default() };
    contact.overlap_limit = 0.1;
    let setup = Setup::new(Mesh::cubic([16, 16, 16], 0.25))
        .with_gravity(DVec3::NEG_Z)
        .with_contact(contact)
        .with_grains([held(at(1.0, 2.0)), held(at(1.6, 2.0)), at(3.0, 0.42)])
        .with_step(StepRule::Fixed(0.01));
    let mut sim = Simulation::new(setup).unwrap();
    let error = (0..200).find_map(|_| sim.step(f64::INFINITY).err()).expect("a soft contact");
    let StepError { what, .. } = error;
    assert!(what.starts_with("grain 2 overlaps the lower z wall"), "{what}");
    let largest = sim.largest_overlap().expect("a contact");
    assert_eq!((largest.grain, largest.partner), (0, Partner::Grain(1)));
}
