//! Grains whose centroid lies outside their solid: rings, C shapes, tubes and bowls. The test of
//! overlap at the start is the distance of the contact model, and the contacts hold.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt::Write;
use std::path::Path;

use crate::common::grainwake;
use predicates::str::contains;

/// Writes the solid that a closed, counterclockwise polygon of (r, z) [mm] sweeps over an angle.
fn sweep(path: &Path, profile: &[[f64; 2]], span: f64) {
    const STEPS: usize = 48;
    let closed = span == TAU;
    let rows = if closed { STEPS } else { STEPS + 1 };
    let (mut vertices, mut text) = (0, String::new());
    let mut index = vec![vec![0; profile.len()]; rows];
    for i in 0..rows {
        let (sin, cos) = (span * i as f64 / STEPS as f64).sin_cos();
        for (j, [r, z]) in profile.iter().enumerate() {
            if *r == 0.0 && i > 0 {
                index[i][j] = index[0][j];
                continue;
            }
            vertices += 1;
            index[i][j] = vertices;
            writeln!(text, "v {} {} {z}", r * cos, r * sin).unwrap();
        }
    }
    let face = |text: &mut String, t: [usize; 3]| {
        if t[0] != t[1] && t[1] != t[2] && t[2] != t[0] {
            writeln!(text, "f {} {} {}", t[0], t[1], t[2]).unwrap();
        }
    };
    for i in 0..STEPS {
        for j in 0..profile.len() {
            let (k, l) = ((i + 1) % rows, (j + 1) % profile.len());
            let [a, b, c, d] = [index[i][j], index[i][l], index[k][l], index[k][j]];
            face(&mut text, [a, c, b]);
            face(&mut text, [a, d, c]);
        }
    }
    for end in [0, rows - 1].into_iter().filter(|_| !closed) {
        let (sin, cos) = (span * end as f64 / STEPS as f64).sin_cos();
        let mean =
            |axis: usize| profile.iter().map(|p| p[axis]).sum::<f64>() / profile.len() as f64;
        vertices += 1;
        writeln!(text, "v {} {} {}", mean(0) * cos, mean(0) * sin, mean(1)).unwrap();
        for j in 0..profile.len() {
            let (a, b) = (index[end][j], index[end][(j + 1) % profile.len()]);
            face(&mut text, if end == 0 { [vertices, a, b] } else { [vertices, b, a] });
        }
    }
    std::fs::write(path, text).unwrap();
}

/// Circle of radius 0.8 mm around r = 3 mm, the profile of a torus.
fn ring() -> Vec<[f64; 2]> {
    let at = |k: usize| (TAU * k as f64 / 24.0).sin_cos();
    (0..24).map(|k| [3.0 + 0.8 * at(k).1, 0.8 * at(k).0]).collect()
}

/// Half of a spherical shell that opens along +z.
fn bowl(outer: f64, inner: f64) -> Vec<[f64; 2]> {
    let arc = |radius: f64, k: usize| {
        let (sin, cos) = (FRAC_PI_2 * k as f64 / 12.0).sin_cos();
        if k == 0 { [0.0, -radius] } else { [radius * sin, -radius * cos] }
    };
    let outside = (0..=12).map(|k| arc(outer, k));
    outside.chain((0..=12).rev().map(|k| arc(inner, k))).collect()
}

/// Folder with a grain file for each profile.
fn folder(solids: &[(&str, Vec<[f64; 2]>, f64)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, profile, span) in solids {
        let mesh = folder.path().join(format!("{name}.obj"));
        sweep(&mesh, profile, *span);
        let mut command = grainwake();
        command.args(["grain", "from-mesh"]).arg(&mesh).args(["--unit", "1 mm", "--cells", "64"]);
        command.arg("-o").arg(folder.path().join(format!("{name}.grain"))).assert().success();
    }
    folder
}

/// Case of a dry box of 14 mm with these grains.
fn case(folder: &Path, grains: &str) -> std::path::PathBuf {
    let path = folder.join("case.toml");
    let head = r#"
[domain]
size = ["14 mm", "14 mm", "14 mm"]
[contact]
restitution = 0.3
global_damping = 20
[time]
end = "150 ms"
[output]
surfaces = 0
"#;
    std::fs::write(&path, format!("{head}{grains}")).unwrap();
    path
}

fn grain(shape: &str, position: [f64; 3], more: &str) -> String {
    let [x, y, z] = position.map(|x| format!("\"{x} mm\""));
    format!("[[grain]]\n{shape}\ndensity = 2650\nposition = [{x}, {y}, {z}]\n{more}\n")
}

fn check(folder: &Path, grains: &str) -> assert_cmd::assert::Assert {
    grainwake().arg("check").arg(case(folder, grains)).assert()
}

/// Runs a case and returns the heights of the grains at the end [mm].
fn heights(folder: &Path, grains: &str) -> Vec<f64> {
    let out = folder.join("run");
    let mut command = grainwake();
    command.arg("run").arg(case(folder, grains)).arg("-o").arg(&out);
    command.args(["--no-report", "--force"]).assert().success();
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert!(summary["max_overlap"].as_f64().unwrap() < 0.02, "{summary}");
    let grains = summary["grains"].as_array().unwrap();
    grains.iter().map(|grain| 1e3 * grain["position_m"][2].as_f64().unwrap()).collect()
}

const TORUS: &str = "file = \"torus.grain\"";
const ON_EDGE: &str = "orientation = { short_axis = \"y\" }";
const HELD: &str = "motion = \"fixed\"";

