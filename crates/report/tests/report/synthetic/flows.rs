//! Folders of a settling sphere and of a lid-driven cavity.

use std::f64::consts::PI;
use std::path::Path;

use glam::{DQuat, DVec3};

use super::writing::{HEADER, diagnostics, grain_row, provenance, write, write_slice};

/// A sphere that settles alone, in a wide box; no surfaces.
pub fn single(folder: &Path) {
    let (rows, end) = (300, 1.3);
    let mut table = String::from(HEADER);
    let place = |t: f64| {
        DVec3::new(0.05, 0.05, 0.1275 - 0.128 * (t - 0.15 * (1.0 - (-t / 0.15).exp())) * 0.78)
    };
    for row in 0..=rows {
        let t = end * row as f64 / rows as f64;
        let v = DVec3::Z * -0.128 * 0.78 * (1.0 - (-t / 0.15).exp());
        grain_row(&mut table, t, 0, place(t), v, DQuat::IDENTITY, DVec3::ZERO, 0);
    }
    write(folder, "grains.csv", &table);
    write(
        folder,
        "case.resolved.toml",
        "gravity = [0, 0, -9.81]\n[domain]\nsize = [0.1, 0.1, 0.16]\ncells = [50, 50, 80]\n[domain.boundaries]\nx = [\"wall\", \"wall\"]\ny = [\"wall\", \"wall\"]\nz = [\"wall\", \"free-surface\"]\n[fluid]\ndensity = 960.0\nviscosity = 0.058\n[[grain]]\nshape = { kind = \"sphere\", diameter = 0.015 }\ndensity = 1120.0\n",
    );
    write(folder, "diagnostics.csv", &diagnostics(end, 200, |_| None));
    write(
        folder,
        "events.jsonl",
        "{\"time\":1.25,\"event\":\"landing\",\"grains\":[0],\"confirmed\":1.25}\n",
    );
    write(
        folder,
        "summary.json",
        "{\"steps\":900,\"end_time_s\":1.3,\"wall_s\":61.0,\"events\":[],\"max_divergence\":1e-12,\"grains\":[{\"equivalent_diameter_m\":0.015,\"density\":1120.0,\"shape\":\"sphere\"}]}",
    );
    provenance(folder);
    std::fs::create_dir_all(folder.join("slices")).unwrap();
    for (n, t) in [0.325, 0.65, 0.975, 1.3].into_iter().enumerate() {
        let centre = place(t);
        let field = |x: DVec3| {
            let r = (x - centre) / 7.5e-3;
            let solid = (0.5 + 4.0 * (1.0 - r.length())).clamp(0.0, 1.0);
            let stream = DVec3::Z
                * -0.09
                * (-(r.x * r.x) / (1.0 + 0.1 * r.z.max(0.0))).exp()
                * (-(r.z - 1.0).powi(2) / if r.z > 1.0 { 40.0 } else { 3.0 }).exp();
            (stream, DVec3::Y * stream.z * 300.0 * r.x, 0.0, solid)
        };
        write_slice(
            &folder.join(format!("slices/y-grain0_{n:06}.vti")),
            [50, 80],
            2e-3,
            0.05,
            t,
            field,
        );
    }
}

/// A lid-driven cavity without grains.
pub fn cavity(folder: &Path) {
    write(
        folder,
        "case.resolved.toml",
        "[domain]\nsize = [1.0, 1.0, 1.0]\ncells = [64, 1, 64]\n[domain.boundaries]\nx = [\"wall\", \"wall\"]\ny = [\"periodic\", \"periodic\"]\nz = [\"wall\", { kind = \"wall\", velocity = [1.0, 0.0, 0.0] }]\n[fluid]\ndensity = 1.0\nkinematic_viscosity = 0.01\n",
    );
    write(folder, "diagnostics.csv", &diagnostics(30.0, 300, |_| None));
    write(
        folder,
        "summary.json",
        "{\"steps\":900,\"end_time_s\":30.0,\"wall_s\":9.0,\"events\":[],\"max_divergence\":1e-12}",
    );
    std::fs::create_dir_all(folder.join("slices")).unwrap();
    let field = |x: DVec3| {
        let (a, b) = ((PI * x.x).sin().powi(2), x.z * x.z * (2.0 * PI * x.z * 0.5).cos());
        let velocity = DVec3::new(
            a * (3.0 * x.z * x.z - 2.0 * x.z),
            0.0,
            -PI * (2.0 * PI * x.x).sin() * (x.z.powi(3) - x.z * x.z),
        );
        (velocity, DVec3::Y * (6.0 * x.z - 2.0) * a, b, 0.0)
    };
    write_slice(&folder.join("slices/y-plane0_000030.vti"), [64, 64], 1.0 / 64.0, 0.5, 30.0, field);
}
