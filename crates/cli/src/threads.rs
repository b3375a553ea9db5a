//! The thread pool of a command.

use crate::exit::{BAD_INPUT, Exit};
use crate::tell;

/// Returns the number of threads of [`grainwake_run::threads::resolve`]; too many are reduced with
/// a warning.
pub fn resolve(threads: usize) -> usize {
    let (threads, warning) = grainwake_run::threads::resolve(threads);
    if let Some(warning) = warning {
        tell!("warning: {warning}");
    }
    threads
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
