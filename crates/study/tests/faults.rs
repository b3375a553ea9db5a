//! Faults of the disk at random changes of a study: after any of them the study resumes to the bits
//! of an undisturbed one. `FAULT_CASES` sets the number of cases and `FAULT_SEED` their choice.

#[path = "study/files.rs"]
mod files;
#[path = "../../run/tests/common/folders.rs"]
mod folders;

use std::collections::BTreeMap;
use std::path::Path;

use files::{DRY, STUDY};
use folders::{contents, copy, folder_in_memory, setting};
use grainwake_formats::disk::faults::{Fault, inject};
use grainwake_run::FailureKind;
use grainwake_study::{
    Options, Outcome, Plan, Study, StudyError, StudyObserver, execute, records, write_tables,
};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::SplitMix64;

const FAULTS: [Fault; 5] =
    [Fault::Error, Fault::ShortWrite, Fault::Full, Fault::Crash, Fault::PowerCut];

struct Quiet;
impl StudyObserver for Quiet {}

/// Runs a study as `grainwake study` does: plan, runs, tables.
fn session(plan: &Plan, study: &Path) -> Result<Vec<Outcome>, StudyError> {
    let options = Options {
        jobs: 1,
        threads: 1,
        retry: false,
        keep_checkpoints: false,
        command: vec!["test".into()],
    };
    plan.create_folder(study)?;
    let all: Vec<usize> = (0..plan.runs.len()).collect();
    let ended = execute(&plan.runs, &all, study, &options, &Quiet)?;
    write_tables(&records(plan, study)?, study)?;
    Ok(ended.into_iter().map(|(_, outcome)| outcome).collect())
}

/// Results of all runs, the plan, and the table without its wall times.
fn results(plan: &Plan, study: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for run in &plan.runs {
        let files = contents(&run.folder(study)).into_iter();
        found.extend(files.map(|(name, bytes)| (format!("{}/{name}", run.name), bytes)));
    }
    let read = |name: &str| std::fs::read_to_string(study.join(name)).unwrap();
    let table = read("table.csv");
    let wall = table.lines().next().unwrap().split(',').position(|name| name == "wall_s").unwrap();
    let without_wall = |line: &str| {
        let cells = line.split(',').enumerate().filter(|(column, _)| *column != wall);
        cells.map(|(_, cell)| cell).collect::<Vec<_>>().join(",")
    };
    let table = table.lines().map(without_wall).collect::<Vec<_>>().join("\n");
    found.insert("table.csv".into(), table.into_bytes());
    found.insert("study.json".into(), read("study.json").into_bytes());
    found
}

/// Resolves the study with short runs.
fn plan(folder: &Path, study: &str) -> Plan {
    std::fs::write(folder.join("case.toml"), DRY).unwrap();
    let path = folder.join("study.toml");
    std::fs::write(&path, study.replace("50 ms", "5 ms")).unwrap();
    Plan::resolve(&Study::read(&path).unwrap(), &["time.end=4 ms".into()]).unwrap()
}

#[test]
fn a_study_resumes_to_the_same_bits_after_any_fault_of_the_disk() {
    let root = folder_in_memory();
    let earlier = plan(root.path(), &STUDY.replace("friction = 0.6", "friction = 0.3"));
    let before = root.path().join("before");
    session(&earlier, &before).unwrap();
    let plan = plan(root.path(), STUDY);
    let study = root.path().join("study");
    // A new study, and one that follows a study with other runs.
    let prepare = |anew: bool| {
        if !anew {
            copy(&before, &study);
        }
    };
    let mut changes = [0; 2];
    let mut whole = BTreeMap::new();
    for anew in [false, true] {
        prepare(anew);
        let count = inject(&study, Fault::Error, u64::MAX);
        session(&plan, &study).unwrap();
        changes[usize::from(anew)] = count.changes();
        drop(count);
        whole = results(&plan, &study);
        std::fs::remove_dir_all(&study).unwrap();
    }
    let (cases, seed) = (setting("FAULT_CASES", 40), setting("FAULT_SEED", 1));
    for number in 0..cases {
        let mut random = SplitMix64::seed_from_u64(seed ^ number.wrapping_mul(0x9e37_79b9));
        let anew = random.random_bool(0.7);
        prepare(anew);
        let mut story = format!("case {number} with FAULT_SEED={seed}, anew: {anew}");
        for _ in 0..random.random_range(1..=3) {
            let fault = FAULTS[random.random_range(0..FAULTS.len())];
            let at = random.random_range(0..changes[usize::from(anew)]);
            let injected = inject(&study, fault, at);
            let ended = session(&plan, &study);
            story += &format!("\n{fault:?} at {at}: {:?}", injected.struck());
            drop(injected);
            match ended {
                Ok(ended) => {
                    let failed = ended.iter().filter(|end| match end {
                        Outcome::Failed(_, kind) => *kind != FailureKind::InputOutput,
                        _ => false,
                    });
                    assert_eq!(failed.count(), 0, "{story}: {ended:?}");
                }
                Err(StudyError::Io { .. }) => {}
                Err(error) => panic!("{story}: {error}"),
            }
        }
        let ended = session(&plan, &study).unwrap_or_else(|error| panic!("{story}: {error}"));
        let good = |end: &Outcome| matches!(end, Outcome::Finished(_) | Outcome::AlreadyFinished);
        assert!(ended.iter().all(good), "{story}: {ended:?}");
        let found = results(&plan, &study);
        let names =
            |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<String>>();
        assert_eq!(names(&whole), names(&found), "{story}");
        let differs = found.iter().find(|(name, bytes)| whole[*name] != **bytes);
        assert!(differs.is_none(), "{story}: {} differs", differs.unwrap().0);
        std::fs::remove_dir_all(&study).unwrap();
    }
}
