//! Rank correlations with their intervals.

use grainwake_report::figure::axis::Axis;
use grainwake_report::figure::frame::{Frame, Sign};
use grainwake_report::figure::style::{BLUE, GREEN, INK, ORANGE, PAGE, SMALL, TEXT, VERMILION};
use grainwake_report::figure::svg::{Anchor, Drawing};
use grainwake_report::figure::text;

use super::{FigureData, StudyFigure};
use crate::analysis::correlation::Correlation;
use crate::format::title;

const COLOURS: [&str; 4] = [VERMILION, ORANGE, BLUE, GREEN];
const STEP: f64 = 9.0;

/// A panel for each factor, a row for each quantity and value of the axis.
pub fn figure(data: &FigureData) -> Option<StudyFigure> {
    let wanted = data.plan.analysis.correlations.as_ref()?;
    let known: Vec<&Correlation> = data
        .correlations
        .iter()
        .filter(|c| c.interval.is_some())
        .collect();
    if known.is_empty() {
        return None;
    }
    let levels = data.levels(&wanted.by);
    let block = STEP * levels.len() as f64 + 8.0;
    let height = block * wanted.quantities.len() as f64;
    let (left, gap) = (96.0, 26.0);
    let panels = wanted.factors.len().max(1) as f64;
    let width = (PAGE - left - 8.0 - gap * (panels - 1.0)) / panels;
    let mut drawing = Drawing::new(PAGE, 26.0 + height + 26.0);
    for (i, factor) in wanted.factors.iter().enumerate() {
        let mut up = Axis::linear("", 0.0, height, 1, true);
        up.ticks.clear();
        let frame = Frame {
            x: left + i as f64 * (width + gap),
            y: 26.0,
            width,
            height,
            across: Axis::linear(
                &format!("rank correlation with {}", text::literal(factor)),
                -1.0,
                1.0,
                4,
                true,
            ),
            up,
        };
        let zero = frame.px(0.0);
        drawing.line(
            &[(zero, frame.y), (zero, frame.y + height)],
            INK,
            0.6,
            Some("2 2"),
        );
        for (q, quantity) in wanted.quantities.iter().enumerate() {
            let top = frame.y + block * q as f64;
            if q % 2 == 0 {
                drawing.rectangle(frame.x, top, width, block, "fill=\"#f4f4f6\"");
            }
            if i == 0 {
                drawing.label(
                    left - 6.0,
                    top + 0.5 * block + 0.36 * SMALL,
                    Anchor::End,
                    SMALL,
                    INK,
                    &text::literal(&title(quantity)),
                    false,
                );
            }
            for (l, level) in levels.iter().enumerate() {
                let found = known
                    .iter()
                    .find(|c| c.quantity == *quantity && c.factor == *factor && c.level == *level);
                let Some((rho, [low, high])) = found.and_then(|c| c.rho.zip(c.interval)) else {
                    continue;
                };
                let y = top + 4.0 + STEP * (l as f64 + 0.5);
                drawing.line(
                    &[(frame.px(low), y), (frame.px(high), y)],
                    COLOURS[l % 4],
                    1.2,
                    None,
                );
                Sign::number(l).draw(&mut drawing, (frame.px(rho), y), 2.7, COLOURS[l % 4], false);
            }
        }
        drawing.line(
            &[(zero, frame.y), (zero, frame.y + height)],
            INK,
            0.6,
            Some("2 2"),
        );
        frame.outline(&mut drawing, (true, false));
    }
    let mut x = left;
    for (l, level) in levels.iter().enumerate() {
        Sign::number(l).draw(&mut drawing, (x + 4.0, 12.0), 3.0, COLOURS[l % 4], false);
        drawing.label(
            x + 10.0,
            12.0 + 0.36 * SMALL,
            Anchor::Start,
            TEXT,
            INK,
            &text::literal(level),
            false,
        );
        x += 26.0 + text::width(level, TEXT);
    }
    let n = known.iter().map(|c| c.n).max().unwrap_or(0);
    Some(StudyFigure {
        name: "correlations".into(),
        number: String::new(),
        title: "Rank correlations with form".into(),
        caption: format!(
            "Spearman's rank correlation of each quantity with each factor, over up to {n} grains in one orientation, with 95 % intervals. An interval that does not hold zero is a trend.",
        ),
        drawing,
    })
}
