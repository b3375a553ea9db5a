//! The measurements behind `docs/decisions/` and the case pages, one word each:
//!
//! `cargo run --release -p grainwake-solver --example measure -- WORD [numbers]`
//!
//! - `fixed [Re] [cells/d] [t_end] [x]`: drag of a fixed sphere, a quarter of the paper's box
//! - `spin [cells/d] [box/d] [t_end]`: torque of a spinning sphere between walls
//! - `shear [cells/d] [box/d] [t_end]`: spin of a free sphere in shear
//! - `tencate [1-4] [nx] [nz]`: peak speed of a settling sphere
//! - `pair [cells/d] [t_end] [friction]`: two spheres, ratio 1.14 (SINGLE=1: one alone)
//! - `carry [cells/d] [Re] [frame]`: force on a carried (frame 0) or held (frame 1) sphere
//! - `bench [nx ny nz] [steps]`: time a step
//!
//! SCHEME=paper takes the paper's coupling, CFL=0.1 another time step.
use glam::{DQuat, DVec3};
use grainwake_shape::Shape;
use grainwake_solver::{coupling::Scheme, dem::*, flow::*, grid::Mesh, math::Pose, sim::*};
use std::sync::Arc;

fn sphere(d: f64, x: DVec3, density: f64) -> Grain {
    Grain {
        shape: Arc::new(Shape::sphere(0.5 * d, 1250)),
        density,
        pose: Pose {
            position: x,
            orientation: DQuat::IDENTITY,
        },
        velocity: DVec3::ZERO,
        angular_velocity: DVec3::ZERO,
        translation: Dof::Free,
        rotation: Dof::Free,
    }
}
fn fluid(density: f64, nu: f64) -> FluidParams {
    FluidParams {
        density,
        kinematic_viscosity: nu,
        body_acceleration: DVec3::ZERO,
        initial_velocity: DVec3::ZERO,
        advection: Advection::Central,
    }
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let num = |i: usize, d: f64| a.get(i).and_then(|s| s.parse().ok()).unwrap_or(d);
    let scheme = if std::env::var("SCHEME").as_deref() == Ok("paper") {
        Scheme::Paper
    } else {
        Scheme::Aperture
    };
    let cfl = std::env::var("CFL")
        .ok()
        .and_then(|s| s.parse().ok())
        .unwrap_or(0.3);
    let limits = StepRule::Limits {
        cfl,
        viscous: 0.2,
        max_step: 1e9,
    };
    let wall = Boundary::WALL;
    let per = [Boundary::Periodic; 2];
    match a[1].as_str() {
        "fixed" => {
            let (re, n, tend) = (num(2, 100.0), num(3, 8.0), num(4, 30.0));
            let xs = num(5, 5.0);
            let h = 1.0 / n;
            let mesh = Mesh {
                cells: [15, 3, 3].map(|c| c * n as usize),
                spacing: DVec3::splat(h),
                origin: DVec3::ZERO,
            };
            let u = DVec3::X;
            let mut g = sphere(1.0, DVec3::new(xs, 0.0, 0.0), 1.0);
            g.translation = Dof::Prescribed(DVec3::ZERO);
            g.rotation = Dof::Prescribed(DVec3::ZERO);
            let mut f = fluid(1.0, 1.0 / re);
            f.initial_velocity = u;
            let mut s = Simulation::new(Setup {
                prescription: Default::default(),
                mesh,
                boundaries: Boundaries([
                    [Boundary::Inflow { velocity: u }, Boundary::Outflow],
                    [Boundary::Slip; 2],
                    [Boundary::Slip; 2],
                ]),
                fluid: Some(f),
                scheme,
                gravity: DVec3::ZERO,
                grains: vec![g],
                contact: Default::default(),
                step: limits,
            })
            .unwrap();
            let start = std::time::Instant::now();
            let mut next = 0.0;
            while s.time() < tend {
                s.step(f64::INFINITY).unwrap();
                if s.time() >= next {
                    let c = 32.0 / std::f64::consts::PI;
                    let drag = s.loads()[0].force * c;
                    println!(
                        "t {:.2} dt {:.4} Cd {:.5} Cl {:.5} {:.5} slip {:.4} div {:.1e} wall {:.1}",
                        s.time(),
                        s.time_step(),
                        drag.x,
                        drag.y,
                        drag.z,
                        s.diagnostics().slip,
                        s.diagnostics().max_divergence,
                        start.elapsed().as_secs_f64()
                    );
                    next += tend / 10.0;
                }
            }
            let ns =
                start.elapsed().as_nanos() as f64 / s.steps() as f64 / mesh.cell_count() as f64;
            println!(
                "steps {} ns/cell/step {ns:.1} {:?}",
                s.steps(),
                s.pass_times()
            );
        }
        "spin" => {
            // sphere spinning in a box of L diameters with walls, Stokes
            let (n, l) = (num(2, 16.0), num(3, 6.0));
            let nu = 1.0;
            let om = 0.01;
            let h = 1.0 / n;
            let mesh = Mesh {
                cells: [(l * n) as usize; 3],
                spacing: DVec3::splat(h),
                origin: DVec3::ZERO,
            };
            let off = DVec3::new(0.13, 0.29, 0.41) * h;
            let mut g = sphere(1.0, DVec3::splat(l / 2.0) + off, 1.0);
            g.translation = Dof::Prescribed(DVec3::ZERO);
            g.rotation = Dof::Prescribed(DVec3::new(0.0, om, 0.0));
            let mut s = Simulation::new(Setup {
                prescription: Default::default(),
                mesh,
                boundaries: Boundaries([[wall; 2]; 3]),
                fluid: Some(fluid(1.0, nu)),
                scheme,
                gravity: DVec3::ZERO,
                grains: vec![g],
                contact: Default::default(),
                step: limits,
            })
            .unwrap();
            let exact = 8.0 * std::f64::consts::PI * nu * 0.125 * om;
            while s.time() < num(4, 1.0) {
                s.step(f64::INFINITY).unwrap();
                if s.steps().is_multiple_of(100) {
                    println!(
                        "t {:.3} T/T0 {:.5} F {:?}",
                        s.time(),
                        -s.loads()[0].torque.y / exact,
                        s.loads()[0].force.length()
                    );
                }
            }
            println!("finite-size: (R/(L/2))^3 ~ {:.5}", (1.0 / l).powi(3));
        }
        "shear" => {
            let (n, l) = (num(2, 16.0), num(3, 6.0));
            let nu = 1.0;
            let gdot = 0.05;
            let h = 1.0 / n;
            let c = (l * n) as usize;
            let mesh = Mesh {
                cells: [c, c, c],
                spacing: DVec3::splat(h),
                origin: DVec3::ZERO,
            };
            let mut g = sphere(1.0, DVec3::splat(l / 2.0), 1.0);
            g.translation = Dof::Prescribed(DVec3::ZERO);
            let v = 0.5 * gdot * l;
            let b = [
                Boundary::Wall {
                    velocity: DVec3::new(-v, 0.0, 0.0),
                },
                Boundary::Wall {
                    velocity: DVec3::new(v, 0.0, 0.0),
                },
            ];
            let mut s = Simulation::new(Setup {
                prescription: Default::default(),
                mesh,
                boundaries: Boundaries([per, per, b]),
                fluid: Some(fluid(1.0, nu)),
                scheme,
                gravity: DVec3::ZERO,
                grains: vec![g],
                contact: Default::default(),
                step: limits,
            })
            .unwrap();
            while s.time() < num(4, 6.0) {
                s.step(f64::INFINITY).unwrap();
                if s.steps().is_multiple_of(4000) {
                    println!(
                        "t {:.3} spin/gdot {:.5}",
                        s.time(),
                        s.grains()[0].angular_velocity.y / gdot
                    );
                }
            }
        }
        "tencate" => {
            let e = num(2, 4.0) as usize;
            let nx = num(3, 59.0) as usize;
            let nz = num(4, 94.0) as usize;
            let (rho, mu, uinf) = [
                (970.0, 0.373, 0.038),
                (965.0, 0.212, 0.060),
                (962.0, 0.113, 0.091),
                (960.0, 0.058, 0.128),
            ][e - 1];
            let mesh = Mesh {
                cells: [nx, nx, nz],
                spacing: DVec3::new(0.1 / nx as f64, 0.1 / nx as f64, 0.16 / nz as f64),
                origin: DVec3::ZERO,
            };
            let g = sphere(0.015, DVec3::new(0.05, 0.05, 0.1275), 1120.0);
            let mut s = Simulation::new(Setup {
                prescription: Default::default(),
                mesh,
                boundaries: Boundaries([[wall; 2]; 3]),
                fluid: Some(fluid(rho, mu / rho)),
                scheme,
                gravity: DVec3::new(0.0, 0.0, -9.81),
                grains: vec![g],
                contact: Default::default(),
                step: limits,
            })
            .unwrap();
            let mut peak: f64 = 0.0;
            let mut tp = 0.0;
            let mut next = 0.0;
            let start = std::time::Instant::now();
            while s.grains()[0].pose.position.z > 0.0125 && s.time() < num(5, 10.0) {
                s.step(f64::INFINITY).unwrap();
                let g = &s.grains()[0];
                if -g.velocity.z > peak {
                    peak = -g.velocity.z;
                    tp = s.time();
                }
                if s.time() >= next {
                    println!(
                        "t {:.3} u {:.5} h/d {:.3} dt {:.5}",
                        s.time(),
                        g.velocity.z,
                        (g.pose.position.z - 0.0075) / 0.015,
                        s.time_step()
                    );
                    next += 0.1;
                }
            }
            println!(
                "E{e} peak {peak:.5} ratio {:.4} at {tp:.3} wall {:.1}",
                peak / uinf,
                start.elapsed().as_secs_f64()
            );
        }
        "bench" => {
            let h = 0.25e-3;
            let mesh = Mesh {
                cells: [
                    num(2, 100.0) as usize,
                    num(3, 100.0) as usize,
                    num(4, 390.0) as usize,
                ],
                spacing: DVec3::splat(h),
                origin: DVec3::ZERO,
            };
            let e = mesh.extent();
            let gr = vec![
                sphere(2e-3, 0.5 * e, 1500.0),
                sphere(2e-3, 0.5 * e + DVec3::new(0.0, 0.0, 5e-3), 1500.0),
            ];
            let mut s = Simulation::new(Setup {
                prescription: Default::default(),
                mesh,
                boundaries: Boundaries([[wall; 2]; 3]),
                fluid: Some(fluid(1000.0, 1e-6)),
                scheme,
                gravity: DVec3::new(0.0, 0.0, -9.81),
                grains: gr,
                contact: Default::default(),
                step: StepRule::Fixed(2e-4),
            })
            .unwrap();
            for _ in 0..2 {
                s.step(f64::INFINITY).unwrap();
            }
            let p0 = s.pass_times();
            let t = std::time::Instant::now();
            let n = num(5, 10.0) as usize;
            for _ in 0..n {
                s.step(f64::INFINITY).unwrap();
            }
            let c = 1e9 / n as f64 / mesh.cell_count() as f64;
            println!("ns/cell/step {:.1}", t.elapsed().as_secs_f64() * c);
            for (a, b) in p0.iter().zip(s.pass_times()) {
                println!("{} {:.1}", a.0, (b.1 - a.1) * c);
            }
            println!(
                "bytes/cell {:.1}",
                s.bytes() as f64 / mesh.cell_count() as f64
            );
        }
        "pair" => {
            // FeatFloWer sphere pair: d = g = 1, nu 4.7e-3, ratio 1.14, box 6 x 6 x 24
            let n = num(2, 8.0);
            let h = 1.0 / n;
            let mesh = Mesh {
                cells: [6, 6, 24].map(|c| c * n as usize),
                spacing: DVec3::splat(h),
                origin: DVec3::new(-3.0, -3.0, 0.0),
            };
            let gr = vec![
                sphere(1.0, DVec3::new(0.0, 0.0, 20.0), 1.14),
                sphere(1.0, DVec3::new(0.05, 0.0, 21.5), 1.14),
            ];
            let mut gr = gr;
            if std::env::var("SINGLE").is_ok() {
                gr[1].pose.position = DVec3::new(0.0, 0.0, 3.0);
                gr[1].translation = Dof::Prescribed(DVec3::ZERO);
                gr[0].pose.position.z = 21.5;
            }
            let contact = ContactParams {
                normal_stiffness: 300.0,
                friction: num(4, 0.0),
                wall_friction: 0.0,
                restitution: 0.9,
                ..Default::default()
            };
            let mut s = Simulation::new(Setup {
                prescription: Default::default(),
                mesh,
                boundaries: Boundaries([[wall; 2]; 3]),
                fluid: Some(fluid(1.0, 4.7e-3)),
                scheme,
                gravity: DVec3::new(0.0, 0.0, -1.0),
                grains: gr,
                contact,
                step: limits,
            })
            .unwrap();
            let (mut next, mut kiss, mut peak) = (0.0, None, 0.0f64);
            let start = std::time::Instant::now();
            while s.time() < num(3, 36.0) {
                if let Err(e) = s.step(f64::INFINITY) {
                    println!("{e}");
                    break;
                }
                let (a, b) = (&s.grains()[0], &s.grains()[1]);
                let r = b.pose.position - a.pose.position;
                if kiss.is_none() && r.length() < 1.005 {
                    kiss = Some(s.time());
                }
                if s.time() < 18.8 {
                    peak = peak.max(-b.velocity.z);
                }
                if s.time() >= next {
                    println!(
                        "t {:.2} sep {:.3} tilt {:.2} ul {:.4} ut {:.4} dt {:.4}",
                        s.time(),
                        r.length(),
                        r.x.hypot(r.y).atan2(r.z).to_degrees(),
                        -a.velocity.z,
                        -b.velocity.z,
                        s.time_step()
                    );
                    next += 1.25;
                }
            }
            println!(
                "kiss {kiss:?} peak {peak:.4} steps {} wall {:.0}",
                s.steps(),
                start.elapsed().as_secs_f64()
            );
        }
        "carry" => {
            // sphere carried at constant speed through a periodic box, force noise
            let (n, re) = (num(2, 16.0), num(3, 50.0));
            let h = 1.0 / n;
            let mesh = Mesh {
                cells: [(8.0 * n) as usize, (4.0 * n) as usize, (4.0 * n) as usize],
                spacing: DVec3::splat(h),
                origin: DVec3::ZERO,
            };
            let mut g = sphere(1.0, DVec3::new(2.0, 2.0 + 0.21 * h, 2.0 + 0.37 * h), 1.0);
            let frame = num(4, 0.0) * DVec3::X;
            g.translation = Dof::Prescribed(DVec3::X - frame);
            g.rotation = Dof::Prescribed(DVec3::ZERO);
            let mut f = fluid(1.0, 1.0 / re);
            f.initial_velocity = -frame;
            let w = Boundary::Wall { velocity: -frame };
            let mut s = Simulation::new(Setup {
                prescription: Default::default(),
                mesh,
                boundaries: Boundaries([per, [w; 2], [w; 2]]),
                fluid: Some(f),
                scheme,
                gravity: DVec3::ZERO,
                grains: vec![g],
                contact: Default::default(),
                step: StepRule::Fixed(cfl * h),
            })
            .unwrap();
            let mut v = vec![];
            while s.time() < 6.0 {
                s.step(f64::INFINITY).unwrap();
                if s.time() > 4.0 {
                    v.push((s.time(), -s.loads()[0].force.x));
                }
            }
            // remove quadratic trend
            let m = v.len() as f64;
            let mean = v.iter().map(|x| x.1).sum::<f64>() / m;
            let tm = 5.0;
            let (mut sxx, mut sxy) = (0.0, 0.0);
            for (t, f) in &v {
                sxx += (t - tm) * (t - tm);
                sxy += (t - tm) * (f - mean);
            }
            let b = sxy / sxx;
            let rms = (v
                .iter()
                .map(|(t, f)| (f - mean - b * (t - tm)).powi(2))
                .sum::<f64>()
                / m)
                .sqrt();
            println!(
                "mean {:.5} slope {:.5} rms/mean {:.5}",
                mean * 8.0 / std::f64::consts::PI,
                b / mean,
                rms / mean
            );
        }
        _ => {}
    }
}
