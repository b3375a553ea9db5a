//! Friction: slip to roll (MFIX DEM04), oblique impact (DEM05, Kharaz), inclines.

use crate::clouds::step;
use crate::support::{floor, sphere};
use glam::DVec3;
use grainwake_solver::dem::{ContactDynamics, ContactParams, Grain, MotionConstraint, Side};

#[test]
fn dem04_slip_becomes_rolling_at_two_sevenths() {
    let (radius, g, v0) = (5e-4, 9.80665, 0.1);
    for friction in [0.2, 0.5, 1.0] {
        let mut grain = sphere(radius, 2000.0, 4000, DVec3::ZERO);
        // A stiff spring: the tangential spring is loaded when sliding ends and oscillates with a
        // speed mu g / w0.
        let k = 1e4;
        // At rest on the floor: the overlap carries the weight.
        grain.pose.position.z = radius - grain.mass() * g / k;
        grain.velocity.x = v0;
        let params = ContactParams {
            normal_stiffness: k,
            wall_friction: friction,
            tangential_ratio: 2.0 / 7.0,
            ..Default::default()
        };
        let mut grains = [grain];
        let mut dynamics = ContactDynamics::new(params, floor());
        let end = 2.0 / 7.0 * v0 / (friction * g);
        let dt = end / 400.0;
        let (mut rolling, mut time) = (None, 0.0);
        for _ in 0..600 {
            step(&mut dynamics, &mut grains, DVec3::new(0.0, 0.0, -g), dt);
            time += dt;
            // Tangential force below Coulomb's bound: no sliding.
            let slip = grains[0].velocity.x - grains[0].angular_velocity.y * radius;
            if rolling.is_none() && slip < 1e-3 * v0 {
                rolling = Some(time);
            }
        }
        let scaled = rolling.unwrap() * friction * g / v0;
        let (v, w) = (grains[0].velocity.x / v0, grains[0].angular_velocity.y * radius / v0);
        println!("DEM04: mu {friction}: time {scaled:.5}, v {v:.5}, omega {w:.5}");
        assert!((scaled - 2.0 / 7.0).abs() < 0.01 * 2.0 / 7.0, "{scaled}");
        assert!((v - 5.0 / 7.0).abs() < 0.005, "{v}");
        assert!((w - 5.0 / 7.0).abs() < 0.005, "{w}");
    }
}

/// Sphere that is put on the floor with a velocity, after 0.05 s: it slides, then rolls.
fn slid(velocity: DVec3, floor_side: Side) -> Grain {
    let (radius, k, g) = (5e-4, 1e4, 9.81);
    let mut grain = sphere(radius, 2000.0, 4000, DVec3::ZERO);
    grain.pose.position.z = radius - grain.mass() * g / k;
    grain.velocity = velocity;
    let params = ContactParams { normal_stiffness: k, wall_friction: 0.3, ..Default::default() };
    let mut enclosure = floor();
    enclosure.sides[2][0] = floor_side;
    let (mut grains, mut dynamics) = ([grain], ContactDynamics::new(params, enclosure));
    for _ in 0..500 {
        step(&mut dynamics, &mut grains, DVec3::new(0.0, 0.0, -g), 1e-4);
    }
    let [grain] = grains;
    grain
}

#[test]
fn a_moving_floor_carries_a_sphere_as_a_floor_at_rest_stops_it() {
    let belt = DVec3::new(0.06, -0.08, 0.0);
    let carried = slid(DVec3::ZERO, Side::Wall { velocity: belt });
    let stopped = slid(-belt, Side::WALL);
    // The same motion in two frames of reference: the sphere ends at 2/7 of the speed of the belt.
    assert!((carried.velocity - belt - stopped.velocity).length() < 1e-12);
    assert!((carried.angular_velocity - stopped.angular_velocity).length() < 1e-9);
    assert!((carried.velocity - 2.0 / 7.0 * belt).length() < 2e-4 * belt.length());
}

