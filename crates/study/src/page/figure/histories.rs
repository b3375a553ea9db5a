//! Figs 15 to 18: gap and vertical velocity in one orientation, by row and by column.

use grainwake_report::figure::axis::{Axis, extent};
use grainwake_report::figure::frame::Frame;
use grainwake_report::figure::style::{
    BLUE, GREEN, INK, LINE, ORANGE, PAGE, SMALL, TEXT, VERMILION,
};
use grainwake_report::figure::svg::{Anchor, Drawing};
use grainwake_report::figure::text;

use super::{FigureData, StudyFigure, symbol, value_text};
use crate::measure::trajectory::Trajectory;
use crate::plan::Run;

const COLOURS: [&str; 4] = [BLUE, GREEN, ORANGE, VERMILION];
const TIME: &str = "*t* √(*g*/*d*)  [–]";
const LEFT: f64 = 40.0;
const GAP: f64 = 20.0;
const WIDTH: f64 = (PAGE - LEFT - GAP - 8.0) / 2.0;
const HEIGHT: f64 = 128.0;
/// Above a panel, for its title.
const HEAD: f64 = 20.0;
/// Above all, for the legend.
const LEGEND: f64 = 16.0;

/// What is drawn of each run.
#[derive(Clone, Copy, PartialEq)]
enum What {
    Gap,
    Velocity,
}

/// Figures 15, 16, 17 and 18.
pub fn figures(data: &FigureData, notes: &mut Vec<String>) -> Vec<StudyFigure> {
    let plan = &data.plan.analysis.figures;
    let (Some(rows), Some(columns), Some(axis), Some(level)) =
        (&plan.rows, &plan.columns, &plan.orientations, &plan.compare)
    else {
        return Vec::new();
    };
    let wanted: Vec<&Run> = data
        .plan
        .runs
        .iter()
        .filter(|r| r.member == 0 && r.levels.get(axis) == Some(level))
        .collect();
    let missing: Vec<&str> = wanted
        .iter()
        .filter(|r| !data.trajectories.contains_key(&r.name))
        .map(|r| r.name.as_str())
        .collect();
    if !missing.is_empty() {
        notes.push(format!(
            "figures 15 to 18 lack runs that are not finished: {}",
            missing.join(", ")
        ));
    }
    let mut out = Vec::new();
    for (number, what, by, within) in [
        ("15", What::Gap, rows, columns),
        ("16", What::Gap, columns, rows),
        ("17", What::Velocity, rows, columns),
        ("18", What::Velocity, columns, rows),
    ] {
        out.extend(figure(data, &wanted, number, what, by, within, level));
    }
    out
}

