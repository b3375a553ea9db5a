//! Conservation in contact: Newton's third law, momentum, angular momentum, energy; invariance of a
//! contact across a periodic face.

use std::sync::Arc;

use crate::clouds::{cloud, step};
use crate::support::{kinetic, open_box, smooth, sphere};
use glam::{DQuat, DVec3};
use grainwake_shape::Shape;
use grainwake_solver::dem::{
    ContactDynamics, ContactParams, Enclosure, Grain, MotionConstraint, Partner,
};
use grainwake_solver::math::Load;

fn momenta(grains: &[Grain]) -> (DVec3, DVec3) {
    grains.iter().fold((DVec3::ZERO, DVec3::ZERO), |(p, l), g| {
        (p + g.momentum(), l + g.angular_momentum(DVec3::ZERO))
    })
}

#[test]
fn a_colliding_cloud_keeps_momentum_and_angular_momentum() {
    let mut grains = cloud(60, 0.05, 0.008, 0.3, 7);
    let params = ContactParams {
        normal_stiffness: 1e3,
        friction: 0.4,
        restitution: 0.8,
        ..Default::default()
    };
    let mut dynamics = ContactDynamics::new(params, open_box(1.0));
    let (p0, l0) = momenta(&grains);
    let speeds: f64 = grains.iter().map(|g| g.momentum().length()).sum();
    let spins: f64 = grains.iter().map(|g| g.angular_momentum(DVec3::ZERO).length()).sum();
    let energy = kinetic(&grains);
    let mut met = 0;
    for _ in 0..400 {
        step(&mut dynamics, &mut grains, DVec3::ZERO, 5e-4);
        met += dynamics.contacts().len();
    }
    let (p, l) = momenta(&grains);
    println!(
        "cloud: {met} contacts, p {:.1e}, L {:.1e}",
        (p - p0).length() / speeds,
        (l - l0).length() / spins
    );
    assert!(met > 200);
    assert!((p - p0).length() <= 1e-13 * speeds);
    assert!((l - l0).length() <= 1e-12 * spins);
    assert!(kinetic(&grains) < 0.9 * energy, "friction and dashpots take energy");
}

/// A step in which the grain turns by two radians is taken in sub-steps.
#[test]
fn a_tumbling_ellipsoid_keeps_angular_momentum_and_energy_in_long_steps() {
    let shape =
        grainwake_shape::analytic::ellipsoid(3e-3, 2e-3, 1.5e-3, &Default::default()).unwrap();
    let spin = DVec3::new(0.1, 20.0, 0.05);
    let grain = Grain::new(shape, 2600.0).with_angular_velocity(spin);
    let mut grains = vec![grain.with_position(DVec3::splat(0.5))];
    let mut dynamics = ContactDynamics::new(ContactParams::default(), open_box(1.0));
    let (before, energy) = (momenta(&grains).1, kinetic(&grains));
    let mut turned = false;
    for _ in 0..100 {
        step(&mut dynamics, &mut grains, DVec3::ZERO, 0.1);
        let own = grains[0].pose.orientation.conjugate() * grains[0].angular_velocity;
        turned |= own.y < -10.0;
    }
    let change = (momenta(&grains).1 - before).length() / before.length();
    assert!(change < 2e-3, "{change:e}");
    assert!((kinetic(&grains) / energy - 1.0).abs() < 1e-3, "{}", kinetic(&grains) / energy - 1.0);
    assert!(turned, "the rotation about the intermediate axis is unstable");
}

#[test]
fn elastic_collisions_keep_the_energy() {
    let mut grains = cloud(60, 0.05, 0.008, 0.3, 11);
    let params = ContactParams { substeps_per_contact: 60.0, ..smooth(1e3) };
    let mut dynamics = ContactDynamics::new(params, open_box(1.0));
    let start = kinetic(&grains);
    let mut worst: f64 = 0.0;
    for _ in 0..300 {
        step(&mut dynamics, &mut grains, DVec3::ZERO, 5e-4);
        let now = kinetic(&grains) + dynamics.elastic_energy();
        worst = worst.max((now / start - 1.0).abs());
    }
    println!("elastic cloud: energy {worst:.1e}");
    assert!(worst < 2e-3, "{worst}");
}

