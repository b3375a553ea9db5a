//! Means of quantities against factors, with their 95 % intervals.

use grainwake_plot::axis::{Axis, AxisRange, extent};
use grainwake_plot::drawing::Drawing;
use grainwake_plot::frame::{Fill, Frame, Labelled, Marker};
use grainwake_plot::legend::Legend;
use grainwake_plot::style::PAGE;
use grainwake_plot::{Figure, text};

use super::data::{FigureData, symbol_entry, unique};
use super::trends::COLOURS;
use crate::analysis::factor_mean::{FactorMean, KISSING_SHARE};
use crate::format::title;

const LEFT: f64 = 42.0;
const GAP: f64 = 14.0;
const HEIGHT: f64 = 92.0;
/// Space between two rows of panels [pt].
const SPACE: f64 = 12.0;
/// Distance of the symbols of two levels at a value of a factor [pt].
const ASIDE: f64 = 5.0;

/// Draws one row of panels per quantity and one column per factor, with one curve per level.
pub fn figure(data: &FigureData) -> Option<Figure> {
    let means = data.factor_means;
    let quantities = unique(means.iter().map(|m| &m.quantity));
    let factors = unique(means.iter().map(|m| &m.factor));
    let levels = unique(means.iter().map(|m| &m.level));
    if levels.is_empty() {
        return None;
    }
    let entry = |(l, level): (usize, &String)| symbol_entry(level, l, COLOURS[l % 4]);
    let legend = Legend::new(levels.iter().enumerate().map(entry), PAGE - LEFT);
    let top = legend.height() + 8.0;
    let row_height = HEIGHT + SPACE;
    let mut drawing = Drawing::new(PAGE, top + row_height * quantities.len() as f64 + 18.0);
    legend.draw(&mut drawing, (LEFT, 5.0));
    let count = factors.len() as f64;
    let width = (PAGE - LEFT - 8.0 - GAP * (count - 1.0)) / count;
    for (row, quantity) in quantities.iter().enumerate() {
        let here = || means.iter().filter(|m| m.quantity == *quantity);
        let ends = here().flat_map(|m| m.interval.unwrap_or([m.mean; 2]));
        let (low, high) = if quantity == KISSING_SHARE { (0.0, 1.0) } else { extent(ends)? };
        for (column, factor) in factors.iter().enumerate() {
            let shown = || here().filter(|m| m.factor == *factor);
            let (first, last) = extent(means.iter().filter(|m| m.factor == *factor).map(|m| m.at))?;
            let margin = 0.06 * (last - first).max(0.1 * last.abs());
            let (first, last) = (first - margin, last + margin);
            let frame = Frame {
                x: LEFT + column as f64 * (width + GAP),
                y: top + row as f64 * row_height,
                width,
                height: HEIGHT,
                across: Axis::linear(&label(factor), first, last, 5, AxisRange::Tight),
                up: Axis::linear(&label(quantity), low, high, 4, AxisRange::Rounded),
            };
            frame.grid(&mut drawing);
            for (l, level) in levels.iter().enumerate() {
                // The levels stand side by side, so that their intervals do not overlap.
                let aside = ASIDE * (l as f64 - 0.5 * (levels.len() as f64 - 1.0));
                let curve = shown().filter(|m| m.level == *level);
                let curve: Vec<(f64, &FactorMean)> =
                    curve.map(|m| (frame.px(m.at) + aside, m)).collect();
                let colour = COLOURS[l % 4];
                let line: Vec<(f64, f64)> =
                    curve.iter().map(|(x, m)| (*x, frame.py(m.mean))).collect();
                drawing.line(&line, colour, 0.6, None);
                for (x, mean) in &curve {
                    if let Some(ends) = mean.interval {
                        drawing.line(&ends.map(|end| (*x, frame.py(end))), colour, 1.2, None);
                    }
                }
                for place in line {
                    Marker::nth(l).draw(&mut drawing, place, 2.5, colour, Fill::Solid);
                }
            }
            let across = row + 1 == quantities.len();
            frame.outline(&mut drawing, Labelled { across, up: column == 0 });
        }
    }
    let caption = "Mean over the models with equal or similar values of a factor; bars: \
                   95 % intervals of a bootstrap over models and members. A pair that lands \
                   before the event counts in the kissing share only.";
    Some(Figure::new("factor-means", "Results against shape factors", caption, drawing))
}

fn label(name: &str) -> String {
    text::literal(&title(name))
}
