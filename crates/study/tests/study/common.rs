//! Studies of a small pair in a folder of their own.

use std::path::{Path, PathBuf};

use grainwake_study::{Plan, Study, StudyError};

use crate::files::DRY;

/// Creates a folder with `case.toml` and `study.toml`.
pub fn folder(study: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("case.toml"), DRY).unwrap();
    let path = folder.path().join("study.toml");
    std::fs::write(&path, study).unwrap();
    (folder, path)
}

/// Resolves a study file.
pub fn plan(path: &Path) -> Result<Plan, StudyError> {
    Plan::resolve(&Study::read(path)?, &[])
}

/// Returns the problems of an invalid study.
pub fn problems(study: &str) -> Vec<grainwake_run::case::Problem> {
    let (_folder, path) = folder(study);
    match plan(&path) {
        Err(StudyError::Invalid(problems)) => problems,
        Err(other) => panic!("another error: {other}"),
        Ok(_) => panic!("accepted"),
    }
}
