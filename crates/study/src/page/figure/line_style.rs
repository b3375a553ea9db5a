//! Line styles of runs and levels.

use grainwake_plot::frame::Marker;
use grainwake_plot::style::{BLUE, GREEN, INK, ORANGE, SERIES_COLOURS, VERMILION, series_colour};

pub(super) const DASHES: [Option<&str>; 4] =
    [None, Some("4 1.8"), Some("1.2 1.5"), Some("6 1.6 1.2 1.6")];
/// Colours of up to three levels: vermilion and orange look alike.
const THREE: [&str; 3] = [VERMILION, BLUE, GREEN];
/// Colours of four levels.
const FOUR: [&str; 4] = [VERMILION, ORANGE, BLUE, GREEN];
/// Number of lines that differ in colour or dash pattern.
pub(super) const MOST: usize = SERIES_COLOURS * DASHES.len();
/// Style of a model outside the axes.
pub const OUTSIDE: LineStyle = LineStyle { colour: INK, dash: None, sign: Marker::Circle };

/// Line style of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineStyle {
    /// Colour of the line and the symbols.
    pub colour: &'static str,
    /// Dash pattern of the line.
    pub dash: Option<&'static str>,
    /// Symbol of the points.
    pub sign: Marker,
}

impl LineStyle {
    /// Returns the n-th style; [`MOST`] lines and 36 symbols differ.
    pub fn nth(n: usize) -> LineStyle {
        let cycle = n / SERIES_COLOURS;
        LineStyle {
            colour: series_colour(n),
            dash: DASHES[cycle % DASHES.len()],
            sign: Marker::nth(n + cycle),
        }
    }

    /// Returns the black style of the n-th level of an axis that has no colours, with the symbol of
    /// [`LineStyle::of_level`].
    pub fn of_second(n: usize) -> LineStyle {
        LineStyle { colour: INK, dash: DASHES[n % DASHES.len()], sign: Marker::nth(n) }
    }

    /// Returns the style of the n-th of `count` levels of an axis.
    pub fn of_level(n: usize, count: usize) -> LineStyle {
        let colours = if count <= THREE.len() { &THREE[..] } else { &FOUR };
        match colours.get(n).filter(|_| count <= FOUR.len()) {
            Some(colour) => LineStyle { colour, dash: None, sign: Marker::nth(n) },
            None => LineStyle::nth(n),
        }
    }
}
