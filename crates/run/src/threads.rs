//! Number of threads.

/// Most threads per core: more only slow a machine down.
const MOST_PER_CORE: usize = 4;

/// Returns the number of threads, and a warning if `threads` are too many for this machine.
///
/// 0 stands for `RAYON_NUM_THREADS` or all cores. Numbers beyond four threads per core are reduced
/// to that.
pub fn resolve(threads: usize) -> (usize, Option<String>) {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let from_environment =
        std::env::var("RAYON_NUM_THREADS").ok().and_then(|n| n.parse().ok()).filter(|n| *n > 0);
    let wanted = if threads > 0 { threads } else { from_environment.unwrap_or(cores) };
    let most = MOST_PER_CORE * cores;
    let warning = (wanted > most).then(|| {
        format!(
            "{wanted} threads are too many for {cores} cores: {most} are used; results do not \
             depend on the number"
        )
    });
    (wanted.min(most), warning)
}
