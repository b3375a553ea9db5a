//! Slices of the flow at the key instants: speed with arrows, and vorticity across the plane.

use super::section::{Section, View};
use super::sheet::{self, Cells, Column, Look};
use super::{AXES, Figure, Scene, cuts, letter};
use crate::run_folder::{FrameFile, History};
use crate::story::{Subject, short};
use grainwake_plot::axis::Axis;
use grainwake_plot::colormap::ColorMap;
use grainwake_plot::equal_aspect::{Window, length_unit};
use grainwake_plot::style::series_colour;

/// Speed and vorticity slices; what cannot be read is added to `notes`.
pub fn figures(scene: &Scene, notes: &mut Vec<String>) -> Vec<Figure> {
    if scene.run.slices.is_empty() {
        if scene.run.facts.fluid_density.is_some() {
            notes.push("there are no slices of the flow in slices/".to_owned());
        }
        return Vec::new();
    }
    let columns = columns(scene, notes);
    let rows = columns
        .iter()
        .map(|column| column.sections.len())
        .max()
        .unwrap_or(0);
    let mut out = Vec::new();
    out.extend(speed(scene, &columns, rows));
    out.extend(vorticity(scene, &columns, rows));
    out
}

fn columns(scene: &Scene, notes: &mut Vec<String>) -> Vec<Column> {
    let vertical = scene.vertical().0;
    let mut read = |frame: Option<&FrameFile>| -> Option<Section> {
        let frame = frame?;
        let section = scene
            .run
            .slice(frame)
            .and_then(|image| Section::of(&image, vertical));
        let name = scene.run.short_name(&frame.file);
        section
            .map_err(|what| notes.push(format!("{name} was left out: {what}")))
            .ok()
    };
    let mut out: Vec<Column> = Vec::new();
    let mut apart = false;
    for (i, instant) in scene.instants.iter().enumerate() {
        let frames: Vec<&FrameFile> = scene
            .run
            .slices
            .iter()
            .filter(|frame| frame.time == instant.time)
            .collect();
        let of = |grain: usize| {
            frames
                .iter()
                .find(|frame| frame.grain == Some(grain))
                .copied()
        };
        let sections = match scene.story.pair {
            Some(pair) if of(pair[0]).is_some() => pair.map(|grain| read(of(grain))).to_vec(),
            _ => vec![read(frames.first().copied())],
        };
        let Some(first) = sections.iter().flatten().next() else {
            continue;
        };
        let view = first.view;
        apart |= scene.out_of_plane(instant.time, view);
        out.push(Column {
            title: format!("{} {}", letter(i), instant.name),
            time: scene.story.time_text(instant.time),
            at: instant.time,
            window: first.whole(),
            centres: scene.centres(instant.time, view),
            cuts: Vec::new(),
            sections,
        });
    }
    // While both grains lie in one plane, one row shows both.
    if !apart {
        for column in &mut out {
            let first = column.sections.drain(..).flatten().next();
            column.sections.push(first);
        }
    }
    if let [only] = out.as_mut_slice() {
        only.title = scene
            .instants
            .first()
            .map_or("", |instant| instant.name)
            .to_owned();
    }
    crop(scene, &mut out);
    for column in &mut out {
        column.cuts = cuts::of_column(scene, column);
    }
    out
}

/// The planes of a pair, by name and colour, where each has its row.
fn row_names(scene: &Scene, rows: usize) -> Vec<(String, &'static str)> {
    let name = |grain: usize| {
        let colour = series_colour(scene.story.grain_rank(grain));
        (format!("plane of grain {grain}"), colour)
    };
    let pair = scene.story.pair.filter(|_| rows > 1);
    pair.map_or(Vec::new(), |pair| pair.map(name).to_vec())
}

impl Scene<'_> {
    /// Centres of all grains at a time, as seen.
    pub(super) fn centres(&self, time: f64, view: View) -> Vec<(usize, (f64, f64))> {
        let place = |(grain, history): (usize, &History)| {
            Some((grain, view.seen(self.run.wrapped(history.pose(time)?.0))))
        };
        self.run
            .grains
            .iter()
            .enumerate()
            .filter_map(place)
            .collect()
    }

    /// Whether one plane cannot show both grains of a pair.
    fn out_of_plane(&self, time: f64, view: View) -> bool {
        let Some([a, b]) = self.story.pair else {
            return false;
        };
        let place = |grain: usize| Some(self.run.grains[grain].pose(time)?.0);
        let diameter = self.run.facts.diameter().unwrap_or(0.0);
        place(a)
            .zip(place(b))
            .is_some_and(|(a, b)| self.run.nearest(a - b)[view.normal].abs() > 0.25 * diameter)
    }
}

