//! Case files: TOML in, a validated set-up and a run plan out.
//!
//! A case has three representations:
//!
//! 1. raw: the file as written, each key with its position (`raw`),
//! 2. validated: the parameter structs of the modules that own them (`validate`),
//! 3. resolved: the raw case with every default written out. Running it gives the same results.
//!
//! A problem is reported with file, line, key and remedy; then nothing is written.
//!
//! Layers, downwards: `variant`, `branch`, `continuation`, `validate` -> `warnings` -> `estimate`,
//! `close_packing` -> `packing`, `placement`, `shapes` -> `settling`, `expect` -> `blockage` ->
//! `raw` -> `source` -> `quantity` -> `notation`, `units`, `located`, `error`, `suggest`.

mod blockage;
mod branch;
mod close_packing;
mod continuation;
mod error;
mod estimate;
mod exactly;
mod expect;
mod located;
mod notation;
mod overrides;
mod packing;
mod placement;
pub mod quantity;
mod raw;
mod schema;
mod settling;
mod shapes;
mod source;
mod sphere_cells;
mod suggest;
mod time_scale;
mod toml_messages;
mod units;
mod validate;
mod variant;
mod warnings;

use std::path::Path;
use std::sync::atomic::AtomicBool;

use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::{Job, RESOLVED, RunPlan};
use grainwake_formats::bounded_file::{SETTINGS, read_text};
use grainwake_solver::sim::Setup;

pub use branch::find_parent;
pub use error::{CaseError, Problem};
pub use estimate::{Estimate, cells_for_drag_error, drag_error_text};
pub use exactly::exactly;
pub use expect::{Expectation, Verdict};
pub use located::Located;
pub use schema::schema;
pub use shapes::{ClosedForms, ShapeFile};
pub use source::Source;
pub use suggest::{did_you_mean, nearest};
pub use variant::Origin;

use raw::{RawCase, RawExpect, RawRun};
use shapes::Library;
use validate::Validated;

/// Flag of a case that is read to the end.
static NEVER: AtomicBool = AtomicBool::new(false);

/// A case that can be run.
#[derive(Debug)]
pub struct Case {
    /// Title, one line.
    pub title: String,
    /// Set-up of the simulation.
    pub setup: Setup,
    /// Outputs and end of the run.
    pub plan: RunPlan,
    /// Threads; 0 for all cores.
    pub threads: usize,
    /// Expected results.
    pub expect: Vec<Expectation>,
    /// Resolved case as TOML, with the names that grain files have in the run folder.
    pub resolved: String,
    /// Grain files of the case.
    pub shapes: Vec<ShapeFile>,
    /// Hash of everything that decides the results up to a given time: threads, `[expect]`, the
    /// title, the end, `contact.overlap_limit` and the checkpoint intervals do not.
    pub digest: String,
    origin: Origin,
    /// Text of the case, for the positions of later problems.
    source: Source,
    /// Resolved case.
    raw: RawCase,
}

impl Case {
    /// Reads a case file and applies overrides in turn: "time.end=0.5" sets a key, "-time.step"
    /// removes one.
    ///
    /// # Errors
    /// [`CaseError`] with every problem found and its place.
    pub fn load(path: &Path, overrides: &[String]) -> Result<Case, CaseError> {
        Case::load_until(path, overrides, &NEVER)
    }

    /// Reads a case file as [`Case::load`], until another thread sets `stop`.
    ///
    /// # Errors
    /// As [`Case::load`], and [`CaseError::Interrupted`].
    pub fn load_until(
        path: &Path,
        overrides: &[String],
        stop: &AtomicBool,
    ) -> Result<Case, CaseError> {
        Case::load_sharing(path, overrides, &ClosedForms::default(), stop)
    }

    /// Reads a case file as [`Case::load_until`], and takes its closed forms from `shapes`.
    ///
    /// # Errors
    /// As [`Case::load_until`].
    pub fn load_sharing(
        path: &Path,
        overrides: &[String],
        shapes: &ClosedForms,
        stop: &AtomicBool,
    ) -> Result<Case, CaseError> {
        let text = read_text(path, SETTINGS)
            .map_err(|source| CaseError::Unreadable { path: path.into(), source })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let origin = Origin::new(&path.display().to_string(), &text, folder, overrides);
        let library = origin.library(shapes);
        Case::build(origin, library, stop)
    }

