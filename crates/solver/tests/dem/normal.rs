//! Normal contact against closed forms and ordinary differential equations (MFIX DEM01 to DEM03).

use crate::clouds::step;
use crate::support::{floor, open_box, smooth, sphere};
use glam::DVec3;
use grainwake_solver::dem::{
    ContactDynamics, ContactParams, Enclosure, Grain, MotionConstraint, Partner, Side,
};
use grainwake_solver::math::Load;

const G: f64 = 9.80665;

/// The sphere of MFIX DEM01 and DEM02: d 0.2 m, 2600 kg/m^3, centre 0.5 m above the floor.
fn mfix_ball() -> Grain {
    sphere(0.1, 2600.0, 400, DVec3::new(0.0, 0.0, 0.5))
}

#[test]
fn dem01_free_fall_and_damped_contact() {
    let k = 1e4;
    let restitution = 0.9;
    let params = ContactParams { restitution, substeps_per_contact: 100.0, ..smooth(k) };
    let mut grains = [mfix_ball()];
    let mut dynamics = ContactDynamics::new(params, floor());
    let gravity = DVec3::new(0.0, 0.0, -G);
    let dt = 2e-5;

    // Stage 1: free fall. Stage 2: damped oscillator about its equilibrium, until the force
    // vanishes.
    let mass = grains[0].mass();
    let (zeta, w0) = (params.damping_ratio(), (k / mass).sqrt());
    let (wd, b) = (w0 * (1.0 - zeta * zeta).sqrt(), w0 * zeta);
    let landing = (2.0 * 0.4 / G).sqrt();
    let speed = G * landing;
    assert!((landing - 0.28562).abs() < 1e-5 && (speed - 2.80095).abs() < 1e-5);
    let sag = G / (w0 * w0);
    let contact = |s: f64| {
        // y - R = -sag + e^(-b s) (sag cos + c2 sin), velocity -speed at s = 0.
        let c2 = (b * sag - speed) / wd;
        let (sin, cos) = (wd * s).sin_cos();
        let decay = (-b * s).exp();
        let y = -sag + decay * (sag * cos + c2 * sin);
        let v = decay * ((wd * c2 - b * sag) * cos - (wd * sag + b * c2) * sin);
        (y, v)
    };
    let mut release = 0.0;
    while k * -contact(release).0 - 2.0 * b * mass * contact(release).1 > 0.0 || release < 1e-3 {
        release += 1e-7;
    }
    let leaving = contact(release);
    let exact = |t: f64| {
        if t < landing {
            (0.5 - 0.5 * G * t * t, -G * t)
        } else if t < landing + release {
            let (y, v) = contact(t - landing);
            (0.1 + y, v)
        } else {
            let s = t - landing - release;
            (0.1 + leaving.0 + leaving.1 * s - 0.5 * G * s * s, leaving.1 - G * s)
        }
    };
    let mut worst = (0.0f64, 0.0f64);
    for i in 1..=30_000 {
        step(&mut dynamics, &mut grains, gravity, dt);
        let (y, v) = exact(f64::from(i) * dt);
        worst.0 = worst.0.max((grains[0].pose.position.z - y).abs());
        worst.1 = worst.1.max((grains[0].velocity.z - v).abs());
    }
    println!("DEM01: height {:.2e} m, velocity {:.2e} m/s", worst.0, worst.1);
    assert!(worst.0 < 1e-6, "height {}", worst.0);
    assert!(worst.1 < 1e-4 * speed, "velocity {}", worst.1);
}

#[test]
fn dem02_bounce_heights_fall_with_restitution_squared() {
    let gravity = DVec3::new(0.0, 0.0, -G);
    for restitution in [1.0, 0.9, 0.7, 0.5] {
        // The hard-sphere height is not reached: a damped contact ends with an overlap.

        let params = ContactParams { restitution, substeps_per_contact: 100.0, ..smooth(5e10) };
        let mut grains = [mfix_ball()];
        let mut dynamics = ContactDynamics::new(params, floor());
        let mut tops = Vec::new();
        let mut rising = false;
        for _ in 0..40_000 {
            step(&mut dynamics, &mut grains, gravity, 5e-5);
            let v = grains[0].velocity.z;
            if rising && v <= 0.0 {
                tops.push(grains[0].pose.position.z - 0.1);
            }
            rising = v > 0.0;
            if tops.len() == 3 {
                break;
            }
        }
        assert_eq!(tops.len(), 3);
        for (n, top) in tops.iter().enumerate() {
            let expected = 0.4 * restitution.powi(2 * (n as i32 + 1));
            let error = top / expected - 1.0;
            println!("DEM02: e {restitution}, bounce {}: {error:.2e}", n + 1);
            // The bound grows as the fall becomes shorter.
            assert!(error.abs() < 2e-3 * (n as f64 + 1.0), "e {restitution}: {top} v {expected}");
        }
    }
}

