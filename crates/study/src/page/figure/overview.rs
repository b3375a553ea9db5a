//! Figures of a study that asks for none: motion of all runs against time, and a result against
//! what was varied.

use std::collections::BTreeMap;

use grainwake_report::figure::axis::{Axis, extent};
use grainwake_report::figure::frame::Frame;
use grainwake_report::figure::style::{LINE, PAGE};
use grainwake_report::figure::svg::Drawing;
use grainwake_report::figure::text;

use super::legend::{LineStyles, axes};
use super::{FigureData, StudyFigure};
use crate::analysis::observation::{Observation, observations};
use crate::measure::trajectory::Trajectory;
use crate::measure::trajectory::settling_curve;
use crate::plan::Run;
use crate::plan::claims::FigureRequest;
use crate::plan::quantities::SHAPE_FACTORS;

const LEFT: f64 = 42.0;
const GAP: f64 = 14.0;
const HEIGHT: f64 = 150.0;
/// More runs than that are drawn with write_thinned_history lines.
const FEW: usize = 12;
/// Most panels of a figure.
const PANELS: usize = 6;

/// Labels of a figure.
struct Words {
    name: &'static str,
    title: &'static str,
    across: &'static str,
    up: &'static str,
    caption: String,
}

/// What is drawn where the analysis asks for no figures.
pub fn figures(data: &FigureData) -> Vec<StudyFigure> {
    if data.plan.analysis.figures != FigureRequest::default() {
        return Vec::new();
    }
    let settling = data.records.iter().any(|row| row.settling.is_some());
    let pairs = data.records.iter().any(|row| row.pair.is_some());
    let mut out = Vec::new();
    if settling {
        out.extend(speeds(data));
        out.extend(against(data, "final_speed_m_per_s", || Words {
            name: "settling-speed",
            title: "Final settling speed",
            across: "",
            up: "settling speed  [m/s]",
            caption: "Mean speed over the last diameter fallen before the floor slows the grain (mean over the grains of a run), against what was varied.".into(),
        }));
    }
    if pairs {
        out.extend(distances(data));
        out.extend(against(data, "kiss_time", || Words {
            name: "kissing-time",
            title: "Kissing time",
            across: "",
            up: "kissing time  *t* √(*g*/*d*)  [–]",
            caption: "First contact against what was varied. Hollow signs landed before they kissed; the landing is shown.".into(),
        }));
    }
    out
}

fn finished<'a>(
    data: &'a FigureData,
) -> impl Iterator<Item = (&'a Run, &'a crate::measure::record::RunRecord)> {
    let both = data.plan.runs.iter().zip(data.records);
    both.filter(|(_, row)| row.finished())
}

fn speeds(data: &FigureData) -> Option<StudyFigure> {
    let known = finished(data).filter(|(_, row)| row.settling.is_some());
    let curves: Vec<(&Run, Vec<(f64, f64)>)> = known
        .filter_map(|(run, row)| Some((run, settling_curve(run, row, data.folder)?)))
        .collect();
    let single = data
        .records
        .iter()
        .all(|r| r.settling.as_ref().is_none_or(|s| s.grains == 1));
    let words = Words {
        name: "velocity",
        title: "Settling speed against time",
        across: "*t*  [s]",
        up: "settling speed  [m/s]",
        caption: format!(
            "Speed along gravity of the {} of {} runs, down positive.",
            if single { "grain" } else { "grains (mean)" },
            curves.len()
        ),
    };
    curves_against_time(data, &curves, words)
}

fn distances(data: &FigureData) -> Option<StudyFigure> {
    let trajectories = finished(data).filter(|(_, row)| row.pair.is_some());
    let curves: Vec<(&Run, Vec<(f64, f64)>)> = trajectories
        .filter_map(|(run, row)| Some((run, Trajectory::read(run, row, data.folder)?)))
        .map(|(run, motion)| (run, motion.points(&motion.distance)))
        .collect();
    let words = Words {
        name: "gap",
        title: "Distance of the centres against time",
        across: "*t* √(*g*/*d*)  [–]",
        up: "*D*_{r}/*d*  [–]",
        caption: format!(
            "Distance of the centres of the pairs of {} runs, until the first grain lands.",
            curves.len()
        ),
    };
    curves_against_time(data, &curves, words)
}

