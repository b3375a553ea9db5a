//! Changes on the disk: every file is created, written, synced, renamed and removed through this
//! module, so that tests can make any of these changes fail ([`faults`]).

pub mod faults;

use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use faults::Change;

/// File that is open for writing.
#[derive(Debug)]
pub struct Output {
    file: File,
    path: PathBuf,
}

impl Output {
    /// Creates a file, or empties an existing one.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub fn create(path: &Path) -> io::Result<Output> {
        Output::open(path, OpenOptions::new().write(true).create(true).truncate(true))
    }

    /// Opens a file as `options` say.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub fn open(path: &Path, options: &OpenOptions) -> io::Result<Output> {
        faults::before(Change::Create, path)?;
        Ok(Output { file: options.open(path)?, path: path.into() })
    }

    /// Returns the open file, to be read or locked.
    pub fn file(&self) -> &File {
        &self.file
    }

    /// Sets the place of the next write, counted from the start [bytes].
    ///
    /// # Errors
    /// Errors of the operating system.
    pub fn seek(&mut self, place: u64) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(place)).map(drop)
    }

    /// Cuts the file off.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub fn set_len(&self, length: u64) -> io::Result<()> {
        faults::before(Change::Cut(length), &self.path)?;
        self.file.set_len(length)
    }

    /// Waits until the content is on the disk.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub fn sync(&self) -> io::Result<()> {
        faults::before(Change::Sync, &self.path)?;
        self.file.sync_data()
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match faults::at_write(&self.path, bytes.len()) {
            None => self.file.write(bytes),
            Some((stored, result)) => {
                self.file.write_all(&bytes[..stored])?;
                result
            }
        }
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Writes `path` through `fill`; after an error an existing file is unchanged.
///
/// The content goes to a temporary file beside it, whose name holds the process number, because
/// several programs may share a folder. With `sync` the content reaches the disk before the file
/// gets its name.
///
/// # Errors
/// Errors of the operating system and of `fill`.
pub fn write_atomically(
    path: &Path,
    sync: bool,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{}.tmp", std::process::id()));
    let temporary = path.with_file_name(name);
    let written = (|| {
        let mut out = BufWriter::with_capacity(1 << 18, Output::create(&temporary)?);
        fill(&mut out)?;
        let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
        if sync {
            file.sync()?;
        }
        faults::before(Change::Rename(path), &temporary)?;
        std::fs::rename(&temporary, path)
    })();
    if written.is_err() {
        // Best-effort clean-up; the first error is reported.
        let _ = remove_file(&temporary);
    }
    written
}

/// Returns whether a file is a temporary one, left behind by a program that was stopped.
pub fn is_temporary(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "tmp")
}

/// Removes the files `NAME.PROCESS.tmp` of a folder that were written more than a day ago: no
/// program still writes them. Errors are ignored, for another program may remove the same file.
pub fn remove_old_temporaries(folder: &Path) {
    const DAY: Duration = Duration::from_secs(24 * 3600);
    let old = |path: &Path| {
        let written = path.metadata().and_then(|data| data.modified());
        written.is_ok_and(|at| at.elapsed().is_ok_and(|age| age > DAY))
    };
    let ours = |path: &Path| {
        let process = path.file_stem().and_then(|stem| Path::new(stem).extension()?.to_str());
        is_temporary(path) && process.is_some_and(|process| process.parse::<u32>().is_ok())
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    for path in entries.map(|entry| entry.path()) {
        if ours(&path) && path.is_file() && old(&path) {
            let _ = remove_file(&path);
        }
    }
}

/// Waits until the content of a file, however it was written, is on the disk.
///
/// # Errors
/// Errors of the operating system.
pub fn sync_file(path: &Path) -> io::Result<()> {
    Output::open(path, OpenOptions::new().append(true))?.sync()
}

/// Makes the renames in `folder` durable, on systems that can sync a folder.
///
/// # Errors
/// Errors of the operating system.
pub fn sync_folder(folder: &Path) -> io::Result<()> {
    faults::before(Change::Sync, folder)?;
    if cfg!(unix) { File::open(folder)?.sync_all() } else { Ok(()) }
}

/// Creates a folder and its parents, unless they exist.
///
/// # Errors
/// Errors of the operating system.
pub fn create_folder(folder: &Path) -> io::Result<()> {
    faults::before(Change::Create, folder)?;
    std::fs::create_dir_all(folder)
}

/// Removes a file.
///
/// # Errors
/// Errors of the operating system.
pub fn remove_file(path: &Path) -> io::Result<()> {
    faults::before(Change::Remove, path)?;
    std::fs::remove_file(path)
}

/// Removes a folder with its content.
///
/// # Errors
/// Errors of the operating system.
pub fn remove_folder(folder: &Path) -> io::Result<()> {
    faults::before(Change::Remove, folder)?;
    std::fs::remove_dir_all(folder)
}
