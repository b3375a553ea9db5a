//! A frame with equal scale along both axes, for maps, side views and sections; colour bars.

use crate::axis::{Axis, AxisRange};
use crate::drawing::{Anchor, Drawing, path_data};
use crate::style::{self, HAIR, INK, SMALL, TICK};
use crate::ticks;

/// The displayed range of two of the three coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Lower ends [m].
    pub low: (f64, f64),
    /// Upper ends [m].
    pub high: (f64, f64),
}

impl Window {
    /// Width [m].
    pub fn width(&self) -> f64 {
        self.high.0 - self.low.0
    }
    /// Height [m].
    pub fn height(&self) -> f64 {
        self.high.1 - self.low.1
    }
    /// Returns the part inside another window; its size is negative if there is none.
    pub fn intersection(&self, other: Window) -> Window {
        let larger = |a: (f64, f64), b: (f64, f64)| (a.0.max(b.0), a.1.max(b.1));
        let smaller = |a: (f64, f64), b: (f64, f64)| (a.0.min(b.0), a.1.min(b.1));
        Window { low: larger(self.low, other.low), high: smaller(self.high, other.high) }
    }
}

/// Returns the unit suited to lengths of `size` [m]: its name, and the number of units per metre.
pub fn length_unit(size: f64) -> (&'static str, f64) {
    if size < 2e-4 {
        ("µm", 1e6)
    } else if size < 0.5 {
        ("mm", 1e3)
    } else {
        ("m", 1.0)
    }
}

/// A frame on paper that shows a window at equal scale.
#[derive(Clone, Copy, Debug)]
pub struct EqualAspectFrame {
    /// Displayed range.
    pub window: Window,
    /// Upper left corner [pt].
    pub corner: (f64, f64),
    /// Scale [pt/m].
    pub scale: f64,
    /// Whether the vertical coordinate increases downwards.
    pub flipped: bool,
}

impl EqualAspectFrame {
    /// Width on paper [pt].
    pub fn width(&self) -> f64 {
        self.window.width() * self.scale
    }
    /// Height on paper [pt].
    pub fn height(&self) -> f64 {
        self.window.height() * self.scale
    }
    /// Returns the distance of a height from the upper edge of the window [m].
    fn depth(&self, y: f64) -> f64 {
        if self.flipped { y - self.window.low.1 } else { self.window.high.1 - y }
    }
    /// Returns the position on paper [pt] of a point [m].
    pub fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (
            self.corner.0 + (x - self.window.low.0) * self.scale,
            self.corner.1 + self.depth(y) * self.scale,
        )
    }
    /// Returns the point [m] at a position on paper [pt].
    pub fn point(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let depth = (y - self.corner.1) / self.scale;
        let up = if self.flipped { self.window.low.1 + depth } else { self.window.high.1 - depth };
        (self.window.low.0 + (x - self.corner.0) / self.scale, up)
    }
    /// Returns SVG path data through points [m].
    pub fn path(&self, points: &[(f64, f64)], closed: bool) -> String {
        let placed: Vec<_> = points.iter().map(|p| self.at(*p)).collect();
        path_data(&placed, closed)
    }

    /// Returns closed loops as one path; a loop inside another that turns the other way is a hole.
    pub fn paths(&self, loops: &[Vec<(f64, f64)>]) -> String {
        loops.iter().map(|points| self.path(points, true)).collect()
    }

    /// Begins clipping to the frame.
    pub fn clip(&self, drawing: &mut Drawing, name: &str) {
        let (x, y) = self.corner;
        drawing.begin_clip(name, x, y, self.width(), self.height());
    }

    /// Draws the outline, the ticks and the axis labels; `None` also omits the tick labels.
    pub fn frame(&self, drawing: &mut Drawing, labels: (Option<&str>, Option<&str>)) {
        let (x, y) = self.corner;
        let (width, height) = (self.width(), self.height());
        let (_, factor) = length_unit(self.window.width().max(self.window.height()));
        let axis = |low: f64, high: f64, length: f64, spacing: f64| {
            let count = ((length / spacing) as usize).clamp(2, 8);
            Axis::linear("", low * factor, high * factor, count, AxisRange::Tight)
        };
        let Window { low, high } = self.window;
        let across = axis(low.0, high.0, width, 18.0);
        let bottom = y + height;
        ticks::horizontal(drawing, &across, (x, bottom), width, labels.0.is_some());
        let up = axis(low.1, high.1, height, 22.0);
        let up = if self.flipped { up.reversed() } else { up };
        ticks::vertical(drawing, &up, (x, y), height, labels.1.is_some(), None);
        drawing.outline(x, y, width, height);
        if let Some(label) = labels.0.filter(|label| !label.is_empty()) {
            let base = (x + 0.5 * width, bottom + TICK + SMALL + 10.5);
            drawing.text(base, Anchor::Middle, label);
        }
        if let Some(label) = labels.1.filter(|label| !label.is_empty()) {
            let base = x - TICK - ticks::widest(&up) - 6.0;
            drawing.upward_text((base, y + 0.5 * height), label);
        }
    }
}

