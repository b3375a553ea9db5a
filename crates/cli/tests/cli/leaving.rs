//! A grain that leaves the box is gone from the outputs.

use std::path::Path;

use crate::common::grainwake;

/// Runs the case of a sphere that falls through an outflow, at 4 cells across, and returns the
/// folder.
fn left() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/open-sides");
    let mut command = grainwake();
    command.arg("run").arg(cases.join("leaving.toml")).arg("-o").arg(folder.path().join("run"));
    command.args(["--quiet", "--no-report", "--set", "domain.cell_size=0.5 mm"]);
    command.args(["--set", "output.surfaces=10 ms"]).assert().success();
    folder
}

#[test]
fn a_grain_that_left_is_gone_from_all_outputs() {
    let folder = left();
    let run = folder.path().join("run");
    let text = |name: &str| std::fs::read_to_string(run.join(name)).unwrap();
    let events: Vec<serde_json::Value> =
        text("events.jsonl").lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let event = events.iter().find(|event| event["event"] == "left").expect("an event");
    let time = event["time"].as_f64().unwrap();
    assert!((0.08..0.1).contains(&time), "left at {time} s");

    let table = text("grains.csv");
    let rows = table.lines().skip(1).map(|row| {
        let values: Vec<f64> = row.split(',').map(|value| value.parse().unwrap()).collect();
        (values[0], values[7])
    });
    let rows: Vec<(f64, f64)> = rows.collect();
    let (last, speed) = *rows.last().unwrap();
    assert!(time - 2e-3 < last && last <= time, "last row at {last} s");
    // It does not return, and the run goes on without it.
    assert!(rows.iter().skip(1).all(|(_, vz)| *vz < 0.0) && speed < -0.1, "{speed} m/s");
    let diagnostics = text("diagnostics.csv");
    let end: f64 = diagnostics.lines().last().unwrap().split(',').next().unwrap().parse().unwrap();
    assert!((end - 0.12).abs() < 1e-9);

    let summary: serde_json::Value = serde_json::from_str(&text("summary.json")).unwrap();
    assert!(summary["grains"][0]["position_m"].is_null());
    // Surfaces: a file at each output time, with triangles only until it left.
    let mut surfaces: Vec<_> =
        std::fs::read_dir(run.join("grains")).unwrap().map(|file| file.unwrap().path()).collect();
    surfaces.sort();
    let points = |file: &Path| {
        let bytes = std::fs::read(file).unwrap();
        let head = String::from_utf8_lossy(&bytes[..bytes.len().min(2000)]).into_owned();
        let number = head.split_once("NumberOfPoints=\"").unwrap().1.split('"').next().unwrap();
        number.parse::<usize>().unwrap()
    };
    assert!(points(&surfaces[0]) > 0);
    assert_eq!(points(surfaces.last().unwrap()), 0);
}
