//! The plan of a study: every run with its case resolved, its name and its hash.

pub mod claims;
pub mod expand;
pub mod file;
mod offset;
pub mod quantities;
mod raw;
pub mod selection;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use grainwake_solver::case::estimate::Estimate;
use grainwake_solver::case::{Case, CaseError, Problem};
use grainwake_solver::output::provenance::Provenance;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use self::claims::Analysis;
use self::expand::Model;
use self::file::Study;
use self::offset::offset_override;
use self::quantities::SHAPE_FACTORS;
use crate::error::{At, StudyError, write_whole};

/// Subfolder of a study folder that holds the run folders.
pub const RUNS: &str = "runs";
/// File of a study folder that holds its plan.
pub const MANIFEST: &str = "study.json";

/// One run of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Name of its folder: that of its model, with the number of the member behind it.
    pub name: String,
    /// Name of its model.
    pub model: String,
    /// Number in the ensemble; 0 is not offset.
    pub member: usize,
    /// Name of its value on each axis.
    pub levels: BTreeMap<String, String>,
    /// Numbers that belong to it.
    pub factors: BTreeMap<String, f64>,
    /// Base case.
    pub base: PathBuf,
    /// What is set in it, as `--set` takes it.
    pub set: Vec<String>,
    /// Hash of everything that decides its results, its end, and the program.
    pub id: String,
    /// Hash of what decides its results up to a given time, as in `provenance.json`.
    pub case_sha256: String,
    /// Its end and what stops it before.
    pub ending: String,
    /// End at the latest [s].
    pub end_s: f64,
    /// Memory expected [bytes].
    pub memory_bytes: u64,
    /// Wall-clock time expected on one thread [s], if it goes on to its end.
    pub wall_s: f64,
}

impl Run {
    /// Reads its case.
    ///
    /// # Errors
    /// [`CaseError`].
    pub fn case(&self) -> Result<Case, CaseError> {
        Case::load(&self.base, &self.set)
    }

    /// Its run folder in a study folder.
    pub fn folder(&self, study: &Path) -> PathBuf {
        study.join(RUNS).join(&self.name)
    }
}

/// What a study folder is for; written before the first run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Tells the file from others.
    pub grainwake_study: u32,
    /// The study file.
    pub study: PathBuf,
    /// One line that says what it is.
    pub title: String,
    /// Version of the program.
    pub version: String,
    /// Its commit, where known.
    pub commit: Option<String>,
    /// What is asked of the results.
    #[serde(default)]
    pub analysis: Analysis,
    /// All runs.
    pub runs: Vec<Run>,
}

/// A study with all its runs resolved.
pub struct Plan {
    /// What it is.
    pub manifest: Manifest,
}

impl Plan {
    /// Resolves every model of a study; `sets` are overrides for all of them, applied last.
    ///
    /// # Errors
    /// [`StudyError::Invalid`] with the problems of the first models that are wrong, placed in the
    /// study file where it set the key.
    pub fn of(study: &Study, sets: &[String]) -> Result<Plan, StudyError> {
        let resolved: Vec<Result<Vec<Run>, StudyError>> = (0..study.models.len())
            .into_par_iter()
            .map(|i| runs_of(study, i, sets))
            .collect();
        let mut runs = Vec::new();
        for found in resolved {
            runs.extend(found?);
        }
        let own = Provenance::new("");
        let path = std::path::absolute(&study.path).unwrap_or_else(|_| study.path.clone());
        Ok(Plan {
            manifest: Manifest {
                grainwake_study: 1,
                study: path,
                title: study.title.clone(),
                version: own.version,
                commit: own.commit,
                analysis: study.analysis.clone(),
                runs,
            },
        })
    }

    /// Makes the study folder, and writes the plan into it.
    ///
    /// # Errors
    /// [`StudyError::Occupied`] if it belongs to another study or holds something else.
    pub fn create_folder(&self, folder: &Path) -> Result<(), StudyError> {
        self.check_folder(folder)?;
        std::fs::create_dir_all(folder.join(RUNS)).at("create", folder)?;
        self.manifest.write(folder)
    }

    /// Whether the study may go into the folder; nothing is written.
    ///
    /// # Errors
    /// [`StudyError::Occupied`] if it belongs to another study or holds something else.
    pub fn check_folder(&self, folder: &Path) -> Result<(), StudyError> {
        let occupied = |what: String| {
            Err(StudyError::Occupied {
                folder: folder.into(),
                what,
            })
        };
        if folder.join(MANIFEST).is_file() {
            let there = Manifest::read(folder)?;
            let name = |path: &Path| path.file_name().map(ToOwned::to_owned);
            if there.title != self.manifest.title
                && name(&there.study) != name(&self.manifest.study)
            {
                return occupied(format!(
                    "holds another study, \"{}\" of {}",
                    there.title,
                    there.study.display()
                ));
            }
            return Ok(());
        }
        let mut entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        match entries.find(|e| e.file_name() != RUNS) {
            Some(_) => occupied("is not empty and holds no study".into()),
            None => Ok(()),
        }
    }
}