#[test]
fn both_bodies_get_opposite_loads_to_round_off() {
    let params = ContactParams {
        normal_stiffness: 1e4,
        friction: 0.5,
        restitution: 0.7,
        ..Default::default()
    };
    let mut dynamics = ContactDynamics::new(params, open_box(10.0));
    let mut grains = [
        sphere(1.0, 100.0, 500, DVec3::new(0.1, 0.2, 0.3)),
        sphere(0.6, 300.0, 200, DVec3::new(1.0, 1.2, 1.1)),
    ];
    grains[0].velocity = DVec3::new(1.0, 2.0, 0.5);
    grains[0].angular_velocity = DVec3::new(-3.0, 1.0, 2.0);
    grains[1].angular_velocity = DVec3::new(0.5, 4.0, 1.0);
    for _ in 0..20 {
        let mut mean = [Load::default(); 2];
        let at: Vec<_> = grains.iter().map(|g| g.pose.position).collect();
        dynamics.advance(&mut grains, &[], 1e-5, &mut mean);
        let force = mean[0].force + mean[1].force;
        assert!(mean[0].force.length() > 0.0);
        assert!(force.length() <= 1e-15 * mean[0].force.length(), "{force}");
        // About the origin, with the lever arms at the middle of the step.
        let arm = |i: usize| 0.5 * (at[i] + grains[i].pose.position);
        let moment = mean[0].torque
            + arm(0).cross(mean[0].force)
            + mean[1].torque
            + arm(1).cross(mean[1].force);
        let scale = mean[0].torque.length() + arm(0).length() * mean[0].force.length();
        assert!(moment.length() <= 1e-8 * scale, "{moment}");
    }
    // The reported load of the pair equals its mean over a vanishing step.
    let mut mean = [Load::default(); 2];
    dynamics.advance(&mut grains, &[], 1e-14, &mut mean);
    let about = |i: usize| mean[i].torque + grains[i].pose.position.cross(mean[i].force);
    let scale = about(0).length();
    assert!((about(0) + about(1)).length() <= 1e-12 * scale);
}

fn periodic(size: DVec3) -> Enclosure {
    Enclosure { lower: DVec3::ZERO, upper: size, periodic: [true; 3], sides: Default::default() }
}

#[test]
fn contact_across_a_periodic_face_equals_contact_in_the_interior() {
    let size = DVec3::new(1.0, 1.5, 2.0);
    let params = ContactParams { normal_stiffness: 1e3, friction: 0.4, ..Default::default() };
    let run = |offset: DVec3, wrap: bool| {
        let enclosure = periodic(size);
        let mut grains = [
            sphere(0.1, 1000.0, 300, DVec3::new(0.4, 0.7, 1.0)),
            sphere(0.1, 1000.0, 300, DVec3::new(0.55, 0.8, 1.1)),
        ];
        grains[0].velocity = DVec3::new(0.6, 0.2, 0.1);
        for grain in &mut grains {
            grain.pose.position = enclosure.wrap(grain.pose.position + offset);
        }
        let mut dynamics = ContactDynamics::new(params, enclosure);
        let mut touched = 0;
        for _ in 0..300 {
            step(&mut dynamics, &mut grains, DVec3::ZERO, 1e-3);
            touched += dynamics.contacts().len();
            if wrap {
                for grain in &mut grains {
                    grain.pose.position = enclosure.wrap(grain.pose.position);
                }
            }
        }
        assert!(touched > 10);
        grains.map(|g| (g.velocity, g.angular_velocity, enclosure.wrap(g.pose.position - offset)))
    };
    let inside = run(DVec3::ZERO, false);
    for offset in
        [DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.52, 0.75, 0.95), DVec3::new(-3.45, 6.7, 0.0)]
    {
        for wrap in [false, true] {
            let across = run(offset, wrap);
            for (a, b) in inside.iter().zip(&across) {
                assert!((a.0 - b.0).length() < 1e-9, "{offset} {wrap}: {} {}", a.0, b.0);
                assert!((a.1 - b.1).length() < 1e-8, "{offset} {wrap}: {} {}", a.1, b.1);
                assert!((a.2 - b.2).length() < 1e-10, "{offset} {wrap}: {} {}", a.2, b.2);
            }
        }
    }
}

#[test]
fn a_grain_that_fills_a_periodic_box_presses_on_its_own_image() {
    // Radius 0.5 in a box of width 0.98: overlap 0.02 along x with its own image, none along y and
    // z.
    let enclosure = periodic(DVec3::new(0.98, 3.0, 3.0));
    let mut grains = [sphere(0.5, 1000.0, 500, DVec3::new(0.1, 0.2, 0.3))];
    let mut dynamics = ContactDynamics::new(smooth(1e5), enclosure);
    let mut mean = [Load::default()];
    dynamics.advance(&mut grains, &[], 1e-4, &mut mean);
    let [contact] = dynamics.contacts() else { panic!("one contact: {:?}", dynamics.contacts()) };
    assert_eq!((contact.grain, contact.partner), (0, Partner::Grain(0)));
    assert!((contact.overlap - 0.02).abs() < 1e-4 * 0.02);
    assert!((contact.load.force.length() / (1e5 * 0.02) - 1.0).abs() < 1e-3);
    // The forces of the two images cancel.
    assert!(mean[0].force.length() < 1e-12 * contact.load.force.length());
    assert!(grains[0].velocity.length() < 1e-15);
}

