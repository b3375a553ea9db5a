//! The thread pool of a command.

use crate::exit::{BAD_INPUT, Exit};
use crate::tell;

/// Returns the number of threads; warns if it is reduced.
pub fn resolve(threads: usize) -> usize {
    grainwake_run::threads::resolve(threads, warn)
}

/// Returns the number of simultaneous runs of a study and the threads of each; warns if they are
/// reduced.
pub fn share(jobs: usize, threads: usize) -> (usize, usize) {
    grainwake_run::threads::share(jobs, threads, warn)
}

fn warn(text: String) {
    tell!("warning: {text}");
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
