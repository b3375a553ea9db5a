//! Slices in columns (instants) and rows (planes) on one colour scale.

use grainwake_plot::axis::{Axis, AxisRange};
use grainwake_plot::colormap::ColorMap;
use grainwake_plot::drawing::{Anchor, Drawing};
use grainwake_plot::equal_aspect::{EqualAspectFrame, Window, colour_bar, length_unit};
use grainwake_plot::style::{FAINT, INK, PAGE, SMALL};
use grainwake_plot::text;

use serde::Deserialize;

use super::arrows::{self, ArrowKey};
use super::grain_surface::Outline;
use super::scene::AXES;
use super::section::{Section, Shading};

/// Pixels of a slice per point of the page.
const PIXELS: f64 = 3.0;
/// Distance between rows [pt].
const ROW_GAP: f64 = 12.0;
/// Space between the colour bar and the key of the arrows [pt].
const KEY_GAP: f64 = 20.0;

/// Quantity shown in slices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// Magnitude of the velocity.
    Speed,
    /// Vorticity along the normal of the plane.
    Vorticity,
    /// Solid fraction, one colour per cell.
    SolidFraction,
}

impl Quantity {
    /// Returns the values by cell; `None` if the slice does not hold the quantity.
    pub fn values(self, section: &Section) -> Option<Vec<f64>> {
        match self {
            Quantity::Speed => {
                let velocity = section.velocity.as_ref();
                velocity.map(|cells| cells.iter().map(|v| v[2]).collect())
            }
            Quantity::Vorticity => section.vorticity.clone(),
            Quantity::SolidFraction => section.solid_fraction().map(<[f64]>::to_vec),
        }
    }
}

/// Quantity with options of its colour scale, the arrows and the axes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Style {
    /// Quantity.
    pub quantity: Quantity,
    /// Label of the colour scale, in label markup; `None` for the quantity in SI units.
    pub label: Option<String>,
    /// End of the colour scale; `None` to derive it from the values.
    pub limit: Option<f64>,
    /// Unit of lengths, such as "d"; `None` for metres and fractions of metres.
    pub length: Option<String>,
    /// Whether arrows show the velocity in the plane, over the speed.
    #[serde(default)]
    pub arrows: bool,
}

impl Style {
    /// Returns the default options for a quantity; only the speed has arrows.
    pub fn new(quantity: Quantity) -> Style {
        Style {
            quantity,
            label: None,
            limit: None,
            length: None,
            arrows: quantity == Quantity::Speed,
        }
    }
}

/// Slices at one instant, one per row.
pub struct Column {
    /// Title, in label markup.
    pub title: String,
    /// Time as text, in label markup.
    pub time: String,
    /// Time [s].
    pub at: f64,
    /// Displayed range.
    pub window: Window,
    /// Slices; `None` for a row without one.
    pub sections: Vec<Option<Section>>,
    /// Centres of the grains in the plane.
    pub centres: Vec<(usize, (f64, f64))>,
    /// Outlines of the grains in the plane of each row, with their colours.
    pub outlines: Vec<Vec<(&'static str, Outline)>>,
}

/// Colour scale of a quantity.
pub struct ColourScale {
    quantity: Quantity,
    map: ColorMap,
    /// Range and label.
    pub axis: Axis,
    /// Largest magnitude in the windows, outside the grains.
    pub largest: f64,
    /// Unit of the values, in label markup; empty if the label states none.
    unit: String,
    arrows: bool,
}

impl ColourScale {
    /// Creates the colour scale that covers the values of all columns, or ends at the given limit.
    pub fn new(style: &Style, columns: &[Column]) -> ColourScale {
        let quantity = style.quantity;
        let values = || shown_values(columns, quantity);
        let range = match style.limit {
            Some(_) => AxisRange::Tight,
            None => AxisRange::Rounded,
        };
        let scale = |label: &str, low: f64, high: f64, steps: usize| {
            let label = style.label.as_deref().unwrap_or(label);
            Axis::linear(label, low, high, steps, range)
        };
        let (map, axis, largest) = match quantity {
            Quantity::Speed => {
                let largest = values().fold(0.0, f64::max);
                let end = style.limit.unwrap_or(largest);
                let axis = scale("speed |*u*|  [m/s]", 0.0, end, 5);
                (ColorMap::Magnitude, axis, largest)
            }
            Quantity::Vorticity => {
                let (end, largest) = signed_range(values()).unwrap_or((1.0, 0.0));
                let end = style.limit.unwrap_or(end);
                let mut sections = columns.iter().flat_map(|c| c.sections.iter().flatten());
                let normal = sections.next().map_or("", |section| AXES[section.view.normal]);
                let label = format!("vorticity *ω*_{{{normal}}}  [1/s]");
                (ColorMap::Signed, scale(&label, -end, end, 4), largest)
            }
            Quantity::SolidFraction => {
                let axis = scale("solid fraction  [–]", 0.0, 1.0, 4);
                (ColorMap::Magnitude, axis, 1.0)
            }
        };
        // A label of the user's, such as "|u|/U", may have no unit in brackets.
        let unit = match &style.label {
            None => "m/s",
            Some(label) => {
                label.split_once('[').and_then(|l| Some(l.1.split_once(']')?.0)).unwrap_or("")
            }
        };
        ColourScale {
            quantity,
            map,
            axis,
            largest,
            unit: unit.trim_matches('–').to_owned(),
            arrows: style.arrows && quantity == Quantity::Speed && largest > 0.0,
        }
    }

