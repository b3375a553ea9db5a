//! Curves in panels stacked over a shared horizontal axis, with marked instants.

mod marks;

use crate::axis::{Axis, AxisRange, extent};
use crate::curve;
use crate::drawing::{Anchor, Drawing};
use crate::frame::Frame;
use crate::legend::{Entry, Legend};
use crate::style::{COLUMN, FAINT, LINE, SMALL, TEXT, TICK};
use crate::text;
use crate::ticks;

pub use marks::VerticalMark;
use marks::{RIGHT, ROW};

/// Smallest margin to the left of the panels [pt].
const LEFT: f64 = 38.0;
/// Baseline of the labels of the vertical axes [pt].
const LABEL: f64 = 9.0;

/// A curve.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name in the legend; `None` for a curve without an entry.
    pub name: Option<String>,
    /// Points in data units; values that are not finite interrupt the curve.
    pub points: Vec<(f64, f64)>,
    /// Colour.
    pub colour: &'static str,
    /// SVG dash pattern.
    pub dash: Option<&'static str>,
}

impl Series {
    /// Creates a solid curve without an entry in the legend.
    pub fn new(points: Vec<(f64, f64)>, colour: &'static str) -> Series {
        Series { name: None, points, colour, dash: None }
    }

    /// Sets the name in the legend.
    #[must_use]
    pub fn named(mut self, name: impl Into<String>) -> Series {
        self.name = Some(name.into());
        self
    }

    /// Sets the SVG dash pattern.
    #[must_use]
    pub fn dashed(mut self, pattern: &'static str) -> Series {
        self.dash = Some(pattern);
        self
    }

    /// Returns the entry in the legend, if the curve has a name.
    fn entry(&self) -> Option<Entry> {
        Some(Entry::line(self.name.clone()?, self.colour, self.dash))
    }

    /// Returns the vertical values.
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        self.points.iter().map(|point| point.1)
    }

    /// Returns the point whose value has the largest magnitude; `None` without finite values.
    pub fn peak(&self) -> Option<(f64, f64)> {
        let finite = self.points.iter().copied().filter(|point| point.1.is_finite());
        finite.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
    }
}

/// A panel with its curves.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Vertical axis.
    pub y: Axis,
    /// Curves.
    pub series: Vec<Series>,
    /// Value and note of each horizontal reference line.
    pub levels: Vec<(f64, String)>,
    /// Height of the frame [pt].
    pub height: f64,
}

impl Panel {
    /// Creates a panel of the given height [pt] with an axis that covers the curves and the values
    /// `also`.
    pub fn linear(label: &str, series: Vec<Series>, also: &[f64], height: f64) -> Panel {
        let values = series.iter().flat_map(Series::values);
        let (low, high) = extent(values.chain(also.iter().copied())).unwrap_or((0.0, 1.0));
        Panel::with_axis(Axis::linear(label, low, high, 5, AxisRange::Rounded), series, height)
    }

    /// Creates a panel with a logarithmic axis; `None` if no value is positive.
    pub fn log(label: &str, series: Vec<Series>, height: f64) -> Option<Panel> {
        let values = series.iter().flat_map(Series::values);
        let (low, high) = extent(values.filter(|v| *v > 0.0))?;
        Some(Panel::with_axis(Axis::log(label, low, high), series, height))
    }

    /// Creates a panel with a given vertical axis.
    pub fn with_axis(y: Axis, series: Vec<Series>, height: f64) -> Panel {
        Panel { y, series, levels: Vec::new(), height }
    }
}

/// Draws the panels over one horizontal axis, in a drawing of one column width.
pub fn stacked_panels(x: &Axis, panels: &[Panel], verticals: &[VerticalMark]) -> Drawing {
    // The descenders of an axis label and its distance from the tick labels take 4.5 pt.
    let widest = panels.iter().map(|panel| ticks::widest(&panel.y)).fold(0.0, f64::max);
    let left = LEFT.max(LABEL + 4.5 + widest + TICK + 2.0);
    let width = COLUMN - left - RIGHT;
    let names = marks::name_positions(x, verticals, (left, width));
    let rows = names.iter().map(|(row, _, _)| row + 1).max().unwrap_or(0);
    let names_of = |panel: &Panel| -> Vec<Option<String>> {
        panel.series.iter().map(|s| s.name.clone()).collect()
    };
    // A panel with the names of the previous panel has no legend of its own.
    let legend = |i: usize| {
        let repeated = i > 0 && names_of(&panels[i]) == names_of(&panels[i - 1]);
        let series = panels[i].series.iter().filter(|_| !repeated);
        Legend::new(series.filter_map(Series::entry), width)
    };
    let legends: Vec<Legend> = (0..panels.len()).map(legend).collect();
    let top = |i: usize| {
        let marks = if i == 0 { ROW * rows as f64 } else { 0.0 };
        let letter = if panels.len() > 1 { 5.0 } else { 0.0 };
        7.0 + letter + legends[i].height() + marks
    };
    // A long label makes its panel taller.
    let height = |panel: &Panel| panel.height.max(text::width(&panel.y.label, TEXT) + 4.0);
    let heights: f64 = panels.iter().enumerate().map(|(i, panel)| top(i) + height(panel)).sum();
    let mut drawing = Drawing::new(COLUMN, heights + 26.0);
    let mut y = 0.0;
    for (i, panel) in panels.iter().enumerate() {
        legends[i].draw(&mut drawing, (left, y + 7.0));
        y += top(i);
        let frame = Frame {
            x: left,
            y,
            width,
            height: height(panel),
            across: x.clone(),
            up: panel.y.clone(),
        };
        let named = if i == 0 { names.as_slice() } else { &[] };
        marks::draw(&mut drawing, &frame, verticals, named);
        draw_panel(&mut drawing, &frame, panel, i);
        y += frame.height;
        let last = i + 1 == panels.len();
        ticks::horizontal(&mut drawing, x, (left, y), width, last);
        if last {
            frame.horizontal_label(&mut drawing);
        }
        if panels.len() > 1 {
            drawing.text((2.0, frame.y - 4.0), Anchor::Start, &text::letter(i));
        }
    }
    drawing
}

