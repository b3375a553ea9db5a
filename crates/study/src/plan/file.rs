//! The validated study file.

use std::ops::Range;
use std::path::{Path, PathBuf};

use grainwake_formats::bounded_file::{SETTINGS, read_text};
use grainwake_run::case::{Located, Problem, Source, parse_angle, parse_length};

use super::claims::Analysis;
use super::expand::{self, Model};
use super::raw::{OneOrSeveral, RawEnsemble, RawStudy, Size};
use crate::error::{At, StudyError, refer_to_study_keys};

/// A study: its models, repetitions and requested analysis.
pub struct Study {
    /// Path of the study file.
    pub path: PathBuf,
    /// Title, one line.
    pub title: String,
    /// Models in the order of the file.
    pub models: Vec<Model>,
    /// Repetitions with small changes of the start.
    pub ensemble: Option<Ensemble>,
    /// Requested analysis.
    pub analysis: Analysis,
    /// Text of the study file.
    pub(crate) source: Source,
}

/// Repetitions of models with small changes of the initial position and orientation of one grain.
#[derive(Clone, Debug, PartialEq)]
pub struct Ensemble {
    /// Runs of each model; the first one has no offset.
    pub members: usize,
    /// Radius of the disc across the axis of gravity from which offsets are drawn uniformly [m].
    pub offset: f64,
    /// Largest rotation about each axis of the space frame, drawn uniformly up to it [rad].
    pub turn: f64,
    /// Whether all grains are moved together by a part of a cell along every axis.
    pub cell_shift: bool,
    /// Grain that is moved; the last one by default.
    pub grain: Option<usize>,
    /// Seed of the Sobol sequence.
    pub seed: u64,
    /// Indices of the repeated models.
    pub models: Vec<usize>,
    /// Location in the study file.
    pub span: Option<Range<usize>>,
}

impl Study {
    /// Reads and expands a study file.
    ///
    /// # Errors
    /// [`StudyError`] with all problems found and their location.
    pub fn read(path: &Path) -> Result<Study, StudyError> {
        let text = read_text(path, SETTINGS).at("read", path)?;
        Study::parse(&text, path)
    }

    /// Expands the text of a study file; paths are relative to the folder of `path`.
    ///
    /// # Errors
    /// [`StudyError`] with all problems found and their location.
    pub fn parse(text: &str, path: &Path) -> Result<Study, StudyError> {
        let (source, raw): (Source, RawStudy) =
            Source::parse(&path.display().to_string(), text, &[]).map_err(refer_to_study_keys)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let models = expand::expand(&source, &raw, folder).map_err(StudyError::Invalid)?;
        let ensemble = raw.ensemble.as_ref();
        let ensemble = ensemble.map(|given| read_ensemble(&source, given, &models));
        let analysis = raw.analysis.as_ref();
        let analysis = analysis.map(|given| read_analysis(&source, given, folder, &models));
        Ok(Study {
            path: path.into(),
            title: raw.title,
            ensemble: ensemble.transpose()?,
            analysis: analysis.transpose()?.unwrap_or_default(),
            models,
            source,
        })
    }
}

fn read_analysis(
    source: &Source,
    given: &Located<OneOrSeveral<PathBuf>>,
    folder: &Path,
    models: &[Model],
) -> Result<Analysis, StudyError> {
    let mut all = Analysis::default();
    for file in given.value.list() {
        let path = folder.join(file);
        let text = read_text(&path, SETTINGS).map_err(|error| {
            let message = format!("cannot read {}: {error}", path.display());
            let help = "paths are relative to the study file";
            source.problem(message, help, given.span.as_ref(), "this file")
        })?;
        let name = path.display().to_string();
        all.extend(Analysis::parse(&name, &text, models).map_err(StudyError::Invalid)?);
    }
    Ok(all)
}

fn read_ensemble(
    source: &Source,
    raw: &RawEnsemble,
    models: &[Model],
) -> Result<Ensemble, StudyError> {
    let offset = raw.offset.as_ref().map(|offset| {
        let expected = "an offset must be a positive length";
        positive(source, offset, parse_length, expected, "for example offset = \"0.02 mm\"")
    });
    let turn = raw.turn.as_ref().map(|turn| {
        let expected = "a turn must be a positive angle";
        positive(source, turn, parse_angle, expected, "for example turn = \"2 deg\"")
    });
    let refuse = |message: &str, help: &str| {
        Err(source.problem(message, help, raw.members.span.as_ref(), "here").into())
    };
    if !(1..=1000).contains(&raw.members.value) {
        let help = "members includes the undisturbed run";
        return refuse("an ensemble has 1 to 1000 members", help);
    }
    if offset.is_none() && turn.is_none() && !raw.cell_shift {
        let help = "give offset, turn or cell_shift, for example offset = \"0.02 mm\"";
        return refuse("all members of the ensemble would start alike", help);
    }
    let models = match &raw.models {
        None => (0..models.len()).collect(),
        Some(patterns) => expand::matching(source, patterns, models)?,
    };
    let runs = models.len().saturating_mul(raw.members.value);
    if runs > expand::MOST_RUNS {
        let most = expand::MOST_RUNS;
        let help = format!("a study has at most {most} runs: take fewer members or models");
        return refuse(&format!("the ensemble has {runs} runs"), &help);
    }
    Ok(Ensemble {
        members: raw.members.value,
        offset: offset.transpose()?.unwrap_or(0.0),
        turn: turn.transpose()?.unwrap_or(0.0),
        cell_shift: raw.cell_shift,
        grain: raw.grain,
        seed: raw.seed,
        models,
        span: raw.members.span.clone(),
    })
}

/// Reads a positive number or text with a unit.
fn positive(
    source: &Source,
    given: &Located<Size>,
    parse: fn(&str) -> Result<f64, String>,
    expected: &str,
    help: &str,
) -> Result<f64, Problem> {
    let value = match &given.value {
        Size::Number(value) => Ok(*value),
        Size::Text(text) => parse(text),
    };
    let refused = |message: String| source.problem(message, help, given.span.as_ref(), "here");
    match value {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        Ok(_) => Err(refused(expected.into())),
        Err(message) => Err(refused(message)),
    }
}
