//! Two runs do not share a folder.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{DRY, WET, folder_with, grainwake};
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

fn run(case: &Path, out: &Path, more: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = grainwake();
    command.arg("run").arg(case).arg("-o").arg(out);
    command.args(["--quiet", "--threads", "1"]).args(more).assert()
}

#[test]
fn a_folder_in_use_is_refused_until_its_run_is_dead() {
    let (folder, case) = folder_with(WET);
    let out = folder.path().join("out");
    let mut first = Command::new(assert_cmd::cargo::cargo_bin("grainwake"))
        .arg("run")
        .arg(&case)
        .arg("-o")
        .arg(&out)
        .args(["--quiet", "--threads", "1", "--set", "time.end=1000 s"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while !out.join("events.jsonl").is_file() {
        assert!(begun.elapsed() < Duration::from_secs(60), "it does not start");
        std::thread::sleep(Duration::from_millis(10));
    }
    let number = format!("process {}", first.id());
    for more in [&["--force"][..], &["--resume"], &[]] {
        let refused = run(&case, &out, more).code(2);
        if !more.is_empty() {
            let place = out.display().to_string();
            refused.stderr(contains("is writing into").and(contains(place)).and(contains(&number)));
        }
    }
    assert!(first.try_wait().unwrap().is_none(), "the first run goes on");
    first.kill().unwrap();
    first.wait().unwrap();
    run(&case, &out, &["--force", "--set", "time.end=4 ms"]).success();
}

#[test]
fn a_finished_run_keeps_its_last_checkpoint_and_can_be_extended() {
    let (folder, case) = folder_with(DRY);
    let (whole, out) = (folder.path().join("whole"), folder.path().join("out"));
    let count = |run: &Path| std::fs::read_dir(run.join("checkpoint")).unwrap().count();
    run(&case, &out, &["--set", "time.end=60 ms"]).success();
    assert_eq!(count(&out), 1);
    run(&case, &out, &["--resume"]).success();
    run(&case, &whole, &[]).success();
    assert_eq!((count(&out), count(&whole)), (1, 1));
    for file in ["grains.csv", "events.jsonl"] {
        let read = |run: &Path| std::fs::read(run.join(file)).unwrap();
        assert!(read(&out) == read(&whole), "{file} differs");
    }
}

#[test]
fn a_few_grains_tell_whom_they_meet() {
    let (folder, case) = folder_with(DRY);
    let out = folder.path().join("out");
    run(&case, &out, &[]).success();
    let log = std::fs::read_to_string(out.join("events.jsonl")).unwrap();
    let events: Vec<serde_json::Value> =
        log.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    // The large grain falls on the one below it; both were apart.
    let kiss = events.iter().find(|e| e["event"] == "kiss").expect("a meeting");
    assert_eq!(kiss["grains"], serde_json::json!([0, 1]));
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["events"].as_array().unwrap().len(), events.len());
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("Height and velocity of each grain") && page.contains("<td>kiss</td>"));
}
