//! A run that is killed and resumed gives the bits of one that is not; damaged checkpoints.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::SplitMix64;
#[cfg(unix)]
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use grainwake_formats::table::Table;
use grainwake_run::case::Case;
use grainwake_run::provenance::Provenance;
use grainwake_run::{Existing, Options, Recording};

use crate::common::{DRY, WET, assert_same_run, folder_with, grainwake};

fn run(case: &Path, out: &Path, more: &[&str]) -> assert_cmd::assert::Assert {
    grainwake().arg("run").arg(case).arg("-o").arg(out).arg("--quiet").args(more).assert()
}

fn checkpoints(run: &Path) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> =
        std::fs::read_dir(run.join("checkpoint")).unwrap().map(|e| e.unwrap().path()).collect();
    found.sort();
    found
}

#[test]
fn dimensionless_columns_are_added_and_survive_kills() {
    let scales = "[output]\nscales = { length = \"2 mm\", time = \"10 ms\", density = 500 }\n";
    let probe = "[[probe]]\nname = \"middle\"\npoints = [[2e-3, 2e-3, 6e-3]]\n";
    let text = WET.replace("[output]\n", scales) + probe;
    survives_kills(&text, 5);
    let (folder, case) = folder_with(&text);
    let (plain, scaled) = (folder.path().join("plain"), folder.path().join("scaled"));
    run(&case, &scaled, &[]).success();
    run(&case, &plain, &["--unset", "output.scales"]).success();
    // The force scale is 500 * 0.2^2 * 0.002^2 = 8e-5 N, that of pressure 20 Pa.
    let expected: [(&str, &[(&str, f64)]); 3] = [
        (
            "grains.csv",
            &[
                ("time", 0.01),
                ("z", 2e-3),
                ("vz", 0.2),
                ("wx", 100.0),
                ("fz", 8e-5),
                ("tx", 1.6e-7),
            ],
        ),
        (
            "diagnostics.csv",
            &[
                ("time", 0.01),
                ("gap", 2e-3),
                ("max_velocity", 0.2),
                ("grain_kinetic_energy", 1.6e-7),
                ("momentum_z", 8e-7),
            ],
        ),
        ("probes/middle.csv", &[("x", 2e-3), ("vz", 0.2), ("pressure", 20.0)]),
    ];
    let mut notes = Vec::new();
    for (file, columns) in expected {
        let read = |run: &Path| std::fs::read_to_string(run.join(file)).unwrap();
        let table = Table::read(&scaled.join(file), &mut notes).unwrap();
        for (name, unit) in columns {
            let column =
                |name: &str| table.column(name).unwrap_or_else(|| panic!("{name}")).to_vec();
            let (values, without) = (column(name), column(&format!("{name}_scaled")));
            assert!(values.iter().zip(&without).all(|(v, s)| {
                v.is_nan() && s.is_nan() || (v / unit - s).abs() <= 1e-12 * s.abs()
            }));
            assert!(values.iter().any(|value| *value != 0.0), "{name}");
        }
        // The columns in SI units are those without scales.
        let (all, si) = (read(&scaled), read(&plain));
        assert_eq!(all.lines().count(), si.lines().count());
        for (all, si) in all.lines().zip(si.lines()) {
            assert!(all.starts_with(&format!("{si},")), "{all}\n{si}");
        }
        assert!(
            !si.contains("_scaled") && !all.contains("grain_scaled") && !all.contains("qw_scaled")
        );
    }
    let summary = std::fs::read_to_string(scaled.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["scales"]["velocity_m_per_s"], 0.2);
    // Other scales are another case.
    let other = ["--resume", "--set", "output.scales=\"gravity\"", "--set", "time.end=1"];
    let message = run(&case, &scaled, &other).code(2);
    let message = String::from_utf8_lossy(&message.get_output().stderr).into_owned();
    assert!(message.contains("output.scales"), "{message}");
}

