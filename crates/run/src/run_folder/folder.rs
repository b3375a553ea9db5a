//! The run folder: admission of a run, creation and removal of its files.

use std::path::{Path, PathBuf};

use grainwake_formats::disk::{self, is_temporary, write_atomically};
use grainwake_formats::{contacts, probes, summary};

use super::checkpoint;
use super::lock::{self, Attempt, Lock};
use super::parent::Parent;
use super::provenance::{self, ParentRun, Provenance};
use super::tables;
use super::vtk_output;
use crate::error::{Context, RunError};
use crate::number_format::quantity;

/// Name of the case file with all defaults written out.
pub const RESOLVED: &str = "case.resolved.toml";

/// Treatment of an existing run in the folder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Existing {
    /// Keep the run and stop.
    #[default]
    Refuse,
    /// Remove the run and start over.
    Replace,
    /// Continue from the last checkpoint.
    Resume,
    /// Continue from the last checkpoint; start in a folder without a run.
    ResumeOrStart,
    /// Keep or continue a run of the same case and program; otherwise start over.
    Reuse,
}

impl Existing {
    /// Resolves [`Existing::Reuse`] and [`Existing::ResumeOrStart`] for this folder; other values
    /// are returned unchanged.
    pub(crate) fn resolve(self, folder: &Path, digest: &str) -> Existing {
        match self {
            Existing::Reuse => {}
            Existing::ResumeOrStart if Provenance::read(folder).is_some() => {
                return Existing::Resume;
            }
            Existing::ResumeOrStart => return Existing::Refuse,
            _ => return self,
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

/// Content of a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Content {
    /// Nothing.
    Empty,
    /// Finished run.
    Finished,
    /// Unfinished run.
    Unfinished,
    /// Other files.
    Foreign,
}

fn content(folder: &Path) -> Result<Content, RunError> {
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Content::Empty),
        Err(error) => return Err(error).context("read", folder),
    };
    if Provenance::read(folder).is_some() {
        return Ok(if folder.join(summary::FILE).is_file() {
            Content::Finished
        } else {
            Content::Unfinished
        });
    }
    // A run killed right after its start leaves at most empty folders and temporary files.
    let foreign = entries.flatten().any(|entry| {
        let empty = std::fs::read_dir(entry.path()).is_ok_and(|mut inside| inside.next().is_none());
        let own = [lock::FILE, checkpoint::REMOVAL].iter().any(|own| entry.file_name() == *own);
        !empty && !is_temporary(&entry.path()) && !own
    });
    Ok(if foreign { Content::Foreign } else { Content::Empty })
}

/// Checks that a run may use the folder; writes nothing.
pub(crate) fn admit(folder: &Path, existing: Existing) -> Result<Content, RunError> {
    let occupied = |what: &str, remedy: &str| Err(RunError::occupied(folder, what, remedy));
    if folder.exists() && !folder.is_dir() {
        return occupied("is a file, not a folder", "give the folder of the run with -o");
    }
    let present = content(folder)?;
    match (present, existing) {
        (Content::Foreign, _) if folder.join(provenance::FILE).exists() => {
            let what = "holds a provenance.json that cannot be read, so that its run is not known";
            occupied(what, "give another folder with -o")
        }
        (Content::Foreign, _) => {
            occupied("is not empty and holds no run of this program", "give another folder with -o")
        }
        (Content::Finished, Existing::Refuse) => occupied(
            "holds a finished run",
            "give another folder with -o, or --force to replace it",
        ),
        (Content::Unfinished, Existing::Refuse) => occupied(
            "holds a run that has not finished",
            "continue it with --resume, give another folder with -o, or --force to start over",
        ),
        (Content::Empty, Existing::Resume) => occupied(
            "holds no run to resume",
            "leave out --resume, write --resume-or-start, or give the run folder with -o",
        ),
        _ => Ok(present),
    }
}

/// Refuses a run in the folder of its own parent.
pub(crate) fn admit_parent(folder: &Path, parent: Option<&Parent>) -> Result<(), RunError> {
    let Some(parent) = parent else { return Ok(()) };
    let absolute = |path: &Path| std::fs::canonicalize(path).ok();
    match absolute(folder) {
        path @ Some(_) if absolute(parent.folder()) == path => {
            let remedy = "give another folder with -o, or continue the run itself with --resume";
            Err(RunError::occupied(folder, "is the run to start from", remedy))
        }
        _ => Ok(()),
    }
}

