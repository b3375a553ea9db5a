//! Progress of a study on standard error: one bar per active run and one for the study.

use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use grainwake_formats::events::{Event, EventKind};
use grainwake_run::Progress;
use grainwake_study::{Outcome, Run, StudyObserver};
use indicatif::{MultiProgress, ProgressBar};

use crate::progress::{TICKS, bar, clock, first_line};
use crate::tell;

/// Interval between lines without a terminal [s].
const LINE_INTERVAL: f64 = 60.0;

/// Progress display of a study.
pub struct Board<'a> {
    runs: &'a [Run],
    total: usize,
    jobs: usize,
    quiet: bool,
    stop: Arc<AtomicBool>,
    bars: Option<MultiProgress>,
    inner: Mutex<Inner>,
}

struct Inner {
    started: Instant,
    last_line: Instant,
    /// Active runs.
    active: BTreeMap<usize, Active>,
    /// Runs not yet started, with their latest end [s].
    waiting: BTreeMap<usize, f64>,
    ended: usize,
    /// Time simulated by the runs that ended in this session [s].
    simulated: f64,
    /// Ends of the runs that finished in this session [s].
    ends: Vec<f64>,
    whole: Option<ProgressBar>,
}

struct Active {
    bar: Option<ProgressBar>,
    time: f64,
    from: f64,
    end: f64,
    doing: &'static str,
}

impl<'a> Board<'a> {
    /// Creates a display of the chosen runs of a plan.
    pub fn new(
        runs: &'a [Run],
        chosen: &[usize],
        jobs: usize,
        quiet: bool,
        stop: Arc<AtomicBool>,
    ) -> Board<'a> {
        let bars = (!quiet && std::io::stderr().is_terminal()).then(MultiProgress::new);
        let whole = bars.as_ref().map(|bars| bars.add(bar("green")));
        Board {
            runs,
            total: chosen.len(),
            jobs,
            quiet,
            stop,
            bars,
            inner: Mutex::new(Inner {
                started: Instant::now(),
                last_line: Instant::now(),
                active: BTreeMap::new(),
                waiting: chosen.iter().map(|i| (*i, runs[*i].end_s)).collect(),
                ended: 0,
                simulated: 0.0,
                ends: Vec::new(),
                whole,
            }),
        }
    }

    /// Removes the bars.
    pub fn clear(&self) {
        if let Some(bars) = &self.bars {
            // A failure means that the terminal has been closed.
            let _ = bars.clear();
        }
    }

    fn line(&self, text: &str) {
        match &self.bars {
            Some(bars) => {
                let _ = bars.println(text);
            }
            None => tell!("{text}"),
        }
    }

    fn with<T>(&self, what: impl FnOnce(&mut Inner) -> T) -> Option<T> {
        self.inner.lock().ok().map(|mut inner| what(&mut inner))
    }
}

impl Inner {
    /// Returns the completed fraction of the study and the remaining wall-clock time [s], from the
    /// time that remains to be simulated and the rate so far.
    fn whole(&self, total: usize, jobs: usize) -> (f64, f64) {
        let typical =
            (!self.ends.is_empty()).then(|| self.ends.iter().sum::<f64>() / self.ends.len() as f64);
        let expected = |end: f64| typical.map_or(end, |t| t.min(end));
        let running: f64 = self.active.values().map(|a| a.time - a.from).sum();
        let left_running: f64 =
            self.active.values().map(|a| (expected(a.end) - a.time).max(0.02 * a.end)).sum();
        let left_waiting: f64 = self.waiting.values().map(|end| expected(*end)).sum();
        let simulated = self.simulated + running;
        let rate = simulated / self.started.elapsed().as_secs_f64().max(1e-9);
        // At the end there are fewer runs than jobs: the last run has only its share of the rate.
        let busy = self.active.len().clamp(1, jobs) as f64;
        let last = self.active.values().map(|a| expected(a.end) - a.time).fold(0.0, f64::max);
        let left = ((left_running + left_waiting) / rate).max(last * busy / rate);
        let done: f64 = self.active.values().map(|a| (a.time / expected(a.end)).min(1.0)).sum();
        ((self.ended as f64 + done) / total.max(1) as f64, left)
    }
}

