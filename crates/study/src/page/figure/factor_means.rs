//! Means of quantities against factors, with their 95 % intervals.

use grainwake_plot::Figure;
use grainwake_plot::axis::{Axis, AxisRange, extent};
use grainwake_plot::drawing::Drawing;
use grainwake_plot::frame::{Fill, Frame, Labelled};
use grainwake_plot::legend::Legend;
use grainwake_plot::style::PAGE;

use super::data::FigureData;
use super::legend::symbol_entry;
use super::line_style::LineStyle;
use crate::analysis::factor_mean::{FactorMean, KISSING_SHARE};
use crate::measure::unique;
use crate::page::label::label;

const LEFT: f64 = 42.0;
const GAP: f64 = 14.0;
const HEIGHT: f64 = 92.0;
/// Space between two rows of panels [pt].
const SPACE: f64 = 12.0;
/// Height below the last row of panels [pt].
const FOOT: f64 = 18.0;
/// Largest number of panels in a row.
const ACROSS: usize = 4;
/// Largest distance of the symbols of two levels at a value of a factor [pt].
const ASIDE: f64 = 5.0;
/// Largest radius of a symbol [pt].
const SYMBOL: f64 = 4.0;

/// Draws one row of panels per quantity and one column per factor, with one curve per level.
pub fn figure(data: &FigureData) -> Option<Figure> {
    let means = data.factor_means;
    let quantities = unique(means.iter().map(|m| &m.quantity));
    let factors = unique(means.iter().map(|m| &m.factor));
    let levels = unique(means.iter().map(|m| &m.level));
    if levels.is_empty() {
        return None;
    }
    let by = &data.plan.analysis.correlations.as_ref()?.by;
    let style = |level: &String| data.level_style(by, level);
    let entry = |level: &String| symbol_entry(level, style(level));
    let legend = Legend::new(levels.iter().map(entry), PAGE - LEFT);
    let top = legend.height() + 8.0;
    let row_height = HEIGHT + SPACE;
    let block = row_height * quantities.len() as f64 + FOOT;
    let blocks = factors.len().div_ceil(ACROSS) as f64;
    let mut drawing = Drawing::new(PAGE, top + block * blocks);
    legend.draw(&mut drawing, (LEFT, 5.0));
    let count = factors.len().min(ACROSS) as f64;
    let width = (PAGE - LEFT - 8.0 - GAP * (count - 1.0)) / count;
    let column = |factor: &String| {
        let label = data.axis_label(factor);
        Column::new(means, (factor, &label), levels.len(), width)
    };
    let columns = factors.iter().map(column).collect::<Option<Vec<Column>>>()?;
    for (row, quantity) in quantities.iter().enumerate() {
        let here = || means.iter().filter(|m| m.quantity == *quantity);
        let ends = here().flat_map(|m| m.interval.unwrap_or([m.mean; 2]));
        let (low, high) = if quantity == KISSING_SHARE { (0.0, 1.0) } else { extent(ends)? };
        for (i, column) in columns.iter().enumerate() {
            let shown = || here().filter(|m| m.factor == column.factor);
            let (n, part) = (i % ACROSS, i / ACROSS);
            let frame = Frame {
                x: LEFT + n as f64 * (width + GAP),
                y: top + part as f64 * block + row as f64 * row_height,
                width,
                height: HEIGHT,
                across: column.axis.clone(),
                up: Axis::linear(&label(quantity), low, high, 4, AxisRange::Rounded),
            };
            frame.grid(&mut drawing);
            for (l, level) in levels.iter().enumerate() {
                let aside = column.aside * (l as f64 - 0.5 * (levels.len() as f64 - 1.0));
                let curve = shown().filter(|m| m.level == *level);
                let curve: Vec<(f64, &FactorMean)> =
                    curve.map(|m| (frame.px(m.at) + aside, m)).collect();
                let LineStyle { colour, dash, sign } = style(level);
                let line: Vec<(f64, f64)> =
                    curve.iter().map(|(x, m)| (*x, frame.py(m.mean))).collect();
                drawing.line(&line, colour, 0.6, dash);
                for (x, mean) in &curve {
                    if let Some(ends) = mean.interval {
                        drawing.line(&ends.map(|end| (*x, frame.py(end))), colour, 1.2, None);
                    }
                }
                for place in line {
                    sign.draw(&mut drawing, place, 2.5, colour, Fill::Solid);
                }
            }
            let across = row + 1 == quantities.len();
            frame.outline(&mut drawing, Labelled { across, up: n == 0 });
        }
    }
    let shares = quantities.iter().filter(|quantity| *quantity == KISSING_SHARE).count();
    let bars = match (shares, quantities.len() - shares) {
        (0, _) => "of a bootstrap over models and members",
        (_, 0) => "of Clopper and Pearson with models as units",
        _ => {
            "of the share those of Clopper and Pearson with models as units, else those of a \
             bootstrap over models and members"
        }
    };
    let without = match means.iter().any(|m| m.interval.is_none()) {
        true => " A mean without a bar is that of a single run.",
        false => "",
    };
    let left_out = match shares > 0 {
        true => "A pair without the event counts in the kissing share only.",
        false => "A run that ends before the event of a quantity is left out.",
    };
    let caption = format!(
        "Mean over the models with equal or similar values of a factor; bars: 95 % intervals, \
         {bars}.{without} {left_out}"
    );
    Some(Figure::new("factor-means", "Results against factors", caption, drawing))
}

