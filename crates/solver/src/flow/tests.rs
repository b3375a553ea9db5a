//! Discrete identities and observed orders of the fluid alone.

use std::f64::consts::PI;

use glam::DVec3;

use super::*;

const PERIODIC: Boundaries = Boundaries([[Boundary::Periodic; 2]; 3]);

fn params(nu: f64) -> FluidParams {
    FluidParams {
        density: 1.0,
        kinematic_viscosity: nu,
        body_acceleration: DVec3::ZERO,
        initial_velocity: DVec3::ZERO,
    }
}

fn noise(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// A random divergence-free velocity.
fn random_flow(mesh: &Mesh, boundaries: Boundaries, nu: f64) -> Flow {
    let mut flow = Flow::<f64>::new(mesh, boundaries, &params(nu));
    let mut state = 11;
    for axis in 0..3 {
        flow.velocity.component_mut(axis).iter_mut().for_each(|value| *value = noise(&mut state));
    }
    flow.make_solenoidal();
    flow
}

/// Advection and diffusion of the present velocity, per component.
fn tendencies(flow: &mut Flow) -> FaceVector {
    flow.predict(1.0);
    flow.tendency.clone()
}

#[test]
fn divergence_is_minus_the_transposed_gradient() {
    let mesh = Mesh { cells: [7, 6, 5], spacing: DVec3::new(0.3, 0.4, 0.5), origin: DVec3::ZERO };
    let flow = random_flow(
        &mesh,
        Boundaries([[Boundary::Periodic; 2], [Boundary::WALL; 2], [Boundary::WALL; 2]]),
        0.0,
    );
    let mut state = 5;
    let mut p = Field::<Centre>::zeros(&mesh);
    p.iter_mut().for_each(|value| *value = noise(&mut state));
    flow.boundaries.fill_ghosts(mesh.layout(), None, 0..3, &mut p);
    let mut u = flow.velocity.clone();
    for axis in 0..3 {
        u.component_mut(axis).iter_mut().for_each(|value| *value = noise(&mut state));
    }
    flow.boundaries.set_normal(&mut u);
    let h = mesh.spacing;
    let (mut left, mut right, mut size) = (0.0, 0.0, 0.0);
    for [i, j, k] in mesh.indices() {
        let div = (u.x.at(i + 1, j, k) - u.x.at(i, j, k)) / h.x
            + (u.y.at(i, j + 1, k) - u.y.at(i, j, k)) / h.y
            + (u.z.at(i, j, k + 1) - u.z.at(i, j, k)) / h.z;
        left += p.at(i, j, k) * div;
        size += (p.at(i, j, k) * div).abs();
        let c = p.at(i, j, k);
        right -= u.x.at(i, j, k) * (c - p.at(i - 1, j, k)) / h.x
            + u.y.at(i, j, k) * (c - p.at(i, j - 1, k)) / h.y
            + u.z.at(i, j, k) * (c - p.at(i, j, k - 1)) / h.z;
    }
    assert!((left - right).abs() <= 1e-14 * size, "p.Du = {left:e}, -Gp.u = {right:e}");
}

#[test]
fn projection_leaves_round_off_divergence() {
    for boundaries in [PERIODIC, Boundaries([[Boundary::WALL; 2]; 3])] {
        let mesh =
            Mesh { cells: [19, 14, 11], spacing: DVec3::new(0.3, 0.4, 0.5), origin: DVec3::ZERO };
        let mut flow = random_flow(&mesh, boundaries, 0.01);
        for _ in 0..5 {
            flow.predict(0.01);
            let m = flow.project(0.01);
            assert!(m.max_divergence <= 1e-10 * m.max_rate, "{m:?}");
            let h = mesh.spacing;
            let worst = mesh
                .indices()
                .map(|[i, j, k]| {
                    let u = &flow.velocity;
                    ((u.x.at(i + 1, j, k) - u.x.at(i, j, k)) / h.x
                        + (u.y.at(i, j + 1, k) - u.y.at(i, j, k)) / h.y
                        + (u.z.at(i, j, k + 1) - u.z.at(i, j, k)) / h.z)
                        .abs()
                })
                .fold(0.0, f64::max);
            assert!(worst <= 1e-10 * m.max_rate, "measured apart from the sweep: {worst:e}");
        }
    }
}

#[test]
fn the_mean_pressure_is_zero() {
    let walls = Boundaries([[Boundary::WALL; 2]; 3]);
    let mesh =
        Mesh { cells: [19, 14, 11], spacing: DVec3::new(0.3, 0.4, 0.5), origin: DVec3::ZERO };
    for boundaries in [PERIODIC, walls] {
        let mut flow = random_flow(&mesh, boundaries, 0.01);
        for _ in 0..5 {
            flow.predict(0.01);
            flow.project(0.01);
        }
        let inside = mesh.indices().map(|[i, j, k]| flow.pressure.at(i, j, k));
        let (sum, size) = inside.fold((0.0, 0.0), |(sum, size), p| (sum + p, size + p.abs()));
        assert!(sum.abs() < 1e-11 * size, "{sum:e} of {size:e}");
    }
}

#[test]
fn advection_conserves_momentum_and_kinetic_energy() {
    let mesh = Mesh { cells: [9, 8, 7], spacing: DVec3::new(0.3, 0.4, 0.5), origin: DVec3::ZERO };
    let mut flow = random_flow(&mesh, PERIODIC, 0.0);
    let h = tendencies(&mut flow);
    for axis in 0..3 {
        let (mut momentum, mut size) = (0.0, 0.0);
        for [i, j, k] in mesh.indices() {
            let value = h.component(axis)[mesh.layout().index(i, j, k)];
            momentum += value;
            size += value.abs();
        }
        assert!(momentum.abs() <= 1e-13 * size, "momentum {axis}: {momentum:e} of {size:e}");
    }
    let (mut power, mut size) = (0.0, 0.0);
    for [i, j, k] in mesh.indices() {
        let at = mesh.layout().index(i, j, k);
        for axis in 0..3 {
            let p = h.component(axis)[at] * flow.velocity.component(axis)[at];
            power += p;
            size += p.abs();
        }
    }
    assert!(power.abs() <= 1e-13 * size, "energy rate {power:e} of {size:e}");
}

/// Decaying Taylor-Green vortex in the plane of two axes; returns the largest velocity error.
fn taylor_green(n: usize, dt: f64, steps: usize, nu: f64, plane: [usize; 2]) -> f64 {
    let mut cells = [1; 3];
    cells[plane[0]] = n;
    cells[plane[1]] = n;
    let mesh = Mesh { cells, spacing: DVec3::splat(2.0 * PI / n as f64), origin: DVec3::ZERO };
    let mut flow = Flow::<f64>::new(&mesh, PERIODIC, &params(nu));
    let exact = |axis: usize, x: DVec3, t: f64| {
        let (a, b) = (x[plane[0]], x[plane[1]]);
        let decay = (-2.0 * nu * t).exp();
        if axis == plane[0] {
            a.sin() * b.cos() * decay
        } else if axis == plane[1] {
            -a.cos() * b.sin() * decay
        } else {
            0.0
        }
    };
    flow.velocity.x.fill_with(&mesh, |x| exact(0, x, 0.0));
    flow.velocity.y.fill_with(&mesh, |x| exact(1, x, 0.0));
    flow.velocity.z.fill_with(&mesh, |x| exact(2, x, 0.0));
    flow.fill_ghosts();
    for _ in 0..steps {
        flow.predict(dt);
        flow.project(dt);
    }
    let t = dt * steps as f64;
    let mut worst: f64 = 0.0;
    for [i, j, k] in mesh.indices() {
        for axis in 0..3 {
            let x = mesh.position(crate::grid::FACE_OFFSET[axis], [i, j, k]);
            let u = flow.velocity.component(axis)[mesh.layout().index(i, j, k)];
            worst = worst.max((u - exact(axis, x, t)).abs());
        }
    }
    worst
}

#[test]
fn taylor_green_is_second_order_in_space() {
    for plane in [[0, 1], [1, 2], [0, 2]] {
        let coarse = taylor_green(16, 2e-3, 250, 0.1, plane);
        let fine = taylor_green(32, 2e-3, 250, 0.1, plane);
        let order = (coarse / fine).log2();
        assert!((order - 2.0).abs() <= 0.1, "{plane:?}: errors {coarse:e} {fine:e}, order {order}");
    }
}

#[test]
fn taylor_green_is_second_order_in_time() {
    // The same grid throughout: differences between steps leave the error in time alone.
    let field = |steps: usize| {
        let n = 24;
        let mesh = Mesh {
            cells: [n, 1, n],
            spacing: DVec3::splat(2.0 * PI / n as f64),
            origin: DVec3::ZERO,
        };
        let mut flow = Flow::<f64>::new(&mesh, PERIODIC, &params(0.05));
        // Two superposed vortices interact, so that advection is not a gradient.
        flow.velocity.x.fill_with(&mesh, |x| x.x.sin() * x.z.cos() + 0.5 * (2.0 * x.z).sin());
        flow.velocity.z.fill_with(&mesh, |x| -x.x.cos() * x.z.sin());
        flow.make_solenoidal();
        for _ in 0..steps {
            flow.predict(1.0 / steps as f64);
            flow.project(1.0 / steps as f64);
        }
        flow.velocity.x.to_vec()
    };
    let apart =
        |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let [one, two, four] = [40, 80, 160].map(field);
    let order = (apart(&one, &two) / apart(&two, &four)).log2();
    assert!((1.9..=2.2).contains(&order), "observed order in time {order}");
}

/// Arnold-Beltrami-Childress flow, an exact decaying solution in three dimensions.
fn beltrami(n: usize) -> f64 {
    let nu = 0.1;
    let mesh =
        Mesh { cells: [n; 3], spacing: DVec3::splat(2.0 * PI / n as f64), origin: DVec3::ZERO };
    let mut flow = Flow::<f64>::new(&mesh, PERIODIC, &params(nu));
    flow.velocity.x.fill_with(&mesh, |x| x.z.sin() + 0.7 * x.y.cos());
    flow.velocity.y.fill_with(&mesh, |x| 0.8 * x.x.sin() + x.z.cos());
    flow.velocity.z.fill_with(&mesh, |x| 0.7 * x.y.sin() + 0.8 * x.x.cos());
    flow.fill_ghosts();
    let (dt, steps) = (4e-3, 100);
    for _ in 0..steps {
        flow.predict(dt);
        flow.project(dt);
    }
    let decay = (-nu * dt * steps as f64).exp();
    mesh.indices()
        .map(|[i, j, k]| {
            let x = mesh.position(crate::grid::FACE_OFFSET[0], [i, j, k]);
            (flow.velocity.x.at(i, j, k) - decay * (x.z.sin() + 0.7 * x.y.cos())).abs()
        })
        .fold(0.0, f64::max)
}

#[test]
fn beltrami_flow_is_second_order_in_space() {
    let (coarse, fine) = (beltrami(12), beltrami(24));
    let order = (coarse / fine).log2();
    assert!((order - 2.0).abs() <= 0.1, "errors {coarse:e} {fine:e}, order {order}");
}

/// Steady Couette-Poiseuille flow between a wall at rest and a moving lid, across `axis`.
fn channel(n: usize, axis: usize) -> f64 {
    let along = (axis + 1) % 3;
    let mut cells = [1; 3];
    cells[axis] = n;
    let (nu, push, lid) = (1.0, 6.0, 0.7);
    let mut p = params(nu);
    p.body_acceleration[along] = push;
    let mut velocity = DVec3::ZERO;
    velocity[along] = lid;
    let mut boundaries = PERIODIC;
    boundaries.0[axis] = [Boundary::WALL, Boundary::Wall { velocity }];
    let h = 1.0 / n as f64;
    let mesh = Mesh { cells, spacing: DVec3::splat(h), origin: DVec3::ZERO };
    let mut flow = Flow::<f64>::new(&mesh, boundaries, &p);
    let dt = 0.2 * h * h;
    for _ in 0..(2.0 / dt) as usize {
        flow.predict(dt);
        flow.project(dt);
    }
    (1..=n)
        .map(|m| {
            let mut index = [1; 3];
            index[axis] = m;
            let s = (m as f64 - 0.5) * h;
            let exact = lid * s + push / (2.0 * nu) * s * (1.0 - s);
            (flow.velocity.component(along)[mesh.layout().index(index[0], index[1], index[2])]
                - exact)
                .abs()
        })
        .fold(0.0, f64::max)
}

#[test]
fn channel_with_a_moving_lid_is_exact() {
    for axis in 0..3 {
        let error = channel(8, axis);
        assert!(error < 1e-8, "axis {axis}: {error:e}");
    }
}

/// A sine of shear that dies out between two walls across `axis`; relative error after a while.
fn decaying_shear(n: usize, axis: usize) -> f64 {
    let along = (axis + 2) % 3;
    let mut cells = [1; 3];
    cells[axis] = n;
    let h = 1.0 / n as f64;
    let mesh = Mesh { cells, spacing: DVec3::splat(h), origin: DVec3::ZERO };
    let mut boundaries = PERIODIC;
    boundaries.0[axis] = [Boundary::WALL; 2];
    let mut flow = Flow::<f64>::new(&mesh, boundaries, &params(1.0));
    let at = |m: usize| {
        let mut index = [1; 3];
        index[axis] = m;
        mesh.layout().index(index[0], index[1], index[2])
    };
    let sine = |m: usize| (PI * (m as f64 - 0.5) * h).sin();
    for m in 1..=n {
        flow.velocity.component_mut(along)[at(m)] = sine(m);
    }
    flow.fill_ghosts();
    let (dt, steps) = (0.05 * h * h, 2 * n * n);
    for _ in 0..steps {
        flow.predict(dt);
        flow.project(dt);
    }
    let decay = (-PI * PI * dt * steps as f64).exp();
    (1..=n)
        .map(|m| (flow.velocity.component(along)[at(m)] / decay - sine(m)).abs())
        .fold(0.0, f64::max)
}

#[test]
fn shear_between_walls_is_second_order() {
    for axis in 0..3 {
        let (coarse, fine) = (decaying_shear(64, axis), decaying_shear(128, axis));
        let order = (coarse / fine).log2();
        assert!(
            (order - 2.0).abs() <= 0.1,
            "axis {axis}: errors {coarse:e} {fine:e}, order {order}"
        );
    }
}

#[test]
fn outflow_keeps_the_mass_of_the_box() {
    let mesh = Mesh { cells: [20, 8, 8], spacing: DVec3::splat(0.1), origin: DVec3::ZERO };
    let velocity = DVec3::X;
    let boundaries = Boundaries([
        [Boundary::Inflow { velocity }, Boundary::Outflow],
        [Boundary::Slip; 2],
        [Boundary::WALL, Boundary::FreeSurface],
    ]);
    let mut p = params(0.02);
    p.initial_velocity = velocity;
    let mut flow = Flow::<f64>::new(&mesh, boundaries, &p);
    for _ in 0..200 {
        flow.predict(0.02);
        let m = flow.project(0.02);
        assert!(m.max_divergence <= 1e-10 * m.max_rate, "{m:?}");
    }
    let through = |i: usize| {
        mesh.indices()
            .filter(|[x, ..]| *x == 1)
            .map(|[_, j, k]| flow.velocity.x.at(i, j, k))
            .sum::<f64>()
    };
    assert!((through(1) - 64.0).abs() < 1e-12 && (through(21) - 64.0).abs() < 1e-10);
    // The floor slows the fluid, the lid does not.
    assert!(flow.velocity.x.at(18, 4, 1) < 0.8 * flow.velocity.x.at(18, 4, 8));
}

#[test]
fn bits_of_a_step_do_not_depend_on_the_caches() {
    fn bits<R: Real>(boundaries: Boundaries, non_temporal: bool) -> Vec<u64> {
        let mesh =
            Mesh { cells: [29, 11, 9], spacing: DVec3::new(0.3, 0.4, 0.5), origin: DVec3::ZERO };
        let mut flow = Flow::<R>::new(&mesh, boundaries, &params(0.01));
        flow.non_temporal = non_temporal;
        flow.start_from(|axis, x| (x + DVec3::new(0.1, 0.2, 0.3)).to_array()[axis].sin());
        let mut kept = Vec::new();
        for _ in 0..3 {
            flow.predict(0.05);
            let measures = flow.project(0.05);
            kept.extend([measures.max_divergence, measures.max_rate, measures.kinetic_energy]);
            kept.extend(measures.momentum.to_array());
        }
        let (fields, sums) = flow.state();
        let values = fields.into_iter().flatten().map(|value| value.wide());
        let all = values.chain(sums.iter().copied()).chain(kept);
        all.map(f64::to_bits).collect()
    }
    let walls = Boundaries([[Boundary::WALL; 2]; 3]);
    for boundaries in [PERIODIC, walls] {
        let [near, past] = [false, true]
            .map(|past| [bits::<f64>(boundaries, past), bits::<f32>(boundaries, past)]);
        assert!(near == past);
    }
}

#[test]
fn single_precision_follows_a_driven_flow() {
    // A channel that speeds up from rest: what a step adds is small against the speed.
    fn speed<R: Real>() -> f64 {
        let mesh =
            Mesh { cells: [4, 16, 4], spacing: DVec3::splat(1.0 / 16.0), origin: DVec3::ZERO };
        let mut driven = params(0.1);
        driven.body_acceleration = DVec3::X;
        let sides = [[Boundary::Periodic; 2], [Boundary::WALL; 2], [Boundary::Periodic; 2]];
        let mut flow = Flow::<R>::new(&mesh, Boundaries(sides), &driven);
        for _ in 0..4000 {
            flow.predict(1e-3);
            flow.project(1e-3);
        }
        flow.velocity.x.at(2, 8, 2).wide()
    }
    let (double, single) = (speed::<f64>(), speed::<f32>());
    let off = (single / double - 1.0).abs();
    assert!(double > 1.0 && off < 1e-5, "{double} {single}: {off:e}");
}
