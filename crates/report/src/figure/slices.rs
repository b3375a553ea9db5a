//! Slices of the flow at the key instants: speed with arrows, and vorticity across the plane.

use super::axis::Axis;
use super::colormap::ColorMap;
use super::plan::{Plan, Window, colour_bar, length_unit};
use super::section::Section;
use super::style::{self, HAIR, INK, PAGE, SMALL, TEXT, grain_colour};
use super::svg::{Anchor, Drawing, path_data};
use super::{Figure, Scene, letter};
use crate::run_folder::FrameFile;
use crate::story::{Subject, short};

/// Pixels of a slice for each point of the paper.
const PIXELS: f64 = 3.0;
/// Distance of the arrows [pt].
const ARROWS: f64 = 8.5;

/// One column of the figure: an instant, and the plane of each row.
struct Column {
    title: String,
    time: String,
    window: Window,
    sections: Vec<Option<Section>>,
    /// Centres of the grains at that instant, for the colour of their outlines.
    centres: Vec<(usize, (f64, f64))>,
}

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

/// Cuts all windows to the same size about the grains: ten diameters wide, the wake above them.
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
    let width = (10.0 * diameter).max(widest(|p| p.0) + 4.0 * diameter);
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
    let drawing = sheet(scene, columns, rows, &look, value)?;
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
    let drawing = sheet(scene, columns, rows, &look, value)?;
    let caption = format!(
        "{} Colour is the vorticity about y (out of the page is −y), at most {} 1/s here; values beyond ±{} 1/s take the end colours.",
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
            "Vertical planes through the centre of {} (upper row) and {} (lower row): {times}. The window follows the grains.",
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

/// How a quantity is shown.
struct Look {
    map: ColorMap,
    low: f64,
    high: f64,
    /// Largest speed, if arrows are drawn.
    arrows: Option<f64>,
    axis: Axis,
    beyond: (bool, bool),
}

fn sheet(
    scene: &Scene,
    columns: &[Column],
    rows: usize,
    look: &Look,
    value: impl Fn(&Section) -> Option<Vec<f64>>,
) -> Option<Drawing> {
    let first = columns.first()?;
    let (left, gap, right) = (36.0 + if rows > 1 { 12.0 } else { 0.0 }, 25.0, 6.0);
    let n = columns.len() as f64;
    let room = (PAGE - left - right - gap * (n - 1.0)) / n;
    let widest = columns.iter().map(|c| c.window.width()).fold(0.0, f64::max);
    let tallest = columns
        .iter()
        .map(|c| c.window.height())
        .fold(0.0, f64::max);
    let scale = (room.min(230.0) / widest).min(if rows > 1 { 200.0 } else { 260.0 } / tallest);
    let (width, height) = (scale * widest, scale * tallest);
    let total = (left + n * width + (n - 1.0) * gap + right).max(220.0);
    let start = left + 0.5 * (total - left - right - n * width - (n - 1.0) * gap);
    let top = 22.0;
    let bottom = top + rows as f64 * height + (rows as f64 - 1.0) * 12.0;
    let mut drawing = Drawing::new(total, bottom + 26.0 + 32.0);
    let (unit, _) = length_unit(first.window.width().max(first.window.height()));
    let (x_name, z_name) = (format!("*x*  [{unit}]"), format!("*z*  [{unit}]"));
    for (c, column) in columns.iter().enumerate() {
        let x = start + c as f64 * (width + gap);
        drawing.label(
            x + 0.5 * width,
            8.5,
            Anchor::Middle,
            TEXT,
            INK,
            column.title.trim(),
            false,
        );
        drawing.label(
            x + 0.5 * width,
            18.0,
            Anchor::Middle,
            SMALL,
            INK,
            &column.time,
            false,
        );
        for (r, section) in column.sections.iter().enumerate() {
            let y = top + r as f64 * (height + 12.0);
            let plan = Plan {
                window: column.window,
                corner: (x, y),
                scale,
            };
            match section {
                Some(section) => {
                    draw_section(
                        &mut drawing,
                        scene,
                        column,
                        section,
                        &plan,
                        look,
                        &value,
                        &format!("clip-{c}-{r}"),
                    );
                }
                None => drawing.label(
                    x + 0.5 * width,
                    y + 0.5 * height,
                    Anchor::Middle,
                    SMALL,
                    style::FAINT,
                    "no slice",
                    false,
                ),
            }
            let across = if r + 1 == rows {
                Some(x_name.as_str())
            } else {
                None
            };
            plan.frame(
                &mut drawing,
                (across, Some(if c == 0 { z_name.as_str() } else { "" })),
            );
        }
    }
    if let (Some(pair), true) = (scene.story.pair, rows > 1) {
        for (r, grain) in pair.iter().enumerate() {
            let y = top + (r as f64 + 0.5) * height + 12.0 * r as f64;
            let colour = grain_colour(scene.story.grain_rank(*grain));
            drawing.label(
                9.0,
                y,
                Anchor::Middle,
                SMALL,
                colour,
                &format!("plane of grain {grain}"),
                true,
            );
        }
    }
    let bar = 180.0_f64.min(total - 40.0);
    colour_bar(
        &mut drawing,
        (0.5 * (total - bar), bottom + 28.0),
        bar,
        &look.map.palette(),
        &look.axis,
        look.beyond,
    );
    Some(drawing)
}

fn draw_section(
    drawing: &mut Drawing,
    scene: &Scene,
    column: &Column,
    section: &Section,
    plan: &Plan,
    look: &Look,
    value: impl Fn(&Section) -> Option<Vec<f64>>,
    clip: &str,
) {
    let Some(values) = value(section) else { return };
    let (width, height) = (plan.width(), plan.height());
    let pixels = |size: f64| ((PIXELS * size).round() as usize).clamp(1, 2000);
    let position = |v: f64| (v - look.low) / (look.high - look.low);
    let raster = section.raster(
        plan.window,
        pixels(width),
        pixels(height),
        look.map.palette(),
        |cell| values[cell],
        position,
    );
    drawing.raster(plan.corner.0, plan.corner.1, width, height, raster);
    plan.clip(drawing, clip);
    if let (Some(highest), Some(velocity)) = (look.arrows, &section.velocity) {
        draw_arrows(drawing, section, velocity, plan, highest);
    }
    for ring in section.outlines() {
        let n = ring.len() as f64;
        let middle = ring
            .iter()
            .fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / n, sum.1 + p.1 / n));
        let distance = |p: &(f64, f64)| (p.0 - middle.0).hypot(p.1 - middle.1);
        let owner = column
            .centres
            .iter()
            .min_by(|a, b| distance(&a.1).total_cmp(&distance(&b.1)));
        let colour = owner.map_or(INK, |(grain, _)| {
            grain_colour(scene.story.grain_rank(*grain))
        });
        let style = format!(
            "fill=\"#d9d9d9\" stroke=\"{colour}\" stroke-width=\"1.1\" stroke-linejoin=\"round\""
        );
        drawing.path(&plan.path(&ring, true), &style);
    }
    drawing.end_clip();
}