#[test]
fn a_sphere_slides_on_over_a_slip_wall() {
    let grain = slid(DVec3::new(0.1, 0.0, 0.0), Side::Frictionless);
    // The nodes of the sphere are not quite even.
    let spin = 5e-4 * grain.angular_velocity.length();
    assert!((grain.velocity.x - 0.1).abs() < 1e-12 && spin < 1e-7, "{} {spin}", grain.velocity);
}

/// Rebound of the sphere of Kharaz, Gorham & Salman: angle from the normal [deg], ratio of the
/// tangential velocities, spin [rad/s].
fn kharaz(angle: f64) -> (f64, f64, f64) {
    let (radius, speed) = (2.5e-3, 3.9);
    let params = ContactParams {
        normal_stiffness: 1.72e7,
        tangential_ratio: 1.48 / 1.72,
        wall_friction: 0.092,
        substeps_per_contact: 200.0,
        ..Default::default()
    };
    let (s, c) = angle.to_radians().sin_cos();
    let mut grain = sphere(radius, 4000.0, 10_000, DVec3::new(0.0, 0.0, radius * 1.0001));
    grain.velocity = speed * DVec3::new(s, 0.0, -c);
    let mut grains = [grain];
    let mut dynamics = ContactDynamics::new(params, floor());
    for _ in 0..100 {
        step(&mut dynamics, &mut grains, DVec3::ZERO, 5e-7);
    }
    assert!(dynamics.contacts().is_empty());
    let v = grains[0].velocity;
    (v.x.atan2(v.z).to_degrees(), v.x / (speed * s), grains[0].angular_velocity.length())
}

#[test]
fn dem05_oblique_impact_follows_the_linear_spring_curve() {
    // Rebound angle of the published linear-spring run with the same constants.
    let published = [
        (2.5, 2.12),
        (5.0, 4.01),
        (7.5, 5.49),
        (10.0, 6.63),
        (12.5, 7.81),
        (15.0, 9.13),
        (20.0, 12.24),
        (25.0, 16.19),
        (30.0, 21.48),
        (35.0, 27.30),
        (40.0, 33.23),
        (45.0, 39.21),
        (50.0, 45.22),
        (55.0, 51.21),
        (60.0, 57.14),
    ];
    let mut worst: f64 = 0.0;
    for (angle, expected) in published {
        let (rebound, _, _) = kharaz(angle);
        println!("DEM05: {angle} deg -> {rebound:.3} (published {expected})");
        worst = worst.max((rebound - expected).abs());
        assert!((rebound - expected).abs() < 2.0, "{angle}: {rebound}");
    }
    println!("DEM05: worst {worst:.3} deg");
    assert!(worst < 0.2, "{worst}");
}

#[test]
fn dem05_agrees_with_the_experiment_as_far_as_a_linear_spring_can() {
    let measured = [
        (2.2945, 1.763),
        (4.2922, 2.9577),
        (9.9429, 6.6917),
        (20.5594, 12.3645),
        (30.3767, 21.7809),
        (39.6233, 32.5455),
        (49.7831, 45.1051),
        (60.0571, 57.3652),
    ];
    for (angle, expected) in measured {
        let (rebound, _, _) = kharaz(angle);
        assert!((rebound - expected).abs() < 2.0, "{angle}: {rebound} v {expected}");
    }
    // Restitution of the tangential velocity, and spin, of an impact that slides throughout.
    for (angle, restitution, spin) in [(49.6, 0.8469, 452.9444), (59.9, 0.9019, 381.3185)] {
        let (_, e_t, omega) = kharaz(angle);
        println!(
            "{angle}: e_t {e_t:.4} (experiment {restitution}), omega {omega:.1} (experiment {spin})"
        );
        assert!((e_t - restitution).abs() < 0.02, "{angle}: {e_t}");
        assert!((omega / spin - 1.0).abs() < 0.2, "{angle}: {omega}");
    }
    for (angle, restitution) in
        [(9.6304, 0.6728), (20.0845, 0.5964), (30.2218, 0.6883), (39.3031, 0.7719)]
    {
        let (_, e_t, _) = kharaz(angle);
        println!("Kharaz {angle}: e_t {e_t:.4} (measured {restitution})");
        assert!((e_t - restitution).abs() < 0.03, "{angle}: {e_t}");
    }
}

