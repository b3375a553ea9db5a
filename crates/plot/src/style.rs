//! Sizes, line widths and the Okabe-Ito colours, which remain distinct for colour-blind readers
//! (M. Okabe and K. Ito, 2008).

/// Width of one column of a journal page, 88 mm [pt].
pub const COLUMN: f64 = 250.0;
/// Width of a full journal page, 180 mm [pt].
pub const PAGE: f64 = 510.0;
/// Text size [pt].
pub const TEXT: f64 = 7.5;
/// Size of tick labels and notes [pt].
pub const SMALL: f64 = 6.5;
/// Width of frames and ticks [pt].
pub const HAIR: f64 = 0.6;
/// Width of data lines [pt].
pub const LINE: f64 = 1.2;
/// Length of ticks [pt].
pub const TICK: f64 = 2.5;
/// Pixels per point of the PNG files: 300 dots per inch.
pub const PIXELS_PER_POINT: f64 = 300.0 / 72.0;
/// Font families of the SVG files; PNG files use the first one, which is embedded.
pub const FONT: &str = "DejaVu Sans, Verdana, sans-serif";

/// Colour of text, frames and outlines.
pub const INK: &str = "#222222";
/// Colour of secondary lines and notes.
pub const FAINT: &str = "#8a8a8a";
/// Colour of grid lines.
pub const GRID: &str = "#e4e4e4";
/// Okabe-Ito blue.
pub const BLUE: &str = "#0072b2";
/// Okabe-Ito vermilion.
pub const VERMILION: &str = "#d55e00";
/// Okabe-Ito bluish green.
pub const GREEN: &str = "#009e73";
/// Okabe-Ito reddish purple.
pub const PURPLE: &str = "#cc79a7";
/// Okabe-Ito orange.
pub const ORANGE: &str = "#e69f00";
/// Okabe-Ito sky blue.
pub const SKY: &str = "#56b4e9";

/// Number of colours in the cycle of data series.
pub const SERIES_COLOURS: usize = 6;

/// Returns the colour of the n-th data series, in a cycle of [`SERIES_COLOURS`].
pub fn series_colour(n: usize) -> &'static str {
    [BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY][n % SERIES_COLOURS]
}