impl Manifest {
    /// Of a study folder.
    ///
    /// # Errors
    /// If there is none, or it is damaged.
    pub fn read(folder: &Path) -> Result<Manifest, StudyError> {
        let file = folder.join(MANIFEST);
        let text = std::fs::read_to_string(&file).at("read", &file)?;
        serde_json::from_str(&text).map_err(|error| StudyError::Damaged {
            file,
            what: error.to_string(),
        })
    }

    /// Into a study folder.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(crate) fn write(&self, folder: &Path) -> Result<(), StudyError> {
        let file = folder.join(MANIFEST);
        let text = serde_json::to_string_pretty(self).map_err(std::io::Error::from);
        write_whole(&file, text.at("write", &file)?.as_bytes())
    }

    /// Whether a folder holds a study.
    pub fn is_in(folder: &Path) -> bool {
        folder.join(MANIFEST).is_file()
    }
}

fn runs_of(study: &Study, index: usize, sets: &[String]) -> Result<Vec<Run>, StudyError> {
    let model = &study.models[index];
    let set: Vec<String> = model
        .settings
        .iter()
        .map(|s| s.text())
        .chain(sets.iter().cloned())
        .collect();
    let case = Case::load(&model.base, &set).map_err(|e| placed(study, model, e))?;
    let mut runs = vec![run(model, 0, set.clone(), &case)];
    let Some(ensemble) = study
        .ensemble
        .as_ref()
        .filter(|e| e.models.contains(&index))
    else {
        return Ok(runs);
    };
    for member in 1..ensemble.members {
        let mut set = set.clone();
        set.push(offset_override(
            study, model, ensemble, member, &case, &set,
        )?);
        let case = Case::load(&model.base, &set).map_err(|e| placed(study, model, e))?;
        runs.push(run(model, member, set, &case));
    }
    Ok(runs)
}

fn run(model: &Model, member: usize, set: Vec<String>, case: &Case) -> Run {
    let estimate = Estimate::of(case, 1);
    let ending = end_condition(&case.resolved);
    let own = Provenance::new(&case.digest);
    let mut hash = Sha256::new();
    for part in [
        &own.case_sha256,
        &ending,
        &own.version,
        &own.commit.unwrap_or_default(),
    ] {
        hash.update(part);
        hash.update([0]);
    }
    let id: String = hash
        .finalize()
        .iter()
        .take(6)
        .map(|b| format!("{b:02x}"))
        .collect();
    Run {
        name: if member == 0 {
            model.name.clone()
        } else {
            format!("{}-m{member}", model.name)
        },
        model: model.name.clone(),
        member,
        levels: model.levels.clone(),
        factors: factors(model, case),
        base: std::path::absolute(&model.base).unwrap_or_else(|_| model.base.clone()),
        set,
        id,
        case_sha256: case.digest.clone(),
        ending,
        end_s: case.plan.end,
        memory_bytes: estimate.memory_bytes,
        wall_s: estimate.wall_s,
    }
}

/// The numbers of a model, and what is measured on its first grain.
fn factors(model: &Model, case: &Case) -> BTreeMap<String, f64> {
    let mut factors = BTreeMap::new();
    if let Some(grain) = case.setup.grains.first() {
        let form = grain.shape.morphology();
        factors.insert(SHAPE_FACTORS[0].to_owned(), form.krumbein_sphericity);
        factors.extend(
            form.wadell_roundness
                .map(|r| (SHAPE_FACTORS[1].to_owned(), r)),
        );
    }
    factors.extend(model.factors.clone());
    factors
}

/// The end of a resolved case and what stops it before, in one line.
pub(crate) fn end_condition(resolved: &str) -> String {
    let table: toml::Table = resolved.parse().unwrap_or_default();
    let time = table.get("time").and_then(toml::Value::as_table);
    let part = |name: &str| {
        time.and_then(|t| t.get(name))
            .map_or("-".into(), toml::Value::to_string)
    };
    format!("end {}, stop {}", part("end"), part("stop"))
}

/// Problems of a model's case, placed in the study file where it set the key.
fn placed(study: &Study, model: &Model, error: CaseError) -> StudyError {
    let CaseError::Invalid(problems) = error else {
        return StudyError::Case(error);
    };
    let moved = problems.into_iter().map(|problem| {
        let from_set = problem.place().is_none_or(|(name, ..)| name == "--set");
        let key = problem.key.clone().unwrap_or_default();
        let message = format!("model \"{}\": {}", model.name, problem.message);
        let mut problem = problem;
        let reaches = |set: &str| {
            let under = |long: &str, short: &str| {
                long.strip_prefix(short)
                    .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
            };
            under(&key, set) || under(set, &key)
        };
        let setting = model
            .settings
            .iter()
            .rev()
            .find(|s| !key.is_empty() && reaches(&s.key));
        match setting.filter(|_| from_set) {
            Some(setting) => {
                let mut fresh = Problem::new(message).key(key);
                fresh.help = problem.help.take();
                study.locate(fresh, setting.span.as_ref(), "set here")
            }
            None => {
                problem.message = message;
                problem
            }
        }
    });
    StudyError::Invalid(moved.collect())
}
