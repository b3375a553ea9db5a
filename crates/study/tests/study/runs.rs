//! Execution of runs: resume, repetition of stale runs, locks and failures.

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use crate::common::{folder, plan};
use crate::files::STUDY;
use grainwake_run::{FailureKind, Progress};
use grainwake_study::{
    Archive, Options, Outcome, Plan, RunRecord, RunState, StateKind, Study, StudyError,
    StudyObserver, execute, records, refuse_to_replace, render, run_state, to_csv, write_tables,
};

struct Quiet;
impl StudyObserver for Quiet {}

/// Interrupts after a total number of steps of all runs.
struct After(AtomicU64, u64);
impl StudyObserver for After {
    fn progress(&self, _: usize, _: &Progress) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
    fn interrupted(&self) -> bool {
        self.0.load(Ordering::Relaxed) >= self.1
    }
}

fn options(jobs: usize) -> Options {
    Options {
        jobs,
        threads: 1,
        retry: false,
        keep_checkpoints: false,
        command: vec!["test".into()],
    }
}

fn run(plan: &Plan, study: &Path, watcher: &dyn StudyObserver, options: &Options) -> Vec<Outcome> {
    plan.create_folder(study).unwrap();
    let runs = &plan.runs;
    let all: Vec<usize> = (0..runs.len()).collect();
    execute(runs, &all, study, options, watcher).unwrap().into_iter().map(|(_, o)| o).collect()
}

fn states(plan: &Plan, study: &Path) -> Vec<RunState> {
    let archive = Archive::read(study).unwrap();
    plan.runs.iter().map(|r| run_state(r, study, &archive)).collect()
}

fn results(plan: &Plan, study: &Path) -> Vec<Vec<u8>> {
    let file = |name: &str| {
        plan.runs
            .iter()
            .map(|r| std::fs::read(r.folder(study).join(name)).unwrap())
            .collect::<Vec<_>>()
    };
    [file("grains.csv"), file("events.jsonl"), file("case.resolved.toml")].concat()
}

#[test]
fn finished_runs_are_kept_and_stale_ones_repeated() {
    let (folder, path) = folder(STUDY);
    let study = folder.path().join("out");
    let first = plan(&path).unwrap();
    assert!(states(&first, &study).iter().all(|s| *s == RunState::Missing));
    let ended = run(&first, &study, &Quiet, &options(2));
    assert!(ended.iter().all(|o| matches!(o, Outcome::Finished(_))), "{ended:?}");
    assert!(!study.join("runs/alone/checkpoint").exists(), "checkpoints of finished runs go");
    assert_eq!(Plan::read(&study).unwrap(), first);
    let kept = std::fs::read(study.join("runs/alone/provenance.json")).unwrap();
    assert!(
        run(&first, &study, &Quiet, &options(1)).iter().all(|o| *o == Outcome::AlreadyFinished)
    );
    assert_eq!(std::fs::read(study.join("runs/alone/provenance.json")).unwrap(), kept, "untouched");
    // One model changes: only this one is stale and repeated.
    std::fs::write(&path, STUDY.replace("friction = 0.6", "friction = 0.3")).unwrap();
    let second = plan(&path).unwrap();
    let found = states(&second, &study);
    let stale: Vec<StateKind> = found.iter().map(RunState::kind).collect();
    let (finished, changed) = (StateKind::Finished, StateKind::Stale);
    assert_eq!(stale, [finished, changed, finished, changed, finished]);
    let ended = run(&second, &study, &Quiet, &options(1));
    let again: Vec<bool> = ended.iter().map(|o| matches!(o, Outcome::Finished(_))).collect();
    assert_eq!(again, [false, true, false, true, false]);
    // A changed end time is stale too, although the case hash does not include it.
    let longer = Plan::resolve(&Study::read(&path).unwrap(), &["time.end=0.07".into()]).unwrap();
    assert!(states(&longer, &study).iter().all(|s| matches!(s, RunState::Stale(_))));
    // Runs of another case or end count as results that are replaced, those of another program not.
    let all: Vec<usize> = (0..second.runs.len()).collect();
    let replaced_by = |plan: &Plan| match refuse_to_replace(&plan.runs, &all, &study) {
        Ok(()) => 0,
        Err(StudyError::WouldReplace { runs, .. }) => runs.len(),
        Err(error) => panic!("{error}"),
    };
    assert_eq!((replaced_by(&first), replaced_by(&second), replaced_by(&longer)), (2, 0, 5));
    // Another version of the program.
    let file = study.join("runs/alone/provenance.json");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replace("\"version\": \"", "\"version\": \"0.0.")).unwrap();
    assert!(matches!(states(&second, &study)[4], RunState::Stale(why) if why.contains("version")));
    assert_eq!((replaced_by(&second), replaced_by(&longer)), (0, 5));
}

