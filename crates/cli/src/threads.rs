//! The thread pool of a command.

use crate::exit::{BAD_INPUT, Exit};
use crate::tell;

/// Most threads per core: more only slow a machine down.
const MOST_PER_CORE: usize = 4;

/// Returns the number of threads; 0 stands for `RAYON_NUM_THREADS` or all cores. Numbers beyond
/// four threads per core are reduced to that with a warning.
pub fn resolve(threads: usize) -> usize {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let from_environment =
        std::env::var("RAYON_NUM_THREADS").ok().and_then(|n| n.parse().ok()).filter(|n| *n > 0);
    let wanted = if threads > 0 { threads } else { from_environment.unwrap_or(cores) };
    let most = MOST_PER_CORE * cores;
    if wanted > most {
        tell!(
            "warning: {wanted} threads are too many for {cores} cores: {most} are used; results do not depend on the number"
        );
    }
    wanted.min(most)
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