/// Kills the run at random moments until it comes through, and compares with an unharmed one.
fn survives_kills(case_text: &str, seed: u64) {
    let (folder, case) = folder_with(case_text);
    let (whole, killed) = (folder.path().join("whole"), folder.path().join("killed"));
    let start = std::time::Instant::now();
    run(&case, &whole, &["--threads", "2"]).success();
    let length = start.elapsed().as_millis() as u64;
    let mut random = SplitMix64::seed_from_u64(seed);
    let mut kills = 0;
    for attempt in 0..200 {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin("grainwake"));
        command.arg("run").arg(&case).arg("-o").arg(&killed).args(["--quiet", "--threads", "1"]);
        // Before its first file is written there is nothing to resume.
        if killed.join("provenance.json").is_file() {
            command.arg("--resume");
        }
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        if attempt < 10 {
            std::thread::sleep(Duration::from_millis(
                random.random_range(0..length.max(20) * 2 / 3),
            ));
            child.kill().unwrap();
        }
        let output = child.wait_with_output().unwrap();
        // The run may have come to its end just before; a killed one has no exit code.
        kills += usize::from(output.status.code().is_none());
        if output.status.success() && attempt >= 10 {
            break;
        }
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.success() || output.status.code().is_none(),
            "attempt {attempt}: {:?} {message}",
            output.status
        );
    }
    assert!(kills > 0, "no kill met a run");
    assert_same_run(&whole, &killed);
}

#[test]
fn a_killed_dry_run_resumes_to_the_same_bits() {
    survives_kills(DRY, 1);
}

#[test]
fn a_killed_wet_run_resumes_to_the_same_bits() {
    survives_kills(WET, 2);
}

#[test]
fn checkpoints_and_threads_do_not_change_the_results() {
    let (folder, case) = folder_with(WET);
    let (a, b) = (folder.path().join("a"), folder.path().join("b"));
    run(
        &case,
        &a,
        &["--threads", "1", "--set", "output.checkpoint_steps=0", "--set", "run.threads=3"],
    )
    .success();
    run(&case, &b, &["--threads", "3", "--set", "output.checkpoint_steps=1"]).success();
    for file in [
        "grains.csv",
        "diagnostics.csv",
        "events.jsonl",
        "fields/fields_000003.vti",
        "slices/y-grain1_000004.vti",
        "grains/grains_000006.vtp",
        "run.pvd",
    ] {
        assert!(
            std::fs::read(a.join(file)).unwrap() == std::fs::read(b.join(file)).unwrap(),
            "{file} differs"
        );
    }
    let last = |run: &Path| std::fs::read(checkpoints(run).pop().unwrap()).unwrap();
    assert!(last(&a) == last(&b), "the last checkpoints differ");
}

#[test]
fn the_resolved_case_gives_the_same_bits() {
    let (folder, case) = folder_with(WET);
    let (a, b) = (folder.path().join("a"), folder.path().join("b"));
    run(&case, &a, &["--set", "time.end=20 ms"]).success();
    run(&a.join("case.resolved.toml"), &b, &[]).success();
    assert_same_run(&a, &b);
}

/// A run that has not finished, with two checkpoints.
fn unfinished(folder: &Path, case: &Path) -> PathBuf {
    let out = folder.join("run");
    run(case, &out, &["--set", "time.end=20 ms"]).success();
    // A finished run keeps its last checkpoint alone; one that goes on keeps the one before.
    let before = checkpoints(&out).pop().unwrap();
    let bytes = std::fs::read(&before).unwrap();
    run(case, &out, &["--resume", "--set", "time.end=30 ms"]).success();
    std::fs::remove_file(out.join("summary.json")).unwrap();
    std::fs::write(before, bytes).unwrap();
    assert_eq!(checkpoints(&out).len(), 2);
    out
}

