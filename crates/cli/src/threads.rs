//! The thread pool of a command.

use crate::exit::Exit;
use crate::tell;

/// Returns the number of threads; unless `quiet`, warns if it is reduced.
pub fn resolve(threads: usize, quiet: bool) -> usize {
    grainwake_run::threads::resolve(threads, |text| {
        if !quiet {
            warn(text);
        }
    })
}

/// Returns the number of simultaneous runs and the threads of each; warns if they are reduced.
pub fn share(jobs: usize, threads: usize) -> (usize, usize) {
    grainwake_run::threads::share(jobs, threads, warn)
}

/// Limits the threads that commands without `--threads` start by `RAYON_NUM_THREADS`.
pub fn limit_default_pool() {
    if std::env::var_os("RAYON_NUM_THREADS").is_some() {
        // Fails only if the pool exists already.
        let _ = rayon::ThreadPoolBuilder::new()
            .num_threads(grainwake_run::threads::resolve(0, |_| {}))
            .build_global();
    }
}

fn warn(text: String) {
    tell!("warning: {text}");
}

/// Runs `work` on this many threads.
pub fn on<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T, Exit> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| {
        Exit::refused(
            format!("cannot start {threads} threads: {error}"),
            "use fewer threads (--threads N)",
        )
    })?;
    Ok(pool.install(work))
}
