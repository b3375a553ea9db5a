//! What several tests need.
#![allow(dead_code)]

use std::path::{Path, PathBuf};

/// The folder of shared data, or none (said loudly) where it is absent: the environment variable
/// `GRAINWAKE_SHARED`, else `shared` beside the workspace.
pub fn shared(below: &str) -> Option<PathBuf> {
    let root = std::env::var_os("GRAINWAKE_SHARED").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"),
        PathBuf::from,
    );
    let path = root.join(below);
    if path.exists() {
        return Some(path);
    }
    eprintln!(
        "SKIPPED: {} is absent (set GRAINWAKE_SHARED)",
        path.display()
    );
    None
}

/// Fails unless `found` is within the share `relative` of `exact`.
#[track_caller]
pub fn close(found: f64, exact: f64, relative: f64) {
    let error = found / exact - 1.0;
    assert!(
        error.abs() <= relative,
        "{found} for {exact}: off by {error:.5}"
    );
}
