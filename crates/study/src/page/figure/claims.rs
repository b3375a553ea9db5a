//! Effects of all claims with their intervals and verdicts: a forest plot.

use grainwake_plot::axis::{Axis, AxisRange, extent};
use grainwake_plot::drawing::{Anchor, Drawing};
use grainwake_plot::frame::{Fill, Frame, Labelled, Marker};
use grainwake_plot::legend::{Entry, Legend};
use grainwake_plot::style::{FAINT, GREEN, INK, PAGE, SMALL, TEXT, VERMILION};
use grainwake_plot::{Figure, text};

use super::data::FigureData;
use crate::analysis::claim_test::Effect;
use crate::analysis::verdict::{Finding, Verdict};
use crate::measure::unique;
use crate::page::label::label;

/// Width of the column of the claims [pt].
const LEFT: f64 = 262.0;
/// Distance of two lines of text, and space between two rows [pt].
const LINE: f64 = 8.0;
const SPACE: f64 = 5.0;
/// Height of the axis below a panel, and of the space below that [pt].
const AXIS: f64 = 40.0;

/// Length of the arrow of an effect without bound [pt].
const ARROW: f64 = 5.0;

/// Draws one panel per kind of effect, of differences one per quantity, with one row per claim, and
/// a list of the claims without a test.
pub fn figure(data: &FigureData) -> Option<Figure> {
    let (known, untested): (Vec<&Finding>, Vec<&Finding>) =
        data.findings.iter().partition(|f| f.interval.is_some() && f.value.is_some());
    if known.is_empty() {
        return None;
    }
    let panels = panels(&known);
    let untested: Vec<Vec<String>> =
        untested.iter().map(|f| wrapped(&f.claim, PAGE - 20.0)).collect();
    let entry = |verdict: Verdict| Entry {
        name: verdict.to_string(),
        colour: colour(verdict),
        line: Some(""),
        symbol: Some((Marker::Circle, Fill::Solid)),
    };
    let verdicts = [Verdict::Holds, Verdict::Contradicted, Verdict::Open];
    let legend = Legend::new(verdicts.into_iter().map(entry), PAGE - LEFT);
    let mut top = legend.height() + 8.0;
    let list = untested.iter().map(|lines| LINE * lines.len() as f64 + SPACE).sum::<f64>();
    let list = if untested.is_empty() { 0.0 } else { list + LINE + SPACE };
    let total = top + panels.iter().map(|(_, rows)| height(rows) + AXIS).sum::<f64>() + list;
    let mut drawing = Drawing::new(PAGE, total);
    legend.draw(&mut drawing, (LEFT, 5.0));
    for (across, rows) in &panels {
        panel(&mut drawing, across.clone(), rows, top);
        top += height(rows) + AXIS;
    }
    if !untested.is_empty() {
        drawing.label((0.0, top + LINE), Anchor::Start, TEXT, INK, "Not tested: too few data");
        top += LINE + SPACE;
        for lines in &untested {
            for line in lines {
                top += LINE;
                drawing.label((10.0, top), Anchor::Start, SMALL, FAINT, &text::literal(line));
            }
            top += SPACE;
        }
    }
    let mut caption = "Estimated effects of the claims with their 95 % intervals. Shaded: effects \
                       that do not matter, where the analysis states them. The rule of the \
                       verdicts is given above the table of claims."
        .to_owned();
    let unbounded = |row: &Row| row.interval.iter().any(|end| end.is_infinite());
    if panels.iter().any(|(_, rows)| rows.iter().any(unbounded)) {
        caption += " Arrow with ∞: no bound on this side, because of models without the event; \
                    without a dot the effect itself has none.";
    }
    Some(Figure::new("claims", "Claims with their effects", caption, drawing))
}

fn colour(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Holds => GREEN,
        Verdict::Contradicted => VERMILION,
        Verdict::Open => FAINT,
    }
}

