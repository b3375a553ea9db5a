//! Probes: tables of points, lines and planes, their continuation, and what is refused.

use std::path::Path;

use crate::common::{DRY, WET, assert_same_run, folder_with, grainwake};
use predicates::prelude::*;
use predicates::str::contains;

const PROBES: &str = r#"
[[probe]]
name = "middle"
every = "1 ms"
plane = { normal = "z", at = "4.5 mm" }
[[probe]]
point = ["2 mm", "2 mm", "6 mm"]
[[probe]]
name = "axis"
every = "5 ms"
line = { from = ["2 mm", "2 mm", 0], to = ["2 mm", "2 mm", "12 mm"], points = 5 }
[[probe]]
name = "corners"
every = "20 ms"
points = [[0, 0, 0], ["4 mm", "4 mm", "12 mm"]]
"#;

fn run(case: &Path, out: &Path, more: &[&str]) {
    let mut command = grainwake();
    command.arg("run").arg(case).args(["--quiet", "--no-report", "-o"]).arg(out).args(more);
    command.assert().success();
}

/// Rows of a table as numbers, after its header.
fn table(run: &Path, name: &str, header: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(run.join("probes").join(name)).unwrap();
    let (first, rest) = text.split_once('\n').unwrap();
    assert_eq!(first, header);
    rest.lines().map(|line| line.split(',').map(|n| n.parse().unwrap()).collect()).collect()
}

/// Volume of a sphere of 2 mm below a plane at `height` [m] above its centre.
fn volume_below(height: f64) -> f64 {
    let r = 1e-3;
    let h = (r + height).clamp(0.0, 2.0 * r);
    std::f64::consts::PI * h * h * (3.0 * r - h) / 3.0
}

#[test]
fn probes_write_their_tables_and_a_resumed_run_continues_them() {
    let (folder, case) = folder_with(&format!("{WET}{PROBES}"));
    let (whole, parts) = (folder.path().join("whole"), folder.path().join("parts"));
    grainwake().arg("check").arg(&case).assert().success().stdout(
        contains("plane z = 4.5 mm, every 1 ms (probes/middle.csv)")
            .and(contains("point [2 mm, 2 mm, 6 mm], every 2 ms (probes/probe1.csv)"))
            .and(contains("5 points, every 5 ms (probes/axis.csv)")),
    );
    run(&case, &whole, &[]);

    let points = "time,point,x,y,z,vx,vy,vz,pressure,solid_fraction";
    let middle = table(&whole, "middle.csv", "time,volume_flux,grain_flux,solid_fraction,pressure");
    let axis = table(&whole, "axis.csv", points);
    assert_eq!((middle.len(), axis.len()), (61, 13 * 5));
    assert_eq!(table(&whole, "probe1.csv", points).len(), 31);
    assert_eq!(table(&whole, "corners.csv", points).len(), 4 * 2);
    for (n, row) in axis.iter().enumerate() {
        assert!((row[0] - 5e-3 * (n / 5) as f64).abs() < 1e-12);
        assert_eq!((row[1], row[4]), ((n % 5) as f64, 3e-3 * (n % 5) as f64));
    }
    // The first point lies on the floor, the last on the lid.
    assert!(axis.iter().filter(|row| row[1] == 0.0).all(|row| row[5..8] == [0.0; 3]));
    // The upper grain passes the plane; fluid rises in its place.
    let passed: f64 = middle.windows(2).map(|w| 0.5e-3 * (w[0][2] + w[1][2])).sum();
    let grains = std::fs::read_to_string(whole.join("grains.csv")).unwrap();
    let last: Vec<f64> =
        grains.lines().last().unwrap().split(',').map(|n| n.parse().unwrap()).collect();
    let exact = volume_below(4.5e-3 - last[4]);
    assert!(exact > 2e-9, "{exact:e}");
    assert!((passed + exact).abs() < 0.02 * exact, "{passed:e}, not -{exact:e}");
    for row in &middle {
        assert!(row[1].abs() < 1e-17, "{row:?}");
    }

    // The tables are cut back to the checkpoint and continued.
    run(&case, &parts, &["--set", "time.end=20 ms"]);
    for name in ["middle.csv", "axis.csv"] {
        let path = parts.join("probes").join(name);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text + "1,2,3\n4").unwrap();
    }
    run(&case, &parts, &["--resume"]);
    assert_same_run(&whole, &parts);
    // A run that starts from a checkpoint of another begins its tables there.
    let branch = folder.path().join("branch");
    let from = whole.to_str().unwrap();
    run(&case, &branch, &["--from", from, "--set", "time.end=64 ms"]);
    let times: Vec<f64> =
        table(&branch, "middle.csv", "time,volume_flux,grain_flux,solid_fraction,pressure")
            .iter()
            .map(|row| row[0])
            .collect();
    assert_eq!(times.len(), 5);
    assert!((times[0] - 60e-3).abs() < 1e-12 && (times[4] - 64e-3).abs() < 1e-12, "{times:?}");
    // The resolved case names the probes and has the same results.
    let resolved = folder.path().join("resolved");
    run(&whole.join("case.resolved.toml"), &resolved, &[]);
    assert_same_run(&whole, &resolved);
}

