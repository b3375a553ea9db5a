//! Rank correlations with their confidence intervals.

use grainwake_plot::axis::{Axis, AxisRange};
use grainwake_plot::drawing::{Anchor, Drawing};
use grainwake_plot::frame::{Fill, Frame, Labelled};
use grainwake_plot::legend::Legend;
use grainwake_plot::style::{INK, PAGE, TEXT};
use grainwake_plot::{Figure, text};

use super::data::FigureData;
use super::legend::symbol_entry;
use super::line_style::LineStyle;
use crate::analysis::correlation::Correlation;
use crate::page::label::name_of;

/// Beginning of the label of a panel.
const QUANTITY: &str = "rank correlation with";
/// Height of the row of one level [pt].
const ROW: f64 = 9.0;
const LEFT: f64 = 96.0;
const GAP: f64 = 26.0;
/// Largest number of panels in a row.
const ACROSS: usize = 4;
/// Space between two rows of panels [pt].
const SPACE: f64 = 8.0;
/// Height below a panel with a label of one line, and of a further line [pt].
const FOOT: f64 = 26.0;
const LINE: f64 = 10.0;

/// Draws one panel per factor, with one row per quantity and level of the axis.
pub fn figure(data: &FigureData) -> Option<Figure> {
    let request = data.plan.analysis.correlations.as_ref()?;
    let known = data.correlations.iter().filter(|c| c.interval.is_some());
    let known: Vec<&Correlation> = known.collect();
    let n = known.iter().map(|c| c.n).max()?;
    let levels = data.levels(&request.by);
    let block = ROW * levels.len() as f64 + 8.0;
    let height = block * request.quantities.len() as f64;
    let (across, labels) = labels(&request.factors);
    let foot = FOOT + if labels.iter().any(|label| label.len() > 1) { LINE } else { 0.0 };
    let width = panel_width(across);
    let style = |level: &String| data.level_style(&request.by, level);
    let entry = |level: &String| symbol_entry(level, style(level));
    let legend = Legend::new(levels.iter().map(entry), PAGE - LEFT);
    let top = legend.height() + 16.5;
    let rows = request.factors.len().div_ceil(across);
    let mut drawing = Drawing::new(PAGE, top + rows as f64 * (height + foot + SPACE) - SPACE);
    legend.draw(&mut drawing, (LEFT, 12.0));
    for (i, factor) in request.factors.iter().enumerate() {
        let mut up = Axis::linear("", 0.0, height, 1, AxisRange::Tight);
        up.ticks.clear();
        let (row, column) = (i / across, i % across);
        let frame = Frame {
            x: LEFT + column as f64 * (width + GAP),
            y: top + row as f64 * (height + foot + SPACE),
            width,
            height,
            across: Axis::linear(&labels[i][0], -1.0, 1.0, 4, AxisRange::Tight),
            up,
        };
        for (q, quantity) in request.quantities.iter().enumerate() {
            let top = frame.y + block * q as f64;
            if q % 2 == 0 {
                drawing.rectangle(frame.x, top, width, block, "fill=\"#f4f4f6\"");
            }
            if column == 0 {
                let place = (LEFT - 6.0, top + 0.5 * block);
                drawing.note(place, Anchor::End, &name_of(quantity));
            }
            for (l, level) in levels.iter().enumerate() {
                let found = known
                    .iter()
                    .find(|c| c.quantity == *quantity && c.factor == *factor && c.level == *level);
                let Some((rho, [low, high])) = found.and_then(|c| c.rho.zip(c.interval)) else {
                    continue;
                };
                let y = top + 4.0 + ROW * (l as f64 + 0.5);
                let LineStyle { colour, sign, .. } = style(level);
                let interval = [(frame.px(low), y), (frame.px(high), y)];
                drawing.line(&interval, colour, 1.2, None);
                sign.draw(&mut drawing, (frame.px(rho), y), 2.7, colour, Fill::Solid);
            }
        }
        let zero = frame.px(0.0);
        let zero = [(zero, frame.y), (zero, frame.y + height)];
        drawing.line(&zero, INK, 0.6, Some("2 2"));
        frame.outline(&mut drawing, Labelled { across: true, up: false });
        if let Some(name) = labels[i].get(1) {
            let below = (frame.x + 0.5 * width, frame.y + height + frame.foot() - 6.0 + LINE);
            drawing.text(below, Anchor::Middle, name);
        }
    }
    let caption = format!(
        "Spearman's rank correlation of each quantity with each factor, over up to {n} models of \
         equal {}, with 95 % intervals. An interval that excludes zero indicates a trend.",
        name_of(&request.by)
    );
    Some(Figure::new("correlations", "Rank correlations with factors", caption, drawing))
}

/// Width of each of `across` panels in a row [pt].
fn panel_width(across: usize) -> f64 {
    (PAGE - LEFT - 8.0 - GAP * (across as f64 - 1.0)) / across as f64
}

/// Returns the number of panels in a row and the lines of their labels, which do not overlap.
fn labels(factors: &[String]) -> (usize, Vec<Vec<String>>) {
    let names: Vec<String> = factors.iter().map(|f| name_of(f)).collect();
    let one = |name: &String| vec![format!("{QUANTITY} {name}")];
    let two = |name: &String| vec![QUANTITY.to_owned(), name.clone()];
    let one: Vec<Vec<String>> = names.iter().map(one).collect();
    let two: Vec<Vec<String>> = names.iter().map(two).collect();
    let fits = |labels: &[Vec<String>], across: usize| {
        // The last panel ends near the edge of the page.
        let room = panel_width(across) + 14.0;
        labels.iter().flatten().all(|line| text::width(line, TEXT) <= room)
    };
    let most = factors.len().clamp(1, ACROSS);
    if fits(&one, most) {
        return (most, one);
    }
    ((1..=most).rev().find(|across| fits(&two, *across)).unwrap_or(1), two)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_of_many_factors_do_not_overlap() {
        let of = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
            labels(&names)
        };
        let (across, two) = of(&["sphericity", "roundness"]);
        assert_eq!((across, &two[0]), (2, &vec!["rank correlation with sphericity".to_owned()]));
        let (across, four) = of(&["density", "diameter", "viscosity_Pas", "krumbein_sphericity"]);
        assert_eq!((across, &*four[3][1]), (4, "Krumbein sphericity"));
        let (across, long) = of(&["density", "ratio_of_the_longest_axis_to_the_shortest_axis"]);
        assert_eq!((across, long.len()), (2, 2));
        assert_eq!(of(&["a"; 9]).0, ACROSS);
    }
}
