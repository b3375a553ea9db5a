//! Writing of files and figures.

use std::path::{Path, PathBuf};

use grainwake_formats::disk::{self, write_atomically};
use grainwake_plot::Figure;

use crate::error::{ReportError, Written as _};

/// A figure with its files.
#[derive(Clone, Debug)]
pub struct WrittenFigure {
    /// Figure.
    pub figure: Figure,
    /// Text of the SVG file.
    pub svg: String,
    /// PNG file.
    pub png_file: PathBuf,
    /// SVG file.
    pub svg_file: PathBuf,
}

/// Writes a file through a temporary name, so that readers never see a part of it.
///
/// # Errors
/// Error of the operating system.
pub fn write_file(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    write_atomically(path, false, |out| out.write_all(bytes))
}

/// File in `figures/` that lists the figures of the last report, one name per line.
const LIST: &str = ".figures";

/// Removes the figures of an earlier report that are not among the `written` ones, and lists these
/// for the next report. Other files in the folder stay.
///
/// # Errors
/// If a figure cannot be removed or the list cannot be written.
pub fn remove_earlier_figures(folder: &Path, written: &[WrittenFigure]) -> Result<(), ReportError> {
    let list = folder.join(LIST);
    let files = written.iter().flat_map(|f| [&f.png_file, &f.svg_file]);
    let names: Vec<&str> = files.filter_map(|file| file.file_name()?.to_str()).collect();
    // A missing or unreadable list names no file.
    let earlier = std::fs::read_to_string(&list).unwrap_or_default();
    let is_figure = |name: &&str| {
        let plain = Path::new(name).file_name().is_some_and(|file| file == *name);
        plain && (name.ends_with(".png") || name.ends_with(".svg"))
    };
    for name in earlier.lines().filter(is_figure).filter(|name| !names.contains(name)) {
        let path = folder.join(name);
        match disk::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(error).written(&path);
            }
            _ => (),
        }
    }
    write_file(&list, (names.join("\n") + "\n").as_bytes()).written(&list)
}

/// Writes a figure as `NAME.png` and `NAME.svg` into an existing folder.
///
/// # Errors
/// If the figure cannot be drawn, or a file cannot be written.
pub fn write_figure(folder: &Path, figure: Figure) -> Result<WrittenFigure, ReportError> {
    let [png_file, svg_file] =
        ["png", "svg"].map(|extension| folder.join(format!("{}.{extension}", figure.name)));
    let png = figure.drawing.to_png().written(&png_file)?;
    write_file(&png_file, &png).written(&png_file)?;
    let svg = figure.svg();
    write_file(&svg_file, svg.as_bytes()).written(&svg_file)?;
    Ok(WrittenFigure { figure, svg, png_file, svg_file })
}