/// Horizontal axis of the panels of a factor.
struct Column {
    factor: String,
    axis: Axis,
    /// Distance of the symbols of two levels [pt]; they stand side by side at a common value.
    aside: f64,
}

impl Column {
    /// Creates the column of a factor with panels `width` [pt] wide, from means in ascending order
    /// of the factor; none if it has no values. The factor comes with the label of its axis.
    fn new(
        means: &[FactorMean],
        (factor, label): (&str, &str),
        levels: usize,
        width: f64,
    ) -> Option<Column> {
        let own: Vec<&FactorMean> = means.iter().filter(|m| m.factor == factor).collect();
        let (first, last) = extent(own.iter().map(|m| m.at))?;
        let range = (last - first).max(0.1 * last.abs()).max(f64::MIN_POSITIVE);
        let together =
            |w: &&[&FactorMean]| (&w[0].quantity, &w[0].level) == (&w[1].quantity, &w[1].level);
        let steps = own.windows(2).filter(together).map(|w| w[1].at - w[0].at);
        let step = steps.fold(range, f64::min) / range;
        let equal = |a: f64, b: f64| (a - b).abs() < 1e-9 * range;
        let common = |m: &&FactorMean| own.iter().any(|o| o.level != m.level && equal(o.at, m.at));
        let shared = own.iter().any(common);
        let count = levels as f64;
        let room = 0.56 * step * width / count;
        let aside = if shared { ASIDE.min(room) } else { 0.0 };
        // The outer levels stay inside the frame.
        let outer = 0.5 * aside * (count - 1.0) + SYMBOL;
        let margin = range * f64::max(0.06, outer / (width - 2.0 * outer));
        let (first, last) = (first - margin, last + margin);
        let ticks = (width / 20.0).clamp(2.0, 5.0) as usize;
        let axis = Axis::linear(label, first, last, ticks, AxisRange::Tight);
        Some(Column { factor: factor.to_owned(), axis, aside })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Column in which each level has all values or only its own, and half the distance of its
    /// outer symbols.
    fn column(values: &[f64], levels: usize, shared: bool, width: f64) -> (Column, f64) {
        let mean = |level: usize, at: f64| FactorMean {
            quantity: "kiss_time".into(),
            factor: "density".into(),
            level: format!("o{level}"),
            at,
            models: 1,
            mean: 1.0,
            interval: None,
        };
        let mut means = Vec::new();
        for level in 0..levels {
            let own = values.iter().enumerate().filter(|(i, _)| shared || *i == level);
            means.extend(own.map(|(_, at)| mean(level, *at)));
        }
        let column = Column::new(&means, ("density", "density"), levels, width).unwrap();
        let outer = 0.5 * column.aside * (levels as f64 - 1.0);
        (column, outer)
    }

    #[test]
    fn symbols_stay_inside_the_frame_and_near_their_value() {
        let values = [1400.0, 2500.0, 2600.0, 2650.0, 2840.0];
        for (width, levels) in [(104.0, 5), (223.0, 4), (104.0, 12)] {
            let (column, outer) = column(&values, levels, true, width);
            let at = |value: f64| width * column.axis.fraction(value).unwrap();
            assert!(at(1400.0) - outer > 3.0 && at(2840.0) + outer < width - 3.0, "{width}");
            assert!(at(2600.0) + outer < at(2650.0) - outer, "{width}: closer to another value");
        }
        let (wide, _) = column(&[0.2, 0.4, 0.6, 0.8], 4, true, 223.0);
        assert_eq!(wide.aside, ASIDE);
        let (alone, outer) = column(&[2.0], 5, true, 104.0);
        assert!(alone.aside > 0.0 && outer < 48.0);
        assert_eq!(column(&values, 5, false, 104.0).0.aside, 0.0, "one level per value");
    }
}
