//! Locks: one program at a time in a folder. The system releases a lock when its program ends, in
//! whatever way.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Write};
use std::path::Path;

/// Name of the lock in a run folder.
pub const FILE: &str = "run.lock";

/// A file that is locked as long as this lives.
#[derive(Debug)]
pub struct Lock {
    file: File,
}

impl Drop for Lock {
    fn drop(&mut self) {
        // The file stays: another program may just have opened it to ask.
        let _ = self.file.set_len(0);
    }
}

/// What came of asking for a lock.
#[derive(Debug)]
pub enum Asked {
    /// It is ours.
    Taken(Lock),
    /// Another program has it; its process number, where it can be read.
    Elsewhere(Option<u32>),
}

/// Locks a file, which is made if it is not there, without waiting.
///
/// On a file system that knows no locks everybody gets one: who shares it must see to it that no
/// two programs use a folder.
///
/// # Errors
/// If the file cannot be made.
pub fn take(path: &Path) -> io::Result<Asked> {
    let mut open = OpenOptions::new();
    let mut file = open
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .open(path)?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => {
            let mut text = String::new();
            // Some systems let nobody read a locked file.
            let _ = file.read_to_string(&mut text);
            Ok(Asked::Elsewhere(text.trim().parse().ok()))
        }
        Ok(()) | Err(TryLockError::Error(_)) => {
            // The number is for people; the lock holds without it.
            let _ = file
                .set_len(0)
                .and_then(|()| writeln!(file, "{}", std::process::id()));
            Ok(Asked::Taken(Lock { file }))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_is_held_once_and_goes_with_its_owner() {
        let path = std::env::temp_dir().join(format!("grainwake-lock-{}", std::process::id()));
        let Asked::Taken(first) = take(&path).unwrap() else {
            panic!("nobody has it");
        };
        let second = take(&path).unwrap();
        assert!(matches!(second, Asked::Elsewhere(_)), "{second:?}");
        drop(first);
        assert!(matches!(take(&path).unwrap(), Asked::Taken(_)));
        std::fs::remove_file(path).unwrap();
    }
}
