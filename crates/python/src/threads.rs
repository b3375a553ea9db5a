//! The thread pool of a simulation or a run.

use std::sync::Arc;

use rayon::ThreadPool;

use crate::error::input;

/// Returns the number of threads; 0 stands for `RAYON_NUM_THREADS` or all cores.
pub fn resolve(threads: usize) -> usize {
    if threads > 0 {
        return threads;
    }
    let from_environment =
        std::env::var("RAYON_NUM_THREADS").ok().and_then(|n| n.parse().ok()).filter(|n| *n > 0);
    from_environment.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from))
}

/// Starts a pool of this many threads.
pub fn pool(threads: usize) -> pyo3::PyResult<Arc<ThreadPool>> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let refused = |error| input(format!("cannot start {threads} threads: {error}; use fewer"));
    pool.map(Arc::new).map_err(refused)
}