#[test]
fn resumed_studies_give_identical_bits() {
    let (folder, path) = folder(STUDY);
    let plan = plan(&path).unwrap();
    let (whole, broken) = (folder.path().join("whole"), folder.path().join("broken"));
    run(&plan, &whole, &Quiet, &options(1));
    let mut rounds = 0;
    loop {
        let ended = run(&plan, &broken, &After(AtomicU64::new(0), 333), &options(2));
        rounds += 1;
        if ended.iter().all(|o| matches!(o, Outcome::Finished(_) | Outcome::AlreadyFinished)) {
            break;
        }
        assert!(ended.contains(&Outcome::Interrupted) && rounds < 50, "{ended:?}");
        assert!(states(&plan, &broken).contains(&RunState::Unfinished) || rounds > 1);
    }
    assert!(rounds > 3, "it was interrupted {rounds} times");
    assert_eq!(results(&plan, &whole), results(&plan, &broken));
    let (a, b) = (records(&plan, &whole).unwrap(), records(&plan, &broken).unwrap());
    let measured = |rows: &[grainwake_study::RunRecord]| {
        rows.iter().map(|r| (r.pair.clone(), r.steps)).collect::<Vec<_>>()
    };
    assert_eq!(measured(&a), measured(&b));
    assert!(
        a.iter().all(|r| r.pair.as_ref().unwrap().kiss_time.is_some() || r.name == "alone"),
        "they do collide"
    );
}

#[test]
fn a_run_without_a_usable_checkpoint_restarts() {
    let (folder, path) = folder(STUDY);
    let plan = plan(&path).unwrap();
    let (whole, broken) = (folder.path().join("whole"), folder.path().join("broken"));
    run(&plan, &whole, &Quiet, &options(1));
    run(&plan, &broken, &After(AtomicU64::new(0), 200), &options(1));
    let checkpoints = broken.join("runs/light-smooth/checkpoint");
    for file in std::fs::read_dir(&checkpoints).unwrap().flatten() {
        std::fs::write(file.path(), b"nonsense").unwrap();
    }
    let ended = run(&plan, &broken, &Quiet, &options(1));
    assert!(ended.iter().all(|o| matches!(o, Outcome::Finished(_))), "{ended:?}");
    assert_eq!(results(&plan, &whole), results(&plan, &broken));
}

#[test]
fn a_failed_run_does_not_stop_the_others() {
    let (folder, path) = folder(STUDY);
    let plan = plan(&path).unwrap();
    let study = folder.path().join("out");
    std::fs::create_dir_all(study.join("runs/light-rough")).unwrap();
    std::fs::write(study.join("runs/light-rough/mine.txt"), "not a run").unwrap();
    let ended = run(&plan, &study, &Quiet, &options(2));
    for (i, outcome) in ended.iter().enumerate() {
        match outcome {
            Outcome::Failed(why, kind) => assert!(
                i == 1 && why.contains("is not empty") && *kind == FailureKind::Input,
                "{why}"
            ),
            other => assert!(i != 1 && matches!(other, Outcome::Finished(_))),
        }
    }
    assert_eq!(
        std::fs::read_to_string(study.join("runs/light-rough/mine.txt")).unwrap(),
        "not a run"
    );
    // An unstable run is not repeated unless requested.
    let alone = study.join("runs/alone");
    std::fs::remove_file(alone.join("summary.json")).unwrap();
    std::fs::write(alone.join("failure.json"), "{\"time\":0.1,\"what\":\"it blew up\"}").unwrap();
    assert_eq!(states(&plan, &study)[4], RunState::Failed("it blew up".into()));
    let ended = run(&plan, &study, &Quiet, &options(1));
    assert!(
        matches!(&ended[4], Outcome::Failed(why, FailureKind::Computation) if why.contains("it blew up"))
    );
    assert_eq!(records(&plan, &study).unwrap()[4].remark.as_deref(), Some("it blew up"));
    let ended = run(&plan, &study, &Quiet, &Options { retry: true, ..options(1) });
    assert!(matches!(ended[4], Outcome::Finished(_)));
}

