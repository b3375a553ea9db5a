//! Slices side by side on one colour scale, of one run or of several.

use std::path::Path;

use grainwake_formats::vti::Image;

use super::section::Section;
use super::sheet::{self, Cells, Column, Look};
use super::silhouette::Outline;
use super::{AXES, Scene, cuts};
use crate::run_folder::RunFolder;
use crate::story::Story;
use grainwake_plot::axis::Axis;
use grainwake_plot::colormap::ColorMap;
use grainwake_plot::drawing::Drawing;
use grainwake_plot::equal_aspect::Window;
use grainwake_plot::style::INK;

/// What is shown of a slice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Magnitude of the velocity.
    Speed,
    /// Vorticity along the normal of the plane.
    Vorticity,
    /// Part of each cell that a grain fills, cell by cell.
    SolidFraction,
}

/// One slice.
pub struct Panel<'a> {
    /// What stands above it, in label markup.
    pub title: String,
    /// The slice, one cell thick.
    pub image: &'a Image,
    /// The part that is shown; none for all of it.
    pub window: Option<Window>,
    /// The run folder, whose tables say where the grains are; without it they are outlined along
    /// half solid fraction.
    pub run: Option<&'a Path>,
}

/// How the slices are shown.
#[derive(Clone, Debug, Default)]
pub struct Style {
    /// Label of the colour scale, in label markup; none for the quantity in SI units.
    pub label: Option<String>,
    /// End of the colour scale; none to take it from the values.
    pub limit: Option<f64>,
    /// What lengths are in, such as "d"; none for metres and parts of them.
    pub length: Option<String>,
    /// Whether arrows show the velocity in the plane, over the speed.
    pub arrows: bool,
}

/// Draws the slices, z or else y upwards.
///
/// # Errors
/// A slice that cannot be drawn or has no such quantity, in words.
pub fn draw(panels: &[Panel], quantity: Quantity, style: &Style) -> Result<Drawing, String> {
    let columns = panels.iter().map(column).collect::<Result<Vec<_>, _>>()?;
    let value = |section: &Section| match quantity {
        Quantity::Speed => section
            .velocity
            .as_ref()
            .map(|v| v.iter().map(|v| v[2]).collect::<Vec<_>>()),
        Quantity::Vorticity => section.vorticity.clone(),
        Quantity::SolidFraction => section.solid_fraction().map(<[f64]>::to_vec),
    };
    let normal = match columns.first().and_then(|c| c.sections[0].as_ref()) {
        Some(section) => AXES[section.view.normal],
        None => return Err("there is no slice".to_owned()),
    };
    if columns
        .iter()
        .flat_map(|c| c.sections.iter().flatten())
        .any(|section| value(section).is_none())
    {
        return Err("a slice has no such quantity".to_owned());
    }
    let look = match quantity {
        Quantity::Speed => {
            let highest = sheet::shown_values(&columns, value).fold(0.0, f64::max);
            let end = style.limit.unwrap_or(highest);
            let axis = scale(style, "speed |*u*|  [m/s]", 0.0, end);
            let arrows = (style.arrows && highest > 0.0).then_some(highest);
            let beyond = (false, highest > axis.high());
            look(ColorMap::Magnitude, axis, arrows, beyond, Cells::Smooth)
        }
        Quantity::Vorticity => {
            let found = sheet::signed_end(sheet::shown_values(&columns, value));
            let (end, highest) = found.unwrap_or((1.0, 0.0));
            let end = style.limit.unwrap_or(end);
            let label = format!("vorticity *ω*_{{{normal}}}  [1/s]");
            let axis = scale(style, &label, -end, end);
            let beyond = highest > axis.high();
            look(
                ColorMap::Signed,
                axis,
                None,
                (beyond, beyond),
                Cells::Smooth,
            )
        }
        Quantity::SolidFraction => {
            let axis = scale(style, "solid fraction  [–]", 0.0, 1.0);
            look(ColorMap::Magnitude, axis, None, (false, false), Cells::Flat)
        }
    };
    let look = Look {
        unit: style.length.clone(),
        ..look
    };
    sheet::draw(&columns, 1, &look, value).ok_or_else(|| "there is no slice".to_owned())
}

