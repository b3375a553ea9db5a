//! How runs are told apart in the figures that a study has without being asked, and the legend.

use grainwake_report::figure::frame::Sign;
use grainwake_report::figure::style::{
    BLUE, GREEN, INK, LINE, ORANGE, PAGE, PURPLE, SKY, SMALL, VERMILION,
};
use grainwake_report::figure::svg::{Anchor, Drawing};
use grainwake_report::figure::text;

use super::FigureData;
use crate::plan::Run;

const COLOURS: [&str; 6] = [BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY];
const DASHES: [Option<&str>; 4] = [None, Some("4 1.8"), Some("1.2 1.5"), Some("6 1.6 1.2 1.6")];
/// Height of a row of the legend [pt].
pub const ROW: f64 = 10.0;

/// Line style of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineStyle {
    /// Colour of its line and sign.
    pub colour: &'static str,
    /// Dashes of its line.
    pub dash: Option<&'static str>,
    /// Sign of its points.
    pub sign: Sign,
}

/// What colours and dashes stand for.
pub enum LineStyles {
    /// Colours are models.
    Models(Vec<String>),
    /// Colours are the values of an axis, dashes those of another.
    Axes(Vec<(String, Vec<String>)>),
}

impl LineStyles {
    /// Models where they are few or on no axis, else up to two axes.
    pub fn of(data: &FigureData) -> LineStyles {
        let runs = &data.plan.runs;
        let mut models: Vec<String> = Vec::new();
        for run in runs {
            if !models.contains(&run.model) {
                models.push(run.model.clone());
            }
        }
        let axes = axes(data);
        if models.len() <= COLOURS.len() || axes.is_empty() {
            return LineStyles::Models(models);
        }
        LineStyles::Axes(axes.into_iter().take(2).collect())
    }

    /// Of a run.
    pub fn look(&self, run: &Run) -> LineStyle {
        let (colour, dash) = match self {
            LineStyles::Models(models) => (models.iter().position(|m| *m == run.model), None),
            LineStyles::Axes(axes) => {
                let place = |(axis, levels): &(String, Vec<String>)| {
                    let level = run.levels.get(axis)?;
                    levels.iter().position(|l| l == level)
                };
                (axes.first().and_then(place), axes.get(1).and_then(place))
            }
        };
        // A model that stands outside the axes.
        let Some(colour) = colour else {
            return LineStyle {
                colour: INK,
                dash: None,
                sign: Sign::Circle,
            };
        };
        LineStyle {
            colour: COLOURS[colour % COLOURS.len()],
            dash: DASHES[dash.unwrap_or(0) % DASHES.len()],
            sign: Sign::number(dash.unwrap_or(colour)),
        }
    }

    fn entries(&self) -> Vec<(String, LineStyle)> {
        let look = |colour: &'static str, n: usize, sign: usize| LineStyle {
            colour,
            dash: DASHES[n % DASHES.len()],
            sign: Sign::number(sign),
        };
        match self {
            // More models than that have no colours of their own.
            LineStyles::Models(models) => models
                .iter()
                .take(4 * COLOURS.len())
                .enumerate()
                .map(|(i, m)| (m.clone(), look(COLOURS[i % COLOURS.len()], 0, i)))
                .collect(),
            LineStyles::Axes(axes) => {
                let mut out = Vec::new();
                for (n, (axis, levels)) in axes.iter().enumerate() {
                    for (i, level) in levels.iter().enumerate() {
                        let look = match (n, axes.len()) {
                            (0, 1) => look(COLOURS[i % COLOURS.len()], 0, i),
                            (0, _) => look(COLOURS[i % COLOURS.len()], 0, 0),
                            _ => look(INK, i, i),
                        };
                        out.push((format!("{axis} {level}"), look));
                    }
                }
                out
            }
        }
    }

    /// Draws the legend from the left in rows, or only measures it; returns its height [pt].
    pub fn legend(&self, mut drawing: Option<&mut Drawing>, left: f64, signs: bool) -> f64 {
        let (mut x, mut y) = (left, 0.5 * ROW);
        for (name, look) in self.entries() {
            let label = text::literal(&name);
            let width = 17.0 + text::width(&label, SMALL) + 12.0;
            if x + width > PAGE && x > left {
                (x, y) = (left, y + ROW);
            }
            if let Some(drawing) = drawing.as_deref_mut() {
                if signs {
                    look.sign
                        .draw(drawing, (x + 7.0, y), 2.7, look.colour, false);
                } else {
                    drawing.line(&[(x, y), (x + 14.0, y)], look.colour, LINE, look.dash);
                }
                let base = y + 0.36 * SMALL;
                drawing.label(x + 17.0, base, Anchor::Start, SMALL, INK, &label, false);
            }
            x += width;
        }
        y + 0.5 * ROW
    }
}

/// The axes with more than one value, with their values in the order of the runs.
pub fn axes(data: &FigureData) -> Vec<(String, Vec<String>)> {
    let mut names: Vec<String> = Vec::new();
    for run in &data.plan.runs {
        for axis in run
            .levels
            .keys()
            .filter(|a| !names.contains(a))
            .cloned()
            .collect::<Vec<_>>()
        {
            names.push(axis);
        }
    }
    let all = names.into_iter().map(|axis| {
        let levels = data.levels(&axis);
        (axis, levels)
    });
    all.filter(|(_, levels)| levels.len() > 1).collect()
}