#[test]
fn dem03_two_stacked_compressed_spheres() {
    // d 1 mm, 2e4 and 1e4 kg/m^3, box 1.8 mm high, k 1e3 N/m, centres at 0.45 and 1.35 mm.
    let (r, k, height) = (5e-4, 1e3, 1.8e-3);
    let start = [4.5e-4, 1.35e-3];
    let mut grains = [
        sphere(r, 2e4, 400, DVec3::new(0.0, 0.0, start[0])),
        sphere(r, 1e4, 400, DVec3::new(0.0, 0.0, start[1])),
    ];
    let enclosure = Enclosure {
        lower: DVec3::new(-1e-3, -1e-3, 0.0),
        upper: DVec3::new(1e-3, 1e-3, height),
        periodic: [false; 3],
        sides: [[Side::Open; 2], [Side::Open; 2], [Side::WALL, Side::WALL]],
    };
    let params = ContactParams { substeps_per_contact: 100.0, ..smooth(k) };
    let mut dynamics = ContactDynamics::new(params, enclosure);
    let masses = [grains[0].mass(), grains[1].mass()];
    let rate = |[y1, y2, v1, v2]: [f64; 4]| {
        let between = k * (2.0 * r - (y2 - y1)).max(0.0);
        let bottom = k * (r - y1).max(0.0);
        let top = k * (r - (height - y2)).max(0.0);
        [v1, v2, (bottom - between) / masses[0] - G, (between - top) / masses[1] - G]
    };
    let add = |a: [f64; 4], b: [f64; 4], h: f64| std::array::from_fn(|i| a[i] + h * b[i]);
    let mut state = [start[0], start[1], 0.0, 0.0];
    let (dt, inner) = (1e-6, 10);
    let mut worst: f64 = 0.0;
    for i in 1..=1000 {
        step(&mut dynamics, &mut grains, DVec3::new(0.0, 0.0, -G), dt);
        for _ in 0..inner {
            let h = dt / f64::from(inner);
            let a = rate(state);
            let b = rate(add(state, a, 0.5 * h));
            let c = rate(add(state, b, 0.5 * h));
            let d = rate(add(state, c, h));
            state = std::array::from_fn(|j| {
                state[j] + h / 6.0 * (a[j] + 2.0 * b[j] + 2.0 * c[j] + d[j])
            });
        }
        for j in 0..2 {
            worst = worst.max((grains[j].pose.position.z - state[j]).abs() / start[j]);
        }
        // Anchors from the published table of the case (analytic column).
        for (time, low, high) in
            [(2.25e-5, 4.4881e-4, 1.35237e-3), (1.0288e-4, 4.3201e-4, 1.38237e-3)]
        {
            if (f64::from(i) * dt - time).abs() < 0.5 * dt {
                assert!(
                    (state[0] / low - 1.0).abs() < 1e-3 && (state[1] / high - 1.0).abs() < 1e-3
                );
            }
        }
    }
    println!("DEM03: largest relative error of the heights {worst:.2e}");
    assert!(worst < 5e-5, "{worst}");
}

