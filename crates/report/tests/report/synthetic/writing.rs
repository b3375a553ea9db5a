//! Files of run folders: tables, logs and slices.

use std::fmt::Write as _;
use std::path::Path;

use glam::{DQuat, DVec3};
use grainwake_formats::vti;

/// Cell values of a slice: velocity, vorticity, pressure, solid fraction.
type Cell = (DVec3, DVec3, f64, f64);

pub fn write_slice(
    file: &Path,
    cells: [usize; 2],
    h: f64,
    y: f64,
    time: f64,
    value: impl Fn(DVec3) -> Cell,
) {
    let [nx, nz] = cells;
    let mut arrays =
        [("velocity", 3), ("vorticity", 3), ("pressure", 1), ("solid_fraction", 1)].map(
            |(name, components)| vti::Array { name: name.to_owned(), components, data: Vec::new() },
        );
    for k in 0..nz {
        for i in 0..nx {
            let (u, w, p, s) = value(DVec3::new((i as f64 + 0.5) * h, y, (k as f64 + 0.5) * h));
            arrays[0].data.extend(u.as_vec3().to_array());
            arrays[1].data.extend(w.as_vec3().to_array());
            arrays[2].data.push(p as f32);
            arrays[3].data.push(s as f32);
        }
    }
    let image = vti::Image {
        frame: vti::Frame {
            cells: [nx, 1, nz],
            spacing: DVec3::splat(h),
            origin: DVec3::new(0.0, y - 0.5 * h, 0.0),
            time,
        },
        arrays: arrays.to_vec(),
    };
    vti::write(file, &image).unwrap();
}

pub const HEADER: &str =
    "time,grain,x,y,z,vx,vy,vz,qw,qx,qy,qz,wx,wy,wz,fx,fy,fz,tx,ty,tz,contacts\n";

pub fn grain_row(
    out: &mut String,
    time: f64,
    grain: usize,
    x: DVec3,
    v: DVec3,
    q: DQuat,
    w: DVec3,
    contacts: usize,
) {
    writeln!(
        out,
        "{time},{grain},{},{},{},{},{},{},{},{},{},{},{},{},{},0,0,0,0,0,0,{contacts}",
        x.x, x.y, x.z, v.x, v.y, v.z, q.w, q.x, q.y, q.z, w.x, w.y, w.z
    )
    .unwrap();
}

pub fn write(folder: &Path, name: &str, content: &str) {
    std::fs::write(folder.join(name), content).unwrap();
}

pub fn diagnostics(end: f64, rows: usize, gap: impl Fn(f64) -> Option<f64>) -> String {
    let mut out = String::from(
        "time,step,max_divergence,max_velocity,cfl,slip,fluid_kinetic_energy,grain_kinetic_energy,momentum_residual,gap\n",
    );
    for i in 0..=rows {
        let t = end * i as f64 / rows as f64;
        let s = i as f64 / rows as f64;
        let noise = 1.0 + 0.6 * (37.0 * s).sin() * (91.0 * s).cos();
        let gap = gap(t).map_or(String::new(), |gap| gap.to_string());
        writeln!(
            out,
            "{t},{i},{:e},0.1,{},1e-4,{:e},{:e},{:e},{gap}",
            2e-12 * noise,
            0.3 * (1.0 - (-8.0 * s).exp()) + 0.01 * noise,
            2.1e-7 * s,
            4e-8 * (1.0 - (-9.0 * s).exp()),
            3e-11 * noise
        )
        .unwrap();
    }
    out
}

pub fn provenance(folder: &Path) {
    write(
        folder,
        "provenance.json",
        "{\"program\":\"grainwake\",\"version\":\"0.1.0\",\"commit\":\"0123abc\",\"case_sha256\":\"00ff\",\"sessions\":[{\"started\":\"2026-11-21T04:30:00+00:00\",\"command\":[\"grainwake\",\"run\",\"cases/dkt-pair/case.toml\"],\"cpu\":\"some cpu\",\"system\":\"linux x86_64\",\"threads\":2,\"from_step\":0,\"wall_s\":1234.5,\"passes\":[{\"name\":\"predict\",\"wall_s\":1000,\"cpu_s\":2000},{\"name\":\"output\",\"wall_s\":2,\"cpu_s\":2}]}]}",
    );
}
