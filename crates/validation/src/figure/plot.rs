//! Points and curves in one frame, with their names above it.

use grainwake_report::figure::COLUMN;
use grainwake_report::figure::axis::{Axis, extent};
use grainwake_report::figure::frame::{Frame, Sign};
use grainwake_report::figure::style::{INK, LINE, SMALL};
use grainwake_report::figure::svg::{Anchor, Drawing};
use grainwake_report::figure::text;

use super::AxisPlan;

const LEFT: f64 = 42.0;
const RIGHT: f64 = 9.0;
const HEIGHT: f64 = 150.0;
const ROW: f64 = 10.0;
/// Width of the sample of a line in the legend [pt].
const SAMPLE: f64 = 16.0;
/// Half the size of a sign [pt].
const SIGN: f64 = 2.4;

/// Points ready to be drawn.
#[derive(Clone, Debug)]
pub struct Shown {
    /// Name in the legend, in label markup; empty keeps it out.
    pub label: String,
    /// Colour.
    pub colour: &'static str,
    /// Number of the sign at its points, if they have one.
    pub sign: Option<usize>,
    /// Whether the signs are hollow.
    pub hollow: bool,
    /// SVG dash pattern of the line through its points ("" for a full line), if they have one.
    pub line: Option<&'static str>,
    /// The points.
    pub points: Vec<(f64, f64)>,
}

impl Shown {
    fn dash(&self) -> Option<&'static str> {
        self.line.filter(|dash| !dash.is_empty())
    }

    fn mark(&self, drawing: &mut Drawing, at: (f64, f64)) {
        if let Some(sign) = self.sign {
            Sign::number(sign).draw(drawing, at, SIGN, self.colour, self.hollow);
        }
    }

    /// Width of the sample before its name [pt].
    fn sample(&self) -> f64 {
        if self.line.is_some() { SAMPLE } else { 6.0 }
    }

    fn entry(&self) -> f64 {
        self.sample() + 4.0 + text::width(&self.label, SMALL) + 9.0
    }
}

/// Draws the sets in their order in a column-wide drawing.
pub fn draw(across: &AxisPlan, up: &AxisPlan, shown: &[Shown]) -> Drawing {
    let known = |plan: &AxisPlan, v: f64| v.is_finite() && (!plan.log || v > 0.0);
    let points = || {
        let all = shown.iter().flat_map(|s| s.points.iter().copied());
        all.filter(|(x, y)| known(across, *x) && known(up, *y))
    };
    let across = axis(across, points().map(|p| p.0), 6);
    let inside = |x: f64| {
        across
            .place(x)
            .is_some_and(|p| (-1e-9..=1.0 + 1e-9).contains(&p))
    };
    let up = axis(up, points().filter(|p| inside(p.0)).map(|p| p.1), 5);

    let rows = legend(shown);
    let top = 6.0 + ROW * rows.len() as f64;
    let mut drawing = Drawing::new(COLUMN, top + HEIGHT + 26.0);
    for (r, row) in rows.iter().enumerate() {
        let y = 7.0 + ROW * r as f64;
        let mut x = LEFT;
        for one in row {
            if one.line.is_some() {
                drawing.line(&[(x, y), (x + SAMPLE, y)], one.colour, LINE, one.dash());
            }
            one.mark(&mut drawing, (x + 0.5 * one.sample(), y));
            let left = x + one.sample() + 4.0;
            let base = y + 0.36 * SMALL;
            drawing.label(left, base, Anchor::Start, SMALL, INK, &one.label, false);
            x += one.entry();
        }
    }
    let frame = Frame {
        x: LEFT,
        y: top,
        width: COLUMN - LEFT - RIGHT,
        height: HEIGHT,
        across,
        up,
    };
    frame.grid(&mut drawing);
    for (i, one) in shown
        .iter()
        .enumerate()
        .filter(|(_, one)| one.line.is_some())
    {
        for (k, part) in parts(&frame, &one.points).iter().enumerate() {
            let clip = format!("clip-{i}-{k}");
            frame.curve(&mut drawing, part, one.colour, one.dash(), &clip);
        }
    }
    frame.outline(&mut drawing, (true, true));
    for one in shown {
        for (x, y) in &one.points {
            let places = frame.across.place(*x).zip(frame.up.place(*y));
            let inside = |p: f64| (-1e-6..=1.0 + 1e-6).contains(&p);
            if places.is_some_and(|(a, b)| inside(a) && inside(b)) {
                one.mark(&mut drawing, (frame.px(*x), frame.py(*y)));
            }
        }
    }
    drawing
}

fn axis(plan: &AxisPlan, values: impl Iterator<Item = f64>, count: usize) -> Axis {
    let (low, high) = extent(values).unwrap_or((1.0, 10.0));
    let (low, high) = (plan.ends[0].unwrap_or(low), plan.ends[1].unwrap_or(high));
    let tight = plan.ends.iter().all(Option::is_some);
    let axis = if plan.log {
        Axis::log_close(&plan.label, low, high, tight)
    } else {
        Axis::linear(&plan.label, low, high, count, tight)
    };
    match &plan.ticks {
        Some(ticks) => axis.with_ticks(ticks),
        None => axis,
    }
}

/// Names that stand in one row each.
fn legend(shown: &[Shown]) -> Vec<Vec<&Shown>> {
    let width = COLUMN - LEFT;
    let mut rows: Vec<Vec<&Shown>> = Vec::new();
    let mut used = f64::INFINITY;
    for one in shown.iter().filter(|one| !one.label.is_empty()) {
        if used + one.entry() - 9.0 > width {
            rows.push(Vec::new());
            used = 0.0;
        }
        used += one.entry();
        if let Some(row) = rows.last_mut() {
            row.push(one);
        }
    }
    rows
}

/// Stretches of points that all have a place.
fn parts(frame: &Frame, points: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    let placed = |p: &(f64, f64)| {
        p.0.is_finite()
            && p.1.is_finite()
            && frame.across.place(p.0).is_some()
            && frame.up.place(p.1).is_some()
    };
    points
        .split(|p| !placed(p))
        .filter(|part| part.len() > 1)
        .map(<[_]>::to_vec)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_outside_a_logarithmic_axis_leaves_the_rest() {
        let plan = |log| AxisPlan {
            label: "x".into(),
            log,
            ends: [None, None],
            ticks: None,
        };
        let shown = |label: &str, points: &[(f64, f64)]| Shown {
            label: label.into(),
            colour: INK,
            sign: Some(1),
            hollow: true,
            line: Some(""),
            points: points.to_vec(),
        };
        let sets = [
            shown(
                "good",
                &[
                    (1.0, 1.0),
                    (10.0, 2.0),
                    (20.0, f64::NAN),
                    (30.0, 3.0),
                    (40.0, 2.0),
                ],
            ),
            shown("none", &[(-1.0, 0.0), (0.0, -1.0)]),
        ];
        let svg = draw(&plan(true), &plan(true), &sets).to_svg("f", "t", "d");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        assert_eq!(svg.matches("<clipPath").count(), 2, "the curve breaks");
        assert!(svg.contains(">good<") && svg.contains(">none<"));
    }
}
