//! Fig. 4, the grains in rows and columns, and Fig. 5, the initial orientations.

use glam::{DQuat, DVec3};
use grainwake_plot::drawing::{Anchor, Drawing, path_data};
use grainwake_plot::raster::Raster;
use grainwake_plot::style::{HAIR, INK, PAGE, SMALL};
use grainwake_plot::{Figure, letter, text};
use grainwake_shape::Shape;
use grainwake_shape::render::{Picture, View};
use grainwake_solver::dem::Grain;

use super::data::{FigureData, value_text};
use crate::plan::Run;

/// Pixels of a picture per point of the page.
const PIXELS: f64 = 2.5;
/// Colour of a fully lit surface.
const STONE: [f64; 3] = [222.0, 200.0, 165.0];
/// Brightness of the silhouette's rim, which blends into the page.
const RIM: f64 = 0.4;
/// Height of the name below a picture in the figure of all grains [pt].
const NAME: f64 = 10.0;
/// Largest width of a picture in the figure of all grains [pt].
const LARGEST: f64 = (PAGE - LEFT) / 4.0;
/// Left edge of the pictures of all grains [pt].
const LEFT: f64 = 44.0;

/// First grain of a run's case.
fn first_grain(data: &FigureData, run: &Run) -> Option<Grain> {
    data.case(run)?.setup.grains.into_iter().next()
}

/// Draws the grains of an axis, seen from the same side at the same scale.
pub fn family(data: &FigureData, notes: &mut Vec<String>) -> Option<Figure> {
    let request = &data.plan.analysis.figures;
    let axis = request.grains.as_ref()?;
    let (rows, columns) = (request.rows.as_ref()?, request.columns.as_ref()?);
    let (down, across) = (data.factor_values(rows), data.factor_values(columns));
    let mut found: Vec<(String, usize, usize, Grain)> = Vec::new();
    for name in data.levels(axis) {
        let run = data.run_at(axis, &name)?;
        let index = |factor: &str, values: &[f64]| {
            values.iter().position(|v| run.factors.get(factor) == Some(v))
        };
        let (Some(row), Some(column)) = (index(rows, &down), index(columns, &across)) else {
            continue;
        };
        match first_grain(data, run) {
            Some(grain) => found.push((name, row, column, grain)),
            None => notes
                .push(format!("the figure of the grains lacks {name}: its case cannot be read")),
        }
    }
    let radii = found.iter().map(|f| f.3.shape.bounding_radius());
    let window = 2.04 * radii.reduce(f64::max)?;
    let (left, top) = (LEFT, 16.0);
    let cell = LARGEST.min((PAGE - left) / across.len().max(1) as f64);
    // Seen slightly from above and from the side, so that the third dimension shows.
    let rotation = (DQuat::from_rotation_x(-0.45) * DQuat::from_rotation_y(0.35)).conjugate();
    let view = View { right: rotation * DVec3::X, up: rotation * DVec3::Y };
    let pictures = found.iter().map(|found| rendered(&found.3.shape, view, window, cell));
    let pictures: Vec<Picture> = pictures.collect();
    let row_height = row_height(&pictures, cell);
    let bottom = top + row_height * down.len() as f64;
    let mut drawing = Drawing::new(PAGE, bottom + 22.0);
    for ((name, row, column, _), picture) in found.iter().zip(&pictures) {
        let (x, y) = (left + cell * *column as f64, top + row_height * *row as f64);
        let height = cell.min(row_height - NAME);
        drawing.raster(x, y, cell, height, cropped(picture, height));
        let base = y + row_height - 4.0 - 0.36 * SMALL;
        let place = (x + 0.5 * cell, base);
        drawing.note(place, Anchor::Middle, &text::fitting(name, SMALL, cell - 4.0));
    }
    for (n, value) in across.iter().enumerate() {
        let place = (left + cell * (n as f64 + 0.5), 9.0);
        let label = data.fitting_label(columns, *value, cell - 4.0);
        drawing.text(place, Anchor::Middle, &label);
    }
    for (n, value) in down.iter().enumerate() {
        let label = data.fitting_label(rows, *value, row_height - 4.0);
        let y = top + row_height * (n as f64 + 0.45);
        drawing.upward_text((12.0, y), &label);
    }
    let diameter = found.first()?.3.shape.equivalent_diameter();
    let corner = (left + 6.0, bottom + 10.0);
    scale_bar(&mut drawing, corner, cell / window, diameter);
    let caption = format!(
        "{} grains at the same scale, from the same side. Rows: equal {rows}; columns: equal \
         {columns}. The bar is the equivalent diameter, {:.3} mm.",
        found.len(),
        1e3 * diameter
    );
    Some(Figure::new("fig04-grains", "The grains", caption, drawing).numbered(4))
}

