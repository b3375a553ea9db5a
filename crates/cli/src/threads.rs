//! The thread pool of a command.

use crate::exit::{BAD_INPUT, Exit};

/// Returns the number of threads; 0 stands for `RAYON_NUM_THREADS` or all cores.
pub fn resolve(threads: usize) -> usize {
    if threads > 0 {
        return threads;
    }
    let from_environment =
        std::env::var("RAYON_NUM_THREADS").ok().and_then(|n| n.parse().ok()).filter(|n| *n > 0);
    from_environment.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from))
}

/// Runs `work` on this many threads.
pub fn on<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T, Exit> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| {
        Exit::with_help(
            BAD_INPUT,
            format!("cannot start {threads} threads: {error}"),
            "use fewer threads (--threads N)",
        )
    })?;
    Ok(pool.install(work))
}
