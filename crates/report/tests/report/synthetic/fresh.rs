//! Folders of their own for tests.

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A fresh empty folder.
pub fn folder(name: &str) -> PathBuf {
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let unique =
        format!("grainwake-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
    let unique = std::env::temp_dir().join(unique);
    // Left by an earlier process with the same number.
    let _ = std::fs::remove_dir_all(&unique);
    let path = unique.join(name);
    std::fs::create_dir_all(&path).unwrap();
    path
}