#[test]
fn head_on_collision_lasts_pi_sqrt_of_mass_over_two_k() {
    // m 1 kg, k 1e5 N/m: 7.02481e-3 s.
    let radius = 0.1;
    let density = 1.0 / (4.0 / 3.0 * std::f64::consts::PI * radius * radius * radius);
    let mut grains = [
        sphere(radius, density, 400, DVec3::new(-0.1001, 0.01, -0.02)),
        sphere(radius, density, 400, DVec3::new(0.1001, 0.01, -0.02)),
    ];
    grains[0].velocity = DVec3::new(0.5, 0.0, 0.0);
    grains[1].velocity = DVec3::new(-0.5, 0.0, 0.0);
    let params = ContactParams { substeps_per_contact: 200.0, ..smooth(1e5) };
    let mut dynamics = ContactDynamics::new(params, open_box(1.0));
    let dt = 1e-5;
    let (mut began, mut ended, mut deepest) = (None, None, 0.0f64);
    for i in 0..2000 {
        let before = grains[1].pose.position.x - grains[0].pose.position.x - 0.2;
        step(&mut dynamics, &mut grains, DVec3::ZERO, dt);
        let after = grains[1].pose.position.x - grains[0].pose.position.x - 0.2;
        let time = dt * (f64::from(i) + before / (before - after));
        if before > 0.0 && after <= 0.0 {
            began = Some(time);
        }
        if before < 0.0 && after >= 0.0 {
            ended = Some(time);
        }
        deepest = deepest.max(-after);
        if let [contact] = dynamics.contacts() {
            assert_eq!((contact.grain, contact.partner), (0, Partner::Grain(1)));
            // In the step in which the contact ends, the pair is listed with zero overlap.
            let depth = (-after).max(0.0);
            let error = (contact.overlap - depth).abs();
            assert!(error <= 1e-4 * depth + 1e-14, "{} {after}", contact.overlap);
            let error = (contact.load.force.x + 1e5 * contact.overlap).abs();
            assert!(error <= 1e-3 * 1e5 * contact.overlap, "{error}");
        }
    }
    let duration = ended.unwrap() - began.unwrap();
    println!("head-on: duration {duration:.6e} s, overlap {deepest:.6e} m");
    assert!((duration - 7.02481e-3).abs() < 1e-3 * 7.02481e-3, "{duration}");
    // v sqrt(m_eff / k) with v = 1 m/s.
    assert!((deepest - (0.5f64 / 1e5).sqrt()).abs() < 1e-3 * deepest, "{deepest}");
    for (grain, expected) in grains.iter().zip([-0.5, 0.5]) {
        assert!((grain.velocity.x - expected).abs() < 1e-3 * 0.5, "{}", grain.velocity);
        assert!(grain.velocity.truncate().y.abs().max(grain.velocity.z.abs()) < 1e-4);
    }
}

#[test]
fn stiffness_does_not_depend_on_the_number_of_nodes() {
    for nodes in [60, 250, 1000, 4000, 16_000] {
        for depth in [1e-4, 1e-3, 1e-2] {
            let mut grains = [
                sphere(1.0, 1.0, nodes, DVec3::ZERO),
                sphere(1.0, 1.0, nodes, (2.0 - depth) * DVec3::new(0.36, 0.48, 0.8)),
                sphere(1.0, 1.0, nodes, DVec3::new(4.0, 4.0, 1.0 - depth)),
            ];
            for grain in &mut grains {
                grain.translation = MotionConstraint::Prescribed(DVec3::ZERO);
                grain.rotation = MotionConstraint::Prescribed(DVec3::ZERO);
            }
            let mut dynamics = ContactDynamics::new(
                smooth(1000.0),
                Enclosure { lower: DVec3::new(-9.0, -9.0, 0.0), ..floor() },
            );
            grains[0].pose.position.z += 5.0;
            grains[1].pose.position.z += 5.0;
            let mut mean = [Load::default(); 3];
            dynamics.advance(&mut grains, &[], 1e-3, &mut mean);
            for (name, contact) in ["pair", "wall"].iter().zip(dynamics.contacts()) {
                let force = contact.load.force.length();
                let error = force / (1000.0 * depth) - 1.0;
                assert!(
                    (contact.overlap / depth - 1.0).abs() < 1e-4,
                    "{name} {nodes} {depth}: {}",
                    contact.overlap
                );
                assert!(error.abs() < 1e-3, "{name} {nodes} {depth}: {error}");
            }
            assert_eq!(dynamics.contacts().len(), 2);
            // The impulse over the step equals that of a constant force.
            assert!((mean[2].force.z / (1000.0 * depth) - 1.0).abs() < 1e-3);
            // The moment of a single sphere on the floor is small compared with force times radius.
            let lever = mean[2].torque.length() / mean[2].force.length();
            assert!(lever < 1e-3, "{nodes} {depth}: lever {lever}");
        }
    }
}

