//! Slices of the flow at the key instants: speed with arrows, and vorticity normal to the plane.

use grainwake_plot::axis::extent;
use grainwake_plot::equal_aspect::{Window, length_unit};
use grainwake_plot::style::series_colour;
use grainwake_plot::{Drawing, Figure, letter};

use super::scene::{AXES, Scene};
use super::section::Section;
use super::slice_grid::{self, ColourScale, Column, Quantity, Style};
use super::slice_outlines;
use crate::features::{RunKind, short};
use crate::run_folder::FrameFile;

/// Draws the speed and the vorticity; slices that cannot be read are added to `notes`.
pub fn figures(scene: &Scene, notes: &mut Vec<String>) -> Vec<Figure> {
    if scene.run.slices.is_empty() {
        if scene.run.facts.fluid_density.is_some() {
            notes.push("there are no slices of the flow in slices/".to_owned());
        }
        return Vec::new();
    }
    let columns = columns(scene, notes);
    let figures = [speed(scene, &columns), vorticity(scene, &columns)];
    figures.into_iter().flatten().collect()
}

/// Reads the slices at the key instants; a pair that no single plane contains has two rows.
fn columns(scene: &Scene, notes: &mut Vec<String>) -> Vec<Column> {
    let mut read = |frame: &FrameFile| -> Option<Section> {
        let image = scene.run.slice(frame);
        let section = image.and_then(|image| scene.section(&image));
        section.map_err(|what| notes.push(scene.run.left_out(frame, &what))).ok()
    };
    let mut out: Vec<Column> = Vec::new();
    let mut apart = false;
    for (i, instant) in scene.instants.iter().enumerate() {
        let frames = scene.run.slices.iter().filter(|f| f.time == instant.time);
        let frames: Vec<&FrameFile> = frames.collect();
        let through = |grain: usize| frames.iter().find(|frame| frame.grain == Some(grain));
        let sections = match scene.features.pair {
            Some(pair) if pair.iter().any(|grain| through(*grain).is_some()) => {
                pair.map(|grain| through(grain).and_then(|frame| read(frame))).to_vec()
            }
            _ => vec![frames.first().and_then(|frame| read(frame))],
        };
        let Some(first) = sections.iter().flatten().next() else {
            continue;
        };
        let view = first.view;
        apart |= scene.out_of_plane(instant.time, view);
        out.push(Column {
            title: format!("{} {}", letter(i), instant.name),
            time: scene.features.time_text(instant.time),
            at: instant.time,
            window: first.whole(),
            centres: scene.centres(instant.time, view),
            outlines: Vec::new(),
            sections,
        });
    }
    if !apart {
        for column in &mut out {
            let first = column.sections.drain(..).flatten().next();
            column.sections.push(first);
        }
    }
    if let ([only], Some(instant)) = (out.as_mut_slice(), scene.instants.first()) {
        only.title = instant.name.to_owned();
    }
    crop(scene, &mut out);
    for column in &mut out {
        column.outlines = slice_outlines::of_column(scene, column);
    }
    out
}

/// Returns the names and colours of the rows of a pair; empty for a single row.
fn row_names(scene: &Scene, columns: &[Column]) -> Vec<(String, &'static str)> {
    let name = |grain: usize| {
        let colour = series_colour(scene.features.grain_rank(grain));
        (format!("plane of grain {grain}"), colour)
    };
    let several = columns.iter().any(|column| column.sections.len() > 1);
    let pair = scene.features.pair.filter(|_| several);
    pair.map_or(Vec::new(), |pair| pair.map(name).to_vec())
}

/// Crops all windows to one size around settling grains: at least eight diameters wide, with the
/// wake above the grains.
pub fn crop(scene: &Scene, columns: &mut [Column]) {
    let settling = matches!(scene.features.kind, RunKind::Pair | RunKind::Single);
    let diameter = scene.run.facts.diameter();
    let Some(diameter) = diameter.filter(|_| settling && scene.features.travels) else {
        return;
    };
    let span = |column: &Column, pick: fn(&(f64, f64)) -> f64| {
        extent(column.centres.iter().map(|(_, p)| pick(p))).unwrap_or((0.0, 0.0))
    };
    let widest = |pick: fn(&(f64, f64)) -> f64| {
        let spans = columns.iter().map(|c| span(c, pick));
        spans.map(|(low, high)| high - low).fold(0.0, f64::max)
    };
    let widths = columns.iter().map(|c| c.window.width());
    let box_width = widths.fold(f64::INFINITY, f64::min);
    let width = (8.0 * diameter).max(widest(|p| p.0) + 4.0 * diameter).min(box_width);
    let height = (1.9 * width).max(widest(|p| p.1) + 5.0 * diameter);
    // Shifts a range of a given size into the whole range.
    let fit = |low: f64, size: f64, from: f64, to: f64| {
        let low = if size >= to - from { from } else { low.clamp(from, to - size) };
        (low, (low + size).min(to))
    };
    for column in columns {
        let Window { low, high } = column.window;
        let (x, z) = (span(column, |p| p.0), span(column, |p| p.1));
        let left = 0.5 * (x.0 + x.1) - 0.5 * width;
        let (x0, x1) = fit(left, width, low.0, high.0);
        let below = match column.sections.iter().flatten().any(|section| section.view.flipped) {
            true => z.1 + 2.5 * diameter - height,
            false => z.0 - 2.5 * diameter,
        };
        let (z0, z1) = fit(below, height, low.1, high.1);
        column.window = Window { low: (x0, z0), high: (x1, z1) };
    }
}

