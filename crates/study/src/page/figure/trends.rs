//! Rank correlations with their confidence intervals.

use grainwake_plot::axis::{Axis, AxisRange};
use grainwake_plot::drawing::{Anchor, Drawing};
use grainwake_plot::frame::{Fill, Frame, Labelled, Marker};
use grainwake_plot::legend::Legend;
use grainwake_plot::style::{BLUE, GREEN, INK, ORANGE, PAGE, VERMILION};
use grainwake_plot::{Figure, text};

use super::data::{FigureData, symbol_entry};
use crate::analysis::correlation::Correlation;
use crate::format::title;

/// Colours of the levels of an axis.
pub(super) const COLOURS: [&str; 4] = [VERMILION, ORANGE, BLUE, GREEN];
/// Height of the row of one level [pt].
const ROW: f64 = 9.0;
const LEFT: f64 = 96.0;
const GAP: f64 = 26.0;
const TOP: f64 = 26.0;

/// Draws one panel per factor, with one row per quantity and level of the axis.
pub fn figure(data: &FigureData) -> Option<Figure> {
    let request = data.plan.analysis.correlations.as_ref()?;
    let known = data.correlations.iter().filter(|c| c.interval.is_some());
    let known: Vec<&Correlation> = known.collect();
    let n = known.iter().map(|c| c.n).max()?;
    let levels = data.levels(&request.by);
    let block = ROW * levels.len() as f64 + 8.0;
    let height = block * request.quantities.len() as f64;
    let panels = request.factors.len().max(1) as f64;
    let width = (PAGE - LEFT - 8.0 - GAP * (panels - 1.0)) / panels;
    let mut drawing = Drawing::new(PAGE, TOP + height + 26.0);
    for (i, factor) in request.factors.iter().enumerate() {
        let mut up = Axis::linear("", 0.0, height, 1, AxisRange::Tight);
        up.ticks.clear();
        let label = format!("rank correlation with {}", text::literal(factor));
        let frame = Frame {
            x: LEFT + i as f64 * (width + GAP),
            y: TOP,
            width,
            height,
            across: Axis::linear(&label, -1.0, 1.0, 4, AxisRange::Tight),
            up,
        };
        for (q, quantity) in request.quantities.iter().enumerate() {
            let top = frame.y + block * q as f64;
            if q % 2 == 0 {
                drawing.rectangle(frame.x, top, width, block, "fill=\"#f4f4f6\"");
            }
            if i == 0 {
                let place = (LEFT - 6.0, top + 0.5 * block);
                drawing.note(place, Anchor::End, &text::literal(&title(quantity)));
            }
            for (l, level) in levels.iter().enumerate() {
                let found = known
                    .iter()
                    .find(|c| c.quantity == *quantity && c.factor == *factor && c.level == *level);
                let Some((rho, [low, high])) = found.and_then(|c| c.rho.zip(c.interval)) else {
                    continue;
                };
                let y = top + 4.0 + ROW * (l as f64 + 0.5);
                let colour = COLOURS[l % 4];
                let interval = [(frame.px(low), y), (frame.px(high), y)];
                drawing.line(&interval, colour, 1.2, None);
                Marker::nth(l).draw(&mut drawing, (frame.px(rho), y), 2.7, colour, Fill::Solid);
            }
        }
        let zero = frame.px(0.0);
        let zero = [(zero, frame.y), (zero, frame.y + height)];
        drawing.line(&zero, INK, 0.6, Some("2 2"));
        frame.outline(&mut drawing, Labelled { across: true, up: false });
    }
    let entry = |(l, level): (usize, &String)| symbol_entry(level, l, COLOURS[l % 4]);
    let legend = Legend::new(levels.iter().enumerate().map(entry), PAGE - LEFT);
    legend.draw(&mut drawing, (LEFT, 12.0));
    let caption = format!(
        "Spearman's rank correlation of each quantity with each factor, over up to {n} grains in \
         one orientation, with 95 % intervals. An interval that excludes zero indicates a trend."
    );
    let title = "Rank correlations with shape factors";
    Some(Figure::new("correlations", title, caption, drawing))
}
