//! The thread pool of a simulation or a run.

use std::sync::Arc;

use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::error::{input, warn};

/// Returns the number of threads of [`grainwake_run::threads::resolve`]; too many are reduced with
/// a `CaseWarning`.
pub fn resolve(py: Python<'_>, threads: usize) -> PyResult<usize> {
    let (threads, warning) = grainwake_run::threads::resolve(threads);
    warn(py, warning)?;
    Ok(threads)
}

/// Starts a pool of this many threads.
pub fn pool(threads: usize) -> PyResult<Arc<ThreadPool>> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let refused = |error| input(format!("cannot start {threads} threads: {error}; use fewer"));
    pool.map(Arc::new).map_err(refused)
}
