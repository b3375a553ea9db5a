//! Studies through the binary: a kill at any moment changes nothing, and bad input is located.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::common::{WET, folder_with, grainwake};
use predicates::prelude::*;
use predicates::str::contains;

const STUDY: &str = r#"
title = "small and wet"
base = "case.toml"
[[axis]]
name = "weight"
key = "grain.1.density"
values = [
  { name = "light", value = 2500 },
  { name = "heavy", value = 5000 },
]
[[adjust]]
models = ["*"]
set = { "output.slices" = 0, "output.surfaces" = 0, "output.fields" = 0 }
"#;

/// Long enough to be killed five times.
const LONGER: &str = "time.end=150 ms";

fn study() -> (tempfile::TempDir, PathBuf) {
    let (folder, _) = folder_with(WET);
    let path = folder.path().join("study.toml");
    std::fs::write(&path, STUDY).unwrap();
    (folder, path)
}

/// The table without what differs from time to time.
fn table(out: &Path) -> Vec<serde_json::Value> {
    let text = std::fs::read_to_string(out.join("table.json")).unwrap();
    let mut rows: Vec<serde_json::Value> = serde_json::from_str(&text).unwrap();
    for row in &mut rows {
        row["wall_s"] = 0.into();
        row["threads"] = 0.into();
    }
    rows
}

#[test]
fn killed_studies_give_the_same_table() {
    let (folder, path) = study();
    let (whole, killed) = (folder.path().join("whole"), folder.path().join("killed"));
    let run = |out: &Path| {
        let mut command = grainwake();
        command.arg("study").arg(&path).arg("-o").arg(out);
        command.args(["--set", LONGER]);
        command
    };
    let start = std::time::Instant::now();
    run(&whole).args(["--threads", "1", "--quiet"]).assert().success().stdout(contains("heavy"));
    let length = start.elapsed().as_millis() as u64;
    let mut kills = 0;
    for attempt in 1..=5 {
        let mut child = Command::new(assert_cmd::cargo::cargo_bin("grainwake"))
            .arg("study")
            .arg(&path)
            .arg("-o")
            .arg(&killed)
            .args(["--jobs", "2", "--threads", "1", "--quiet", "--set", LONGER])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(length * (3 + attempt) / 100));
        if child.try_wait().unwrap().is_none() {
            kills += 1;
        }
        child.kill().unwrap();
        child.wait().unwrap();
    }
    // All five together leave a half of the work undone, on a machine as fast as in the first run.
    assert!(kills >= 3, "killed {kills} times");
    run(&killed).args(["--jobs", "2", "--quiet"]).assert().success();
    assert_eq!(table(&whole), table(&killed));
    assert!(
        table(&whole)
            .iter()
            .all(|row| row["state"] == "finished" && row["pair"]["mean_speed_leading"].is_number())
    );
    for name in ["light", "heavy"] {
        for file in ["grains.csv", "diagnostics.csv", "events.jsonl"] {
            let read = |out: &Path| std::fs::read(out.join("runs").join(name).join(file)).unwrap();
            assert!(read(&whole) == read(&killed), "{name}/{file}");
        }
    }
    // Once more: nothing is left to do.
    run(&whole).assert().success().stderr(contains("had finished before"));
}

#[test]
fn a_finished_run_with_a_damaged_case_is_a_failure_and_stays() {
    let (folder, path) = study();
    let out = folder.path().join("out");
    let run = |more: &[&str]| {
        let mut command = grainwake();
        command.arg("study").arg(&path).arg("-o").arg(&out).args(["--only", "light"]);
        command.args(["--quiet", "--set", "time.end=4 ms"]).args(more).assert()
    };
    run(&[]).success();
    std::fs::write(out.join("runs/light/case.resolved.toml"), b"title = \"\xff\"\n").unwrap();
    let before = crate::common::contents(&out.join("runs"));
    run(&["--list"]).success().stdout(contains("light  damaged"));
    run(&["--dry-run"]).success().stdout(
        contains("light: skip, ")
            .and(contains("case.resolved.toml cannot be read: line 1 is not a text in UTF-8"))
            .and(contains("restore the file"))
            .and(contains("0 of 1 to do")),
    );
    for more in [&[][..], &["--retry"]] {
        let failed = run(more).code(2).stderr(contains("case.resolved.toml cannot be read"));
        failed.stderr(contains("remove its folder and its row").and(contains("--retry").not()));
        assert!(before == crate::common::contents(&out.join("runs")), "nothing may change");
    }
}

