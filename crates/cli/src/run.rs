//! `grainwake run`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use grainwake_formats::summary::Summary;
use grainwake_run::case::{Case, Problem, Verdict, find_parent};
use grainwake_run::number_format::quantity;
use grainwake_run::{Ending, Existing, Options, RESOLVED};

use crate::args::{self, RunArgs};
use crate::exit::{Exit, INTERRUPTED, MISSED};
use crate::out::shell_word;
use crate::progress::{self, count};
use crate::{check, expect, kind, print, signals, tell, threads};

/// Runs a case.
pub fn run(args: &RunArgs) -> Result<(), Exit> {
    let case = kind::case(&args.case, &args.overrides)?;
    let out = args.output.clone().unwrap_or_else(|| default_folder(&args.case));
    let threads = threads::resolve(args.threads.unwrap_or(case.threads), args.quiet);
    let existing = match (args.resume, args.resume_or_start, args.force) {
        (true, ..) => Existing::Resume,
        (_, true, _) => Existing::ResumeOrStart,
        (.., true) => Existing::Replace,
        _ => Existing::Refuse,
    };
    let mut parent = None;
    if let Some(text) = &args.from {
        let found = find_parent(text, &mut |note| tell!("{note}"))?;
        case.check_parent(&found)?;
        parent = Some(found);
    }
    let command = args::words();
    let options = Options { existing, command, threads, parent, ..Options::default() };
    let stop = Arc::new(AtomicBool::new(false));
    signals::watch_for_interrupt(stop.clone());
    if !args.quiet {
        let cells = case.setup.mesh.cells;
        let what = if case.setup.fluid.is_some() {
            format!("{} x {} x {} cells", cells[0], cells[1], cells[2])
        } else {
            "dry".into()
        };
        tell!(
            "{}: {}, {what}, {} -> {}",
            args.case.display(),
            count(case.setup.grains.len(), "grain"),
            count(threads, "thread"),
            out.display()
        );
        check::warnings(&case.estimate(threads)).for_each(|w| tell!("{w}"));
    }
    let job = case.job_in(&out, existing)?;
    let ending = progress::run(job, &out, &options, args.quiet, stop.clone())??;
    if !matches!(ending, Ending::Interrupted(_)) {
        signals::results_are_complete();
    }
    match ending {
        Ending::Interrupted(time) => {
            let message =
                format!("interrupted at t = {}; a checkpoint was written", quantity(time, "s"));
            Err(Exit::with_help(
                INTERRUPTED,
                message,
                format!(
                    "continue with: grainwake run {} --resume{}",
                    shell_word(&out.join(RESOLVED)),
                    args.threads.map_or(String::new(), |n| format!(" --threads {n}"))
                ),
            ))
        }
        Ending::AlreadyFinished(summary) => {
            if !args.quiet {
                tell!("the run has already finished");
            }
            if !args.no_report && !out.join("report.html").exists() {
                draw(args, &out, &stop);
            }
            conclude(args, &case, &summary, &out)
        }
        Ending::Finished(summary) => {
            if !args.no_report {
                draw(args, &out, &stop);
            } else if !args.quiet && out.join("report.html").exists() {
                tell!(
                    "note: report.html shows an earlier state of the run; draw it again with \
                     `grainwake report {}`",
                    out.display()
                );
            }
            conclude(args, &case, &summary, &out)
        }
    }
}

/// Writes the report, unless or until an interrupt sets `stop`. The run is valid without it, so
/// an error is only noted.
fn draw(args: &RunArgs, out: &Path, stop: &AtomicBool) {
    let again = format!("`grainwake report {}`", shell_word(out));
    let (sender, drawn) = mpsc::channel();
    let folder = out.to_owned();
    // After an interrupt the thread ends with the program.
    std::thread::spawn(move || sender.send(grainwake_report::render(&folder)));
    loop {
        if stop.load(Ordering::Relaxed) {
            tell!("interrupted: the run is complete, its report is not; draw it with {again}");
            return;
        }
        match drawn.recv_timeout(Duration::from_millis(50)) {
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                tell!("note: the report could not be drawn: internal error of the program");
                return;
            }
            Ok(Ok(done)) => {
                if !args.quiet {
                    tell!("report: {}", done.page.display());
                }
                return;
            }
            Ok(Err(error)) => {
                tell!("note: the report could not be drawn: {error}; retry with {again}");
                return;
            }
        }
    }
}

/// Prints the summary and compares it with `[expect]`.
fn conclude(args: &RunArgs, case: &Case, summary: &Summary, out: &Path) -> Result<(), Exit> {
    let verdicts: Vec<Verdict> = case.expect.iter().map(|e| e.judge(summary)).collect();
    if args.json {
        let mut value = serde_json::to_value(summary)?;
        if let Some(object) = value.as_object_mut().filter(|_| !verdicts.is_empty()) {
            object.insert("expect".into(), serde_json::to_value(&verdicts)?);
        }
        print(&value.to_string())?;
    } else if !args.quiet {
        print(&describe(summary, case.setup.fluid.is_some(), out))?;
    }
    if !args.quiet {
        verdicts.iter().for_each(|v| tell!("{}", expect::line(v)));
    }
    let missed: Vec<Problem> = verdicts.iter().filter(|v| !v.pass).map(expect::missed).collect();
    if missed.is_empty() { Ok(()) } else { Err(Exit::problems(MISSED, missed)) }
}

fn describe(s: &Summary, wet: bool, out: &Path) -> String {
    let time = |t: Option<f64>| t.map_or("-".to_string(), |t| format!("{t:.4} s"));
    let mut lines = vec![format!(
        "done at t = {:.4} s ({}) after {} in {}",
        s.end_time_s,
        s.ended_by,
        count(s.steps as usize, "step"),
        progress::clock(s.cost.wall_s)
    )];
    if wet {
        lines[0] += &format!("; largest |div u| {:.1e} 1/s", s.max_divergence);
    }
    if let Some(pair) = &s.pair {
        lines.push(format!(
            "kiss time {}  tumble time {}  separation time {}  role changes {}",
            time(pair.kiss_time_s),
            time(pair.tumble_time_s),
            time(pair.separation_time_s),
            pair.role_changes
        ));
    }
    lines.push(format!("{}", out.display()));
    lines.join("\n")
}

/// Returns the default run folder: `runs/FOLDER` for a `case.toml`, `runs/FOLDER-FILE` for other
/// cases beside it, `runs/FILE` elsewhere, and its own folder for a resolved case.
fn default_folder(case: &Path) -> PathBuf {
    if case.file_name().is_some_and(|name| name == RESOLVED) {
        let folder = case.parent().filter(|folder| !folder.as_os_str().is_empty());
        return folder.unwrap_or(Path::new(".")).into();
    }
    kind::default_folder(case, "case", |folder| folder.join("case.toml").is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn run_folders_are_named_after_their_case() {
        let folder = tempfile::tempdir().unwrap();
        let case = folder.path().join("dkt-pair");
        std::fs::create_dir(&case).unwrap();
        std::fs::write(case.join("case.toml"), "").unwrap();
        assert_eq!(default_folder(&case.join("case.toml")), Path::new("runs/dkt-pair"));
        assert_eq!(default_folder(&case.join("quick.toml")), Path::new("runs/dkt-pair-quick"));
        assert_eq!(default_folder(&folder.path().join("mine.toml")), Path::new("runs/mine"));
        assert_eq!(default_folder(&case.join(RESOLVED)), case);
        assert_eq!(default_folder(Path::new(RESOLVED)), Path::new("."));
    }
}
