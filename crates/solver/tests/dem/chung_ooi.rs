//! Benchmark tests 1 to 8 of Chung & Ooi (2011) for the Hertz-Mindlin law: closed forms, and the
//! published curves as digitised in `data/chung_ooi_2011.csv`.
//!
//! A bound is the measured deviation, stated beside it, rounded up. The digitised points have an
//! error of about 0.01 of their axes.
//!
//! In the sliding regime all curves agree with closed forms. Where the contact sticks for most of
//! its duration, the result depends on the tangential force during unloading and on the tangential
//! dashpot. The published codes keep k_t times displacement; here the force falls with k_t, so that
//! no energy is created. Those points are left out, with their deviation stated.

use std::ops::Range;

use crate::support::{floor, open_box, sphere};
use glam::DVec3;
use grainwake_solver::dem::{
    ContactDynamics, ContactLawKind, ContactParams, Enclosure, Grain, Material,
};
use grainwake_solver::math::Load;

/// Material with the restitution 1.
fn material(youngs_modulus: f64, poisson_ratio: f64) -> Material {
    Material { youngs_modulus, poisson_ratio, restitution: 1.0 }
}

fn hertz_mindlin(friction: f64) -> ContactParams {
    ContactParams {
        law: ContactLawKind::HertzMindlin,
        friction,
        wall_friction: friction,
        substeps_per_contact: 400.0,
        ..Default::default()
    }
}

fn grain(radius: f64, density: f64, material: Material, position: DVec3) -> Grain {
    sphere(radius, density, 500, position).with_material(material)
}

/// Hertz impact between two bodies.
struct Hertz {
    overlap: f64,
    force: f64,
    duration: f64,
}

/// Closed form for reduced mass [kg], reduced radius [m], effective modulus [Pa] and speed [m/s].
fn hertz(mass: f64, radius: f64, modulus: f64, speed: f64) -> Hertz {
    let stiffness = 4.0 / 3.0 * modulus * radius.sqrt();
    let overlap = (1.25 * mass * speed * speed / stiffness).powf(0.4);
    Hertz { overlap, force: stiffness * overlap.powf(1.5), duration: 2.943_275 * overlap / speed }
}

/// Outcome of an impact.
struct Impact {
    grains: Vec<Grain>,
    /// Largest force [N], largest overlap [m], time in contact [s].
    largest: [f64; 3],
}

/// Advances an impact in 3000 steps over 1.5 times the duration [s] of its contact.
fn impact(
    mut grains: Vec<Grain>,
    params: ContactParams,
    enclosure: Enclosure,
    duration: f64,
) -> Impact {
    let mut dynamics = ContactDynamics::new(params, enclosure);
    let mut mean = vec![Load::default(); grains.len()];
    let (mut largest, dt) = ([0.0f64; 3], 1.5 * duration / 3000.0);
    for _ in 0..3000 {
        dynamics.advance(&mut grains, &[], dt, &mut mean);
        for contact in dynamics.contacts().iter().filter(|c| c.overlap > 0.0) {
            let force = contact.load.force.length();
            largest = [largest[0].max(force), largest[1].max(contact.overlap), largest[2] + dt];
        }
    }
    assert!(dynamics.contacts().is_empty(), "the grains have separated");
    Impact { grains, largest }
}

/// Impact of a sphere on a rigid plane at z = 0.
fn plane_impact(
    (radius, density, material): (f64, f64, Material),
    friction: f64,
    velocity: DVec3,
    spin: f64,
) -> Grain {
    let mut ball = grain(radius, density, material, DVec3::Z * radius);
    ball.velocity = velocity;
    ball.angular_velocity.y = spin;
    let modulus = material.youngs_modulus / (1.0 - material.poisson_ratio.powi(2));
    let duration = hertz(ball.mass(), radius, modulus, -velocity.z).duration;
    impact(vec![ball], hertz_mindlin(friction), floor(), duration).grains[0].clone()
}

/// Digitised points of one curve.
fn points(test: &str) -> Vec<(f64, f64)> {
    let rows = include_str!("../data/chung_ooi_2011.csv").lines();
    let points: Vec<_> = rows
        .filter_map(|row| row.strip_prefix(test)?.strip_prefix(','))
        .map(|row| row.split_once(',').unwrap())
        .map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()))
        .collect();
    assert!(points.len() > 10, "{test}");
    points
}

