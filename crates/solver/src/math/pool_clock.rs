//! CPU clocks of the threads of a pool. The clock of the process would also count other
//! simulations, such as the runs of a study that are computed at the same time.

use std::time::Duration;

thread_local! {
    /// Clocks of the threads of the pool of this thread, and its own.
    static CLOCKS: Vec<libc::clockid_t> = {
        let of_pool = rayon::broadcast(|_| own_clock());
        let mut clocks: Vec<_> = of_pool.into_iter().flatten().collect();
        if rayon::current_thread_index().is_none() {
            clocks.extend(own_clock());
        }
        clocks
    };
}

/// CPU clock of this thread.
fn own_clock() -> Option<libc::clockid_t> {
    let mut clock = 0;
    // SAFETY: `pthread_self` is a running thread and `clock` is valid for the write.
    let failed = unsafe { libc::pthread_getcpuclockid(libc::pthread_self(), &mut clock) };
    (failed == 0).then_some(clock)
}

fn read(clock: libc::clockid_t) -> Duration {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is valid for the write. The clock of a thread that has ended is an error.
    let failed = unsafe { libc::clock_gettime(clock, &mut time) };
    if failed != 0 {
        return Duration::ZERO;
    }
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// CPU time of all threads of the pool so far.
pub fn pool_cpu_time() -> Option<Duration> {
    CLOCKS
        .with(|clocks| (!clocks.is_empty()).then(|| clocks.iter().map(|clock| read(*clock)).sum()))
}
