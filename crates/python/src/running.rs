//! Runs and studies on threads of their own, while the thread of Python handles signals and shows
//! the progress.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use grainwake_formats::events::Event;
use grainwake_formats::summary::Summary;
use grainwake_run::case::{Case, find_parent};
use grainwake_run::number_format::quantity;
use grainwake_run::{Ending, Existing, Observer, Options, Parent, Progress};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::{Raise, input, numerics, warn};
use crate::threads;

/// Interval at which signals are handled and the progress is shown.
const INTERVAL: Duration = Duration::from_millis(50);

/// Returns the treatment of a run in the folder.
pub fn existing(resume: bool, force: bool) -> PyResult<Existing> {
    match (resume, force) {
        (true, true) => {
            Err(input("resume continues a run and force replaces it: give one of them"))
        }
        (true, _) => Ok(Existing::Resume),
        (_, true) => Ok(Existing::Replace),
        _ => Ok(Existing::Refuse),
    }
}

/// Runs `work` on another thread and calls `show` at intervals; the first exception of `show` or of
/// a signal handler sets `stop` and is returned after the end of `work`.
pub fn attended<T: Send>(
    py: Python<'_>,
    stop: &AtomicBool,
    work: impl FnOnce() -> T + Send,
    mut show: impl FnMut(Python<'_>) -> PyResult<()>,
) -> PyResult<(T, Option<PyErr>)> {
    std::thread::scope(|scope| {
        let (sender, receiver) = mpsc::channel();
        let worker = scope.spawn(move || {
            let result = work();
            // The receiver is gone only if the thread of Python has panicked.
            let _ = sender.send(());
            result
        });
        let receiver = Mutex::new(receiver);
        let mut raised = None;
        let wait = || {
            let receiver = receiver.lock().unwrap_or_else(PoisonError::into_inner);
            receiver.recv_timeout(INTERVAL)
        };
        while py.detach(wait) == Err(RecvTimeoutError::Timeout) {
            let attended = py.check_signals().and_then(|()| show(py));
            if let (Err(error), None) = (attended, &raised) {
                stop.store(true, Ordering::Relaxed);
                raised = Some(error);
            }
        }
        let failed = |_| numerics("internal error of the program: please report it with the case");
        let result = worker.join().map_err(failed)?;
        if raised.is_none() {
            show(py)?;
        }
        Ok((result, raised))
    })
}

/// Runs `work` on the common threads, and sets its flag if a signal handler raises an exception.
pub fn interruptible<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&AtomicBool) -> T + Send,
) -> PyResult<T> {
    let stop = AtomicBool::new(false);
    let work = threads::on_common(|| work(&stop))?;
    match attended(py, &stop, work, |_| Ok(()))? {
        (result, None) => Ok(result),
        (_, Some(error)) => Err(error),
    }
}

/// State of a run that its thread shares with that of Python.
#[derive(Default)]
struct Shared {
    progress: Option<Progress>,
    messages: Vec<String>,
}

/// Observer on the thread of the run.
struct Relay<'a> {
    shared: &'a Mutex<Shared>,
    stop: Arc<AtomicBool>,
}

impl Relay<'_> {
    fn update(&self, change: impl FnOnce(&mut Shared)) {
        change(&mut self.shared.lock().unwrap_or_else(PoisonError::into_inner));
    }
}

impl Observer for Relay<'_> {
    fn progress(&mut self, progress: &Progress) {
        self.update(|shared| shared.progress = Some(*progress));
    }
    fn event(&mut self, event: &Event) {
        let grains: Vec<String> = event.grains.iter().map(usize::to_string).collect();
        let text =
            format!("t {:.4} s  {} (grain {})", event.time, event.kind.name(), grains.join(", "));
        self.update(|shared| shared.messages.push(text));
    }
    fn note(&mut self, text: &str) {
        self.update(|shared| shared.messages.push(text.to_owned()));
    }
    fn interrupted(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

fn as_dict<'py>(py: Python<'py>, p: &Progress) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("time", p.time)?;
    dict.set_item("end", p.end)?;
    dict.set_item("start", p.from)?;
    dict.set_item("steps", p.steps)?;
    dict.set_item("wall_s", p.wall_s)?;
    dict.set_item("dt", p.dt)?;
    dict.set_item("gap", p.gap)?;
    dict.set_item("phase", p.phase.map(|phase| phase.name()))?;
    dict.set_item("contacts", p.contacts)?;
    Ok(dict)
}

/// Finds the checkpoint that `from`, "DIR" or "DIR@TIME", names, and checks that the case can start
/// from it.
pub fn parent(py: Python<'_>, case: &Case, from: &Path) -> PyResult<Parent> {
    let text = from
        .to_str()
        .ok_or_else(|| input(format!("start_from: {} is not UTF-8", from.display())))?;
    let mut notes = Vec::new();
    let found = find_parent(text, &mut |note| notes.push(note.to_owned())).raise()?;
    case.check_parent(&found).raise()?;
    warn(py, notes)?;
    Ok(found)
}

/// Refuses a value of the argument `progress` of another kind.
pub fn check_progress(py: Python<'_>, progress: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
    py.import("grainwake._progress")?.call_method1("check", (progress,)).map(drop)
}

/// Runs a case in a folder, from a checkpoint of the parent if there is one.
pub fn run(
    py: Python<'_>,
    case: &Case,
    folder: &Path,
    existing: Existing,
    parent: Option<Parent>,
    threads: usize,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Summary> {
    check_progress(py, progress)?;
    let job = case.job_in(folder, existing).raise()?;
    let pool = threads::pool(threads)?;
    let (shared, stop) = (Mutex::new(Shared::default()), Arc::new(AtomicBool::new(false)));
    let options =
        Options { existing, command: command(py)?, threads, parent, controlled_from: None };
    let display = py.import("grainwake._progress")?.call_method1("of_run", (progress,))?;
    let warnings = threads::detached(py, || case.estimate(threads))?.warnings;
    display.call_method1("warn", (warnings,))?;
    let work = || {
        let mut relay = Relay { shared: &shared, stop: stop.clone() };
        pool.install(|| grainwake_run::run(job, folder, &options, &mut relay))
    };
    let show = |py: Python<'_>| -> PyResult<()> {
        let (progress, messages) = {
            let mut shared = shared.lock().unwrap_or_else(PoisonError::into_inner);
            (shared.progress, std::mem::take(&mut shared.messages))
        };
        let progress = progress.map(|p| as_dict(py, &p)).transpose()?;
        display.call_method1("update", (progress, messages)).map(drop)
    };
    let ended = attended(py, &stop, work, show);
    display.call_method0("close")?;
    let (ending, raised) = ended?;
    match (ending.raise()?, raised) {
        (_, Some(error)) => Err(error),
        (Ending::Finished(summary) | Ending::AlreadyFinished(summary), None) => Ok(summary),
        (Ending::Interrupted(time), None) => {
            Err(PyKeyboardInterrupt::new_err(format!("interrupted at t = {}", quantity(time, "s"))))
        }
    }
}

/// Returns the command line of Python, for the provenance.
pub fn command(py: Python<'_>) -> PyResult<Vec<String>> {
    py.import("sys")?.getattr("orig_argv")?.extract()
}
