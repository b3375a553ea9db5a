//! The study file, validated.

use std::ops::Range;
use std::path::{Path, PathBuf};

use grainwake_solver::case::{Loc, Problem, Source, parse_length};

use crate::error::{At, StudyError, of_a_study};
use crate::plan::claims::Analysis;
use crate::plan::expand::{self, Model};
use crate::plan::raw::{Length, RawEnsemble, RawStudy};

/// A study: its models and what is asked of them.
pub struct Study {
    /// The study file.
    pub path: PathBuf,
    /// One line that says what it is.
    pub title: String,
    /// What is run.
    pub models: Vec<Model>,
    /// Repetitions with small random offsets.
    pub ensemble: Option<Ensemble>,
    /// What is asked of the results.
    pub analysis: Analysis,
    source: Source,
}

/// Repetitions of models with small random offsets of the start.
#[derive(Clone, Debug, PartialEq)]
pub struct Ensemble {
    /// Runs of each model; the first one is not offset.
    pub members: usize,
    /// Radius of the disc, normal to gravity, from which the offsets are drawn evenly [m].
    pub offset: f64,
    /// The grain that is offset; the last one if none is named.
    pub grain: Option<usize>,
    /// Other seeds give other offsets.
    pub seed: u64,
    /// Which models are repeated, by index.
    pub models: Vec<usize>,
}

impl Study {
    /// Reads a study file and expands it.
    ///
    /// # Errors
    /// [`StudyError`] with every problem found and its place.
    pub fn read(path: &Path) -> Result<Study, StudyError> {
        let text = std::fs::read_to_string(path).at("read", path)?;
        Study::parse(&text, path)
    }

    /// The same from text; paths are relative to the folder of `path`.
    ///
    /// # Errors
    /// [`StudyError`] with every problem found and its place.
    pub fn parse(text: &str, path: &Path) -> Result<Study, StudyError> {
        let (source, raw): (Source, RawStudy) =
            Source::parse(&path.display().to_string(), text, &[]).map_err(of_a_study)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let models = expand::expand(&source, &raw, folder).map_err(StudyError::Invalid)?;
        let ensemble = match &raw.ensemble {
            Some(given) => Some(ensemble(&source, given, &models)?),
            None => None,
        };
        let analysis = match &raw.analysis {
            Some(given) => analysis(&source, given, folder, &models)?,
            None => Analysis::default(),
        };
        Ok(Study {
            path: path.into(),
            title: raw.title,
            models,
            ensemble,
            analysis,
            source,
        })
    }

    /// `runs/NAME`, NAME being that of the study's folder, with the file's name if it is not `study.toml`.
    pub fn default_folder(&self) -> PathBuf {
        let absolute = std::path::absolute(&self.path).unwrap_or_else(|_| self.path.clone());
        let name = |part: Option<&std::ffi::OsStr>| part.map(|p| p.to_string_lossy().into_owned());
        let stem = name(absolute.file_stem()).unwrap_or_else(|| "study".into());
        let folder = name(absolute.parent().and_then(Path::file_name));
        let name = match folder {
            Some(folder) if stem == "study" => folder,
            Some(folder) => format!("{folder}-{stem}"),
            None => stem,
        };
        Path::new("runs").join(name)
    }

    /// A problem with its place in the study file.
    pub(crate) fn locate(
        &self,
        problem: Problem,
        span: Option<&Range<usize>>,
        label: &str,
    ) -> Problem {
        self.source.locate(problem, span, label)
    }
}

fn analysis(
    source: &Source,
    given: &Loc<PathBuf>,
    folder: &Path,
    models: &[Model],
) -> Result<Analysis, StudyError> {
    let path = folder.join(&given.value);
    let text = std::fs::read_to_string(&path).map_err(|error| {
        let problem = Problem::new(format!("cannot read {}: {error}", path.display()))
            .help("paths are relative to the study file");
        source.locate(problem, given.span.as_ref(), "this file")
    })?;
    Analysis::parse(&path.display().to_string(), &text, models).map_err(StudyError::Invalid)
}

fn ensemble(source: &Source, raw: &RawEnsemble, models: &[Model]) -> Result<Ensemble, Problem> {
    let offset = match &raw.offset.value {
        Length::Metres(metres) => Ok(*metres),
        Length::Text(text) => parse_length(text),
    };
    let offset = offset.and_then(|metres| {
        let good = metres.is_finite() && metres > 0.0;
        good.then_some(metres)
            .ok_or_else(|| "an offset is a positive length".into())
    });
    let offset = offset.map_err(|message| {
        let problem = Problem::new(message)
            .help("for example offset = \"0.02 mm\", a hundredth of a diameter");
        source.locate(problem, raw.offset.span.as_ref(), "here")
    })?;
    if !(1..=1000).contains(&raw.members.value) {
        let problem = Problem::new("an ensemble has 1 to 1000 members")
            .help("members counts the run that is not offset too");
        return Err(source.locate(problem, raw.members.span.as_ref(), "here"));
    }
    let which = match &raw.models {
        None => (0..models.len()).collect(),
        Some(Loc { value, span }) => expand::matching(source, value, span.as_ref(), models)?,
    };
    Ok(Ensemble {
        members: raw.members.value,
        offset,
        grain: raw.grain,
        seed: raw.seed,
        models: which,
    })
}