#[test]
fn a_locked_run_is_skipped() {
    let (folder, path) = folder(STUDY);
    let plan = plan(&path).unwrap();
    let study = folder.path().join("out");
    std::fs::create_dir_all(study.join("runs")).unwrap();
    plan.create_folder(&study).unwrap();
    std::fs::create_dir_all(study.join("locks")).unwrap();
    let lock = std::fs::File::create(study.join("locks/alone.lock")).unwrap();
    lock.lock().unwrap();
    let ended = run(&plan, &study, &Quiet, &options(1));
    assert_eq!(ended[4], Outcome::Locked);
    assert!(matches!(ended[0], Outcome::Finished(_)));
    drop(lock);
    assert!(matches!(run(&plan, &study, &Quiet, &options(1))[4], Outcome::Finished(_)));
}

#[test]
fn folders_with_other_contents_are_refused() {
    let (folder, path) = folder(STUDY);
    let first = plan(&path).unwrap();
    let study = folder.path().join("out");
    first.create_folder(&study).unwrap();
    let other = folder.path().join("other.toml");
    std::fs::write(&other, STUDY.replace("title = \"test\"", "title = \"another\"")).unwrap();
    let second = plan(&other).unwrap();
    let error = second.create_folder(&study).unwrap_err().to_string();
    assert!(error.contains("holds another study, \"test\""), "{error}");
    // Most study files are called study.toml.
    let elsewhere = folder.path().join("elsewhere");
    std::fs::create_dir(&elsewhere).unwrap();
    std::fs::copy(folder.path().join("case.toml"), elsewhere.join("case.toml")).unwrap();
    std::fs::rename(&other, elsewhere.join("study.toml")).unwrap();
    let third = plan(&elsewhere.join("study.toml")).unwrap();
    assert!(third.create_folder(&study).is_err());
    // A corrected title, and a study file that was moved, are no other study.
    std::fs::write(&path, STUDY.replace("title = \"test\"", "title = \"tests\"")).unwrap();
    plan(&path).unwrap().create_folder(&study).unwrap();
    let moved = elsewhere.join("moved.toml");
    std::fs::rename(&path, &moved).unwrap();
    plan(&moved).unwrap().create_folder(&study).unwrap();
    let foreign = folder.path().join("foreign");
    std::fs::create_dir_all(&foreign).unwrap();
    std::fs::write(foreign.join("thesis.tex"), "").unwrap();
    assert!(first.create_folder(&foreign).unwrap_err().to_string().contains("holds no study"));
}

#[test]
fn the_table_has_every_run_and_survives_removal_of_the_run_folders() {
    let (folder, path) = folder(STUDY);
    let plan = plan(&path).unwrap();
    let study = folder.path().join("out");
    plan.create_folder(&study).unwrap();
    execute(&plan.runs, &[0, 4], &study, &options(1), &Quiet).unwrap();
    let rows = records(&plan, &study).unwrap();
    write_tables(&rows, &study).unwrap();
    let words: Vec<String> = rows.iter().map(|r| r.state.to_string()).collect();
    assert_eq!(words, ["finished", "missing", "missing", "missing", "finished"]);
    let mut csv = csv::Reader::from_path(study.join("table.csv")).unwrap();
    let header = csv.headers().unwrap().clone();
    let column =
        |name: &str| header.iter().position(|h| h == name).unwrap_or_else(|| panic!("{name}"));
    let lines: Vec<_> = csv.records().map(Result::unwrap).collect();
    assert_eq!(lines.len(), 5);
    assert_eq!((&lines[0][column("weight")], &lines[0][column("density")]), ("light", "2000"));
    let kiss: f64 = lines[0][column("kiss_time")].parse().unwrap();
    let seconds: f64 = lines[0][column("kiss_time_s")].parse().unwrap();
    assert!((kiss - seconds / (2e-3_f64 / 9.81).sqrt()).abs() < 1e-4 * kiss, "{kiss} {seconds}");
    assert_eq!(&lines[1][column("kiss_time")], "");
    assert_eq!(to_csv(&rows).lines().count(), 6);
    std::fs::remove_dir_all(study.join("runs")).unwrap();
    assert_eq!(records(&plan, &study).unwrap(), rows, "the table is kept");
}

