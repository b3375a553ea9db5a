//! Computing time of a session.

use grainwake_formats::summary::{Cost, PassTime};
use grainwake_solver::math::{Stopwatch, TimeSpent};
use grainwake_solver::sim::Simulation;

/// Stopwatch of a session.
pub struct Meter {
    session: Stopwatch,
    /// Tables, VTK files and checkpoints.
    output: TimeSpent,
}

impl Meter {
    /// Starts the stopwatch.
    pub fn start() -> Meter {
        Meter { session: Stopwatch::start(), output: TimeSpent::default() }
    }

    /// Runs `write` and counts its time as that of outputs.
    pub fn output<T>(&mut self, write: impl FnOnce() -> T) -> T {
        let start = Stopwatch::start();
        let result = write();
        self.output += start.elapsed();
        result
    }

    /// Returns the wall-clock time of the session [s].
    pub fn wall_s(&self) -> f64 {
        self.session.wall().as_secs_f64()
    }

    /// Returns the time of the session and of its passes.
    pub fn cost(&self, sim: &Simulation) -> Cost {
        let total = self.session.elapsed();
        let mut passes = sim.pass_times();
        passes.push(("output", self.output));
        let named = passes.iter().fold(TimeSpent::default(), |sum, (_, time)| sum + *time);
        passes.push(("other", total - named));
        let seconds =
            |time: TimeSpent| (time.wall.as_secs_f64(), time.cpu.map(|t| t.as_secs_f64()));
        let passes = passes.into_iter().map(|(name, time)| {
            let (wall_s, cpu_s) = seconds(time);
            PassTime { name: name.into(), wall_s, cpu_s }
        });
        let (wall_s, cpu_s) = seconds(total);
        Cost { wall_s, cpu_s, passes: passes.collect() }
    }
}
