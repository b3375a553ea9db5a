//! Contact of grains other than spheres: Newton's third law, momentum, blocks on a plane, nodes.

use std::sync::{Arc, LazyLock};

use crate::clouds::{Random, step};
use crate::support::{floor, kinetic, open_box, smooth};
use glam::{DQuat, DVec3};
use grainwake_shape::mesh::{MeshOptions, TriangleMesh, shape_from_mesh};
use grainwake_shape::{Shape, ShapeOptions, SourceFile, analytic};
use grainwake_solver::dem::{
    ContactDynamics, ContactParams, Enclosure, Grain, MotionConstraint, surface_gap,
};
use grainwake_solver::math::Load;

/// A rounded box of 40 x 30 x 20 mm with edges rounded to 4 mm.
static BLOCK: LazyLock<Arc<Shape>> = LazyLock::new(|| {
    Arc::new(analytic::rounded_box(0.04, 0.03, 0.02, 0.004, &ShapeOptions::default()).unwrap())
});

/// A pebble with bumps and hollows, about 30 mm across.
static PEBBLE: LazyLock<Arc<Shape>> = LazyLock::new(|| {
    let radius = |d: DVec3| {
        0.015
            * (1.0 + 0.18 * (2.1 * d.x + 0.7).sin() * d.y + 0.12 * (4.0 * d.z + d.x).cos()
                - 0.15 * d.z * d.z)
    };
    let (rows, columns) = (60usize, 120usize);
    let mut vertices = vec![DVec3::Z * radius(DVec3::Z)];
    for i in 1..rows {
        for j in 0..columns {
            let (st, ct) = (std::f64::consts::PI * i as f64 / rows as f64).sin_cos();
            let (sp, cp) = (std::f64::consts::TAU * j as f64 / columns as f64).sin_cos();
            let d = DVec3::new(st * cp, st * sp, ct);
            vertices.push(d * radius(d));
        }
    }
    vertices.push(-DVec3::Z * radius(-DVec3::Z));
    let at = |i: usize, j: usize| (1 + (i - 1) * columns + j % columns) as u32;
    let last = vertices.len() as u32 - 1;
    let mut triangles = Vec::new();
    for j in 0..columns {
        triangles.push([0, at(1, j), at(1, j + 1)]);
        triangles.push([last, at(rows - 1, j + 1), at(rows - 1, j)]);
        for i in 1..rows - 1 {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    let mesh = TriangleMesh { vertices, triangles };
    Arc::new(shape_from_mesh(&mesh, &SourceFile::default(), &MeshOptions::default()).unwrap())
});

fn grain(shape: &Arc<Shape>, position: DVec3, orientation: DQuat) -> Grain {
    Grain::new(shape.clone(), 2500.0).with_position(position).with_orientation(orientation)
}

/// Moves `b` towards `a` until the surfaces overlap by `depth` [m].
fn press(a: &Grain, b: &mut Grain, depth: f64) {
    let direction = (b.pose.position - a.pose.position).normalize();
    for _ in 0..6 {
        let gap = surface_gap(a, b, &open_box(1.0));
        b.pose.position -= direction * (gap + depth);
    }
}

#[test]
fn third_law_holds_to_round_off_for_two_irregular_grains() {
    let mut random = Random(3);
    let params = ContactParams { normal_stiffness: 1e4, restitution: 0.8, ..Default::default() };
    for _ in 0..10 {
        let turn = |random: &mut Random| DQuat::from_scaled_axis(random.vector() * 3.0);
        let a = grain(&PEBBLE, DVec3::new(0.01, 0.02, 0.03), turn(&mut random));
        let mut b =
            grain(&BLOCK, a.pose.position + random.vector().normalize() * 0.05, turn(&mut random));
        press(&a, &mut b, 2e-4);
        let mut grains = [a, b];
        for grain in &mut grains {
            grain.velocity = random.vector() * 0.1;
            grain.angular_velocity = random.vector() * 5.0;
        }
        let mut dynamics = ContactDynamics::new(params, open_box(1.0));
        let mut mean = [Load::default(); 2];
        dynamics.advance(&mut grains, &[], 1e-15, &mut mean);
        assert_eq!(dynamics.contacts().len(), 1);
        let scale = mean[0].force.length();
        assert!(scale > 0.1, "{scale}");
        assert!((mean[0].force + mean[1].force).length() <= 1e-15 * scale);
        let about = |i: usize| mean[i].torque + grains[i].pose.position.cross(mean[i].force);
        assert!((about(0) + about(1)).length() <= 1e-14 * scale * 0.1, "{}", about(0) + about(1));
    }
}

#[test]
fn colliding_irregular_grains_keep_momentum_and_angular_momentum() {
    let mut random = Random(17);
    let params = ContactParams { normal_stiffness: 2e4, restitution: 0.8, ..Default::default() };
    let mut grains: Vec<Grain> = (0..8)
        .map(|i| {
            let corner =
                DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) - 0.5;
            let shape = if i % 3 == 0 { &BLOCK } else { &PEBBLE };
            let mut g =
                grain(shape, corner * 0.055, DQuat::from_scaled_axis(random.vector() * 3.0));
            g.velocity = -corner * 1.0 + random.vector() * 0.1;
            g.angular_velocity = random.vector() * 10.0;
            g
        })
        .collect();
    let sums = |grains: &[Grain]| {
        grains.iter().fold((DVec3::ZERO, DVec3::ZERO), |(p, l), g| {
            (p + g.momentum(), l + g.angular_momentum(DVec3::ZERO))
        })
    };
    let (p0, l0) = sums(&grains);
    let scale: f64 = grains.iter().map(|g| g.momentum().length()).sum();
    let spins: f64 = grains.iter().map(|g| g.angular_momentum(DVec3::ZERO).length()).sum();
    let mut dynamics = ContactDynamics::new(params, open_box(1.0));
    let mut met = 0;
    for _ in 0..200 {
        step(&mut dynamics, &mut grains, DVec3::ZERO, 2e-4);
        met += dynamics.contacts().len();
    }
    let (p, l) = sums(&grains);
    println!(
        "irregular: {met} contacts, p {:.1e}, L {:.1e}",
        (p - p0).length() / scale,
        (l - l0).length() / spins
    );
    assert!(met > 50, "{met}");
    assert!((p - p0).length() <= 1e-14 * scale);
    // The rotation scheme conserves L of a tumbling body to second order in the step, not to
    // round-off.
    assert!((l - l0).length() <= 1e-5 * spins, "{}", (l - l0).length() / spins);
}

#[test]
fn stiffness_of_an_irregular_pair_does_not_depend_on_its_nodes() {
    let block = |nodes| {
        let options = ShapeOptions { nodes: Some(nodes), ..Default::default() };
        Arc::new(analytic::rounded_box(0.04, 0.03, 0.02, 0.004, &options).unwrap())
    };
    let turn = DQuat::from_scaled_axis(DVec3::new(0.5, 0.3, -0.2));
    let force = |nodes: usize, depth: f64| {
        let shape = block(nodes);
        let a = grain(&shape, DVec3::ZERO, turn);
        let mut b = grain(&shape, DVec3::new(0.02, 0.01, 0.05), turn.inverse());
        press(&a, &mut b, depth);
        let mut grains = [a, b];
        for grain in &mut grains {
            grain.translation = MotionConstraint::Prescribed(DVec3::ZERO);
            grain.rotation = MotionConstraint::Prescribed(DVec3::ZERO);
        }
        let mut dynamics = ContactDynamics::new(smooth(1e4), open_box(1.0));
        let mut mean = [Load::default(); 2];
        dynamics.advance(&mut grains, &[], 1e-6, &mut mean);
        mean[0].force
    };
    // The effective overlap of a patch of many points is at most the deepest, so the force is a
    // little below k delta. It varies with the places of the points that happen to touch.
    for depth in [2e-4, 1e-3] {
        let reference = force(4000, depth);
        for nodes in [1000, 2000] {
            let f = force(nodes, depth);
            let of_spring = f.length() / (1e4 * depth);
            let off = (f - reference).length() / reference.length();
            println!("{nodes} nodes, {depth}: {of_spring:.4} of k delta, {off:.2e} off");
            assert!((0.74..0.9).contains(&of_spring), "{nodes} {depth}: {of_spring}");
            assert!(off < 0.18, "{nodes} {depth}: {off}");
        }
    }
}

/// A block flat on a plane of 30 degrees (gravity is turned instead): its state after `time` [s].
fn block_on_incline(friction: f64, time: f64) -> (Grain, f64) {
    let (s, c) = 30f64.to_radians().sin_cos();
    let (g, k) = (9.81, 2e4);
    let params = ContactParams {
        normal_stiffness: k,
        wall_friction: friction,
        restitution: 0.2,
        ..Default::default()
    };
    let mut block = grain(&BLOCK, DVec3::ZERO, DQuat::IDENTITY);
    block.pose.position.z = 0.01 - block.mass() * g * c / k;
    let mut grains = [block];
    let mut dynamics = ContactDynamics::new(params, floor());
    let gravity = g * DVec3::new(s, 0.0, -c);
    let (dt, mut half) = (5e-4, 0.0);
    let steps = (time / dt) as usize;
    for i in 0..steps {
        if i == steps / 2 {
            half = grains[0].velocity.x;
        }
        step(&mut dynamics, &mut grains, gravity, dt);
    }
    let acceleration = (grains[0].velocity.x - half) / (dt * (steps - steps / 2) as f64);
    let [block] = grains;
    (block, acceleration)
}

#[test]
fn a_block_on_an_incline_slides_at_the_coulomb_rate_or_rests() {
    let (block, acceleration) = block_on_incline(0.3, 0.2);
    println!("block, mu .3: a {acceleration:.5} (2.35629), omega {}", block.angular_velocity);
    assert!((acceleration / 2.35629 - 1.0).abs() < 1e-3, "{acceleration}");
    let up = block.pose.orientation * DVec3::Z;
    assert!(
        up.z > 0.9999 && block.angular_velocity.length() < 0.02,
        "{up} {}",
        block.angular_velocity
    );
    let (block, acceleration) = block_on_incline(0.7, 0.2);
    println!("block, mu .7: a {acceleration:.1e}, v {:.1e}", block.velocity.length());
    assert!(block.velocity.length() < 1e-4, "{}", block.velocity);
    assert!(block.pose.position.x < 1e-3, "{}", block.pose.position);
}

#[test]
fn a_dropped_block_comes_to_rest_on_a_face() {
    let params = ContactParams { normal_stiffness: 2e4, restitution: 0.5, ..Default::default() };
    let mut grains = [grain(
        &BLOCK,
        DVec3::new(0.0, 0.0, 0.035),
        DQuat::from_scaled_axis(DVec3::new(0.5, 0.4, 0.3)),
    )];
    let mut dynamics = ContactDynamics::new(params, floor());
    for _ in 0..1600 {
        step(&mut dynamics, &mut grains, DVec3::new(0.0, 0.0, -9.81), 5e-4);
    }
    let up = grains[0].pose.orientation.conjugate() * DVec3::Z;
    println!(
        "block at rest: up {up}, v {:.1e}, omega {:.1e}",
        grains[0].velocity.length(),
        grains[0].angular_velocity.length()
    );
    assert!(up.abs().max_element() > 0.9999, "{up}");
    assert!(grains[0].velocity.length() < 1e-5);
    assert!(grains[0].angular_velocity.length() < 0.01);
}

/// State of a rounded box of `size` [mm], laid on the floor from a height of 0.05 mm, after 0.1 s
/// under `gravity` in steps of `dt` [s].
fn box_laid_on_the_floor(size: [f64; 3], params: ContactParams, gravity: DVec3, dt: f64) -> Grain {
    let [x, y, z] = size.map(|edge| 1e-3 * edge);
    let shape = analytic::rounded_box(x, y, z, 0.3e-3, &ShapeOptions::default()).unwrap();
    let mut grains = [grain(&Arc::new(shape), DVec3::Z * (0.5 * z + 0.05e-3), DQuat::IDENTITY)];
    let mut dynamics = ContactDynamics::new(params, floor());
    for _ in 0..(0.1 / dt).round() as usize {
        step(&mut dynamics, &mut grains, gravity, dt);
    }
    let [block] = grains;
    block
}

#[test]
fn a_plate_with_little_restitution_gains_no_energy_at_its_corners() {
    // The mass at a corner of a plate is a fraction of its whole mass. A dashpot chosen for the
    // whole mass is unstable there: the plate would rise by millimetres.
    let params =
        ContactParams { normal_stiffness: 2e4, restitution: 0.05, ..ContactParams::default() };
    // Many sub-steps in a step, and a step of about one.
    for (substeps_per_contact, dt) in [(25.0, 5e-4), (12.0, 1.6e-5)] {
        let params = ContactParams { substeps_per_contact, ..params };
        let plate = box_laid_on_the_floor([8.0, 5.0, 1.0], params, DVec3::Z * -9.81, dt);
        println!("plate: v {:.1e}, omega {}", plate.velocity.length(), plate.angular_velocity);
        assert!(plate.velocity.length() < 1e-9, "{}", plate.velocity);
        assert!((plate.pose.position.z - 0.5e-3).abs() < 0.01e-3, "{}", plate.pose.position);
    }
}

#[test]
fn a_flat_box_rests_on_a_slope_below_the_friction_angle() {
    // Slope 20 degrees, friction angle 26.6 degrees. With normal forces that are no gradient of an
    // energy the box creeps at 2 to 6 mm/s (results/flat-grains).
    let (s, c) = 20f64.to_radians().sin_cos();
    let params = ContactParams {
        normal_stiffness: 28_840.0,
        restitution: 0.2,
        wall_friction: 0.5,
        ..ContactParams::default()
    };
    let gravity = 9.81 * DVec3::new(s, 0.0, -c);
    let block = box_laid_on_the_floor([6.0, 5.0, 2.0], params, gravity, 5e-4);
    println!("box on a slope: v {}, x {:.1e}", block.velocity, block.pose.position.x);
    assert!(block.velocity.length() < 1e-9, "{}", block.velocity);
    assert!(block.pose.position.x < 0.1e-3, "{}", block.pose.position);
}

/// A scanned rock of 0.5 mm, thrown onto a floor with a stiffness that keeps overlaps far below the
/// roughness of its surface.
fn thrown_rock(params: ContactParams, seed: u64) -> (ContactDynamics, [Grain; 1]) {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../cases/grains/tsquare_rock.grain");
    let rock = Shape::load(path.as_ref()).unwrap();
    let rock = Arc::new(rock.scaled_to_equivalent_diameter(0.5e-3).unwrap());
    let turn = DQuat::from_scaled_axis(Random(seed).vector() * 3.0);
    let params = ContactParams { normal_stiffness: 1880.0, ..params };
    let rock = grain(&rock, DVec3::new(0.0, 0.0, 0.6e-3), turn);
    (ContactDynamics::new(params, floor()), [rock])
}

#[test]
fn dropped_rocks_come_to_rest() {
    // A search for the deepest point that misses more than the overlap at rest keeps them moving.
    // Now and then a rock rocks for long from one foot to another.
    let mut at_rest = 0;
    for seed in 1..=6 {
        let params = ContactParams { restitution: 0.5, friction: 0.4, ..Default::default() };
        let (mut dynamics, mut rock) = thrown_rock(params, seed);
        let mut fastest = 0.0_f64;
        for n in 0..3000 {
            step(&mut dynamics, &mut rock, DVec3::new(0.0, 0.0, -9.81), 1e-4);
            if n >= 2500 {
                fastest = fastest.max(rock[0].velocity.length());
            }
        }
        println!("rock {seed}: up to {fastest:.1e} m/s");
        at_rest += i32::from(fastest < 1e-8);
    }
    assert!(at_rest >= 5, "{at_rest}");
}

#[test]
fn an_undamped_rock_keeps_its_energy_over_many_bounces() {
    let gravity = DVec3::new(0.0, 0.0, -9.81);
    let mut sum = 0.0;
    for seed in 1..=4 {
        let (mut dynamics, mut rock) = thrown_rock(smooth(0.0), seed);
        let energy =
            |rock: &[Grain; 1]| kinetic(rock) - rock[0].mass() * gravity.dot(rock[0].pose.position);
        let start = energy(&rock);
        let (mut bounces, mut touched) = (0, false);
        let mut errors: Vec<f64> = Vec::new();
        for _ in 0..2000 {
            step(&mut dynamics, &mut rock, gravity, 1e-4);
            let touches = !dynamics.contacts().is_empty();
            bounces += i32::from(touched && !touches);
            touched = touches;
            if !touches {
                errors.push(energy(&rock) / start - 1.0);
            }
        }
        let most = errors.iter().map(|error| error.abs()).fold(0.0, f64::max);
        println!("rock {seed}: {bounces} bounces, energy within {most:.3}");
        assert!(bounces > 10 && most < 0.02, "{bounces} {most}");
        sum += most;
    }
    // 0.1 with a force that is shared in proportion to the overlaps.
    assert!(sum / 4.0 < 0.01, "{sum}");
}

#[test]
fn a_spinning_top_on_its_face_is_stopped_by_the_friction_of_its_whole_face() {
    // Only contact points off the axis brake the spin: mu m g times a lever arm of some
    // millimetres.
    let params = ContactParams { normal_stiffness: 2e4, restitution: 0.5, ..Default::default() };
    let mut block = grain(&BLOCK, DVec3::ZERO, DQuat::IDENTITY);
    block.pose.position.z = 0.01 - block.mass() * 9.81 / 2e4;
    block.angular_velocity.z = 10.0;
    let mut grains = [block];
    let mut dynamics = ContactDynamics::new(params, floor());
    let mut brakes: Vec<f64> = Vec::new();
    for _ in 0..25 {
        let before = grains[0].angular_velocity.z;
        step(&mut dynamics, &mut grains, DVec3::new(0.0, 0.0, -9.81), 1e-3);
        brakes.push((before - grains[0].angular_velocity.z) / 1e-3);
    }
    // Uniform pressure on the flat face of 32 x 22 mm: mean distance from its centre 10.4 mm.
    let inertia = grains[0].principal_inertia().z;
    let expected = 0.5 * grains[0].mass() * 9.81 * 0.0104 / inertia;
    let mean = brakes[5..].iter().sum::<f64>() / 20.0;
    println!("spin brake {mean:.1} rad/s^2, uniform pressure {expected:.1}");
    assert!((mean / expected - 1.0).abs() < 0.15, "{mean} v {expected}");
}

#[test]
fn elastic_irregular_bounces_keep_their_energy() {
    // Not to round-off: the sub-steps cross kinks of the sampled surface.
    let mut random = Random(23);
    let params = ContactParams { substeps_per_contact: 50.0, ..smooth(2e5) };
    let (mut sum, mut square, count) = (0.0, 0.0, 16);
    for _ in 0..count {
        let mut grains = [grain(
            &PEBBLE,
            DVec3::new(0.0, 0.0, 0.03),
            DQuat::from_scaled_axis(random.vector() * 3.0),
        )];
        grains[0].velocity.z = -0.3;
        let start = kinetic(&grains);
        let mut dynamics = ContactDynamics::new(params, floor());
        let mut touched = false;
        for _ in 0..400 {
            step(&mut dynamics, &mut grains, DVec3::ZERO, 5e-4);
            touched |= !dynamics.contacts().is_empty();
            if touched && dynamics.contacts().is_empty() && grains[0].velocity.z > 0.0 {
                break;
            }
        }
        assert!(touched);
        let error = kinetic(&grains) / start - 1.0;
        sum += error;
        square += error * error;
    }
    let (mean, rms) = (sum / f64::from(count), (square / f64::from(count)).sqrt());
    println!("elastic bounces of a pebble: energy mean {mean:.1e}, rms {rms:.1e}");
    assert!(mean.abs() < 1e-3 && rms < 2e-3, "{mean} {rms}");
}

#[test]
fn irregular_contact_across_a_periodic_face_is_the_same() {
    let run = |offset: f64| {
        let enclosure = Enclosure {
            lower: DVec3::ZERO,
            upper: DVec3::splat(0.2),
            periodic: [true; 3],
            sides: Default::default(),
        };
        let turn = DQuat::from_scaled_axis(DVec3::new(0.4, -0.2, 0.9));
        let mut grains = [
            grain(&PEBBLE, DVec3::new(0.08 + offset, 0.1, 0.1), turn),
            grain(&BLOCK, DVec3::new(0.12 + offset, 0.11, 0.1), turn.inverse()),
        ];
        grains[0].velocity.x = 0.5;
        let mut dynamics = ContactDynamics::new(
            ContactParams { normal_stiffness: 2e4, ..Default::default() },
            enclosure,
        );
        for _ in 0..100 {
            for grain in &mut grains {
                grain.pose.position = enclosure.wrap(grain.pose.position);
            }
            step(&mut dynamics, &mut grains, DVec3::ZERO, 5e-4);
        }
        grains.map(|g| (g.velocity, g.angular_velocity))
    };
    let (inside, across) = (run(0.0), run(0.1));
    assert!(inside[1].0.length() > 0.05, "they met");
    for (a, b) in inside.iter().zip(&across) {
        assert!((a.0 - b.0).length() < 1e-6 && (a.1 - b.1).length() < 1e-4, "{a:?} {b:?}");
    }
}

#[test]
fn pairs_that_are_not_looked_at_do_not_miss_a_contact() {
    // One long step skips pairs with a known separation and tests candidate nodes alone; a
    // hundred short steps search without this information.
    let turn = DQuat::from_scaled_axis(DVec3::new(0.4, -0.2, 0.9));
    let start = {
        let mut a = grain(&PEBBLE, DVec3::ZERO, turn);
        let mut b = grain(&BLOCK, DVec3::new(0.05, 0.01, 0.0), turn.inverse());
        a.velocity.x = 2.0;
        a.angular_velocity = DVec3::new(5.0, -20.0, 10.0);
        b.angular_velocity.y = 30.0;
        [a, b]
    };
    let mass = 1.0 / start.iter().map(|g| 1.0 / g.mass()).sum::<f64>();
    let mut params = ContactParams { normal_stiffness: 1e5, friction: 0.3, ..Default::default() };
    // A hundredth of the step is one sub-step.
    let contact_time = std::f64::consts::PI * (mass / params.normal_stiffness).sqrt();
    params.substeps_per_contact = 100.0 * contact_time / 1e-2 * 0.9999;
    let run = |steps: u32| {
        let mut grains = start.clone();
        let mut dynamics = ContactDynamics::new(params, open_box(1.0));
        for _ in 0..2 * steps {
            step(&mut dynamics, &mut grains, DVec3::ZERO, 1e-2 / f64::from(steps));
        }
        grains.map(|g| (g.velocity, g.angular_velocity))
    };
    let (long, short) = (run(1), run(100));
    assert!(long[1].0.length() > 0.1, "they met: {}", long[1].0);
    for (a, b) in long.iter().zip(&short) {
        assert!((a.0 - b.0).length() < 1e-9 && (a.1 - b.1).length() < 1e-6, "{a:?} {b:?}");
    }
}

/// Without friction nothing turns a sphere that rolls over a flat face: the force acts in the line
/// through its centre.
#[test]
fn a_sphere_keeps_its_spin_on_a_frictionless_face() {
    let options = ShapeOptions { nodes: Some(2000), ..ShapeOptions::default() };
    let plate = analytic::rounded_box(30.0, 6.0, 2.0, 0.5, &options).unwrap();
    let mut plate = Grain::new(plate, 1.0).with_position(DVec3::new(0.0, 0.0, -1.0));
    plate.translation = MotionConstraint::Prescribed(DVec3::ZERO);
    plate.rotation = MotionConstraint::Prescribed(DVec3::ZERO);
    let mut ball = Grain::new(Shape::sphere(1.0, 600), 1.0);
    // The overlap carries the weight.
    let stiffness = 1e4;
    ball.pose.position = DVec3::new(-5.0, 0.1, 1.0 - ball.mass() / stiffness);
    ball.velocity.x = 0.2;
    ball.angular_velocity.y = 0.2;
    let params = smooth(stiffness);
    let mut dynamics = ContactDynamics::new(params, open_box(20.0));
    let mut grains = [plate, ball];
    for _ in 0..500 {
        step(&mut dynamics, &mut grains, DVec3::NEG_Z, 0.02);
    }
    let Grain { velocity, angular_velocity, pose, .. } = &grains[1];
    println!("{} {velocity} {angular_velocity}", pose.position);
    assert!((velocity - DVec3::new(0.2, 0.0, 0.0)).length() < 1e-6, "{velocity}");
    assert!((angular_velocity - DVec3::new(0.0, 0.2, 0.0)).length() < 1e-7, "{angular_velocity}");
}

/// Largest relative change of the energy in 20 collisions of `a`, which flies along x, with `b`,
/// without friction and damping.
fn largest_change_of_energy(a: &Arc<Shape>, b: &Arc<Shape>) -> f64 {
    let mut random = Random(7);
    let mut worst = 0.0_f64;
    let [radius, other] = [a, b].map(|shape| 0.5 * shape.equivalent_diameter());
    for stiffness in [20.0, 2000.0] {
        for _ in 0..10 {
            let turn = |random: &mut Random| DQuat::from_scaled_axis(random.vector() * 3.0);
            let start = DVec3::splat(0.02);
            let apart = DVec3::new(1.6 * (radius + other), 0.2 * (radius + other), 0.0);
            let mut grains =
                [grain(a, start, turn(&mut random)), grain(b, start + apart, turn(&mut random))];
            grains[0].velocity.x = 0.1;
            grains[0].angular_velocity = random.vector() * 0.012 / radius;
            let start = kinetic(&grains);
            let mut dynamics = ContactDynamics::new(smooth(stiffness), open_box(0.04));
            let mut touched = false;
            for _ in 0..400 {
                step(&mut dynamics, &mut grains, DVec3::ZERO, 0.2 * (radius + other));
                touched |= !dynamics.contacts().is_empty();
                if touched && dynamics.contacts().is_empty() {
                    break;
                }
            }
            assert!(touched && dynamics.contacts().is_empty());
            worst = worst.max((kinetic(&grains) / start - 1.0).abs());
        }
    }
    worst
}

#[test]
fn a_collision_of_any_two_shapes_keeps_the_energy() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../cases/grains/tsquare_rock.grain");
    let rock = Shape::load(path.as_ref()).unwrap();
    let rock = |diameter| Arc::new(rock.scaled_to_equivalent_diameter(diameter).unwrap());
    let sphere = Arc::new(Shape::sphere(0.25e-3, 2000));
    for (name, a, b, bound) in [
        ("rock and rock", rock(0.5e-3), rock(0.5e-3), 0.008),
        ("rock and rock of 20 times its size", rock(0.1e-3), rock(2e-3), 0.005),
        // The deepest point of a sphere on a rough surface is searched.
        ("sphere and rock", sphere.clone(), rock(0.5e-3), 0.045),
        ("sphere and rock of 20 times its size", sphere, rock(10e-3), 0.025),
    ] {
        let change = largest_change_of_energy(&a, &b);
        println!("{name}: energy {change:.1e}");
        assert!(change < bound, "{name}: {change}");
    }
}

