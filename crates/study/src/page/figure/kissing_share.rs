//! Share of the pairs that have kissed, against time.

use grainwake_plot::axis::{Axis, AxisRange};
use grainwake_plot::drawing::{Anchor, Drawing};
use grainwake_plot::frame::{Frame, Labelled};
use grainwake_plot::legend::{Entry, Legend};
use grainwake_plot::style::PAGE;
use grainwake_plot::{Figure, letter, text};

use super::data::FigureData;
use crate::analysis::kissing::Level;
use crate::measure::unique;

const LEFT: f64 = 42.0;
const GAP: f64 = 20.0;
const HEIGHT: f64 = 140.0;
/// Height of the title above a panel with the name of its grid [pt].
const TITLE: f64 = 20.0;
/// Largest number of panels in a row.
const ACROSS: usize = 2;

/// Draws one panel per grid, with one curve per level.
pub fn figure(data: &FigureData) -> Option<Figure> {
    let levels = &data.kissing?.levels;
    let shown: Vec<&Level> = levels.iter().filter(|l| l.runs > 0).collect();
    let end = shown.iter().map(|l| l.last).fold(0.0, f64::max);
    if end == 0.0 {
        return None;
    }
    // The last step must not lie under the frame.
    let end = 1.03 * end;
    let names: Vec<String> = unique(shown.iter().map(|l| &l.level));
    let grids: Vec<String> = unique(shown.iter().filter_map(|l| l.grid.as_ref()));
    let panels = grids.len().max(1);
    let across = panels.min(ACROSS);
    let width = (PAGE - LEFT - 8.0 - GAP * (across as f64 - 1.0)) / across as f64;
    let by = &data.plan.analysis.kissing.as_ref()?.by;
    let entry = |name: &String| {
        let style = data.level_style(by, name);
        Entry::line(text::literal(name), style.colour, style.dash)
    };
    let title = if grids.is_empty() { 0.0 } else { TITLE };
    let legend = Legend::new(names.iter().map(entry), PAGE - LEFT);
    let top = legend.height() + 8.0;
    let rows = panels.div_ceil(across) as f64;
    let mut drawing = Drawing::new(PAGE, top + rows * (HEIGHT + title) + 26.0);
    legend.draw(&mut drawing, (LEFT, 5.0));
    for panel in 0..panels {
        let (column, row) = (panel % across, panel / across);
        let frame = Frame {
            x: LEFT + column as f64 * (width + GAP),
            y: top + title + row as f64 * (HEIGHT + title),
            width,
            height: HEIGHT,
            across: Axis::linear("*t* √(*g*/*d*)  [–]", 0.0, end, 6, AxisRange::Tight),
            up: Axis::linear("share that has kissed  [–]", 0.0, 1.02, 5, AxisRange::Tight),
        };
        frame.grid(&mut drawing);
        if let Some(grid) = grids.get(panel) {
            let name = format!("{}  {}", letter(panel), text::literal(grid));
            drawing.text((frame.x, frame.y - 4.0), Anchor::Start, &name);
        }
        for level in shown.iter().filter(|l| l.grid.as_ref() == grids.get(panel)) {
            let style = data.level_style(by, &level.level);
            let clip = format!("clip-share-{panel}-{}", level.level);
            frame.curve(&mut drawing, &steps(level, end), style.colour, style.dash, &clip);
        }
        let last_row = panel + across >= panels;
        frame.outline(&mut drawing, Labelled { across: last_row, up: column == 0 });
    }
    let runs: usize = shown.iter().map(|l| l.runs).sum();
    let caption = format!(
        "Share of the pairs that have come into contact by time *t* (cumulative incidence), the \
         mean over the models of {runs} runs. Pairs without contact never count. A curve below 1 \
         ends at the last contact, landing or end of a run."
    );
    Some(Figure::new("kissing-share", "Share of the pairs that have kissed", caption, drawing))
}

/// Points of the step curve of a level, to its last observation, or to `end` if all have kissed.
fn steps(level: &Level, end: f64) -> Vec<(f64, f64)> {
    let mut points = vec![(0.0, 0.0)];
    let mut share = 0.0;
    for &(time, next) in &level.incidence {
        points.extend([(time, share), (time, next)]);
        share = next;
    }
    points.push((if share > 1.0 - 1e-9 { end } else { level.last }, share));
    points
}
