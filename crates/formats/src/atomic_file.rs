//! Atomic writing: a file is written under a temporary name, synced if asked, and renamed.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes `path` through `fill`; after an error an existing file is unchanged.
///
/// With `sync` the content reaches the disk before the file gets its name.
///
/// # Errors
/// Errors of the operating system and of `fill`.
pub fn write_atomically(
    path: &Path,
    sync: bool,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(".tmp");
    let temporary = path.with_file_name(name);
    let written = (|| {
        let mut out = BufWriter::with_capacity(1 << 18, File::create(&temporary)?);
        fill(&mut out)?;
        let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
        if sync {
            file.sync_all()?;
        }
        std::fs::rename(&temporary, path)
    })();
    if written.is_err() {
        // Best-effort clean-up; the first error is reported.
        let _ = std::fs::remove_file(&temporary);
    }
    written
}

/// Makes the renames in `folder` durable, on systems that can sync a folder.
///
/// # Errors
/// Errors of the operating system.
pub fn sync_folder(folder: &Path) -> io::Result<()> {
    if cfg!(unix) { File::open(folder)?.sync_all() } else { Ok(()) }
}