/// Draws a horizontal colour bar with its label below; an end is a triangle if values lie beyond
/// it.
pub fn colour_bar(
    drawing: &mut Drawing,
    corner: (f64, f64),
    width: f64,
    palette: &[[u8; 3]],
    axis: &Axis,
    beyond: (bool, bool),
) {
    const HEIGHT: f64 = 6.0;
    let (x, y) = corner;
    let raster = crate::raster::Raster {
        width: palette.len(),
        height: 1,
        pixels: (0..palette.len()).map(|i| i.min(255) as u8).collect(),
        palette: palette.to_vec(),
    };
    drawing.raster(x, y, width, HEIGHT, raster);
    let tip = |drawing: &mut Drawing, at: f64, out: f64, colour: [u8; 3]| {
        let triangle = [(at, y), (at + out, y + 0.5 * HEIGHT), (at, y + HEIGHT)];
        let style = format!(
            "fill=\"{}\" stroke=\"{INK}\" stroke-width=\"{HAIR}\"",
            crate::colormap::hex(colour)
        );
        drawing.path(&path_data(&triangle, true), &style);
    };
    if let (true, Some(first)) = (beyond.0, palette.first()) {
        tip(drawing, x, -5.0, *first);
    }
    if let (true, Some(last)) = (beyond.1, palette.last()) {
        tip(drawing, x + width, 5.0, *last);
    }
    drawing.outline(x, y, width, HEIGHT);
    ticks::horizontal(drawing, axis, (x, y + HEIGHT), width, true);
    let base = (x + 0.5 * width, y + HEIGHT + TICK + SMALL + 10.5);
    drawing.text(base, Anchor::Middle, &axis.label);
}

/// Returns SVG attributes of an outline with a light fill; `strength` from 0 to 1 sets opacity.
pub fn outline_style(colour: &str, strength: f64) -> String {
    format!(
        "fill=\"{colour}\" fill-opacity=\"{:.2}\" stroke=\"{colour}\" stroke-opacity=\"{:.2}\" \
         stroke-width=\"{}\" stroke-linejoin=\"round\"",
        0.3 * strength,
        strength,
        style::HAIR + 0.1
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flipped_frame_has_the_lower_end_on_top() {
        let window = Window { low: (0.0, 1.0), high: (2.0, 4.0) };
        let frame = EqualAspectFrame { window, corner: (10.0, 20.0), scale: 5.0, flipped: false };
        assert_eq!(frame.at((1.0, 4.0)), (15.0, 20.0));
        let flipped = EqualAspectFrame { flipped: true, ..frame };
        assert_eq!(flipped.at((1.0, 1.0)), (15.0, 20.0));
        for frame in [frame, flipped] {
            assert_eq!(frame.point(frame.at((0.5, 3.5))), (0.5, 3.5));
        }
        let axis = Axis::linear("", 1.0, 4.0, 3, AxisRange::Tight).reversed();
        assert_eq!([1.0, 4.0].map(|value| axis.fraction(value)), [Some(1.0), Some(0.0)]);
    }
}
