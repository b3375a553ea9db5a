//! The plan of a study: study file to models, models to runs with a stable name and hash.

mod analysis_file;
pub mod claims;
pub mod expand;
pub mod file;
mod offset;
pub mod quantities;
mod raw;
mod rebuild;
mod resolve;
pub mod selection;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use grainwake_formats::disk::{self, is_temporary};
use grainwake_run::case::{Case, CaseError, Problem};
use grainwake_run::provenance::Provenance;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

use self::claims::Analysis;
use crate::error::{At, StudyError, read_json, write_json};

pub(crate) use resolve::end_condition;

/// Subfolder of a study folder that holds the run folders.
pub const RUNS: &str = "runs";
/// File of a study folder that holds its plan.
pub const MANIFEST: &str = "study.json";
/// File of a study folder with a record of every run.
pub const TABLE: &str = "table.json";

/// File of a study folder with the finished runs that are no longer in [`TABLE`].
pub const EARLIER_TABLE: &str = "table.earlier.json";

/// Other files and folders of a study folder.
const WRITTEN: [&str; 9] = [
    "locks",
    "table.csv",
    TABLE,
    EARLIER_TABLE,
    "settling.csv",
    "histories",
    "figures",
    "analysis.json",
    "report.html",
];

/// Level on each axis, in the order of the study file.
pub type Levels = IndexMap<String, String>;
/// Numerical factors, in the order of the axes.
pub type Factors = IndexMap<String, f64>;

/// One run of a study. The JSON names are stable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Name of the run and of its folder: the model, and "-m1", "-m2" ... for ensemble members.
    pub name: String,
    /// Name of the model.
    pub model: String,
    /// Index in the ensemble; 0 starts as the case says.
    pub member: usize,
    /// Level on each axis.
    pub levels: Levels,
    /// Numerical factors for the analysis.
    pub factors: Factors,
    /// Base case.
    pub base: PathBuf,
    /// Overrides in the syntax of `--set`.
    pub set: Vec<String>,
    /// Hash of the case, the end condition and the program.
    pub id: String,
    /// Hashes with the programs whose finished runs count, in the order of [`Plan::accepted`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub accepted_ids: Vec<String>,
    /// Hash of the case without its end, as in `provenance.json`.
    pub case_sha256: String,
    /// End time and stop condition as text.
    pub ending: String,
    /// Latest end time [s].
    pub end_s: f64,
    /// Estimated memory [bytes].
    pub memory_bytes: u64,
    /// Estimated size of the run folder without checkpoints [bytes].
    #[serde(default)]
    pub disk_bytes: u64,
    /// Estimated size of the checkpoints during the run [bytes].
    #[serde(default)]
    pub checkpoint_bytes: u64,
    /// Estimated wall-clock time on one thread up to the expected end [s].
    pub wall_s: f64,
}

impl Run {
    /// Reads the case of the run.
    ///
    /// # Errors
    /// [`CaseError`].
    pub fn case(&self) -> Result<Case, CaseError> {
        Case::load(&self.base, &self.set)
    }

    /// Returns the hash of the case, the end condition and another program.
    pub fn id_by(&self, program: &Provenance) -> String {
        let commit = program.commit.as_deref().unwrap_or_default();
        resolve::run_id(&self.case_sha256, &self.ending, &program.version, commit)
    }

    /// Returns the hashes of the run by the program of the plan and by the accepted ones.
    pub fn ids(&self) -> impl Iterator<Item = &String> {
        std::iter::once(&self.id).chain(&self.accepted_ids)
    }

    /// Returns the run folder in a study folder.
    pub fn folder(&self, study: &Path) -> PathBuf {
        study.join(RUNS).join(&self.name)
    }
}

/// All runs of a study and the requested analysis: `study.json`. The JSON names are stable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Version of the file format.
    pub grainwake_study: u32,
    /// Study file.
    pub study: PathBuf,
    /// Title of the study, one line.
    pub title: String,
    /// Version of the program.
    pub version: String,
    /// Commit of the program, if known.
    pub commit: Option<String>,
    /// Commits of other programs of this version whose finished runs count.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub accepted: Vec<String>,
    /// Requested analysis.
    #[serde(default)]
    pub analysis: Analysis,
    /// All runs.
    pub runs: Vec<Run>,
}

/// Number of digits of a commit in `provenance.json`.
const COMMIT_DIGITS: usize = 12;

