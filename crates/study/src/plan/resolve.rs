//! Resolution of models into runs: cases with all overrides, ensemble members and hashes.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use grainwake_run::case::{Case, CaseError, ClosedForms, Problem};
use grainwake_run::provenance::Provenance;
use rayon::prelude::*;
use sha2::{Digest, Sha256};

use super::expand::Model;
use super::file::{Ensemble, Study};
use super::offset::member_overrides;
use super::quantities::SHAPE_FACTORS;
use super::{Factors, Plan, Run};
use crate::error::StudyError;

impl Plan {
    /// Resolves every model of a study; `sets` are overrides of all models with highest precedence.
    ///
    /// # Errors
    /// [`StudyError::Invalid`] with the problems of the first invalid model, located in the study
    /// file where it sets the key.
    pub fn resolve(study: &Study, sets: &[String]) -> Result<Plan, StudyError> {
        Plan::resolve_until(study, sets, &AtomicBool::new(false))
    }

    /// Resolves every model as [`Plan::resolve`], until another thread sets `stop`.
    ///
    /// # Errors
    /// As [`Plan::resolve`], and [`CaseError::Interrupted`].
    pub fn resolve_until(
        study: &Study,
        sets: &[String],
        stop: &AtomicBool,
    ) -> Result<Plan, StudyError> {
        let shapes = ClosedForms::default();
        let all = (0..study.models.len()).into_par_iter();
        let resolved: Vec<Result<Vec<Run>, StudyError>> =
            all.map(|i| runs_of(study, i, sets, (&shapes, stop))).collect();
        let mut runs = Vec::new();
        for found in resolved {
            runs.extend(found?);
        }
        check_names(study, &runs)?;
        let file = std::path::absolute(&study.path).unwrap_or_else(|_| study.path.clone());
        Ok(Plan::new(file, study.title.clone(), study.analysis.clone(), runs))
    }
}

/// Checks that no two runs share a name, and hence a folder.
fn check_names(study: &Study, runs: &[Run]) -> Result<(), StudyError> {
    let mut by_name = BTreeMap::new();
    for run in runs {
        if let Some(first) = by_name.insert(&run.name, run) {
            let [first, second] = [first, run].map(|run| match run.member {
                0 => format!("the model \"{}\"", run.model),
                member => format!("member {member} of \"{}\"", run.model),
            });
            let message = format!("{first} and {second} are both called \"{}\"", run.name);
            let help = "members are called MODEL-m1, MODEL-m2 ...: choose another name";
            return Err(study.source.problem(message, help, None, "").into());
        }
    }
    Ok(())
}

/// Returns the runs of a model: one, or the members of its ensemble.
fn runs_of(
    study: &Study,
    index: usize,
    sets: &[String],
    (shapes, stop): (&ClosedForms, &AtomicBool),
) -> Result<Vec<Run>, StudyError> {
    let model = &study.models[index];
    let own = model.settings.iter().map(|s| s.text());
    let set: Vec<String> = own.chain(sets.iter().cloned()).collect();
    let load = |set: &[String]| {
        Case::load_sharing(&model.base, set, shapes, stop)
            .map_err(|error| locate_in_study(study, model, error))
    };
    let case = load(&set)?;
    let mut runs = vec![run(model, 0, set.clone(), &case)?];
    let ensemble = study.ensemble.as_ref().filter(|e| e.models.contains(&index));
    if let Some(ensemble) = ensemble {
        for member in 1..ensemble.members {
            let mut set = set.clone();
            set.extend(member_overrides(study, model, ensemble, member, &case)?);
            let case = Case::load_sharing(&model.base, &set, shapes, stop)
                .map_err(|error| locate_in_ensemble(study, ensemble, model, member, error))?;
            runs.push(run(model, member, set, &case)?);
        }
    }
    Ok(runs)
}

fn run(model: &Model, member: usize, set: Vec<String>, case: &Case) -> Result<Run, StudyError> {
    let base = std::path::absolute(&model.base).unwrap_or_else(|_| model.base.clone());
    let mut run = run_of_case(&model.name, &base, set, case)?;
    if member > 0 {
        run.name = format!("{}-m{member}", model.name);
    }
    run.member = member;
    run.levels = model.levels.clone();
    // Those of the study file come first, also in the table.
    let of_shape = std::mem::replace(&mut run.factors, model.factors.clone());
    for (name, value) in of_shape {
        run.factors.entry(name).or_insert(value);
    }
    Ok(run)
}

