//! Figs 15 to 18: gap and vertical velocity in one orientation, by row and by column of grains.

use grainwake_plot::axis::{Axis, AxisRange, extent};
use grainwake_plot::drawing::{Anchor, Drawing};
use grainwake_plot::frame::{Frame, Labelled};
use grainwake_plot::legend::{Entry, Legend};
use grainwake_plot::style::{BLUE, GREEN, INK, ORANGE, PAGE, SKY, VERMILION};
use grainwake_plot::{Figure, letter, text};

use super::data::FigureData;
use crate::measure::trajectory::Trajectory;
use crate::plan::Run;

/// Colours of up to four values in ascending order.
const FOUR: [&str; 4] = [BLUE, GREEN, ORANGE, VERMILION];
/// Colours of more values in ascending order.
const EIGHT: [&str; 8] = ["#5e3c99", BLUE, SKY, GREEN, "#9aa61f", ORANGE, VERMILION, "#7f1d3f"];
const TIME: &str = "*t* √(*g*/*d*)  [–]";
const LEFT: f64 = 40.0;
const GAP: f64 = 20.0;
const WIDTH: f64 = (PAGE - LEFT - GAP - 8.0) / 2.0;
const HEIGHT: f64 = 128.0;
/// Height of the title above a panel [pt].
const TITLE: f64 = 20.0;
/// Space between the legend and the titles of the first panels [pt].
const SPACE: f64 = 6.5;
/// Width of the lines of further members of an ensemble [pt].
const THIN: f64 = 0.45;
/// Dashes of the trailing grain.
const DASHED: Option<&str> = Some("3.5 1.8");

/// Quantity of the curves.
#[derive(Clone, Copy, PartialEq)]
enum Curve {
    Gap,
    Velocity,
}

/// Points of a line, its dash pattern, and what distinguishes it from the other lines of a run.
type Line = (Vec<(f64, f64)>, Option<&'static str>, &'static str);

impl Curve {
    /// Returns the lines of a run.
    fn lines(self, t: &Trajectory) -> Vec<Line> {
        match self {
            Curve::Gap => vec![(t.points(&t.distance), None, "")],
            Curve::Velocity => vec![
                (t.points(&t.velocity[1]), None, "-l"),
                (t.points(&t.velocity[0]), DASHED, "-t"),
            ],
        }
    }
}

/// One of the figures: number in the paper, factor of the panels, factor of the colours.
struct Layout<'a> {
    number: &'a str,
    curve: Curve,
    by: &'a str,
    within: &'a str,
}

/// Draws figures 15, 16, 17 and 18.
pub fn figures(data: &FigureData, notes: &mut Vec<String>) -> Vec<Figure> {
    let request = &data.plan.analysis.figures;
    let (Some(rows), Some(columns), Some(axis), Some(level)) =
        (&request.rows, &request.columns, &request.orientations, &request.compare)
    else {
        return Vec::new();
    };
    let compared = data.plan.runs.iter().filter(|run| run.levels.get(axis) == Some(level));
    let (wanted, members): (Vec<&Run>, Vec<&Run>) = compared.partition(|run| run.member == 0);
    let missing = wanted.iter().copied().filter(|r| !data.trajectories.contains_key(&r.name));
    let finished = |run: &&Run| data.records.iter().any(|r| r.name == run.name && r.finished());
    let (no_history, unfinished): (Vec<&Run>, Vec<&Run>) = missing.partition(finished);
    for (reason, runs) in [("unfinished runs", unfinished), ("runs without history", no_history)] {
        let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
        if !names.is_empty() {
            let names = names.join(", ");
            notes.push(format!("the figures of distance and velocity lack {reason}: {names}"));
        }
    }
    let layouts = [
        ("15", Curve::Gap, rows, columns),
        ("16", Curve::Gap, columns, rows),
        ("17", Curve::Velocity, rows, columns),
        ("18", Curve::Velocity, columns, rows),
    ];
    let draw = |(number, curve, by, within): (&str, Curve, &String, &String)| {
        let layout = Layout { number, curve, by, within };
        figure(data, [&wanted, &members], &layout, level)
    };
    layouts.into_iter().filter_map(draw).collect()
}

