//! Strip above a frame that shows models without an event, whose time has no place on the axis.

use grainwake_plot::drawing::{Anchor, Drawing};
use grainwake_plot::frame::{Fill, Frame, Marker};
use grainwake_plot::legend::Entry;
use grainwake_plot::style::{FAINT, INK};

use super::line_style::LineStyle;
use crate::analysis::observation::Observation;

/// Height of the strip [pt].
pub(super) const STRIP: f64 = 16.0;

/// Draws the strip above a frame, with its name to the left if `named`.
pub(super) fn strip(drawing: &mut Drawing, frame: &Frame, named: bool) {
    let (top, bottom) = (frame.y - STRIP, frame.y);
    let (left, right) = (frame.x, frame.x + frame.width);
    let border = [(left, bottom), (left, top), (right, top), (right, bottom)];
    drawing.line(&border, FAINT, 0.5, None);
    if named {
        drawing.note((left - 4.0, middle(frame)), Anchor::End, "no kiss");
    }
}

fn middle(frame: &Frame) -> f64 {
    frame.y - 0.5 * STRIP
}

/// Draws an observation at a horizontal position [pt]: the range of the events as a bar, and the
/// value as a symbol. A model without the event has a hollow symbol in the strip.
pub(super) fn mark(
    drawing: &mut Drawing,
    frame: &Frame,
    x: f64,
    observation: &Observation,
    style: LineStyle,
) {
    let LineStyle { colour, sign, .. } = style;
    let (low, high) = observation.range;
    if high > low && observation.occurred() {
        let bar = [(x, frame.py(low)), (x, frame.py(high))];
        drawing.line(&bar, colour, 0.9, None);
    } else if observation.censored && observation.occurred() {
        // The only event.
        let y = frame.py(low);
        drawing.line(&[(x - 2.5, y), (x + 2.5, y)], colour, 0.9, None);
    }
    match observation.censored {
        true => sign.draw(drawing, (x, middle(frame)), 2.9, colour, Fill::Hollow),
        false => sign.draw(drawing, (x, frame.py(observation.value)), 2.9, colour, Fill::Solid),
    }
}

/// Writes the number of models without the event into the strip.
pub(super) fn number(drawing: &mut Drawing, frame: &Frame, x: f64, count: usize) {
    if count > 0 {
        drawing.note((x, middle(frame)), Anchor::Middle, &count.to_string());
    }
}

/// Hollow symbol of a model without the event, for a legend; `several` if models have several runs.
pub(super) fn entry(several: bool) -> Entry {
    let name = match several {
        true => "hollow: no kiss in half of the runs or more; bars: range of the kisses",
        false => "hollow: landed, or run ended, before kissing",
    };
    Entry::symbol(name, INK, Marker::Circle, Fill::Hollow)
}