#[test]
fn the_last_state_is_written_and_a_new_run_removes_old_tables() {
    let (folder, case) = folder_with(&format!("{WET}{PROBES}"));
    let out = folder.path().join("run");
    run(&case, &out, &["--set", "time.end=7 ms", "--set", "probe.2.every=0"]);
    let header = "time,volume_flux,grain_flux,solid_fraction,pressure";
    assert_eq!(table(&out, "middle.csv", header).last().unwrap()[0], 7e-3);
    let points = "time,point,x,y,z,vx,vy,vz,pressure,solid_fraction";
    let corners = table(&out, "corners.csv", points);
    assert_eq!(corners.iter().map(|row| row[0]).collect::<Vec<_>>(), [0.0, 0.0, 7e-3, 7e-3]);
    assert_eq!(table(&out, "axis.csv", points).len(), 0);
    let (_other, without) = folder_with(WET);
    run(&without, &out, &["--force", "--set", "time.end=7 ms"]);
    assert!(!out.join("probes").exists());
}

#[test]
fn probes_that_cannot_be_are_refused_with_their_place() {
    let refused = |case: &str, set: &[&str], words: &[&str]| {
        let (_folder, path) = folder_with(case);
        let mut command = grainwake();
        command.arg("check").arg(&path);
        set.iter().for_each(|set| {
            command.args(["--set", set]);
        });
        let output = command.assert().code(2).get_output().stderr.clone();
        let message = String::from_utf8(output).unwrap();
        for word in words {
            assert!(message.contains(word), "`{word}` is missing in:\n{message}");
        }
    };
    let case = format!("{WET}{PROBES}");
    let set = |key: &str, words: &[&str]| refused(&case, &[key], words);
    set("probe.0.plane.at=\"13 mm\"", &["probe.0.plane.at", "13 mm lies outside", "0 m and 12 mm"]);
    set("probe.0.plane.normal=\"w\"", &["probe.0.plane.normal", "found \"w\"", "\"x\", \"y\""]);
    set("probe.0.name=\"a/b\"", &["probe.0.name", "no name of a probe", "letters, digits"]);
    set("probe.0.name=\"Axis\"", &["probe.2.name", "there is a probe \"Axis\" already"]);
    set("probe.1.point=[0, 0, \"-1 mm\"]", &["probe.1.point", "lies outside the box"]);
    set("probe.2.line.points=1", &["probe.2.line.points", "found 1 points", "2 to"]);
    set("probe.2.line.to=[0, 0, 1]", &["probe.2.line.to", "lies outside the box"]);
    set("probe.0.every=\"1 ns\"", &["probe.0.every", "million outputs"]);
    set("probe.1.plane={ normal = \"z\", at = 0 }", &["probe.1", "give one of `point`"]);
    let bad = case.replace("[\"4 mm\", \"4 mm\", \"12 mm\"]]", "[\"4 mm\", \"5 mm\", \"12 mm\"]]");
    refused(&bad, &[], &["case.toml:", "probe.3.points.1", "lies outside the box"]);
    let dry = format!("{DRY}\n[[probe]]\npoint = [0, 0, 0]\n");
    refused(&dry, &[], &["there is no fluid to probe", "add [fluid]"]);
}
