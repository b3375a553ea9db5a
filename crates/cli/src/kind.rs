//! Distinction of case files and study files, to suggest the right command for a confused file.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use grainwake_formats::bounded_file::{SETTINGS, read_text};
use grainwake_run::case::{Case, CaseError, Source};
use grainwake_study::{Study, StudyError};
use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::args::Overrides;
use crate::exit::Exit;

/// Top-level keys that occur in one of the two kinds only.
#[derive(Deserialize)]
struct Marks {
    domain: Option<IgnoredAny>,
    grain: Option<IgnoredAny>,
    packing: Option<IgnoredAny>,
    poses: Option<IgnoredAny>,
    base: Option<IgnoredAny>,
    axis: Option<IgnoredAny>,
    model: Option<IgnoredAny>,
}

#[derive(PartialEq)]
enum Kind {
    Case,
    Study,
}

/// Returns the kind of a file by its keys; `None` if they are ambiguous.
fn kind(path: &Path) -> Option<Kind> {
    let text = read_text(path, SETTINGS).ok()?;
    let (_, marks): (Source, Marks) = Source::parse("", &text, &[]).ok()?;
    let case = marks.domain.or(marks.grain).or(marks.packing).or(marks.poses).is_some();
    let study = marks.base.or(marks.axis).or(marks.model).is_some();
    match (case, study) {
        (true, false) => Some(Kind::Case),
        (false, true) => Some(Kind::Study),
        _ => None,
    }
}

/// Returns the default folder of the results of a file: `runs/FOLDER` for one with the `usual`
/// name, else `runs/FOLDER-FILE`; `runs/FILE` if the folder is not the `own` one of its files.
pub fn default_folder(file: &Path, usual: &str, own: impl Fn(&Path) -> bool) -> PathBuf {
    let absolute = std::path::absolute(file).unwrap_or_else(|_| file.into());
    let name = |part: Option<&OsStr>| part.map(|part| part.to_string_lossy().into_owned());
    let stem = name(absolute.file_stem()).unwrap_or_else(|| usual.into());
    let folder = absolute.parent().filter(|folder| own(folder));
    let name = match name(folder.and_then(Path::file_name)) {
        Some(folder) if stem == usual => folder,
        Some(folder) => format!("{folder}-{stem}"),
        None => stem,
    };
    Path::new("runs").join(name)
}

/// Reads a case file and applies overrides.
pub fn case(path: &Path, overrides: &Overrides) -> Result<Case, Exit> {
    Case::load(path, &overrides.list()).map_err(|error| {
        if matches!(error, CaseError::Invalid(_)) && kind(path) == Some(Kind::Study) {
            return Exit::refused(
                format!("{} is a study file, not a case", path.display()),
                format!("use: grainwake study {}; --dry-run lists its runs", path.display()),
            );
        }
        error.into()
    })
}

/// Reads a study file.
pub fn study(path: &Path) -> Result<Study, Exit> {
    Study::read(path).map_err(|error| {
        if matches!(error, StudyError::Invalid(_)) && kind(path) == Some(Kind::Case) {
            return Exit::refused(
                format!("{} is a case, not a study file", path.display()),
                format!(
                    "use: grainwake run {}; a study file refers to it as its `base`",
                    path.display()
                ),
            );
        }
        error.into()
    })
}
