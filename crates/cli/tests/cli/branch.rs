//! Runs that start from a checkpoint of another run.

use std::path::{Path, PathBuf};

use crate::common::{DRY, WET, assert_same_run, contents, folder_with, grainwake};
use serde_json::Value;

fn run(case: &Path, out: &Path, more: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = grainwake();
    command.arg("run").arg(case).arg("-o").arg(out).args(["--quiet", "--no-report"]);
    command.args(more).assert()
}

fn message(done: &assert_cmd::assert::Assert) -> String {
    String::from_utf8_lossy(&done.get_output().stderr).into_owned()
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// A run that keeps all its checkpoints.
fn parent(text: &str) -> (tempfile::TempDir, PathBuf, PathBuf) {
    let (folder, case) = folder_with(text);
    let out = folder.path().join("parent");
    run(&case, &out, &["--set", "output.checkpoint_keep=1000"]).success();
    (folder, case, out)
}

fn from(parent: &Path, time: &str) -> String {
    format!("{}@{time}", parent.display())
}

/// Lines of a table at times after `time` [s].
fn rows_after(run: &Path, table: &str, time: f64) -> Vec<String> {
    let text = std::fs::read_to_string(run.join(table)).unwrap();
    let after = |line: &&str| line.split(',').next().unwrap().parse::<f64>().unwrap() > time;
    text.lines().skip(1).filter(after).map(str::to_owned).collect()
}

/// Asserts that a branch with an unchanged case repeats its parent from the checkpoint on.
fn assert_continues(text: &str, time: &str) {
    let (folder, case, parent) = parent(text);
    let child = folder.path().join("child");
    run(&case, &child, &["--from", &from(&parent, time)]).success();
    let provenance = json(&child.join("provenance.json"));
    let start = provenance["parent"]["checkpoint_time"].as_f64().unwrap();
    assert!(start > 0.02, "{start}");
    let rows = rows_after(&child, "grains.csv", start);
    assert!(rows.len() > 20 && rows == rows_after(&parent, "grains.csv", start));
    let first = std::fs::read_to_string(child.join("grains.csv")).unwrap();
    assert!(first.lines().nth(1).unwrap().starts_with(&format!("{start},0,")), "{first}");
    // All files of the child but those of its start are files of the parent.
    let of_parent = contents(&parent);
    let mut compared = 0;
    for (name, bytes) in contents(&child) {
        let series =
            ["slices/", "fields/", "grains/"].iter().any(|folder| name.starts_with(folder));
        if series && !name.contains("_start.") || name == "events.jsonl" {
            let same = of_parent.iter().find(|(other, _)| *other == name);
            assert!(same.is_some_and(|(_, other)| *other == bytes), "{name} differs");
            compared += 1;
        }
    }
    assert!(compared > 3, "{compared}");
    let summary = |run: &Path| {
        let mut summary = json(&run.join("summary.json"));
        for key in [
            "wall_s",
            "cpu_s",
            "passes",
            "substeps",
            "contact_pairs",
            "max_divergence",
            "max_cfl",
            "max_overlap",
            "mean_overlap",
        ] {
            summary[key] = 0.into();
        }
        summary
    };
    assert_eq!(summary(&child), summary(&parent));
}

#[test]
fn a_dry_branch_without_changes_has_the_bits_of_its_parent() {
    assert_continues(DRY, "47 ms");
}

#[test]
fn a_wet_branch_without_changes_has_the_bits_of_its_parent() {
    assert_continues(WET, "0.031");
}

#[test]
fn a_branch_has_another_friction_step_end_and_outputs_and_records_its_parent() {
    let (folder, case, parent) = parent(DRY);
    let child = folder.path().join("child");
    let sets = [
        "contact.friction=0",
        "contact.restitution=0.5",
        "time.step=0.05 ms",
        "time.end=130 ms",
        "output.tables=3 ms",
        "output.checkpoint_keep=3",
    ];
    let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
    let from = from(&parent, "60 ms");
    run(&case, &child, &[&sets[..], &["--from", &from]].concat()).success();
    let own = json(&child.join("provenance.json"));
    let its = json(&parent.join("provenance.json"));
    assert_eq!(own["parent"]["case_sha256"], its["case_sha256"]);
    assert_ne!(own["case_sha256"], its["case_sha256"]);
    let absolute = std::fs::canonicalize(&parent).unwrap();
    assert_eq!(own["parent"]["folder"], absolute.display().to_string());
    let start = own["parent"]["checkpoint_time"].as_f64().unwrap();
    assert!((start - 0.06).abs() < 1e-9, "{start}");
    assert_eq!(own["sessions"][0]["from_step"], own["parent"]["checkpoint_step"]);
    let resolved = std::fs::read_to_string(child.join("case.resolved.toml")).unwrap();
    assert!(resolved.starts_with("# Started from step "), "{resolved}");
    let rows = rows_after(&child, "grains.csv", start);
    assert_eq!(rows.len(), 3 * 24, "63 ms to 129 ms, and the end");
    assert_ne!(rows.last(), rows_after(&parent, "grains.csv", start).last());
    let kept = std::fs::read_dir(child.join("checkpoint")).unwrap().count();
    assert_eq!(kept, 3);
    // A branch of the branch knows both.
    let grandchild = folder.path().join("grandchild");
    let more = ["--set", "time.end=140 ms", "--from", child.to_str().unwrap()];
    run(&case, &grandchild, &more).success();
    let chain = json(&grandchild.join("provenance.json"));
    assert_eq!(chain["parent"]["parent"], own["parent"]);
}

#[test]
fn an_interrupted_branch_resumes_to_the_same_bits() {
    let (folder, case, parent) = parent(WET);
    let (whole, parted) = (folder.path().join("whole"), folder.path().join("parted"));
    let from = from(&parent, "20 ms");
    let job = ["--from", &from, "--set", "fluid.viscosity=8 mPa s", "--resume-or-start"];
    run(&case, &whole, &job).success();
    run(&case, &parted, &[&job[..], &["--set", "time.end=40 ms"]].concat()).success();
    run(&case, &parted, &job).success();
    assert_same_run(&whole, &parted);
    // A job that names an earlier checkpoint of the same parent asks for another run.
    let mut earlier = job;
    let from = self::from(&parent, "10 ms");
    earlier[1] = &from;
    let refused = message(&run(&case, &parted, &earlier).code(2));
    assert!(refused.contains("it started at t = 14 ms"), "{refused}");
    // Another parent is refused, and so is a start at t = 0.
    let other = folder.path().join("other");
    run(&case, &other, &["--set", "grain.0.density=2000", "--set", "time.end=10 ms"]).success();
    let other = other.display().to_string();
    let mut changed = job;
    changed[1] = &other;
    let changed = [&changed[..], &["--set", "grain.0.density=2000"]].concat();
    let refused = message(&run(&case, &parted, &changed).code(2));
    assert!(refused.contains("another case"), "{refused}");
    for checkpoint in std::fs::read_dir(parted.join("checkpoint")).unwrap() {
        std::fs::remove_file(checkpoint.unwrap().path()).unwrap();
    }
    // The results of a run whose checkpoints were removed stay.
    let alone = [&job[2..4], &["--resume"]].concat();
    for job in [&alone[..], &job] {
        run(&case, &parted, &[job, &["--set", "time.end=160 ms"]].concat()).code(4);
    }
    // A run that was interrupted before its first checkpoint has no tables, and took no time.
    let provenance = parted.join("provenance.json");
    let text = std::fs::read_to_string(&provenance).unwrap();
    let mut own: serde_json::Value = serde_json::from_str(&text).unwrap();
    for session in own["sessions"].as_array_mut().unwrap() {
        session["wall_s"] = 0.0.into();
    }
    std::fs::write(&provenance, own.to_string()).unwrap();
    for file in ["summary.json", "grains.csv", "diagnostics.csv", "events.jsonl"] {
        std::fs::remove_file(parted.join(file)).unwrap();
    }
    let refused = message(&run(&case, &parted, &alone).code(2));
    assert!(refused.contains("has no checkpoint yet") && refused.contains("--from"), "{refused}");
    // With the parent named, the job starts again.
    run(&case, &parted, &job).success();
    let rows = |run: &Path| rows_after(run, "grains.csv", 0.0);
    assert_eq!(rows(&whole), rows(&parted));
}

#[test]
fn what_a_checkpoint_fixes_may_not_differ() {
    let (folder, case, parent) = parent(WET);
    let child = folder.path().join("child");
    let parent_name = parent.display().to_string();
    for (set, key, said) in [
        ("domain.cell_size=1 mm", "domain.cell_size", "8 x 8 x 24 cells"),
        ("domain.boundaries.x=\"wall\"", "domain.boundaries.x", "normal to x"),
        ("domain.origin=[0, 0, \"-1 mm\"]", "domain.origin", "begins at"),
        ("domain.refinement=2", "domain.refinement", "refinement is 2, and that of the parent"),
        ("run.precision=\"f32\"", "run.precision", "precision"),
        ("grain.0.nodes=300", "grain.0.nodes", "grain 0 has another set of surface nodes"),
        ("grain.0.shape.diameter=\"1.9 mm\"", "grain.0.shape", "grain 0 has another shape"),
        ("grain.0.position.0=\"1.9 mm\"", "grain.0.position", "another position at the start"),
        ("grain.0.velocity=[0, 0, -1e-3]", "grain.0.velocity", "another velocity at the start"),
        ("fluid.initial_velocity=[0, 0, 1e-3]", "fluid.initial_velocity", "initial velocity"),
        ("coupling.start=\"released\"", "coupling.start", "start of the grains"),
    ] {
        let done = run(&case, &child, &["--set", set, "--from", &parent_name]);
        let message = message(&done.code(2));
        assert!(message.contains(key) && message.contains(said), "{set}: {message}");
        assert!(message.contains("--set") && message.contains("checkpoint"), "{set}: {message}");
    }
    let text = std::fs::read_to_string(&case).unwrap();
    let third = "[[grain]]\nshape = { kind = \"sphere\", diameter = \"1 mm\" }\n\
                 density = 2500\nposition = [1e-3, 1e-3, 10e-3]\n";
    std::fs::write(&case, text.clone() + third).unwrap();
    let refused = message(&run(&case, &child, &["--from", &parent_name]).code(2));
    assert!(refused.contains("3 grains, and the parent run has 2 grains"), "{refused}");
    assert!(refused.contains("case.toml:"), "{refused}");
    std::fs::write(&case, text).unwrap();
    // The end of the case is that of the parent's newest checkpoint.
    let refused = message(&run(&case, &child, &["--from", &parent_name]).code(2));
    assert!(refused.contains("time.end") && refused.contains("later end"), "{refused}");
    assert!(!child.exists(), "nothing was written");
}

#[test]
fn a_parent_without_the_wanted_checkpoint_is_refused() {
    let (folder, case, parent) = parent(DRY);
    let child = folder.path().join("child");
    let name = parent.display().to_string();
    let refused = |from: &str, code: i32| {
        message(&run(&case, &child, &["--from", from, "--set", "time.end=1 s"]).code(code))
    };
    assert!(refused(&from(&parent, "soon"), 2).contains("runs/heap@0.5"));
    assert!(refused(&from(&parent, "2 mm"), 2).contains("a time"));
    let absent = refused(&folder.path().join("absent").display().to_string(), 2);
    assert!(absent.contains("is no folder") && absent.contains("--from runs/heap"), "{absent}");
    let empty = refused(&folder.path().display().to_string(), 2);
    assert!(empty.contains("holds no run"), "{empty}");
    let early = folder.path().join("early");
    let sets = ["--set", "time.end=10 ms", "--set", "output.checkpoint_steps=0"];
    run(&case, &early, &sets).success();
    let before = refused(&from(&early, "5 ms"), 2);
    assert!(before.contains("at 0.01 s") && before.contains("checkpoint_keep"), "{before}");
    // The folder of the parent is never the folder of the new run.
    let same = message(&run(&case, &parent, &["--from", &name, "--force"]).code(2));
    assert!(same.contains("time.end") || same.contains("give another folder"), "{same}");
    let later = ["--from", &name, "--force", "--set", "time.end=1 s"];
    let same = message(&run(&case, &parent, &later).code(2));
    assert!(same.contains("is the run to start from"), "{same}");
    // A damaged checkpoint gives way to the one before; without any other the run is refused.
    let mut kept: Vec<PathBuf> = std::fs::read_dir(parent.join("checkpoint"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    kept.sort();
    std::fs::write(kept.last().unwrap(), "short").unwrap();
    let sets = ["--from", &name, "--set", "time.end=121 ms"];
    let noted = message(&run(&case, &child, &sets).success());
    assert!(noted.contains("warning") && noted.contains("earlier checkpoint"), "{noted}");
    for path in kept {
        std::fs::write(path, "short").unwrap();
    }
    let other = folder.path().join("other");
    let refused = message(&run(&case, &other, &sets).code(4));
    assert!(refused.contains("no checkpoint") && refused.contains("cut off"), "{refused}");
    assert!(!other.exists());
}