fn damage(path: &Path) {
    let mut bytes = std::fs::read(path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn a_damaged_checkpoint_gives_way_to_the_one_before() {
    let (folder, case) = folder_with(WET);
    let whole = folder.path().join("whole");
    run(&case, &whole, &["--set", "time.end=30 ms"]).success();
    for harm in [damage as fn(&Path), |p| std::fs::write(p, b"short").unwrap()] {
        let out = unfinished(folder.path(), &case);
        harm(&checkpoints(&out)[1]);
        let done = run(&case, &out, &["--set", "time.end=30 ms", "--resume"]).success();
        let message = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
        assert!(
            message.contains("warning") && message.contains("checkpoint before it"),
            "{message}"
        );
        assert_same_run(&whole, &out);
        std::fs::remove_dir_all(out).unwrap();
    }
}

#[test]
fn a_checkpoint_ahead_of_the_tables_gives_way_to_the_one_before() {
    let (folder, case) = folder_with(WET);
    let whole = folder.path().join("whole");
    run(&case, &whole, &["--set", "time.end=30 ms"]).success();
    for table in ["grains.csv", "diagnostics.csv"] {
        let out = unfinished(folder.path(), &case);
        // The rows since the older checkpoint, at 20 ms, are lost.
        let text = std::fs::read_to_string(out.join(table)).unwrap();
        let early = |line: &&str| {
            let time = line.split(',').next().unwrap().parse::<f64>();
            time.is_ok_and(|time| time < 0.0201) || line.starts_with("time")
        };
        let kept: Vec<&str> = text.lines().filter(early).collect();
        std::fs::write(out.join(table), kept.join("\n") + "\n").unwrap();
        let done = run(&case, &out, &["--set", "time.end=30 ms", "--resume"]).success();
        let message = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
        assert!(
            message.contains(&format!("the tables do not reach it: {table} has"))
                && message.contains("checkpoint before it"),
            "{message}"
        );
        assert_same_run(&whole, &out);
        std::fs::remove_dir_all(out).unwrap();
    }
    // Other ends of lines, as a spreadsheet writes them, shift all rows.
    for table in ["grains.csv", "diagnostics.csv"] {
        let out = unfinished(folder.path(), &case);
        let text = std::fs::read_to_string(out.join(table)).unwrap();
        std::fs::write(out.join(table), text.replace('\n', "\r\n")).unwrap();
        let before = crate::common::contents(&out);
        let done = run(&case, &out, &["--set", "time.end=30 ms", "--resume"]).code(4);
        done.stderr(predicates::str::contains(format!("{table} was changed")));
        assert_eq!(before, crate::common::contents(&out), "nothing may change");
        std::fs::remove_dir_all(out).unwrap();
    }
    // Without any rows there is nothing to continue.
    let out = unfinished(folder.path(), &case);
    std::fs::remove_file(out.join("grains.csv")).unwrap();
    let before = crate::common::contents(&out);
    let done = run(&case, &out, &["--set", "time.end=30 ms", "--resume"]).code(4);
    let message = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    assert!(
        message.contains("grains.csv is missing")
            && message.contains("--force")
            && !message.contains("continue a started run with --resume"),
        "{message}"
    );
    assert_eq!(before, crate::common::contents(&out), "nothing may change");
}

#[cfg(unix)]
#[test]
fn a_limit_of_the_file_size_is_an_error_and_the_run_resumes() {
    let (folder, case) = folder_with(WET);
    let (out, whole) = (folder.path().join("run"), folder.path().join("whole"));
    let sets = ["fields=0", "slices=0", "surfaces=0", "at_events=false", "tables=0.2 ms"];
    let sets = sets.map(|set| format!("output.{set}"));
    let mut sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
    // A checkpoint smaller than the table at its end.
    sets.extend(["--set", "run.precision=f32"]);
    run(&case, &whole, &sets).success();
    let largest = |file: &str| std::fs::metadata(whole.join(file)).unwrap().len();
    assert!(largest("grains.csv") > 180_000);
    // The first checkpoint exceeds the first limit; in the middle of the run a table exceeds the
    // second one.
    for (kilobytes, file) in [(50, "checkpoint"), (140, "grains.csv")] {
        let command = format!("ulimit -c 0; ulimit -f {kilobytes}; exec \"$@\"");
        let mut shell = Command::new("bash");
        shell.args(["-c", &command, "bash"]).arg(assert_cmd::cargo::cargo_bin("grainwake"));
        shell.arg("run").arg(&case).arg("-o").arg(&out).arg("--quiet").args(&sets);
        let output = shell.output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(4), "{message}");
        assert!(message.contains("cannot write") && message.contains("ulimit -f"), "{message}");
        assert!(message.contains(file) && !out.join("summary.json").exists(), "{message}");
        run(&case, &out, &[&sets[..], &["--resume"]].concat()).success();
        for file in ["grains.csv", "diagnostics.csv", "events.jsonl"] {
            let read = |run: &Path| std::fs::read(run.join(file)).unwrap();
            assert!(read(&whole) == read(&out), "{file}");
        }
        std::fs::remove_dir_all(&out).unwrap();
    }
}

#[test]
fn two_damaged_checkpoints_end_with_exit_code_4() {
    let (folder, case) = folder_with(WET);
    let out = unfinished(folder.path(), &case);
    for path in checkpoints(&out) {
        damage(&path);
    }
    let before = crate::common::contents(&out);
    let done = run(&case, &out, &["--set", "time.end=30 ms", "--resume"]).code(4);
    let message = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    assert!(
        message.contains("no checkpoint")
            && message.contains("checksum")
            && message.contains("--force"),
        "{message}"
    );
    assert_eq!(before, crate::common::contents(&out), "nothing may change");
}

#[test]
fn a_run_without_checkpoints_is_not_replaced_by_resuming() {
    let (folder, case) = folder_with(WET);
    let finished = folder.path().join("finished");
    run(&case, &finished, &["--set", "time.end=3 ms"]).success();
    let killed = unfinished(folder.path(), &case);
    // Without rows after the first state, as with long intervals of the tables.
    let bare = folder.path().join("bare");
    std::fs::rename(&killed, &bare).unwrap();
    let rows = std::fs::read_to_string(bare.join("diagnostics.csv")).unwrap();
    let first: String = rows.split_inclusive('\n').take(2).collect();
    std::fs::write(bare.join("diagnostics.csv"), first).unwrap();
    let killed = unfinished(folder.path(), &case);
    for out in [finished, killed, bare] {
        std::fs::remove_dir_all(out.join("checkpoint")).unwrap();
        let before = crate::common::contents(&out);
        let done = run(&case, &out, &["--set", "time.end=30 ms", "--resume"]).code(4);
        let message = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
        assert!(message.contains("no checkpoint") && message.contains("--force"), "{message}");
        assert_eq!(before, crate::common::contents(&out), "nothing may change");
    }
}

#[test]
fn a_finished_run_is_not_overwritten() {
    let (folder, case) = folder_with(DRY);
    let out = folder.path().join("run");
    run(&case, &out, &["--set", "time.end=2 ms"]).success();
    let before = crate::common::contents(&out);
    let refused = run(&case, &out, &["--set", "time.end=2 ms"]).code(2);
    let message = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    assert!(
        message.contains("finished run") && message.contains("--force") && message.contains("-o"),
        "{message}"
    );
    run(&case, &out, &["--set", "time.end=2 ms", "--resume"]).success();
    assert_eq!(before, crate::common::contents(&out));
    run(&case, &out, &["--set", "time.end=2 ms", "--force"]).success();
    let other =
        run(&case, &out, &["--set", "time.end=2 ms", "--set", "grain.0.density=2000", "--resume"])
            .code(2);
    assert!(String::from_utf8_lossy(&other.get_output().stderr).contains("another case"));
}

#[test]
fn a_finished_run_can_be_continued_to_a_later_end() {
    let (folder, case) = folder_with(DRY);
    let (out, whole) = (folder.path().join("run"), folder.path().join("whole"));
    run(&case, &out, &["--set", "time.end=20 ms"]).success();
    run(&case, &out, &["--set", "time.end=40 ms", "--resume"]).success();
    run(&case, &whole, &["--set", "time.end=40 ms"]).success();
    assert_same_run(&whole, &out);
}

#[test]
fn an_extended_run_keeps_the_intervals_of_its_start() {
    // Without gravity the longest step depends on the end, as the default intervals do.
    let given = ["tables = \"2 ms\"\n", "slices = \"10 ms\"\n"];
    let text = given.iter().fold(WET.to_owned(), |text, key| text.replace(key, ""));
    let text = format!("gravity = [0, 0, 0]\n{text}velocity = [0, 0, -0.05]\n")
        + "[[probe]]\nname = \"middle\"\npoint = [2e-3, 2e-3, 6e-3]\n";
    let (folder, case) = folder_with(&text);
    let (out, whole) = (folder.path().join("run"), folder.path().join("whole"));
    let keys =
        ["output.tables", "output.slices", "output.surfaces", "probe.0.every", "time.max_step"];
    let intervals = || {
        let Case { plan, setup, .. } = Case::load(&out.join("case.resolved.toml"), &[]).unwrap();
        let outputs = [plan.tables, plan.slices, plan.surfaces, plan.probes[0].every];
        (outputs, format!("{:?}", setup.step))
    };
    run(&case, &out, &["--set", "time.end=20 ms"]).success();
    let started = intervals();
    let anew = Case::load(&case, &["time.end=40 ms".into()]).unwrap();
    assert_ne!(anew.digest, Provenance::read(&out).unwrap().case_sha256);
    run(&case, &out, &["--set", "time.end=40 ms", "--resume"]).success();
    assert_eq!(intervals(), started);
    run(&out.join("case.resolved.toml"), &whole, &[]).success();
    assert_same_run(&whole, &out);
    run(&case, &out, &["--set", "time.end=50 ms", "--resume-or-start"]).success();
    assert_eq!(intervals(), started);
    // An interval that is given counts.
    for key in keys {
        let other = format!("{key}=0.3 ms");
        let refused = run(&case, &out, &["--set", "time.end=60 ms", "--resume", "--set", &other]);
        let message = String::from_utf8_lossy(&refused.code(2).get_output().stderr).into_owned();
        assert!(message.contains("another case") && message.contains(key), "{message}");
    }
}

/// Runs the case up to `until` [s] in steps that the test takes, as a program that controls grains.
fn controlled(case: &Path, out: &Path, existing: Existing, until: f64) {
    let job = Case::load(case, &[]).unwrap().job();
    let options =
        Options { existing, controlled_from: Some("Python".into()), ..Options::default() };
    let (mut sim, mut recording) = Recording::start(&job, out, &options, &mut |_| {}).unwrap();
    while sim.time() < until {
        recording.step(&mut sim, f64::INFINITY).unwrap();
    }
    recording.checkpoint(&sim).unwrap();
    if recording.at_end(&sim) {
        recording.finish(&sim).unwrap();
    }
}

#[test]
fn only_the_program_that_controls_a_run_resumes_it() {
    let (folder, case) = folder_with(WET);
    let (out, whole) = (folder.path().join("run"), folder.path().join("whole"));
    run(&case, &whole, &[]).success();
    controlled(&case, &out, Existing::Refuse, 0.02);
    let before = crate::common::contents(&out);
    let refused = run(&case, &out, &["--resume"]).code(2);
    let message = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    let words = message.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        words.contains("was controlled from Python: continue it there") && words.contains("-o"),
        "{message}"
    );
    assert_eq!(before, crate::common::contents(&out), "nothing may change");
    // The program goes on. It has controlled nothing, so that the bits are those of the case.
    controlled(&case, &out, Existing::Resume, 0.0599);
    assert_same_run(&whole, &out);
    let by = |run: &Path| Provenance::read(run).unwrap().controlled_from;
    assert_eq!((by(&out).as_deref(), by(&whole)), (Some("Python"), None));
    // Its checkpoint is a start for a run of the case alone.
    let branch = folder.path().join("branch");
    let from = out.to_string_lossy().into_owned();
    run(&case, &branch, &["--from", &from, "--set", "time.end=70 ms"]).success();
    assert_eq!(by(&branch), None);
    run(&case, &out, &["--force"]).success();
    assert_eq!(by(&out), None);
}

