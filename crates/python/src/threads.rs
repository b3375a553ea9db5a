//! The thread pool of a simulation or a run.

use std::sync::Arc;

use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::error::{input, warn};

/// Returns the number of threads; gives a `CaseWarning` if it is reduced.
pub fn resolve(py: Python<'_>, threads: usize) -> PyResult<usize> {
    let mut warning = None;
    let threads = grainwake_run::threads::resolve(threads, |text| warning = Some(text));
    warn(py, warning).map(|()| threads)
}

/// Returns the number of simultaneous runs of a study and the threads of each; gives a
/// `CaseWarning` if they are reduced.
pub fn share(py: Python<'_>, jobs: usize, threads: usize) -> PyResult<(usize, usize)> {
    let mut warning = None;
    let shares = grainwake_run::threads::share(jobs, threads, |text| warning = Some(text));
    warn(py, warning).map(|()| shares)
}

/// Starts a pool of this many threads.
pub fn pool(threads: usize) -> PyResult<Arc<ThreadPool>> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let refused = |error| input(format!("cannot start {threads} threads: {error}; use fewer"));
    pool.map(Arc::new).map_err(refused)
}
