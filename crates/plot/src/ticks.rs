//! Ticks with their labels, along horizontal and vertical axes.

use crate::axis::Axis;
use crate::drawing::{Anchor, Drawing};
use crate::style::{GRID, HAIR, INK, SMALL, TICK};
use crate::text;

/// Draws the ticks of a horizontal axis of length `width` [pt] below `(left, bottom)`.
pub fn horizontal(
    drawing: &mut Drawing,
    axis: &Axis,
    (left, bottom): (f64, f64),
    width: f64,
    labelled: bool,
) {
    for (value, name) in &axis.ticks {
        let Some(fraction) = axis.fraction(*value) else {
            continue;
        };
        let x = left + width * fraction;
        drawing.line(&[(x, bottom), (x, bottom + TICK)], INK, HAIR, None);
        if labelled {
            let y = bottom + TICK + SMALL + 0.5;
            // A long label at the right end stays on the drawing.
            let half = 0.5 * text::width(name, SMALL);
            let x = x.min(drawing.width() - half - 1.0).max(half);
            drawing.label((x, y), Anchor::Middle, SMALL, INK, name);
        }
    }
}

/// Draws the ticks of a vertical axis of length `height` [pt] to the left of `(left, top)`, with
/// grid lines of the given length at the inner labelled ticks.
///
/// Returns the width of the widest tick label [pt].
pub fn vertical(
    drawing: &mut Drawing,
    axis: &Axis,
    (left, top): (f64, f64),
    height: f64,
    labelled: bool,
    grid: Option<f64>,
) -> f64 {
    let mut widest: f64 = 0.0;
    for (value, name) in &axis.ticks {
        let Some(fraction) = axis.fraction(*value) else {
            continue;
        };
        let y = top + height * (1.0 - fraction);
        let inner = fraction > 0.01 && fraction < 0.99 && !name.is_empty();
        if let Some(length) = grid.filter(|_| inner) {
            drawing.line(&[(left, y), (left + length, y)], GRID, 0.5, None);
        }
        drawing.line(&[(left - TICK, y), (left, y)], INK, HAIR, None);
        if labelled {
            widest = widest.max(text::width(name, SMALL));
            drawing.note((left - TICK - 2.0, y), Anchor::End, name);
        }
    }
    widest
}
