//! Suites of a folder, or those in the program.

use std::io::Read as _;
use std::path::Path;

use flate2::read::DeflateDecoder;
use tempfile::TempDir;

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
    /// Copy of the files in the program.
    unpacked: Option<TempDir>,
}

impl Library {
    /// Reads the suites in `folder`. Without a folder, reads those in `validation` below the
    /// current folder if there are any, otherwise those in the program.
    ///
    /// # Errors
    /// An unreadable folder, or the first invalid suite.
    pub fn open(folder: Option<&Path>) -> Result<Library, SuiteError> {
        if let Some(folder) = folder {
            return Ok(Library { suites: Suite::read_all(folder)?, unpacked: None });
        }
        let tree = Path::new(FOLDER);
        let suites = if tree.is_dir() { Suite::read_all(tree)? } else { Vec::new() };
        if suites.is_empty() { Library::embedded() } else { Ok(Library { suites, unpacked: None }) }
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
        Ok(Library { suites: Suite::read_all(unpacked.path())?, unpacked: Some(unpacked) })
    }

    /// Returns whether the suites are those in the program.
    pub fn is_embedded(&self) -> bool {
        self.unpacked.is_some()
    }
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
        let unpacked = embedded.unpacked.as_ref().unwrap().path();
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
        let folder = embedded.unpacked.as_ref().unwrap().path().to_path_buf();
        assert!(embedded.suites[0].folder.starts_with(&folder) && folder.is_dir());
        drop(embedded);
        assert!(!folder.exists(), "the temporary folder is removed");
    }

    #[test]
    fn the_suites_in_the_program_are_small() {
        let size: usize = FILES.iter().map(|(_, length)| length).sum();
        assert!(size < 300_000 && CONTENTS.len() < 150_000, "{size}, {} bytes", CONTENTS.len());
    }
}
