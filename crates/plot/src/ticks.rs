//! Ticks with their labels, along horizontal and vertical axes.

use crate::axis::Axis;
use crate::drawing::{Anchor, Drawing};
use crate::style::{GRID, HAIR, INK, SMALL, TICK};
use crate::text;

/// Smallest space between two names of categories on a line [pt].
const SPACE: f64 = 2.0;
/// Largest length of a name of a category beyond the ends of its axis [pt].
const OVERHANG: f64 = 6.0;

/// Returns whether the names of categories are too long for one line along an axis of length
/// `width` [pt], so that they run upwards.
fn upwards(axis: &Axis, width: f64) -> bool {
    let mut end = -OVERHANG - SPACE;
    let fits = |(value, name): &(f64, String)| {
        let middle = width * axis.fraction(*value).unwrap_or(0.0);
        let half = 0.5 * text::width(name, SMALL);
        let free = middle - half >= end + SPACE;
        end = middle + half;
        free
    };
    let all_fit = axis.ticks.iter().all(fits);
    axis.has_categories() && !(all_fit && end <= width + OVERHANG)
}

/// Returns the width of the widest tick label of a vertical axis [pt].
pub fn widest(axis: &Axis) -> f64 {
    axis.ticks.iter().map(|(_, name)| text::width(name, SMALL)).fold(0.0, f64::max)
}

/// Returns the height of the tick labels of a horizontal axis of length `width` [pt].
pub fn height(axis: &Axis, width: f64) -> f64 {
    let widths = axis.ticks.iter().map(|(_, name)| text::width(name, SMALL));
    if upwards(axis, width) { widths.fold(SMALL, f64::max) } else { SMALL }
}

/// Draws the ticks of a horizontal axis of length `width` [pt] below `(left, bottom)`.
///
/// Names of categories that are too long for one line run upwards; of too many, every second, third
/// ... is shown.
pub fn horizontal(
    drawing: &mut Drawing,
    axis: &Axis,
    (left, bottom): (f64, f64),
    width: f64,
    labelled: bool,
) {
    let upwards = upwards(axis, width);
    let every = (SMALL * axis.ticks.len() as f64 / width).ceil().max(1.0) as usize;
    for (i, (value, name)) in axis.ticks.iter().enumerate() {
        let Some(fraction) = axis.fraction(*value) else {
            continue;
        };
        let x = left + width * fraction;
        drawing.line(&[(x, bottom), (x, bottom + TICK)], INK, HAIR, None);
        if labelled && upwards {
            if i % every == 0 {
                let base = (x + 0.36 * SMALL, bottom + TICK + 2.0);
                drawing.upward_label(base, Anchor::End, SMALL, INK, name);
            }
        } else if labelled {
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
pub fn vertical(
    drawing: &mut Drawing,
    axis: &Axis,
    (left, top): (f64, f64),
    height: f64,
    labelled: bool,
    grid: Option<f64>,
) {
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
            drawing.note((left - TICK - 2.0, y), Anchor::End, name);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(names: &[String], width: f64) -> (f64, String) {
        let axis = Axis::categories("model", names.to_vec());
        let mut drawing = Drawing::new(width + 100.0, 200.0);
        horizontal(&mut drawing, &axis, (50.0, 10.0), width, true);
        (height(&axis, width), drawing.to_svg("f", "t", "d"))
    }

    #[test]
    fn long_names_of_categories_run_upwards() {
        let short: Vec<String> = (1..=12).map(|i| format!("m{i}")).collect();
        let (height, svg) = drawn(&short, 220.0);
        assert!(height == SMALL && !svg.contains("rotate"));
        let long: Vec<String> = short.iter().map(|name| format!("model-number-{name}")).collect();
        let (height, svg) = drawn(&long, 220.0);
        assert!(height >= text::width(&long[11], SMALL), "{height}");
        assert_eq!(svg.matches("rotate(-90").count(), 12);
        // One long name would extend into the next panel.
        let (_, svg) = drawn(&["a".repeat(60), "b".into()], 220.0);
        assert!(svg.contains("rotate(-90"));
        // 60 names on 220 pt: every second one.
        let many: Vec<String> = (0..60).map(|i| format!("model-{i}")).collect();
        assert_eq!(drawn(&many, 220.0).1.matches("rotate(-90").count(), 30);
    }
}