fn figure(
    data: &FigureData,
    wanted: &[&Run],
    number: &str,
    what: What,
    by: &str,
    within: &str,
    level: &str,
) -> Option<StudyFigure> {
    let reference = data.plan.analysis.figures.reference.as_ref();
    let sphere =
        reference.and_then(|name| Some((name, data.trajectories.get(&data.run(name)?.name)?)));
    let shown: Vec<(&Run, &Trajectory)> = wanted
        .iter()
        .filter_map(|r| Some((*r, data.trajectories.get(&r.name)?)))
        .collect();
    if shown.is_empty() {
        return None;
    }
    let trajectories = || shown.iter().map(|(_, m)| *m).chain(sphere.map(|(_, m)| m));
    let end = trajectories()
        .filter_map(|m| m.time.last().copied())
        .fold(0.0, f64::max);
    let (low, high) = match what {
        What::Gap => extent(trajectories().flat_map(|m| m.distance.iter().copied())),
        What::Velocity => extent(trajectories().flat_map(|m| m.velocity.iter().flatten().copied())),
    }?;
    let label = match what {
        What::Gap => "*D*_{r}/*d*  [–]",
        What::Velocity => "*v*_{z} / √(*d* *g*)  [–]",
    };
    let panels = data.factor_values(by);
    let lines = data.factor_values(within);
    let high_rows = panels.len().div_ceil(2);
    let mut drawing = Drawing::new(
        PAGE,
        LEGEND + high_rows as f64 * (HEIGHT + HEAD) + 26.0 + 8.0,
    );
    for (i, value) in panels.iter().enumerate() {
        let (column, row) = (i % 2, i / 2);
        let frame = Frame {
            x: LEFT + column as f64 * (WIDTH + GAP),
            y: LEGEND + HEAD + row as f64 * (HEIGHT + HEAD),
            width: WIDTH,
            height: HEIGHT,
            across: Axis::linear(TIME, 0.0, end, 6, true),
            up: Axis::linear(
                label,
                if what == What::Gap { 0.0 } else { low },
                high.max(0.0),
                5,
                false,
            ),
        };
        frame.grid(&mut drawing);
        let letter = char::from(b'a' + (i % 26) as u8);
        let title = format!("({letter})  {} = {}", symbol(by), value_text(*value));
        drawing.label(
            frame.x,
            frame.y - 4.0,
            Anchor::Start,
            TEXT,
            INK,
            &title,
            false,
        );
        let mut curve = |motion: &Trajectory, colour: &str, name: &str| match what {
            What::Gap => frame.curve(
                &mut drawing,
                &motion.points(&motion.distance),
                colour,
                None,
                &format!("clip-{i}-{name}"),
            ),
            What::Velocity => {
                frame.curve(
                    &mut drawing,
                    &motion.points(&motion.velocity[1]),
                    colour,
                    None,
                    &format!("clip-{i}-{name}-l"),
                );
                frame.curve(
                    &mut drawing,
                    &motion.points(&motion.velocity[0]),
                    colour,
                    Some("3.5 1.8"),
                    &format!("clip-{i}-{name}-t"),
                );
            }
        };
        if let Some((_, motion)) = sphere.filter(|_| what == What::Gap) {
            curve(motion, INK, "sphere");
        }
        for (run, motion) in shown
            .iter()
            .filter(|(r, _)| r.factors.get(by) == Some(value))
        {
            let n = lines
                .iter()
                .position(|v| run.factors.get(within) == Some(v))
                .unwrap_or(0);
            curve(motion, COLOURS[n % 4], &run.name);
        }
        frame.outline(&mut drawing, (row + 1 == high_rows, column == 0));
    }
    let mut entries: Vec<(String, &str, Option<&str>)> = lines
        .iter()
        .enumerate()
        .map(|(n, v)| {
            let name = format!("{} = {}", symbol(within), value_text(*v));
            (name, COLOURS[n % 4], None)
        })
        .collect();
    match what {
        What::Velocity => entries.extend([
            ("leading".to_owned(), INK, None),
            ("trailing".to_owned(), INK, Some("3.5 1.8")),
        ]),
        What::Gap if sphere.is_some() => {
            let name = reference.map_or("", String::as_str);
            entries.push((text::literal(name), INK, None));
        }
        What::Gap => {}
    }
    legend(
        &mut drawing,
        &entries,
        LEFT + 2.0 * WIDTH + GAP,
        LEGEND - 6.0,
    );
    let (quantity, file) = match what {
        What::Gap => ("Distance of the centres", "gap"),
        What::Velocity => ("Vertical velocity", "velocity"),
    };
    let way = if matches!(number, "15" | "17") {
        "row"
    } else {
        "column"
    };
    let mut caption = format!(
        "{quantity} in orientation {} until the first grain lands; a panel holds the grains of one {by}, colours are {within}.",
        text::literal(level)
    );
    if what == What::Velocity {
        caption +=
            " Down is negative; leading and trailing are the grains as they lie at the start.";
    }
    if shown.len() < wanted.len() {
        caption += &format!(" {} of {} runs are finished.", shown.len(), wanted.len());
    }
    Some(StudyFigure {
        name: format!("fig{number}-{file}-by-{way}"),
        number: number.into(),
        title: format!("{quantity} by {by}"),
        caption,
        drawing,
    })
}

/// Entries of a legend in a line that ends at `right`.
fn legend(drawing: &mut Drawing, entries: &[(String, &str, Option<&str>)], right: f64, base: f64) {
    let mut x = right;
    for (name, colour, dash) in entries.iter().rev() {
        x -= text::width(name, SMALL);
        drawing.label(x, base, Anchor::Start, SMALL, INK, name, false);
        x -= 15.0;
        drawing.line(
            &[(x, base - 0.36 * SMALL), (x + 12.0, base - 0.36 * SMALL)],
            colour,
            LINE,
            *dash,
        );
        x -= 8.0;
    }
}
