//! Faults of the disk at random changes of a run: after any of them the run resumes to the bits of
//! an undisturbed run. `FAULT_CASES` sets the number of cases and `FAULT_SEED` their choice.

#[path = "common/folders.rs"]
mod folders;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use folders::{contents, copy, folder_in_memory, setting};
use grainwake_formats::disk::faults::{Fault, inject};
use grainwake_run::case::Case;
use grainwake_run::provenance::Provenance;
use grainwake_run::{Ending, Existing, FailureKind, Observer, Options, Parent, RunError, Silent};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::SplitMix64;

/// A grain in water that reaches the floor, with every kind of output.
const WET: &str = r#"
title = "wet"
[fluid]
density = 1000
viscosity = "5 mPa s"
[domain]
size = ["2 mm", "2 mm", "4 mm"]
cell_size = "0.5 mm"
boundaries = { x = "periodic", y = "periodic" }
[contact]
stiffness = 100
[time]
end = "6 ms"
step = "0.5 ms"
[output]
tables = "1 ms"
slices = "2 ms"
fields = "3 ms"
surfaces = "3 ms"
contacts = "1 ms"
contact_network = "3 ms"
wall_events = true
checkpoint_steps = 3
[[probe]]
name = "middle"
point = ["1 mm", "1 mm", "2 mm"]
every = "1 ms"
[[grain]]
shape = { kind = "sphere", diameter = "1 mm" }
nodes = 30
density = 2500
position = ["1 mm", "1 mm", "0.52 mm"]
velocity = [0, 0, "-2 cm/s"]
"#;

/// Two grains that collide, without fluid and without VTK files.
const DRY: &str = r#"
title = "dry"
[domain]
size = ["4 mm", "4 mm", "6 mm"]
[contact]
stiffness = 200
[time]
end = "6 ms"
step = "0.1 ms"
[output]
tables = "1 ms"
contacts = "1 ms"
slices = 0
fields = 0
surfaces = 0
at_events = false
checkpoint_steps = 11
[[grain]]
shape = { kind = "sphere", diameter = "1 mm" }
nodes = 30
density = 2500
position = ["2 mm", "2 mm", "1 mm"]
[[grain]]
shape = { kind = "sphere", diameter = "1 mm" }
nodes = 30
density = 2500
position = ["2.1 mm", "2 mm", "2.1 mm"]
velocity = [0, 0, "-5 cm/s"]
"#;

const FAULTS: [Fault; 5] =
    [Fault::Error, Fault::ShortWrite, Fault::Full, Fault::Crash, Fault::PowerCut];

/// State of the folder before the run.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Before {
    /// No folder.
    Nothing,
    /// A finished run of the same case, which is to be replaced.
    SameRun,
    /// A finished run of another case, which is to be replaced.
    OtherRun,
    /// A run of the same case that has reached an earlier end.
    EarlierEnd,
    /// Nothing; the run starts from a checkpoint of another run.
    Parent,
}

const BEFORE: [Before; 5] =
    [Before::Nothing, Before::SameRun, Before::OtherRun, Before::EarlierEnd, Before::Parent];

/// A case with undisturbed runs of it.
struct Reference {
    root: tempfile::TempDir,
    case: Case,
    /// Files of each undisturbed run, and its number of changes on the disk.
    whole: Vec<(BTreeMap<String, Vec<u8>>, u64)>,
}

impl Reference {
    fn new(text: &str) -> Reference {
        let root = folder_in_memory();
        let folder = |name: &str| root.path().join(name);
        let parse = |set: &[&str]| {
            let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
            Case::parse(text, "case.toml", Path::new("."), &set).unwrap()
        };
        let case = parse(&[]);
        let start = Options::default();
        let finished = |case: &Case, folder: &Path| {
            let ended = grainwake_run::run(case.job(), folder, &start, &mut Silent).unwrap();
            assert!(matches!(ended, Ending::Finished(_)));
        };
        finished(&case, &folder("SameRun"));
        finished(&parse(&["contact.friction=0.3"]), &folder("OtherRun"));
        finished(&parse(&["time.end=4 ms"]), &folder("EarlierEnd"));
        copy(&folder("EarlierEnd"), &folder("Parent"));
        let mut reference = Reference { root, case, whole: Vec::new() };
        for before in BEFORE {
            let run = reference.prepared(before, "whole");
            let count = inject(&run, Fault::Error, u64::MAX);
            reference.session(before, 0, &run).unwrap();
            let changes = count.changes();
            drop(count);
            reference.whole.push((contents(&run), changes));
            std::fs::remove_dir_all(run).unwrap();
        }
        reference
    }

    /// Creates the folder of a run in its state before the run.
    fn prepared(&self, before: Before, name: &str) -> PathBuf {
        let run = self.root.path().join(name);
        if !matches!(before, Before::Nothing | Before::Parent) {
            copy(&self.root.path().join(format!("{before:?}")), &run);
        }
        run
    }