#[test]
fn a_damaged_table_is_refused_and_stays() {
    let (folder, path) = folder(STUDY);
    let plan = plan(&path).unwrap();
    let study = folder.path().join("out");
    plan.create_folder(&study).unwrap();
    execute(&plan.runs, &[0], &study, &options(1), &Quiet).unwrap();
    write_tables(&records(&plan, &study).unwrap(), &study).unwrap();
    std::fs::remove_dir_all(study.join("runs")).unwrap();
    let table = study.join("table.json");
    let damaged = std::fs::read_to_string(&table).unwrap().replace("\n]", ",\n]");
    std::fs::write(&table, &damaged).unwrap();
    let refused = |error: StudyError| {
        let text = error.to_string();
        assert!(text.contains("table.json is damaged") && text.contains("line"), "{text}");
    };
    refused(render(&study).unwrap_err());
    refused(records(&plan, &study).unwrap_err());
    refused(Archive::read(&study).unwrap_err());
    refused(execute(&plan.runs, &[0], &study, &options(1), &Quiet).unwrap_err());
    refused(write_tables(&[], &study).unwrap_err());
    assert_eq!(std::fs::read_to_string(&table).unwrap(), damaged);
}

#[test]
fn a_finished_run_with_damaged_files_keeps_its_values() {
    let (folder, path) = folder(STUDY);
    let plan = plan(&path).unwrap();
    let study = folder.path().join("out");
    plan.create_folder(&study).unwrap();
    execute(&plan.runs, &[0], &study, &options(1), &Quiet).unwrap();
    let before = records(&plan, &study).unwrap();
    write_tables(&before, &study).unwrap();
    let file = plan.runs[0].folder(&study).join("grains.csv");
    let text = std::fs::read_to_string(&file).unwrap();
    let history =
        || std::fs::read(study.join(format!("histories/{}.csv", plan.runs[0].name))).unwrap();
    render(&study).unwrap();
    let thinned = history();
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    let [half, header] = [lines.len() / 2, 1].map(|count| lines[..count].concat());
    for damaged in [half, header, text.replacen(',', ";", 40)] {
        std::fs::write(&file, damaged).unwrap();
        let after = records(&plan, &study).unwrap();
        let remark = after[0].remark.clone().unwrap();
        assert!(remark.contains("grains.csv"), "{remark}");
        assert_eq!(after[0].pair, before[0].pair);
        let notes = render(&study).unwrap().notes;
        assert!(notes.iter().any(|note| note.contains("grains.csv")), "{notes:?}");
        assert_eq!(history(), thinned);
    }
    let page = std::fs::read_to_string(study.join("report.html")).unwrap();
    assert!(page.contains("grains.csv"), "the page names the damage");
    // The times of the stages of a pair come from the events.
    std::fs::write(&file, &text).unwrap();
    let events = plan.runs[0].folder(&study).join("events.jsonl");
    assert!(std::fs::read_to_string(&events).unwrap().lines().count() > 1);
    for damage in ["lost", "empty"] {
        match damage {
            "lost" => std::fs::remove_file(&events).unwrap(),
            _ => std::fs::write(&events, "").unwrap(),
        }
        let after = records(&plan, &study).unwrap();
        let remark = after[0].remark.clone().unwrap();
        assert!(remark.contains("events.jsonl lacks"), "{damage}: {remark}");
        assert_eq!(after[0].pair, before[0].pair, "{damage}");
    }
    assert_eq!(records(&plan, &study).unwrap()[0].pair, before[0].pair);
}

