//! Slices of the flow at the key instants: speed with arrows, and vorticity across the plane.

use super::axis::Axis;
use super::colormap::ColorMap;
use super::plan::Window;
use super::section::Section;
use super::sheet::{self, Column, Look};
use super::{Figure, Scene, letter};
use crate::run_folder::FrameFile;
use crate::story::{Subject, short};

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
    let mut read = |frame: Option<&FrameFile>| -> Option<Section> {
        let frame = frame?;
        let section = scene.run.slice(frame).and_then(|image| Section::of(&image));
        section
            .map_err(|what| {
                notes.push(format!(
                    "{} was left out: {what}",
                    scene.run.short_name(&frame.file)
                ))
            })
            .ok()
    };
    let apart = scene
        .instants
        .iter()
        .any(|instant| scene.out_of_plane(instant.time));
    let mut out = Vec::new();
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
            Some([behind, ahead]) if apart => vec![read(of(behind)), read(of(ahead))],
            Some([behind, ahead]) => {
                vec![read(of(behind).or(of(ahead)).or(frames.first().copied()))]
            }
            None => vec![read(frames.first().copied())],
        };
        if sections.iter().all(Option::is_none) {
            continue;
        }
        let title = format!("{} {}", letter(i), instant.name);
        let centres = scene.centres(instant.time);
        let whole = sections.iter().flatten().next().map(Section::whole);
        let Some(whole) = whole else { continue };
        out.push(Column {
            title,
            time: scene.story.time_text(instant.time),
            at: instant.time,
            window: whole,
            sections,
            centres,
        });
    }
    crop(scene, &mut out);
    out
}

impl Scene<'_> {
    /// Centres (x, z) of all grains at a time.
    fn centres(&self, time: f64) -> Vec<(usize, (f64, f64))> {
        let place = |(grain, history): (usize, &crate::run_folder::History)| {
            let position = history.position[history.nearest(time)?];
            Some((grain, (position.x, position.z)))
        };
        self.run
            .grains
            .iter()
            .enumerate()
            .filter_map(place)
            .collect()
    }

    /// Whether one vertical plane cannot show both grains of a pair.
    fn out_of_plane(&self, time: f64) -> bool {
        let Some([a, b]) = self.story.pair else {
            return false;
        };
        let y = |grain: usize| {
            let history = &self.run.grains[grain];
            history.nearest(time).map(|row| history.position[row].y)
        };
        let diameter = self.run.facts.diameter().unwrap_or(0.0);
        y(a).zip(y(b))
            .is_some_and(|(a, b)| (a - b).abs() > 0.25 * diameter)
    }
}

/// Cuts all windows to the same size about the grains: eight diameters wide, the wake above them.
fn crop(scene: &Scene, columns: &mut [Column]) {
    let Some(diameter) = scene.run.facts.diameter() else {
        return;
    };
    if !matches!(scene.story.subject, Subject::Pair | Subject::Single) {
        return;
    }
    let span = |column: &Column, pick: fn(&(f64, f64)) -> f64| {
        super::axis::extent(column.centres.iter().map(|(_, p)| pick(p))).unwrap_or((0.0, 0.0))
    };
    let widest = |pick: fn(&(f64, f64)) -> f64| {
        columns
            .iter()
            .map(|c| span(c, pick))
            .map(|(low, high)| high - low)
            .fold(0.0, f64::max)
    };
    let width = (8.0 * diameter).max(widest(|p| p.0) + 4.0 * diameter);
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
    let highest = shown_values(columns, value).fold(0.0, f64::max);
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
    };
    let drawing = sheet::draw(scene, columns, rows, &look, value)?;
    let caption = format!(
        "{} Colour is the speed of the fluid, at most {} m/s here; arrows show the velocity in the plane, their length in proportion.",
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
    let mut sizes: Vec<f64> = shown_values(columns, value).map(f64::abs).collect();
    sizes.sort_by(f64::total_cmp);
    let highest = *sizes.last()?;
    // Thin layers at the grains would hide the wakes: the scale ends where one cell in fifty of
    // those with visible vorticity lies beyond.
    let visible = &sizes[sizes.partition_point(|v| *v < 0.02 * highest)..];
    let end = *visible.get(visible.len().saturating_sub(1) * 49 / 50)?;
    if end <= 0.0 {
        return None;
    }
    let axis = Axis::linear("vorticity *ω*_{y}  [1/s]", -end, end, 4, false);
    let end = axis.high();
    let look = Look {
        map: ColorMap::Signed,
        low: -end,
        high: end,
        arrows: None,
        axis,
        beyond: (highest > end, highest > end),
    };
    let drawing = sheet::draw(scene, columns, rows, &look, value)?;
    let caption = format!(
        "{} Colour is the vorticity about y (positive, red, turns clockwise in this view), at most {} 1/s here; values beyond ±{} 1/s take the end colours.",
        planes(scene, columns, rows),
        short(highest),
        short(end)
    );
    Some(Figure {
        name: "vorticity",
        title: "Vorticity of the fluid".to_owned(),
        caption,
        drawing,
    })
}

/// Which planes are shown.
fn planes(scene: &Scene, columns: &[Column], rows: usize) -> String {
    let times: Vec<String> = columns
        .iter()
        .map(|column| format!("{}, {}", column.title.trim(), column.time))
        .collect();
    let times = times.join("; ");
    match (scene.story.subject, scene.story.pair) {
        (Subject::Flow, _) => {
            let y = columns
                .iter()
                .flat_map(|column| column.sections.iter().flatten())
                .next()
                .map_or(0.0, |s| s.y);
            format!(
                "The plane y = {} m at {}.",
                short(y),
                columns.last().map_or("", |column| column.time.as_str())
            )
        }
        (_, Some(pair)) if rows == 2 => format!(
            "Vertical planes through the centres of {} (upper row) and of {} (lower row): {times}. The window follows the grains.",
            scene.story.grain_name(pair[0]),
            scene.story.grain_name(pair[1])
        ),
        (_, Some(_)) => format!(
            "Vertical plane through the centres of both grains: {times}. The window follows the grains."
        ),
        (Subject::Single, None) => format!(
            "Vertical plane through the centre of the grain: {times}. The window follows the grain."
        ),
        (_, None) => format!("Vertical plane through the centre of a grain: {times}."),
    }
}

/// Values of all cells that the windows show, grains left out.
fn shown_values<'a>(
    columns: &'a [Column],
    value: impl Fn(&Section) -> Option<Vec<f64>> + 'a,
) -> impl Iterator<Item = f64> + 'a {
    columns.iter().flat_map(move |column| {
        let mut out = Vec::new();
        for section in column.sections.iter().flatten() {
            if let Some(values) = value(section) {
                out.extend(
                    section
                        .cells_in(column.window)
                        .filter(|c| section.solid(*c) < 0.5)
                        .map(|c| values[c]),
                );
            }
        }
        out.into_iter().filter(|v| v.is_finite())
    })
}
