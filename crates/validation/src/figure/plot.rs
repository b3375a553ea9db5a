//! Plots of points and curves with a legend.

use grainwake_plot::COLUMN;
use grainwake_plot::axis::{Axis, AxisRange, extent};
use grainwake_plot::drawing::Drawing;
use grainwake_plot::frame::{Fill, Frame, Labelled, Marker};
use grainwake_plot::legend::{Entry, Legend};
use grainwake_run::case::Located;

use super::raw::{AxisSpec, Scale};

const LEFT: f64 = 42.0;
const RIGHT: f64 = 9.0;
const HEIGHT: f64 = 150.0;
/// Half the size of a symbol [pt].
const SIGN: f64 = 2.4;

/// Data set with its style.
#[derive(Clone, Debug)]
pub struct DataSet {
    /// Name in the legend, in label markup; empty for no entry.
    pub label: String,
    /// Colour.
    pub colour: &'static str,
    /// Number of the symbol of its points, if any.
    pub sign: Option<usize>,
    /// Fill of the symbols.
    pub fill: Fill,
    /// SVG dash pattern of the line through its points ("" for a solid line), if any.
    pub line: Option<&'static str>,
    /// Points.
    pub points: Vec<(f64, f64)>,
}

impl DataSet {
    fn dash(&self) -> Option<&'static str> {
        self.line.filter(|dash| !dash.is_empty())
    }

    fn mark(&self, drawing: &mut Drawing, at: (f64, f64)) {
        if let Some(sign) = self.sign {
            Marker::nth(sign).draw(drawing, at, SIGN, self.colour, self.fill);
        }
    }

    /// Returns the entry in the legend, if the data set has a name.
    fn entry(&self) -> Option<Entry> {
        (!self.label.is_empty()).then(|| Entry {
            name: self.label.clone(),
            colour: self.colour,
            line: self.line,
            symbol: self.sign.map(|sign| (Marker::nth(sign), self.fill)),
        })
    }
}

/// Draws the data sets, in their order, at column width.
pub fn draw(across: &AxisSpec, up: &AxisSpec, sets: &[DataSet]) -> Drawing {
    let valid = |axis: &AxisSpec, v: f64| v.is_finite() && (axis.scale != Scale::Log || v > 0.0);
    let points = || {
        let all = sets.iter().flat_map(|s| s.points.iter().copied());
        all.filter(|(x, y)| valid(across, *x) && valid(up, *y))
    };
    let across = axis(across, points().map(|p| p.0), 6);
    let inside = |x: f64| across.fraction(x).is_some_and(|p| (-1e-9..=1.0 + 1e-9).contains(&p));
    let up = axis(up, points().filter(|p| inside(p.0)).map(|p| p.1), 5);

    let legend = Legend::new(sets.iter().filter_map(DataSet::entry), COLUMN - LEFT);
    let top = 6.0 + legend.height();
    let mut drawing = Drawing::new(COLUMN, top + HEIGHT + 26.0);
    legend.draw(&mut drawing, (LEFT, 7.0));
    let frame = Frame { x: LEFT, y: top, width: COLUMN - LEFT - RIGHT, height: HEIGHT, across, up };
    frame.grid(&mut drawing);
    for (i, one) in sets.iter().enumerate() {
        if one.line.is_some() {
            let clip = format!("clip-{i}-0");
            frame.curve(&mut drawing, &one.points, one.colour, one.dash(), &clip);
        }
    }
    frame.outline(&mut drawing, Labelled::BOTH);
    for one in sets {
        for (x, y) in &one.points {
            let places = frame.across.fraction(*x).zip(frame.up.fraction(*y));
            let inside = |p: f64| (-1e-6..=1.0 + 1e-6).contains(&p);
            if places.is_some_and(|(a, b)| inside(a) && inside(b)) {
                one.mark(&mut drawing, (frame.px(*x), frame.py(*y)));
            }
        }
    }
    drawing
}

fn axis(plan: &AxisSpec, values: impl Iterator<Item = f64>, count: usize) -> Axis {
    let (low, high) = extent(values).unwrap_or((1.0, 10.0));
    let end =
        |given: &Option<Located<f64>>, default: f64| given.as_ref().map_or(default, |v| v.value);
    let (low, high) = (end(&plan.from, low), end(&plan.to, high));
    let range = match (&plan.from, &plan.to) {
        (Some(_), Some(_)) => AxisRange::Tight,
        _ => AxisRange::Rounded,
    };
    let axis = if plan.scale == Scale::Log {
        Axis::log_rounded(&plan.label, low, high, range)
    } else {
        Axis::linear(&plan.label, low, high, count, range)
    };
    match &plan.ticks {
        Some(ticks) => axis.with_ticks(ticks),
        None => axis,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use grainwake_plot::style::INK;

    #[test]
    fn a_data_set_outside_a_logarithmic_axis_is_left_out() {
        let plan =
            AxisSpec { label: "x".into(), scale: Scale::Log, from: None, to: None, ticks: None };
        let shown = |label: &str, points: &[(f64, f64)]| DataSet {
            label: label.into(),
            colour: INK,
            sign: Some(1),
            fill: Fill::Hollow,
            line: Some(""),
            points: points.to_vec(),
        };
        let sets = [
            shown("good", &[(1.0, 1.0), (10.0, 2.0), (20.0, f64::NAN), (30.0, 3.0), (40.0, 2.0)]),
            shown("none", &[(-1.0, 0.0), (0.0, -1.0)]),
        ];
        let svg = draw(&plan, &plan, &sets).to_svg("f", "t", "d");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        let curves = svg.matches("stroke-width=\"1.2\"").count();
        assert_eq!(curves, 2 + 2, "two samples in the legend, and a curve in two parts");
        assert!(svg.contains(">good<") && svg.contains(">none<"));
    }
}
