//! Planned faults of the disk, for tests.
//!
//! [`inject`] plans a fault at the n-th change in a folder. It is a function, not an environment
//! variable: no user can set it by accident, and a test tries thousands of faults in one process. A
//! crash stops the disk, not the process: no later change has an effect, so that the folder is left
//! as a killed program leaves it. Without a plan a change costs one relaxed load.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The change fails; half the bytes of a write are stored.
    Error,
    /// A write stores half its bytes and says so, which is no error. Other changes succeed.
    ShortWrite,
    /// The disk is full from this change on: writing and creating fail, removing does not.
    Full,
    /// The program stops at this change; half the bytes of a write are stored.
    Crash,
    /// The power fails at this change: as [`Fault::Crash`], and unsynced content is lost.
    PowerCut,
}

/// Kind of change.
#[derive(Clone, Copy, Debug)]
pub(super) enum Change<'a> {
    /// A file or folder is created or opened for writing.
    Create,
    /// A file is cut off at this length [bytes].
    Cut(u64),
    /// A file or folder is synced.
    Sync,
    /// A file gets this name.
    Rename(&'a Path),
    /// A file or folder is removed.
    Remove,
    /// Bytes are written.
    Write,
}

/// Planned fault, and the state of the disk.
struct Plan {
    /// Folder whose changes count.
    folder: PathBuf,
    fault: Fault,
    /// Number of the change at which the fault strikes, from 0.
    at: u64,
    /// Changes so far.
    changes: u64,
    /// Change at which the fault struck.
    struck: Option<String>,
    /// Files with content that was not synced, and the length that was [bytes].
    unsynced: BTreeMap<PathBuf, u64>,
}

static ACTIVE: AtomicBool = AtomicBool::new(false);
static PLANS: Mutex<Vec<Plan>> = Mutex::new(Vec::new());

fn plans() -> MutexGuard<'static, Vec<Plan>> {
    PLANS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Planned fault; the disk is sound again when it is dropped.
pub struct Injected(PathBuf);

/// Plans a fault at the change with this number below a folder, counted from 0 over all threads.
pub fn inject(folder: &Path, fault: Fault, at: u64) -> Injected {
    let unsynced = BTreeMap::new();
    plans().push(Plan { folder: folder.into(), fault, at, changes: 0, struck: None, unsynced });
    ACTIVE.store(true, Ordering::Relaxed);
    Injected(folder.into())
}

impl Injected {
    /// Returns the number of changes so far.
    pub fn changes(&self) -> u64 {
        plans().iter().find(|plan| plan.folder == self.0).map_or(0, |plan| plan.changes)
    }

    /// Returns the change that failed, "Rename grains.csv"; none if the fault has not struck.
    pub fn struck(&self) -> Option<String> {
        plans().iter().find(|plan| plan.folder == self.0)?.struck.clone()
    }
}

impl Drop for Injected {
    fn drop(&mut self) {
        let mut plans = plans();
        plans.retain(|plan| plan.folder != self.0);
        ACTIVE.store(!plans.is_empty(), Ordering::Relaxed);
    }
}

/// Counts a change other than a write, and returns the error of a fault that strikes it.
pub(super) fn before(change: Change, path: &Path) -> io::Result<()> {
    if !ACTIVE.load(Ordering::Relaxed) {
        return Ok(());
    }
    let mut plans = plans();
    let Some(plan) = plans.iter_mut().find(|plan| path.starts_with(&plan.folder)) else {
        return Ok(());
    };
    match plan.strikes(change, path) {
        Some(Fault::ShortWrite) | None => {
            plan.note(change, path);
            Ok(())
        }
        Some(fault) => Err(plan.error(fault)),
    }
}

/// Counts a write of this many bytes. Returns how many a fault stores and what the write returns;
/// none if no fault strikes.
pub(super) fn at_write(path: &Path, bytes: usize) -> Option<(usize, io::Result<usize>)> {
    if !ACTIVE.load(Ordering::Relaxed) {
        return None;
    }
    let mut plans = plans();
    let plan = plans.iter_mut().find(|plan| path.starts_with(&plan.folder))?;
    let stopped = plan.is_stopped();
    let strike = plan.strikes(Change::Write, path);
    if !stopped {
        plan.note(Change::Write, path);
    }
    let half = bytes / 2;
    match strike? {
        Fault::ShortWrite => {
            let stored = half.max(1).min(bytes);
            Some((stored, Ok(stored)))
        }
        fault if stopped || fault == Fault::PowerCut => Some((0, Err(plan.error(fault)))),
        fault => Some((half, Err(plan.error(fault)))),
    }
}

impl Plan {
    /// Returns whether no change has an effect any more.
    fn is_stopped(&self) -> bool {
        self.struck.is_some() && matches!(self.fault, Fault::Crash | Fault::PowerCut)
    }

    /// Counts a change and returns the fault, if it strikes.
    fn strikes(&mut self, change: Change, path: &Path) -> Option<Fault> {
        let number = self.changes;
        self.changes += 1;
        if self.struck.is_none() && number >= self.at {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let kind = format!("{change:?}");
            let kind = kind.split('(').next().unwrap_or_default();
            self.struck = Some(format!("{kind} {name}"));
            return Some(self.fault);
        }
        let grows = matches!(change, Change::Create | Change::Write | Change::Sync);
        let lasting = self.is_stopped() || self.fault == Fault::Full && grows;
        (self.struck.is_some() && lasting).then_some(self.fault)
    }

    /// Keeps the record of synced content.
    fn note(&mut self, change: Change, path: &Path) {
        match change {
            Change::Write if !self.unsynced.contains_key(path) => {
                let length = std::fs::metadata(path).map_or(0, |data| data.len());
                self.unsynced.insert(path.into(), length);
            }
            Change::Sync | Change::Remove => {
                self.unsynced.remove(path);
            }
            Change::Cut(to) => {
                self.unsynced.entry(path.into()).and_modify(|length| *length = to.min(*length));
            }
            Change::Rename(to) => {
                let length = self.unsynced.remove(path);
                self.unsynced.remove(to);
                self.unsynced.extend(length.map(|length| (to.into(), length)));
            }
            _ => {}
        }
    }

    /// Returns the error of a fault; a cut of the power loses what was not synced.
    fn error(&mut self, fault: Fault) -> io::Error {
        if fault == Fault::PowerCut {
            for (path, length) in std::mem::take(&mut self.unsynced) {
                if let Ok(file) = std::fs::OpenOptions::new().write(true).open(path) {
                    let _ = file.set_len(length);
                }
            }
        }
        let kind = match fault {
            Fault::Full => io::ErrorKind::StorageFull,
            _ => io::ErrorKind::Other,
        };
        io::Error::new(kind, format!("planned fault of the disk: {fault:?}"))
    }
}