/// Cuts all windows to the same size about the grains: eight diameters wide, the wake above them.
fn crop(scene: &Scene, columns: &mut [Column]) {
    let Some(diameter) = scene.run.facts.diameter() else {
        return;
    };
    let settling = matches!(scene.story.subject, Subject::Pair | Subject::Single);
    if !settling || !scene.story.travels {
        return;
    }
    let span = |column: &Column, pick: fn(&(f64, f64)) -> f64| {
        grainwake_plot::axis::extent(column.centres.iter().map(|(_, p)| pick(p)))
            .unwrap_or((0.0, 0.0))
    };
    let widest = |pick: fn(&(f64, f64)) -> f64| {
        columns
            .iter()
            .map(|c| span(c, pick))
            .map(|(low, high)| high - low)
            .fold(0.0, f64::max)
    };
    let box_width = columns
        .iter()
        .map(|c| c.window.width())
        .fold(f64::INFINITY, f64::min);
    let width = (8.0 * diameter)
        .max(widest(|p| p.0) + 4.0 * diameter)
        .min(box_width);
    let height = (1.9 * width).max(widest(|p| p.1) + 5.0 * diameter);
    for column in columns {
        let whole = column.window;
        let place = |low: f64, size: f64, from: f64, to: f64| {
            let low = if size >= to - from {
                from
            } else {
                low.clamp(from, to - size)
            };
            (low, (low + size).min(to))
        };
        let (x, z) = (span(column, |p| p.0), span(column, |p| p.1));
        let (x0, x1) = place(
            0.5 * (x.0 + x.1) - 0.5 * width,
            width,
            whole.low.0,
            whole.high.0,
        );
        let (z0, z1) = place(z.0 - 2.5 * diameter, height, whole.low.1, whole.high.1);
        column.window = Window {
            low: (x0, z0),
            high: (x1, z1),
        };
    }
}

fn speed(scene: &Scene, columns: &[Column], rows: usize) -> Option<Figure> {
    let value = |section: &Section| {
        section
            .velocity
            .as_ref()
            .map(|v| v.iter().map(|v| v[2]).collect::<Vec<_>>())
    };
    let highest = sheet::shown_values(columns, value).fold(0.0, f64::max);
    if highest <= 0.0 {
        return None;
    }
    let axis = Axis::linear("speed |*u*|  [m/s]", 0.0, highest, 5, false);
    let top = axis.high();
    let look = Look {
        map: ColorMap::Magnitude,
        low: 0.0,
        high: top,
        arrows: Some(highest),
        axis,
        beyond: (false, false),
        rows: row_names(scene, rows),
        unit: None,
        cells: Cells::Smooth,
    };
    let drawing = sheet::draw(columns, rows, &look, value)?;
    let caption = format!(
        "{} Colour is the speed of the fluid, at most {} m/s; arrows show the velocity in the plane, their length in proportion.",
        planes(scene, columns, rows),
        short(highest)
    );
    Some(Figure {
        name: "speed",
        title: "Speed of the fluid".to_owned(),
        caption,
        drawing,
    })
}

fn vorticity(scene: &Scene, columns: &[Column], rows: usize) -> Option<Figure> {
    let value = |section: &Section| section.vorticity.clone();
    let (end, highest) = sheet::signed_end(sheet::shown_values(columns, value))?;
    let view = columns
        .iter()
        .flat_map(|c| c.sections.iter().flatten())
        .next()?
        .view;
    let normal = AXES[view.normal];
    let axis = Axis::linear(
        &format!("vorticity *ω*_{{{normal}}}  [1/s]"),
        -end,
        end,
        4,
        false,
    );
    let end = axis.high();
    let look = Look {
        map: ColorMap::Signed,
        low: -end,
        high: end,
        arrows: None,
        axis,
        beyond: (highest > end, highest > end),
        rows: row_names(scene, rows),
        unit: None,
        cells: Cells::Smooth,
    };
    let drawing = sheet::draw(columns, rows, &look, value)?;
    let mut caption = format!(
        "{} Colour is the vorticity about {normal} (positive, red, turns {} in this view), at most {} 1/s.",
        planes(scene, columns, rows),
        if view.clockwise() {
            "clockwise"
        } else {
            "anticlockwise"
        },
        short(highest)
    );
    if highest > end {
        caption.push_str(&format!(
            " Values beyond ±{} 1/s take the end colours.",
            short(end)
        ));
    }
    Some(Figure {
        name: "vorticity",
        title: "Vorticity of the fluid".to_owned(),
        caption,
        drawing,
    })
}

/// Which planes are shown, and when.
fn planes(scene: &Scene, columns: &[Column], rows: usize) -> String {
    let times: Vec<String> = columns
        .iter()
        .map(|column| format!("{}, {}", column.title.trim(), column.time))
        .collect();
    let times = if columns.len() == 1 {
        columns[0].time.clone()
    } else {
        times.join("; ")
    };
    let Some(first) = columns
        .iter()
        .flat_map(|column| column.sections.iter().flatten())
        .next()
    else {
        return String::new();
    };
    let normal = AXES[first.view.normal];
    let follows = if scene.story.travels {
        " The window follows the motion."
    } else {
        ""
    };
    match (scene.story.subject, scene.story.pair) {
        (_, Some([behind, ahead])) if rows == 2 => format!(
            "Planes normal to {normal} through the centres of {} (upper row) and of {} (lower row): {times}.{follows}",
            scene.story.grain_name(behind),
            scene.story.grain_name(ahead)
        ),
        (_, Some(_)) => format!("Plane normal to {normal} through both grains: {times}.{follows}"),
        (Subject::Single, _) => {
            format!("Plane normal to {normal} through the grain: {times}.{follows}")
        }
        _ => {
            let (unit, factor) = length_unit(first.whole().width().max(first.whole().height()));
            format!(
                "The plane {normal} = {} {unit}: {times}.",
                short(first.place * factor)
            )
        }
    }
}
