//! Run folders made up from closed forms: smooth paths, bumpy grains, Lamb-Oseen vortices.
#![allow(dead_code)]

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DQuat, DVec3};
use grainwake_formats::vti;

pub const D: f64 = 2e-3;
pub const G: f64 = 9.81;

/// A fresh empty folder.
pub fn folder(name: &str) -> PathBuf {
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let unique =
        format!("grainwake-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
    let unique = std::env::temp_dir().join(unique);
    // Left by an earlier process with the same number.
    let _ = std::fs::remove_dir_all(&unique);
    let path = unique.join(name);
    std::fs::create_dir_all(&path).unwrap();
    path
}

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

/// A bumpy ellipsoid in its own frame.
fn bumpy() -> (Vec<DVec3>, Vec<[usize; 3]>) {
    let (rows, columns) = (24, 40);
    let mut points = Vec::new();
    for i in 0..=rows {
        let theta = PI * i as f64 / rows as f64;
        for j in 0..columns {
            let phi = TAU * j as f64 / columns as f64;
            let n = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            let bump = 1.0
                + theta.sin()
                    * (0.07 * (3.0 * phi + 1.0).sin()
                        + 0.06 * (5.0 * n.z).cos() * (2.0 * phi).sin());
            points.push(0.5 * D * bump * n * DVec3::new(1.3, 1.0, 0.75));
        }
    }
    let mut triangles = Vec::new();
    for i in 0..rows {
        for j in 0..columns {
            let at = |i: usize, j: usize| i * columns + j % columns;
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    (points, triangles)
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

/// One VTK file with raw appended arrays of 32-bit reals.
struct Appended {
    heads: String,
    data: Vec<u8>,
}

impl Appended {
    fn new() -> Appended {
        Appended { heads: String::new(), data: Vec::new() }
    }
    fn head(&mut self, kind: &str, name: &str, components: usize, bytes: Vec<u8>) -> String {
        let offset = self.data.len();
        self.data.extend((bytes.len() as u64).to_le_bytes());
        self.data.extend(bytes);
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"appended\" offset=\"{offset}\"/>\n"
        )
    }
    fn reals(&mut self, name: &str, components: usize, values: &[f64]) -> String {
        self.head(
            "Float32",
            name,
            components,
            values.iter().flat_map(|v| (*v as f32).to_le_bytes()).collect(),
        )
    }
    fn integers(&mut self, name: &str, values: &[usize]) -> String {
        self.head("Int32", name, 1, values.iter().flat_map(|v| (*v as i32).to_le_bytes()).collect())
    }
    fn file(&self, kind: &str, body: &str) -> Vec<u8> {
        let mut out = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n{body}\n<AppendedData encoding=\"raw\">\n_"
        )
        .into_bytes();
        out.extend(&self.data);
        out.extend(b"\n</AppendedData>\n</VTKFile>\n");
        out
    }
}

/// Cell values of a slice: velocity, vorticity, pressure, solid fraction.
type Cell = (DVec3, DVec3, f64, f64);

fn write_slice(
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

fn write_surfaces(file: &Path, grains: &[(DVec3, DQuat)], time: f64) {
    let (points, triangles) = bumpy();
    let (mut all, mut corners, mut ends, mut owner) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (grain, (position, turn)) in grains.iter().enumerate() {
        let first = all.len() / 3;
        all.extend(points.iter().flat_map(|p| (*position + *turn * *p).to_array()));
        for triangle in &triangles {
            corners.extend(triangle.map(|i| i + first));
            ends.push(corners.len());
            owner.push(grain);
        }
    }
    let mut out = Appended::new();
    let (n, m) = (all.len() / 3, ends.len());
    let parts = [
        out.reals("Points", 3, &all),
        out.integers("connectivity", &corners),
        out.integers("offsets", &ends),
        out.integers("grain", &owner),
    ];
    let body = format!(
        "<PolyData>\n<FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{time:?}</DataArray></FieldData>\n<Piece NumberOfPoints=\"{n}\" NumberOfPolys=\"{m}\"><CellData>\n{}</CellData><Points>\n{}</Points><Polys>\n{}{}</Polys></Piece></PolyData>",
        parts[3], parts[0], parts[1], parts[2]
    );
    std::fs::write(file, out.file("PolyData", &body)).unwrap();
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

const HEADER: &str = "time,grain,x,y,z,vx,vy,vz,qw,qx,qy,qz,wx,wy,wz,fx,fy,fz,tx,ty,tz,contacts\n";

fn grain_row(
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

fn write(folder: &Path, name: &str, content: &str) {
    std::fs::write(folder.join(name), content).unwrap();
}

fn diagnostics(end: f64, rows: usize, gap: impl Fn(f64) -> Option<f64>) -> String {
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

fn provenance(folder: &Path) {
    write(
        folder,
        "provenance.json",
        "{\"program\":\"grainwake\",\"version\":\"0.1.0\",\"commit\":\"0123abc\",\"case_sha256\":\"00ff\",\"sessions\":[{\"started\":\"2026-11-21T04:30:00+00:00\",\"command\":[\"grainwake\",\"run\",\"cases/dkt-pair/case.toml\"],\"cpu\":\"some cpu\",\"system\":\"linux x86_64\",\"threads\":2,\"from_step\":0,\"wall_s\":1234.5}]}",
    );
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
