//! Signals: hang-ups under `nohup`, and interrupts while the report is drawn.
#![cfg(unix)]

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::common::{WET, folder_with};

/// Runs a case in a shell that first executes `before`.
fn start(before: &str, case: &Path, out: &Path, more: &str) -> Child {
    let program = assert_cmd::cargo::cargo_bin("grainwake");
    let script = format!("{before}exec \"$1\" run \"$2\" -o \"$3\" --threads 1 --quiet {more}");
    Command::new("sh")
        .args(["-c", &script, "sh"])
        .args([program.as_path(), case, out])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Sends a signal as soon as the run folder has a file; returns exit code and messages.
fn signalled(child: Child, signal: &str, out: &Path, file: &str) -> (Option<i32>, String) {
    for _ in 0..6000 {
        if out.join(file).is_file() {
            break;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(out.join(file).is_file(), "{file} is missing after a minute");
    // The program may still write the file.
    std::thread::sleep(Duration::from_millis(200));
    let pid = child.id().to_string();
    assert!(Command::new("kill").args([signal, &pid]).status().unwrap().success());
    let ended = child.wait_with_output().unwrap();
    (ended.status.code(), String::from_utf8(ended.stderr).unwrap())
}

#[test]
fn signals_that_are_ignored_at_the_start_stay_ignored() {
    let (folder, case) = folder_with(WET);
    let out = folder.path().join("out");
    let child = start("trap '' HUP; ", &case, &out, "--no-report --set time.end='150 ms'");
    let (code, messages) = signalled(child, "-HUP", &out, "provenance.json");
    assert_eq!(code, Some(0), "{messages}");
    assert!(out.join("summary.json").is_file());
}

#[test]
fn an_interrupt_while_the_report_is_drawn_ends_a_finished_run() {
    let heap = r#"
[domain]
size = ["10 mm", "10 mm", "20 mm"]
[time]
end = "0.1 ms"
[[packing]]
count = 2000
shapes = [{ kind = "sphere", diameter = "0.5 mm" }]
nodes = 100
density = 2500
"#;
    let (folder, case) = folder_with(heap);
    let out = folder.path().join("out");
    let child = start("", &case, &out, "");
    let (code, messages) = signalled(child, "-TERM", &out, "summary.json");
    assert_eq!(code, Some(0), "{messages}");
    assert!(messages.contains("the run is complete, its report is not"), "{messages}");
    assert!(!messages.contains("checkpoint") && !out.join("report.html").exists(), "{messages}");
}
