//! Output of the commands.

use crate::common::{DRY, WET, folder_with, grainwake};
use grainwake_plot::raster::Picture;
use grainwake_solver::math::InstructionSet;
use predicates::str::contains;
use serde_json::Value;

fn json(stdout: &[u8]) -> Value {
    serde_json::from_slice(stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(stdout)))
}

#[test]
fn run_prints_one_json_object() {
    let (folder, case) = folder_with(WET);
    let out = folder.path().join("run");
    let done = grainwake()
        .arg("run")
        .arg(&case)
        .arg("-o")
        .arg(&out)
        .args(["--json", "--set", "time.end=10 ms"])
        .assert()
        .success();
    let summary = json(&done.get_output().stdout);
    for key in [
        "steps",
        "end_time_s",
        "wall_s",
        "events",
        "max_divergence",
        "kiss_time_s",
        "tumble_time_s",
        "separation_time_s",
        "role_changes",
    ] {
        assert!(summary.get(key).is_some(), "{key} is missing in {summary}");
    }
    assert_eq!(summary["end_time_s"], 0.01);
    let file = json(&std::fs::read(out.join("summary.json")).unwrap());
    assert_eq!(file, summary);
    let provenance = json(&std::fs::read(out.join("provenance.json")).unwrap());
    assert_eq!(provenance["sessions"][0]["from_step"], 0);
    assert_eq!(provenance["sessions"][0]["passes"], summary["passes"]);
}