fn curves_against_time(
    data: &FigureData,
    curves: &[(&Run, Vec<(f64, f64)>)],
    words: Words,
) -> Option<StudyFigure> {
    let points = || curves.iter().flat_map(|(_, points)| points.iter().copied());
    let (_, end) = extent(points().map(|p| p.0))?;
    let (low, high) = extent(points().map(|p| p.1).chain([0.0]))?;
    let looks = LineStyles::of(data);
    let top = looks.legend(None, LEFT, false) + 4.0;
    let frame = Frame {
        x: LEFT,
        y: top,
        width: PAGE - LEFT - 8.0,
        height: 200.0,
        across: Axis::linear(words.across, 0.0, end, 8, true),
        up: Axis::linear(words.up, low, high, 6, false),
    };
    let mut drawing = Drawing::new(PAGE, top + frame.height + 26.0);
    looks.legend(Some(&mut drawing), LEFT, false);
    frame.grid(&mut drawing);
    for (run, points) in curves {
        let look = looks.look(run);
        if curves.len() <= FEW {
            let clip = format!("clip-{}", run.name);
            frame.curve(&mut drawing, points, look.colour, look.dash, &clip);
        } else {
            let placed: Vec<(f64, f64)> = points
                .iter()
                .map(|p| (frame.px(p.0), frame.py(p.1)))
                .collect();
            drawing.line(&placed, look.colour, 0.6 * LINE, look.dash);
        }
    }
    frame.outline(&mut drawing, (true, true));
    Some(StudyFigure {
        name: words.name.into(),
        number: String::new(),
        title: words.title.into(),
        caption: words.caption,
        drawing,
    })
}

/// What was varied: where each model stands, and the ticks of names.
struct Parameter {
    /// Name of the axis or the factor.
    name: String,
    /// Axis of the study that it stands for.
    axis: Option<String>,
    place: BTreeMap<String, f64>,
    /// Names at whole places; none of a number.
    names: Option<Vec<String>>,
}

/// The axes, as numbers where a factor goes with them; of a study without axes its factors, else its models.
fn varied(data: &FigureData) -> Vec<Parameter> {
    let runs = &data.plan.runs;
    let own = |run: &Run| -> Vec<String> {
        let names = run
            .factors
            .keys()
            .filter(|f| !SHAPE_FACTORS.contains(&f.as_str()));
        names.cloned().collect()
    };
    let mut factors: Vec<String> = runs.iter().flat_map(own).collect();
    factors.sort();
    factors.dedup();
    let mut out = Vec::new();
    for (axis, levels) in axes(data) {
        let value = |factor: &String, level: &String| -> Option<f64> {
            let here = runs.iter().filter(|r| r.levels.get(&axis) == Some(level));
            let values: Vec<Option<f64>> = here.map(|r| r.factors.get(factor).copied()).collect();
            let first = (*values.first()?)?;
            values.iter().all(|v| *v == Some(first)).then_some(first)
        };
        let numbers = factors.iter().find_map(|factor| {
            let values: Option<Vec<f64>> = levels.iter().map(|l| value(factor, l)).collect();
            let mut sorted = values.clone()?;
            sorted.sort_by(f64::total_cmp);
            sorted.dedup();
            (sorted.len() == levels.len()).then_some((factor.clone(), values?))
        });
        let place = |at: &dyn Fn(usize) -> f64| {
            let known = runs.iter().filter_map(|run| {
                let level = run.levels.get(&axis)?;
                let i = levels.iter().position(|l| l == level)?;
                Some((run.model.clone(), at(i)))
            });
            known.collect()
        };
        out.push(match &numbers {
            Some((factor, values)) => Parameter {
                name: factor.clone(),
                place: place(&|i| values[i]),
                names: None,
                axis: Some(axis.clone()),
            },
            None => Parameter {
                name: axis.clone(),
                place: place(&|i| i as f64 + 0.5),
                names: Some(levels.clone()),
                axis: Some(axis.clone()),
            },
        });
    }
    if !out.is_empty() {
        return out;
    }
    for factor in factors {
        let known = runs
            .iter()
            .filter_map(|r| Some((r.model.clone(), *r.factors.get(&factor)?)));
        let place: BTreeMap<String, f64> = known.collect();
        if extent(place.values().copied()).is_some_and(|(a, b)| b > a) {
            out.push(Parameter {
                name: factor,
                axis: None,
                place,
                names: None,
            });
        }
    }
    if out.is_empty() {
        let mut models: Vec<String> = runs.iter().map(|r| r.model.clone()).collect();
        models.dedup();
        let place = models
            .iter()
            .enumerate()
            .map(|(i, m)| (m.clone(), i as f64 + 0.5));
        out.push(Parameter {
            name: "model".into(),
            axis: None,
            place: place.collect(),
            names: Some(models),
        });
    }
    out
}