impl Plan {
    /// Returns a note if runs of different names are the same case with the same end: a setting,
    /// such as a level of an axis, has no effect in them.
    pub fn note_on_equal_runs(&self) -> Option<String> {
        let mut first: BTreeMap<&str, &str> = BTreeMap::new();
        let mut pairs: Vec<[&str; 2]> = Vec::new();
        for run in &self.runs {
            pairs.extend(first.insert(&run.id, &run.name).map(|earlier| [earlier, &run.name]));
        }
        let [one, other] = pairs.first()?;
        let more = match pairs.len() - 1 {
            0 => String::new(),
            more => format!(", and so are {more} more"),
        };
        Some(format!(
            "{other} is the same case as {one}{more}: what distinguishes them has no effect, or an \
             override replaces it"
        ))
    }

    /// Returns the plan of this program with these runs.
    fn new(study: PathBuf, title: String, analysis: Analysis, runs: Vec<Run>) -> Plan {
        let Provenance { version, commit, .. } = Provenance::new("");
        let accepted = Vec::new();
        Plan { grainwake_study: 1, study, title, version, commit, accepted, analysis, runs }
    }

    /// Returns whether a model has more than one run.
    pub fn has_members(&self) -> bool {
        self.runs.iter().any(|run| run.member > 0)
    }

    /// Returns the plan with commits of other programs whose finished runs count.
    ///
    /// # Errors
    /// If a text is not a commit as in `provenance.json`.
    pub fn accepting(mut self, commits: &[String]) -> Result<Plan, Problem> {
        let is_commit = |text: &str| {
            text.len() == COMMIT_DIGITS && text.chars().all(|c| matches!(c, '0'..='9' | 'a'..='f'))
        };
        if let Some(wrong) = commits.iter().find(|commit| !is_commit(commit)) {
            let message = format!("accept: \"{wrong}\" is not a commit of the program");
            return Err(Problem::new(message).help(format!(
                "give the {COMMIT_DIGITS} hexadecimal digits of `commit` in the run's provenance.json"
            )));
        }
        for run in &mut self.runs {
            let id = |commit| resolve::run_id(&run.case_sha256, &run.ending, &self.version, commit);
            run.accepted_ids = commits.iter().map(|commit| id(commit)).collect();
        }
        self.accepted = commits.to_vec();
        Ok(self)
    }

    /// Creates the study folder, removes temporary files of killed programs that are more than a
    /// day old, and writes the plan.
    ///
    /// # Errors
    /// [`StudyError::Occupied`] if the folder holds another study or other files.
    pub fn create_folder(&self, folder: &Path) -> Result<(), StudyError> {
        self.check_folder(folder)?;
        disk::create_folder(&folder.join(RUNS)).at("create", folder)?;
        disk::remove_old_temporaries(folder);
        self.write(folder)
    }

    /// Checks whether the study may use the folder, without writing.
    ///
    /// # Errors
    /// [`StudyError::Occupied`] if the folder holds another study or other files.
    pub fn check_folder(&self, folder: &Path) -> Result<(), StudyError> {
        let occupied = |what: String| Err(StudyError::Occupied { folder: folder.into(), what });
        let has_runs = folder.join(RUNS).is_dir();
        if Plan::exists_in(folder) {
            let other = match Plan::read(folder) {
                Ok(other) => other,
                // The plan is written again, and finished runs are kept.
                Err(StudyError::Damaged { .. }) if has_runs => return Ok(()),
                Err(error) => return Err(error),
            };
            // A title may be corrected, and a study file may be moved.
            if other.title != self.title && other.study != self.study {
                let study = other.study.display();
                return occupied(format!("holds another study, \"{}\" of {study}", other.title));
            }
            return Ok(());
        }
        // A study without its plan is recognised by its runs or its table.
        let known = has_runs || folder.join(TABLE).is_file();
        let of_study = |name: &str| WRITTEN.contains(&name) || is_temporary(Path::new(name));
        let own = |name: &str| name == RUNS || known && of_study(name);
        let mut entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        match entries.find(|entry| !entry.file_name().to_str().is_some_and(own)) {
            Some(_) => occupied("is not empty and holds no study".into()),
            None => Ok(()),
        }
    }

    /// Reads the plan of a study folder.
    ///
    /// # Errors
    /// If the file is missing or damaged; in a folder with runs a missing file is damage.
    pub fn read(folder: &Path) -> Result<Plan, StudyError> {
        let file = folder.join(MANIFEST);
        if !file.exists() && Plan::exists_in(folder) {
            return Err(StudyError::Damaged { file, what: "the file is missing".into() });
        }
        read_json(&file)
    }

    /// Writes the plan into a study folder.
    pub(crate) fn write(&self, folder: &Path) -> Result<(), StudyError> {
        write_json(&folder.join(MANIFEST), self)
    }

    /// Returns whether a folder holds a study: its plan, or runs with their table.
    pub fn exists_in(folder: &Path) -> bool {
        let [plan, table] = [MANIFEST, TABLE].map(|name| folder.join(name).is_file());
        plan || table && folder.join(RUNS).is_dir()
    }
}
