//! A frame of equal scale along both axes: maps, side views, sections.

use crate::axis::Axis;
use crate::style::{self, HAIR, INK, SMALL, TEXT, TICK};
use crate::svg::{Anchor, Drawing, path_data};

/// A window on two of the three coordinates.
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
}

/// Unit for lengths of this size: its name and how many make a metre.
pub fn length_unit(size: f64) -> (&'static str, f64) {
    if size < 2e-4 {
        ("µm", 1e6)
    } else if size < 0.5 {
        ("mm", 1e3)
    } else {
        ("m", 1.0)
    }
}

/// A frame on the paper.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// What it shows.
    pub window: Window,
    /// Upper left corner [pt].
    pub corner: (f64, f64),
    /// Points per metre.
    pub scale: f64,
}

impl Plan {
    /// Width on the paper [pt].
    pub fn width(&self) -> f64 {
        self.window.width() * self.scale
    }
    /// Height on the paper [pt].
    pub fn height(&self) -> f64 {
        self.window.height() * self.scale
    }
    /// Place of a point on the paper [pt].
    pub fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (
            self.corner.0 + (x - self.window.low.0) * self.scale,
            self.corner.1 + (self.window.high.1 - y) * self.scale,
        )
    }
    /// Path data of a line through points [m].
    pub fn path(&self, points: &[(f64, f64)], closed: bool) -> String {
        path_data(
            &points.iter().map(|p| self.at(*p)).collect::<Vec<_>>(),
            closed,
        )
    }

    /// Opens a clip to the frame.
    pub fn clip(&self, drawing: &mut Drawing, name: &str) {
        drawing.begin_clip(
            name,
            self.corner.0,
            self.corner.1,
            self.width(),
            self.height(),
        );
    }

    /// The frame with ticks; `names` are the labels of the axes, none leaves out the tick labels.
    pub fn frame(&self, drawing: &mut Drawing, names: (Option<&str>, Option<&str>)) {
        let (x, y) = self.corner;
        let (width, height) = (self.width(), self.height());
        let (_, factor) = length_unit(self.window.width().max(self.window.height()));
        let axis = |low: f64, high: f64, length: f64, room: f64| {
            Axis::linear(
                "",
                low * factor,
                high * factor,
                ((length / room) as usize).clamp(2, 8),
                true,
            )
        };
        let across = axis(self.window.low.0, self.window.high.0, width, 18.0);
        for (value, name) in &across.ticks {
            let Some(place) = across.place(*value) else {
                continue;
            };
            let at = x + width * place;
            drawing.line(
                &[(at, y + height), (at, y + height + TICK)],
                INK,
                HAIR,
                None,
            );
            if names.0.is_some() {
                drawing.label(
                    at,
                    y + height + TICK + SMALL + 0.5,
                    Anchor::Middle,
                    SMALL,
                    INK,
                    name,
                    false,
                );
            }
        }
        let up = axis(self.window.low.1, self.window.high.1, height, 22.0);
        let mut widest: f64 = 0.0;
        for (value, name) in &up.ticks {
            let Some(place) = up.place(*value) else {
                continue;
            };
            let at = y + height * (1.0 - place);
            drawing.line(&[(x - TICK, at), (x, at)], INK, HAIR, None);
            if names.1.is_some() {
                widest = widest.max(crate::text::width(name, SMALL));
                drawing.label(
                    x - TICK - 2.0,
                    at + 0.36 * SMALL,
                    Anchor::End,
                    SMALL,
                    INK,
                    name,
                    false,
                );
            }
        }
        drawing.rectangle(
            x,
            y,
            width,
            height,
            &format!("fill=\"none\" stroke=\"{INK}\" stroke-width=\"{HAIR}\""),
        );
        if let Some(name) = names.0.filter(|name| !name.is_empty()) {
            drawing.label(
                x + 0.5 * width,
                y + height + TICK + SMALL + 10.5,
                Anchor::Middle,
                TEXT,
                INK,
                name,
                false,
            );
        }
        if let Some(name) = names.1.filter(|name| !name.is_empty()) {
            drawing.label(
                x - TICK - widest - 6.0,
                y + 0.5 * height,
                Anchor::Middle,
                TEXT,
                INK,
                name,
                true,
            );
        }
    }
}

/// A horizontal colour bar with its label below; the ends point outwards where values lie beyond.
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
    drawing.rectangle(
        x,
        y,
        width,
        HEIGHT,
        &format!("fill=\"none\" stroke=\"{INK}\" stroke-width=\"{HAIR}\""),
    );
    for (value, name) in &axis.ticks {
        let Some(place) = axis.place(*value) else {
            continue;
        };
        let at = x + width * place;
        drawing.line(
            &[(at, y + HEIGHT), (at, y + HEIGHT + TICK)],
            INK,
            HAIR,
            None,
        );
        drawing.label(
            at,
            y + HEIGHT + TICK + SMALL + 0.5,
            Anchor::Middle,
            SMALL,
            INK,
            name,
            false,
        );
    }
    drawing.label(
        x + 0.5 * width,
        y + HEIGHT + TICK + SMALL + 10.5,
        Anchor::Middle,
        TEXT,
        INK,
        &axis.label,
        false,
    );
}

/// An outline filled lightly in `colour`.
pub fn grain_style(colour: &str, strength: f64) -> String {
    format!(
        "fill=\"{colour}\" fill-opacity=\"{:.2}\" stroke=\"{colour}\" stroke-opacity=\"{:.2}\" stroke-width=\"{}\" stroke-linejoin=\"round\"",
        0.3 * strength,
        strength,
        style::HAIR + 0.1
    )
}