fn draw_panel(drawing: &mut Drawing, frame: &Frame, panel: &Panel, index: usize) {
    let (x, y, width, height) = (frame.x, frame.y, frame.width, frame.height);
    ticks::vertical(drawing, &frame.up, (x, y), height, true, Some(width));
    let clip = format!("clip-{index}");
    drawing.begin_clip(&clip, x, y - 1.0, width, height + 2.0);
    for (value, _) in &panel.levels {
        let level = frame.py(*value);
        drawing.line(&[(x, level), (x + width, level)], FAINT, 0.8, Some("5 2.5"));
    }
    for series in &panel.series {
        for segment in curve::segments(&series.points, |p| frame.position(p)) {
            let points = curve::simplified(&segment);
            drawing.line(&points, series.colour, LINE, series.dash);
        }
    }
    drawing.end_clip();
    for (value, note) in &panel.levels {
        let place = note_position(frame, panel, frame.py(*value), text::width(note, SMALL));
        drawing.note_with_halo(place, Anchor::Start, FAINT, note);
    }
    drawing.outline(x, y, width, height);
    drawing.upward_text((LABEL, y + 0.5 * height), &panel.y.label);
}

/// Returns the left end and baseline [pt] where the note of a reference line at height `y` covers
/// the fewest points of the curves.
fn note_position(frame: &Frame, panel: &Panel, y: f64, width: f64) -> (f64, f64) {
    let points = panel.series.iter().flat_map(|series| &series.points);
    let points: Vec<_> = points.filter_map(|p| frame.position(*p)).collect();
    let covered = |left: f64, base: f64| {
        let inside = |p: &&(f64, f64)| {
            (left - 2.0..left + width + 2.0).contains(&p.0)
                && (base - SMALL - 1.0..base + 3.0).contains(&p.1)
        };
        points.iter().filter(inside).count()
    };
    let room = frame.width - width - 6.0;
    let ends = [1.0, 0.0, 0.75, 0.25, 0.5].map(|part| frame.x + 3.0 + part * room);
    let bases = [y - 2.5, y + SMALL + 1.5];
    let places = ends.iter().flat_map(|left| bases.map(|base| (*left, base)));
    let inside =
        |(_, base): &(f64, f64)| *base > frame.y + SMALL && *base < frame.y + frame.height - 1.0;
    let best = places.filter(inside).min_by_key(|(left, base)| covered(*left, *base));
    best.unwrap_or((ends[0], bases[0]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_margin_follows_the_widest_tick_label() {
        let x = Axis::linear("t", 0.0, 10.0, 5, AxisRange::Tight);
        let panel = |low: f64| {
            let points = vec![(0.0, low), (10.0, 0.0)];
            Panel::linear("*v*_{z}  [m/s]", vec![Series::new(points, FAINT)], &[], 60.0)
        };
        // Left edges of the frames, which are the only rectangles with an outline.
        let edges = |panels: &[Panel]| -> Vec<f64> {
            let svg = stacked_panels(&x, panels, &[]).to_svg("f", "t", "d");
            let document = resvg::usvg::roxmltree::Document::parse(&svg).unwrap();
            let rects = document.descendants().filter(|node| node.has_tag_name("rect"));
            let outlines = rects.filter(|rect| rect.attribute("fill") == Some("none"));
            outlines.map(|rect| rect.attribute("x").unwrap().parse().unwrap()).collect()
        };
        assert_eq!(edges(&[panel(-1.0)]), [LEFT]);
        let wide = panel(-0.0174);
        let needed = LABEL + 3.0 + text::width("−0.015", SMALL) + TICK + 2.0;
        assert!(wide.y.ticks.iter().any(|(_, name)| name == "−0.015"), "{:?}", wide.y.ticks);
        let both = edges(&[panel(-1.0), wide]);
        assert!(both[0] > LEFT && both[0] > needed && both[0] == both[1], "{both:?}");
    }

    #[test]
    fn the_peak_has_the_largest_magnitude() {
        let points = vec![(0.0, 1.0), (1.0, -3.0), (2.0, f64::NAN), (3.0, 2.0)];
        assert_eq!(Series::new(points, FAINT).peak(), Some((1.0, -3.0)));
        assert_eq!(Series::new(vec![(0.0, f64::NAN)], FAINT).peak(), None);
    }

    #[test]
    fn notes_keep_off_the_curves() {
        let x = Axis::linear("t", 0.0, 10.0, 5, AxisRange::Tight);
        let points =
            (0..=100).map(|i| (0.1 * f64::from(i), if i < 60 { 1.0 } else { 5.5 })).collect();
        let y = Axis::linear("y", 0.0, 10.0, 5, AxisRange::Tight);
        let panel = Panel::with_axis(y, vec![Series::new(points, FAINT)], 100.0);
        let frame =
            Frame { across: x, up: panel.y.clone(), x: 40.0, y: 10.0, width: 200.0, height: 100.0 };
        let (left, base) = note_position(&frame, &panel, 60.0, 30.0);
        assert!(left > 200.0 && base > 60.0, "to the right, below the line: {left} {base}");
    }
}