fn against(data: &FigureData, quantity: &str, words: impl Fn() -> Words) -> Option<StudyFigure> {
    let all = observations(data.records, quantity, &BTreeMap::new());
    let (low, high) = extent(all.iter().flat_map(|s| [s.range.0, s.range.1, 0.0]))?;
    let mut panels = varied(data);
    let left_out = panels.len().saturating_sub(PANELS);
    panels.truncate(PANELS);
    let looks = LineStyles::of(data);
    let words = words();
    let top = looks.legend(None, LEFT, true) + 4.0;
    let rows = panels.len().div_ceil(2);
    let each = HEIGHT + 30.0;
    let mut drawing = Drawing::new(PAGE, top + rows as f64 * each);
    looks.legend(Some(&mut drawing), LEFT, true);
    let width = (PAGE - LEFT - 8.0 - GAP) / 2.0;
    for (i, panel) in panels.iter().enumerate() {
        let label = text::literal(&panel.name.replace('_', " "));
        let across = match &panel.names {
            Some(names) => {
                let mut axis = Axis::linear(&label, 0.0, names.len() as f64, 4, true);
                let tick = |(i, name): (usize, &String)| (i as f64 + 0.5, text::literal(name));
                axis.ticks = names.iter().enumerate().map(tick).collect();
                axis
            }
            None => {
                let (a, b) = extent(panel.place.values().copied())?;
                let room = 0.06 * (b - a);
                Axis::linear(&label, a - room, b + room, 5, true)
            }
        };
        let frame = Frame {
            x: LEFT + (i % 2) as f64 * (width + GAP),
            y: top + (i / 2) as f64 * each,
            width,
            height: HEIGHT,
            across,
            up: Axis::linear(words.up, low, high, 5, false),
        };
        frame.grid(&mut drawing);
        draw_panel(&mut drawing, &frame, panel, &all, data, &looks);
        frame.outline(&mut drawing, (true, i % 2 == 0));
    }
    let mut caption = words.caption;
    let models = data.plan.runs.iter().filter(|r| r.member == 0).count();
    if all.len() < models {
        caption += &format!(" {} of {models} models have a value.", all.len());
    }
    if data.plan.runs.iter().any(|r| r.member > 0) {
        caption += " Signs are medians and bars the range of the runs of an ensemble.";
    }
    if left_out > 0 {
        caption += &format!(" {left_out} more axes or factors are not shown.");
    }
    Some(StudyFigure {
        name: words.name.into(),
        number: String::new(),
        title: words.title.into(),
        caption,
        drawing,
    })
}

fn draw_panel(
    drawing: &mut Drawing,
    frame: &Frame,
    panel: &Parameter,
    all: &[Observation],
    data: &FigureData,
    looks: &LineStyles,
) {
    let at = |s: &Observation| Some((frame.px(*panel.place.get(&s.model)?), frame.py(s.value)));
    // Models that differ along this axis alone are joined.
    let mut lines: BTreeMap<BTreeMap<String, String>, Vec<(f64, f64)>> = BTreeMap::new();
    for sample in all {
        if let (Some(axis), Some(place)) = (&panel.axis, at(sample)) {
            let mut rest = sample.levels.clone();
            rest.remove(axis);
            lines.entry(rest).or_default().push(place);
        }
    }
    for line in lines.values_mut() {
        line.sort_by(|a, b| a.0.total_cmp(&b.0));
        drawing.line(line, "#b4b4b8", 0.7, None);
    }
    for sample in all {
        let run = data.run(&sample.model);
        let (Some((x, y)), Some(run)) = (at(sample), run) else {
            continue;
        };
        let look = looks.look(run);
        let (low, high) = sample.range;
        if high > low {
            drawing.line(
                &[(x, frame.py(low)), (x, frame.py(high))],
                look.colour,
                0.9,
                None,
            );
        }
        look.sign
            .draw(drawing, (x, y), 3.0, look.colour, sample.censored);
    }
}