/// Only the end of the run is unknown; its results may be sound.
#[test]
fn a_finished_run_with_a_damaged_case_is_reported_and_never_replaced() {
    let (folder, path) = folder(STUDY);
    let plan = plan(&path).unwrap();
    let study = folder.path().join("out");
    plan.create_folder(&study).unwrap();
    execute(&plan.runs, &[0], &study, &options(1), &Quiet).unwrap();
    let before = records(&plan, &study).unwrap();
    let files = ["provenance.json", "grains.csv", "summary.json"];
    let run_folder = plan.runs[0].folder(&study);
    let results = || files.map(|name| std::fs::read(run_folder.join(name)).unwrap());
    let (kept, resolved) = (results(), run_folder.join("case.resolved.toml"));
    let sound = std::fs::read(&resolved).unwrap();
    let text = String::from_utf8(sound.clone()).unwrap();
    let mut byte = sound.clone();
    *byte.last_mut().unwrap() = 0xff;
    let no_end = text.lines().filter(|line| !line.starts_with("end = ")).collect::<Vec<_>>();
    assert_eq!(no_end.len() + 1, text.lines().count());
    let damages = [
        (Some(byte), "not a text in UTF-8 (byte 0xff)"),
        (Some(format!("x =\n{text}").into_bytes()), "is damaged: line 1: "),
        (Some(no_end.join("\n").into_bytes()), "no `end` in [time]"),
        (None, "cannot be read"),
    ];
    let retry = Options { retry: true, ..options(1) };
    for in_table in [false, true] {
        for (damaged, reason) in &damages {
            match damaged {
                Some(bytes) => std::fs::write(&resolved, bytes).unwrap(),
                None => std::fs::remove_file(&resolved).unwrap(),
            }
            let named = |text: &str| text.contains("case.resolved.toml") && text.contains(reason);
            let RunState::Damaged(why) = &states(&plan, &study)[0] else {
                panic!("{:?}", states(&plan, &study)[0]);
            };
            assert!(named(why), "{why}");
            let ended = execute(&plan.runs, &[0], &study, &retry, &Quiet).unwrap();
            let Outcome::Failed(why, FailureKind::Input) = &ended[0].1 else {
                panic!("{ended:?}");
            };
            assert!(named(why) && why.contains("remove its folder"), "{why}");
            assert!(results() == kept, "nothing may change");
            let row = &records(&plan, &study).unwrap()[0];
            assert!(row.remark.as_deref().is_some_and(named), "{:?}", row.remark);
            // Values that are known stay.
            let values = in_table.then_some((StateKind::Finished, before[0].pair.clone()));
            let expected = values.unwrap_or((StateKind::Damaged, None));
            assert_eq!((row.state, row.pair.clone()), expected);
            let listed = render(&study);
            assert!(listed.is_ok());
            let page = std::fs::read_to_string(study.join("report.html")).unwrap();
            assert!(page.contains("case.resolved.toml cannot") || page.contains("is damaged"));
        }
        std::fs::write(&resolved, &sound).unwrap();
        write_tables(&before, &study).unwrap();
    }
    let ended = execute(&plan.runs, &[0], &study, &retry, &Quiet).unwrap();
    assert_eq!(ended[0].1, Outcome::AlreadyFinished);
}

#[test]
fn a_summary_of_another_structure_is_remarked() {
    let (folder, path) = folder(STUDY);
    let plan = plan(&path).unwrap();
    let study = folder.path().join("out");
    plan.create_folder(&study).unwrap();
    execute(&plan.runs, &[0], &study, &options(1), &Quiet).unwrap();
    let before = records(&plan, &study).unwrap();
    let file = plan.runs[0].folder(&study).join("summary.json");
    let mut summary: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    summary["steps"] = "many".into();
    std::fs::write(&file, summary.to_string()).unwrap();
    let row = &records(&plan, &study).unwrap()[0];
    let remark = row.remark.clone().unwrap();
    assert!(remark.contains("summary.json cannot be read") && remark.contains("many"), "{remark}");
    assert!(row.steps.is_none() && row.unmeasured());
    assert_eq!(row.pair, before[0].pair, "the tables are sound");
    // The row in the table has all values.
    write_tables(&before, &study).unwrap();
    let row = &records(&plan, &study).unwrap()[0];
    assert_eq!((row.steps, row.remark.as_ref()), (before[0].steps, Some(&remark)));
}

