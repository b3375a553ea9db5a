//! The folder of a settling pair: smooth paths, bumpy grains, Lamb-Oseen vortices.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::path::Path;

use glam::{DQuat, DVec3};

use super::surfaces::{D, write_surfaces};
use super::writing::{HEADER, diagnostics, grain_row, provenance, write, write_slice};

pub const G: f64 = 9.81;

fn time_unit() -> f64 {
    (D / G).sqrt()
}

/// Grows smoothly from 0 to 1 over [a, b].
fn ramp(s: f64, a: f64, b: f64) -> f64 {
    let t = ((s - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Centre of grain 0 (behind) or 1 (ahead) of the made-up pair at dimensionless time s.
fn pair_position(grain: usize, s: f64, swing: f64) -> DVec3 {
    let distance = D * (2.6 - 1.6 * ramp(s, 0.0, 18.0) + 2.2 * ramp(s, 29.0, 46.0));
    let tilt = 2.45 * ramp(s, 17.0, 33.0);
    let azimuth = swing * ramp(s, 18.0, 30.0);
    let line = DVec3::new(tilt.sin() * azimuth.cos(), tilt.sin() * azimuth.sin(), tilt.cos());
    let fallen = 1.5e-3 * (s - 4.0 * (1.0 - (-s / 4.0).exp()));
    let middle = DVec3::new(
        12.5e-3 + 0.6e-3 * (s / 5.0).sin() * ramp(s, 10.0, 30.0),
        12.5e-3,
        84e-3 - 1.13 * fallen,
    );
    middle + (0.5 - grain as f64) * distance * line
}

fn pair_turn(grain: usize, s: f64) -> DQuat {
    let about =
        1.0 * (-s / 9.0).exp() * (0.5 * s).cos() + 0.5 * ramp(s, 18.0, 34.0) * (0.3 * s).sin();
    DQuat::from_rotation_y(if grain == 0 { about } else { -0.8 * about })
        * DQuat::from_rotation_z(0.4 * grain as f64)
}

fn inside_bumpy(x: DVec3) -> f64 {
    let n = (x / DVec3::new(1.3, 1.0, 0.75)) / (0.5 * D);
    let phi = n.y.atan2(n.x);
    let unit = n.normalize_or_zero();
    let sin = (1.0 - unit.z * unit.z).max(0.0).sqrt();
    let bump = 1.0
        + sin * (0.07 * (3.0 * phi + 1.0).sin() + 0.06 * (5.0 * unit.z).cos() * (2.0 * phi).sin());
    (0.5 + 4.0 * (bump - n.length())).clamp(0.0, 1.0)
}

/// Wakes of grains: a Gaussian stream that follows each grain, and Lamb-Oseen vortices beside it.
fn wake(x: DVec3, grains: &[(DVec3, DVec3)]) -> (DVec3, DVec3) {
    let (mut velocity, mut vorticity) = (DVec3::ZERO, 0.0);
    for (n, (centre, v)) in grains.iter().enumerate() {
        for pair in 0..4 {
            let height = (0.3 + 1.5 * f64::from(pair)) * D;
            let fade = (-0.4 * f64::from(pair)).exp() * (v.length() / 0.09);
            let core = (0.45 + 0.18 * f64::from(pair)) * D;
            let sway = 0.25 * D * (1.3 * f64::from(pair) + n as f64).sin();
            for side in [-1.0, 1.0] {
                let r = DVec3::new(
                    x.x - centre.x - sway - 0.75 * side * D,
                    0.0,
                    x.z - centre.z - height,
                );
                let (r2, strength) = (r.length_squared().max(1e-14), -side * 3.2e-4 * fade);
                let turn = strength / (TAU * r2) * (1.0 - (-r2 / (core * core)).exp());
                velocity += turn * DVec3::new(r.z, 0.0, -r.x);
                vorticity += strength / (PI * core * core) * (-r2 / (core * core)).exp();
            }
        }
    }
    (velocity, DVec3::new(0.0, vorticity, 0.0))
}

/// A settling pair with drafting, kissing, tumbling and separation. `swing` [rad] turns the line of
/// centres out of the plane; `h` is the cell edge [m].
pub fn pair(folder: &Path, swing: f64, h: f64) {
    let unit = time_unit();
    let rows = 460;
    let time = |row: usize| 0.1 * row as f64 * unit;
    let place = |grain: usize, s: f64| pair_position(grain, s, swing);
    let speed =
        |grain: usize, s: f64| (place(grain, s + 1e-3) - place(grain, s - 1e-3)) / (2e-3 * unit);
    let spin = |grain: usize, s: f64| {
        let turn = pair_turn(grain, s + 1e-3) * pair_turn(grain, s - 1e-3).conjugate();
        turn.to_scaled_axis() / (2e-3 * unit)
    };
    let mut table = String::from(HEADER);
    for row in 0..=rows {
        let s = 0.1 * row as f64;
        for grain in 0..2 {
            let touch = usize::from((18.0..30.0).contains(&s));
            grain_row(
                &mut table,
                time(row),
                grain,
                place(grain, s),
                if row == 0 { DVec3::ZERO } else { speed(grain, s) },
                pair_turn(grain, s),
                spin(grain, s),
                touch,
            );
        }
    }
    write(folder, "grains.csv", &table);
    write(
        folder,
        "case.resolved.toml",
        &format!(
            "title = \"Two rocks drafting, kissing and tumbling\"\ngravity = [0.0, 0.0, -9.81]\n[domain]\nsize = [0.025, 0.025, 0.0975]\ncells = [{0}, {0}, {1}]\norigin = [0.0, 0.0, 0.0]\n[domain.boundaries]\nx = [\"wall\", \"wall\"]\ny = [\"wall\", \"wall\"]\nz = [\"wall\", \"wall\"]\n[fluid]\ndensity = 1000.0\nkinematic_viscosity = 1e-6\n[coupling]\nscheme = \"default\"\n[[grain]]\nfile = \"rock.grain\"\ndensity = 1500.0\n[[grain]]\nfile = \"rock.grain\"\ndensity = 1500.0\n",
            (0.025 / h).round() as usize,
            (0.0975 / h).round() as usize
        ),
    );
    let gap = |t: f64| {
        let s = t / unit;
        Some(((place(0, s) - place(1, s)).length() - 1.02 * D).max(-1e-6))
    };
    write(folder, "diagnostics.csv", &diagnostics(time(rows), 600, gap));
    let event = |s: f64, name: &str, grains: &str| {
        let t = s * unit;
        format!(
            "{{\"time\":{t},\"event\":\"{name}\",\"grains\":{grains},\"confirmed\":{t},\"gap\":1.25e-5,\"tilt\":0.5}}\n"
        )
    };
    let log = [
        event(17.9, "kiss", "[0,1]"),
        event(23.5, "tumble", "[0,1]"),
        event(26.4, "role-change", "[0,1]"),
        event(30.2, "separation", "[0,1]"),
        event(44.0, "landing", "[0]"),
    ];
    write(folder, "events.jsonl", &log.concat());
    write(
        folder,
        "summary.json",
        &format!(
            "{{\"steps\":12000,\"end_time_s\":{},\"wall_s\":1234.5,\"events\":[],\"max_divergence\":3.1e-12,\"kiss_time_s\":{},\"tumble_time_s\":{},\"separation_time_s\":{},\"role_changes\":1,\"grains\":[{{\"equivalent_diameter_m\":{D},\"density\":1500.0,\"shape\":\"rock.grain\"}},{{\"equivalent_diameter_m\":{D},\"density\":1500.0,\"shape\":\"rock.grain\"}}]}}",
            time(rows),
            17.9 * unit,
            23.5 * unit,
            30.2 * unit
        ),
    );
    provenance(folder);
    std::fs::create_dir_all(folder.join("slices")).unwrap();
    std::fs::create_dir_all(folder.join("grains")).unwrap();
    let mut collection = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\"><Collection>\n",
    );
    for row in [0, 107, 179, 264, 371, 460] {
        let s = 0.1 * row as f64;
        let poses = [0, 1].map(|grain| (place(grain, s), pair_turn(grain, s)));
        let moving = [0, 1]
            .map(|grain| (place(grain, s), if row == 0 { DVec3::ZERO } else { speed(grain, s) }));
        for grain in 0..2 {
            let name = format!("slices/y-grain{grain}_{row:06}.vti");
            let field = |x: DVec3| {
                let (u, w) = wake(x, &moving);
                let solid: f64 =
                    poses.iter().map(|(p, q)| inside_bumpy(q.conjugate() * (x - *p))).sum();
                (
                    u * (1.0 - solid) + moving[grain].1 * solid,
                    w * (1.0 - solid),
                    1e3 * u.z,
                    solid.min(1.0),
                )
            };
            let cells = [(0.025 / h).round() as usize, (0.0975 / h).round() as usize];
            write_slice(&folder.join(&name), cells, h, poses[grain].0.y, time(row), field);
            writeln!(
                collection,
                "<DataSet timestep=\"{:?}\" part=\"{grain}\" file=\"{name}\"/>",
                time(row)
            )
            .unwrap();
        }
        let name = format!("grains/grains_{row:06}.vtp");
        write_surfaces(&folder.join(&name), &poses, time(row));
        writeln!(collection, "<DataSet timestep=\"{:?}\" part=\"2\" file=\"{name}\"/>", time(row))
            .unwrap();
    }
    write(folder, "run.pvd", &(collection + "</Collection></VTKFile>\n"));
}
