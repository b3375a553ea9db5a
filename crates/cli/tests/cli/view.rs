//! `grainwake view`: saved pages, the served address, and bad input.

use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::common::{DRY, WET, folder_with, grainwake};
use predicates::prelude::*;
use predicates::str::contains;
use serde_json::Value;

const STUDY: &str = r#"
title = "two weights"
base = "case.toml"
[[axis]]
name = "weight"
key = "grain.1.density"
values = [
  { name = "light", value = 2500 },
  { name = "heavy", value = 5000 },
]
"#;

fn run(case: &str) -> (tempfile::TempDir, PathBuf) {
    let (folder, file) = folder_with(case);
    let out = folder.path().join("run");
    let mut command = grainwake();
    command.arg("run").arg(&file).arg("-o").arg(&out).args(["--quiet", "--no-report"]);
    command.args(["--set", "time.end=20 ms"]).assert().success();
    (folder, out)
}

/// Saves a page and returns the JSON of one of its data blocks.
fn saved(folder: &Path, id: &str) -> Value {
    let page = folder.with_extension("html");
    grainwake().arg("view").arg(folder).arg("--save").arg(&page).assert().success();
    let text = std::fs::read_to_string(page).unwrap();
    let block = text.split(&format!("id=\"{id}\">")).nth(1).expect("the block");
    serde_json::from_str(block.split("</script>").next().unwrap()).unwrap()
}

#[test]
fn a_run_is_saved_as_one_page() {
    let (_folder, out) = run(WET);
    let run = saved(&out, "run-0");
    assert_eq!(run["title"], "small and wet");
    assert_eq!(run["state"], "finished");
    assert_eq!(run["periodic"], serde_json::json!([true, true, false]));
    assert_eq!(run["meshes"].as_array().unwrap().len(), 1, "one mesh for two equal spheres");
    assert!(!run["slices"][0]["frames"].as_array().unwrap().is_empty());
}

#[test]
fn grains_without_surface_files_come_from_their_descriptions() {
    let (_folder, out) = run(DRY);
    std::fs::remove_dir_all(out.join("grains")).unwrap();
    let run = saved(&out, "run-0");
    assert_eq!(run["meshes"], serde_json::json!([{"kind": "sphere"}]));
    assert_eq!(run["grains"][1]["scale"], 1.5e-3);
    let note = "grains: 2 of 2 files that run.pvd lists are missing";
    assert_eq!(run["notes"], serde_json::json!([note]));
}

#[test]
fn a_grain_file_replaces_surface_files_that_are_gone() {
    let (folder, case) = folder_with(DRY);
    let shape = folder.path().join("pebble.grain");
    let axes = ["grain", "make", "ellipsoid", "3 mm", "2 mm", "1 mm", "-o"];
    grainwake().args(axes).arg(&shape).assert().success();
    let text = std::fs::read_to_string(&case).unwrap();
    let own = "shape = { kind = \"sphere\", diameter = \"3 mm\" }\nnodes = 300\n";
    let file = "file = \"pebble.grain\"\nequivalent_diameter = \"3 mm\"\n";
    assert!(text.contains(own));
    std::fs::write(&case, text.replace(own, file)).unwrap();
    let out = folder.path().join("run");
    let mut command = grainwake();
    command.arg("run").arg(&case).arg("-o").arg(&out).args(["--quiet", "--no-report"]);
    command.args(["--set", "time.end=5 ms"]).assert().success();
    let size = |run: &Value| run["grains"][1]["scale"].as_f64().unwrap();
    let with = saved(&out, "run-0");
    std::fs::remove_dir_all(out.join("grains")).unwrap();
    let without = saved(&out, "run-0");
    let mesh = without["grains"][1]["mesh"].as_u64().unwrap() as usize;
    assert_eq!(without["meshes"][mesh]["kind"], "surface");
    assert!((size(&with) / size(&without) - 1.0).abs() < 1e-3, "scaled to 3 mm");
}

#[test]
fn a_study_has_a_table_of_its_runs() {
    let (folder, _) = folder_with(WET);
    let study = folder.path().join("study.toml");
    std::fs::write(&study, STUDY).unwrap();
    let out = folder.path().join("out");
    let mut command = grainwake();
    command.arg("study").arg(&study).arg("-o").arg(&out).args(["--quiet", "--only", "*heavy*"]);
    command.args(["--set", "time.end=20 ms"]).assert().success();
    let index = saved(&out, "index");
    let rows = index["study"]["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 2);
    let heavy = rows.iter().find(|row| row["values"][0] == "heavy").unwrap();
    let light = rows.iter().find(|row| row["values"][0] == "light").unwrap();
    assert_eq!((&heavy["run"], &heavy["state"]), (&0.into(), &"finished".into()));
    assert_eq!((&light["run"], &light["state"]), (&Value::Null, &"missing".into()));
    assert_eq!(index["runs"].as_array().unwrap().len(), 1);
    let (_other, run) = run(WET);
    let page = folder.path().join("page.html");
    let mut several = grainwake();
    several.arg("view").arg(&run).arg(&out).arg("--save").arg(page);
    several.assert().code(2).stderr(contains("view one study at a time"));
}

#[test]
fn the_served_address_is_printed() {
    let (_folder, out) = run(WET);
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("grainwake"))
        .arg("view")
        .arg(&out)
        .args(["--port", "0"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(line.starts_with("http://127.0.0.1:"), "{line}");
}

#[test]
fn bad_input_is_refused_with_the_remedy() {
    let (folder, out) = run(WET);
    let view = |folders: &[&Path], more: &[&str]| {
        grainwake().arg("view").args(folders).args(more).assert()
    };
    let missing = folder.path().join("nowhere");
    let remedy = |why| contains(why).and(contains("`grainwake run`"));
    view(&[&missing], &[]).code(2).stderr(remedy("there is no folder"));
    view(&[folder.path()], &[]).code(2).stderr(remedy("holds no run"));
    let here = folder.path().display().to_string();
    view(&[&out], &["--save", &here]).code(2).stderr(contains("is a folder"));
    let deep = folder.path().join("no/such/page.html").display().to_string();
    view(&[&out], &["--save", &deep]).code(4).stderr(contains("cannot write"));
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    view(&[&out], &["--port", &port]).code(4).stderr(contains("--port"));
    view(&[&out], &["--port", "80", "--save", "x.html"]).code(2);
}

#[test]
fn only_pages_are_replaced() {
    let (folder, out) = run(DRY);
    let case = folder.path().join("case.toml");
    let text = std::fs::read_to_string(&case).unwrap();
    let save = |file: &Path| grainwake().arg("view").arg(&out).arg("--save").arg(file).assert();
    save(&case).code(2).stderr(contains("does not end in .html"));
    assert_eq!(std::fs::read_to_string(&case).unwrap(), text);
    let other = folder.path().join("notes.html");
    std::fs::write(&other, "<!DOCTYPE html><title>notes</title>").unwrap();
    save(&other).code(2).stderr(contains("is not a page of grainwake view"));
    let page = folder.path().join("page.html");
    save(&page).success();
    save(&page).success();
}