#[test]
fn finished_runs_of_other_settings_are_replaced_by_force_only() {
    let (folder, path) = study();
    let out = folder.path().join("out");
    let run = |viscosity: &str, end: &str, more: &[&str]| {
        let mut command = grainwake();
        command.arg("study").arg(&path).arg("-o").arg(&out).args(["--quiet", "--set", end]);
        command.args(["--set", &format!("fluid.viscosity={viscosity}")]).args(more).assert()
    };
    let (only_light, end) = (&["--only", "light"], "time.end=4 ms");
    run("1 mPa s", end, only_light).success();
    let before = crate::common::contents(&out);
    let refused = run("2 mPa s", end, &[]).code(2);
    refused.stderr(
        contains("1 finished run that would be replaced: light (its case has changed)")
            .and(contains("another folder with -o, or use --force")),
    );
    run("1 mPa s", "time.end=5 ms", &[]).code(2).stderr(contains("light (its "));
    assert!(before == crate::common::contents(&out), "a refusal changes nothing");
    // A run that is not chosen is not replaced.
    run("2 mPa s", end, &["--only", "heavy"]).success();
    run("2 mPa s", end, &["--force"]).success();
    let case = std::fs::read_to_string(out.join("runs/light/case.resolved.toml")).unwrap();
    assert!(case.contains("viscosity = 0.000002"), "{case}");
}

#[test]
fn lists_and_dry_runs_write_nothing() {
    let (folder, path) = study();
    let out = folder.path().join("out");
    let run =
        |more: &[&str]| grainwake().arg("study").arg(&path).arg("-o").arg(&out).args(more).assert();
    run(&["--list"]).success().stdout(contains("   2  heavy  missing"));
    run(&["--dry-run", "--only", "2/2"]).success().stdout(contains("heavy: run\n1 of 1 to do"));
    let listed = run(&["--list", "--json", "--only", "light"]).success();
    let json: serde_json::Value = serde_json::from_slice(&listed.get_output().stdout).unwrap();
    assert_eq!(
        (json[0]["name"].as_str(), json[0]["state"].as_str()),
        (Some("light"), Some("missing"))
    );
    assert!(!out.exists());
}

#[test]
fn a_dry_run_times_steps_and_writes_nothing() {
    let (folder, path) = study();
    let out = folder.path().join("out");
    let run =
        |more: &[&str]| grainwake().arg("study").arg(&path).arg("-o").arg(&out).args(more).assert();
    // Both runs have the same grid, so the steps of one are timed.
    run(&["--dry-run", "--measure", "--jobs", "2", "--threads", "1"])
        .success()
        .stderr(contains("light: 0.").and(contains("heavy").not()))
        .stdout(contains("2 of 2 to do: about").and(contains("from timed steps")));
    let vast = ["--set", "domain.size=[\"1 m\", \"1 m\", \"1 m\"]"];
    run(&["--dry-run", "--measure", vast[0], vast[1]])
        .code(2)
        .stderr(contains("light cannot be timed: the run needs").and(contains("--jobs N")));
    run(&["--measure"]).code(2).stderr(contains("--dry-run"));
    assert!(!out.exists());
}

#[test]
fn one_share_after_the_other_is_the_whole() {
    let (folder, path) = study();
    let out = folder.path().join("out");
    let run = |more: &[&str]| {
        let command = &mut grainwake();
        command.arg("study").arg(&path).arg("-o").arg(&out).args([
            "--quiet",
            "--set",
            "time.end=10 ms",
        ]);
        command.args(more).assert().success()
    };
    run(&["--only", "1/2"]).stdout(contains("light").and(contains("heavy").not()));
    let json = run(&["--only", "heavy", "--json"]);
    let rows: serde_json::Value = serde_json::from_slice(&json.get_output().stdout).unwrap();
    assert_eq!(rows.as_array().unwrap().len(), 1);
    assert_eq!(rows[0]["state"], "finished");
    assert!(table(&out).iter().all(|row| row["state"] == "finished"));
}