#[test]
fn global_damping_is_an_exponential() {
    let mut grains = [sphere(0.1, 1000.0, 100, DVec3::ZERO)];
    grains[0].velocity = DVec3::new(3.0, 0.0, -1.0);
    let params = ContactParams { global_damping: 1.0, ..smooth(1e4) };
    let mut dynamics = ContactDynamics::new(params, open_box(10.0));
    for _ in 0..1000 {
        step(&mut dynamics, &mut grains, DVec3::ZERO, 1e-3);
    }
    let expected = DVec3::new(3.0, 0.0, -1.0) * (-1.0f64).exp();
    assert!((grains[0].velocity - expected).length() < 1e-6, "{}", grains[0].velocity);
    // Terminal velocity g / xi.
    for _ in 0..30_000 {
        step(&mut dynamics, &mut grains, DVec3::new(0.0, 0.0, -9.81), 1e-3);
    }
    assert!((grains[0].velocity.z + 9.81).abs() < 1e-9);
}

#[test]
fn mean_contact_is_the_impulse_of_the_step() {
    let mut grains = [
        sphere(0.1, 1000.0, 300, DVec3::new(0.0, 0.0, 0.1002)),
        sphere(0.1, 2000.0, 300, DVec3::new(0.02, 0.05, 0.295)),
    ];
    grains[0].velocity.z = -1.0;
    grains[1].velocity = DVec3::new(0.5, 0.1, -3.0);
    let params = ContactParams { restitution: 0.7, normal_stiffness: 1e6, ..Default::default() };
    let mut dynamics = ContactDynamics::new(params, floor());
    let gravity = DVec3::new(1.0, 0.0, -G);
    let mut most = 0;
    for _ in 0..50 {
        let loads = crate::clouds::weights(&grains, gravity);
        let before: Vec<_> =
            grains.iter().map(|g| (g.momentum(), g.inertia() * g.angular_velocity)).collect();
        let mut mean = [Load::default(); 2];
        let dt = 1e-3;
        let substeps = dynamics.advance(&mut grains, &loads, dt, &mut mean);
        most = most.max(substeps);
        for i in 0..2 {
            let kicked = grains[i].momentum() - before[i].0;
            let expected = dt * (loads[i].force + mean[i].force);
            let scale = grains[i].momentum().length() + before[i].0.length();
            assert!((kicked - expected).length() < 1e-12 * scale, "{kicked} {expected}");
            let turned = grains[i].inertia() * grains[i].angular_velocity - before[i].1;
            assert!(
                (turned - dt * mean[i].torque).length() < 1e-10 * (turned.length() + 1e-3),
                "{turned}"
            );
        }
    }
    assert!(most > 1);
}

#[test]
fn lubrication_brakes_the_approach_and_never_the_dry_contact() {
    // Two equal spheres: F = 6 pi mu R_eq^2 v (1/h - 1/h_g), R_eq = R/2, h_g = h + 0.07 (h0 - h),
    // from a prescribed approach.
    let (radius, viscosity, range) = (1e-3, 0.1, 1e-4);
    let params = ContactParams {
        lubrication_gap: range,
        lubrication_viscosity: viscosity,
        roughness: 1e-6,
        ..smooth(1e3)
    };
    let force = |gap: f64, speed: f64| {
        let mut grains = [
            sphere(radius, 2500.0, 1000, DVec3::ZERO),
            sphere(radius, 2500.0, 1000, DVec3::new(0.0, 0.0, 2.0 * radius + gap)),
        ];
        grains[0].rotation = MotionConstraint::Prescribed(DVec3::ZERO);
        grains[0].translation = MotionConstraint::Prescribed(DVec3::ZERO);
        grains[1].rotation = MotionConstraint::Prescribed(DVec3::ZERO);
        grains[1].translation = MotionConstraint::Prescribed(DVec3::new(0.01, 0.0, -speed));
        let mut mean = [Load::default(); 2];
        ContactDynamics::new(params, open_box(1.0)).advance(&mut grains, &[], 1e-9, &mut mean);
        assert!((mean[0].force + mean[1].force).length() <= 1e-12 * mean[1].force.length());
        mean[1].force
    };
    let expected = |gap: f64, speed: f64| {
        let r = 0.5 * radius;
        let grid_film = gap + 0.07 * (range - gap);
        6.0 * std::f64::consts::PI * viscosity * r * r * speed * (1.0 / gap - 1.0 / grid_film)
    };
    for gap in [5e-6, 2e-5, 8e-5] {
        for speed in [0.01, -0.02] {
            let f = force(gap, speed);
            assert!((f.z / expected(gap, speed) - 1.0).abs() < 1e-3, "{gap} {speed}: {f}");
            assert!(f.truncate().length() < 1e-3 * f.z.abs());
        }
    }
    // The film is not thinner than the asperities; the force vanishes beyond the range.
    assert!((force(1e-8, 0.01).z / expected(1e-6, 0.01) - 1.0).abs() < 1e-3);
    assert_eq!(force(1.1e-4, 0.01), DVec3::ZERO);
    // In contact only the spring acts.
    assert!((force(-1e-5, 0.0).z / (1e3 * 1e-5) - 1.0).abs() < 1e-3);
}

