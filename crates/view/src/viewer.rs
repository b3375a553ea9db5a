//! Run folders and their current state.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash as _, Hasher as _};
use std::path::PathBuf;

use grainwake_formats::table::Damage;
use grainwake_formats::{diagnostics, events, grains, summary};
use grainwake_report::ReportError;
use grainwake_report::run_folder::RunFolder;
use grainwake_report::thumbnail::thumbnail;

use crate::document::{Index, Limits, RunDocument, StudyTable};
use crate::error::ViewError;
use crate::frame_cache::FrameCache;

/// Run folder with its name on the page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// Name.
    pub name: String,
    /// Folder.
    pub folder: PathBuf,
}

/// Run folders that the page shows.
pub struct Viewer {
    sources: Vec<Source>,
    study: Option<StudyTable>,
    frames: FrameCache,
}

impl Viewer {
    /// Creates a viewer of run folders and, for a study, its table.
    ///
    /// # Errors
    /// If a folder holds no run.
    pub fn new(sources: Vec<Source>, study: Option<StudyTable>) -> Result<Viewer, ViewError> {
        if let Some(source) = sources.iter().find(|s| !RunFolder::exists_in(&s.folder)) {
            return Err(ReportError::NotARun(source.folder.clone()).into());
        }
        Ok(Viewer { sources, study, frames: FrameCache::new() })
    }

    /// Returns the list of runs as JSON.
    pub(crate) fn index(&self, live: bool) -> String {
        let names = self.sources.iter().map(|source| source.name.clone()).collect();
        json(&Index::new(names, self.study.clone(), live))
    }

    /// Returns the number of runs.
    pub fn len(&self) -> usize {
        self.sources.len()
    }

    /// Returns whether there are no runs.
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Returns the document of a run as JSON; `None` for an unknown index.
    pub(crate) fn run(&mut self, index: usize) -> Option<Result<String, ViewError>> {
        let source = self.sources.get(index)?;
        let run = open(source);
        let document =
            run.map(|run| RunDocument::of(&source.name, &run, Limits::SERVED, &mut self.frames));
        Some(document.map(|document| json(&document)).map_err(ViewError::from))
    }

    /// Returns the small picture of a run as JSON, `null` if it has none; `None` for an unknown
    /// index.
    pub(crate) fn picture(&self, index: usize) -> Option<Result<String, ViewError>> {
        let run = open(self.sources.get(index)?);
        Some(run.map(|run| json(&thumbnail(&run))).map_err(ViewError::from))
    }

    /// Returns the small pictures of the runs of a study; none of other runs, which have no table.
    pub(crate) fn all_pictures(&self) -> Result<Vec<String>, ViewError> {
        let count = if self.study.is_some() { self.sources.len() } else { 0 };
        (0..count).filter_map(|index| self.picture(index)).collect()
    }

    /// Returns the documents of all runs, within the limits of a saved page, and their notes.
    pub(crate) fn all_runs(&mut self) -> Result<(Vec<String>, Vec<String>), ViewError> {
        let limits = Limits::saved(self.sources.len());
        let (mut documents, mut notes) = (Vec::new(), Vec::new());
        for source in &self.sources {
            let document =
                RunDocument::of(&source.name, &open(source)?, limits, &mut FrameCache::new());
            notes.extend(document.notes.iter().map(|note| format!("{}: {note}", source.name)));
            documents.push(json(&document));
        }
        Ok((documents, notes))
    }

    /// Returns the revisions of all runs as JSON: a text that changes when a run goes on.
    pub(crate) fn revisions(&self) -> String {
        json(&self.sources.iter().map(revision).collect::<Vec<_>>())
    }
}

/// Reads a run folder as far as possible.
fn open(source: &Source) -> Result<RunFolder, ReportError> {
    RunFolder::open_with(&source.folder, Damage::Truncate)
}

/// Returns a hash of sizes and times of the files that grow during a run.
fn revision(source: &Source) -> String {
    let mut hasher = DefaultHasher::new();
    let names =
        [grains::FILE, diagnostics::FILE, events::FILE, summary::FILE, "run.pvd", "failure.json"];
    for name in names {
        let data = std::fs::metadata(source.folder.join(name)).ok();
        data.map(|data| (data.len(), data.modified().ok())).hash(&mut hasher);
    }
    format!("{:016x}", hasher.finish())
}

/// Serialises a document; numbers that are not finite become null. All keys are text, so that the
/// serialisation cannot fail.
fn json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value)
        .unwrap_or_else(|error| format!("{{\"error\":{:?}}}", error.to_string()))
}
