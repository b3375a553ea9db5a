//! `grainwake`: parses the arguments, calls the libraries and prints the results.

// The print macros of the standard library panic on a closed pipe; module `out` does not.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod args;
mod bench;
mod check;
mod exit;
mod expect;
mod grain;
mod kind;
mod man;
mod out;
mod progress;
mod report;
mod run;
mod signals;
mod study;
mod study_board;
mod threads;
mod validate;
mod view;

use clap::CommandFactory;

use args::{Cli, Command};
use out::{print, tell};

fn main() -> std::process::ExitCode {
    match exit::without_panic(command) {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(exit) => {
            tell!("{}", exit.messages());
            exit.code()
        }
    }
}

/// Executes the command of the command line.
fn command() -> Result<(), exit::Exit> {
    let cli = Cli::read();
    signals::survive_file_size_limit();
    threads::limit_default_pool();
    match &cli.command {
        Command::Run(args) => run::run(args),
        Command::Check(args) => check::check(args),
        Command::Grain(args) => grain::grain(args),
        Command::Validate(args) => validate::validate(args),
        Command::Study(args) => study::study(args),
        Command::Report(args) => report::report(args),
        Command::View(args) => view::view(args),
        Command::Bench(args) => bench::bench(args),
        Command::Schema => print(&format!("{:#}", grainwake_run::case::schema())),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "grainwake", &mut script);
            out::write(&script)
        }
        Command::Man(args) => man::man(args),
    }
}
