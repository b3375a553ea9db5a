//! Progress of a run on standard error: a bar on a terminal, otherwise a line at intervals.

use std::io::IsTerminal;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use grainwake_formats::events::Event;
pub use grainwake_run::number_format::count;
use grainwake_run::{Ending, Job, Observer, Options, Progress, RunError};
use indicatif::{ProgressBar, ProgressStyle};

use crate::exit::Exit;
use crate::{tell, threads};

/// Interval of the lines without a terminal [s].
const LINE_INTERVAL: f64 = 10.0;
/// Steps of a bar.
pub const TICKS: u64 = 10_000;

/// Progress display of a run.
struct ProgressDisplay {
    bar: Option<ProgressBar>,
    quiet: bool,
    last_line: Instant,
    stop: Arc<AtomicBool>,
    /// Unit of displayed gaps [m].
    diameter: Option<f64>,
}

impl ProgressDisplay {
    /// Creates a display that stops the run when `stop` is set; gaps are shown in units of
    /// `diameter` [m].
    fn new(quiet: bool, stop: Arc<AtomicBool>, diameter: Option<f64>) -> ProgressDisplay {
        let bar = (!quiet && std::io::stderr().is_terminal()).then(|| bar("cyan"));
        ProgressDisplay { bar, quiet, last_line: Instant::now(), stop, diameter }
    }

    /// Removes the bar.
    fn clear(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    fn line(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.println(text),
            None => tell!("{text}"),
        }
    }

    fn describe(&self, p: &Progress) -> String {
        let rate = p.session_steps as f64 / p.wall_s.max(1e-9);
        let left = p.wall_s * (p.end - p.time) / (p.time - p.from).max(1e-300);
        let mut text = format!(
            "t {:.4} / {:.4} s  step {}  {}  ETA {}",
            p.time,
            p.end,
            p.steps,
            per_second(rate),
            clock(left)
        );
        if let (Some(gap), Some(phase)) = (p.gap, p.phase) {
            let gap = self
                .diameter
                .map_or(format!("{:.3} mm", 1e3 * gap), |d| format!("{:.2} d", gap / d));
            text += &format!("  gap {gap}  {}", phase.name());
        } else if p.contacts > 0 {
            text += &format!("  {}", count(p.contacts, "contact"));
        }
        text
    }
}

/// Runs a job with a progress display, on the threads of the options, until its end or `stop`.
/// The inner error is that of the run.
pub fn run(
    job: Job,
    out: &Path,
    options: &Options,
    quiet: bool,
    stop: Arc<AtomicBool>,
) -> Result<Result<Ending, RunError>, Exit> {
    let diameter = job.setup.grains.first().map(|grain| grain.shape.equivalent_diameter());
    let mut shown = ProgressDisplay::new(quiet, stop, diameter);
    threads::on(options.threads, || {
        let ending = grainwake_run::run(job, out, options, &mut shown);
        shown.clear();
        ending
    })
}

/// Returns a bar of [`TICKS`] steps with a percentage and a message.
pub fn bar(colour: &str) -> ProgressBar {
    let bar = ProgressBar::new(TICKS);
    let template = format!("{{bar:30.{colour}/blue}} {{percent:>3}} % {{msg}}");
    if let Ok(style) = ProgressStyle::with_template(&template) {
        bar.set_style(style.progress_chars("━╸─"));
    }
    bar
}

fn per_second(rate: f64) -> String {
    if rate >= 1.0 {
        format!("{rate:.1} steps/s")
    } else {
        format!("{:.1} s/step", 1.0 / rate.max(1e-9))
    }
}

/// Returns the first line of a message.
pub fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or_default()
}

/// Formats a duration [s] as "1:02:03" or "2:03".
pub fn clock(seconds: f64) -> String {
    if !(seconds.is_finite() && seconds < 1e9) {
        return "?".into();
    }
    let s = seconds.round() as u64;
    if s >= 3600 {
        format!("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
    } else {
        format!("{}:{:02}", s / 60, s % 60)
    }
}

impl Observer for ProgressDisplay {
    fn progress(&mut self, p: &Progress) {
        if self.quiet {
            return;
        }
        match &self.bar {
            Some(bar) => {
                bar.set_position((p.time / p.end * TICKS as f64) as u64);
                bar.set_message(self.describe(p));
            }
            None if self.last_line.elapsed().as_secs_f64() >= LINE_INTERVAL => {
                self.last_line = Instant::now();
                tell!("{:3.0} %  {}", 100.0 * p.time / p.end, self.describe(p));
            }
            None => {}
        }
    }
    fn event(&mut self, event: &Event) {
        if !self.quiet {
            let grains: Vec<String> = event.grains.iter().map(usize::to_string).collect();
            let wall = event.wall.as_ref().map_or(String::new(), |wall| format!(", {wall} wall"));
            self.line(&format!(
                "t {:.4} s  {} (grain {}{wall})",
                event.time,
                event.kind.name(),
                grains.join(", ")
            ));
        }
    }
    fn note(&mut self, text: &str) {
        // Warnings are printed even with --quiet.
        if !self.quiet || text.starts_with("warning") {
            self.line(text);
        }
    }
    fn interrupted(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::clock;

    #[test]
    fn durations_read_like_a_clock() {
        assert_eq!(clock(61.2), "1:01");
        assert_eq!(clock(3723.0), "1:02:03");
        assert_eq!(clock(f64::INFINITY), "?");
    }
}
