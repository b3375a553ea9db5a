//! A pipe closed early (`| head -1`, `| true`) neither stops a command nor causes a message.
#![cfg(unix)]

use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{WET, folder_with, grainwake};

/// The program with these arguments.
fn program(words: &[&str], paths: &[&Path]) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("grainwake"));
    command.args(words).args(paths).stdin(Stdio::null());
    command
}

/// The end of a pipe that nobody reads.
fn closed() -> Stdio {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    writer.into()
}

#[test]
fn a_run_survives_closed_streams() {
    let (folder, case) = folder_with(WET);
    let out = folder.path().join("run");
    let short = ["run", "--threads", "1", "--set", "time.end=10 ms"];
    let mut run = program(&short, &[&case]);
    run.arg("-o").arg(&out).stdout(closed()).stderr(closed());
    assert_eq!(run.status().unwrap().code(), Some(0));
    assert!(out.join("summary.json").is_file() && out.join("report.html").is_file());
    // Nor does a closed stream make good what is wrong: the folder is taken.
    let mut again = program(&short, &[&case]);
    again.arg("-o").arg(&out).stdout(closed()).stderr(closed());
    assert_eq!(again.status().unwrap().code(), Some(2));
}

#[test]
fn a_reader_that_has_gone_is_no_error() {
    let folder = tempfile::tempdir().unwrap();
    let ball = folder.path().join("ball.grain");
    grainwake()
        .args(["grain", "make", "sphere", "2 mm", "--cells", "32", "-o"])
        .arg(&ball)
        .assert()
        .success();
    let calls: [(&[&str], &[&Path]); 3] = [
        (&["grain", "info"], &[&ball, &ball]),
        (&["schema"], &[]),
        (&["completions", "bash"], &[]),
    ];
    for (words, paths) in calls {
        let done = program(words, paths).stdout(closed()).output().unwrap();
        let message = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!((done.status.code(), message.as_str()), (Some(0), ""), "{words:?}");
    }
}
