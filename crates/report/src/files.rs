//! Writing of files and figures.

use std::path::{Path, PathBuf};

use grainwake_formats::disk::write_atomically;
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