#[test]
fn a_study_continues_from_its_archive() {
    let (folder, path) = folder(STUDY);
    let first = plan(&path).unwrap();
    let study = folder.path().join("out");
    first.create_folder(&study).unwrap();
    execute(&first.runs, &[0, 4], &study, &options(1), &Quiet).unwrap();
    write_tables(&records(&first, &study).unwrap(), &study).unwrap();
    // Only the table goes to another machine.
    let archive = folder.path().join("archive");
    std::fs::create_dir(&archive).unwrap();
    std::fs::copy(study.join("table.json"), archive.join("table.json")).unwrap();
    let ended = run(&first, &archive, &Quiet, &options(1));
    let had: Vec<bool> = ended.iter().map(|o| *o == Outcome::AlreadyFinished).collect();
    assert_eq!(had, [true, false, false, false, true]);
    assert!(!archive.join("runs/alone").exists(), "not repeated");
    let both = records(&first, &archive).unwrap();
    assert!(both.iter().all(|record| record.finished() && record.pair.is_some()));
    assert_eq!(both[4], records(&first, &study).unwrap()[4]);
    // A run whose case has changed since is repeated.
    write_tables(&both, &archive).unwrap();
    std::fs::remove_dir_all(archive.join("runs")).unwrap();
    std::fs::write(&path, STUDY.replace("friction = 0.6", "friction = 0.3")).unwrap();
    let second = plan(&path).unwrap();
    let found: Vec<StateKind> = states(&second, &archive).iter().map(RunState::kind).collect();
    let (finished, missing) = (StateKind::Finished, StateKind::Missing);
    assert_eq!(found, [finished, missing, finished, missing, finished]);
}

#[test]
fn finished_runs_of_accepted_programs_count() {
    let (folder, path) = folder(STUDY);
    let plan = plan(&path).unwrap();
    let study = folder.path().join("out");
    plan.create_folder(&study).unwrap();
    execute(&plan.runs, &[0, 4], &study, &options(1), &Quiet).unwrap();
    // Another program made both runs; of the second only the row of the table is left.
    let other = "0123456789ab".to_owned();
    let provenance = plan.runs[0].folder(&study).join("provenance.json");
    let mut made: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&provenance).unwrap()).unwrap();
    made["commit"] = other.clone().into();
    std::fs::write(&provenance, made.to_string()).unwrap();
    let mut rows = records(&plan, &study).unwrap();
    let accepting = plan.clone().accepting(std::slice::from_ref(&other)).unwrap();
    let id_by_other = |i: usize| accepting.runs[i].accepted_ids[0].clone();
    rows[4].id = id_by_other(4);
    write_tables(&rows, &study).unwrap();
    std::fs::remove_dir_all(plan.runs[4].folder(&study)).unwrap();

    let kinds =
        |plan: &Plan| states(plan, &study).iter().map(RunState::kind).collect::<Vec<StateKind>>();
    let (finished, missing, stale) = (StateKind::Finished, StateKind::Missing, StateKind::Stale);
    assert_eq!(kinds(&plan), [stale, missing, missing, missing, missing]);
    let wrong = plan.clone().accepting(&["900fc4e".into()]).unwrap_err();
    assert!(wrong.to_string().contains("900fc4e") && wrong.help.unwrap().contains("12"));
    let plan = accepting.clone();
    assert_eq!(kinds(&plan), [finished, missing, missing, missing, finished]);
    let rows = records(&plan, &study).unwrap();
    for i in [0, 4] {
        assert!(rows[i].finished() && rows[i].pair.is_some());
        assert_eq!(rows[i].id, id_by_other(i), "the row names the program");
    }
    let ended = execute(&plan.runs, &[0, 4], &study, &options(1), &Quiet).unwrap();
    assert!(ended.iter().all(|(_, outcome)| *outcome == Outcome::AlreadyFinished));
    // An unfinished run of another program is not continued.
    std::fs::remove_file(plan.runs[0].folder(&study).join("summary.json")).unwrap();
    assert_eq!(kinds(&plan)[0], stale);
}

#[test]
fn finished_runs_of_another_program_are_kept_in_the_earlier_table() {
    let (folder, path) = folder(STUDY);
    let plan = plan(&path).unwrap();
    let study = folder.path().join("out");
    plan.create_folder(&study).unwrap();
    execute(&plan.runs, &[0, 4], &study, &options(1), &Quiet).unwrap();
    // Another program made the first run; only the rows of the table are left.
    let mut rows = records(&plan, &study).unwrap();
    rows[0].id = "0".repeat(rows[0].id.len());
    write_tables(&rows, &study).unwrap();
    std::fs::remove_dir_all(study.join("runs")).unwrap();
    let outdated = || Archive::read(&study).unwrap().outdated(&plan.runs);
    assert_eq!(outdated(), 1);

    let earlier = || -> Vec<RunRecord> {
        let text = std::fs::read(study.join("table.earlier.json")).unwrap();
        serde_json::from_slice(&text).unwrap()
    };
    for _ in 0..2 {
        write_tables(&records(&plan, &study).unwrap(), &study).unwrap();
        assert_eq!(earlier(), rows[..1], "the row is kept once");
    }
    assert_eq!(outdated(), 0);
    assert!(records(&plan, &study).unwrap()[4].finished());
    // The sound row of the other run joins the first when it is replaced, its successor too.
    let mut changed = records(&plan, &study).unwrap();
    changed[4].id.clone_from(&rows[0].id);
    write_tables(&changed, &study).unwrap();
    write_tables(&records(&plan, &study).unwrap(), &study).unwrap();
    let names: Vec<String> = earlier().into_iter().map(|row| row.name).collect();
    assert_eq!(names, [0, 4, 4].map(|run: usize| rows[run].name.clone()));
    plan.create_folder(&study).unwrap();
}