fn column(panel: &Panel) -> Result<Column, String> {
    let section = Section::of(panel.image, 2)?;
    let whole = section.whole();
    let window = match panel.window {
        None => whole,
        Some(wanted) => Window {
            low: (wanted.low.0.max(whole.low.0), wanted.low.1.max(whole.low.1)),
            high: (
                wanted.high.0.min(whole.high.0),
                wanted.high.1.min(whole.high.1),
            ),
        },
    };
    if !(window.width() > 0.0 && window.height() > 0.0) {
        return Err("the part that is asked for lies outside the slice".to_owned());
    }
    let rings = section.outlines();
    let mut column = Column {
        title: panel.title.clone(),
        time: String::new(),
        at: panel.image.frame.time,
        window,
        cuts: vec![rings.into_iter().map(|ring| (INK, ring)).collect()],
        centres: Vec::new(),
        sections: vec![Some(section)],
    };
    if let Some(cuts) = panel.run.and_then(|run| exact(run, &column)) {
        column.cuts = cuts;
    }
    Ok(column)
}

/// Outlines of the grains from the tables of the run, all dark; none where they do not say enough.
fn exact(run: &Path, column: &Column) -> Option<Vec<Vec<(&'static str, Outline)>>> {
    let run = RunFolder::open(run).ok()?;
    let story = Story::of(&run);
    let bodies = super::bodies(&run, &mut Vec::new());
    let scene = Scene {
        run: &run,
        story: &story,
        bodies,
        instants: Vec::new(),
    };
    let view = column.sections.iter().flatten().next()?.view;
    let placed = Column {
        title: String::new(),
        time: String::new(),
        at: column.at,
        window: column.window,
        centres: scene.centres(column.at, view),
        cuts: Vec::new(),
        sections: column.sections.clone(),
    };
    if placed.centres.is_empty() {
        return None;
    }
    let dark = |rings: Vec<(&'static str, Outline)>| {
        rings.into_iter().map(|(_, ring)| (INK, ring)).collect()
    };
    Some(
        cuts::of_column(&scene, &placed)
            .into_iter()
            .map(dark)
            .collect(),
    )
}

fn scale(style: &Style, label: &str, low: f64, high: f64) -> Axis {
    let label = style.label.as_deref().unwrap_or(label);
    Axis::linear(label, low, high, 4, style.limit.is_some())
}

fn look(
    map: ColorMap,
    axis: Axis,
    arrows: Option<f64>,
    beyond: (bool, bool),
    cells: Cells,
) -> Look {
    Look {
        map,
        low: axis.low(),
        high: axis.high(),
        arrows,
        axis,
        beyond,
        rows: Vec::new(),
        unit: None,
        cells,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use grainwake_formats::vti::{Array, Frame};

    /// A disc in a uniform stream along x.
    fn image() -> Image {
        let inside = |i: usize| {
            let (x, z) = ((i % 20) as f64 + 0.5, (i / 20) as f64 + 0.5);
            (4.5 - (x - 10.0).hypot(z - 5.0)).clamp(0.0, 1.0) as f32
        };
        let array = |name: &str, components, data| Array {
            name: name.to_owned(),
            components,
            data,
        };
        Image {
            frame: Frame {
                cells: [20, 1, 10],
                spacing: DVec3::ONE,
                origin: DVec3::ZERO,
                time: 1.0,
            },
            arrays: vec![
                array("solid_fraction", 1, (0..200).map(inside).collect()),
                array(
                    "velocity",
                    3,
                    (0..600).map(|i| f32::from(u8::from(i % 3 == 0))).collect(),
                ),
            ],
        }
    }

    #[test]
    fn slices_stand_side_by_side() {
        let image = image();
        let panel = |title: &str, window| Panel {
            title: title.to_owned(),
            image: &image,
            window,
            run: None,
        };
        let window = Window {
            low: (5.0, -1.0),
            high: (15.0, 10.0),
        };
        let style = Style {
            length: Some("d".to_owned()),
            ..Style::default()
        };
        let both = [panel("whole", None), panel("part", Some(window))];
        for quantity in [Quantity::Speed, Quantity::SolidFraction] {
            let drawing = draw(&both, quantity, &style).unwrap();
            let svg = drawing.to_svg("f", "t", "d");
            assert!(svg.contains(">whole<") && svg.contains(">part<"));
            assert!(
                svg.contains("/<tspan font-style=\"italic\">d</tspan>"),
                "{svg}"
            );
        }
        let problem = draw(&both, Quantity::Vorticity, &style).unwrap_err();
        assert!(problem.contains("no such quantity"));
        let outside = Window {
            low: (30.0, 0.0),
            high: (40.0, 5.0),
        };
        assert!(draw(&[panel("out", Some(outside))], Quantity::Speed, &style).is_err());
    }
}