/// Draws one grain in all orientations, seen along y with gravity downwards.
pub fn orientations(data: &FigureData, notes: &mut Vec<String>) -> Option<Figure> {
    let request = &data.plan.analysis.figures;
    let (grains, axis) = (request.grains.as_ref()?, request.orientations.as_ref()?);
    let oriented = request.oriented.as_ref()?;
    let names = data.levels(axis);
    let cell = PAGE / names.len().max(1) as f64;
    let mut drawing = Drawing::new(PAGE, cell + 14.0);
    let mut drawn = 0;
    for (n, name) in names.iter().enumerate() {
        let mut runs = data.plan.runs.iter();
        let run = runs
            .find(|r| r.levels.get(grains) == Some(oriented) && r.levels.get(axis) == Some(name));
        let Some(grain) = run.and_then(|run| first_grain(data, run)) else {
            notes.push(format!(
                "the figure of the initial orientations lacks {oriented} in {name}: its case \
                 cannot be read"
            ));
            continue;
        };
        let rotation = grain.pose.orientation.conjugate();
        let view = View { right: rotation * DVec3::X, up: rotation * DVec3::Z };
        let window = 2.3 * grain.shape.bounding_radius();
        let x = cell * n as f64;
        let picture = rendered(&grain.shape, view, window, cell);
        drawing.raster(x, 12.0, cell, cell, cropped(&picture, cell));
        let label = format!("{}  {}", letter(n), text::literal(name));
        drawing.text((x + 6.0, 9.0), Anchor::Start, &label);
        drawn += 1;
    }
    let corner = (10.0, cell + 2.0);
    for (tip, name, shift) in [
        ((corner.0 + 20.0, corner.1), "*x*", (4.0, 2.0)),
        ((corner.0, corner.1 - 20.0), "*z*", (-2.5, -3.0)),
    ] {
        arrow(&mut drawing, corner, tip);
        let place = (tip.0 + shift.0, tip.1 + shift.1);
        drawing.label(place, Anchor::Start, SMALL, INK, name);
    }
    let caption = format!(
        "The initial orientations of {}, seen along y. Gravity points down.",
        text::literal(oriented)
    );
    let title = "The initial orientations";
    let figure = Figure::new("fig05-orientations", title, caption, drawing).numbered(5);
    (drawn > 0).then_some(figure)
}

/// Draws an arrow with its head at `to`.
pub(super) fn arrow(drawing: &mut Drawing, from: (f64, f64), to: (f64, f64)) {
    drawing.line(&[from, to], INK, 0.8, None);
    let length = (to.0 - from.0).hypot(to.1 - from.1).max(1e-9);
    let (dx, dy) = ((to.0 - from.0) / length, (to.1 - from.1) / length);
    let barb = |side: f64| {
        let (along, across) = (4.0, 1.7 * side);
        (to.0 - along * dx + across * dy, to.1 - along * dy - across * dx)
    };
    let head = path_data(&[barb(1.0), to, barb(-1.0)], true);
    drawing.path(&head, &format!("fill=\"{INK}\""));
}