impl StudyObserver for Board<'_> {
    fn started(&self, run: usize) {
        let name = &self.runs[run].name;
        let bar = self.bars.as_ref().map(|bars| {
            let bar = bars.insert_from_back(1, bar("cyan"));
            bar.set_message(name.clone());
            bar
        });
        self.with(|inner| {
            let end = inner.waiting.remove(&run).unwrap_or(self.runs[run].end_s);
            let active = Active { bar, time: 0.0, from: 0.0, end, doing: "starting" };
            inner.active.insert(run, active);
        });
        if !self.quiet && self.bars.is_none() {
            tell!("{name}: started");
        }
    }

    fn progress(&self, run: usize, p: &Progress) {
        if self.quiet {
            return;
        }
        let name = &self.runs[run].name;
        let text = self.with(|inner| {
            let (total, jobs) = (self.total, self.jobs);
            if let Some(active) = inner.active.get_mut(&run) {
                (active.time, active.from) = (p.time, p.from);
                active.doing = p.phase.map_or("settling", |phase| phase.name());
                if let Some(bar) = &active.bar {
                    bar.set_position((p.time / p.end * TICKS as f64) as u64);
                    let rate = p.session_steps as f64 / p.wall_s.max(1e-9);
                    bar.set_message(format!(
                        "{name}  t {:.3} / {:.3} s  {rate:.1} steps/s  {}",
                        p.time, p.end, active.doing
                    ));
                }
            }
            let (done, left) = inner.whole(total, jobs);
            let text = format!("{} of {total} done, ETA {}", inner.ended, clock(left));
            if let Some(whole) = &inner.whole {
                whole.set_position((done * TICKS as f64) as u64);
                whole.set_message(text);
                return None;
            }
            if inner.last_line.elapsed().as_secs_f64() < LINE_INTERVAL {
                return None;
            }
            inner.last_line = Instant::now();
            let each = inner
                .active
                .iter()
                .map(|(i, a)| format!("{} t {:.3} s {}", self.runs[*i].name, a.time, a.doing));
            Some(format!("{:3.0} %  {text}; {}", 100.0 * done, each.collect::<Vec<_>>().join("; ")))
        });
        if let Some(text) = text.flatten() {
            self.line(&text);
        }
    }

    fn event(&self, run: usize, event: &Event) {
        let shown = event.kind != EventKind::Landing && event.wall.is_none();
        if !self.quiet && shown {
            self.line(&format!(
                "{}: t {:.4} s  {}",
                self.runs[run].name,
                event.time,
                event.kind.name()
            ));
        }
    }

    fn note(&self, run: usize, text: &str) {
        if !self.quiet || text.starts_with("warning") {
            self.line(&format!("{}: {text}", self.runs[run].name));
        }
    }

    fn ended(&self, run: usize, outcome: &Outcome) {
        let text = self.with(|inner| {
            inner.waiting.remove(&run);
            inner.ended += usize::from(!matches!(outcome, Outcome::Interrupted | Outcome::Locked));
            if let Some(active) = inner.active.remove(&run) {
                if let (Some(bar), Some(bars)) = (&active.bar, &self.bars) {
                    bar.finish_and_clear();
                    bars.remove(bar);
                }
                inner.simulated += active.time - active.from;
                if let Outcome::Finished(summary) = outcome {
                    inner.ends.push(summary.end_time_s);
                }
            }
            let (_, left) = inner.whole(self.total, self.jobs);
            let eta = if inner.active.is_empty() && inner.waiting.is_empty() {
                String::new()
            } else {
                format!(", ETA {}", clock(left))
            };
            format!("[{}/{}{eta}]", inner.ended, self.total)
        });
        if self.quiet {
            return;
        }
        let how = match outcome {
            Outcome::Finished(s) => format!(
                "finished at t = {:.4} s ({}) in {}",
                s.end_time_s,
                s.ended_by,
                clock(s.cost.wall_s)
            ),
            Outcome::AlreadyFinished => "had finished before".into(),
            Outcome::Failed(why, _) => format!("FAILED: {}", first_line(why)),
            Outcome::Interrupted => "interrupted".into(),
            Outcome::Locked => "locked by another program".into(),
        };
        self.line(&format!("{}: {how} {}", self.runs[run].name, text.unwrap_or_default()));
    }

    fn interrupted(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