fn draw_arrows(
    drawing: &mut Drawing,
    section: &Section,
    velocity: &[[f64; 3]],
    plan: &Plan,
    highest: f64,
) {
    let (columns, rows) = (
        (plan.width() / ARROWS) as usize,
        (plan.height() / ARROWS) as usize,
    );
    let mut data = String::new();
    for row in 0..rows {
        for column in 0..columns {
            let x = plan.corner.0 + plan.width() * (column as f64 + 0.5) / columns as f64;
            let y = plan.corner.1 + plan.height() * (row as f64 + 0.5) / rows as f64;
            let at = (
                plan.window.low.0 + (x - plan.corner.0) / plan.scale,
                plan.window.high.1 - (y - plan.corner.1) / plan.scale,
            );
            if section.sample(|cell| section.solid(cell), at) > 0.1 {
                continue;
            }
            let u = section.sample(|cell| velocity[cell][0], at) / highest;
            let w = section.sample(|cell| velocity[cell][1], at) / highest;
            let size = u.hypot(w);
            if !(size > 0.06) {
                continue;
            }
            let length = 1.7 * ARROWS * size.min(1.0);
            let (dx, dy) = (u / size, -w / size);
            let tip = (x + 0.5 * length * dx, y + 0.5 * length * dy);
            let head = 0.35 * length.min(5.0);
            let barb = |side: f64| {
                (
                    tip.0 - head * (dx - 0.5 * side * dy),
                    tip.1 - head * (dy + 0.5 * side * dx),
                )
            };
            data.push_str(&path_data(
                &[(x - 0.5 * length * dx, y - 0.5 * length * dy), tip],
                false,
            ));
            data.push_str(&path_data(&[barb(1.0), tip, barb(-1.0)], false));
        }
    }
    if !data.is_empty() {
        let style = format!(
            "fill=\"none\" stroke=\"{INK}\" stroke-opacity=\"0.75\" stroke-width=\"{}\"",
            HAIR - 0.1
        );
        drawing.path(&data, &style);
    }
}
