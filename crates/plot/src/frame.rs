//! A rectangular frame with two axes, for points, boxes and curves; markers of data points.

use crate::axis::Axis;
use crate::curve;
use crate::drawing::{Anchor, Drawing, path_data};
use crate::style::{FAINT, GRID, LINE, TEXT, TICK};
use crate::{text, ticks};

/// Distance of two lines of a label [pt].
const LINE_SPACING: f64 = 9.0;

/// A rectangle on paper with a horizontal and a vertical axis.
pub struct Frame {
    /// Left edge [pt].
    pub x: f64,
    /// Top edge [pt].
    pub y: f64,
    /// Width [pt].
    pub width: f64,
    /// Height [pt].
    pub height: f64,
    /// Horizontal axis.
    pub across: Axis,
    /// Vertical axis.
    pub up: Axis,
}

impl Frame {
    /// Returns the horizontal position of a value [pt]; the left edge if it has none.
    pub fn px(&self, value: f64) -> f64 {
        self.x + self.width * self.across.fraction(value).unwrap_or(0.0)
    }

    /// Returns the vertical position of a value [pt]; the bottom edge if it has none.
    pub fn py(&self, value: f64) -> f64 {
        self.y + self.height * (1.0 - self.up.fraction(value).unwrap_or(0.0))
    }

    /// Returns the position of a data point [pt]; `None` if an axis cannot represent it.
    pub fn position(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        Some((
            self.x + self.width * self.across.fraction(x)?,
            self.y + self.height * (1.0 - self.up.fraction(y)?),
        ))
    }

    /// Draws grid lines at the labelled ticks of the vertical axis.
    pub fn grid(&self, drawing: &mut Drawing) {
        for (value, _) in self.up.ticks.iter().filter(|(_, name)| !name.is_empty()) {
            let y = self.py(*value);
            if y > self.y + 1.0 && y < self.y + self.height - 1.0 {
                drawing.line(&[(self.x, y), (self.x + self.width, y)], GRID, 0.5, None);
            }
        }
    }

    /// Draws the outline, the ticks, and the labels of the selected axes.
    pub fn outline(&self, drawing: &mut Drawing, labelled: Labelled) {
        let (x, y, width, height) = (self.x, self.y, self.width, self.height);
        ticks::horizontal(drawing, &self.across, (x, y + height), width, labelled.across);
        ticks::vertical(drawing, &self.up, (x, y), height, labelled.up, None);
        drawing.outline(x, y, width, height);
        if labelled.across {
            self.horizontal_label(drawing);
        }
        if labelled.up {
            let right = x - TICK - ticks::widest(&self.up) - 7.0;
            let lines = self.upward_lines();
            for (i, line) in lines.iter().rev().enumerate() {
                drawing.upward_text((right - LINE_SPACING * i as f64, y + 0.5 * height), line);
            }
        }
    }

    /// Returns the lines of the vertical label: name and unit are apart if they are longer than the
    /// frame is high.
    fn upward_lines(&self) -> Vec<&str> {
        let label = self.up.label.as_str();
        match label.split_once("  ") {
            Some((name, unit)) if text::width(label, TEXT) > self.height + 8.0 => {
                vec![name, unit.trim_start()]
            }
            _ => vec![label],
        }
    }

    /// Returns the height of the tick labels and the label below the frame [pt].
    pub fn foot(&self) -> f64 {
        TICK + ticks::height(&self.across, self.width) + 17.0
    }

    /// Draws the label of the horizontal axis below its tick labels.
    pub fn horizontal_label(&self, drawing: &mut Drawing) {
        let base = self.y + self.height + TICK + ticks::height(&self.across, self.width) + 11.0;
        let middle = self.x + 0.5 * self.width;
        drawing.text((middle, base), Anchor::Middle, &self.across.label);
    }

    /// Draws a curve, clipped to the frame and interrupted at points without a position; `clip` is
    /// an identifier unique in the drawing.
    pub fn curve(
        &self,
        drawing: &mut Drawing,
        points: &[(f64, f64)],
        colour: &str,
        dash: Option<&str>,
        clip: &str,
    ) {
        drawing.begin_clip(clip, self.x, self.y, self.width, self.height);
        for segment in curve::segments(points, |point| self.position(point)) {
            drawing.line(&curve::thinned(&segment), colour, LINE, dash);
        }
        drawing.end_clip();
    }

    /// Draws a dashed reference line at a vertical value.
    pub fn level(&self, drawing: &mut Drawing, value: f64) {
        let y = self.py(value);
        let ends = [(self.x, y), (self.x + self.width, y)];
        drawing.line(&ends, FAINT, 0.8, Some("4 2.5"));
    }
}

/// Axes of a frame that have labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Labelled {
    /// Horizontal axis.
    pub across: bool,
    /// Vertical axis.
    pub up: bool,
}

impl Labelled {
    /// Labels on both axes.
    pub const BOTH: Labelled = Labelled { across: true, up: true };
}

/// Fill of a marker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fill {
    /// Filled with its colour.
    Solid,
    /// An outline; usually marks a bound.
    Hollow,
}

/// Shapes of data points that differ without colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// Circle.
    Circle,
    /// Square.
    Square,
    /// Triangle.
    Triangle,
    /// Diamond.
    Diamond,
    /// Triangle that points down.
    TriangleDown,
    /// Pentagon.
    Pentagon,
}

impl Marker {
    /// Returns the n-th shape, in a cycle of six.
    pub fn nth(n: usize) -> Marker {
        [
            Marker::Circle,
            Marker::Square,
            Marker::Triangle,
            Marker::Diamond,
            Marker::TriangleDown,
            Marker::Pentagon,
        ][n % 6]
    }

    /// Draws the marker around `(x, y)` [pt].
    pub fn draw(
        self,
        drawing: &mut Drawing,
        (x, y): (f64, f64),
        size: f64,
        colour: &str,
        fill: Fill,
    ) {
        let ring = |n: i32, radius: f64| -> Vec<(f64, f64)> {
            (0..n)
                .map(|i| (std::f64::consts::TAU * f64::from(i) / f64::from(n)).sin_cos())
                .map(|(sin, cos)| (x + size * radius * sin, y - size * radius * cos))
                .collect()
        };
        let polygon = |scale: f64, corners: &[(f64, f64)]| -> Vec<(f64, f64)> {
            let corner = |(a, b): &(f64, f64)| (x + scale * a, y + scale * b);
            corners.iter().map(corner).collect()
        };
        let corners = match self {
            Marker::Circle => ring(24, 1.0),
            Marker::Pentagon => ring(5, 1.1),
            Marker::TriangleDown => polygon(size, &[(-1.1, -0.8), (1.1, -0.8), (0.0, 1.2)]),
            Marker::Square => {
                polygon(0.88 * size, &[(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
            }
            Marker::Triangle => polygon(size, &[(-1.1, 0.8), (1.1, 0.8), (0.0, -1.2)]),
            Marker::Diamond => polygon(size, &[(-1.2, 0.0), (0.0, -1.2), (1.2, 0.0), (0.0, 1.2)]),
        };
        let (fill, stroke, width) = match fill {
            Fill::Hollow => ("none", colour, "0.9"),
            Fill::Solid => (colour, "#ffffff", "0.5"),
        };
        let style = format!("fill=\"{fill}\" stroke=\"{stroke}\" stroke-width=\"{width}\"");
        drawing.path(&path_data(&corners, true), &style);
    }
}
