//! A result against each varied parameter, one panel per parameter.

use std::collections::BTreeMap;

use grainwake_plot::axis::{Axis, AxisRange, extent};
use grainwake_plot::drawing::Drawing;
use grainwake_plot::frame::{Frame, Labelled};
use grainwake_plot::legend::Legend;
use grainwake_plot::style::PAGE;
use grainwake_plot::{Figure, text};

use super::data::FigureData;
use super::legend::{LineStyles, axes};
use super::misses::{self, STRIP};
use crate::analysis::observation::{Observation, is_time, observations, other_levels};
use crate::format::missed;
use crate::measure::unique;
use crate::plan::Run;
use crate::plan::quantities::SHAPE_FACTORS;

/// Texts of a figure.
pub(super) struct Texts {
    /// File name without extension.
    pub name: &'static str,
    /// Title.
    pub title: &'static str,
    /// Label of the vertical axis.
    pub up: &'static str,
    /// Caption.
    pub caption: String,
}

impl Texts {
    /// Returns the figure of a drawing.
    pub fn figure(self, drawing: Drawing) -> Figure {
        Figure::new(self.name, self.title, self.caption, drawing)
    }
}

/// Left edge of the frames [pt].
pub(super) const LEFT: f64 = 42.0;
const GAP: f64 = 14.0;
const HEIGHT: f64 = 150.0;
/// Largest number of panels in a figure.
const PANELS: usize = 6;
/// Largest number of names along an axis whose values are joined.
const MOST_NAMES_JOINED: usize = 3;

/// A varied parameter.
struct Parameter {
    /// Name of the axis or the factor.
    name: String,
    /// Axis that the parameter belongs to.
    axis: Option<String>,
    /// Coordinate of each model.
    coordinates: BTreeMap<String, f64>,
    /// Names at the coordinates 0.5, 1.5 ...; none for a numerical parameter.
    names: Option<Vec<String>>,
}

impl Parameter {
    /// Returns the horizontal axis; none without coordinates.
    fn across(&self, data: &FigureData) -> Option<Axis> {
        let label = data.axis_label(&self.name);
        if let Some(names) = &self.names {
            let names = names.iter().map(|name| text::literal(name)).collect();
            return Some(Axis::categories(&label, names));
        }
        let (a, b) = extent(self.coordinates.values().copied())?;
        let margin = 0.06 * (b - a);
        Some(Axis::linear(&label, a - margin, b + margin, 5, AxisRange::Tight))
    }
}

/// Returns the varied parameters: the axes; without axes the factors; without factors the models.
///
/// An axis is numerical if a factor has one value per level, distinct between the levels.
fn parameters(data: &FigureData) -> Vec<Parameter> {
    let runs = &data.plan.runs;
    let mut factors = unique(runs.iter().flat_map(|run| run.factors.keys()));
    factors.retain(|factor| !SHAPE_FACTORS.contains(&factor.as_str()));
    factors.sort();
    let of_axis = |(axis, levels): (String, Vec<String>)| {
        let value = |factor: &String, level: &String| -> Option<f64> {
            let here = runs.iter().filter(|r| r.levels.get(&axis) == Some(level));
            let mut values = here.map(|r| r.factors.get(factor).copied());
            let first = values.next()??;
            values.all(|v| v == Some(first)).then_some(first)
        };
        let numerical = factors.iter().find_map(|factor| {
            let values: Option<Vec<f64>> = levels.iter().map(|l| value(factor, l)).collect();
            let mut sorted = values.clone()?;
            sorted.sort_by(f64::total_cmp);
            sorted.dedup();
            (sorted.len() == levels.len()).then_some((factor.clone(), values?))
        });
        let (name, values) = numerical.unzip();
        let known = runs.iter().filter_map(|run| {
            let level = run.levels.get(&axis)?;
            let i = levels.iter().position(|l| l == level)?;
            let at = values.as_ref().map_or(i as f64 + 0.5, |values: &Vec<f64>| values[i]);
            Some((run.model.clone(), at))
        });
        Parameter {
            name: name.unwrap_or(axis.clone()),
            coordinates: known.collect(),
            names: values.is_none().then_some(levels.clone()),
            axis: Some(axis.clone()),
        }
    };
    let mut out: Vec<Parameter> = axes(data).into_iter().map(of_axis).collect();
    if out.is_empty() {
        let of_factor = |factor: &String| {
            let known = runs.iter();
            let known = known.filter_map(|r| Some((r.model.clone(), *r.factors.get(factor)?)));
            Parameter {
                name: factor.clone(),
                axis: None,
                coordinates: known.collect(),
                names: None,
            }
        };
        let varies = |p: &Parameter| {
            extent(p.coordinates.values().copied()).is_some_and(|(low, high)| high > low)
        };
        out.extend(factors.iter().map(of_factor).filter(varies));
    }
    if out.is_empty() {
        let models = unique(runs.iter().map(|run| &run.model));
        let at = models.iter().enumerate().map(|(i, m)| (m.clone(), i as f64 + 0.5));
        out.push(Parameter {
            name: "model".into(),
            axis: None,
            coordinates: at.collect(),
            names: Some(models),
        });
    }
    out
}

