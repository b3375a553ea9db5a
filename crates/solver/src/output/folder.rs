//! The run folder: what may be started where.

use std::path::{Path, PathBuf};

use super::checkpoint;
use super::error::{Context, RunError};
use super::lock::{self, Asked, Lock};
use super::pictures;
use super::provenance::{self, Provenance};
use super::summary::Summary;

/// Name of the summary; it is written last.
pub const SUMMARY: &str = "summary.json";
/// Name of the case with everything spelled out.
pub const RESOLVED: &str = "case.resolved.toml";

/// What to do with a run that is already there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Existing {
    /// Leave it alone and stop.
    #[default]
    Refuse,
    /// Remove it and start over.
    Replace,
    /// Go on from its last checkpoint.
    Resume,
    /// Take it as it is or go on with it if it is of the same case and program; else start over.
    Reuse,
}

impl Existing {
    /// What [`Existing::Reuse`] means in this folder; the others mean themselves.
    pub(super) fn settle(self, folder: &Path, digest: &str) -> Existing {
        if self != Existing::Reuse {
            return self;
        }
        let own = Provenance::new(digest);
        let same = |there: &Provenance| {
            (&there.case_sha256, &there.version, &there.commit)
                == (&own.case_sha256, &own.version, &own.commit)
        };
        match Provenance::read(folder) {
            None => Existing::Refuse,
            Some(there) if same(&there) => Existing::Resume,
            Some(_) => Existing::Replace,
        }
    }
}

/// What is in a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Found {
    /// Nothing.
    Empty,
    /// A run that came to its end.
    Finished,
    /// A run that did not.
    Unfinished,
    /// Something else.
    Foreign,
}

pub(super) fn look(folder: &Path) -> Result<Found, RunError> {
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Found::Empty),
        Err(error) => return Err(error).context("read", folder),
    };
    if Provenance::read(folder).is_some() {
        return Ok(if folder.join(SUMMARY).is_file() {
            Found::Finished
        } else {
            Found::Unfinished
        });
    }
    // A kill in the first moments leaves empty folders and temporary files at most.
    let foreign = entries.flatten().any(|entry| {
        let empty = std::fs::read_dir(entry.path()).is_ok_and(|mut inside| inside.next().is_none());
        !empty && !is_temporary(&entry.path()) && entry.file_name() != lock::FILE
    });
    Ok(if foreign {
        Found::Foreign
    } else {
        Found::Empty
    })
}

/// Whether a run may go into the folder; nothing is written.
pub(super) fn admit(folder: &Path, existing: Existing) -> Result<Found, RunError> {
    if folder.exists() && !folder.is_dir() {
        return Err(RunError::Occupied {
            what: format!("{} is a file, not a folder", folder.display()),
            remedy: "give the folder of the run with -o".into(),
        });
    }
    let found = look(folder)?;
    let occupied = |what: &str, remedy: &str| {
        Err(RunError::Occupied {
            what: format!("{} {what}", folder.display()),
            remedy: remedy.into(),
        })
    };
    match (found, existing) {
        (Found::Foreign, _) => occupied(
            "is not empty and holds no run of this program",
            "give another folder with -o",
        ),
        (Found::Finished, Existing::Refuse) => occupied(
            "holds a finished run",
            "give another folder with -o, or --force to replace it",
        ),
        (Found::Unfinished, Existing::Refuse) => occupied(
            "holds a run that has not finished",
            "continue it with --resume, give another folder with -o, or --force to start over",
        ),
        (Found::Empty, Existing::Resume) => occupied(
            "holds no run to resume",
            "leave out --resume, or give the run folder with -o",
        ),
        _ => Ok(found),
    }
}

/// Makes the folder, if need be, and takes it for this program.
pub(super) fn take(folder: &Path) -> Result<Lock, RunError> {
    std::fs::create_dir_all(folder).context("create", folder)?;
    let path = folder.join(lock::FILE);
    match lock::take(&path).context("lock", &path)? {
        Asked::Taken(lock) => Ok(lock),
        Asked::Elsewhere(process) => Err(RunError::InUse {
            folder: folder.into(),
            process,
        }),
    }
}

/// Removes what a run leaves in its folder, and nothing else; its lock stays.
pub(super) fn clear(folder: &Path) -> Result<(), RunError> {
    // The mark of a run folder goes last: a clearing that is cut short can be repeated.
    let files = [
        SUMMARY,
        "failure.json",
        "run.pvd",
        "report.html",
        "grains.csv",
        "diagnostics.csv",
        "events.jsonl",
        RESOLVED,
        provenance::FILE,
    ];
    for name in pictures::FOLDERS
        .iter()
        .chain(&[checkpoint::FOLDER, "shapes", "figures"])
    {
        remove(&folder.join(name), |p| std::fs::remove_dir_all(p))?;
    }
    for name in files {
        remove(&folder.join(name), |p| std::fs::remove_file(p))?;
    }
    Ok(())
}

fn remove(path: &Path, how: impl Fn(&Path) -> std::io::Result<()>) -> Result<(), RunError> {
    match how(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).context("remove", path)
        }
        _ => Ok(()),
    }
}

fn is_temporary(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "tmp")
}

/// Makes the folder and its subfolders, and removes what a kill left half written there.
pub(super) fn create(folder: &Path) -> Result<(), RunError> {
    let inner = pictures::FOLDERS
        .iter()
        .chain(&[checkpoint::FOLDER, "shapes"])
        .map(|name| folder.join(name));
    for path in std::iter::once(PathBuf::from(folder)).chain(inner) {
        std::fs::create_dir_all(&path).context("create", &path)?;
        let entries = std::fs::read_dir(&path).context("read", &path)?;
        for file in entries
            .flatten()
            .map(|e| e.path())
            .filter(|p| is_temporary(p))
        {
            std::fs::remove_file(&file).context("remove", &file)?;
        }
    }
    Ok(())
}

/// The summary of a finished run.
pub fn read_summary(folder: &Path) -> Result<Summary, RunError> {
    let path = folder.join(SUMMARY);
    let text = std::fs::read_to_string(&path).context("read", &path)?;
    serde_json::from_str(&text)
        .map_err(std::io::Error::from)
        .context("read", &path)
}
