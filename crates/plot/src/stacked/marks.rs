//! Vertical lines that mark instants across all panels, with their names above.

use crate::axis::Axis;
use crate::drawing::{Anchor, Drawing};
use crate::frame::Frame;
use crate::style::{FAINT, GRID, HAIR, INK, SMALL};
use crate::text;

/// Margin to the right of the panels [pt].
pub(super) const RIGHT: f64 = 8.0;
/// Height of a row of names [pt].
pub(super) const ROW: f64 = 9.5;
/// Largest number of rows of names.
const LABEL_ROWS: usize = 5;

/// A vertical line across all panels.
#[derive(Clone, Debug)]
pub struct VerticalMark {
    /// Value on the horizontal axis.
    pub at: f64,
    /// Name above the first panel; empty for none.
    pub name: String,
}

/// Draws the lines across a panel, and the given names above it.
pub fn draw(
    drawing: &mut Drawing,
    frame: &Frame,
    marks: &[VerticalMark],
    names: &[(usize, f64, &str)],
) {
    for mark in marks {
        if let Some(fraction) = fraction_inside(&frame.across, mark) {
            let x = frame.x + frame.width * fraction;
            let ends = [(x, frame.y), (x, frame.y + frame.height)];
            drawing.line(&ends, FAINT, HAIR, Some("1.5 1.5"));
        }
    }
    for (row, at, _) in names {
        let y = frame.y - 3.0 - ROW * *row as f64;
        if *row > 0 {
            let x = frame.x + at;
            drawing.line(&[(x, y + 1.5), (x, frame.y)], GRID, HAIR, None);
        }
    }
    for (row, at, name) in names {
        let y = frame.y - 3.0 - ROW * *row as f64;
        let (centre, _) = centre_and_half_width(name, *at, (frame.x, frame.width));
        drawing.note_with_halo((frame.x + centre, y), Anchor::Middle, INK, name);
    }
}

/// Returns positions of the names without overlap: row, distance from the left edge [pt], name.
/// The panels have the margin `left` and the given width [pt]. Of consecutive marks with one name
/// only the first is named. Names without room are omitted.
pub fn name_positions<'a>(
    x: &Axis,
    marks: &'a [VerticalMark],
    (left, width): (f64, f64),
) -> Vec<(usize, f64, &'a str)> {
    let mut ends = [f64::NEG_INFINITY; LABEL_ROWS];
    let mut out = Vec::new();
    let mut before = "";
    for mark in marks.iter().filter(|mark| !mark.name.is_empty()) {
        let repeated = std::mem::replace(&mut before, mark.name.as_str()) == mark.name;
        if repeated {
            continue;
        }
        let Some(fraction) = fraction_inside(x, mark) else {
            continue;
        };
        let at = fraction * width;
        let (centre, half) = centre_and_half_width(&mark.name, at, (left, width));
        if let Some(row) = ends.iter().position(|end| centre - half > end + 4.0) {
            ends[row] = centre + half;
            out.push((row, at, mark.name.as_str()));
        }
    }
    out
}

/// Returns the position of a mark along the axis, if it lies inside its range.
fn fraction_inside(axis: &Axis, mark: &VerticalMark) -> Option<f64> {
    axis.fraction(mark.at).filter(|fraction| (0.0..=1.0).contains(fraction))
}

/// Returns the centre, kept on the drawing, and half the width of a name at `at` [pt]; the panels
/// have the margin `left` and the given width.
fn centre_and_half_width(name: &str, at: f64, (left, width): (f64, f64)) -> (f64, f64) {
    let half = 0.5 * text::width(name, SMALL);
    let centre = at.clamp(half - left + 12.0, (width + RIGHT - half).max(half));
    (centre, half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::AxisRange;

    #[test]
    fn names_of_marks_do_not_overlap() {
        let x = Axis::linear("t", 0.0, 10.0, 5, AxisRange::Tight);
        let mark = |at, name: &str| VerticalMark { at, name: name.to_owned() };
        let marks = [
            mark(5.0, "kiss"),
            mark(5.1, "role change"),
            mark(5.2, "separation"),
            mark(5.21, "separation"),
            mark(5.3, "landing"),
            mark(5.4, "rest"),
            mark(5.5, "one too many"),
            mark(99.0, "outside"),
        ];
        let placed = name_positions(&x, &marks, (38.0, 200.0));
        assert_eq!(
            placed.iter().map(|(row, _, name)| (*row, *name)).collect::<Vec<_>>(),
            [(0, "kiss"), (1, "role change"), (2, "separation"), (3, "landing"), (4, "rest")]
        );
    }
}