#[test]
fn a_folder_of_something_else_is_never_touched() {
    let (folder, case) = folder_with(DRY);
    for more in [&[][..], &["--force"], &["--resume"]] {
        let refused = run(&case, folder.path(), more).code(2);
        assert!(
            String::from_utf8_lossy(&refused.get_output().stderr)
                .contains("holds no run of this program")
        );
    }
    assert_eq!(crate::common::contents(folder.path()).len(), 1);
}

#[test]
fn the_missing_or_damaged_file_of_a_run_is_named() {
    let (folder, case) = folder_with(DRY);
    let out = folder.path().join("run");
    run(&case, &out, &["--set", "time.end=2 ms"]).success();
    let resumed = || {
        let refused = run(&case, &out, &["--set", "contact.friction=0.1", "--resume"]).code(2);
        let message = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
        message.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    assert!(resumed().contains("contact.friction"), "{}", resumed());
    let file = out.join("case.resolved.toml");
    std::fs::write(&file, "x =").unwrap();
    assert!(resumed().contains("its case.resolved.toml is damaged"), "{}", resumed());
    std::fs::remove_file(file).unwrap();
    assert!(resumed().contains("its case.resolved.toml is missing"), "{}", resumed());
    std::fs::write(out.join("provenance.json"), "{").unwrap();
    assert!(resumed().contains("a provenance.json that cannot be read"), "{}", resumed());
}

#[cfg(unix)]
#[test]
fn an_interrupt_and_sigterm_write_a_checkpoint_and_exit_with_130() {
    for signal in ["-INT", "-TERM", "-HUP"] {
        interrupted_by(signal);
    }
}

#[cfg(unix)]
fn interrupted_by(signal: &str) {
    let (folder, case) = folder_with(WET);
    let (out, whole) = (folder.path().join("run"), folder.path().join("whole"));
    // Minutes of computing: only the signal ends the run.
    let long = ["--set", "output.checkpoint_steps=0", "--set", "time.end=100 s"];
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("grainwake"));
    command.arg("run").arg(&case).arg("-o").arg(&out).arg("--quiet").args(long);
    let number = match signal {
        "-INT" => libc::SIGINT,
        "-TERM" => libc::SIGTERM,
        _ => libc::SIGHUP,
    };
    // Tests that run in the background or under `nohup` ignore some signals.
    let heed = move || {
        // SAFETY: `signal` may be called between `fork` and `exec`.
        unsafe { libc::signal(number, libc::SIG_DFL) };
        Ok(())
    };
    // SAFETY: `heed` only calls `signal`.
    unsafe { command.pre_exec(heed) };
    let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    while !out.join("slices/y-grain0_000000.vti").is_file() {
        std::thread::sleep(Duration::from_millis(1));
    }
    Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    let output = child.wait_with_output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{message}");
    assert!(message.contains("--resume"), "{message}");
    assert!(!out.join("summary.json").exists() && !checkpoints(&out).is_empty());
    // Both runs go on to an end shortly after the checkpoint, which is less than a row and a step
    // after the last row.
    let table = Table::read(&out.join("grains.csv"), &mut Vec::new()).unwrap();
    let end = format!("time.end={} s", table.column("time").unwrap().last().unwrap() + 0.02);
    let short = ["--set", "output.checkpoint_steps=0", "--set", &end];
    run(&case, &whole, &short).success();
    run(&case, &out, &[&short[..], &["--resume"]].concat()).success();
    let tables = |run: &Path| std::fs::read(run.join("grains.csv")).unwrap();
    assert!(tables(&whole) == tables(&out));
}

