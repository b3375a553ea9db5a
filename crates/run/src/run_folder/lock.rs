//! Locks: one program at a time writes into a folder. The operating system releases a lock when its
//! program ends, also after a crash.

use std::fs::{OpenOptions, TryLockError};
use std::io::{self, Read, Write};
use std::path::Path;

use grainwake_formats::disk::Output;

/// Name of the lock in a run folder.
pub const FILE: &str = "run.lock";

/// File that is locked during the life of this value.
#[derive(Debug)]
pub struct Lock {
    file: Output,
}

impl Drop for Lock {
    fn drop(&mut self) {
        // The file is kept: another program may have opened it to try the lock.
        let _ = self.file.set_len(0);
    }
}

/// Result of trying a lock.
#[derive(Debug)]
pub enum Attempt {
    /// This program holds the lock.
    Acquired(Lock),
    /// Another program holds it; with its process number, if readable.
    HeldByOther(Option<u32>),
}

/// Tries to lock a file, which is created if absent; does not wait.
///
/// On a file system without locks every attempt succeeds.
///
/// # Errors
/// If the file cannot be created.
pub fn acquire(path: &Path) -> io::Result<Attempt> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    let mut file = Output::open(path, &options)?;
    match file.file().try_lock() {
        Err(TryLockError::WouldBlock) => {
            let mut text = String::new();
            // Some systems forbid reading a locked file.
            let _ = file.file().read_to_string(&mut text);
            Ok(Attempt::HeldByOther(text.trim().parse().ok()))
        }
        Ok(()) | Err(TryLockError::Error(_)) => {
            // The process number is information for users only.
            let _ = file.set_len(0).and_then(|()| writeln!(file, "{}", std::process::id()));
            Ok(Attempt::Acquired(Lock { file }))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_is_exclusive_and_released_on_drop() {
        let path = std::env::temp_dir().join(format!("grainwake-lock-{}", std::process::id()));
        let Attempt::Acquired(first) = acquire(&path).unwrap() else {
            panic!("the lock is free");
        };
        let second = acquire(&path).unwrap();
        assert!(matches!(second, Attempt::HeldByOther(_)), "{second:?}");
        drop(first);
        assert!(matches!(acquire(&path).unwrap(), Attempt::Acquired(_)));
        std::fs::remove_file(path).unwrap();
    }
}
