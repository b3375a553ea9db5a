//! Wall and CPU time of passes.

use std::ops::{Add, AddAssign, Sub};
use std::time::{Duration, Instant};

#[cfg(all(target_os = "linux", not(miri)))]
use super::pool_clock::pool_cpu_time;

/// Miri and other systems have no clocks of threads.
#[cfg(any(miri, not(target_os = "linux")))]
fn pool_cpu_time() -> Option<Duration> {
    None
}

/// Wall and CPU time spent in a pass.
#[derive(Clone, Copy, Debug, Default)]
pub struct TimeSpent {
    /// Wall time.
    pub wall: Duration,
    /// CPU time of the threads of the pool; `None` where the system has no clocks of threads.
    pub cpu: Option<Duration>,
}

impl Add for TimeSpent {
    type Output = TimeSpent;
    fn add(self, other: TimeSpent) -> TimeSpent {
        // A sum that begins with the default takes the CPU time of the first pass.
        let cpu = self.cpu.map_or(other.cpu, |cpu| Some(cpu + other.cpu.unwrap_or_default()));
        TimeSpent { wall: self.wall + other.wall, cpu }
    }
}

impl AddAssign for TimeSpent {
    fn add_assign(&mut self, other: TimeSpent) {
        *self = *self + other;
    }
}

impl Sub for TimeSpent {
    type Output = TimeSpent;
    /// Difference; negative times count as zero.
    fn sub(self, other: TimeSpent) -> TimeSpent {
        let less = |cpu: Duration| cpu.saturating_sub(other.cpu.unwrap_or_default());
        TimeSpent { wall: self.wall.saturating_sub(other.wall), cpu: self.cpu.map(less) }
    }
}

/// Stopwatch of wall time and of the CPU time of the present thread pool.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    wall: Instant,
    cpu: Option<Duration>,
}

impl Stopwatch {
    /// Starts a stopwatch.
    pub fn start() -> Stopwatch {
        Stopwatch { wall: Instant::now(), cpu: pool_cpu_time() }
    }

    /// Wall time since the start.
    pub fn wall(&self) -> Duration {
        self.wall.elapsed()
    }

    /// Time since the start.
    pub fn elapsed(&self) -> TimeSpent {
        self.until(&Stopwatch::start())
    }

    /// Time between the starts of two stopwatches.
    pub fn until(&self, end: &Stopwatch) -> TimeSpent {
        let cpu = self.cpu.zip(end.cpu).map(|(start, end)| end.saturating_sub(start));
        TimeSpent { wall: end.wall.duration_since(self.wall), cpu }
    }
}

/// Runs `work` and adds the time it takes to `total`.
pub fn timed<T>(total: &mut TimeSpent, work: impl FnOnce() -> T) -> T {
    let start = Stopwatch::start();
    let result = work();
    *total += start.elapsed();
    result
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    /// Computes for some 20 ms of CPU time.
    fn compute() {
        std::hint::black_box((0..20_000_000).fold(0.0, |sum: f64, n| sum + f64::from(n).sqrt()));
    }

    #[test]
    fn cpu_time_is_that_of_the_own_pool() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        let (idle, busy) = pool.install(|| {
            let (mut idle, mut busy) = (TimeSpent::default(), TimeSpent::default());
            timed(&mut busy, || rayon::join(compute, compute));
            timed(&mut idle, || {
                std::thread::scope(|scope| scope.spawn(|| [(); 4].map(|()| compute())).join())
            })
            .unwrap();
            (idle, busy)
        });
        // Wall time depends on other work on the machine, CPU time does not.
        let [idle_cpu, busy_cpu] = [idle, busy].map(|spent| spent.cpu.unwrap());
        assert!(busy_cpu > Duration::from_millis(5) && busy_cpu < 3 * busy.wall, "{busy:?}");
        assert!(idle_cpu < busy_cpu / 2, "{idle:?} {busy:?}");
    }
}
