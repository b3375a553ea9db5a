//! Suites of a folder, or those in the program.

use std::io::Read as _;
use std::path::Path;

use flate2::read::DeflateDecoder;
use grainwake_run::case::{Problem, did_you_mean};
use tempfile::TempDir;

use crate::check::Level;
use crate::suite::{Suite, SuiteError};

/// Files of the suites in the program: path below the folder of the suites, and length [bytes].
const FILES: &[(&str, usize)] = &include!(concat!(env!("OUT_DIR"), "/suites.rs"));
/// Contents of the files, one after the other, compressed.
const CONTENTS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/suites.deflate"));
/// Folder of the suites in a source tree.
const FOLDER: &str = "validation";

/// Suites, with the files that they refer to.
#[derive(Debug)]
pub struct Library {
    /// Suites in order of name. Their files exist as long as the library.
    pub suites: Vec<Suite>,
    /// Copy of the files in the program, removed with the library.
    _unpacked: Option<TempDir>,
}

impl Library {
    /// Reads the suites in `folder`. Without a folder, reads those in `validation` below the
    /// current folder if there are any, otherwise those in the program.
    ///
    /// # Errors
    /// An unreadable folder, or the first invalid suite.
    pub fn open(folder: Option<&Path>) -> Result<Library, SuiteError> {
        if let Some(folder) = folder {
            return Ok(Library { suites: Suite::read_all(folder)?, _unpacked: None });
        }
        let tree = Path::new(FOLDER);
        let suites = if tree.is_dir() { Suite::read_all(tree)? } else { Vec::new() };
        if suites.is_empty() {
            Library::embedded()
        } else {
            Ok(Library { suites, _unpacked: None })
        }
    }

    /// Reads the suites in the program. A temporary folder holds their files.
    ///
    /// # Errors
    /// The temporary folder cannot be written.
    pub fn embedded() -> Result<Library, SuiteError> {
        let failed = |path: &Path| {
            let path = path.to_path_buf();
            move |source| SuiteError::Unreadable { path, source }
        };
        let unpacked = tempfile::Builder::new()
            .prefix("grainwake-validation-")
            .tempdir()
            .map_err(failed(&std::env::temp_dir()))?;
        let mut contents = Vec::new();
        DeflateDecoder::new(CONTENTS).read_to_end(&mut contents).expect("the suites of the build");
        let mut rest = contents.as_slice();
        for (name, length) in FILES {
            let (file, others) = rest.split_at(*length);
            rest = others;
            let path = unpacked.path().join(name);
            let folder = path.parent().unwrap_or(unpacked.path());
            std::fs::create_dir_all(folder).map_err(failed(folder))?;
            std::fs::write(&path, file).map_err(failed(&path))?;
        }
        Ok(Library { suites: Suite::read_all(unpacked.path())?, _unpacked: Some(unpacked) })
    }

    /// Returns the suites and runs with the given names, NAME or NAME/RUN, with the runs that these
    /// refer to; all without names. `level` is that of the runs to be executed, if any.
    ///
    /// # Errors
    /// There are no suites, or a name is not known (the remedy lists the known ones) or has no run
    /// of the level.
    pub fn chosen(&self, names: &[String], level: Option<Level>) -> Result<Vec<Suite>, SuiteError> {
        if self.suites.is_empty() {
            let message = "there is no validation in the folder of the suites";
            let help =
                "each is a folder with a validation.toml; suites is the folder that holds them";
            return Err(Problem::new(message).help(help).into());
        }
        for name in names {
            let (suite_name, run) = match name.split_once('/') {
                Some((suite, run)) => (suite, Some(run)),
                None => (name.as_str(), None),
            };
            let known = self.suites.iter().map(|suite| suite.name.as_str());
            let Some(suite) = self.suites.iter().find(|suite| suite.name == suite_name) else {
                let message = format!("there is no validation \"{suite_name}\"");
                return Err(unknown(message, suite_name, "There are", known.collect()));
            };
            let runs = suite.runs.iter().map(|run| run.name.as_str());
            if let Some(run) = run.filter(|run| !runs.clone().any(|known| known == *run)) {
                let message = format!("the validation \"{suite_name}\" has no run \"{run}\"");
                return Err(unknown(message, run, "It has", runs.collect()));
            }
            let mut named =
                suite.runs.iter().filter(|known| run.is_none_or(|run| known.name == run));
            if level.is_some_and(|level| named.all(|run| run.level > level)) {
                let message = format!("\"{name}\" is of the level full");
                return Err(Problem::new(message)
                    .help("give it: --level full, in Python level=\"full\"")
                    .into());
            }
        }
        let chosen = self.suites.iter().cloned().map(|suite| {
            if names.is_empty() || names.contains(&suite.name) {
                return suite;
            }
            let name = suite.name.clone();
            suite.restricted_to(|run| names.contains(&format!("{name}/{run}")))
        });
        Ok(chosen.filter(|suite| !suite.runs.is_empty()).collect())
    }
}

