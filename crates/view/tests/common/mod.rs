//! A small run folder: two spheres, one slice, one event.

use std::io::Write as _;
use std::path::Path;

use glam::{DQuat, DVec3};
use grainwake_formats::events::{Event, EventKind};
use grainwake_formats::grains::{GrainRow, HEADER};
use grainwake_formats::vti::{self, Array, Frame, Image};
use tempfile::TempDir;

const CASE: &str = r#"
title = "Two spheres"
gravity = [0.0, 0.0, -9.81]
[domain]
size = [0.01, 0.01, 0.02]
cells = [4, 4, 8]
origin = [0.0, 0.0, 0.0]
[domain.boundaries]
x = ["wall", "wall"]
y = ["wall", "wall"]
z = ["wall", "wall"]
[fluid]
density = 1000.0
kinematic_viscosity = 1e-6
[[grain]]
shape = { kind = "sphere", diameter = 2e-3 }
density = 1500.0
[[grain]]
shape = { kind = "sphere", diameter = 3e-3 }
density = 1500.0
"#;

/// Creates the folder of a run that has not finished.
pub fn run_folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("case.resolved.toml"), CASE).unwrap();
    std::fs::write(path.join("grains.csv"), format!("{HEADER}\n")).unwrap();
    append_row(path, 0.0);
    append_row(path, 0.1);
    let event = Event::new(EventKind::Kiss, 0.1, &[0, 1]).to_line().unwrap();
    std::fs::write(path.join("events.jsonl"), event).unwrap();
    std::fs::create_dir(path.join("slices")).unwrap();
    write_slice(&path.join("slices/y-grain0_000000.vti"), 0.0, 0.5);
    folder
}

/// Writes a slice with all components of the velocity equal to `speed` [m/s].
pub fn write_slice(file: &Path, time: f64, speed: f32) {
    let image = Image {
        frame: Frame {
            cells: [4, 1, 8],
            spacing: DVec3::splat(2.5e-3),
            origin: DVec3::new(0.0, 5e-3, 0.0),
            time,
        },
        arrays: vec![Array {
            name: "velocity".into(),
            components: 3,
            data: vec![speed; 3 * 4 * 8],
        }],
    };
    vti::write(file, &image).unwrap();
}

/// Appends the rows of both grains at a time [s].
pub fn append_row(folder: &Path, time: f64) {
    let mut text = String::new();
    for grain in 0..2 {
        let row = GrainRow {
            time,
            grain,
            position: DVec3::new(5e-3, 5e-3, 5e-3 + 8e-3 * grain as f64 - 1e-2 * time),
            velocity: DVec3::new(0.0, 0.0, -1e-2),
            orientation: DQuat::IDENTITY,
            angular_velocity: DVec3::ZERO,
            force: Some(DVec3::new(0.0, 0.0, 1e-5)),
            torque: Some(DVec3::ZERO),
            contacts: Some(0),
        };
        row.append_to(&mut text);
    }
    let mut file =
        std::fs::OpenOptions::new().append(true).open(folder.join("grains.csv")).unwrap();
    file.write_all(text.as_bytes()).unwrap();
}