#[test]
fn a_study_without_an_analysis_has_figures_all_the_same() {
    let (folder, path) = study();
    let out = folder.path().join("out");
    let run = |more: &[&str]| {
        let command = &mut grainwake();
        command.arg("study").arg(&path).arg("-o").arg(&out);
        command.args(["--set", "time.end=4 ms"]).args(more);
        command.assert().success()
    };
    run(&[]).stderr(contains("`analysis` file"));
    run(&["--quiet"]).stderr("");
    grainwake()
        .arg("report")
        .arg(&out)
        .assert()
        .success()
        .stdout(contains("(1 figure, 2 of 2 runs finished)"));
    assert!(out.join("figures/fig01-gap.png").is_file());
}

#[test]
fn a_case_for_a_study_file() {
    let (folder, case) = folder_with(WET);
    grainwake()
        .arg("study")
        .arg(&case)
        .arg("-o")
        .arg(folder.path().join("out"))
        .assert()
        .code(2)
        .stderr(contains("is a case").and(contains("grainwake run")));
}

#[test]
fn wrong_studies_end_with_2_and_a_place() {
    let (folder, path) = study();
    let out = folder.path().join("out");
    let run = |text: &str, more: &[&str]| {
        std::fs::write(&path, text).unwrap();
        grainwake().arg("study").arg(&path).arg("-o").arg(&out).args(more).assert().code(2)
    };
    run(&STUDY.replace("grain.1.density", "grain.1.densty"), &[])
        .stderr(contains("study.toml:").and(contains("did you mean `density`?")));
    run(&STUDY.replace("values =", "value ="), &[]).stderr(contains("unknown key `value`"));
    run(STUDY, &["--only", "haevy"]).stderr(contains("did you mean \"heavy\"?"));
    run(STUDY, &["--only", "3/2"]).stderr(contains("between 1 and N"));
    run(STUDY, &["--set", "time.end=1 mm"]).stderr(contains("--set"));
    run(STUDY, &["--unset", "time.speed"]).stderr(contains("the case has no such key"));
    // A removed key has its default, and this one has none.
    run(STUDY, &["--unset", "time.end"]).stderr(contains("end"));
    run(STUDY, &["--accept", "900fc4e"]).stderr(contains("900fc4e").and(contains("12 hexa")));
    grainwake()
        .args(["study", "nowhere.toml"])
        .assert()
        .code(2)
        .stderr(contains("cannot read nowhere.toml"));
    assert!(!out.exists());
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("thesis.tex"), "").unwrap();
    run(STUDY, &[]).stderr(contains("holds no study"));
}

#[test]
fn a_damaged_plan_is_no_dead_end() {
    let (folder, path) = study();
    let out = folder.path().join("out");
    let run = || {
        let mut command = grainwake();
        command.arg("study").arg(&path).arg("-o").arg(&out).args(["--set", "time.end=10 ms"]);
        command.assert().success()
    };
    run();
    std::fs::write(out.join("study.json"), "{ \"grainwake_study\": 1, \"runs\": [").unwrap();
    let report = grainwake().arg("report").arg(&out).assert().success();
    report
        .stderr(contains("study.json is damaged").and(contains("`grainwake study ")))
        .stdout(contains("2 of 2 runs finished"));
    run().stderr(contains("study.json is damaged").and(contains("finished runs are kept")));
    let provenance = std::fs::read_to_string(out.join("runs/light/provenance.json")).unwrap();
    assert_eq!(provenance.matches("\"started\"").count(), 1, "the run was not repeated");
    let report = grainwake().arg("report").arg(&out).assert().success();
    report.stderr(contains("damaged").not());
    std::fs::remove_file(out.join("study.json")).unwrap();
    let report = grainwake().arg("report").arg(&out).assert().success();
    report
        .stderr(contains("the file is missing").and(contains("`grainwake study ")))
        .stdout(contains("2 of 2 runs finished"));
    run().stderr(contains("the file is missing").and(contains("finished runs are kept")));
}