    /// Sets the largest magnitude, by which the arrows are scaled [m/s].
    pub fn set_largest(&mut self, largest: f64) {
        self.largest = largest;
        self.arrows |= self.quantity == Quantity::Speed && largest > 0.0;
    }

    /// Returns whether values lie below and above the scale.
    fn beyond(&self) -> (bool, bool) {
        let above = self.largest > self.axis.high() && self.quantity != Quantity::SolidFraction;
        (above && self.quantity == Quantity::Vorticity, above)
    }
}

/// Draws all columns; `rows` are the names of the rows and their colours, empty for a single row.
///
/// Lengths are in `unit`, or in metres and fractions of metres. `None` if there is no slice.
pub fn draw(
    columns: &[Column],
    rows: &[(String, &'static str)],
    scale: &ColourScale,
    unit: Option<&str>,
) -> Option<Drawing> {
    let first = columns.first()?;
    let view = first.sections.iter().flatten().next()?.view;
    let count = rows.len().max(1);
    let several = count > 1;
    let (left, gap, right) = (if several { 48.0 } else { 36.0 }, 25.0, 9.0);
    let n = columns.len() as f64;
    let room = (PAGE - left - right - gap * (n - 1.0)) / n;
    let room = room.min(if columns.len() == 1 { 430.0 } else { 230.0 });
    let largest =
        |size: fn(&Window) -> f64| columns.iter().map(|c| size(&c.window)).fold(0.0, f64::max);
    let (widest, tallest) = (largest(Window::width), largest(Window::height));
    let zoom = (room / widest).min(if several { 200.0 } else { 260.0 } / tallest);
    let (width, height) = (zoom * widest, zoom * tallest);
    let total = (left + n * width + (n - 1.0) * gap + right).max(220.0);
    let start = left + 0.5 * (total - left - right - n * width - (n - 1.0) * gap);
    let timed = columns.iter().any(|c| !c.time.is_empty());
    let titled = columns.iter().any(|c| !c.title.trim().is_empty());
    let top = match (timed, titled) {
        (true, _) => 22.0,
        (false, true) => 12.0,
        (false, false) => 5.0,
    };
    let row_top = |row: usize| top + row as f64 * (height + ROW_GAP);
    let bottom = row_top(count) - ROW_GAP;
    let mut drawing = Drawing::new(total, bottom + 26.0 + 32.0);
    let (si_unit, _) = length_unit(first.window.width().max(first.window.height()));
    let name = |axis: usize| match unit {
        Some(unit) => format!("*{}*/*{}*", AXES[axis], text::literal(unit)),
        None => format!("*{}*  [{si_unit}]", AXES[axis]),
    };
    let (x_name, z_name) = (name(view.across), name(view.up));
    for (c, column) in columns.iter().enumerate() {
        let x = start + c as f64 * (width + gap);
        let middle = x + 0.5 * width;
        drawing.text((middle, 8.5), Anchor::Middle, column.title.trim());
        drawing.label((middle, 18.0), Anchor::Middle, SMALL, INK, &column.time);
        for (r, section) in column.sections.iter().enumerate() {
            let (window, corner) = (column.window, (x, row_top(r)));
            let frame = EqualAspectFrame { window, corner, scale: zoom, flipped: view.flipped };
            match section {
                Some(section) => {
                    let outlines = column.outlines.get(r).map_or(&[][..], Vec::as_slice);
                    let clip = format!("clip-{c}-{r}");
                    draw_section(&mut drawing, section, outlines, &frame, scale, &clip);
                }
                None => {
                    let centre = (middle, row_top(r) + 0.5 * height);
                    drawing.label(centre, Anchor::Middle, SMALL, FAINT, "no slice");
                }
            }
            let across = (r + 1 == column.sections.len()).then_some(x_name.as_str());
            let up = if c == 0 { z_name.as_str() } else { "" };
            frame.frame(&mut drawing, (across, Some(up)));
        }
    }
    for (r, (name, colour)) in rows.iter().enumerate() {
        let middle = (9.0, row_top(r) + 0.5 * height);
        drawing.upward_label(middle, Anchor::Middle, SMALL, colour, name);
    }
    let key = scale.arrows.then(|| ArrowKey::new(scale.largest, &scale.unit));
    let beside = key.as_ref().map_or(0.0, |key| KEY_GAP + key.width());
    let length = 180.0_f64.min(total - 40.0 - beside);
    let corner = (0.5 * (total - length - beside), bottom + 28.0);
    let palette = scale.map.palette();
    colour_bar(&mut drawing, corner, length, &palette, &scale.axis, scale.beyond());
    if let Some(key) = key {
        key.draw(&mut drawing, (corner.0 + length + KEY_GAP, corner.1 + 3.0));
    }
    Some(drawing)
}

fn draw_section(
    drawing: &mut Drawing,
    section: &Section,
    outlines: &[(&'static str, Outline)],
    frame: &EqualAspectFrame,
    scale: &ColourScale,
    clip: &str,
) {
    let Some(values) = scale.quantity.values(section) else {
        return;
    };
    let (width, height) = (frame.width(), frame.height());
    let pixels = [width, height].map(|size| ((PIXELS * size).round() as usize).clamp(1, 2000));
    let (low, high) = (scale.axis.low(), scale.axis.high());
    let position = |cell: f64| (cell - low) / (high - low);
    let (shading, fill) = match scale.quantity {
        Quantity::SolidFraction => (Shading::Flat, "none"),
        _ => (Shading::Smooth, "#d9d9d9"),
    };
    let palette = scale.map.palette();
    let raster = section.raster(frame.window, pixels, palette, &values, position, shading);
    drawing.raster(frame.corner.0, frame.corner.1, width, height, raster);
    frame.clip(drawing, clip);
    if let Some(velocity) = section.velocity.as_ref().filter(|_| scale.arrows) {
        arrows::draw(drawing, section, velocity, frame, scale.largest);
    }
    for (colour, ring) in outlines {
        let style = format!(
            "fill=\"{fill}\" stroke=\"{colour}\" stroke-width=\"1.1\" stroke-linejoin=\"round\""
        );
        drawing.path(&frame.path(ring, true), &style);
    }
    drawing.end_clip();
}

/// Returns the finite values of all cells in the windows, outside the grains.
fn shown_values(columns: &[Column], quantity: Quantity) -> impl Iterator<Item = f64> + '_ {
    let of_column = move |column: &Column| {
        let of_section = |section: &Section| {
            let values = quantity.values(section).unwrap_or_default();
            let cells = section.cells_in(column.window).filter(|c| section.solid(*c) < 0.5);
            cells.filter_map(|c| values.get(c).copied()).collect::<Vec<f64>>()
        };
        column.sections.iter().flatten().flat_map(of_section).collect::<Vec<f64>>()
    };
    columns.iter().flat_map(of_column).filter(|v| v.is_finite())
}

/// Returns the end of a scale of signed values, and the largest magnitude.
///
/// Thin layers at the grains would hide the wakes, so the scale ends where 2 % of the cells lie
/// beyond it; cells below 2 % of the largest magnitude do not count.
fn signed_range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    sizes.sort_by(f64::total_cmp);
    let highest = *sizes.last()?;
    let visible = &sizes[sizes.partition_point(|v| *v < 0.02 * highest)..];
    let end = *visible.get(visible.len().saturating_sub(1) * 49 / 50)?;
    (end > 0.0).then_some((end, highest))
}
