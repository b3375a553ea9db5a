//! Slices of one or several runs side by side, on one colour scale.

use std::path::Path;

use grainwake_formats::vti::Image;
use grainwake_plot::drawing::Drawing;
use grainwake_plot::equal_aspect::Window;
use grainwake_plot::style::INK;

use super::grain_surface::{self, Outline};
use super::scene::Scene;
use super::section::Section;
use super::slice_grid::{self, ColourScale, Column};
use super::slice_outlines;
use crate::features::RunFeatures;
use crate::run_folder::RunFolder;

pub use super::slice_grid::{Quantity, Style};

/// A slice with its title.
pub struct Panel<'a> {
    /// Title, in label markup.
    pub title: String,
    /// Slice, one cell thick.
    pub image: &'a Image,
    /// Displayed range; `None` for the whole slice.
    pub window: Option<Window>,
    /// Run folder whose tables hold the poses of the grains; without one, grains are outlined along
    /// solid fraction 0.5.
    pub run: Option<&'a Path>,
}

/// Draws the slices, with z or else y upwards.
///
/// # Errors
/// If there is no slice, or a slice cannot be drawn or does not hold the quantity.
pub fn draw(panels: &[Panel], style: &Style) -> Result<Drawing, String> {
    let columns = panels.iter().map(column).collect::<Result<Vec<_>, _>>()?;
    let mut sections = columns.iter().flat_map(|c| c.sections.iter().flatten());
    if sections.any(|section| style.quantity.values(section).is_none()) {
        return Err("a slice has no such quantity".to_owned());
    }
    let scale = ColourScale::new(style, &columns);
    let drawing = slice_grid::draw(&columns, &[], &scale, style.length.as_deref());
    drawing.ok_or_else(|| "there is no slice".to_owned())
}

fn column(panel: &Panel) -> Result<Column, String> {
    let section = Section::of(panel.image, 2)?;
    let whole = section.whole();
    let window = panel.window.map_or(whole, |wanted| wanted.intersection(whole));
    if !(window.width() > 0.0 && window.height() > 0.0) {
        return Err("the window lies outside the slice".to_owned());
    }
    let rings = section.outlines();
    let mut column = Column {
        title: panel.title.clone(),
        time: String::new(),
        at: panel.image.frame.time,
        window,
        outlines: Vec::new(),
        centres: Vec::new(),
        sections: vec![Some(section)],
    };
    let exact = panel.run.and_then(|run| exact_outlines(run, &mut column));
    let rings = exact.unwrap_or(rings);
    column.outlines = vec![rings.into_iter().map(|ring| (INK, ring)).collect()];
    Ok(column)
}

/// Returns the outlines of the grains from the tables of the run; `None` if no pose is known.
fn exact_outlines(run: &Path, column: &mut Column) -> Option<Vec<Outline>> {
    let run = RunFolder::open(run).ok()?;
    let scene = Scene {
        features: &RunFeatures::of(&run),
        surfaces: grain_surface::surfaces(&run, &mut Vec::new()),
        instants: Vec::new(),
        run: &run,
    };
    let view = column.sections.iter().flatten().next()?.view;
    column.centres = scene.centres(column.at, view);
    let outlines = slice_outlines::of_column(&scene, column).concat();
    let known = !column.centres.is_empty();
    known.then(|| outlines.into_iter().map(|(_, ring)| ring).collect())
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
        let array =
            |name: &str, components, data| Array { name: name.to_owned(), components, data };
        Image {
            frame: Frame {
                cells: [20, 1, 10],
                spacing: DVec3::ONE,
                origin: DVec3::ZERO,
                time: 1.0,
            },
            arrays: vec![
                array("solid_fraction", 1, (0..200).map(inside).collect()),
                array("velocity", 3, (0..600).map(|i| f32::from(u8::from(i % 3 == 0))).collect()),
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
        let window = Window { low: (5.0, -1.0), high: (15.0, 10.0) };
        let style = |quantity| Style {
            length: Some("d".to_owned()),
            arrows: false,
            ..Style::new(quantity)
        };
        let both = [panel("whole", None), panel("part", Some(window))];
        for quantity in [Quantity::Speed, Quantity::SolidFraction] {
            let drawing = draw(&both, &style(quantity)).unwrap();
            let svg = drawing.to_svg("f", "t", "d");
            assert!(svg.contains(">whole<") && svg.contains(">part<"));
            assert!(svg.contains("/<tspan font-style=\"italic\">d</tspan>"), "{svg}");
        }
        let problem = draw(&both, &style(Quantity::Vorticity)).unwrap_err();
        assert!(problem.contains("no such quantity"));
        let outside = Window { low: (30.0, 0.0), high: (40.0, 5.0) };
        assert!(draw(&[panel("out", Some(outside))], &style(Quantity::Speed)).is_err());
    }
}
