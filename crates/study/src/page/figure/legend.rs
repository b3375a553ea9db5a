//! Line styles of runs in the overview figures, and their legend.

use grainwake_plot::frame::{Fill, Marker};
use grainwake_plot::legend::{Entry, Legend};
use grainwake_plot::style::{INK, PAGE, SERIES_COLOURS, series_colour};
use grainwake_plot::text;

use super::data::{FigureData, unique};
use crate::plan::Run;

const DASHES: [Option<&str>; 4] = [None, Some("4 1.8"), Some("1.2 1.5"), Some("6 1.6 1.2 1.6")];

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
    fn numbered(colour: usize, dash: usize, sign: usize) -> LineStyle {
        LineStyle {
            colour: series_colour(colour),
            dash: DASHES[dash % DASHES.len()],
            sign: Marker::nth(sign),
        }
    }
}

/// Assignment of line styles to runs.
pub enum LineStyles {
    /// One colour per model.
    Models(Vec<String>),
    /// One colour per level of the first axis, one dash pattern per level of the second.
    Axes(Vec<(String, Vec<String>)>),
}

impl LineStyles {
    /// Assigns by model if there are few models or no axes, else by up to two axes.
    pub fn of(data: &FigureData) -> LineStyles {
        let models = unique(data.plan.runs.iter().map(|run| &run.model));
        let axes = axes(data);
        if models.len() <= SERIES_COLOURS || axes.is_empty() {
            return LineStyles::Models(models);
        }
        LineStyles::Axes(axes.into_iter().take(2).collect())
    }

    /// Returns the style of a run; black for a model outside the axes.
    pub fn style(&self, run: &Run) -> LineStyle {
        let (colour, dash) = match self {
            LineStyles::Models(models) => (models.iter().position(|m| *m == run.model), None),
            LineStyles::Axes(axes) => {
                let index = |(axis, levels): &(String, Vec<String>)| {
                    let level = run.levels.get(axis)?;
                    levels.iter().position(|l| l == level)
                };
                (axes.first().and_then(index), axes.get(1).and_then(index))
            }
        };
        match colour {
            Some(colour) => LineStyle::numbered(colour, dash.unwrap_or(0), dash.unwrap_or(colour)),
            None => LineStyle { colour: INK, dash: None, sign: Marker::Circle },
        }
    }

    fn entries(&self) -> Vec<(String, LineStyle)> {
        match self {
            // Colours repeat, so a longer legend would be ambiguous.
            LineStyles::Models(models) => models
                .iter()
                .take(4 * SERIES_COLOURS)
                .enumerate()
                .map(|(i, model)| (model.clone(), LineStyle::numbered(i, 0, i)))
                .collect(),
            LineStyles::Axes(axes) => {
                let mut out = Vec::new();
                for (n, (axis, levels)) in axes.iter().enumerate() {
                    for (i, level) in levels.iter().enumerate() {
                        let mut style = match (n, axes.len()) {
                            (0, 1) => LineStyle::numbered(i, 0, i),
                            (0, _) => LineStyle::numbered(i, 0, 0),
                            _ => LineStyle::numbered(0, i, i),
                        };
                        if n > 0 {
                            style.colour = INK;
                        }
                        out.push((format!("{axis} {level}"), style));
                    }
                }
                out
            }
        }
    }

    /// Returns the legend, with symbols or else lines, for a frame with the given left edge [pt].
    pub fn legend(&self, left: f64, symbols: bool) -> Legend {
        let entry = |(name, style): (String, LineStyle)| Entry {
            name: text::literal(&name),
            colour: style.colour,
            line: (!symbols).then_some(style.dash.unwrap_or_default()),
            symbol: symbols.then_some((style.sign, Fill::Solid)),
        };
        Legend::new(self.entries().into_iter().map(entry), PAGE - left)
    }
}

/// Returns the axes with more than one level, and their levels in the order of the runs.
pub fn axes(data: &FigureData) -> Vec<(String, Vec<String>)> {
    let names = unique(data.plan.runs.iter().flat_map(|run| run.levels.keys()));
    let axes = names.into_iter().map(|axis| {
        let levels = data.levels(&axis);
        (axis, levels)
    });
    axes.filter(|(_, levels)| levels.len() > 1).collect()
}
