//! Figures of a study that requests none: curves of all runs against time, and results against the
//! varied parameters.

use grainwake_plot::Figure;
use grainwake_plot::axis::{Axis, AxisRange, extent};
use grainwake_plot::drawing::Drawing;
use grainwake_plot::frame::{Frame, Labelled};
use grainwake_plot::legend::Legend;
use grainwake_plot::style::{LINE, PAGE};

use super::data::FigureData;
use super::legend::LineStyles;
use super::panels::{LEFT, Texts, against_parameters};
use crate::measure::record::RunRecord;
use crate::measure::trajectory::{Trajectory, settling_curve};
use crate::plan::Run;
use crate::plan::claims::FigureRequest;

/// Largest number of runs that are drawn with lines of normal width.
const FEW: usize = 12;

/// Draws the overview figures, if the analysis requests no figures.
pub fn figures(data: &FigureData) -> Vec<Figure> {
    if data.plan.analysis.figures != FigureRequest::default() {
        return Vec::new();
    }
    let mut out = Vec::new();
    if data.records.iter().any(|record| record.settling.is_some()) {
        out.extend(settling_speeds(data));
        let texts = Texts {
            name: "settling-speed",
            title: "Final settling speed",
            up: "settling speed  [m/s]",
            caption: "Mean speed over the last diameter fallen before the floor slows the grain \
                      (mean over the grains of a run), against the varied parameters."
                .into(),
        };
        out.extend(against_parameters(data, "final_speed_m_per_s", texts));
    }
    if data.records.iter().any(|record| record.pair.is_some()) {
        out.extend(distances(data));
        let texts = Texts {
            name: "kissing-time",
            title: "Kissing time",
            up: "kissing time  *t* √(*g*/*d*)  [–]",
            caption: "First contact against the varied parameters.".into(),
        };
        out.extend(against_parameters(data, "kiss_time", texts));
    }
    out
}

type Curves<'a> = Vec<(&'a Run, Vec<(f64, f64)>)>;

/// Reads a curve of every finished run that has one.
fn curves<'a>(
    data: &'a FigureData,
    read: impl Fn(&Run, &RunRecord) -> Option<Vec<(f64, f64)>>,
) -> Curves<'a> {
    let runs = data.plan.runs.iter().zip(data.records);
    let finished = runs.filter(|(_, record)| record.finished());
    finished.filter_map(|(run, record)| Some((run, read(run, record)?))).collect()
}

fn settling_speeds(data: &FigureData) -> Option<Figure> {
    let curves = curves(data, |run, record| {
        record.settling.as_ref()?;
        settling_curve(run, record, data.folder)
    });
    let mut settling = data.records.iter().filter_map(|r| r.settling.as_ref());
    let grains = if settling.all(|s| s.grains == 1) { "grain" } else { "grains (mean)" };
    let texts = Texts {
        name: "velocity",
        title: "Settling speed against time",
        up: "settling speed  [m/s]",
        caption: format!(
            "Speed along gravity of the {grains} of {} runs, down positive.",
            curves.len()
        ),
    };
    against_time(data, &curves, "*t*  [s]", texts)
}

fn distances(data: &FigureData) -> Option<Figure> {
    let curves = curves(data, |run, record| {
        record.pair.as_ref()?;
        let trajectory = Trajectory::read(run, record, data.folder)?;
        Some(trajectory.points(&trajectory.distance))
    });
    let texts = Texts {
        name: "gap",
        title: "Distance of the centres against time",
        up: "*D*_{r}/*d*  [–]",
        caption: format!(
            "Distance of the centres of the pairs of {} runs, until the first landing or the end.",
            curves.len()
        ),
    };
    against_time(data, &curves, "*t* √(*g*/*d*)  [–]", texts)
}

fn against_time(
    data: &FigureData,
    curves: &Curves,
    time: &str,
    mut texts: Texts,
) -> Option<Figure> {
    let points = || curves.iter().flat_map(|(_, points)| points.iter().copied());
    let (_, end) = extent(points().map(|p| p.0))?;
    let (low, high) = extent(points().map(|p| p.1).chain([0.0]))?;
    let styles = LineStyles::of(data);
    let drawn: Vec<&Run> = curves.iter().map(|(run, _)| *run).collect();
    let legend = Legend::new(styles.legend_entries(&drawn, false), PAGE - LEFT);
    if legend.height() == 0.0 {
        texts.caption += " The models are too many for a legend.";
    }
    let top = legend.height() + 4.0;
    let frame = Frame {
        x: LEFT,
        y: top,
        width: PAGE - LEFT - 8.0,
        height: 200.0,
        across: Axis::linear(time, 0.0, end, 8, AxisRange::Tight),
        up: Axis::linear(texts.up, low, high, 6, AxisRange::Rounded),
    };
    let mut drawing = Drawing::new(PAGE, top + frame.height + 26.0);
    legend.draw(&mut drawing, (LEFT, 5.0));
    frame.grid(&mut drawing);
    for (run, points) in curves {
        let style = styles.style(run);
        if curves.len() <= FEW {
            let clip = format!("clip-{}", run.name);
            frame.curve(&mut drawing, points, style.colour, style.dash, &clip);
        } else {
            let placed = points.iter().map(|p| (frame.px(p.0), frame.py(p.1)));
            let placed: Vec<(f64, f64)> = placed.collect();
            drawing.line(&placed, style.colour, 0.6 * LINE, style.dash);
        }
    }
    frame.outline(&mut drawing, Labelled::BOTH);
    Some(texts.figure(drawing))
}
