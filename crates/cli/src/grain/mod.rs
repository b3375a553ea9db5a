//! `grainwake grain`: creates, inspects and compares `.grain` files.

mod compare;
mod drawn;
mod export;
mod family;
mod make;
mod mesh;
mod preview;
mod refused;
mod scan;
mod scan_folder;
mod table;
mod treated;

use std::io::Read;
use std::path::{Path, PathBuf};

use grainwake_formats::disk;
use grainwake_report::grain_sheet::GrainPanel;
use grainwake_run::case::parse_length;
use grainwake_run::check_grain_size;
use grainwake_shape::{Shape, ShapeOptions, check_length};

use crate::args::{GrainCommand, InfoArgs, NewGrain};
use crate::exit::{Exit, IO};
use crate::print;

/// Runs one of the commands.
pub fn grain(command: &GrainCommand) -> Result<(), Exit> {
    match command {
        GrainCommand::FromScan(args) => scan::from_scan(args),
        GrainCommand::FromMesh(args) => mesh::from_mesh(args),
        GrainCommand::Make(args) => make::make(args),
        GrainCommand::Family(args) => family::family(args),
        GrainCommand::Info(args) => info(args),
        GrainCommand::Compare(args) => compare::compare(args),
        GrainCommand::Export(args) => export::export(args),
    }
}

/// Parses the length of one unit of a mesh [m]. A bare unit such as "mm" means "1 mm" here; in
/// other options it is an error.
fn mesh_unit(text: &str) -> Result<f64, Exit> {
    let bare = text.chars().all(char::is_alphabetic);
    length("--unit", &if bare { format!("1 {text}") } else { text.to_owned() })
}

/// Parses a length of the command line [m].
fn length(name: &str, text: &str) -> Result<f64, Exit> {
    parse_length(text).map_err(|message| Exit::input(format!("{name}: {message}")))
}

/// Rescales a shape to the diameter of `--equivalent-diameter`. Without it refuses an implausible
/// size, which indicates a wrong unit of `option`.
fn sized(shape: Shape, diameter: Option<f64>, option: &str) -> Result<Shape, Exit> {
    if let Some(diameter) = diameter {
        return Ok(shape.scaled_to_equivalent_diameter(diameter)?);
    }
    plausible(&shape, option)?;
    Ok(shape)
}

/// Refuses a grain of implausible size, which indicates a wrong unit of `option`.
fn plausible(shape: &Shape, option: &str) -> Result<(), Exit> {
    let help = format!(
        "check the unit of {option} (mm or m?), or set the size with --equivalent-diameter LENGTH"
    );
    let source = &shape.provenance().source;
    let name = if source.is_empty() { String::new() } else { format!("{source}: ") };
    check_grain_size(shape).map_err(|message| Exit::refused(format!("{name}{message}"), help))
}

/// Parses `--equivalent-diameter` [m], before the work starts.
fn diameter(new: &NewGrain) -> Result<Option<f64>, Exit> {
    let Some(text) = &new.equivalent_diameter else {
        return Ok(None);
    };
    let diameter = length("--equivalent-diameter", text)?;
    check_length("--equivalent-diameter", diameter)?;
    Ok(Some(diameter))
}

fn options(new: &NewGrain) -> ShapeOptions {
    let common = &new.common;
    ShapeOptions { cells: common.cells, nodes: common.nodes, ..ShapeOptions::default() }
}

/// Refuses to replace a file without `--force`, and a file that cannot be created. Called before
/// the work starts.
fn may_write(path: &Path, force: bool) -> Result<(), Exit> {
    if !path.exists() {
        return may_create(folder_of(path));
    }
    if !force {
        return Err(Exit::refused(
            format!("{} exists already", path.display()),
            "choose another name with -o, or replace it with --force",
        ));
    }
    Ok(())
}

/// Refuses to overwrite an input file, even with `--force`.
fn not_input(output: &Path, input: &Path) -> Result<(), Exit> {
    let same = match (output.canonicalize(), input.canonicalize()) {
        (Ok(output), Ok(input)) => output == input,
        _ => false,
    };
    if same {
        return Err(Exit::refused(
            format!("{} is an input of this command", output.display()),
            "choose another name for the output",
        ));
    }
    Ok(())
}