    /// Reads a case from text. Messages contain `name`; grain files are relative to `folder`.
    ///
    /// # Errors
    /// [`CaseError`] with every problem found and its place.
    pub fn parse(
        text: &str,
        name: &str,
        folder: &Path,
        overrides: &[String],
    ) -> Result<Case, CaseError> {
        Case::parse_until(text, name, folder, overrides, &NEVER)
    }

    /// Reads a case from text as [`Case::parse`], until another thread sets `stop`.
    ///
    /// # Errors
    /// As [`Case::parse`], and [`CaseError::Interrupted`].
    pub fn parse_until(
        text: &str,
        name: &str,
        folder: &Path,
        overrides: &[String],
        stop: &AtomicBool,
    ) -> Result<Case, CaseError> {
        let shapes = ClosedForms::default();
        let origin = Origin::new(name, text, folder, overrides);
        let library = origin.library(&shapes);
        Case::build(origin, library, stop)
    }

    /// Reads the case of an origin.
    fn build(origin: Origin, library: Library, stop: &AtomicBool) -> Result<Case, CaseError> {
        let Origin { name, text, overrides, .. } = &origin;
        let (source, raw) = source::Source::parse(name, text, overrides)?;
        let validated = validate::validate(&source, raw, library, stop)?;
        Case::of(origin, source, validated)
    }

    /// Builds a case from `resolved` and `shapes` of another one, which it equals.
    ///
    /// # Errors
    /// [`CaseError`] if they are not those of a case.
    pub fn from_resolved(resolved: &str, shapes: Vec<ShapeFile>) -> Result<Case, CaseError> {
        let (source, raw) = source::Source::parse(RESOLVED, resolved, &[])?;
        let closed_forms = ClosedForms::default();
        let library = Library::of_files(&shapes, &closed_forms)
            .map_err(|(message, help)| CaseError::from(Problem::new(message).help(help)))?;
        let mut validated = validate::validate(&source, raw, library, &NEVER)?;
        // The digest depends on their order.
        validated.shapes = shapes;
        validated.paths = validated.shapes.iter().map(|(name, _)| name.into()).collect();
        Case::of(Origin::new(RESOLVED, resolved, Path::new(""), &[]), source, validated)
    }

    fn of(mut origin: Origin, source: Source, validated: Validated) -> Result<Case, CaseError> {
        let resolved = write(&validated.resolved)?;
        let digest = digest(&validated.resolved, &validated.shapes)?;
        let names = validated.shapes.iter().map(|(name, _)| name.clone());
        origin.files = validated.paths.into_iter().zip(names).collect();
        Ok(Case {
            title: validated.resolved.title.clone(),
            setup: validated.setup,
            plan: validated.plan,
            threads: validated.resolved.run.threads.value,
            expect: validated.expect,
            resolved,
            shapes: validated.shapes,
            digest,
            origin,
            source,
            raw: validated.resolved,
        })
    }

    /// Returns the input of the run loop.
    pub fn job(&self) -> Job {
        Job {
            setup: self.setup.clone(),
            plan: self.plan.clone(),
            resolved: self.resolved.clone(),
            digest: self.digest.clone(),
            files: self.shapes.clone(),
        }
    }

    /// Returns whether the case file or an override gives a dotted key: "grain.1.gap_above".
    pub fn gives(&self, key: &str) -> bool {
        self.source.value_of(key).is_some()
    }

    /// Estimates a run on `threads` threads, with warnings.
    pub fn estimate(&self, threads: usize) -> Estimate {
        let grain_files = self.shapes.iter().map(|(_, bytes)| bytes.len()).sum();
        let mut estimate = Estimate::of(&self.setup, &self.plan, threads, grain_files);
        estimate.warnings = warnings::warnings(&self.setup, &self.plan, &self.expect, &estimate);
        estimate
    }
}

fn write(raw: &RawCase) -> Result<String, CaseError> {
    write_toml(raw).map_err(|e| CaseError::from(Problem::new(e.to_string())))
}

