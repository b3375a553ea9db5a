//! The plan of a study whose `study.json` is damaged, from its run folders and its table.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use grainwake_run::RESOLVED;
use grainwake_run::case::Case;
use grainwake_run::provenance::Provenance;

use super::claims::Analysis;
use super::resolve::run_of_case;
use super::{Factors, Levels, Plan, RUNS, Run, TABLE};
use crate::error::{StudyError, read_rows};

/// Entry of `table.json`, as far as a plan needs it.
#[derive(serde::Deserialize)]
struct Entry {
    name: String,
    model: String,
    member: usize,
    #[serde(default)]
    levels: Levels,
    #[serde(default)]
    factors: Factors,
    #[serde(default)]
    id: String,
}

impl Plan {
    /// Reads the plan of a study folder. If `study.json` is damaged or missing, the plan is put
    /// together from the run folders and `table.json`, and a note says what it lacks.
    ///
    /// # Errors
    /// If there is no study, if `study.json` is damaged and no run is found, or if `table.json` is
    /// damaged.
    pub fn read_or_rebuild(folder: &Path) -> Result<(Plan, Option<String>), StudyError> {
        let damage = match Plan::read(folder) {
            Ok(plan) => return Ok((plan, None)),
            Err(error @ StudyError::Damaged { .. }) => error,
            Err(error) => return Err(error),
        };
        let (runs, unreadable) = runs_in(folder)?;
        if runs.is_empty() {
            return Err(damage);
        }
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        let title = format!("Study {name}");
        let plan = Plan::new(PathBuf::new(), title, Analysis::default(), runs);
        let again = match command_of(&plan, folder) {
            Some(command) => format!("`{command}`"),
            None => "`grainwake study`".to_owned(),
        };
        let lacks = match unreadable.as_slice() {
            [] => String::new(),
            names => format!(", and without {}, whose cases cannot be read", names.join(", ")),
        };
        let note = format!(
            "{damage}; its runs were found in the folder, without title, claims and runs that have not begun{lacks}: {again} writes the file again and keeps finished runs"
        );
        Ok((plan, Some(note)))
    }

    /// Returns a note if the folder has a damaged plan, which this plan replaces.
    pub fn damage_in(&self, folder: &Path) -> Option<String> {
        match Plan::read(folder) {
            Err(error @ StudyError::Damaged { .. }) => {
                Some(format!("{error}; it is written again, and finished runs are kept"))
            }
            _ => None,
        }
    }
}

/// Returns the runs with a folder or an entry in the table, by name, and the names of the folders
/// whose cases cannot be read, without an entry.
fn runs_in(folder: &Path) -> Result<(Vec<Run>, Vec<String>), StudyError> {
    let table: Vec<Entry> = read_rows(&folder.join(TABLE))?;
    let mut runs: BTreeMap<String, Run> = BTreeMap::new();
    let mut unreadable = Vec::new();
    let folders = std::fs::read_dir(folder.join(RUNS)).into_iter().flatten().flatten();
    for path in folders.map(|entry| entry.path()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let resolved = path.join(RESOLVED);
        let Some(provenance) = Provenance::read(&path) else { continue };
        let base = std::path::absolute(&resolved).unwrap_or(resolved);
        let case = Case::load(&base, &[]).ok();
        let run = case.and_then(|case| run_of_case(&name, &base, Vec::new(), &case).ok());
        let Some(mut run) = run else {
            unreadable.push(name);
            continue;
        };
        // The hash of an earlier program may differ for the same case.
        run.case_sha256 = provenance.case_sha256;
        let member = name.rsplit_once("-m").and_then(|(model, n)| Some((model, n.parse().ok()?)));
        if let Some((model, member)) = member {
            (run.model, run.member) = (model.to_owned(), member);
        }
        runs.insert(name, run);
    }
    for entry in table {
        let Entry { name, model, member, levels, factors, id } = entry;
        let run = runs.entry(name.clone());
        let run = run.or_insert_with(|| Run { name, id, ..Run::default() });
        (run.model, run.member, run.levels) = (model, member, levels);
        run.factors.extend(factors);
    }
    unreadable.retain(|name| !runs.contains_key(name));
    unreadable.sort();
    Ok((runs.into_values().collect(), unreadable))
}

/// Returns the command that started the runs, if their provenance names a study.
fn command_of(plan: &Plan, folder: &Path) -> Option<String> {
    let sessions = plan.runs.iter().filter_map(|run| Provenance::read(&run.folder(folder)));
    let commands =
        sessions.filter_map(|provenance| Some(provenance.sessions.last()?.command.clone()));
    let mut of_study = commands.filter(|words| words.get(1).is_some_and(|word| word == "study"));
    let words = of_study.next()?;
    Some(format!("grainwake {}", words[1..].join(" ")))
}