/// Draws a quantity; none if it is zero everywhere.
fn draw(scene: &Scene, columns: &[Column], quantity: Quantity) -> Option<(ColourScale, Drawing)> {
    let scale = ColourScale::new(&Style::new(quantity), columns);
    if scale.largest <= 0.0 {
        return None;
    }
    let drawing = slice_grid::draw(columns, &row_names(scene, columns), &scale, None)?;
    Some((scale, drawing))
}

fn speed(scene: &Scene, columns: &[Column]) -> Option<Figure> {
    let (scale, drawing) = draw(scene, columns, Quantity::Speed)?;
    let caption = format!(
        "{} Colour is the speed of the fluid, at most {} m/s; arrows show the velocity in the \
         plane, their length in proportion.{}",
        planes(scene, columns),
        short(scale.largest),
        downwards(scene, columns)
    );
    Some(Figure::new("speed", "Speed of the fluid", caption, drawing))
}

fn vorticity(scene: &Scene, columns: &[Column]) -> Option<Figure> {
    let (scale, drawing) = draw(scene, columns, Quantity::Vorticity)?;
    let view = columns.iter().flat_map(|c| c.sections.iter().flatten()).next()?.view;
    let sense = if view.clockwise() { "clockwise" } else { "anticlockwise" };
    let mut caption = format!(
        "{} Colour is the vorticity about {} (positive, red, turns {sense} in this view), at most \
         {} 1/s.",
        planes(scene, columns),
        AXES[view.normal],
        short(scale.largest)
    );
    let end = scale.axis.high();
    if scale.largest > end {
        caption += &format!(" Values beyond ±{} 1/s have the end colours.", short(end));
    }
    caption += &downwards(scene, columns);
    Some(Figure::new("vorticity", "Vorticity of the fluid", caption, drawing))
}

/// Returns a sentence about a vertical axis that is shown downwards; empty if there is none.
fn downwards(scene: &Scene, columns: &[Column]) -> String {
    let mut sections = columns.iter().flat_map(|column| column.sections.iter().flatten());
    let flipped = sections.any(|section| section.view.flipped);
    if flipped { scene.downwards() } else { String::new() }
}

/// Returns the planes and their times in words.
fn planes(scene: &Scene, columns: &[Column]) -> String {
    let times = match columns {
        [only] => only.time.clone(),
        _ => {
            // Instants without a name have a letter only.
            let time = |column: &Column| match column.title.trim() {
                letter if letter.ends_with(')') => format!("{letter} {}", column.time),
                title => format!("{title}, {}", column.time),
            };
            columns.iter().map(time).collect::<Vec<_>>().join("; ")
        }
    };
    let mut sections = columns.iter().flat_map(|c| c.sections.iter().flatten());
    let Some(first) = sections.next() else {
        return String::new();
    };
    let normal = AXES[first.view.normal];
    let moves = columns.windows(2).any(|c| c[0].window != c[1].window);
    let follows = if moves { " The window follows the motion." } else { "" };
    let several = columns.iter().any(|column| column.sections.len() > 1);
    match (scene.features.kind, scene.features.pair) {
        (_, Some(pair)) if several => {
            let [trailing, leading] = pair.map(|grain| scene.features.grain_name(grain));
            format!(
                "Planes normal to {normal} through the centres of {trailing} (upper row) and of \
                 {leading} (lower row): {times}.{follows}"
            )
        }
        (_, Some(_)) => format!("Plane normal to {normal} through both grains: {times}.{follows}"),
        (RunKind::Single, _) => {
            format!("Plane normal to {normal} through the grain: {times}.{follows}")
        }
        _ => {
            let (unit, factor) = length_unit(first.whole().width().max(first.whole().height()));
            let place = short(first.place * factor);
            format!("The plane {normal} = {place} {unit}: {times}.")
        }
    }
}
