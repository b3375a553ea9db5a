//! `grainwake view`.

use std::collections::BTreeSet;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use grainwake_report::run_folder::RunFolder;
use grainwake_run::number_format::size;
use grainwake_study::format::rounded;
use grainwake_study::{Plan, columns, records};
use grainwake_view::server::Server;
use grainwake_view::{Source, StudyRow, StudyTable, ViewError, Viewer, save};

use crate::args::ViewArgs;
use crate::exit::{BAD_INPUT, Exit, IO};
use crate::{print, tell};

impl From<ViewError> for Exit {
    fn from(error: ViewError) -> Exit {
        let code = if error.is_input_output() { IO } else { BAD_INPUT };
        let help = match &error {
            ViewError::Run(_) => {
                "give folders that `grainwake run` or `grainwake study` has written"
            }
            ViewError::Listen { .. } => "choose another port with --port N; 0 takes any free port",
            ViewError::Write { .. } => "check the folder and its permissions",
        };
        Exit::with_help(code, error.to_string(), help)
    }
}

/// Serves or saves the page of run folders or of a study folder.
pub fn view(args: &ViewArgs) -> Result<(), Exit> {
    let mut viewer = viewer(&args.folders)?;
    if let Some(file) = &args.save {
        may_save(file)?;
        let notes = save(&mut viewer, file)?;
        notes.iter().for_each(|note| tell!("note: {note}"));
        let bytes = std::fs::metadata(file)?.len();
        return print(&format!("{} ({})", file.display(), size(bytes)));
    }
    let server = Server::bind(viewer, args.port)?;
    let address = format!("http://{}/", server.address());
    print(&address)?;
    tell!("served on this machine only; Ctrl-C ends it");
    if args.open && !open(&address) {
        tell!("note: no browser could be started; open {address} yourself");
    }
    server.run();
    Ok(())
}

/// Refuses a name that is no page, and a file that is no page of this program.
fn may_save(file: &Path) -> Result<(), Exit> {
    let refused = |what: &str| {
        let message = format!("--save: {} {what}", file.display());
        Err(Exit::refused(message, "name a page, such as page.html"))
    };
    if file.is_dir() {
        return refused("is a folder");
    }
    if file.extension().is_none_or(|e| !e.eq_ignore_ascii_case("html")) {
        return refused("does not end in .html");
    }
    if !file.exists() {
        return Ok(());
    }
    let mut start = Vec::new();
    std::fs::File::open(file)?.take(1 << 12).read_to_end(&mut start)?;
    let start = String::from_utf8_lossy(&start).to_lowercase();
    if start.contains("<!doctype html>") && start.contains("grainwake") {
        return Ok(());
    }
    refused("exists and is not a page of grainwake view")
}

/// Creates the viewer of run folders, or of the runs of one study folder.
fn viewer(folders: &[PathBuf]) -> Result<Viewer, Exit> {
    match folders {
        [study] if Plan::exists_in(study) => of_study(study),
        _ => {
            if let Some(study) = folders.iter().find(|folder| Plan::exists_in(folder)) {
                let message = format!("{} is a study among several folders", study.display());
                return Err(Exit::refused(message, "view one study at a time"));
            }
            let source = |folder: &PathBuf| Source { name: name(folder), folder: folder.clone() };
            let mut sources: Vec<Source> = folders.iter().map(source).collect();
            // Folders of equal names are distinguished by their paths.
            for i in 0..sources.len() {
                if folders.iter().filter(|folder| name(folder) == name(&folders[i])).count() > 1 {
                    sources[i].name = folders[i].display().to_string();
                }
            }
            Ok(Viewer::new(sources, None)?)
        }
    }
}

/// Returns the last part of the path of a folder.
fn name(folder: &Path) -> String {
    let full = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    full.file_name()
        .map_or_else(|| full.display().to_string(), |n| n.to_string_lossy().into_owned())
}

fn of_study(folder: &Path) -> Result<Viewer, Exit> {
    let (plan, damage) = Plan::read_or_rebuild(folder)?;
    if let Some(note) = damage {
        tell!("note: {note}");
    }
    let records = records(&plan, folder)?;
    let axes: BTreeSet<&String> = records.iter().flat_map(|record| record.levels.keys()).collect();
    let quantities = columns(&records);
    let mut table = StudyTable { title: plan.title.clone(), ..StudyTable::default() };
    table.columns = axes.iter().map(|axis| (*axis).clone()).collect();
    table.columns.push("kiss_time_s".to_owned());
    table.columns.extend(quantities.iter().map(|name| (*name).to_owned()));
    let mut sources = Vec::new();
    for (run, record) in plan.runs.iter().zip(&records) {
        let source = Source { name: run.name.clone(), folder: run.folder(folder) };
        let index = RunFolder::exists_in(&source.folder).then_some(sources.len());
        sources.extend(index.map(|_| source));
        let number = |value: Option<f64>| value.map_or(String::new(), |v| text(rounded(v)));
        let levels = axes.iter().map(|axis| record.levels.get(*axis).cloned().unwrap_or_default());
        let measured = quantities.iter().map(|name| number(record.measured(name)));
        // A contact after the landing is no kiss.
        let kiss = record.kiss_time_s.filter(|_| record.measured("kiss_time").is_some());
        let values = levels.chain([number(kiss)]).chain(measured).collect();
        let (name, state) = (record.name.clone(), record.state.to_string());
        table.rows.push(StudyRow { name, state, run: index, values });
    }
    if sources.is_empty() {
        let message = format!("{}: no run of the study has been started", folder.display());
        return Err(Exit::refused(message, "run `grainwake study` first"));
    }
    Ok(Viewer::new(sources, Some(table))?)
}

/// Returns a number as text; tiny ones with an exponent.
fn text(number: f64) -> String {
    let tiny = number != 0.0 && number.abs() < 1e-4;
    if tiny { format!("{number:e}") } else { number.to_string() }
}

/// Starts the default browser; returns whether that was possible.
fn open(address: &str) -> bool {
    let mut command = if cfg!(target_os = "macos") {
        Command::new("open")
    } else if cfg!(windows) {
        let mut command = Command::new("rundll32");
        command.arg("url.dll,FileProtocolHandler");
        command
    } else {
        Command::new("xdg-open")
    };
    command.arg(address).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().is_ok()
}
