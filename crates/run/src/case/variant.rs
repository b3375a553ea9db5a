//! Variants of a case in memory: its text with further overrides and its own grain files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};

use super::shapes::Library;
use super::{Case, CaseError, ClosedForms};

/// Text, overrides and grain files that a case was read from. It can be stored next to
/// [`Case::resolved`] and [`Case::shapes`].
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Origin {
    /// Name of the text in messages.
    pub(super) name: String,
    pub(super) text: String,
    /// Overrides of the text; each applies to the result of those before.
    pub(super) overrides: Vec<String>,
    /// Folder that files are relative to.
    folder: PathBuf,
    /// Path of each grain file, and its name in the run folder.
    pub(super) files: Vec<(PathBuf, String)>,
}

impl Origin {
    /// Origin of a text with overrides, whose files are relative to `folder`.
    pub(super) fn new(name: &str, text: &str, folder: &Path, overrides: &[String]) -> Origin {
        Origin {
            name: name.into(),
            text: text.into(),
            overrides: overrides.to_vec(),
            folder: folder.into(),
            files: Vec::new(),
        }
    }

    /// Returns the name of the text in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Library without files.
    pub(super) fn library<'a>(&self, shapes: &'a ClosedForms) -> Library<'a> {
        Library::new(&self.folder, shapes)
    }
}

impl Case {
    /// Returns the text, overrides and grain files that the case was read from.
    pub fn origin(&self) -> &Origin {
        &self.origin
    }

    /// Replaces the origin of a case that was rebuilt by [`Case::from_resolved`], so that its
    /// variants are those of the original case.
    #[must_use]
    pub fn with_origin(self, origin: Origin) -> Case {
        Case { origin, ..self }
    }

    /// Returns the case with further overrides, until another thread sets `stop`. Defaults are
    /// derived anew. Grain files that the case has read are not read again.
    ///
    /// # Errors
    /// As [`Case::parse_until`].
    pub fn with_overrides(
        &self,
        overrides: &[String],
        stop: &AtomicBool,
    ) -> Result<Case, CaseError> {
        let mut origin = self.origin.clone();
        origin.overrides.extend_from_slice(overrides);
        let contents: BTreeMap<&str, &Arc<Vec<u8>>> =
            self.shapes.iter().map(|(name, bytes)| (name.as_str(), bytes)).collect();
        let known = |(path, name): &(PathBuf, String)| {
            contents.get(name.as_str()).map(|bytes| (path.clone(), (*bytes).clone()))
        };
        let shapes = ClosedForms::default();
        let library = origin.library(&shapes).knowing(origin.files.iter().filter_map(known));
        Case::build(origin, library, stop)
    }
}

#[cfg(test)]
mod tests {
    use grainwake_shape::Shape;

    use super::super::NEVER;
    use super::*;

    fn text(file: &str) -> String {
        format!(
            "[domain]\nsize = [1, 1, 1]\n[time]\nend = 1\n[[grain]]\nfile = \"{file}\"\n\
             density = 2500\nposition = [0.5, 0.5, 0.5]\n"
        )
    }

    fn strings(overrides: &[&str]) -> Vec<String> {
        overrides.iter().map(|text| (*text).to_owned()).collect()
    }

    #[test]
    fn a_variant_is_the_case_with_all_overrides_and_needs_no_file() {
        let folder = tempfile::tempdir().unwrap();
        Shape::sphere(0.1, 100).save(&folder.path().join("one.grain")).unwrap();
        Shape::sphere(0.2, 100).save(&folder.path().join("two.grain")).unwrap();
        let read = |overrides: &[&str]| {
            Case::parse(&text("one.grain"), "case", folder.path(), &strings(overrides)).unwrap()
        };
        let expected = read(&["time.end=2", "grain.0.density=2000"]);
        let defaults = read(&["grain.0.density=2000"]);
        let case = read(&["time.end=2"]);
        let other = case.with_overrides(&strings(&["grain.0.file=two.grain"]), &NEVER).unwrap();
        assert_eq!(other.shapes.len(), 1, "a file that no grain uses is left out");
        folder.close().unwrap();
        let set = strings(&["grain.0.density=2000"]);
        let rebuilt = Case::from_resolved(&case.resolved, case.shapes.clone()).unwrap();
        for case in [&case, &rebuilt.with_origin(case.origin().clone())] {
            let variant = case.with_overrides(&set, &NEVER).unwrap();
            assert_eq!(variant.resolved, expected.resolved);
            assert_eq!(variant.digest, expected.digest);
            // A key that an earlier override has set is removed.
            let set = strings(&["-time.end", "time.end=1"]);
            let variant = variant.with_overrides(&set, &NEVER).unwrap();
            assert_eq!(variant.resolved, defaults.resolved);
        }
        let other = other.with_overrides(&set, &NEVER).unwrap();
        assert_eq!(other.shapes[0].0, "shapes/two.grain");
    }

    #[test]
    fn a_problem_of_a_variant_is_located_in_its_override() {
        let text =
            text("x").replace("file = \"x\"", "shape = { kind = \"sphere\", diameter = 0.1 }");
        let case = Case::parse(&text, "case", Path::new(""), &strings(&["time.end=2"])).unwrap();
        let error = case.with_overrides(&strings(&["time.end=2 kg"]), &NEVER).unwrap_err();
        let problem = &error.problems()[0];
        assert_eq!(problem.key.as_deref(), Some("time.end"));
        assert_eq!(problem.place(), Some(("--set", 1, 12)));
    }
}