/// Refuses to resume a run as the continuation of another parent; without a parent it resumes.
pub(crate) fn same_parent(
    folder: &Path,
    own: &Provenance,
    parent: Option<&Parent>,
) -> Result<(), RunError> {
    let recorded = own.parent.as_ref();
    match parent {
        Some(parent) if recorded.is_none_or(|own| own.case_sha256 != parent.digest()) => {
            let there = recorded.map_or("at t = 0".into(), |own| format!("from {}", own.folder));
            let here = parent.folder().display();
            let what = format!("it started {there}, and --from names {here}");
            Err(RunError::OtherCase { folder: folder.into(), what })
        }
        Some(parent) => match recorded {
            Some(own) if !parent.may_be_at(own.checkpoint_time) => {
                let (own, asked) = (own.checkpoint_time, parent.time());
                let [own, asked] = [own, asked].map(|time| quantity(time, "s"));
                let what = format!("it started at t = {own}, and --from names t = {asked}");
                Err(RunError::OtherCase { folder: folder.into(), what })
            }
            _ => Ok(()),
        },
        None => Ok(()),
    }
}

/// Error of a run that was interrupted before it had saved the state it started from.
pub(crate) fn start_lost(folder: &Path, parent: &ParentRun) -> RunError {
    let (time, from) = (parent.checkpoint_time, &parent.folder);
    let at = quantity(time, "s");
    let what =
        format!("holds a run that started from {from} at t = {at} and has no checkpoint yet");
    RunError::occupied(
        folder,
        what,
        format!("start it again with --from \"{from}@{time}\" --force"),
    )
}

/// Creates the folder if absent, and locks it for this program.
pub(crate) fn lock_folder(folder: &Path) -> Result<Lock, RunError> {
    disk::create_folder(folder).context("create", folder)?;
    let path = folder.join(lock::FILE);
    match lock::acquire(&path).context("lock", &path)? {
        Attempt::Acquired(lock) => Ok(lock),
        Attempt::HeldByOther(process) => Err(RunError::InUse { folder: folder.into(), process }),
    }
}

/// Removes the files of a run and nothing else; the lock is kept.
pub(crate) fn clear(folder: &Path) -> Result<(), RunError> {
    // An interrupted removal can be repeated: the summary, which marks a finished run, goes first,
    // then the checkpoints, which refer to the other files. The provenance marks a run folder and
    // goes last but one. A mark tells tables without checkpoints from those whose checkpoints were
    // lost.
    remove_if_there(&folder.join(summary::FILE), disk::remove_file)?;
    let mark = folder.join(checkpoint::REMOVAL);
    write_atomically(&mark, true, |_| Ok(())).context("write", &mark)?;
    remove_if_there(&folder.join(checkpoint::FOLDER), disk::remove_folder)?;
    let files = [
        contacts::FILE,
        "failure.json",
        "run.pvd",
        "report.html",
        RESOLVED,
        provenance::FILE,
        checkpoint::REMOVAL,
    ];
    let folders = [vtk_output::FULL_FIELDS, probes::FOLDER, contacts::FOLDER, "shapes", "figures"];
    for name in vtk_output::FOLDERS.iter().chain(&folders) {
        remove_if_there(&folder.join(name), disk::remove_folder)?;
    }
    for name in tables::FILES.into_iter().chain(files) {
        remove_if_there(&folder.join(name), disk::remove_file)?;
    }
    Ok(())
}

/// Removes a file or folder, which may be gone already.
pub(crate) fn remove_if_there(
    path: &Path,
    how: impl Fn(&Path) -> std::io::Result<()>,
) -> Result<(), RunError> {
    match how(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).context("remove", path)
        }
        _ => Ok(()),
    }
}

/// Creates the folder and its subfolders, and removes temporary files of a killed run.
pub(crate) fn create(folder: &Path) -> Result<(), RunError> {
    let inner = || {
        let names = vtk_output::FOLDERS.iter().chain(&[checkpoint::FOLDER, "shapes"]);
        names.map(|name| folder.join(name))
    };
    for path in std::iter::once(PathBuf::from(folder)).chain(inner()) {
        disk::create_folder(&path).context("create", &path)?;
    }
    let optional = [vtk_output::FULL_FIELDS, probes::FOLDER, contacts::FOLDER, "figures"];
    let optional = optional.map(|name| folder.join(name));
    let optional = optional.into_iter().filter(|path| path.is_dir());
    for path in std::iter::once(PathBuf::from(folder)).chain(inner()).chain(optional) {
        let entries = std::fs::read_dir(&path).context("read", &path)?;
        for file in entries.flatten().map(|e| e.path()).filter(|p| is_temporary(p)) {
            disk::remove_file(&file).context("remove", &file)?;
        }
    }
    Ok(())
}