/// Prints the deviation from the digitised curve, and bounds it over `range`.
fn compare(test: &str, range: Range<f64>, bound: f64, mut value: impl FnMut(f64) -> f64) {
    let mut worst = 0.0f64;
    for (x, y) in points(test) {
        let found = value(x);
        if range.contains(&x) {
            worst = worst.max((found - y).abs());
        }
        println!("{test} {x:8.4}: {found:8.4}, published {y:8.4}");
    }
    println!("{test}: largest deviation {worst:.4}");
    assert!(worst < bound, "{test}: {worst} is not below {bound}");
}

#[test]
fn test_1_elastic_normal_impact_of_two_spheres() {
    for (modulus, ratio, density) in [(4.8e10, 0.2, 2800.0), (2.0e10, 0.25, 2500.0)] {
        let (radius, speed) = (0.01, 10.0);
        let material = material(modulus, ratio);
        let grains = [-1.0, 1.0].map(|side: f64| Grain {
            velocity: DVec3::X * -side * speed,
            ..grain(radius, density, material, DVec3::X * side * radius)
        });
        let effective = 0.5 * modulus / (1.0 - ratio * ratio);
        let expected = hertz(0.5 * grains[0].mass(), 0.5 * radius, effective, 2.0 * speed);
        let result = impact(grains.to_vec(), hertz_mindlin(0.35), open_box(0.1), expected.duration);
        // Measured, the larger of two materials: 2.3e-3, 9e-4, three steps in 2000, 2.3e-4. At an
        // overlap of 2.5 % of the radius, friction between the tilted normals adds to the force.
        check(&result, &expected, speed, [3e-3, 1.2e-3, 2.2e-3, 3e-4]);
    }
}

#[test]
fn test_2_elastic_normal_impact_on_a_rigid_plane() {
    for (modulus, ratio, density) in [(7.0e10, 0.3, 2699.0), (4.0e10, 0.35, 1800.0)] {
        let (radius, speed) = (0.1, 0.2);
        let ball = Grain {
            velocity: DVec3::Z * -speed,
            ..grain(radius, density, material(modulus, ratio), DVec3::Z * radius)
        };
        let expected = hertz(ball.mass(), radius, modulus / (1.0 - ratio * ratio), speed);
        let params = hertz_mindlin(0.0);
        let result = impact(vec![ball], params, floor(), expected.duration);
        // Measured: 2e-7, 2e-7, one step in 2000, 1e-11.
        check(&result, &expected, speed, [1e-6, 1e-6, 1e-3, 1e-9]);
    }
}

/// Bounds the relative errors of force, overlap, duration and rebound speed of an elastic impact.
fn check(result: &Impact, expected: &Hertz, speed: f64, bounds: [f64; 4]) {
    let closed_form = [expected.force, expected.overlap, expected.duration];
    let [force, overlap, duration] = [0, 1, 2].map(|n| result.largest[n] / closed_form[n] - 1.0);
    let rebound = result.grains[0].velocity.length() / speed - 1.0;
    let errors = [force, overlap, duration, rebound];
    println!("errors of force, overlap, duration and rebound: {errors:?}");
    for (error, bound) in errors.iter().zip(bounds) {
        assert!(error.abs() < bound, "{errors:?}");
    }
}

#[test]
fn test_3_normal_impact_with_restitution() {
    for (modulus, ratio, density) in [(3.8e11, 0.23, 4000.0), (1.0e11, 0.25, 7000.0)] {
        for restitution in [0.2, 0.4, 0.6, 0.8, 1.0] {
            let material = Material { restitution, ..material(modulus, ratio) };
            let velocity = DVec3::Z * -3.9;
            let ball = plane_impact((0.0025, density, material), 0.0, velocity, 0.0);
            let found = ball.velocity.z / 3.9;
            println!("restitution {restitution}: {found}");
            // Measured: 2e-5 or less.
            assert!((found - restitution).abs() < 5e-5, "{restitution}: {found}");
        }
    }
}