#[test]
fn pairs_touch_through_several_images() {
    // Two spheres alternate along x with period 1, so each touches the other on both sides.
    let enclosure = periodic(DVec3::new(1.0, 3.0, 3.0));
    let mut grains = [
        sphere(0.26, 1000.0, 500, DVec3::new(0.0, 1.0, 1.0)),
        sphere(0.26, 1000.0, 500, DVec3::new(0.5, 1.0, 1.0)),
    ];
    let mut dynamics = ContactDynamics::new(smooth(1e5), enclosure);
    let mut mean = [Load::default(); 2];
    dynamics.advance(&mut grains, &[], 1e-4, &mut mean);
    assert_eq!(dynamics.contacts().len(), 2);
    for contact in dynamics.contacts() {
        assert!((contact.overlap - 0.02).abs() < 1e-4 * 0.02);
    }
    assert!(mean[0].force.length() < 1e-10 * 2e3);
}

#[test]
fn a_prescribed_grain_moves_exactly_and_pushes_others() {
    let mut grains = [
        sphere(0.5, 1000.0, 500, DVec3::ZERO),
        sphere(0.5, 1000.0, 500, DVec3::new(1.01, 0.0, 0.0)),
    ];
    let omega = DVec3::new(0.3, -0.2, 0.9);
    grains[0].translation = MotionConstraint::Prescribed(DVec3::new(0.2, 0.0, 0.1));
    grains[0].rotation = MotionConstraint::Prescribed(omega);
    let start = grains[0].pose;
    let params = ContactParams { normal_stiffness: 1e6, restitution: 0.5, ..Default::default() };
    let mut dynamics = ContactDynamics::new(params, open_box(10.0));
    let mut pushed = Load::default();
    for _ in 0..100 {
        let mut mean = [Load::default(); 2];
        dynamics.advance(&mut grains, &[], 1e-2, &mut mean);
        pushed += mean[0];
    }
    assert!(
        (grains[0].pose.position - start.position - DVec3::new(0.2, 0.0, 0.1)).length() < 1e-13
    );
    let turned = DQuat::from_scaled_axis(omega) * start.orientation;
    assert!((grains[0].pose.orientation - turned).length() < 1e-12);
    assert_eq!(grains[0].velocity, DVec3::new(0.2, 0.0, 0.1));
    assert!(grains[1].velocity.x > 0.19, "{}", grains[1].velocity);
    assert!(pushed.force.x < 0.0, "the load on a prescribed grain is reported");
}

#[test]
fn a_step_without_any_partner_takes_one_sub_step() {
    let mut grains = [
        sphere(0.1, 1000.0, 100, DVec3::ZERO),
        sphere(0.1, 1000.0, 100, DVec3::new(1.0, 0.0, 0.0)),
    ];
    let mut dynamics = ContactDynamics::new(smooth(1e6), open_box(10.0));
    assert_eq!(step(&mut dynamics, &mut grains, DVec3::ZERO, 0.1), 1);
    grains[0].velocity.x = 7.0;
    // The grains travel 0.7 of the distance in this step; the bounding spheres keep a gap of 0.1.
    assert_eq!(step(&mut dynamics, &mut grains, DVec3::ZERO, 0.1), 1);
    assert!(step(&mut dynamics, &mut grains, DVec3::ZERO, 0.1) > 10);
    assert!(grains[1].velocity.x > 6.9, "{}", grains[1].velocity);
}

#[test]
fn bad_input_does_not_panic() {
    let shape = Arc::new(Shape::sphere(0.1, 50));
    let mut grains =
        [sphere(0.1, 1000.0, 100, DVec3::ZERO), sphere(0.1, 1000.0, 100, DVec3::splat(0.1))];
    grains[1].shape = shape;
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        for axes in [DVec3::X, DVec3::ONE] {
            let mut grains = grains.clone();
            grains[0].pose.position = axes * bad;
            grains[1].velocity = axes * bad;
            let mut dynamics = ContactDynamics::new(smooth(1e3), periodic(DVec3::ONE));
            let mut mean = [Load::default(); 1];
            for dt in [1e-3, 0.0, -1.0, f64::NAN] {
                dynamics.advance(&mut grains, &[], dt, &mut mean);
            }
        }
    }
    // Two grains at one position have no contact normal; 0/0 must not produce one.
    let mut same = [sphere(0.1, 1000.0, 100, DVec3::ZERO), sphere(0.1, 1000.0, 100, DVec3::ZERO)];
    step(&mut ContactDynamics::new(smooth(1e3), open_box(1.0)), &mut same, DVec3::ZERO, 1e-3);
    assert!(same.iter().all(|g| g.pose.position.is_finite() && g.velocity.is_finite()));
}
