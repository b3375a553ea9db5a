//! Figs 8 to 13: selected models at several instants, with paths, fluid speed and vorticity.

use grainwake_plot::drawing::Drawing;
use grainwake_plot::style::{COLUMN, PAGE};
use grainwake_plot::{Figure, text};
use grainwake_report::features::RunKind;
use grainwake_report::{RunReport, read_report};

use super::data::FigureData;
use crate::run::state::StateKind;

/// Number of the first of these figures in the paper.
const FIRST: usize = 8;

/// Draws paths with slices of the speed, then slices of the vorticity.
pub fn figures(data: &FigureData, notes: &mut Vec<String>) -> Vec<Figure> {
    let models = &data.plan.analysis.figures.stories;
    let (mut paths, mut vorticities) = (Vec::new(), Vec::new());
    for (n, name) in models.iter().enumerate() {
        let numbers = (FIRST + n, FIRST + models.len() + n);
        let usable = |run: &str| {
            let mut records = data.records.iter().filter(|r| r.name == run);
            records.any(|r| !matches!(r.state, StateKind::Stale | StateKind::Missing))
        };
        let run = data.run(name).filter(|run| usable(&run.name));
        let which = format!("the pictures of {name}");
        match run.map(|run| read_report(&run.folder(data.folder))) {
            None => notes.push(format!("{which} are left out: there is no run {name}")),
            Some(Err(error)) => notes.push(format!("{which} are left out: {error}")),
            Some(Ok(report)) => {
                paths.extend(path_and_speed(name, numbers.0, &report));
                vorticities.extend(vorticity(name, numbers.1, &report));
                notes.extend(report.notes.iter().map(|note| format!("{name}: {note}")));
            }
        }
    }
    paths.extend(vorticities);
    paths
}

fn find<'a>(report: &'a RunReport, name: &str) -> Option<&'a Figure> {
    report.figures.iter().find(|f| f.name == name)
}

/// Sentence of the caption about an unfinished run.
fn unfinished(report: &RunReport) -> &'static str {
    if report.run.finished() { "" } else { " The run has not finished." }
}

fn path_and_speed(name: &str, number: usize, report: &RunReport) -> Option<Figure> {
    let path = find(report, "trajectories")?;
    // The curves that fit beside the paths, at least the first.
    let mut column = 0.0;
    let mut placed = Vec::new();
    for figure in ["gap", "velocity"].iter().filter_map(|n| find(report, n)) {
        if placed.is_empty() || column + figure.drawing.height() <= 1.15 * path.drawing.height() {
            placed.push((figure, column));
            column += figure.drawing.height() + 4.0;
        }
    }
    let height = path.drawing.height().max(column);
    let speed = find(report, "speed");
    let below = speed.map_or(0.0, |f| f.drawing.height() + 8.0);
    let mut drawing = Drawing::new(PAGE, height + below);
    drawing.inset(&path.drawing, 0.0, 0.0, "path");
    for (figure, y) in placed {
        drawing.inset(&figure.drawing, PAGE - COLUMN, y, &figure.name);
    }
    let model = text::literal(name);
    let (beside, title) = match report.features.kind == RunKind::Pair {
        true => (
            "distance of the centres and tilt of their line",
            format!("Drafting, kissing and tumbling of {model}"),
        ),
        false => ("velocity against time", format!("Path of {model}")),
    };
    let mut caption = format!("Left: {} Right: {beside}.", path.caption);
    if let Some(speed) = speed {
        let left = 0.5 * (PAGE - speed.drawing.width());
        drawing.inset(&speed.drawing, left, height + 8.0, "speed");
        caption += &format!(" Below: {}", speed.caption);
    } else {
        caption += " The run has no slices of the flow.";
    }
    caption += unfinished(report);
    let file = format!("fig{number:02}-{name}");
    Some(Figure::new(file, title, caption, drawing).numbered(number))
}

fn vorticity(name: &str, number: usize, report: &RunReport) -> Option<Figure> {
    let figure = find(report, "vorticity")?;
    let file = format!("fig{number:02}-vorticity-{name}");
    let title = format!("Vorticity around {}", text::literal(name));
    let caption = figure.caption.clone() + unfinished(report);
    let drawing = figure.drawing.clone();
    Some(Figure::new(file, title, caption, drawing).numbered(number))
}
