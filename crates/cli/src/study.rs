//! `grainwake study`.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use comfy_table::Table;
use grainwake_run::FailureKind;
use grainwake_run::number_format::size;
use grainwake_study::{
    Analysis, Archive, MANIFEST, Options, Outcome, Plan, RESTORE, Run, RunRecord, RunState,
    Selection, StudyError, execute, expected_cost, note_on_unmeasured, one_per_grid, records,
    refuse_to_replace, run_state, time_steps, write_tables,
};

use crate::args::{self, StudyArgs};
use crate::exit::{BAD_INPUT, Exit, INTERRUPTED, IO, exit_code};
use crate::out::markdown;
use crate::progress::{clock, count, first_line};
use crate::study_board::Board;
use crate::{kind, print, signals, tell, threads};

impl From<StudyError> for Exit {
    fn from(error: StudyError) -> Exit {
        match error {
            StudyError::Invalid(problems) => Exit::problems(BAD_INPUT, problems),
            StudyError::Case(error) => error.into(),
            StudyError::Report(error) => error.into(),
            StudyError::NotTimed { kind, .. } => Exit::with_help(
                exit_code(kind),
                error.to_string(),
                "use fewer simultaneous runs (--jobs N), or --dry-run without --measure",
            ),
            StudyError::Occupied { .. } => {
                Exit::refused(error.to_string(), "give another folder with -o")
            }
            StudyError::WouldReplace { .. } => {
                Exit::refused(error.to_string(), "give another folder with -o, or use --force")
            }
            StudyError::Damaged { ref file, .. } => {
                let help = if file.file_name().is_some_and(|name| name == MANIFEST) {
                    "start the study with `grainwake study`: it writes the file again"
                } else {
                    "mend or restore the file, or remove it: the runs whose folders exist are \
                     measured again, the others are repeated"
                };
                Exit::refused(error.to_string(), help)
            }
            StudyError::Io { action, ref source, .. } => {
                use std::io::ErrorKind::{
                    FileTooLarge, InvalidData, InvalidInput, IsADirectory, NotFound,
                };
                let kinds = [NotFound, InvalidData, InvalidInput, IsADirectory, FileTooLarge];
                let bad = action == "read" && kinds.contains(&source.kind());
                let help = if bad {
                    "give the path of a study file, for example studies/dkt-morphology/study.toml"
                } else {
                    "check the folder, its permissions and the free disk space"
                };
                Exit::with_help(if bad { BAD_INPUT } else { IO }, error.to_string(), help)
            }
        }
    }
}

/// Executes a study, or lists its runs.
pub fn study(args: &StudyArgs) -> Result<(), Exit> {
    let study = kind::study(&args.study)?;
    let selection = args.only.as_deref().map_or(Ok(Selection::All), Selection::parse)?;
    let plan = Plan::resolve(&study, &args.overrides.list())?.accepting(&args.accept)?;
    let runs = &plan.runs;
    let chosen = selection.choose(runs)?;
    if let Some(note) = plan.note_on_equal_runs() {
        tell!("note: {note}");
    }
    let folder =
        args.output.clone().unwrap_or_else(|| kind::default_folder(&args.study, "study", |_| true));
    let jobs = args.jobs.clamp(1, chosen.len().max(1));
    let (jobs, each) = threads::share(jobs, args.threads);
    if args.list || args.dry_run {
        plan.check_folder(&folder)?;
        let archive = Archive::read(&folder)?;
        let states: Vec<(usize, RunState)> =
            chosen.iter().map(|i| (*i, run_state(&runs[*i], &folder, &archive))).collect();
        if args.json {
            return print(&serde_json::to_string_pretty(&listed(runs, &states))?);
        }
        if args.list {
            return print(&list(runs, &states));
        }
        return print(&dry_run(args, &plan, &folder, &states, jobs, each)?);
    }
    if let Some(note) = plan.damage_in(&folder) {
        tell!("note: {note}");
    }
    if !args.force {
        plan.check_folder(&folder)?;
        refuse_to_replace(runs, &chosen, &folder)?;
    }
    plan.create_folder(&folder)?;
    let outdated = Archive::read(&folder)?.outdated(runs);
    if outdated > 0 {
        tell!(
            "note: {} in table.json had another case, end or program: their rows move to table.earlier.json (--accept COMMIT counts those of another commit)",
            count(outdated, "finished run")
        );
    }
    let stop = Arc::new(AtomicBool::new(false));
    signals::watch_for_interrupt(stop.clone());
    if !args.quiet {
        tell!(
            "{}: {} of {}, {jobs} at once with {} each -> {}",
            args.study.display(),
            chosen.len(),
            count(runs.len(), "run"),
            count(each, "thread"),
            folder.display()
        );
    }
    let options = Options {
        jobs,
        threads: each,
        retry: args.retry,
        keep_checkpoints: args.keep_checkpoints,
        command: args::words(),
    };
    let board = Board::new(runs, &chosen, jobs, args.quiet, stop.clone());
    let ended = execute(runs, &chosen, &folder, &options, &board)?;
    board.clear();
    let rows = records(&plan, &folder)?;
    write_tables(&rows, &folder)?;
    let shown: Vec<&RunRecord> = chosen.iter().map(|i| &rows[*i]).collect();
    if args.json {
        print(&serde_json::to_string_pretty(&shown)?)?;
    } else {
        print(&pretty(&shown).to_string())?;
    }
    if !args.quiet {
        tell!("{}", folder.join("table.csv").display());
        if let Some(note) = note_on_unmeasured(shown) {
            tell!("note: {note}");
        }
        if study.analysis == Analysis::default() {
            tell!(
                "note: `grainwake report {}` draws the figures; claims and more figures come with an `analysis` file (docs/reference/study-file.md)",
                folder.display()
            );
        }
    }
    conclude(runs, &ended, stop.load(Ordering::Relaxed))
}

