//! The folder of a dry heap.

use std::f64::consts::TAU;
use std::path::Path;

use glam::{DQuat, DVec3};

use super::surfaces::{D, write_surfaces};
use super::writing::{HEADER, grain_row, write};

/// A dry heap of bumpy grains.
pub fn heap(folder: &Path, count: usize, surfaces: bool) {
    let rows = 60;
    let mut table = String::from(HEADER);
    let mut state = 12345u64;
    let mut random = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let rest: Vec<(DVec3, DQuat)> = (0..count)
        .map(|_| {
            let (r, phi) = (12e-3 * random().sqrt(), TAU * random());
            let height = (9e-3 - 0.7 * r).max(1e-3) * random() + 1e-3;
            let turn =
                DQuat::from_rotation_z(TAU * random()) * DQuat::from_rotation_x(TAU * random());
            (DVec3::new(20e-3 + r * phi.cos(), 20e-3 + r * phi.sin(), height), turn)
        })
        .collect();
    for row in 0..=rows {
        let t = 0.01 * row as f64;
        for (grain, (place, turn)) in rest.iter().enumerate() {
            let fade = (-t / 0.08).exp();
            let up = DVec3::Z * 0.05 * fade;
            grain_row(
                &mut table,
                t,
                grain,
                *place + up,
                -up / 0.08,
                *turn,
                DVec3::ZERO,
                (4.0 * (1.0 - fade)) as usize,
            );
        }
    }
    write(folder, "grains.csv", &table);
    let grains =
        format!("[[grain]]\nfile = \"rock.grain\"\ndensity = 2650.0\nequivalent_diameter = {D}\n")
            .repeat(count);
    write(
        folder,
        "case.resolved.toml",
        &format!(
            "gravity = [0, 0, -9.81]\n[domain]\nsize = [0.04, 0.04, 0.1]\ncells = [20, 20, 50]\n{grains}"
        ),
    );
    write(
        folder,
        "diagnostics.csv",
        "time,step,max_divergence,grain_kinetic_energy\n0,0,0,1e-3\n0.3,5,0,1e-5\n0.6,10,0,1e-9\n",
    );
    write(
        folder,
        "summary.json",
        "{\"steps\":10,\"end_time_s\":0.6,\"wall_s\":3.0,\"events\":[],\"max_divergence\":0}",
    );
    if surfaces {
        std::fs::create_dir_all(folder.join("grains")).unwrap();
        let last = 0.01 * rows as f64;
        let up = DVec3::Z * 0.05 * (-last / 0.08).exp();
        let poses: Vec<(DVec3, DQuat)> = rest.iter().map(|(p, q)| (*p + up, *q)).collect();
        write_surfaces(&folder.join("grains/grains_000060.vtp"), &poses, last);
    }
}
