//! Legends: samples of lines and symbols with their names, in rows.

use crate::drawing::{Anchor, Drawing};
use crate::frame::{Fill, Marker};
use crate::style::{LINE, SMALL};
use crate::text;

/// Height of a row [pt].
const ROW: f64 = 9.5;
/// Radius of the symbols [pt].
const SYMBOL: f64 = 2.7;

/// Entry of a legend.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Name, in label markup.
    pub name: String,
    /// Colour of the line and the symbol.
    pub colour: &'static str,
    /// SVG dash pattern of the line, empty for a solid line; `None` for no line.
    pub line: Option<&'static str>,
    /// Symbol and its fill.
    pub symbol: Option<(Marker, Fill)>,
}

impl Entry {
    /// Creates the entry of a line with an SVG dash pattern, or of a solid line.
    pub fn line(
        name: impl Into<String>,
        colour: &'static str,
        dash: Option<&'static str>,
    ) -> Entry {
        Entry { name: name.into(), colour, line: Some(dash.unwrap_or_default()), symbol: None }
    }

    /// Creates the entry of a symbol.
    pub fn symbol(
        name: impl Into<String>,
        colour: &'static str,
        marker: Marker,
        fill: Fill,
    ) -> Entry {
        Entry { name: name.into(), colour, line: None, symbol: Some((marker, fill)) }
    }

    /// Returns the width of the line or the symbol [pt].
    fn sample(&self) -> f64 {
        if self.line.is_some() { 14.0 } else { 7.0 }
    }

    /// Returns the width with the name and the distance to the next entry [pt].
    fn width(&self) -> f64 {
        self.sample() + 3.0 + text::width(&self.name, SMALL) + 10.0
    }
}

/// A legend.
#[derive(Clone, Debug, Default)]
pub struct Legend {
    rows: Vec<Vec<Entry>>,
}

impl Legend {
    /// Distributes the entries over rows of at most `width` [pt].
    pub fn new(entries: impl IntoIterator<Item = Entry>, width: f64) -> Legend {
        let mut rows: Vec<Vec<Entry>> = Vec::new();
        let mut used = f64::INFINITY;
        for entry in entries {
            used += entry.width();
            match rows.last_mut().filter(|_| used <= width) {
                Some(row) => row.push(entry),
                None => {
                    used = entry.width();
                    rows.push(vec![entry]);
                }
            }
        }
        Legend { rows }
    }

    /// Height [pt].
    pub fn height(&self) -> f64 {
        ROW * self.rows.len() as f64
    }

    /// Draws the legend, with the middle of the first row at `(left, top)` [pt].
    pub fn draw(&self, drawing: &mut Drawing, (left, top): (f64, f64)) {
        for (i, row) in self.rows.iter().enumerate() {
            let (mut x, y) = (left, top + ROW * i as f64);
            for entry in row {
                let sample = entry.sample();
                if let Some(dash) = entry.line {
                    let dash = Some(dash).filter(|dash| !dash.is_empty());
                    drawing.line(&[(x, y), (x + sample, y)], entry.colour, LINE, dash);
                }
                if let Some((marker, fill)) = entry.symbol {
                    let place = (x + 0.5 * sample, y);
                    marker.draw(drawing, place, SYMBOL, entry.colour, fill);
                }
                drawing.note((x + sample + 3.0, y), Anchor::Start, &entry.name);
                x += entry.width();
            }
        }
    }
}
