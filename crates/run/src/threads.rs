//! Number of threads of a run and of a study.

/// Most threads per core: more only slow a machine down.
const MOST_PER_CORE: usize = 4;

/// Returns the number of threads; 0 stands for `RAYON_NUM_THREADS` or all cores. Numbers beyond
/// four threads per core are reduced to that with a warning.
pub fn resolve(threads: usize, warn: impl FnOnce(String)) -> usize {
    let cores = cores();
    let from_environment =
        std::env::var("RAYON_NUM_THREADS").ok().and_then(|n| n.parse().ok()).filter(|n| *n > 0);
    let wanted = if threads > 0 { threads } else { from_environment.unwrap_or(cores) };
    let most = MOST_PER_CORE * cores;
    if wanted > most {
        warn(format!(
            "{wanted} threads are too many for {cores} cores: {most} are used; results do not depend on the number"
        ));
    }
    wanted.min(most)
}

/// Returns how many runs of a study execute at once and the number of threads of each, where
/// `jobs` runs with `threads` threads were asked for. 0 threads share all cores among the jobs.
/// Together they have at most four threads per core; larger numbers are reduced with a warning.
pub fn share(jobs: usize, threads: usize, warn: impl FnOnce(String)) -> (usize, usize) {
    let (cores, jobs) = (cores(), jobs.max(1));
    let each = if threads > 0 { threads } else { (resolve(0, |_| {}) / jobs).max(1) };
    let most = MOST_PER_CORE * cores;
    if jobs.saturating_mul(each) <= most {
        return (jobs, each);
    }
    let fewer = jobs.min(most);
    let shared = each.min(most / fewer);
    warn(format!(
        "{jobs} at once with {each} threads each are too many for {cores} cores: {fewer} at once with {shared} are used; results do not depend on the numbers"
    ));
    (fewer, shared)
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jobs_and_threads_have_a_common_limit() {
        let most = MOST_PER_CORE * cores();
        let share = |jobs, threads| {
            let mut warned = false;
            let (jobs, threads) = share(jobs, threads, |_| warned = true);
            (jobs, threads, warned)
        };
        assert_eq!(share(1, most), (1, most, false));
        assert_eq!(share(most, 1), (most, 1, false));
        assert_eq!(share(1, 5000), (1, most, true));
        assert_eq!(share(2, most), (2, most / 2, true));
        assert_eq!(share(5000, 0), (most, 1, true));
        assert_eq!(share(usize::MAX, usize::MAX), (most, 1, true));
        assert_eq!(share(0, 1), (1, 1, false));
    }
}
