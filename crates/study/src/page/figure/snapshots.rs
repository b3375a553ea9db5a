//! Figs 8 to 13: some pairs at instants: paths, speed of the fluid and vorticity in slices.

use grainwake_report::figure::Figure;
use grainwake_report::figure::style::{COLUMN, PAGE};
use grainwake_report::figure::svg::Drawing;
use grainwake_report::figure::text;
use grainwake_report::story::Subject;
use grainwake_report::{Told, tell};

use super::{FigureData, StudyFigure};

/// Number of the first of these figures in the paper.
const FIRST: usize = 8;

/// Paths with slices of the speed, then slices of the vorticity.
pub fn figures(data: &FigureData, notes: &mut Vec<String>) -> Vec<StudyFigure> {
    let stories = &data.plan.analysis.figures.stories;
    let (mut paths, mut whirls) = (Vec::new(), Vec::new());
    for (n, name) in stories.iter().enumerate() {
        let numbers = (FIRST + n, FIRST + stories.len() + n);
        let run = data.run(name).filter(|run| {
            data.records
                .iter()
                .any(|r| r.name == run.name && r.state != "stale" && r.state != "missing")
        });
        let told = run.map(|run| tell(&run.folder(data.folder)));
        let which = if super::as_in_the_paper(data) {
            format!("figures {} and {}", numbers.0, numbers.1)
        } else {
            format!("the pictures of {name}")
        };
        match told {
            None => notes.push(format!("{which} are left out: there is no run {name}")),
            Some(Err(error)) => notes.push(format!("{which} are left out: {error}")),
            Some(Ok(told)) => {
                paths.extend(path_and_speed(name, numbers.0, &told));
                whirls.extend(vorticity(name, numbers.1, &told));
                notes.extend(told.notes.iter().map(|note| format!("{name}: {note}")));
            }
        }
    }
    paths.extend(whirls);
    paths
}

fn find<'a>(told: &'a Told, name: &str) -> Option<&'a Figure> {
    told.figures.iter().find(|f| f.name == name)
}

/// Whether the run came to its end, for the caption.
fn state(told: &Told) -> &'static str {
    if told.run.finished() {
        ""
    } else {
        " The run has not finished."
    }
}

fn path_and_speed(name: &str, number: usize, told: &Told) -> Option<StudyFigure> {
    let path = find(told, "trajectories")?;
    let beside: Vec<&Figure> = ["gap", "velocity"]
        .iter()
        .filter_map(|n| find(told, n))
        .collect();
    let speed = find(told, "speed");
    let mut column = 0.0;
    let mut room: f64 = path.drawing.height();
    let mut placed = Vec::new();
    // As many of the curves as the height of the paths has room for, at least the gap.
    for figure in beside {
        if placed.is_empty() || column + figure.drawing.height() <= 1.15 * room {
            placed.push((figure, column));
            column += figure.drawing.height() + 4.0;
        }
    }
    room = room.max(column);
    let below = speed.map_or(0.0, |f| f.drawing.height() + 8.0);
    let mut drawing = Drawing::new(PAGE, room + below);
    drawing.inset(&path.drawing, 0.0, 0.0, "path");
    for (figure, y) in placed {
        drawing.inset(&figure.drawing, PAGE - COLUMN, y, figure.name);
    }
    let pair = told.story.subject == Subject::Pair;
    let beside = if pair {
        "gap of the centres and tilt of their line"
    } else {
        "velocity against time"
    };
    let mut caption = format!("Left: {} Right: {beside}.", path.caption);
    if let Some(speed) = speed {
        drawing.inset(
            &speed.drawing,
            0.5 * (PAGE - speed.drawing.width()),
            room + 8.0,
            "speed",
        );
        caption += &format!(" Below: {}", speed.caption);
    } else {
        caption += " The run has no slices of the flow.";
    }
    Some(StudyFigure {
        name: format!("fig{number:02}-{name}"),
        number: number.to_string(),
        title: if pair {
            format!("Drafting, kissing and tumbling of {}", text::literal(name))
        } else {
            format!("Path of {}", text::literal(name))
        },
        caption: caption + state(told),
        drawing,
    })
}

fn vorticity(name: &str, number: usize, told: &Told) -> Option<StudyFigure> {
    let figure = find(told, "vorticity")?;
    Some(StudyFigure {
        name: format!("fig{number:02}-vorticity-{name}"),
        number: number.to_string(),
        title: format!("Vorticity about {}", text::literal(name)),
        caption: figure.caption.clone() + state(told),
        drawing: figure.drawing.clone(),
    })
}