#[test]
fn temporary_files_of_killed_programs_are_removed_after_a_day() {
    let (folder, path) = folder(STUDY);
    let study = folder.path().join("out");
    let plan = plan(&path).unwrap();
    plan.create_folder(&study).unwrap();
    let hours = |name: &str, age: u64| {
        let file = study.join(name);
        std::fs::write(&file, "{").unwrap();
        let written = std::time::SystemTime::now() - Duration::from_secs(age * 3600);
        std::fs::File::options().append(true).open(&file).unwrap().set_modified(written).unwrap();
        file
    };
    let old = hours("study.json.4711.tmp", 25);
    let kept = [("table.csv.4711.tmp", 23), ("notes.4711", 25), ("data.tmp", 25)];
    let kept = kept.map(|(name, age)| hours(name, age));
    plan.create_folder(&study).unwrap();
    assert!(!old.exists());
    assert!(kept.iter().all(|file| file.exists()));
}

#[test]
fn a_damaged_plan_is_rebuilt_from_the_runs() {
    let (folder, path) = folder(STUDY);
    let study = folder.path().join("out");
    let first = plan(&path).unwrap();
    run(&first, &study, &Quiet, &options(2));
    let before = records(&first, &study).unwrap();
    write_tables(&before, &study).unwrap();
    let manifest = study.join("study.json");
    let whole = std::fs::read(&manifest).unwrap();
    let damages: [&[u8]; 4] = [b"{", b"", b"\xff\xfe", &whole[..whole.len() / 2]];
    for damage in damages {
        std::fs::write(&manifest, damage).unwrap();
        assert!(Plan::read(&study).unwrap_err().to_string().contains("study.json is damaged"));
        let (rebuilt, note) = Plan::read_or_rebuild(&study).unwrap();
        assert!(note.unwrap().contains("writes the file again"));
        let mut found = records(&rebuilt, &study).unwrap();
        found.sort_by_key(|record| before.iter().position(|old| old.name == record.name));
        assert_eq!(found, before, "with levels, factors and results");
    }
    // Without the table, runs and results are found, but no levels.
    std::fs::remove_file(study.join("table.json")).unwrap();
    let (rebuilt, _) = Plan::read_or_rebuild(&study).unwrap();
    assert_eq!(rebuilt.runs.len(), 5);
    let found = records(&rebuilt, &study).unwrap();
    assert!(found.iter().all(|record| record.finished() && record.pair.is_some()));
    // A run whose case cannot be read is named.
    let case = study.join("runs/alone/case.resolved.toml");
    let text = std::fs::read(&case).unwrap();
    std::fs::write(&case, "title = ").unwrap();
    let (rebuilt, note) = Plan::read_or_rebuild(&study).unwrap();
    assert_eq!(rebuilt.runs.len(), 4);
    assert!(note.unwrap().contains("without alone, whose cases cannot be read"));
    std::fs::write(&case, text).unwrap();
    // The study goes on as if nothing had happened, also without the file.
    for damage in [true, false] {
        if damage {
            std::fs::write(&manifest, "{").unwrap();
        } else {
            std::fs::remove_file(&manifest).unwrap();
        }
        assert_eq!(first.damage_in(&study).is_some(), damage);
        let ended = run(&first, &study, &Quiet, &options(2));
        assert!(ended.iter().all(|outcome| *outcome == Outcome::AlreadyFinished), "{ended:?}");
        assert_eq!(std::fs::read(&manifest).unwrap(), whole);
    }
    // A folder of something else is left alone.
    let other = folder.path().join("other");
    std::fs::create_dir_all(&other).unwrap();
    std::fs::write(other.join("study.json"), "{").unwrap();
    assert!(first.create_folder(&other).is_err());
}
