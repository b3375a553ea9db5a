//! Effects of all claims with their intervals and verdicts: a forest plot.

use grainwake_plot::axis::{Axis, AxisRange, extent};
use grainwake_plot::drawing::{Anchor, Drawing};
use grainwake_plot::frame::{Fill, Frame, Labelled, Marker};
use grainwake_plot::legend::{Entry, Legend};
use grainwake_plot::style::{FAINT, GREEN, INK, PAGE, SMALL, VERMILION};
use grainwake_plot::{Figure, text};

use super::data::FigureData;
use crate::analysis::claim_test::Effect;
use crate::analysis::verdict::{Finding, Verdict};
use crate::format::title;

/// Width of the column of the claims [pt].
const LEFT: f64 = 262.0;
/// Distance of two lines of text, and space between two rows [pt].
const LINE: f64 = 8.0;
const SPACE: f64 = 5.0;
/// Height of the axis below a panel, and of the space below that [pt].
const AXIS: f64 = 40.0;

/// Draws one panel per kind of effect, with one row per claim.
pub fn figure(data: &FigureData) -> Option<Figure> {
    let known = data.findings.iter().filter(|f| f.interval.is_some() && f.value.is_some());
    let known: Vec<&Finding> = known.collect();
    let kinds = [Effect::RankCorrelation, Effect::Difference, Effect::RelativeDifference];
    let panels = kinds.map(|kind| -> Vec<Row> {
        known.iter().filter(|f| f.effect == kind).filter_map(|f| Row::new(f)).collect()
    });
    if panels.iter().all(Vec::is_empty) {
        return None;
    }
    let entry = |verdict: Verdict| Entry {
        name: verdict.to_string(),
        colour: colour(verdict),
        line: Some(""),
        symbol: Some((Marker::Circle, Fill::Solid)),
    };
    let verdicts = [Verdict::Holds, Verdict::Contradicted, Verdict::Open];
    let legend = Legend::new(verdicts.into_iter().map(entry), PAGE - LEFT);
    let mut top = legend.height() + 8.0;
    let of_panel = |rows: &Vec<Row>| match rows.is_empty() {
        true => 0.0,
        false => height(rows) + AXIS,
    };
    let total = top + panels.iter().map(of_panel).sum::<f64>();
    let mut drawing = Drawing::new(PAGE, total);
    legend.draw(&mut drawing, (LEFT, 5.0));
    for (kind, rows) in kinds.into_iter().zip(&panels).filter(|(_, rows)| !rows.is_empty()) {
        panel(&mut drawing, kind, rows, top)?;
        top += of_panel(rows);
    }
    let caption = "Estimated effects of the claims with their 95 % intervals; an interval that \
                   reaches the edge of a panel may have no bound. Shaded: effects that do not \
                   matter, where the analysis states them. The rule of the verdicts is given above \
                   the table of claims.";
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
        let claim = match finding.effect {
            Effect::Difference => format!("{} [{}]", finding.claim, title(&finding.quantity)),
            _ => finding.claim.clone(),
        };
        Some(Row {
            lines: wrapped(&claim, LEFT - 10.0),
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

fn panel(drawing: &mut Drawing, kind: Effect, rows: &[Row], top: f64) -> Option<()> {
    let across = match kind {
        Effect::RankCorrelation => Axis::linear("rank correlation", -1.0, 1.0, 4, AxisRange::Tight),
        Effect::Difference | Effect::RelativeDifference => {
            let sizes = rows.iter().filter_map(|row| row.negligible);
            let sizes: Vec<f64> = sizes.flat_map(|size| [-size, size]).collect();
            let ends = rows.iter().flat_map(|row| row.interval).chain(sizes);
            let (low, high) = extent(ends.chain([0.0]))?;
            let label = match kind {
                Effect::Difference => "difference, in the unit of the quantity",
                _ => "relative difference  [%]",
            };
            Axis::linear(label, low, high, 5, AxisRange::Rounded)
        }
    };
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
        let place = (frame.px(inside(row.value)), middle);
        Marker::Circle.draw(drawing, place, 2.7, colour, Fill::Solid);
        y += row.height();
    }
    let zero = frame.px(0.0);
    drawing.line(&[(zero, top), (zero, top + height)], INK, 0.6, Some("2 2"));
    frame.outline(drawing, Labelled { across: true, up: false });
    Some(())
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
