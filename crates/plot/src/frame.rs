//! A frame with axes for points, boxes and curves.

use crate::axis::Axis;
use crate::style::{FAINT, GRID, HAIR, INK, LINE, SMALL, TEXT, TICK};
use crate::svg::{Anchor, Drawing, path_data};
use crate::text;

/// A frame on the paper with its axes.
pub struct Frame {
    /// Left end [pt].
    pub x: f64,
    /// Top [pt].
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
    /// Place of a horizontal value [pt].
    pub fn px(&self, value: f64) -> f64 {
        self.x + self.width * self.across.place(value).unwrap_or(0.0)
    }
    /// Place of a vertical value [pt].
    pub fn py(&self, value: f64) -> f64 {
        self.y + self.height * (1.0 - self.up.place(value).unwrap_or(0.0))
    }

    /// Grid lines at the labelled ticks of the vertical axis, below the data.
    pub fn grid(&self, drawing: &mut Drawing) {
        for (value, _) in self.up.ticks.iter().filter(|(_, name)| !name.is_empty()) {
            let y = self.py(*value);
            if y > self.y + 1.0 && y < self.y + self.height - 1.0 {
                drawing.line(&[(self.x, y), (self.x + self.width, y)], GRID, 0.5, None);
            }
        }
    }

    /// The frame, its ticks and labels; `names` says which axes are labelled.
    pub fn outline(&self, drawing: &mut Drawing, names: (bool, bool)) {
        let bottom = self.y + self.height;
        for (value, name) in &self.across.ticks {
            let x = self.px(*value);
            drawing.line(&[(x, bottom), (x, bottom + TICK)], INK, HAIR, None);
            if names.0 {
                drawing.label(
                    x,
                    bottom + TICK + SMALL + 0.5,
                    Anchor::Middle,
                    SMALL,
                    INK,
                    name,
                    false,
                );
            }
        }
        let mut widest: f64 = 0.0;
        for (value, name) in &self.up.ticks {
            let y = self.py(*value);
            drawing.line(&[(self.x - TICK, y), (self.x, y)], INK, HAIR, None);
            if names.1 {
                widest = widest.max(text::width(name, SMALL));
                drawing.label(
                    self.x - TICK - 2.0,
                    y + 0.36 * SMALL,
                    Anchor::End,
                    SMALL,
                    INK,
                    name,
                    false,
                );
            }
        }
        let outline = format!("fill=\"none\" stroke=\"{INK}\" stroke-width=\"{HAIR}\"");
        drawing.rectangle(self.x, self.y, self.width, self.height, &outline);
        if names.0 {
            let y = bottom + TICK + SMALL + 11.0;
            drawing.label(
                self.x + 0.5 * self.width,
                y,
                Anchor::Middle,
                TEXT,
                INK,
                &self.across.label,
                false,
            );
        }
        if names.1 {
            let x = self.x - TICK - widest - 7.0;
            drawing.label(
                x,
                self.y + 0.5 * self.height,
                Anchor::Middle,
                TEXT,
                INK,
                &self.up.label,
                true,
            );
        }
    }

    /// A curve, clipped to the frame.
    pub fn curve(
        &self,
        drawing: &mut Drawing,
        points: &[(f64, f64)],
        colour: &str,
        dash: Option<&str>,
        clip: &str,
    ) {
        let placed: Vec<(f64, f64)> = points
            .iter()
            .map(|(x, y)| (self.px(*x), self.py(*y)))
            .collect();
        drawing.begin_clip(clip, self.x, self.y, self.width, self.height);
        drawing.line(&thin(&placed), colour, LINE, dash);
        drawing.end_clip();
    }

    /// A horizontal line across the frame.
    pub fn level(&self, drawing: &mut Drawing, value: f64) {
        let y = self.py(value);
        drawing.line(
            &[(self.x, y), (self.x + self.width, y)],
            FAINT,
            0.8,
            Some("4 2.5"),
        );
    }
}

/// Leaves out points that lie nearer than a fifth of a point to the one before.
fn thin(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut out: Vec<(f64, f64)> = Vec::with_capacity(points.len());
    for (i, p) in points.iter().enumerate() {
        let far = out
            .last()
            .is_none_or(|last| (p.0 - last.0).hypot(p.1 - last.1) > 0.2);
        if far || i + 1 == points.len() {
            out.push(*p);
        }
    }
    out
}

/// Signs that can be told apart without colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// Circle.
    Circle,
    /// Square.
    Square,
    /// Triangle.
    Triangle,
    /// Diamond.
    Diamond,
    /// Triangle on its tip.
    Down,
    /// Pentagon.
    Pentagon,
}

impl Sign {
    /// The n-th sign.
    pub fn number(n: usize) -> Sign {
        [
            Sign::Circle,
            Sign::Square,
            Sign::Triangle,
            Sign::Diamond,
            Sign::Down,
            Sign::Pentagon,
        ][n % 6]
    }

    /// Draws it; hollow for a bound.
    pub fn draw(
        self,
        drawing: &mut Drawing,
        (x, y): (f64, f64),
        size: f64,
        colour: &str,
        hollow: bool,
    ) {
        let s = size;
        let ring = |n: i32, s0: f64| -> Vec<(f64, f64)> {
            (0..n)
                .map(|i| (std::f64::consts::TAU * f64::from(i) / f64::from(n)).sin_cos())
                .map(|(sin, cos)| (x + s * s0 * sin, y - s * s0 * cos))
                .collect()
        };
        let corners: Vec<(f64, f64)> = match self {
            Sign::Circle => ring(24, 1.0),
            Sign::Pentagon => ring(5, 1.1),
            Sign::Down => [(-1.1, -0.8), (1.1, -0.8), (0.0, 1.2)]
                .iter()
                .map(|(a, b)| (x + s * a, y + s * b))
                .collect(),
            Sign::Square => [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .iter()
                .map(|(a, b)| (x + 0.88 * s * a, y + 0.88 * s * b))
                .collect(),
            Sign::Triangle => [(-1.1, 0.8), (1.1, 0.8), (0.0, -1.2)]
                .iter()
                .map(|(a, b)| (x + s * a, y + s * b))
                .collect(),
            Sign::Diamond => [(-1.2, 0.0), (0.0, -1.2), (1.2, 0.0), (0.0, 1.2)]
                .iter()
                .map(|(a, b)| (x + s * a, y + s * b))
                .collect(),
        };
        let fill = if hollow { "none" } else { colour };
        let style = format!(
            "fill=\"{fill}\" stroke=\"{}\" stroke-width=\"0.9\"",
            if hollow { colour } else { "#ffffff" }
        );
        let style = if hollow {
            style
        } else {
            style.replace("0.9", "0.5")
        };
        drawing.path(&path_data(&corners, true), &style);
    }
}