#[test]
fn a_sphere_in_the_hole_of_a_ring_touches_nothing() {
    let folder = folder(&[("torus", ring(), TAU), ("c", ring(), 0.75 * TAU)]);
    let ball = |d: f64, x: f64| {
        let shape = format!("shape = {{ kind = \"sphere\", diameter = \"{d} mm\" }}");
        grain(&shape, [x, 7.0, 4.0], "")
    };
    let torus = grain(TORUS, [7.0, 7.0, 4.0], HELD);
    // The hole is 4.4 mm wide.
    check(folder.path(), &format!("{torus}{}", ball(4.3, 7.0))).success();
    let touching = check(folder.path(), &format!("{torus}{}", ball(4.3, 7.15)));
    touching.code(2).stderr(contains("grains 0 and 1 overlap at the start by 98."));
    // It falls through the held ring onto the floor.
    let z = heights(folder.path(), &format!("{torus}{}", ball(4.0, 7.0)));
    assert!((z[1] - 2.0).abs() < 0.03, "{z:?}");
    // The centroid of three quarters of a ring lies 1.3 mm from the tube.
    let c = grain("file = \"c.grain\"", [7.0, 7.0, 4.0], HELD);
    check(folder.path(), &format!("{c}{}", ball(2.4, 7.0))).success();
}

#[test]
fn linked_rings_hang_in_each_other() {
    let folder = folder(&[("torus", ring(), TAU)]);
    let upper = grain(TORUS, [6.0, 7.0, 9.0], &format!("{HELD}\n{ON_EDGE}"));
    // The lower ring lies flat and passes through the hole of the upper one.
    let lower = |x: f64, z: f64| grain(TORUS, [x, 7.0, z], "");
    check(folder.path(), &format!("{upper}{}", lower(9.0, 9.0))).success();
    check(folder.path(), &format!("{upper}{}", lower(6.0, 9.0)))
        .code(2)
        .stderr(contains("grains 0 and 1 overlap at the start"));
    // Two equal rings at one place have no distance between their surfaces.
    check(folder.path(), &format!("{}{}", lower(7.0, 7.0), lower(7.0, 7.0)))
        .code(2)
        .stderr(contains("grains 0 and 1 overlap at the start by 0."));
    // Linked, the lower ring cannot fall: its tube rests on that of the upper ring.
    let z = heights(folder.path(), &format!("{upper}{}", lower(9.0, 9.0)));
    assert!(z[1] > 3.0 && z[1] < 8.0, "{z:?}");
    let bottom_of_hole = 9.0 - 2.2;
    assert!(z[1] - 3.8 < bottom_of_hole, "{z:?}");
}

#[test]
fn a_peg_falls_through_a_ring_without_touching() {
    let tube = vec![[1.2, -1.0], [3.0, -1.0], [3.0, 1.0], [1.2, 1.0]];
    let folder = folder(&[("tube", tube, TAU)]);
    let tube = grain("file = \"tube.grain\"", [7.0, 7.0, 7.0], HELD);
    let peg = |d: f64| {
        let shape =
            format!("shape = {{ kind = \"cylinder\", diameter = \"{d} mm\", height = \"4 mm\" }}");
        grain(&shape, [7.0, 7.0, 7.5], "orientation = { long_axis = \"z\" }")
    };
    check(folder.path(), &format!("{tube}{}", peg(2.2))).success();
    check(folder.path(), &format!("{tube}{}", peg(2.6)))
        .code(2)
        .stderr(contains("overlap at the start"));
    let z = heights(folder.path(), &format!("{tube}{}", peg(2.0)));
    // It stands on the floor, or has toppled.
    assert!(z[1] < 2.1, "{z:?}");
}

#[test]
fn a_bowl_rests_in_a_larger_bowl() {
    let folder = folder(&[("big", bowl(3.0, 2.6), TAU), ("small", bowl(2.3, 1.9), TAU)]);
    // Centroid of half a shell, below the centre of its spheres.
    let below = |o: f64, i: f64| 0.375 * (o.powi(4) - i.powi(4)) / (o.powi(3) - i.powi(3));
    let place = |file: &str, outer: f64, inner: f64, flipped: bool, more: &str| {
        let turn = "rotate = { axis = \"x\", angle = \"180 deg\" }";
        let more = format!("{more}\n{}", if flipped { turn } else { "" });
        let height = 7.0 - below(outer, inner);
        grain(&format!("file = \"{file}.grain\""), [7.0, 7.0, height], &more)
    };
    let pair = |[big, small]: [bool; 2]| {
        place("big", 3.0, 2.6, big, HELD) + &place("small", 2.3, 1.9, small, "")
    };
    // The principal frame does not tell up from down: in one of four ways both open upwards, and
    // then the bowls are concentric.
    let ways = [[false, false], [false, true], [true, false], [true, true]];
    let fits = |way: &[bool; 2]| {
        let mut command = grainwake();
        command.arg("check").arg(case(folder.path(), &pair(*way)));
        command.output().unwrap().status.success()
    };
    let fitting: Vec<[bool; 2]> = ways.into_iter().filter(fits).collect();
    assert_eq!(fitting.len(), 1, "{fitting:?}");
    let z = heights(folder.path(), &pair(fitting[0]));
    // The gap of 0.3 mm below the small bowl closes, and it goes no farther.
    let fallen = 7.0 - below(2.3, 1.9) - z[1];
    assert!((0.2..0.33).contains(&fallen), "{fallen}");
}
