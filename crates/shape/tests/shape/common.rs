//! Helpers of several tests.

use std::path::{Path, PathBuf};

/// Returns a path in the folder of shared data: `GRAINWAKE_SHARED`, or `shared` beside the
/// workspace. Prints a notice and returns `None` if it does not exist.
pub fn shared(below: &str) -> Option<PathBuf> {
    let root = std::env::var_os("GRAINWAKE_SHARED").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"),
        PathBuf::from,
    );
    let path = root.join(below);
    if path.exists() {
        return Some(path);
    }
    eprintln!("SKIPPED: {} is absent (set GRAINWAKE_SHARED)", path.display());
    None
}

/// Asserts that the relative error of `found` is at most `relative`.
#[track_caller]
pub fn close(found: f64, exact: f64, relative: f64) {
    let error = found / exact - 1.0;
    assert!(error.abs() <= relative, "{found} for {exact}: off by {error:.5}");
}