fn figure(data: &FigureData, runs: [&[&Run]; 2], layout: &Layout, level: &str) -> Option<Figure> {
    let Layout { number, curve, by, within } = *layout;
    let reference = data.plan.analysis.figures.reference.as_ref();
    let reference =
        reference.and_then(|name| Some((name, data.trajectories.get(&data.run(name)?.name)?)));
    let [shown, members] = runs.map(|runs| -> Vec<(&Run, &Trajectory)> {
        runs.iter().filter_map(|r| Some((*r, data.trajectories.get(&r.name)?))).collect()
    });
    if shown.is_empty() {
        return None;
    }
    let all = || {
        let runs = shown.iter().chain(&members).map(|(_, t)| *t);
        runs.chain(reference.map(|(_, t)| t))
    };
    let end = all().filter_map(|t| t.time.last().copied()).fold(0.0, f64::max);
    let (label, low, high) = match curve {
        Curve::Gap => {
            let (_, high) = extent(all().flat_map(|t| t.distance.iter().copied()))?;
            ("*D*_{r}/*d*  [–]", 0.0, high)
        }
        Curve::Velocity => {
            let values = all().flat_map(|t| t.velocity.iter().flatten().copied());
            let (low, high) = extent(values)?;
            ("*v*_{z} / √(*d* *g*)  [–]", low, high)
        }
    };
    let panels = data.factor_values(by);
    let values = data.factor_values(within);
    let legend = legend(data, layout, reference.map(|(name, _)| name.as_str()), &values);
    let top = legend.height() + SPACE;
    let rows = panels.len().div_ceil(2);
    let height = top + rows as f64 * (HEIGHT + TITLE) + 26.0 + 8.0;
    let mut drawing = Drawing::new(PAGE, height);
    legend.draw(&mut drawing, (LEFT, 8.0));
    for (i, value) in panels.iter().enumerate() {
        let (column, row) = (i % 2, i / 2);
        let frame = Frame {
            x: LEFT + column as f64 * (WIDTH + GAP),
            y: top + TITLE + row as f64 * (HEIGHT + TITLE),
            width: WIDTH,
            height: HEIGHT,
            across: Axis::linear(TIME, 0.0, end, 6, AxisRange::Tight),
            up: Axis::linear(label, low, high.max(0.0), 5, AxisRange::Rounded),
        };
        frame.grid(&mut drawing);
        let title = format!("{}  {}", letter(i), data.factor_label(by, *value));
        drawing.text((frame.x, frame.y - 4.0), Anchor::Start, &title);
        let mut draw = |t: &Trajectory, colour: &str, name: &str| {
            for (points, dash, suffix) in curve.lines(t) {
                let clip = format!("clip-{i}-{name}{suffix}");
                frame.curve(&mut drawing, &points, colour, dash, &clip);
            }
        };
        if let Some((_, trajectory)) = reference.filter(|_| curve == Curve::Gap) {
            draw(trajectory, INK, "sphere");
        }
        let here = |(run, _): &&(&Run, &Trajectory)| run.factors.get(by) == Some(value);
        let colour_of = |run: &Run| {
            let own = run.factors.get(within);
            let n = values.iter().position(|v| own == Some(v)).unwrap_or(0);
            colour(n, values.len())
        };
        for (run, trajectory) in shown.iter().filter(here) {
            draw(trajectory, colour_of(run), &run.name);
        }
        for (run, t) in members.iter().filter(here) {
            for (points, dash, _) in curve.lines(t) {
                let points = points.into_iter().filter_map(|point| frame.position(point));
                drawing.line(&points.collect::<Vec<_>>(), colour_of(run), THIN, dash);
            }
        }
        frame.outline(&mut drawing, Labelled { across: row + 1 == rows, up: column == 0 });
    }
    let (quantity, file) = match curve {
        Curve::Gap => ("Distance of the centres", "gap"),
        Curve::Velocity => ("Vertical velocity", "velocity"),
    };
    let mut caption = format!(
        "{quantity} in orientation {} until the first landing. Panels: grains of equal {by}; \
         colours: {within}.",
        text::literal(level)
    );
    if curve == Curve::Velocity {
        caption += " Negative is downwards. The leading grain is the lower one at the start.";
    }
    if !members.is_empty() {
        caption += " Thin lines: further members of the ensemble.";
    }
    if shown.len() < runs[0].len() {
        caption += &format!(" Shown: {} of {} runs.", shown.len(), runs[0].len());
    }
    let way = if matches!(number, "15" | "17") { "row" } else { "column" };
    let name = format!("fig{number}-{file}-by-{way}");
    let title = format!("{quantity} by {by}");
    Some(Figure::new(name, title, caption, drawing).numbered(number))
}

/// Returns the colour of the n-th of `count` values; neighbours among many values share one.
fn colour(n: usize, count: usize) -> &'static str {
    let most = EIGHT.len();
    match count {
        0..=4 => FOUR[n % 4],
        5..=8 => EIGHT[(n * (most - 1) + (count - 1) / 2) / (count - 1)],
        _ => EIGHT[n * most / count],
    }
}

/// Returns the legend of the colours and, by curve, of the grains or the reference.
fn legend(data: &FigureData, layout: &Layout, reference: Option<&str>, values: &[f64]) -> Legend {
    let mut entries: Vec<Entry> = Vec::new();
    let coloured: Vec<(&str, f64)> =
        values.iter().enumerate().map(|(n, v)| (colour(n, values.len()), *v)).collect();
    for group in coloured.chunk_by(|a, b| a.0 == b.0) {
        let [(colour, first), .., (_, last)] = group else {
            let (colour, value) = group[0];
            entries.push(Entry::line(data.factor_label(layout.within, value), colour, None));
            continue;
        };
        let label = data.factor_label(layout.within, *first);
        let last = data.factor_value(layout.within, *last);
        entries.push(Entry::line(format!("{label} to {last}"), colour, None));
    }
    match layout.curve {
        Curve::Velocity => {
            entries.push(Entry::line("leading", INK, None));
            entries.push(Entry::line("trailing", INK, DASHED));
        }
        Curve::Gap => {
            entries.extend(reference.map(|name| Entry::line(text::literal(name), INK, None)));
        }
    }
    Legend::new(entries, PAGE - LEFT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_distinct_colours_or_share_them_with_their_neighbours() {
        for count in 1..=30 {
            let mut colours: Vec<&str> = (0..count).map(|n| colour(n, count)).collect();
            colours.dedup();
            let groups = colours.len();
            assert_eq!(groups, count.min(EIGHT.len()), "{count}");
            colours.sort_unstable();
            colours.dedup();
            assert_eq!(groups, colours.len(), "{count}: a colour has two meanings");
        }
    }
}
