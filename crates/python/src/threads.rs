//! Thread pools: one for each simulation and run, and one for all other work.

use std::sync::{Arc, Mutex, PoisonError};

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

/// Pool of all work outside of simulations and runs, with the process that made it. A process made
/// by `fork` has no threads of its parent: the global pool of rayon would never answer there.
static COMMON: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Returns the pool of this process for work outside of simulations and runs, with all cores.
fn common() -> PyResult<Arc<ThreadPool>> {
    let process = std::process::id();
    let mut common = COMMON.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((owner, pool)) = &*common
        && *owner == process
    {
        return Ok(pool.clone());
    }
    let own = pool(0)?;
    // The threads of a parent process cannot be ended here.
    std::mem::forget(common.replace((process, own.clone())));
    Ok(own)
}

/// Does work outside of simulations and runs on the common threads, without the lock of Python.
pub fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let pool = common()?;
    Ok(py.detach(|| pool.install(work)))
}

/// Returns the work on the common threads, for a thread of its own.
pub fn on_common<T: Send>(work: impl FnOnce() -> T + Send) -> PyResult<impl FnOnce() -> T + Send> {
    let pool = common()?;
    Ok(move || pool.install(work))
}
