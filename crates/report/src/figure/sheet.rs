//! A sheet of slices: instants across, planes down, one colour scale.

use super::AXES;
use super::section::Section;
use super::silhouette::Outline;
use grainwake_plot::axis::Axis;
use grainwake_plot::colormap::ColorMap;
use grainwake_plot::drawing::{Anchor, Drawing, path_data};
use grainwake_plot::equal_aspect::{EqualAspectFrame, Window, colour_bar, length_unit};
use grainwake_plot::style::{self, HAIR, INK, PAGE, SMALL, TEXT};
use grainwake_plot::text;

/// Pixels of a slice for each point of the paper.
const PIXELS: f64 = 3.0;
/// Distance of the arrows [pt].
const ARROWS: f64 = 8.5;

/// One column of the figure: an instant, and the plane of each row.
pub struct Column {
    pub title: String,
    pub time: String,
    /// The instant [s].
    pub at: f64,
    pub window: Window,
    pub sections: Vec<Option<Section>>,
    /// Centres of the grains at that instant, for the colour of their outlines.
    pub centres: Vec<(usize, (f64, f64))>,
    /// Outlines of the grains in the plane of each row, with their colours.
    pub cuts: Vec<Vec<(&'static str, Outline)>>,
}

/// How a quantity is shown.
pub struct Look {
    pub map: ColorMap,
    pub low: f64,
    pub high: f64,
    /// Largest speed, if arrows are drawn.
    pub arrows: Option<f64>,
    pub axis: Axis,
    pub beyond: (bool, bool),
    /// Names of the rows with their colours, where there are several.
    pub rows: Vec<(String, &'static str)>,
    /// What lengths are in; none for metres and parts of them.
    pub unit: Option<String>,
    /// How the cells are shown.
    pub cells: Cells,
}

/// How the cells of a slice are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cells {
    /// Interpolated between their centres, the grains covered.
    Smooth,
    /// Each in its one colour, the grains outlined.
    Flat,
}

/// Panels of all instants (columns) and planes (rows) on one colour scale.
pub fn draw(
    columns: &[Column],
    rows: usize,
    look: &Look,
    value: impl Fn(&Section) -> Option<Vec<f64>>,
) -> Option<Drawing> {
    let first = columns.first()?;
    let (left, gap, right) = (36.0 + if rows > 1 { 12.0 } else { 0.0 }, 25.0, 9.0);
    let n = columns.len() as f64;
    let room = (PAGE - left - right - gap * (n - 1.0)) / n;
    let widest = columns.iter().map(|c| c.window.width()).fold(0.0, f64::max);
    let tallest = columns
        .iter()
        .map(|c| c.window.height())
        .fold(0.0, f64::max);
    let scale = (room.min(if columns.len() == 1 { 430.0 } else { 230.0 }) / widest)
        .min(if rows > 1 { 200.0 } else { 260.0 } / tallest);
    let (width, height) = (scale * widest, scale * tallest);
    let total = (left + n * width + (n - 1.0) * gap + right).max(220.0);
    let start = left + 0.5 * (total - left - right - n * width - (n - 1.0) * gap);
    let timed = columns.iter().any(|c| !c.time.is_empty());
    let titled = timed || columns.iter().any(|c| !c.title.trim().is_empty());
    let top = if timed {
        22.0
    } else if titled {
        12.0
    } else {
        5.0
    };
    let bottom = top + rows as f64 * height + (rows as f64 - 1.0) * 12.0;
    let mut drawing = Drawing::new(total, bottom + 26.0 + 32.0);
    let (unit, _) = length_unit(first.window.width().max(first.window.height()));
    let view = first.sections.iter().flatten().next()?.view;
    let name = |axis: usize| match &look.unit {
        Some(unit) => format!("*{}*/*{}*", AXES[axis], text::literal(unit)),
        None => format!("*{}*  [{unit}]", AXES[axis]),
    };
    let (x_name, z_name) = (name(view.across), name(view.up));
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
            let plan = EqualAspectFrame {
                window: column.window,
                corner: (x, y),
                scale,
            };
            match section {
                Some(section) => {
                    draw_section(
                        &mut drawing,
                        section,
                        column.cuts.get(r).map_or(&[], Vec::as_slice),
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
    for (r, (name, colour)) in look.rows.iter().enumerate() {
        let y = top + (r as f64 + 0.5) * height + 12.0 * r as f64;
        drawing.label(9.0, y, Anchor::Middle, SMALL, colour, name, true);
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
    section: &Section,
    cuts: &[(&'static str, Outline)],
    plan: &EqualAspectFrame,
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
        look.cells,
    );
    drawing.raster(plan.corner.0, plan.corner.1, width, height, raster);
    plan.clip(drawing, clip);
    if let (Some(highest), Some(velocity)) = (look.arrows, &section.velocity) {
        draw_arrows(drawing, section, velocity, plan, highest);
    }
    let fill = match look.cells {
        Cells::Smooth => "#d9d9d9",
        Cells::Flat => "none",
    };
    for (colour, ring) in cuts {
        let style = format!(
            "fill=\"{fill}\" stroke=\"{colour}\" stroke-width=\"1.1\" stroke-linejoin=\"round\""
        );
        drawing.path(&plan.path(ring, true), &style);
    }
    drawing.end_clip();
}

fn draw_arrows(
    drawing: &mut Drawing,
    section: &Section,
    velocity: &[[f64; 3]],
    plan: &EqualAspectFrame,
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
            if size.is_nan() || size < 0.06 {
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

/// Values of all cells that the windows show, grains left out.
pub fn shown_values<'a>(
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

/// Where a scale of signed values ends, and the largest magnitude. Thin layers at the grains would
/// hide the wakes: the scale ends where one cell in fifty of those with visible values lies beyond.
pub fn signed_end(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    sizes.sort_by(f64::total_cmp);
    let highest = *sizes.last()?;
    let visible = &sizes[sizes.partition_point(|v| *v < 0.02 * highest)..];
    let end = *visible.get(visible.len().saturating_sub(1) * 49 / 50)?;
    (end > 0.0).then_some((end, highest))
}