/// Reports the failed runs; the exit code is that of the worst failure.
fn conclude(runs: &[Run], ended: &[(usize, Outcome)], stopped: bool) -> Result<(), Exit> {
    let failed: Vec<(&str, &str, FailureKind)> = ended
        .iter()
        .filter_map(|(i, outcome)| match outcome {
            Outcome::Failed(why, kind) => Some((runs[*i].name.as_str(), why.as_str(), *kind)),
            _ => None,
        })
        .collect();
    let open = ended.iter().filter(|(_, o)| *o == Outcome::Interrupted).count();
    if stopped {
        return Err(Exit::with_help(
            INTERRUPTED,
            format!(
                "interrupted with {} unfinished; those that had started have a checkpoint",
                count(open, "run")
            ),
            "continue with the same command",
        ));
    }
    if ended.iter().any(|(_, o)| *o == Outcome::Locked) {
        tell!("note: some runs are locked by another program");
    }
    let Some(worst) = failed.iter().map(|(.., kind)| *kind).max() else {
        return Ok(());
    };
    let lines: Vec<String> =
        failed.iter().map(|(name, why, _)| format!("{name}: {}", first_line(why))).collect();
    // A run that could not begin, such as a damaged one, is no run to restart.
    let unstable = failed.iter().any(|(.., kind)| *kind == FailureKind::Computation);
    let retry = if unstable { "; --retry restarts unstable runs" } else { "" };
    Err(Exit::with_help(
        exit_code(worst),
        format!("{} of {} runs failed:\n{}", failed.len(), ended.len(), lines.join("\n")),
        format!("the other chosen runs have ended{retry}"),
    ))
}