/// A prolate ellipsoid rolls about its long axis like a sphere: 5/7 g sin a.
#[test]
fn an_ellipsoid_rolls_down_a_slight_slope() {
    let options = ShapeOptions::default();
    let shape = Arc::new(analytic::ellipsoid(2e-3, 1e-3, 1e-3, &options).unwrap());
    let params = ContactParams {
        normal_stiffness: 1e4,
        restitution: 0.5,
        wall_friction: 0.5,
        ..ContactParams::default()
    };
    for degrees in [0.5_f64, 2.0, 10.0] {
        let (s, c) = degrees.to_radians().sin_cos();
        // The long axis along y.
        let turn = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let mut grains = [grain(&shape, DVec3::Z * 1.001e-3, turn)];
        let mut dynamics = ContactDynamics::new(params, floor());
        for _ in 0..600 {
            step(&mut dynamics, &mut grains, 9.81 * DVec3::new(s, 0.0, -c), 5e-4);
        }
        let ratio = grains[0].velocity.x / (5.0 / 7.0 * 9.81 * s * 0.3);
        println!("ellipsoid on a slope of {degrees} degrees: {ratio:.4} of the exact speed");
        assert!((ratio - 1.0).abs() < 0.015, "{degrees}: {ratio}");
    }
}

/// Rotation about a fixed direction that is no principal axis: I_nn domega/dt = T_n.
#[test]
fn a_grain_that_keeps_to_a_plane_turns_about_its_normal_only() {
    let mut block = Grain::new(BLOCK.clone(), 2500.0)
        .with_orientation(DQuat::from_scaled_axis(DVec3::new(0.4, -0.9, 0.3)));
    block.plane_normal = Some(1);
    let moment = block.inertia().y_axis.y;
    assert!(block.inertia().y_axis.x.abs() > 0.05 * moment, "the normal is no principal axis");
    let load = Load { force: DVec3::new(1e-3, 5e-3, -2e-3), torque: DVec3::new(3e-5, 2e-5, 4e-5) };
    let mut dynamics = ContactDynamics::new(ContactParams::default(), open_box(1.0));
    let (mass, mut grains) = (block.mass(), [block]);
    for _ in 0..100 {
        dynamics.advance(&mut grains, &[load], 1e-3, &mut [Load::default()]);
    }
    let [Grain { pose, velocity, angular_velocity: omega, .. }] = &grains;
    assert!((velocity - 0.1 * DVec3::new(1e-3, 0.0, -2e-3) / mass).length() < 1e-12, "{velocity}");
    assert_eq!((pose.position.y, omega.x, omega.z), (0.0, 0.0, 0.0));
    // The moment about the normal does not change as the grain turns about it.
    assert!((omega.y * moment / (0.1 * load.torque.y) - 1.0).abs() < 1e-12, "{omega}");
}