/// Draws a bar of a length [m] at a scale [pt/m], with its label.
fn scale_bar(drawing: &mut Drawing, (x, y): (f64, f64), scale: f64, length: f64) {
    let end = x + scale * length;
    drawing.line(&[(x, y), (end, y)], INK, 1.4, None);
    for at in [x, end] {
        drawing.line(&[(at, y - 2.5), (at, y + 2.5)], INK, HAIR, None);
    }
    let label = format!("*d* = {} mm", value_text(1e3 * length));
    drawing.note((end + 5.0, y), Anchor::Start, &label);
}

/// Renders a shape in a square window [m] that is drawn `width` [pt] wide.
fn rendered(shape: &Shape, view: View, window: f64, width: f64) -> Picture {
    Picture::of(shape, view, (PIXELS * width) as usize, window, false)
}

/// Height [pt] of a row of pictures `width` [pt] wide and their names, in which no grain is cut.
fn row_height(pictures: &[Picture], width: f64) -> f64 {
    let tallest = pictures.iter().map(height).fold(0.0, f64::max);
    (0.62 * width).max(tallest + 2.0 + NAME)
}

/// Height [pt] that a picture needs around its middle so that no grain is cut.
fn height(picture: &Picture) -> f64 {
    let rows = picture.pixels.chunks(picture.width);
    let inked = rows.enumerate().filter(|(_, row)| row.iter().any(|pixel| *pixel != [255; 3]));
    let from_middle = inked.map(|(i, _)| (i + 1).max(picture.height - i));
    from_middle.max().map_or(0.0, |rows| (2 * rows - picture.height) as f64 / PIXELS)
}

/// Crops a picture to a height [pt] around its middle.
fn cropped(picture: &Picture, height: f64) -> Raster {
    let rows = ((PIXELS * height) as usize).min(picture.height);
    let from = (picture.height - rows) / 2;
    let kept = &picture.pixels[from * picture.width..(from + rows) * picture.width];
    Raster {
        width: picture.width,
        height: rows,
        pixels: kept.iter().map(|p| index(*p)).collect(),
        palette: palette(),
    }
}

/// Palette of 224 shades of stone, then 32 steps from a dark rim to the page.
fn palette() -> Vec<[u8; 3]> {
    let shade = |s: f64| STONE.map(|c| (s * c).round() as u8);
    let rim = |w: f64| STONE.map(|c| (255.0 * w + (1.0 - w) * RIM * c).round() as u8);
    let shades = (0..224).map(|i| shade(f64::from(i) / 223.0));
    shades.chain((0..32).map(|i| rim(f64::from(i) / 31.0))).collect()
}

/// Index of the nearest palette colour, from the portions of stone and page in a pixel.
fn index(pixel: [u8; 3]) -> u8 {
    let [r, _, b] = pixel.map(f64::from);
    let stone = (r - b) / (STONE[0] - STONE[2]);
    let page = ((r - STONE[0] * stone) / 255.0).clamp(0.0, 1.0);
    if page < 0.04 {
        (223.0 * stone.clamp(0.0, 1.0)).round() as u8
    } else {
        224 + (31.0 * page).round() as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_is_not_cut() {
        let sphere = Shape::sphere(1e-3, 100);
        let picture = rendered(&sphere, View::BROAD, 2.04 * sphere.bounding_radius(), 60.0);
        let tall = height(&picture);
        assert!((57.0..=60.0).contains(&tall), "{tall}");
        let row = row_height(std::slice::from_ref(&picture), 60.0);
        let raster = cropped(&picture, row - NAME);
        let page = index([255; 3]);
        let edges = [&raster.pixels[..raster.width], &raster.pixels[raster.pixels.len() - 60..]];
        assert!(edges.iter().all(|row| row.iter().all(|pixel| *pixel == page)));
    }

    #[test]
    fn palette_colours_approximate_the_picture() {
        let colours = palette();
        assert_eq!(colours.len(), 256);
        for s in [0.12, 0.5, 0.97] {
            let pixel = STONE.map(|c| (s * c) as u8);
            let got = colours[usize::from(index(pixel))];
            assert!(got.iter().zip(pixel).all(|(a, b)| a.abs_diff(b) <= 6), "{got:?} {pixel:?}");
        }
        assert_eq!(colours[usize::from(index([255; 3]))], [255; 3]);
    }
}