#[test]
fn a_run_that_blows_up_keeps_its_last_checkpoint() {
    let (folder, case) = folder_with(WET);
    let out = folder.path().join("run");
    let unstable = [
        "--set",
        "time.step=20 ms",
        "--set",
        "output.tables=1 s",
        "--set",
        "output.slices=0",
        "--set",
        "output.fields=0",
        "--set",
        "output.surfaces=0",
        "--set",
        "time.end=10 s",
        "--set",
        "output.checkpoint_steps=1",
    ];
    let done = run(&case, &out, &unstable).code(3);
    let message = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    assert!(
        message.contains("unstable") && message.contains("try") && message.contains("checkpoint"),
        "{message}"
    );
    assert!(
        message.contains("a smaller [time] step") && !message.contains("cfl"),
        "the case has a fixed step: {message}"
    );
    assert!(
        !checkpoints(&out).is_empty()
            && out.join("failure.json").is_file()
            && !out.join("summary.json").exists()
    );
}

/// The heavy grain leaves through the lower side; the light one rises and touches the upper wall.
const LEAVES: &str = r#"
gravity = [0, 0, -9.81]

[domain]
size = ["8 mm", "8 mm", "12 mm"]
cell_size = "0.5 mm"
boundaries = { x = "periodic", y = "periodic", z = ["outflow", "wall"] }