/// Refuses a picture that is an input of the command, does not end in .png, or would replace a file
/// that is not a PNG.
fn may_draw(option: &str, picture: &Path, inputs: &[&Path]) -> Result<(), Exit> {
    inputs.iter().try_for_each(|input| not_input(picture, input))?;
    if picture.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png")) {
        let message = format!("{option}: {} does not end in .png", picture.display());
        return Err(Exit::refused(message, "name a picture, such as picture.png"));
    }
    let mut start = [0; 8];
    let read = std::fs::File::open(picture).and_then(|mut file| file.read_exact(&mut start));
    if picture.exists() && (read.is_err() || start != *b"\x89PNG\r\n\x1a\n") {
        let message = format!("{option}: {} exists and is not a picture", picture.display());
        return Err(Exit::refused(message, "choose another name"));
    }
    Ok(())
}

/// Refuses a folder that cannot be created or written.
fn may_create(folder: &Path) -> Result<(), Exit> {
    let above = folder.ancestors().find(|f| f.exists()).unwrap_or(Path::new("."));
    let help = "choose another place with -o";
    if !above.is_dir() {
        let message = format!("{} is a file, not a folder", above.display());
        return Err(Exit::refused(message, help));
    }
    let probe = above.join(format!(".grainwake-{}", std::process::id()));
    std::fs::create_dir(&probe).and_then(|()| std::fs::remove_dir(&probe)).map_err(|error| {
        let message = format!("cannot write to {}: {error}", above.display());
        Exit::with_help(IO, message, help)
    })
}

/// Returns the folder of a file.
fn folder_of(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

/// Creates a folder and those above it.
fn create(folder: &Path) -> Result<(), Exit> {
    disk::create_folder(folder).map_err(Exit::cannot("create the folder", folder))
}

/// Refuses a file name without the extension `.grain`.
fn grain_file(path: &Path) -> Result<(), Exit> {
    if path.extension().is_some_and(|e| e == "grain") {
        return Ok(());
    }
    Err(Exit::refused(
        format!("{} does not end in .grain", path.display()),
        format!("use -o {}", path.with_extension("grain").display()),
    ))
}

/// Extensions of other files that are read or written here. Those of grain files, also misspelled
/// ones, begin with "gr".
const FILES: [&str; 10] = ["stl", "ply", "obj", "tif", "tiff", "npy", "npz", "nrrd", "mha", "png"];

/// Refuses a new folder with the extension of a file, which indicates a mistake, and a folder that
/// cannot be written.
fn folder(path: &Path) -> Result<(), Exit> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let file = ending.is_some_and(|e| e.starts_with("gr") || FILES.contains(&e.as_str()));
    if !file || path.is_dir() {
        return may_create(path);
    }
    Err(Exit::refused(
        format!("{} is a folder with the extension of a file", path.display()),
        "use a name without this extension; from-scan writes a single grain to NAME.grain",
    ))
}

/// Saves and prints one shape.
fn save(shape: &Shape, new: &NewGrain) -> Result<(), Exit> {
    create(folder_of(&new.output))?;
    shape.save(&new.output)?;
    show(shape, &new.output, new.common.json)
}

fn show(shape: &Shape, path: &Path, json: bool) -> Result<(), Exit> {
    if json {
        print(&serde_json::to_string(&shape.record())?)
    } else {
        print(&table::of(&shape.record(), path))
    }
}

fn info(args: &InfoArgs) -> Result<(), Exit> {
    if let Some(picture) = &args.picture {
        let inputs: Vec<&Path> = args.files.iter().map(PathBuf::as_path).collect();
        may_draw("--picture", picture, &inputs)?;
    }
    let mut pictures = Vec::new();
    for (path, name) in args.files.iter().zip(drawn::names(&args.files)) {
        let shape = Shape::load(path)?;
        show(&shape, path, args.json)?;
        if args.picture.is_some() {
            pictures.push(GrainPanel::three_sides(&name, &shape, drawn::SIDE, true));
        }
    }
    if let Some(path) = &args.picture {
        drawn::save(path, pictures, 1)?;
    }
    Ok(())
}
