//! Help for the tests of the command line.

use std::path::{Path, PathBuf};

use assert_cmd::Command;

/// The program.
pub fn grainwake() -> Command {
    let mut command = Command::cargo_bin("grainwake").unwrap();
    command.env("NO_COLOR", "1");
    command
}

/// Two grains in a small box of water, 8 x 8 x 24 cells; steps and outputs in plenty.
pub const WET: &str = r#"
title = "small and wet"
[fluid]
density = 1000
viscosity = "5 mPa s"
[domain]
size = ["4 mm", "4 mm", "12 mm"]
cell_size = "0.5 mm"
boundaries = { x = "periodic", y = "periodic" }
[time]
end = "60 ms"
[output]
tables = "2 ms"
slices = "10 ms"
fields = "20 ms"
checkpoint_steps = 7
[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
nodes = 200
density = 2500
position = ["2 mm", "2 mm", "3 mm"]
[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
nodes = 200
density = 2500
position = ["2.1 mm", "2 mm"]
gap_above = { grain = 0, gap = "1 mm" }
"#;

/// Three grains that fall on a floor, without fluid.
pub const DRY: &str = r#"
title = "small and dry"
[domain]
size = ["10 mm", "10 mm", "30 mm"]
[contact]
stiffness = 1500
restitution = 0.8
[time]
end = "120 ms"
step = "0.1 ms"
[output]
tables = "1 ms"
surfaces = "20 ms"
checkpoint_steps = 50
[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
nodes = 200
density = 2500
position = ["5 mm", "5 mm", "5 mm"]
[[grain]]
shape = { kind = "sphere", diameter = "3 mm" }
nodes = 300
density = 2500
position = ["5.2 mm", "5 mm", "12 mm"]
angular_velocity = [10, 0, 5]
[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
nodes = 200
density = 2500
position = ["4.9 mm", "5.1 mm", "20 mm"]
"#;

/// A folder with a case file in it.
pub fn folder_with(case: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("case.toml");
    std::fs::write(&path, case).unwrap();
    (folder, path)
}

/// Files below a folder with their contents, sorted.
pub fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    fn collect(folder: &Path, root: &Path, found: &mut Vec<(String, Vec<u8>)>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                collect(&path, root, found);
            } else {
                let name = path.strip_prefix(root).unwrap().to_string_lossy().into_owned();
                found.push((name, std::fs::read(&path).unwrap()));
            }
        }
    }
    let mut found = Vec::new();
    collect(folder, folder, &mut found);
    found.sort();
    found
}

/// Asserts that two run folders have equal bits, except for provenance, wall time, the report, and
/// the unfinished file of a killed process, which is removed after a day.
pub fn assert_same_run(a: &Path, b: &Path) {
    let ignored = |name: &str| {
        ["provenance.json", "report.html"].contains(&name)
            || name.starts_with("figures/")
            || name.ends_with(".tmp")
    };
    let strip = |files: Vec<(String, Vec<u8>)>| -> Vec<(String, Vec<u8>)> {
        files
            .into_iter()
            .filter(|(name, _)| !ignored(name))
            .map(|(name, bytes)| {
                if name != "summary.json" {
                    return (name, bytes);
                }
                let mut summary: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
                for key in ["wall_s", "cpu_s", "passes"] {
                    summary[key] = 0.into();
                }
                (name, summary.to_string().into_bytes())
            })
            .collect()
    };
    let (a, b) = (strip(contents(a)), strip(contents(b)));
    let names = |files: &[(String, Vec<u8>)]| {
        files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>()
    };
    assert_eq!(names(&a), names(&b));
    for ((name, a), (_, b)) in a.iter().zip(&b) {
        assert!(a == b, "{name} differs");
    }
}