[fluid]
density = 1000
viscosity = "5 mPa s"

[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
density = 3000
position = ["2 mm", "2 mm", "2 mm"]
velocity = [0, 0, -0.1]

[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
density = 500
position = ["6 mm", "6 mm", "10 mm"]

[time]
end = "0.12 s"
step = "0.5 ms"

[output]
tables = "5 ms"
slices = 0
surfaces = 0
"#;

#[test]
fn a_resumed_run_finds_the_same_events_after_a_grain_has_left() {
    let (folder, case) = folder_with(LEAVES);
    let (out, whole) = (folder.path().join("run"), folder.path().join("whole"));
    run(&case, &out, &["--set", "time.end=60 ms"]).success();
    run(&case, &out, &["--resume"]).success();
    run(&case, &whole, &[]).success();
    assert_same_run(&whole, &out);
    let events = std::fs::read_to_string(out.join("events.jsonl")).unwrap();
    assert!(events.contains("\"left\""), "{events}");
    assert!(!events.contains("landing"), "the heavy grain settles downwards: {events}");
    let table = Table::read(&out.join("grains.csv"), &mut Vec::new()).unwrap();
    let touches = table.column("contacts").unwrap().iter().any(|contacts| *contacts > 0.0);
    assert!(touches, "the light grain touches the upper wall");
}

#[test]
fn an_end_before_the_checkpoint_is_refused() {
    let (folder, case) = folder_with(DRY);
    let out = folder.path().join("run");
    run(&case, &out, &["--set", "time.end=20 ms"]).success();
    std::fs::remove_file(out.join("summary.json")).unwrap();
    let refused = run(&case, &out, &["--set", "time.end=10 ms", "--resume"]).code(2);
    let message = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    assert!(message.contains("reached t = 20 ms, after the end at 10 ms"), "{message}");
    run(&case, &out, &["--set", "time.end=30 ms", "--resume"]).success();
}

#[test]
fn a_report_of_an_earlier_state_is_named_if_none_is_drawn() {
    let (folder, case) = folder_with(DRY);
    let out = folder.path().join("run");
    run(&case, &out, &["--set", "time.end=10 ms", "--no-report"]).success();
    std::fs::write(out.join("report.html"), "old").unwrap();
    let messages = |more: &[&str]| {
        let mut command = grainwake();
        let done = command.arg("run").arg(&case).arg("-o").arg(&out).args(more).assert().success();
        String::from_utf8_lossy(&done.get_output().stderr).into_owned()
    };
    let resumed = messages(&["--set", "time.end=20 ms", "--resume", "--no-report"]);
    assert!(resumed.contains("report.html shows an earlier state"), "{resumed}");
    // A run that starts again has no report.
    let again = messages(&["--set", "time.end=10 ms", "--force", "--no-report"]);
    assert!(!again.contains("report.html"), "{again}");
}

#[test]
fn a_run_that_finishes_after_a_failure_is_not_shown_as_failed() {
    let (folder, case) = folder_with(DRY);
    let out = folder.path().join("run");
    run(&case, &out, &["--set", "time.end=10 ms"]).success();
    std::fs::write(out.join("failure.json"), "{}").unwrap();
    run(&case, &out, &["--set", "time.end=20 ms", "--resume"]).success();
    assert!(!out.join("failure.json").exists());
}

#[test]
fn no_grain_is_at_rest_when_all_have_left() {
    let falls = LEAVES.replace("density = 500", "density = 3000").replace("\"10 mm\"", "\"3 mm\"");
    let (folder, case) = folder_with(&falls.replace("\"wall\"]", "\"outflow\"]"));
    let out = folder.path().join("run");
    run(&case, &out, &["--set", "time.stop=\"rest\""]).success();
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    assert!(summary.contains("\"ended_by\": \"end\""), "{summary}");
}

#[test]
fn a_folder_that_cannot_be_written_is_exit_code_4() {
    let (folder, case) = folder_with(DRY);
    let file = folder.path().join("file");
    std::fs::write(&file, "x").unwrap();
    let done = run(&case, &file.join("run"), &[]).code(4);
    assert!(String::from_utf8_lossy(&done.get_output().stderr).contains("file"));
}

#[test]
fn a_run_that_was_killed_in_its_first_moments_can_be_started_again() {
    let (folder, case) = folder_with(DRY);
    let out = folder.path().join("run");
    std::fs::create_dir_all(out.join("slices")).unwrap();
    std::fs::create_dir_all(out.join("checkpoint")).unwrap();
    std::fs::write(out.join("provenance.json.tmp"), "{").unwrap();
    run(&case, &out, &["--set", "time.end=2 ms"]).success();
    assert!(!out.join("provenance.json.tmp").exists());
}

#[test]
fn outputs_that_nearly_coincide_do_not_end_a_run() {
    let (folder, case) = folder_with(WET);
    let out = folder.path().join("out");
    let more = ["time.end=20 ms", "output.tables=5 ms", "output.slices=5.000001 ms"];
    let more: Vec<&str> = more.iter().flat_map(|set| ["--set", set]).collect();
    run(&case, &out, &more).success();
}

#[test]
fn resume_or_start_serves_the_first_and_every_later_job() {
    let (folder, case) = folder_with(DRY);
    let out = folder.path().join("run");
    let run = |more: &[&str]| {
        let mut command = grainwake();
        command.arg("run").arg(&case).arg("-o").arg(&out).args(["--no-report"]).args(more).assert()
    };
    run(&["--resume"]).code(2).stderr(predicates::str::contains("--resume-or-start"));
    run(&["--resume-or-start", "--set", "time.end=20 ms"]).success();
    let resumed = run(&["--resume-or-start", "--set", "time.end=20 ms"]).success();
    resumed.stderr(predicates::str::contains("already finished"));
    run(&["--resume-or-start", "--force"]).code(2);
}