/// A claim, in lines of text, and its effect.
struct Row {
    lines: Vec<String>,
    value: f64,
    interval: [f64; 2],
    negligible: Option<f64>,
    verdict: Verdict,
}

impl Row {
    fn new(finding: &Finding) -> Option<Row> {
        // Relative differences are shown in percent.
        let scale = if finding.effect == Effect::RelativeDifference { 100.0 } else { 1.0 };
        Some(Row {
            lines: wrapped(&finding.claim, LEFT - 10.0),
            value: scale * finding.value?,
            interval: finding.interval?.map(|end| scale * end),
            negligible: finding.negligible.map(|size| scale * size),
            verdict: finding.verdict,
        })
    }

    fn height(&self) -> f64 {
        LINE * self.lines.len() as f64 + SPACE
    }
}

fn height(rows: &[Row]) -> f64 {
    rows.iter().map(Row::height).sum()
}

/// Returns the horizontal axis and the rows of each panel.
fn panels(known: &[&Finding]) -> Vec<(Axis, Vec<Row>)> {
    let rows = |chosen: &dyn Fn(&Finding) -> bool| -> Vec<Row> {
        known.iter().filter(|f| chosen(f)).filter_map(|f| Row::new(f)).collect()
    };
    let mut out = Vec::new();
    let correlations = rows(&|f| f.effect == Effect::RankCorrelation);
    out.push((Axis::linear("rank correlation", -1.0, 1.0, 4, AxisRange::Tight), correlations));
    let differences = known.iter().filter(|f| f.effect == Effect::Difference);
    for quantity in unique(differences.map(|f| &f.quantity)) {
        let own = rows(&|f| f.effect == Effect::Difference && f.quantity == quantity);
        out.push((axis(&format!("difference of the {}", label(&quantity)), &own), own));
    }
    let relative = rows(&|f| f.effect == Effect::RelativeDifference);
    out.push((axis("relative difference  [%]", &relative), relative));
    out.retain(|(_, rows)| !rows.is_empty());
    out
}

/// Returns the axis of differences: zero, and all finite effects, intervals and negligible sizes.
fn axis(label: &str, rows: &[Row]) -> Axis {
    let of_row = |row: &Row| {
        let size = row.negligible.unwrap_or(0.0);
        [row.value, row.interval[0], row.interval[1], -size, size]
    };
    let (mut low, mut high) = extent(rows.iter().flat_map(of_row).chain([0.0])).unwrap_or_default();
    if low == high {
        (low, high) = (-1.0, 1.0);
    }
    // Zero is inside the frame, and an arrow does not hide a finite effect.
    let room = 0.08 * (high - low);
    low -= if low == 0.0 { room } else { 0.0 };
    high += if high == 0.0 { room } else { 0.0 };
    let unbounded = |end: f64| rows.iter().any(|row| of_row(row).contains(&end));
    low -= if unbounded(f64::NEG_INFINITY) { room } else { 0.0 };
    high += if unbounded(f64::INFINITY) { room } else { 0.0 };
    Axis::linear(label, low, high, 5, AxisRange::Rounded)
}

/// Draws an arrow at the edge of the frame, with its number, for an effect without bound.
fn arrow(drawing: &mut Drawing, frame: &Frame, y: f64, end: f64, colour: &str) {
    let sign = end.signum();
    let edge = if sign > 0.0 { frame.x + frame.width } else { frame.x };
    let tip = (edge - sign, y);
    let back = tip.0 - sign * ARROW;
    let head = [(back, y - 0.6 * ARROW), tip, (back, y + 0.6 * ARROW)];
    drawing.line(&head, colour, 1.2, None);
    let (anchor, name) = if sign > 0.0 { (Anchor::End, "∞") } else { (Anchor::Start, "−∞") };
    drawing.label((back - sign, y - 2.0), anchor, SMALL, INK, name);
}