    /// Runs the case as a user does who repeats the command, with `--resume-or-start` after the
    /// first session.
    fn session(&self, before: Before, session: u32, run: &Path) -> Result<Ending, RunError> {
        let own = Provenance::read(run).is_some_and(|own| own.case_sha256 == self.case.digest);
        let existing = match before {
            Before::SameRun | Before::OtherRun if session == 0 || !own => Existing::Replace,
            Before::Nothing | Before::Parent if session == 0 => Existing::Refuse,
            _ => Existing::ResumeOrStart,
        };
        let parent = (before == Before::Parent)
            .then(|| Parent::find(&self.root.path().join("Parent"), None, &mut |_| {}).unwrap());
        let options = Options { existing, parent, ..Options::default() };
        grainwake_run::run(self.case.job(), run, &options, &mut Silent)
    }

    /// Runs the case with these faults, one a session, then without a fault, and compares.
    fn survives(&self, before: Before, faults: &[(Fault, u64)]) -> Result<(), String> {
        let _ = std::fs::remove_dir_all(self.root.path().join("faulty"));
        let run = self.prepared(before, "faulty");
        let mut story = Vec::new();
        let mut ended = None;
        for (session, (fault, at)) in (0..).zip(faults) {
            let injected = inject(&run, *fault, *at);
            let result = self.session(before, session, &run);
            story.push(format!("{fault:?} at {at}: {:?}", injected.struck()));
            drop(injected);
            match result {
                Ok(Ending::Finished(_) | Ending::AlreadyFinished(_)) => {
                    ended = Some(contents(&run));
                }
                Ok(other) => return Err(format!("{story:?}: {other:?}")),
                Err(error) if error.kind() == FailureKind::InputOutput => {
                    story.push(error.to_string());
                }
                Err(error) => return Err(format!("{story:?}: {error}")),
            }
        }
        let sessions = faults.len() as u32;
        self.session(before, sessions, &run).map_err(|error| format!("{story:?}: {error}"))?;
        let index = BEFORE.iter().position(|state| *state == before).unwrap();
        let whole = &self.whole[index].0;
        for found in ended.iter().chain([&contents(&run)]) {
            let names =
                |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<String>>();
            if names(whole) != names(found) {
                return Err(format!("{story:?}: {:?} instead of {:?}", names(found), names(whole)));
            }
            if let Some((name, _)) = found.iter().find(|(name, bytes)| whole[*name] != **bytes) {
                return Err(format!("{story:?}: {name} differs"));
            }
        }
        Ok(())
    }
}

/// Calls `work` on one thread: more add nothing to runs of a few cells.
fn on_one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(work)
}

#[test]
fn a_run_resumes_to_the_same_bits_after_any_fault_of_the_disk() {
    let (cases, seed) = (setting("FAULT_CASES", 200), setting("FAULT_SEED", 1));
    let failures = on_one_thread(|| {
        let references = [WET, DRY].map(Reference::new);
        let mut failures = Vec::new();
        for number in 0..cases {
            let mut random = SplitMix64::seed_from_u64(seed ^ number.wrapping_mul(0x9e37_79b9));
            let reference = &references[random.random_range(0..references.len())];
            let state = random.random_range(0..BEFORE.len());
            let changes = reference.whole[state].1;
            let mut fault = || {
                let fault = FAULTS[random.random_range(0..FAULTS.len())];
                (fault, random.random_range(0..changes))
            };
            let mut faults = vec![fault()];
            faults.extend((0..number % 3).map(|_| fault()));
            if let Err(what) = reference.survives(BEFORE[state], &faults) {
                failures.push(format!("case {number} ({:?}): {what}", BEFORE[state]));
            }
        }
        failures
    });
    assert!(
        failures.is_empty(),
        "{} of {cases} cases fail with FAULT_SEED={seed}:\n{}",
        failures.len(),
        failures.join("\n")
    );
}

/// Lets a fault strike every change of the run once.
fn survives_everywhere(text: &str, before: Before, fault: Fault) {
    on_one_thread(|| {
        let reference = Reference::new(text);
        let index = BEFORE.iter().position(|state| *state == before).unwrap();
        for at in 0..reference.whole[index].1 {
            reference.survives(before, &[(fault, at)]).unwrap_or_else(|what| panic!("{what}"));
        }
    });
}

#[test]
fn a_run_survives_a_cut_of_the_power_at_every_change() {
    survives_everywhere(WET, Before::Nothing, Fault::PowerCut);
}

#[test]
fn a_replaced_run_never_passes_for_a_finished_one() {
    survives_everywhere(DRY, Before::SameRun, Fault::Crash);
}

/// Interrupts a run after its first step.
struct AfterOneStep;
impl Observer for AfterOneStep {
    fn interrupted(&self) -> bool {
        true
    }
}

#[test]
fn a_resumed_run_without_vtk_files_writes_no_index_of_them() {
    let folder = tempfile::tempdir().unwrap();
    let case = Case::parse(DRY, "case.toml", Path::new("."), &[]).unwrap();
    let options = Options { existing: Existing::ResumeOrStart, ..Options::default() };
    for _ in 0..3 {
        let ended = grainwake_run::run(case.job(), folder.path(), &options, &mut AfterOneStep);
        assert!(matches!(ended, Ok(Ending::Interrupted(_))));
        assert!(!folder.path().join("run.pvd").exists());
    }
}