#[test]
fn gross_sliding_takes_mu_one_plus_e_of_the_normal_velocity() {
    let (s, c) = 60f64.to_radians().sin_cos();
    let (_, e_t, omega) = kharaz(60.0);
    let lost = 3.9 * s * (1.0 - e_t);
    assert!((lost / (0.092 * 2.0 * 3.9 * c) - 1.0).abs() < 2e-3, "{lost}");
    assert!((omega / (2.5 * 0.092 * 2.0 * 3.9 * c / 2.5e-3) - 1.0).abs() < 5e-3, "{omega}");
}

/// Mean acceleration down a plane of 30 degrees; gravity is inclined instead of the plane.
fn slide(friction: f64, may_turn: bool) -> f64 {
    let (radius, g, k) = (0.01, 9.81, 1e4);
    let (s, c) = 30f64.to_radians().sin_cos();
    let mut grain = sphere(radius, 2500.0, 4000, DVec3::ZERO);
    grain.pose.position.z = radius - grain.mass() * g * c / k;
    if !may_turn {
        grain.rotation = MotionConstraint::Prescribed(DVec3::ZERO);
    }
    let params = ContactParams {
        normal_stiffness: k,
        wall_friction: friction,
        restitution: 0.8,
        ..Default::default()
    };
    let mut grains = [grain];
    let mut dynamics = ContactDynamics::new(params, floor());
    let gravity = g * DVec3::new(s, 0.0, -c);
    let mut at_half = 0.0;
    for i in 0..400 {
        step(&mut dynamics, &mut grains, gravity, 5e-4);
        if i == 199 {
            at_half = grains[0].velocity.x;
        }
    }
    (grains[0].velocity.x - at_half) / 0.1
}

#[test]
fn block_on_an_incline_slides_or_rests() {
    // A sphere that cannot rotate acts as a block with one contact point.
    let a = slide(0.3, false);
    assert!((a - 2.35629).abs() < 1e-3 * 2.35629, "{a}");
    let rest = slide(0.6, false);
    assert!(rest.abs() < 1e-3, "{rest}");
}

#[test]
fn sphere_rolls_down_an_incline_at_five_sevenths() {
    // The sphere rolls for mu above 2/7 tan(30 deg) = 0.16496, and slides below.
    for friction in [0.2, 0.5] {
        let a = slide(friction, true);
        println!("rolling, mu {friction}: {a:.5}");
        assert!((a - 3.50357).abs() < 5e-3 * 3.50357, "mu {friction}: {a}");
    }
    let a = slide(0.1, true);
    let (s, c) = 30f64.to_radians().sin_cos();
    assert!((a - 9.81 * (s - 0.1 * c)).abs() < 2e-3 * a, "sliding: {a}");
}

/// A grain whose translation is fixed takes up the spin of rolling on a moving wall.
#[test]
fn a_grain_on_a_fixed_axle_rolls_on_a_belt() {
    let (radius, speed) = (1e-3, 0.1);
    for dt in [1e-3_f64, 1e-5, 1e-6] {
        let mut grains = [sphere(radius, 2500.0, 2000, DVec3::Z * 0.995 * radius)];
        grains[0].translation = MotionConstraint::Prescribed(DVec3::ZERO);
        let mut belt = floor();
        belt.sides[2][0] = Side::Wall { velocity: DVec3::X * speed };
        let params =
            ContactParams { normal_stiffness: 500.0, restitution: 0.5, ..Default::default() };
        let mut dynamics = ContactDynamics::new(params, belt);
        for _ in 0..(0.01 / dt).round() as usize {
            step(&mut dynamics, &mut grains, DVec3::ZERO, dt);
        }
        let spin = grains[0].angular_velocity.y.abs() * radius / speed;
        assert!((spin - 1.0).abs() < 0.01, "dt {dt}: {spin}");
    }
}
