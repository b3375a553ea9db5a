//! Bad input: exit code 2, nothing written, and a message with file, line, key and remedy.

use crate::common::{WET, folder_with, grainwake};
use predicates::prelude::*;
use predicates::str::contains;

/// Runs a modified case and asserts that standard error contains these words.
fn refused(from: &str, to: &str, words: &[&str]) {
    assert!(WET.contains(from), "{from}");
    let (folder, case) = folder_with(&WET.replacen(from, to, 1));
    let out = folder.path().join("run");
    for command in ["run", "check"] {
        let mut program = grainwake();
        program.arg(command).arg(&case);
        if command == "run" {
            program.arg("-o").arg(&out);
        }
        let done = program.assert().code(2);
        let message = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
        assert!(done.get_output().stdout.is_empty());
        for word in words {
            assert!(message.contains(word), "{command}: `{word}` is missing in:\n{message}");
        }
    }
    assert!(!out.exists(), "nothing may be written");
}

#[test]
fn a_wrong_key() {
    refused(
        "viscosity =",
        "viscossity =",
        &["case.toml:5:1", "fluid.viscossity", "unknown key", "did you mean `viscosity`?"],
    );
}

#[test]
fn a_wrong_unit() {
    refused(
        "\"5 mPa s\"",
        "\"5 mPa\"",
        &["case.toml:5:13", "fluid.viscosity", "is a pressure", "\"1 mPa s\""],
    );
}

#[test]
fn a_missing_grain_file() {
    let from = "shape = { kind = \"sphere\", diameter = \"2 mm\" }\nnodes = 200";
    refused(
        from,
        "file = \"sand.grain\"",
        &[
            "case.toml:18:8",
            "grain.0.file",
            "no grain file",
            "sand.grain",
            "grainwake grain from-scan",
        ],
    );
}

#[test]
fn grains_that_overlap() {
    refused(
        "gap = \"1 mm\"",
        "gap = \"-0.5 mm\"",
        &["case.toml:26:12", "grain.1.position", "overlap at the start by 0.4", "move them apart"],
    );
}

#[test]
fn a_grain_outside() {
    refused(
        "\"3 mm\"]",
        "\"30 mm\"]",
        &["case.toml:21:12", "grain.0.position", "outside the box", "larger"],
    );
    refused(
        "\"3 mm\"]",
        "\"0.5 mm\"]",
        &["case.toml:21:12", "crosses a side", "lower z", "0.5 mm along z"],
    );
}

#[test]
fn a_periodic_mismatch() {
    refused(
        "x = \"periodic\"",
        "x = [\"periodic\", \"wall\"]",
        &["case.toml:9:20", "domain.boundaries.x", "one side only", "x = \"periodic\""],
    );
}

#[test]
fn a_study_file_for_a_case() {
    let (folder, _) = folder_with(WET);
    let study = folder.path().join("study.toml");
    let text = "title = \"two\"\nbase = \"case.toml\"\n[[adjust]]\nmodels = [\"*\"]\n";
    std::fs::write(&study, text).unwrap();
    for command in ["run", "check"] {
        let done = grainwake().arg(command).arg(&study).assert().code(2);
        let message = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
        assert!(
            message.contains("is a study file") && message.contains("grainwake study"),
            "{message}"
        );
    }
    // An error in a case gives the message of the case.
    let slip = WET.replace("[time]", "[tyme]");
    std::fs::write(&study, slip).unwrap();
    let done = grainwake().arg("check").arg(&study).assert().code(2);
    assert!(String::from_utf8_lossy(&done.get_output().stderr).contains("tyme"));
}

#[test]
fn what_is_not_there_and_what_is_no_case() {
    let folder = tempfile::tempdir().unwrap();
    let done = grainwake().arg("run").arg(folder.path().join("nowhere.toml")).assert().code(2);
    assert!(String::from_utf8_lossy(&done.get_output().stderr).contains("nowhere.toml"));
    let path = folder.path().join("broken.toml");
    std::fs::write(&path, "[fluid\n").unwrap();
    let done = grainwake().arg("check").arg(&path).assert().code(2);
    assert!(String::from_utf8_lossy(&done.get_output().stderr).contains("broken.toml:1:"));
    std::fs::write(&path, b"\xff\xfe\x00").unwrap();
    grainwake().arg("check").arg(&path).assert().code(2);
    grainwake().arg("frobnicate").assert().code(2);
}

#[test]
fn a_damaged_grain_file_is_told_of_with_its_place() {
    let (folder, case) = folder_with(&WET.replacen(
        "shape = { kind = \"sphere\", diameter = \"2 mm\" }\nnodes = 200",
        "file = \"a.grain\"",
        1,
    ));
    let grain = folder.path().join("a.grain");
    grainwake().args(["grain", "make", "sphere", "2 mm", "-o"]).arg(&grain).assert().success();
    grainwake().arg("check").arg(&case).assert().success();
    let mut bytes = std::fs::read(&grain).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    std::fs::write(&grain, bytes).unwrap();
    let done = grainwake().arg("check").arg(&case).assert().code(2);
    let message = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    assert!(message.contains("case.toml:18:8") && message.contains("checksum"), "{message}");
}