/// A step is longer than the contact, as in a run, which begins anywhere within a sub-step.
#[test]
fn restitution_with_the_default_substeps() {
    // The ball moves by 2.7 um in a sub-step.
    let (modulus, phases) =
        (1e7, [0.0, 0.34e-6, 0.68e-6, 1.02e-6, 1.36e-6, 1.7e-6, 2.04e-6, 2.38e-6]);
    let bounds = [(0.9, 0.002), (0.5, 0.007), (0.1, 0.007)];
    for ((restitution, bound), gap) in bounds.iter().flat_map(|of| phases.map(|gap| (*of, gap))) {
        let material = Material { restitution, ..material(modulus, 0.3) };
        let mut ball = grain(0.001, 2500.0, material, DVec3::Z * (0.001 + gap));
        ball.velocity.z = -0.3;
        let duration = hertz(ball.mass(), 0.001, modulus / (1.0 - 0.09), 0.3).duration;
        let substeps_per_contact = ContactParams::default().substeps_per_contact;
        let params = ContactParams { substeps_per_contact, ..hertz_mindlin(0.0) };
        let mut dynamics = ContactDynamics::new(params, floor());
        let mut grains = [ball];
        dynamics.advance(&mut grains, &[], 4.0 * duration, &mut [Load::default()]);
        assert!(dynamics.substeps() < 200, "{}", dynamics.substeps());
        let found = grains[0].velocity.z / 0.3;
        println!("restitution {restitution}: {found:.4}");
        assert!((found - restitution).abs() < bound, "{restitution}: {found}");
    }
}

#[test]
fn test_4_oblique_impact_at_constant_speed() {
    let oxide = (material(3.8e11, 0.23), 4000.0, "Test4_al_oxide");
    let alloy = (material(7.0e10, 0.33), 2700.0, "Test4_al_alloy");
    for (elastic, density, test) in [oxide, alloy] {
        let material = Material { restitution: 0.98, ..elastic };
        let mu: f64 = 0.092;
        // Measured: 0.024. At 5 degrees, which is left out, 0.09.
        compare(test, 9.0..90.0, 0.03, |angle| {
            let (sine, cosine) = angle.to_radians().sin_cos();
            let velocity = 3.9 * DVec3::new(sine, 0.0, -cosine);
            let ball = plane_impact((0.0025, density, material), mu, velocity, 0.0);
            let found = ball.velocity.x / velocity.x;
            // Sliding throughout (tan(angle) > 7/2 mu (1 + e)): impulse mu (1 + e) m v_n.
            let sliding = 1.0 - mu * 1.98 * cosine / sine;
            if sine / cosine > 7.0 * mu {
                assert!((found - sliding).abs() < 1e-3, "{angle}: {found} {sliding}");
            }
            found
        });
    }
}

#[test]
fn test_5_oblique_impact_at_constant_normal_speed() {
    let (radius, mu, speed) = (1e-5, 0.3, 5.0);
    let steel = (radius, 7850.0, material(2.08e11, 0.3));
    // Measured: 0.032. The published points at x < 5, up to 1.5 away, correspond to about half of
    // Mindlin's tangential stiffness. The last one is 0.053 off the exact result of sliding.
    compare("Test5_steel", 5.5..12.0, 0.035, |x| {
        let velocity = DVec3::new(x * mu * speed, 0.0, -speed);
        let ball = plane_impact(steel, mu, velocity, 0.0);
        let found = (ball.velocity.x - radius * ball.angular_velocity.y) / (mu * speed);
        // Sliding throughout: impulse 2 mu m v_n.
        if x > 6.5 {
            assert!((found - (x - 7.0)).abs() < 1e-4, "{x}: {found}");
        }
        let energy = |velocity: DVec3| 0.5 * ball.mass() * velocity.length_squared();
        // Undamped springs and friction create no energy.
        assert!(ball.kinetic_energy() < energy(velocity) * (1.0 + 1e-5), "{x}");
        found
    });
}

/// Spin [rad/s] and density of tests 6 to 8 for an abscissa 3.5 mu (1 + e) v_n / (R omega).
const RADIUS: f64 = 0.1;
const SPEED: f64 = 0.2;
const FRICTION: f64 = 0.4;
const ALLOY_DENSITY: f64 = 2700.0;

