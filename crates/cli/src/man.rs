//! `grainwake man`.

use clap::{Command, CommandFactory};
use clap_mangen::Man;
use grainwake_formats::disk;
use grainwake_report::write_file;

use crate::args::{Cli, ManArgs};
use crate::exit::Exit;
use crate::out::{print, write};

/// Prints the manual page of the program, or writes the pages of all commands into a folder.
pub fn man(args: &ManArgs) -> Result<(), Exit> {
    let mut command = Cli::command();
    command.build();
    let Some(folder) = &args.output else {
        return write(&page(command)?);
    };
    disk::create_folder(folder).map_err(Exit::at(folder))?;
    let pages = pages(command);
    for command in &pages {
        let path = folder.join(format!("{}.1", name(command)));
        write_file(&path, &page(command.clone())?).map_err(Exit::at(&path))?;
    }
    print(&format!("{} pages in {}", pages.len(), folder.display()))
}

/// Returns `command` and all commands below it, except those that print help.
fn pages(command: Command) -> Vec<Command> {
    let below: Vec<Command> = command
        .get_subcommands()
        .filter(|below| below.get_name() != "help")
        .cloned()
        .flat_map(pages)
        .collect();
    std::iter::once(command).chain(below).collect()
}

/// Returns the name of a page: `grainwake-grain-make` for `grainwake grain make`.
fn name(command: &Command) -> String {
    command.get_display_name().unwrap_or(command.get_name()).into()
}

fn page(command: Command) -> Result<Vec<u8>, Exit> {
    let title = name(&command);
    let version = command.get_version().unwrap_or_default();
    let source = format!("grainwake {version}");
    let mut text = Vec::new();
    Man::new(command).title(title).source(source).manual("Grainwake").render(&mut text)?;
    Ok(text)
}