/// Writes a value as TOML, as `toml::to_string` does. The time of that function grows with the
/// square of the number of grains.
///
/// # Errors
/// A value that TOML cannot represent.
pub fn write_toml(value: &impl Serialize) -> Result<String, toml::ser::Error> {
    let mut buffer = toml::ser::Buffer::new();
    value.serialize(toml::Serializer::new(&mut buffer))?;
    Ok(buffer.to_string())
}

/// Reads a length such as "2 mm" or "0.002" [m]; the error says what is accepted.
///
/// # Errors
/// A message for the user.
pub fn parse_length(text: &str) -> Result<f64, String> {
    quantity::parse_quantity::<quantity::Length>(text)
}

/// Reads an angle such as "2 deg" or "0.03" [rad]; the error says what is accepted.
///
/// # Errors
/// A message for the user.
pub fn parse_angle(text: &str) -> Result<f64, String> {
    quantity::parse_quantity::<quantity::Angle>(text)
}

fn digest(resolved: &RawCase, shapes: &[ShapeFile]) -> Result<String, CaseError> {
    let mut core = resolved.clone();
    core.title = String::new();
    // The precision decides the results; the number of threads does not.
    core.run.threads = RawRun::default().threads;
    core.expect = RawExpect::default();
    // One limit ends a run, the other admits it; no result depends on them.
    core.contact.overlap_limit = None;
    core.contact.accept_overlap = None;
    core.time.end = Default::default();
    core.time.stop = None;
    core.output.checkpoint_interval = Default::default();
    core.output.checkpoint_steps = Default::default();
    core.output.checkpoint_keep = None;
    let mut hash = Sha256::new();
    hash.update(write(&core)?);
    for (name, bytes) in shapes {
        hash.update(name.as_bytes());
        hash.update(bytes.as_slice());
    }
    let bytes = hash.finalize();
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use grainwake_shape::Shape;

    use super::*;

    /// Grain files of two folders: their order differs from that of their names.
    #[test]
    fn a_case_is_rebuilt_from_its_resolved_text_and_files() {
        let folder = tempfile::tempdir().unwrap();
        let mut grains = String::new();
        for (name, z) in [("b/one", 0.25), ("a/two", 0.75)] {
            let file = folder.path().join(format!("{name}.grain"));
            std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            Shape::sphere(0.1 * (1.0 + z), 100).save(&file).unwrap();
            grains += &format!(
                "[[grain]]\nfile = \"{name}.grain\"\ndensity = 2500\nposition = [0.5, 0.5, {z}]\n"
            );
        }
        let text =
            format!("[domain]\nsize = [1, 1, 1]\ncell_size = 0.1\n[time]\nend = 1\n{grains}");
        let case = Case::parse(&text, "case", folder.path(), &["time.end=2 s".into()]).unwrap();
        let names: Vec<&str> = case.shapes.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["shapes/two.grain", "shapes/one.grain"]);
        let again = Case::from_resolved(&case.resolved, case.shapes.clone()).unwrap();
        assert_eq!((&again.resolved, &again.digest), (&case.resolved, &case.digest));
        assert_eq!((again.plan.end, again.setup.grains.len()), (2.0, 2));
        assert!(Case::from_resolved(&case.resolved, Vec::new()).is_err());
    }

    #[test]
    fn another_thread_ends_the_reading_of_a_case() {
        let text = "[domain]\nsize = [1, 1, 1]\n[time]\nend = 1\n[[grain]]\n\
                    shape = { kind = \"sphere\", diameter = 0.1 }\ndensity = 2500\n\
                    position = [0.5, 0.5, 0.5]\n";
        let read = |stop: bool| {
            Case::parse_until(text, "case", Path::new(""), &[], &AtomicBool::new(stop))
        };
        assert!(read(false).is_ok());
        assert!(matches!(read(true), Err(CaseError::Interrupted)));
    }

    #[test]
    fn the_resolved_case_is_written_as_by_the_plain_function() {
        let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases");
        for name in ["settled-heap/case.toml", "periodic-suspension/case.toml"] {
            let raw = Case::load(&cases.join(name), &[]).unwrap().raw;
            assert_eq!(write_toml(&raw).unwrap(), toml::to_string(&raw).unwrap());
        }
    }
}
