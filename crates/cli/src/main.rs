//! `grainwake`: reads its arguments, calls the libraries, prints.

mod args;
mod bench;
mod check;
mod exit;
mod grain;
mod progress;
mod report;
mod run;
mod study;
mod study_board;
mod threads;
mod validate;

use std::io::Write;

use clap::{CommandFactory, Parser};

use args::{Cli, Command};
use exit::Exit;

fn main() -> std::process::ExitCode {
    let cli = Cli::parse();
    let done = match &cli.command {
        Command::Run(args) => run::run(args),
        Command::Check(args) => check::check(args),
        Command::Grain(args) => grain::grain(args),
        Command::Validate(args) => validate::validate(args),
        Command::Study(args) => study::study(args),
        Command::Report(args) => report::report(args),
        Command::Bench(args) => bench::bench(args),
        Command::Schema => print(&format!("{:#}", grainwake_solver::case::schema())),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "grainwake", &mut script);
            std::io::stdout().write_all(&script).map_err(Exit::from)
        }
    };
    match done {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(exit) => exit.report(),
    }
}

/// One line (or more) on standard output.
fn print(text: &str) -> Result<(), Exit> {
    writeln!(std::io::stdout(), "{text}").map_err(Exit::from)
}