#[test]
fn the_summary_has_sub_steps_pairs_and_times_of_the_passes() {
    let (folder, case) = folder_with(HEAP);
    let out = folder.path().join("run");
    let run = |more: &[&str]| {
        let done = grainwake().arg("run").arg(&case).arg("-o").arg(&out).args(more).output();
        json(&done.unwrap().stdout)
    };
    let stopped = run(&["--no-report", "--json"]);
    let number = |value: &serde_json::Value| value.as_f64().unwrap_or_else(|| panic!("{value}"));
    let (steps, total) = (number(&stopped["steps"]), number(&stopped["substeps"]["total"]));
    let largest = number(&stopped["substeps"]["largest_per_step"]);
    assert!(total > steps && largest * steps >= total, "{stopped}");
    // One grain lies on the floor at the left wall, the other one on it and at the right wall.
    assert_eq!(stopped["contact_pairs"]["largest"], 4, "{stopped}");
    let mean = number(&stopped["contact_pairs"]["mean"]);
    assert!(mean > 0.5 && mean < 4.0, "{mean}");
    let passes = stopped["passes"].as_array().unwrap();
    let names: Vec<&str> = passes.iter().map(|pass| pass["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["contact", "output", "other"]);
    let sum: f64 = passes.iter().map(|pass| number(&pass["wall_s"])).sum();
    let wall = number(&stopped["wall_s"]);
    assert!((sum / wall - 1.0).abs() < 0.02, "{sum} of {wall}");
    if cfg!(target_os = "linux") {
        let cpu = number(&stopped["cpu_s"]);
        assert!(cpu > 0.0 && cpu < 2.5 * wall, "{cpu} of {wall}");
    }
    // A later end goes on with the counts and adds the time of the second session.
    let extended = run(&["--resume", "--no-report", "--json", "--set", "time.end=60 ms"]);
    assert!(number(&extended["substeps"]["total"]) > total);
    assert!(number(&extended["wall_s"]) > wall);
    let wall_of =
        |summary: &serde_json::Value, pass: usize| number(&summary["passes"][pass]["wall_s"]);
    assert!(wall_of(&extended, 0) > wall_of(&stopped, 0));
}

/// Two spheres on a floor between walls that keep them together.
const HEAP: &str = r#"
[domain]
size = ["3.9 mm", "2.2 mm", "8 mm"]
boundaries = { x = "wall", y = "wall", z = "wall" }

[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
density = 2500
position = ["1.0 mm", "1.1 mm", "1.2 mm"]

[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
density = 2500
position = ["2.89 mm", "1.1 mm", "2.0 mm"]

[time]
end = "40 ms"

[output]
tables = "1 ms"
surfaces = 0
"#;

#[test]
fn a_run_folder_holds_what_the_reference_says() {
    let (folder, case) = folder_with(WET);
    let out = folder.path().join("run");
    grainwake()
        .arg("run")
        .arg(&case)
        .arg("-o")
        .arg(&out)
        .arg("--quiet")
        .args(["--set", "output.checkpoint_steps=0"])
        .assert()
        .success()
        .stdout("")
        .stderr("");
    let grains = std::fs::read_to_string(out.join("grains.csv")).unwrap();
    let mut lines = grains.lines();
    assert_eq!(
        lines.next(),
        Some("time,grain,x,y,z,vx,vy,vz,qw,qx,qy,qz,wx,wy,wz,fx,fy,fz,tx,ty,tz,contacts")
    );
    let rows: Vec<Vec<f64>> =
        lines.map(|l| l.split(',').map(|v| v.parse().unwrap()).collect()).collect();
    assert_eq!(rows.len(), 2 * 31);
    for (n, row) in rows.iter().enumerate() {
        assert!(
            (row[0] - 0.002 * (n / 2) as f64).abs() < 1e-12 && row[1] == (n % 2) as f64,
            "{row:?}"
        );
    }
    let field = grainwake_formats::vti::read(&out.join("fields/fields_000001.vti")).unwrap();
    assert_eq!(field.frame.cells, [8, 8, 24]);
    let array = |name: &str| field.arrays.iter().find(|a| a.name == name).unwrap();
    let solid: f64 =
        array("solid_fraction").data.iter().map(|f| f64::from(*f)).sum::<f64>() * 0.125e-9;
    let spheres = 2.0 * std::f64::consts::PI / 6.0 * 8e-9;
    // Four cells across a sphere.
    assert!((solid / spheres - 1.0).abs() < 0.01, "{solid} {spheres}");
    assert!(array("velocity").data.iter().any(|v| *v < -1e-4));
    let slice = grainwake_formats::vti::read(&out.join("slices/y-grain0_000002.vti")).unwrap();
    assert_eq!((slice.frame.cells, slice.arrays.len()), ([8, 1, 24], 4));
    assert!((slice.frame.time - 0.02).abs() < 1e-12);
    // The slice is a layer of the field.
    let layer = (slice.frame.origin.y / 0.5e-3).round() as usize;
    let pressure = &slice.arrays.iter().find(|a| a.name == "pressure").unwrap().data;
    for k in 0..24 {
        for i in 0..8 {
            assert_eq!(pressure[k * 8 + i], array("pressure").data[(k * 8 + layer) * 8 + i]);
        }
    }
    let collection = std::fs::read_to_string(out.join("run.pvd")).unwrap();
    for file in collection.split("file=\"").skip(1).map(|rest| rest.split('"').next().unwrap()) {
        assert!(out.join(file).is_file(), "{file}");
    }
    let events = std::fs::read_to_string(out.join("events.jsonl")).unwrap();
    let kinds: Vec<Value> = events.lines().map(|l| json(l.as_bytes())["event"].clone()).collect();
    assert!(kinds.contains(&"landing".into()), "{events}");
    assert!(collection.contains("landing-1"), "a picture of the landing");
}

#[test]
fn check_gives_the_derived_numbers() {
    let (_folder, case) = folder_with(WET);
    let done = grainwake().arg("check").arg(&case).arg("--json").assert().success();
    let numbers = json(&done.get_output().stdout);
    for key in [
        "cells",
        "steps",
        "time_step_s",
        "memory_bytes",
        "galileo",
        "cells_per_diameter",
        "drag_error",
        "warnings",
    ] {
        assert!(numbers.get(key).is_some(), "{key}");
    }
    assert_eq!(
        (numbers["cells"].as_u64(), numbers["cells_per_diameter"].as_f64()),
        (Some(1536), Some(4.0))
    );
    assert!(numbers["warnings"].to_string().contains("cells across"));
    let text = grainwake().arg("check").arg(&case).assert().success();
    let text = String::from_utf8_lossy(&text.get_output().stdout).into_owned();
    assert!(text.contains("Galileo number"), "{text}");
    assert!(text.contains("error of the drag") && text.contains("2 % from"), "{text}");
}

#[test]
fn a_run_says_what_check_warns_of() {
    let (folder, case) = folder_with(WET);
    let short = ["--set", "time.end=4 ms"];
    let mut check = grainwake();
    check.arg("check").arg(&case).args(short);
    let check = check.assert().success();
    let message = String::from_utf8_lossy(&check.get_output().stdout).into_owned();
    let warnings: Vec<&str> = message.lines().filter(|l| l.starts_with("warning")).collect();
    assert!(!warnings.is_empty(), "{message}");
    let run = |out: &str, more: &[&str]| {
        let mut command = grainwake();
        command.arg("run").arg(&case).arg("-o");
        command.arg(folder.path().join(out)).args(more);
        let done = command.args(short).assert().success();
        String::from_utf8_lossy(&done.get_output().stderr).into_owned()
    };
    let message = run("a", &["--no-report"]);
    assert!(warnings.iter().all(|w| message.contains(w)), "{message}");
    assert_eq!(run("b", &["--no-report", "--quiet"]), "");
}

#[test]
fn expectations_are_told_with_their_units() {
    let (folder, case) = folder_with(&format!(
        "{DRY}\n[expect]\nlanding_time = [\n\
         {{ value = \"28.6 ms\", tolerance = \"1 %\", grain = 0 }},\n\
         {{ value = \"50 ms\", tolerance = \"1 ms\", grain = 0 }},\n]\n\
         end_time = {{ at_least = \"0.1 s\" }}\n"
    ));
    let run = |out: &str, more: &[&str]| {
        let mut command = grainwake();
        command.arg("run").arg(&case).arg("-o");
        command.arg(folder.path().join(out)).args(more);
        let done = command.arg("--no-report").assert().code(1);
        String::from_utf8_lossy(&done.get_output().stderr).into_owned()
    };
    let message = run("a", &[]);
    let line = |start: &str, end: &str| {
        let mut lines = message.lines();
        assert!(lines.any(|l| l.starts_with(start) && l.ends_with(end)), "{message}");
    };
    line("landing_time of grain 0: 2", " ms: met");
    line("landing_time of grain 0: 2", ", expected 49 ms to 51 ms: missed");
    line("end_time: 120 ms, expected at least 100 ms: met", "");
    let miss = "expected landing_time of grain 0: 49 ms to 51 ms, but it is 2";
    assert!(message.contains(miss) && message.contains(" ms (error -4"), "{message}");
    // Missed expectations are printed even with --quiet.
    let quiet = run("b", &["--quiet"]);
    assert!(quiet.contains(miss) && !quiet.contains(": met"), "{quiet}");
}

#[test]
fn an_expectation_makes_a_case_a_test() {
    let (folder, case) = folder_with(&format!(
        "{DRY}\n[expect]\nlanding_time = {{ value = 0.0286, tolerance = \"1 %\", grain = 0 }}\n"
    ));
    grainwake()
        .arg("run")
        .arg(&case)
        .arg("-o")
        .arg(folder.path().join("a"))
        .arg("--quiet")
        .assert()
        .success();
    let wrong = std::fs::read_to_string(&case).unwrap().replace("0.0286", "0.05");
    std::fs::write(&case, wrong).unwrap();
    let done = grainwake()
        .arg("run")
        .arg(&case)
        .arg("-o")
        .arg(folder.path().join("b"))
        .args(["--quiet", "--json"])
        .assert()
        .code(1);
    assert!(
        String::from_utf8_lossy(&done.get_output().stderr)
            .contains("expected landing_time of grain 0")
    );
    assert_eq!(json(&done.get_output().stdout)["expect"][0]["pass"], false);
}

#[test]
fn a_stop_rule_ends_a_run() {
    let (folder, case) = folder_with(
        &DRY.replace(
            "step = \"0.1 ms\"",
            "step = \"0.1 ms\"\nstop = { when = \"landing\", hold = \"1 ms\" }",
        )
        .replace("end = \"120 ms\"", "end = \"1 s\""),
    );
    let out = folder.path().join("run");
    let done =
        grainwake().arg("run").arg(&case).arg("-o").arg(&out).args(["--json", "--quiet"]).assert();
    let summary = json(&done.success().get_output().stdout);
    assert_eq!(summary["ended_by"], "landing");
    let last = summary["grains"]
        .as_array()
        .unwrap()
        .iter()
        .map(|g| g["landing_time_s"].as_f64().unwrap())
        .fold(0.0, f64::max);
    let end = summary["end_time_s"].as_f64().unwrap();
    assert!(end >= last + 1e-3 && end < last + 1.5e-3, "{last} {end}");
}

#[test]
fn the_last_state_is_written_once() {
    let (folder, case) = folder_with(WET);
    let files = |name: &str, set: &str| {
        let out = folder.path().join(name);
        let run = ["--quiet", "--set", set, "--set", "output.at_events=false"];
        grainwake().arg("run").arg(&case).arg("-o").arg(&out).args(run).assert().success();
        let names = |kind: &str| {
            let files = std::fs::read_dir(out.join(kind)).unwrap().flatten();
            let mut names: Vec<String> =
                files.map(|file| file.file_name().into_string().unwrap()).collect();
            names.sort();
            names.retain(|name| name.starts_with("y-grain0") || name.starts_with("grains"));
            names
        };
        let rows = std::fs::read_to_string(out.join("diagnostics.csv")).unwrap().lines().count();
        (names("slices").pop().unwrap(), names("grains").pop().unwrap(), rows)
    };
    // A row of the tables is due at the end, a slice is not.
    let end = ("y-grain0_end.vti".to_owned(), "grains_end.vtp".to_owned());
    assert_eq!(files("row", "time.end=16 ms"), (end.0.clone(), end.1.clone(), 10));
    assert_eq!(files("none", "time.end=15 ms"), (end.0, end.1, 10));
    let due = ("y-grain0_000001.vti".to_owned(), "grains_000001.vtp".to_owned(), 7);
    assert_eq!(files("both", "time.end=10 ms"), due);
}

#[test]
fn schema_and_completions_are_printed() {
    let schema = grainwake().arg("schema").assert().success();
    assert_eq!(json(&schema.get_output().stdout)["title"], "Grainwake case file");
    let script = grainwake().args(["completions", "bash"]).assert().success();
    assert!(String::from_utf8_lossy(&script.get_output().stdout).contains("grainwake"));
}

#[test]
fn bench_measures_a_dry_case() {
    let (_folder, case) = folder_with(HEAP);
    let done = grainwake()
        .arg("bench")
        .arg(&case)
        .args(["--steps", "5", "--warm-up", "400", "--json"])
        .assert()
        .success();
    let measured = json(&done.get_output().stdout);
    let step = &measured["seconds_per_step"];
    let number = |key: &str| step[key].as_f64().unwrap_or_else(|| panic!("{measured}"));
    assert!(number("minimum") > 0.0 && number("minimum") <= number("median"), "{measured}");
    if cfg!(target_os = "linux") {
        assert!(number("cpu") > 0.0, "{measured}");
    }
    assert!(measured["contact_pairs"]["largest"].as_u64() >= Some(2), "{measured}");
    assert!(measured["substeps_per_step"]["mean"].as_f64() > Some(1.0), "{measured}");
    assert!(measured.get("cells").is_none() && measured["grains"] == 2);
    let table = grainwake().arg("bench").arg(&case).args(["--steps", "2"]).assert().success();
    let table = String::from_utf8_lossy(&table.get_output().stdout).into_owned();
    assert!(table.starts_with("dry, 2 grains"), "{table}");
    assert!(table.contains("minimum") && table.contains("CPU"), "{table}");
    let both = grainwake().arg("bench").arg(&case).args(["--grains", "3"]).assert().code(2);
    assert!(String::from_utf8_lossy(&both.get_output().stderr).contains("--grains"));
    let missing = grainwake().args(["bench", "no.toml"]).assert().code(2);
    assert!(String::from_utf8_lossy(&missing.get_output().stderr).contains("no.toml"));
}

#[test]
fn bench_measures_time_memory_and_the_limit() {
    let done = grainwake()
        .args(["bench", "--size", "24", "24", "48", "--grains", "7", "--steps", "2", "--json"])
        .assert()
        .success();
    let measured = json(&done.get_output().stdout);
    for key in ["ns_per_cell_step", "bytes_per_cell", "triad_gb_per_s", "limit_ns_per_cell_step"] {
        assert!(measured[key].as_f64().is_some_and(|v| v > 0.0), "{key} in {measured}");
    }
    assert!(measured["passes"].as_array().is_some_and(|p| p.len() >= 7));
    let step = &measured["seconds_per_step"];
    assert!(
        step["minimum"].as_f64() > Some(0.0) && step["minimum"].as_f64() <= step["median"].as_f64()
    );
    assert_eq!(measured["grains"], 7);
    let single = grainwake()
        .args(["bench", "--size", "24", "24", "48", "--grains", "7"])
        .args(["--steps", "2", "--precision", "f32", "--json"])
        .assert()
        .success();
    let single = json(&single.get_output().stdout);
    assert_eq!(single["precision"], "f32");
    assert_eq!(single["traffic_bytes_per_cell"], 112.0);
    let bytes = |m: &serde_json::Value| m["bytes_per_cell"].as_f64().unwrap();
    assert!(bytes(&single) < bytes(&measured), "{single}");
    let baseline = grainwake()
        .args(["bench", "--size", "24", "24", "48", "--steps", "1"])
        .args(["--instructions", "baseline", "--json"])
        .assert()
        .success();
    assert_eq!(json(&baseline.get_output().stdout)["instructions"], "baseline");
    let unknown = grainwake().args(["bench", "--instructions", "sse9"]).assert().code(2);
    assert!(
        String::from_utf8_lossy(&unknown.get_output().stderr).contains("baseline, avx2, avx512")
    );
    if InstructionSet::widest() < InstructionSet::Avx512 {
        let lacking = grainwake().args(["bench", "--instructions", "avx512"]).assert().code(2);
        let message = String::from_utf8_lossy(&lacking.get_output().stderr).into_owned();
        assert!(message.contains("this processor has at most"), "{message}");
    }
    for (option, found) in [("--size 8 24 48", "--size takes 16 to 4096"), ("--steps 0", "--steps")]
    {
        let refused = grainwake().arg("bench").args(option.split(' ')).assert().code(2);
        let message = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
        assert!(message.contains(found), "{message}");
    }
    // Two by two by four places of eleven cells.
    let many =
        grainwake().args(["bench", "--size", "24", "24", "48", "--grains", "17"]).assert().code(2);
    assert!(String::from_utf8_lossy(&many.get_output().stderr).contains("at most 16"));
}

#[test]
fn grains_are_made_and_described() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new/ball.grain");
    grainwake()
        .args(["grain", "make", "sphere", "2 mm", "--nodes", "500", "-o"])
        .arg(&path)
        .assert()
        .success();
    let done = grainwake().args(["grain", "info", "--json"]).arg(&path).assert().success();
    let record = json(&done.get_output().stdout);
    for key in [
        "volume_m3",
        "equivalent_diameter_m",
        "a_m",
        "b_m",
        "c_m",
        "krumbein_sphericity",
        "wadell_sphericity",
        "wadell_roundness",
        "convexity",
        "surface_nodes",
    ] {
        assert!(record.get(key).is_some(), "{key}");
    }
    assert!((record["equivalent_diameter_m"].as_f64().unwrap() - 2e-3).abs() < 1e-9);
    let again =
        grainwake().args(["grain", "make", "sphere", "2 mm", "-o"]).arg(&path).assert().code(2);
    assert!(String::from_utf8_lossy(&again.get_output().stderr).contains("--force"));
    let bad = grainwake()
        .args(["grain", "make", "sphere", "2 kg", "-o"])
        .arg(folder.path().join("x.grain"))
        .assert()
        .code(2);
    assert!(String::from_utf8_lossy(&bad.get_output().stderr).contains("is a mass"));
}

#[test]
fn grains_are_compared() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for (name, axes) in
        [("long.grain", ["3 mm", "2 mm", "1 mm"]), ("flat.grain", ["4 mm", "4 mm", "2 mm"])]
    {
        let mut make = grainwake();
        make.args(["grain", "make", "ellipsoid"])
            .args(axes)
            .arg("-o")
            .arg(path(name))
            .args(["--cells", "32"]);
        make.assert().success();
    }
    let compare = |more: &[&str]| {
        let mut program = grainwake();
        program
            .args(["grain", "compare"])
            .arg(path("long.grain"))
            .arg(path("flat.grain"))
            .args(more);
        program.assert().success().get_output().stdout.clone()
    };
    let found = json(&compare(&["--json"]));
    // The ends of the middle axis are 1 mm apart, which is more than those of the others.
    let largest = found["comparison"]["largest_distance_m"].as_f64().unwrap();
    assert!((largest - 1e-3).abs() < 5e-5, "{largest}");
    assert!(found["comparison"]["mean_distance_m"].as_f64().unwrap() < -3e-4);
    let same = json(&compare(&["--json", "--same-size"]));
    let diameter = |which: &str| same[which]["equivalent_diameter_m"].as_f64().unwrap();
    assert!((diameter("first") / diameter("second") - 1.0).abs() < 1e-9);
    assert!(same["comparison"]["mean_distance_m"].as_f64().unwrap().abs() < 1e-4);
    let picture = path("both.png");
    let text = compare(&["--picture", picture.to_str().unwrap()]);
    let text = String::from_utf8_lossy(&text);
    assert!(text.contains("Krumbein sphericity") && text.contains("root mean square"), "{text}");
    // Two grains of 320 pixels per view, with margins and lines of text.
    let drawn = Picture::from_png(&std::fs::read(&picture).unwrap()).unwrap();
    assert_eq!((drawn.width, drawn.height), (974, 765));
    let mut over = grainwake();
    over.args(["grain", "compare"])
        .args([path("long.grain"), path("flat.grain")])
        .arg("--picture")
        .arg(path("long.grain"));
    over.assert().code(2).stderr(contains("is an input of this command"));
}

#[test]
fn a_run_can_be_reported() {
    let (folder, case) = folder_with(WET);
    let out = folder.path().join("run");
    let run = |more: &str| {
        let mut command = grainwake();
        command.arg("run").arg(&case).arg("-o").arg(&out);
        command.args(["--quiet", "--set", "time.end=20 ms", more]);
        command.assert().success().stderr("");
    };
    run("--force");
    assert!(out.join("report.html").is_file() && out.join("figures").is_dir());
    std::fs::remove_dir_all(&out).unwrap();
    run("--no-report");
    assert!(!out.join("report.html").exists());
    grainwake().arg("report").arg(&out).assert().success();
    assert!(out.join("report.html").is_file());
    grainwake().arg("report").arg(folder.path()).assert().code(2);
}

/// Set `GRAINWAKE_PYTHON` to a Python that has PyVista; without one the test says so and passes.
#[test]
fn pictures_open_in_pyvista() {
    let python = std::env::var("GRAINWAKE_PYTHON").unwrap_or_else(|_| "python3".into());
    let has = std::process::Command::new(&python).args(["-c", "import pyvista"]).output();
    if !has.is_ok_and(|o| o.status.success()) {
        eprintln!(
            "SKIPPED pictures_open_in_pyvista: {python} has no pyvista (set GRAINWAKE_PYTHON)"
        );
        return;
    }
    let (folder, case) = folder_with(WET);
    let out = folder.path().join("run");
    let quick = ["--quiet", "--set", "output.checkpoint_steps=0", "--set", "time.end=20 ms"];
    grainwake().arg("run").arg(&case).arg("-o").arg(&out).args(quick).assert().success();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/read_pictures.py");
    let done = std::process::Command::new(&python).arg(script).arg(&out).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let found = json(&done.stdout);
    assert_eq!(found["fields"]["dimensions"], serde_json::json!([9, 9, 25]));
    assert_eq!(found["fields"]["arrays"]["velocity"], serde_json::json!([1536, 3]));
    let ours = grainwake_formats::vti::read(&out.join("fields/fields_000001.vti")).unwrap();
    let pressure = &ours.arrays.iter().find(|a| a.name == "pressure").unwrap().data;
    assert_eq!(
        found["fields"]["pressure_at_5_3_7"].as_f64(),
        Some(f64::from(pressure[(7 * 8 + 3) * 8 + 5]))
    );
    assert_eq!(found["fields"]["time"].as_f64(), Some(ours.frame.time));
    assert_eq!(found["grains"]["closed"], true);
    let volume = found["grains"]["volume_of_0"].as_f64().unwrap();
    assert!((volume / (std::f64::consts::PI / 6.0 * 8e-9) - 1.0).abs() < 0.01, "{volume}");
    let grains = std::fs::read_to_string(out.join("grains.csv")).unwrap();
    let last: Vec<f64> =
        grains.lines().rev().nth(1).unwrap().split(',').map(|v| v.parse().unwrap()).collect();
    assert!((found["grains"]["centre_of_0"][2].as_f64().unwrap() - last[4]).abs() < 1e-6);
    assert_eq!(found["times"], serde_json::json!([0.0, 0.01, 0.02]));
    // The field, the grains and a slice through each of them.
    assert_eq!(found["parts_at_the_end"], 4);
}