/// Problem of an unknown `word`; `listed` introduces the `known` ones.
fn unknown(message: String, word: &str, listed: &str, known: Vec<&str>) -> SuiteError {
    let hint = did_you_mean(word, known.iter().copied());
    Problem::new(message).help(format!("{hint}{listed}: {}", known.join(", "))).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_suites_in_the_program_are_those_of_the_source_tree() {
        let tree = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../validation");
        let describe = |suites: &[Suite]| -> Vec<(String, String, usize)> {
            suites.iter().map(|s| (s.name.clone(), s.title.clone(), s.runs.len())).collect()
        };
        let embedded = Library::embedded().unwrap();
        let unpacked = embedded._unpacked.as_ref().unwrap().path();
        let explains =
            |path: &Path| ["md", "py"].iter().any(|e| path.extension() == Some(e.as_ref()));
        for suite in std::fs::read_dir(&tree).unwrap().flatten().filter(|e| e.path().is_dir()) {
            for file in std::fs::read_dir(suite.path()).unwrap().flatten().map(|e| e.path()) {
                let copy = std::fs::read(unpacked.join(file.strip_prefix(&tree).unwrap()));
                let same = copy.is_ok_and(|copy| copy == std::fs::read(&file).unwrap());
                let is_folder = file.is_dir();
                assert!(
                    same || is_folder || explains(&file),
                    "{} is not in the program",
                    file.display()
                );
            }
        }
        assert_eq!(
            describe(&embedded.suites),
            describe(&Library::open(Some(&tree)).unwrap().suites)
        );
        assert!(embedded.suites.iter().any(|suite| suite.name == "ten-cate"));
        let folder = embedded._unpacked.as_ref().unwrap().path().to_path_buf();
        assert!(embedded.suites[0].folder.starts_with(&folder) && folder.is_dir());
        drop(embedded);
        assert!(!folder.exists(), "the temporary folder is removed");
    }

    #[test]
    fn names_choose_suites_and_runs_with_their_references() {
        let library = Library::embedded().unwrap();
        let chosen = |name: &str| library.chosen(&[name.to_string()], Some(Level::Ci));
        let all = library.chosen(&[], None).unwrap();
        assert_eq!(describe_runs(&all), describe_runs(&library.suites));
        let rotation = chosen("rotation").unwrap();
        assert!(rotation.len() == 1 && rotation[0].runs.len() > 1);
        let run = chosen("rotation/spin-d8").unwrap();
        assert!(run[0].runs.len() < rotation[0].runs.len());
        assert_eq!(run[0].runs.last().unwrap().name, "spin-d8");
        for (name, message, help) in [
            ("rotaton", "there is no validation \"rotaton\"", "\"rotation\""),
            ("x/y", "there is no validation \"x\"", "There are: array, "),
            ("rotation/", "the validation \"rotation\" has no run \"\"", "It has: "),
            ("rotation/spin-d16", "is of the level full", "--level full"),
            ("rotation/spin-d9", "has no run \"spin-d9\"", "\"spin-d8\""),
        ] {
            let SuiteError::Invalid(problem) = chosen(name).unwrap_err() else { panic!("{name}") };
            assert!(problem.message.contains(message), "{}", problem.message);
            assert!(problem.help.as_ref().unwrap().contains(help), "{:?}", problem.help);
        }
        let empty = Library { suites: Vec::new(), _unpacked: None };
        let message = empty.chosen(&[], None).unwrap_err().to_string();
        assert!(message.contains("no validation in the folder"), "{message}");
    }

    fn describe_runs(suites: &[Suite]) -> Vec<(String, usize)> {
        suites.iter().map(|suite| (suite.name.clone(), suite.runs.len())).collect()
    }

    #[test]
    fn the_suites_in_the_program_are_small() {
        let size: usize = FILES.iter().map(|(_, length)| length).sum();
        assert!(size < 300_000 && CONTENTS.len() < 150_000, "{size}, {} bytes", CONTENTS.len());
    }
}