fn panel(drawing: &mut Drawing, across: Axis, rows: &[Row], top: f64) {
    let height = height(rows);
    let mut up = Axis::linear("", 0.0, height, 1, AxisRange::Tight);
    up.ticks.clear();
    let frame = Frame { x: LEFT, y: top, width: PAGE - LEFT - 8.0, height, across, up };
    let inside = |value: f64| value.clamp(frame.across.low(), frame.across.high());
    let mut y = top;
    for row in rows {
        if let Some(size) = row.negligible {
            let (left, right) = (frame.px(inside(-size)), frame.px(inside(size)));
            drawing.rectangle(left, y, right - left, row.height(), "fill=\"#ececf0\"");
        }
        for (i, line) in row.lines.iter().enumerate() {
            let place = (0.0, y + 0.5 * SPACE + LINE * (i as f64 + 0.8));
            drawing.label(place, Anchor::Start, SMALL, INK, &text::literal(line));
        }
        let middle = y + 0.5 * row.height();
        let ends = row.interval.map(|end| (frame.px(inside(end)), middle));
        let colour = colour(row.verdict);
        drawing.line(&ends, colour, 1.2, None);
        for end in row.interval.into_iter().filter(|end| end.is_infinite()) {
            arrow(drawing, &frame, middle, end, colour);
        }
        if row.value.is_finite() {
            let place = (frame.px(row.value), middle);
            Marker::Circle.draw(drawing, place, 2.7, colour, Fill::Solid);
        }
        y += row.height();
    }
    let zero = frame.px(0.0);
    drawing.line(&[(zero, top), (zero, top + height)], INK, 0.6, Some("2 2"));
    frame.outline(drawing, Labelled { across: true, up: false });
}

/// Breaks a text into lines of at most a width [pt].
fn wrapped(text: &str, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split_whitespace() {
        let Some(last) = lines.last_mut() else { break };
        let longer = if last.is_empty() { word.into() } else { format!("{last} {word}") };
        if last.is_empty() || text::width(&text::literal(&longer), SMALL) <= width {
            *last = longer;
        } else {
            lines.push(word.into());
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::plan::claims::Test;

    fn finding(quantity: &str, value: f64, interval: [f64; 2]) -> Finding {
        let order = Test::Order { axis: "a".into(), more: "b".into(), less: "c".into() };
        Finding {
            claim: format!("claim about {quantity}"),
            part: String::new(),
            quantity: quantity.into(),
            test: order,
            when: BTreeMap::new(),
            observed: false,
            verdict: Verdict::Open,
            says: String::new(),
            n: 6,
            censored: 0,
            effect: Effect::Difference,
            value: Some(value),
            interval: Some(interval),
            p: Some(0.5),
            adjusted_p: None,
            negligible: None,
        }
    }

    #[test]
    fn each_quantity_has_a_panel_and_an_effect_without_bound_an_arrow() {
        let infinite = f64::INFINITY;
        let all = [
            finding("kiss_time", infinite, [1.0, infinite]),
            finding("kisses", 1.0, [0.0, 2.0]),
            finding("kiss_time", 3.0, [2.0, 4.0]),
        ];
        let panels = panels(&all.iter().collect::<Vec<_>>());
        let sizes: Vec<usize> = panels.iter().map(|(_, rows)| rows.len()).collect();
        assert_eq!(sizes, [2, 1]);
        let (axis, rows) = &panels[0];
        assert!(axis.label.contains("kissing time") && axis.high() > 4.0, "{}", axis.label);
        let mut drawing = Drawing::new(PAGE, 100.0);
        panel(&mut drawing, axis.clone(), rows, 10.0);
        let svg = drawing.to_svg("", "", "");
        assert_eq!(svg.matches('∞').count(), 1, "{svg}");
        // One dot of radius 2.7 for the finite effect only.
        assert_eq!(svg.matches("stroke=\"#ffffff\"").count(), 1, "{svg}");
    }
}