/// Returns a table of number, name, state and hash of the runs.
fn list(runs: &[Run], states: &[(usize, RunState)]) -> String {
    let width = runs.iter().map(|r| r.name.len()).max().unwrap_or(0);
    let line = |(i, state): &(usize, RunState)| {
        let run = &runs[*i];
        format!("{:>4}  {:width$}  {:10}  {}", i + 1, run.name, state.kind(), run.id)
    };
    states.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// Returns the runs and their states as JSON. The names are stable.
fn listed(runs: &[Run], states: &[(usize, RunState)]) -> serde_json::Value {
    let entry = |(i, state): &(usize, RunState)| {
        let run = &runs[*i];
        serde_json::json!({
            "number": i + 1, "name": run.name, "model": run.model, "member": run.member,
            "state": state.kind(), "id": run.id, "set": run.set, "base": run.base,
            "memory_bytes": run.memory_bytes, "wall_s": run.wall_s,
        })
    };
    states.iter().map(entry).collect()
}

/// Returns the action on each run, and the expected cost of all.
fn dry_run(
    args: &StudyArgs,
    plan: &Plan,
    folder: &Path,
    states: &[(usize, RunState)],
    jobs: usize,
    threads: usize,
) -> Result<String, StudyError> {
    let mut lines = Vec::new();
    let mut to_do: Vec<&Run> = Vec::new();
    for (i, state) in states {
        let run = &plan.runs[*i];
        let doing = match state {
            RunState::Missing => "run".to_owned(),
            RunState::Unfinished => "resume".to_owned(),
            RunState::Finished => continue,
            RunState::Failed(why) if args.retry => format!("restart, failed before: {why}"),
            RunState::Failed(why) => {
                lines.push(format!("{}: skip, failed: {why}", run.name));
                continue;
            }
            RunState::Stale(why) => format!("restart: {why}"),
            RunState::Damaged(why) => {
                lines.push(format!("{}: skip, {why}; {RESTORE}", run.name));
                continue;
            }
        };
        lines.push(format!("{}: {doing}", run.name));
        to_do.push(run);
    }
    let mut timed = Vec::new();
    for run in if args.measure { one_per_grid(&to_do) } else { Vec::new() } {
        let step = time_steps(run, jobs, threads)?;
        if !args.quiet {
            let seconds = step.measured_s / threads as f64;
            tell!("{}: {seconds:.3} s per step", run.name);
        }
        timed.push(step);
    }
    let cost = expected_cost(&to_do, plan, &records(plan, folder)?, folder, &timed);
    let time = clock(cost.wall_s / (jobs * threads) as f64);
    let basis = match cost.basis {
        _ if !timed.is_empty() => "from timed steps".to_owned(),
        0 => "no run is finished; runs that stop at rest or separation count to their end".into(),
        n => format!("from {}", count(n, "finished run")),
    };
    let at_once = |bytes: fn(&Run) -> u64| {
        jobs as u64 * to_do.iter().map(|run| bytes(run)).max().unwrap_or(0)
    };
    lines.push(format!(
        "{} of {} to do: about {time} with {jobs} at once, {} each ({basis}); {} of memory, {} of \
         disk space and {} of checkpoints",
        to_do.len(),
        states.len(),
        count(threads, "thread"),
        size(at_once(|run| run.memory_bytes)),
        size(cost.disk_bytes as u64),
        size(at_once(|run| run.checkpoint_bytes)),
    ));
    Ok(lines.join("\n"))
}

/// Returns the table of the terminal.
fn pretty(rows: &[&RunRecord]) -> Table {
    const PAIR: [(&str, &str); 8] = [
        ("kiss time", "kiss_time"),
        ("contact stage", "contact_stage"),
        ("tumble time", "tumble_time"),
        ("separation time", "separation_time"),
        ("landing time", "landing_time"),
        ("kisses", "kisses"),
        ("role changes", "role_changes"),
        ("mean speed leading", "mean_speed_leading"),
    ];
    const SETTLING: [(&str, &str); 8] = [
        ("grains", "grains"),
        ("landed", "landed"),
        ("peak speed [m/s]", "peak_speed_m_per_s"),
        ("final speed [m/s]", "final_speed_m_per_s"),
        ("final Reynolds", "final_reynolds"),
        ("landing time [s]", "landing_time_s"),
        ("drift / d", "drift"),
        ("turned [deg]", "turned"),
    ];
    let settling = rows.iter().any(|row| row.settling.is_some());
    let pairs = rows.iter().any(|row| row.pair.is_some());
    let columns: Vec<(&str, &str)> = [(pairs, PAIR), (settling, SETTLING)]
        .into_iter()
        .filter(|(shown, _)| *shown)
        .flat_map(|(_, columns)| columns)
        .collect();
    let header = ["run", "state"].into_iter().chain(columns.iter().map(|c| c.0)).chain(["wall"]);
    let cells = rows.iter().map(|row| {
        let measured = columns.iter().map(|(_, name)| match row.measured(name) {
            Some(v) if v.fract() == 0.0 => format!("{v:.0}"),
            Some(v) if v.abs() < 0.1 => format!("{v:.5}"),
            Some(v) => format!("{v:.3}"),
            None => "-".into(),
        });
        let wall = row.wall_s.map_or("-".into(), clock);
        [row.name.clone(), row.state.to_string()]
            .into_iter()
            .chain(measured)
            .chain([wall])
            .collect()
    });
    markdown(header, cells, 2..columns.len() + 3)
}