#[test]
fn a_box_beyond_the_memory_is_refused_with_both_figures() {
    let (folder, case) = folder_with(WET);
    let size = ["--set", "domain.cells=[4000, 4000, 4000]", "--set", "domain.size=[1, 1, 1]"];
    let small = ["--set", "domain.cell_size=0.25 mm"];
    for command in ["check", "run"] {
        let mut program = grainwake();
        program.arg(command).arg(&case).args(size).args(small).current_dir(folder.path());
        let refused = program.assert().code(2);
        refused
            .stderr(contains("the run needs 7040 GB of memory and").and(contains("GB are free")));
    }
    let bench = grainwake().args(["bench", "--size", "4000", "4000", "4000"]).assert().code(2);
    bench.stderr(contains("GB of memory and").and(contains("GB are free")));
    assert!(!folder.path().join("runs").exists());
}

#[test]
fn thousands_of_threads_are_reduced_with_a_warning() {
    let (folder, case) = folder_with(WET);
    let out = folder.path().join("run");
    let mut program = grainwake();
    program.arg("run").arg(&case).args(["--threads", "5000", "--set", "time.end=2 ms", "-o"]);
    let done = program.arg(&out).arg("--no-report").assert().success();
    done.stderr(contains("warning: 5000 threads are too many for"));
    let silent = program.args(["--force", "--quiet"]).assert().success();
    silent.stderr(contains("too many").not());
}

#[test]
fn negative_values_of_options_are_told_their_range() {
    let (folder, case) = folder_with(WET);
    let refused = |arguments: &[&str], words: &str| {
        let mut program = grainwake();
        let done = program.args(arguments).arg(&case).assert().code(2);
        done.stderr(contains(words).and(contains("unexpected argument").not()));
    };
    let whole = "'-1' for '--threads <N>': expected a whole number, 0 or more";
    refused(&["run", "--threads", "-1"], whole);
    refused(&["check", "--threads", "-1"], whole);
    refused(&["check", "--set", "run.threads=10000"], "10000 threads: accepted are 0 to 4096");
    let image = folder.path().join("stack.npy");
    std::fs::write(&image, b"").unwrap();
    let image = image.to_str().unwrap();
    let scan = ["grain", "from-scan", image, "--smoothing", "-1", "-o", "out"];
    let done = grainwake().args(scan).current_dir(folder.path()).assert().code(2);
    done.stderr(contains("smoothing").and(contains("unexpected argument").not()));
}

#[test]
fn thousands_of_threads_of_a_study_are_reduced_with_a_warning() {
    let (folder, _) = folder_with(WET);
    let study = folder.path().join("study.toml");
    let text = "title = \"two\"\nbase = \"case.toml\"\n[[model]]\nname = \"one\"\n";
    std::fs::write(&study, text.to_owned() + "[[model]]\nname = \"two\"\n").unwrap();
    let mut program = grainwake();
    program.arg("study").arg(&study).args(["--threads", "5000", "--jobs", "2", "--dry-run"]);
    let done = program.arg("-o").arg(folder.path().join("out")).assert().success();
    done.stderr(contains("warning: 2 at once with 5000 threads each are too many for"));
}

#[test]
fn thousands_of_threads_of_the_environment_are_reduced() {
    let folder = tempfile::tempdir().unwrap();
    let mut program = grainwake();
    program.env("RAYON_NUM_THREADS", "5000").timeout(std::time::Duration::from_secs(60));
    program.args(["grain", "make", "ellipsoid", "2 mm", "2 mm", "1 mm", "--cells", "40", "-o"]);
    program.arg(folder.path().join("a.grain")).assert().success();
}

#[cfg(unix)]
#[test]
fn devices_are_no_files() {
    refused(
        "shape = { kind = \"sphere\", diameter = \"2 mm\" }\nnodes = 200",
        "file = \"/dev/zero\"",
        &["case.toml:18:8", "grain.0.file", "/dev/zero: it is a device, not a file"],
    );
    let start = std::time::Instant::now();
    let commands: [&[&str]; 5] = [
        &["run", "/dev/zero"],
        &["check", "/dev/zero"],
        &["study", "/dev/zero"],
        &["grain", "info", "/dev/zero"],
        &["grain", "compare", "/dev/zero", "/dev/zero"],
    ];
    for command in commands {
        let done = grainwake().args(command).assert().code(2);
        let message = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
        assert!(
            message.contains("/dev/zero: it is a device, not a file"),
            "{command:?}: {message}"
        );
    }
    assert!(start.elapsed().as_secs() < 30, "nothing is read");
}