/// Returns the run of a case, outside all axes.
///
/// # Errors
/// [`StudyError::Damaged`] if the end of the resolved case is not known.
pub(super) fn run_of_case(
    name: &str,
    base: &Path,
    set: Vec<String>,
    case: &Case,
) -> Result<Run, StudyError> {
    let estimate = case.estimate(1);
    let ending = end_condition(&case.resolved)
        .map_err(|what| StudyError::Damaged { file: base.into(), what })?;
    let program = Provenance::new(&case.digest);
    let commit = program.commit.unwrap_or_default();
    let id = run_id(&program.case_sha256, &ending, &program.version, &commit);
    Ok(Run {
        name: name.into(),
        model: name.into(),
        factors: shape_factors(case),
        base: base.into(),
        set,
        id,
        case_sha256: case.digest.clone(),
        ending,
        end_s: case.plan.end,
        memory_bytes: estimate.memory_bytes,
        disk_bytes: estimate.disk_bytes,
        checkpoint_bytes: estimate.checkpoint_bytes,
        // JSON has no infinity.
        wall_s: estimate.wall_s.min(f64::MAX),
        ..Run::default()
    })
}

/// Returns the hash of a case, its end condition and a program.
pub(super) fn run_id(case_sha256: &str, ending: &str, version: &str, commit: &str) -> String {
    let mut hash = Sha256::new();
    for part in [case_sha256, ending, version, commit] {
        hash.update(part);
        hash.update([0]);
    }
    hash.finalize().iter().take(6).map(|b| format!("{b:02x}")).collect()
}

/// Returns the shape factors of the first grain.
fn shape_factors(case: &Case) -> Factors {
    let mut factors = Factors::new();
    if let Some(grain) = case.setup.grains.first() {
        let shape = grain.shape.morphology();
        let values = [Some(shape.krumbein_sphericity), shape.wadell_roundness];
        let known = SHAPE_FACTORS.into_iter().zip(values);
        let finite =
            known.filter_map(|(name, value)| Some((name, value.filter(|v| v.is_finite())?)));
        factors.extend(finite.map(|(name, value)| (name.to_owned(), value)));
    }
    factors
}

/// Returns the end time and the stop condition of a resolved case on one line.
///
/// # Errors
/// The line of a syntax error, or that there is no end time, which every resolved case has.
pub(crate) fn end_condition(resolved: &str) -> Result<String, String> {
    let table: toml::Table = resolved.parse().map_err(|error: toml::de::Error| {
        let start = error.span().map_or(0, |span| span.start);
        let before = resolved.as_bytes().iter().take(start);
        let line = 1 + before.filter(|byte| **byte == b'\n').count();
        let message: Vec<&str> = error.message().lines().collect();
        format!("line {line}: {}", message.join(", "))
    })?;
    let time = table.get("time").and_then(toml::Value::as_table);
    let part = |name: &str| time?.get(name).map(toml::Value::to_string);
    let end = part("end").ok_or("there is no `end` in [time]")?;
    Ok(format!("end {end}, stop {}", part("stop").unwrap_or("-".into())))
}

/// Locates the problems of a member, whose start differs from that of the model, in the ensemble.
fn locate_in_ensemble(
    study: &Study,
    ensemble: &Ensemble,
    model: &Model,
    member: usize,
    error: CaseError,
) -> StudyError {
    let CaseError::Invalid(problems) = error else {
        return StudyError::Case(error);
    };
    let moved = problems.into_iter().map(|problem| {
        let message = format!("member {member} of \"{}\": {}", model.name, problem.message);
        let help = "the ensemble changes the start of a grain: reduce offset, turn or cell_shift";
        study.source.problem(message, help, ensemble.span.as_ref(), "this ensemble")
    });
    StudyError::Invalid(moved.collect())
}

/// Locates the problems of a model's case in the study file where it sets the key.
fn locate_in_study(study: &Study, model: &Model, error: CaseError) -> StudyError {
    let CaseError::Invalid(problems) = error else {
        return StudyError::Case(error);
    };
    // Whether one dotted key is the other, or lies below it.
    let below = |long: &str, short: &str| {
        let rest = long.strip_prefix(short);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    let moved = problems.into_iter().map(|mut problem| {
        let from_set = problem.place().is_none_or(|(name, ..)| name == "--set");
        let key = problem.key.clone().unwrap_or_default();
        let sets = |set: &str| !key.is_empty() && (below(&key, set) || below(set, &key));
        let setting = model.settings.iter().rev().find(|s| sets(&s.key));
        let message = format!("model \"{}\": {}", model.name, problem.message);
        match setting.filter(|_| from_set) {
            Some(setting) => {
                let mut moved = Problem::new(message).key(key);
                moved.help = problem.help.take();
                study.source.locate(moved, setting.span.as_ref(), "set here")
            }
            None => {
                problem.message = message;
                problem
            }
        }
    });
    StudyError::Invalid(moved.collect())
}