fn alloy() -> Material {
    Material { restitution: 0.5, ..material(7.0e10, 0.33) }
}

fn surface_speed(x: f64) -> f64 {
    3.5 * FRICTION * 1.5 * SPEED / x
}

#[test]
fn test_6_spinning_sphere_on_a_rigid_plane() {
    // Measured: 0.016. The points at x > 2.2, where the contact sticks, deviate by up to 0.33.
    compare("Test6_al_alloy", 0.0..2.2, 0.02, |x| {
        let (surface, velocity) = (surface_speed(x), DVec3::Z * -SPEED);
        let ball = (RADIUS, ALLOY_DENSITY, alloy());
        let ball = plane_impact(ball, FRICTION, velocity, -surface / RADIUS);
        let found = -(ball.velocity.x - RADIUS * ball.angular_velocity.y) / surface;
        if x < 0.9 {
            assert!((found - (x - 1.0)).abs() < 2e-3, "sliding: {found} at {x}");
        }
        found
    });
}

/// Impact of two spheres along x; returns them after it.
fn spinning_impact(grains: [Grain; 2]) -> Vec<Grain> {
    let inverse: f64 = grains.iter().map(|g| 1.0 / g.mass()).sum();
    let radii = [0, 1].map(|n| grains[n].shape.bounding_radius());
    let radius = radii[0] * radii[1] / (radii[0] + radii[1]);
    let modulus = 0.5 * 7.0e10 / (1.0 - 0.33 * 0.33);
    let speed = grains[0].velocity.x - grains[1].velocity.x;
    let duration = hertz(1.0 / inverse, radius, modulus, speed).duration;
    impact(grains.to_vec(), hertz_mindlin(FRICTION), open_box(10.0), 1.3 * duration).grains
}

#[test]
fn test_7_two_spheres_with_opposite_spins() {
    for spin in [0.175, 2.0, 22.86] {
        let grains = spinning_impact([-1.0, 1.0].map(|side: f64| Grain {
            velocity: DVec3::X * -side * SPEED,
            angular_velocity: DVec3::Y * -side * spin,
            ..grain(RADIUS, ALLOY_DENSITY, alloy(), DVec3::X * side * RADIUS)
        }));
        // The surfaces move alike at the contact, so no tangential force acts.
        let [a, b] = [&grains[0], &grains[1]];
        // Measured: 1e-4 or less of the spin, and of the surface speed.
        assert!((a.angular_velocity.y / spin - 1.0).abs() < 1e-3);
        assert!((b.angular_velocity.y / spin + 1.0).abs() < 1e-3);
        assert!(a.velocity.z.abs() < 1e-3 * spin * RADIUS, "{}", a.velocity.z);
    }
}

#[test]
fn test_8_two_spheres_of_different_size() {
    let run = |x: f64, other_density: f64| {
        let surface = surface_speed(x);
        let mut small = grain(RADIUS, ALLOY_DENSITY, alloy(), DVec3::X * -RADIUS);
        small.velocity.x = SPEED;
        small.angular_velocity.y = -surface / RADIUS;
        let centre = DVec3::X * 5.0 * RADIUS;
        let large = grain(5.0 * RADIUS, other_density, alloy(), centre);
        let after = spinning_impact([small, large]);
        // Velocity of the first surface relative to the second, at the contact.
        let at = |g: &Grain, side: f64, radius: f64| {
            (g.velocity + g.angular_velocity.cross(DVec3::X * side * radius)).z
        };
        let relative = at(&after[0], 1.0, RADIUS) - at(&after[1], -1.0, 5.0 * RADIUS);
        -relative / surface
    };
    // A large sphere of very high density acts as a plane.
    // Measured: 0.016.
    compare("Test8_case_a", 0.0..2.2, 0.02, |x| run(x, 1e6 * ALLOY_DENSITY));
    // While the contact slides throughout, masses and radii have no effect.
    for x in [0.2, 0.5, 0.85] {
        let found = run(x, ALLOY_DENSITY);
        assert!((found - (x - 1.0)).abs() < 3e-3, "sliding: {found} at {x}");
    }
}
