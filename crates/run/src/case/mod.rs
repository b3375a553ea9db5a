//! Case files: TOML in, a validated set-up and a run plan out.
//!
//! A case passes three forms: as written (`raw`, every key with its place), validated (the
//! parameter structs of the modules that own them), and resolved (the same file with every
//! default spelled out, which runs as it is and gives the same bits). What is wrong is reported
//! with file, line, key and remedy, and nothing is written.

mod error;
pub mod estimate;
mod expect;
mod loc;
mod overrides;
mod packing;
mod placement;
mod quantity;
mod raw;
pub mod readable;
mod schema;
mod shapes;
mod source;
mod suggest;
mod units;
mod validate;
mod warnings;
mod wording;

use std::path::Path;

use sha2::{Digest, Sha256};

use crate::{Job, RunPlan};
use grainwake_solver::sim::Setup;

pub use error::{CaseError, Problem};
pub use expect::{Expectation, Verdict};
pub use loc::Loc;
pub use schema::schema;
pub use shapes::ShapeFile;
pub use source::Source;
pub use suggest::nearest;

use raw::{RawCase, RawExpect, RawRun};

/// A case that can be run.
#[derive(Debug)]
pub struct Case {
    /// One line that says what it is.
    pub title: String,
    /// What is simulated.
    pub setup: Setup,
    /// What is written and when it ends.
    pub plan: RunPlan,
    /// Threads; 0 for all cores.
    pub threads: usize,
    /// What the run must give.
    pub expect: Vec<Expectation>,
    /// The case as TOML with all defaults spelled out; grain files as they are called in the run folder.
    pub resolved: String,
    /// Grain files that the case uses.
    pub shapes: Vec<ShapeFile>,
    /// Hash of everything that decides the results up to a given time: threads, `[expect]`, the
    /// title, the end and the checkpoint intervals do not.
    pub digest: String,
}

impl Case {
    /// Reads a case file and applies overrides such as "time.end=0.5".
    ///
    /// # Errors
    /// [`CaseError`] with every problem found and its place.
    pub fn load(path: &Path, overrides: &[String]) -> Result<Case, CaseError> {
        let text = std::fs::read_to_string(path).map_err(|source| CaseError::Unreadable {
            path: path.into(),
            source,
        })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Case::parse(&text, &path.display().to_string(), folder, overrides)
    }

    /// The same from text; `name` stands in messages, grain files are relative to `folder`.
    ///
    /// # Errors
    /// [`CaseError`] with every problem found and its place.
    pub fn parse(
        text: &str,
        name: &str,
        folder: &Path,
        overrides: &[String],
    ) -> Result<Case, CaseError> {
        let (source, raw) = source::Source::parse(name, text, overrides)?;
        let v = validate::validate(&source, raw, folder)?;
        let write = |raw: &RawCase| {
            toml::to_string(raw).map_err(|e| CaseError::from(Problem::new(e.to_string())))
        };
        let resolved = write(&v.resolved)?;
        let digest = digest(&v.resolved, &v.shapes, &write)?;
        let title = v.resolved.title;
        let validate::Validated {
            setup,
            plan,
            threads,
            expect,
            shapes,
            ..
        } = v;
        Ok(Case {
            title,
            setup,
            plan,
            threads,
            expect,
            resolved,
            shapes,
            digest,
        })
    }
}

impl Case {
    /// What the run loop needs of the case.
    pub fn job(&self) -> Job {
        Job {
            setup: self.setup.clone(),
            plan: self.plan.clone(),
            resolved: self.resolved.clone(),
            digest: self.digest.clone(),
            files: self
                .shapes
                .iter()
                .map(|file| (file.name.clone(), file.bytes.clone()))
                .collect(),
        }
    }
}

/// Reads a length such as "2 mm" or "0.002" [m]; the error says what is accepted.
///
/// # Errors
/// A message for the user.
pub fn parse_length(text: &str) -> Result<f64, String> {
    quantity::parse_quantity::<quantity::Length>(text)
}

fn digest(
    resolved: &RawCase,
    shapes: &[ShapeFile],
    write: &dyn Fn(&RawCase) -> Result<String, CaseError>,
) -> Result<String, CaseError> {
    let mut core = resolved.clone();
    core.title = String::new();
    // Rounding decides results; threads do not.
    core.run.threads = RawRun::default().threads;
    core.expect = RawExpect::default();
    core.time.end = Default::default();
    core.time.stop = None;
    core.output.checkpoint_interval = Default::default();
    core.output.checkpoint_steps = Default::default();
    let mut hash = Sha256::new();
    hash.update(write(&core)?);
    for shape in shapes {
        hash.update(shape.name.as_bytes());
        hash.update(shape.bytes.as_slice());
    }
    Ok(hash
        .finalize()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect())
}