/// Draws a quantity against every varied parameter; none if no run has more than a lower bound.
pub(super) fn against_parameters(
    data: &FigureData,
    quantity: &str,
    texts: Texts,
) -> Option<Figure> {
    let all = observations(data.records, quantity, &BTreeMap::new());
    if all.iter().all(|o| o.censored) {
        return None;
    }
    let (low, high) =
        extent(all.iter().filter(|o| o.occurred()).flat_map(|o| [o.range.0, o.range.1, 0.0]))?;
    let misses = all.iter().filter(|o| o.censored).count();
    let strip = if misses > 0 { STRIP } else { 0.0 };
    let mut parameters = parameters(data);
    let left_out = parameters.len().saturating_sub(PANELS);
    parameters.truncate(PANELS);
    let styles = LineStyles::of(data);
    // Names along the axis replace the legend of a single panel.
    let named = matches!(parameters.as_slice(), [Parameter { names: Some(_), .. }]);
    let drawn: Vec<&Run> = all.iter().filter_map(|o| data.run(&o.model)).collect();
    let mut entries = if named { Vec::new() } else { styles.legend_entries(&drawn, true) };
    let several = data.plan.has_members();
    entries.extend((misses > 0).then(|| misses::entry(several)));
    let legend = Legend::new(entries, PAGE - LEFT);
    let columns = parameters.len().min(2);
    let width = (PAGE - LEFT - 8.0 - GAP * (columns as f64 - 1.0)) / columns as f64;
    let frame = |(i, parameter): (usize, &Parameter)| {
        let column = i % columns;
        Some(Frame {
            x: LEFT + column as f64 * (width + GAP),
            y: 0.0,
            width,
            height: HEIGHT,
            across: parameter.across(data)?,
            up: Axis::linear(texts.up, low, high, 5, AxisRange::Rounded),
        })
    };
    let frames: Option<Vec<Frame>> = parameters.iter().enumerate().map(frame).collect();
    let mut frames = frames?;
    let mut bottom = legend.height() + 4.0;
    for row in frames.chunks_mut(columns) {
        let foot = row.iter().map(Frame::foot).fold(0.0, f64::max);
        row.iter_mut().for_each(|frame| frame.y = bottom + strip);
        bottom += strip + HEIGHT + foot + 4.0;
    }
    let mut drawing = Drawing::new(PAGE, bottom);
    legend.draw(&mut drawing, (LEFT, 5.0));
    for (i, (parameter, frame)) in parameters.iter().zip(&frames).enumerate() {
        frame.grid(&mut drawing);
        if misses > 0 {
            misses::strip(&mut drawing, frame, i % columns == 0);
        }
        draw_panel(&mut drawing, frame, parameter, &all, data, &styles);
        frame.outline(&mut drawing, Labelled { across: true, up: i % columns == 0 });
    }
    let mut caption = texts.caption.clone();
    let models = data.plan.runs.iter().filter(|r| r.member == 0).count();
    if all.len() < models {
        caption += &format!(" {} of {models} models have a value.", all.len());
    }
    if several {
        caption += match is_time(quantity) {
            true => {
                " Symbols are medians over an ensemble, runs without the event last; bars are the \
                 range of the events."
            }
            false => " Symbols are means and bars the range over an ensemble.",
        };
    }
    if misses > 0 {
        caption += &format!(" Hollow symbols above the axis: {} no time.", missed(misses, several));
    }
    if left_out > 0 {
        caption += &format!(" {left_out} more axes or factors are not shown.");
    }
    Some(Texts { caption, ..texts }.figure(drawing))
}

fn draw_panel(
    drawing: &mut Drawing,
    frame: &Frame,
    parameter: &Parameter,
    all: &[Observation],
    data: &FigureData,
    styles: &LineStyles,
) {
    let at = |o: &Observation| {
        let x = *parameter.coordinates.get(&o.model)?;
        Some((frame.px(x), frame.py(o.value)))
    };
    // Models that differ only on this axis are joined, except across one without the event, and
    // among many names, which have no order.
    let joins = parameter.names.as_ref().is_none_or(|names| names.len() <= MOST_NAMES_JOINED);
    let mut lines: BTreeMap<BTreeMap<String, String>, Vec<(f64, f64)>> = BTreeMap::new();
    for observation in all {
        if let (Some(axis), Some(point)) =
            (parameter.axis.as_ref().filter(|_| joins), at(observation))
        {
            let point = if observation.censored { (point.0, f64::NAN) } else { point };
            lines.entry(other_levels(&observation.levels, axis)).or_default().push(point);
        }
    }
    for line in lines.values_mut() {
        line.sort_by(|a, b| a.0.total_cmp(&b.0));
        for part in line.split(|point| point.1.is_nan()).filter(|part| part.len() > 1) {
            drawing.line(part, "#b4b4b8", 0.7, None);
        }
    }
    for observation in all {
        let (Some((x, _)), Some(run)) = (at(observation), data.run(&observation.model)) else {
            continue;
        };
        misses::mark(drawing, frame, x, observation, styles.style(run));
    }
}