#[test]
fn lubrication_acts_at_a_wall_up_to_its_whole_range() {
    // F = 6 pi mu R^2 v (1/h - 1/h_g), h_g = h + 0.35 (h0 - h). At a slip wall the film is that
    // between the sphere and its mirror image: R*^2 is R^2 / 4, h twice the gap, v twice the speed.
    let (radius, viscosity, range, speed) = (1e-3, 0.1, 5e-4, 1e-3);
    let params = ContactParams {
        lubrication_gap: range,
        lubrication_viscosity: viscosity,
        roughness: 1e-6,
        ..smooth(1e3)
    };
    let force = |side: Side, gap: f64| {
        let mut enclosure = floor();
        enclosure.sides[2][0] = side;
        let mut grain = sphere(radius, 2500.0, 1000, DVec3::Z * (radius + gap));
        grain.rotation = MotionConstraint::Prescribed(DVec3::ZERO);
        grain.translation = MotionConstraint::Prescribed(-speed * DVec3::Z);
        let mut mean = [Load::default()];
        ContactDynamics::new(params, enclosure).advance(&mut [grain], &[], 1e-9, &mut mean);
        mean[0].force.z
    };
    let strength = 6.0 * std::f64::consts::PI * viscosity * radius * radius * speed;
    for (side, factor, images) in [(Side::WALL, 1.0, 1.0), (Side::Frictionless, 0.5, 2.0)] {
        for share in [0.1, 0.4, 0.6, 0.9] {
            let film = share * range;
            let grid_film = film + 0.35 * (range - film);
            let expected = factor * strength * (1.0 / film - 1.0 / grid_film);
            let ratio = force(side, film / images) / expected;
            assert!((ratio - 1.0).abs() < 1e-3, "{side:?}, {share}: {ratio}");
        }
        assert_eq!(force(side, 1.1 * range / images), 0.0);
    }
}

#[test]
fn a_contact_turns_the_added_mass_as_well() {
    let mut impulses = [0.0; 2];
    for (impulse, added_density) in impulses.iter_mut().zip([0.0, 900.0]) {
        let params = ContactParams { added_density, ..smooth(1e5) };
        let mut grains = [sphere(0.1, 2600.0, 400, DVec3::new(0.0, 0.0, 0.1001))];
        grains[0].velocity = DVec3::new(0.0, 0.0, -1.0);
        let mut dynamics = ContactDynamics::new(params, floor());
        let mut mean = [Load::default()];
        let dt = 1e-3;
        for _ in 0..200 {
            dynamics.advance(&mut grains, &[], dt, &mut mean);
            *impulse += mean[0].force.z * dt;
        }
        assert!((grains[0].velocity.z - 1.0).abs() < 1e-3);
        let moved = grains[0].mass() + added_density * grains[0].shape.volume();
        assert!((*impulse / (2.0 * moved) - 1.0).abs() < 1e-3, "{impulse}");
    }
    assert!((impulses[1] / impulses[0] - 3500.0 / 2600.0).abs() < 1e-3);
}

