//! Pictures of grains with their names and scale bars.

use glam::DMat3;
use grainwake_plot::drawing::{Anchor, Drawing};
use grainwake_plot::raster;
use grainwake_plot::scale_bar::ScaleBar;
use grainwake_plot::style::INK;
use grainwake_plot::text;
use grainwake_shape::Shape;
use grainwake_shape::render::{Picture, View};

/// Size of the text relative to the width of a view, and the smallest size [pixels].
const TEXT: f64 = 0.045;
const SMALLEST_TEXT: f64 = 10.0;
/// Smallest width of a view with name and scale bar [pixels].
const LABELLED: usize = 64;
/// Height of the lines of the name and of the scale bar, and the distance between panels, relative
/// to the text.
const NAME: f64 = 1.7;
const BAR: f64 = 1.8;
const GAP: f64 = 0.9;
/// Largest length of a scale bar relative to the width of a view.
const LONGEST: f64 = 0.35;

/// Views of a grain at one scale, side by side.
pub struct GrainPanel {
    name: String,
    views: Picture,
    /// Width of a view [pixels].
    pixels: usize,
    /// Scale [pixels/m].
    scale: f64,
}

impl GrainPanel {
    /// Renders the broad side of a grain, `pixels` wide and high.
    pub fn broad(name: &str, shape: &Shape, pixels: usize) -> GrainPanel {
        let width = window(shape);
        let views = Picture::of(shape, View::BROAD, pixels, width, false);
        GrainPanel { name: name.to_owned(), views, pixels, scale: pixels as f64 / width }
    }

    /// Renders three sides of a grain: broad side, long side, end; with `nodes` the surface nodes
    /// are drawn as dots.
    pub fn three_sides(name: &str, shape: &Shape, pixels: usize, nodes: bool) -> GrainPanel {
        GrainPanel::sides(name, shape, DMat3::IDENTITY, pixels, window(shape), nodes)
    }

    /// Renders three sides in a frame that `turn` maps to the grain's own; each shows `width` [m].
    pub fn sides(
        name: &str,
        shape: &Shape,
        turn: DMat3,
        pixels: usize,
        width: f64,
        nodes: bool,
    ) -> GrainPanel {
        let views = Picture::sides(shape, turn, pixels, width, nodes);
        GrainPanel { name: name.to_owned(), views, pixels, scale: pixels as f64 / width }
    }

    /// Returns the text size; `None` if the views are too small for text.
    fn text(&self) -> Option<f64> {
        let size = (TEXT * self.pixels as f64).max(SMALLEST_TEXT);
        (self.pixels >= LABELLED).then(|| size.round())
    }
}

/// Width of a view that shows a grain from any side [m].
pub fn window(shape: &Shape) -> f64 {
    2.1 * shape.bounding_radius()
}

/// Arranges panels of equal size in rows of `columns`. Each has its name above and a scale bar
/// below, unless the views are too small for text; a panel without a name has no line for it.
///
/// # Errors
/// The reason, if the picture is too large.
pub fn sheet(panels: Vec<GrainPanel>, columns: usize) -> Result<raster::Picture, String> {
    let columns = columns.clamp(1, panels.len().max(1));
    let Some(first) = panels.first() else {
        return Ok(raster::Picture { width: 1, height: 1, pixels: vec![255; 3] });
    };
    let size = first.text();
    let named = panels.iter().any(|panel| !panel.name.is_empty());
    let line = |relative: f64| size.map_or(0.0, |size| (relative * size).round());
    let (name, bar, gap) = (if named { line(NAME) } else { 0.0 }, line(BAR), line(GAP));
    let margin = (0.5 * gap).round();
    let [wide, high] = [first.views.width, first.views.height].map(|n| n as f64);
    let rows = panels.len().div_ceil(columns) as f64;
    let (width, height) = (
        columns as f64 * (wide + gap) - gap + 2.0 * margin,
        rows * (name + high + bar + gap) - gap + 2.0 * margin,
    );
    let mut drawing = Drawing::new(width, height);
    for (n, panel) in panels.into_iter().enumerate() {
        let left = margin + (n % columns) as f64 * (wide + gap);
        let top = margin + (n / columns) as f64 * (name + high + bar + gap);
        if let Some(size) = size {
            let label = text::fitting(&panel.name, size, wide);
            let base = (left, top + 0.5 * name + 0.36 * size);
            drawing.label(base, Anchor::Start, size, INK, &label);
            let scale_bar = ScaleBar::within(LONGEST * panel.pixels as f64 / panel.scale);
            let middle = top + name + high + 0.5 * bar;
            scale_bar.draw(&mut drawing, (left, middle), panel.scale, size);
        }
        let Picture { width, height, pixels } = panel.views;
        let picture = raster::Picture { width, height, pixels: pixels.as_flattened().to_vec() };
        drawing.picture(left, top + name, wide, high, picture);
    }
    drawing.to_picture([width as u32, height as u32], 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the number of dark pixels in the rows of a picture.
    fn ink(picture: &raster::Picture, rows: std::ops::Range<usize>) -> usize {
        let pixels = picture.pixels[3 * picture.width * rows.start..3 * picture.width * rows.end]
            .chunks_exact(3);
        pixels.filter(|pixel| pixel.iter().all(|v| *v < 90)).count()
    }

    #[test]
    fn panels_have_their_name_and_a_bar_of_the_stated_length() {
        let shape = Shape::sphere(1e-3, 100);
        let panel = |name: &str| vec![GrainPanel::three_sides(name, &shape, 200, false)];
        let named = sheet(panel("pebble"), 1).unwrap();
        let plain = sheet(panel(""), 1).unwrap();
        // Text of 10 pixels: lines of 17 and 18, a margin of 5 (half of 9, rounded).
        assert_eq!((named.width, named.height), (610, 245));
        assert_eq!((plain.width, plain.height), (610, 228));
        assert!(ink(&named, 0..22) > 20, "the name");
        // The window shows 2.1 mm, so that at most 0.735 mm fit: 0.5 mm are 47.6 pixels.
        let line = named.height - 5 - 9;
        let row = &named.pixels[3 * named.width * line..3 * named.width * (line + 1)];
        let light = row.chunks_exact(3).take(100).take_while(|p| p[0] > 127).count();
        let bar = row.chunks_exact(3).skip(light).take_while(|p| p[0] < 128).count();
        assert!(light == 5 && (47..=49).contains(&bar), "{light} {bar}");
    }

    #[test]
    fn small_views_have_no_text() {
        let panels = vec![GrainPanel::three_sides("pebble", &Shape::sphere(1e-3, 100), 32, false)];
        let picture = sheet(panels, 1).unwrap();
        assert_eq!((picture.width, picture.height), (96, 32));
        assert_eq!(sheet(Vec::new(), 3).unwrap().width, 1);
    }
}