#[test]
fn a_film_takes_its_speed_whatever_the_step() {
    // m dv = -6 pi mu R^2 (1/h - 1/h_g) dh, h_g = h + s (h0 - h), down to the asperities, the
    // thinnest film below them.
    let (radius, viscosity, range, roughness) = (3e-3, 0.1, 7.5e-4, 9e-6);
    let params = ContactParams {
        lubrication_gap: range,
        lubrication_viscosity: viscosity,
        roughness,
        ..smooth(1e4)
    };
    for dt in [2e-5, 1e-3] {
        let mut grains = [sphere(radius, 7800.0, 1000, DVec3::new(0.0, 0.0, radius + 1.2 * range))];
        grains[0].velocity = DVec3::new(0.0, 0.0, -0.5);
        let mass = grains[0].mass();
        let mut dynamics = ContactDynamics::new(params, floor());
        let mut mean = [Load::default()];
        let mut time = 0.0;
        while time < 8e-3 {
            dynamics.advance(&mut grains, &[], dt, &mut mean);
            time += dt;
        }
        let s = 0.35;
        let thinnest = roughness + s * (range - roughness);
        let once = 6.0 * std::f64::consts::PI * viscosity * radius * radius / mass
            * ((range / roughness).ln() - (range / thinnest).ln() / (1.0 - s) + 1.0
                - roughness / thinnest);
        let expected = 0.5 - 2.0 * once;
        let rebound = grains[0].velocity.z;
        assert!((rebound / expected - 1.0).abs() < 0.02, "dt {dt}: {rebound} against {expected}");
    }
}

#[test]
fn a_sphere_falls_through_a_thin_film_at_the_speed_of_its_load() {
    // F = 6 pi mu R^2 v (1/h - 1/h_g); the film stops the sphere within a hundredth of the step.
    let (radius, gap, range, viscosity, load) = (1e-3, 2e-5, 2.5e-4, 10.0, 1e-3);
    let params = ContactParams {
        lubrication_gap: range,
        lubrication_viscosity: viscosity,
        roughness: 1e-6,
        ..smooth(1e3)
    };
    let mut grains = [sphere(radius, 1500.0, 600, DVec3::Z * (radius + gap))];
    let mut dynamics = ContactDynamics::new(params, floor());
    let loads = [Load { force: -load * DVec3::Z, torque: DVec3::ZERO }];
    for _ in 0..20 {
        dynamics.advance(&mut grains, &loads, 1e-3, &mut [Load::default()]);
    }
    let left = grains[0].pose.position.z - radius;
    let grid_film = left + 0.35 * (range - left);
    let resistance = 6.0 * std::f64::consts::PI * viscosity * radius * radius;
    let expected = load / (resistance * (1.0 / left - 1.0 / grid_film));
    let speed = -grains[0].velocity.z;
    assert!((0.3 * gap..0.99 * gap).contains(&left), "{left}");
    assert!((speed / expected - 1.0).abs() < 0.01, "{speed} against {expected}");
}

#[test]
fn a_thick_film_slows_a_sphere_in_steps_of_one_substep() {
    // The explicit force of the film would reverse the speed many times over in a sub-step.
    let (radius, gap) = (1e-3, 5e-6);
    let params = ContactParams {
        lubrication_gap: 2.5e-4,
        lubrication_viscosity: 10.0,
        roughness: 3e-6,
        ..smooth(1e3)
    };
    for dt in [1e-6_f64, 5e-6, 1e-4] {
        let mut grains = [sphere(radius, 1500.0, 600, DVec3::Z * (radius + gap))];
        grains[0].velocity.z = -1e-4;
        let mut dynamics = ContactDynamics::new(params, floor());
        for _ in 0..(1e-3 / dt).round() as usize {
            dynamics.advance(&mut grains, &[], dt, &mut [Load::default()]);
            let speed = grains[0].velocity.z;
            assert!(speed.abs() < 1.0001e-4 && speed < 1e-5, "dt {dt}: {speed}");
        }
        assert!(grains[0].velocity.z.abs() < 1e-8, "dt {dt}: {}", grains[0].velocity.z);
    }
}
