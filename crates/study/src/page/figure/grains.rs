//! Fig. 4, the grains in their rows and columns, and Fig. 5, the orientations.

use glam::{DQuat, DVec3};
use grainwake_report::figure::raster::Raster;
use grainwake_report::figure::style::{HAIR, INK, PAGE, SMALL, TEXT};
use grainwake_report::figure::svg::{Anchor, Drawing, path_data};
use grainwake_report::figure::text;
use grainwake_shape::Shape;
use grainwake_shape::picture::{Picture, View};
use grainwake_solver::dem::Grain;

use super::{FigureData, StudyFigure, symbol, value_text};

/// Pixels of a picture for each point of the paper.
const PIXELS: f64 = 2.5;
/// Full light of the pictures.
const STONE: [f64; 3] = [222.0, 200.0, 165.0];
/// Grey levels of the rim that blends into the paper.
const RIM: f64 = 0.4;

/// The grains of an axis, each seen from the same side at the same scale.
pub fn family(data: &FigureData, notes: &mut Vec<String>) -> Option<StudyFigure> {
    let plan = &data.plan.analysis.figures;
    let (axis, rows, columns) = (
        plan.grains.as_ref()?,
        plan.rows.as_ref()?,
        plan.columns.as_ref()?,
    );
    let (down, across) = (data.factor_values(rows), data.factor_values(columns));
    let mut found: Vec<(String, usize, usize, Grain)> = Vec::new();
    for name in data.levels(axis) {
        let run = data
            .plan
            .runs
            .iter()
            .find(|r| r.levels.get(axis) == Some(&name))?;
        let place = |factor: &str, values: &[f64]| {
            values
                .iter()
                .position(|v| run.factors.get(factor) == Some(v))
        };
        let (Some(row), Some(column)) = (place(rows, &down), place(columns, &across)) else {
            continue;
        };
        match data
            .case(run)
            .and_then(|c| c.setup.grains.into_iter().next())
        {
            Some(grain) => found.push((name, row, column, grain)),
            None => notes.push(format!(
                "figure 4 lacks {name}: neither its run nor its case can be read"
            )),
        }
    }
    let largest = found
        .iter()
        .map(|f| f.3.shape.bounding_radius())
        .reduce(f64::max)?;
    let (left, top, cell) = (44.0, 16.0, (PAGE - 44.0) / across.len().max(1) as f64);
    let tall = 0.62 * cell;
    let mut drawing = Drawing::new(PAGE, top + tall * down.len() as f64 + 22.0);
    // Seen a little from above and from the side, so that the third dimension shows.
    let turn = DQuat::from_rotation_x(-0.45) * DQuat::from_rotation_y(0.35);
    let view = View {
        right: turn.conjugate() * DVec3::X,
        up: turn.conjugate() * DVec3::Y,
    };
    let window = 2.04 * largest;
    for (name, row, column, grain) in &found {
        let (x, y) = (left + cell * *column as f64, top + tall * *row as f64);
        let picture = cut(&grain.shape, view, window, cell, tall - 10.0);
        drawing.raster(x, y, cell, tall - 10.0, picture);
        drawing.label(
            x + 0.5 * cell,
            y + tall - 4.0,
            Anchor::Middle,
            SMALL,
            INK,
            &text::literal(name),
            false,
        );
    }
    for (n, value) in across.iter().enumerate() {
        let label = format!("{} = {}", symbol(columns), value_text(*value));
        drawing.label(
            left + cell * (n as f64 + 0.5),
            9.0,
            Anchor::Middle,
            TEXT,
            INK,
            &label,
            false,
        );
    }
    for (n, value) in down.iter().enumerate() {
        let label = format!("{} = {}", symbol(rows), value_text(*value));
        drawing.label(
            12.0,
            top + tall * (n as f64 + 0.45),
            Anchor::Middle,
            TEXT,
            INK,
            &label,
            true,
        );
    }
    let diameter = found.first().map(|f| f.3.shape.equivalent_diameter())?;
    scale_bar(
        &mut drawing,
        (left + 6.0, top + tall * down.len() as f64 + 10.0),
        cell / window,
        diameter,
    );
    Some(StudyFigure {
        name: "fig04-grains".into(),
        number: "4".into(),
        title: "The grains".into(),
        caption: format!(
            "{} grains at the same scale, from the same side: a row has one {rows}, a column one {columns}. The bar is the equal-volume diameter, {:.3} mm.",
            found.len(),
            1e3 * diameter
        ),
        drawing,
    })
}

/// One grain in all orientations, seen along y with gravity down.
pub fn orientations(data: &FigureData, notes: &mut Vec<String>) -> Option<StudyFigure> {
    let plan = &data.plan.analysis.figures;
    let (grains, axis, oriented) = (
        plan.grains.as_ref()?,
        plan.orientations.as_ref()?,
        plan.oriented.as_ref()?,
    );
    let names = data.levels(axis);
    let cell = PAGE / names.len().max(1) as f64;
    let mut drawing = Drawing::new(PAGE, cell + 14.0);
    let mut drawn = 0;
    for (n, name) in names.iter().enumerate() {
        let run =
            data.plan.runs.iter().find(|r| {
                r.levels.get(grains) == Some(oriented) && r.levels.get(axis) == Some(name)
            });
        let Some(grain) = run
            .and_then(|r| data.case(r))
            .and_then(|c| c.setup.grains.into_iter().next())
        else {
            notes.push(format!(
                "figure 5 lacks {oriented} in {name}: its case cannot be read"
            ));
            continue;
        };
        let back = grain.pose.orientation.conjugate();
        let view = View {
            right: back * DVec3::X,
            up: back * DVec3::Z,
        };
        let window = 2.3 * grain.shape.bounding_radius();
        let x = cell * n as f64;
        drawing.raster(
            x,
            12.0,
            cell,
            cell,
            cut(&grain.shape, view, window, cell, cell),
        );
        let letter = char::from(b'a' + (n % 26) as u8);
        drawing.label(
            x + 6.0,
            9.0,
            Anchor::Start,
            TEXT,
            INK,
            &format!("({letter})  {}", text::literal(name)),
            false,
        );
        drawn += 1;
    }
    let corner = (10.0, cell + 2.0);
    for (tip, name, at) in [
        ((corner.0 + 20.0, corner.1), "*x*", (4.0, 2.0)),
        ((corner.0, corner.1 - 20.0), "*z*", (-2.5, -3.0)),
    ] {
        arrow(&mut drawing, corner, tip);
        drawing.label(
            tip.0 + at.0,
            tip.1 + at.1,
            Anchor::Start,
            SMALL,
            INK,
            name,
            false,
        );
    }
    (drawn > 0).then(|| StudyFigure {
        name: "fig05-orientations".into(),
        number: "5".into(),
        title: "The initial orientations".into(),
        caption: format!(
            "The initial orientations of {}, seen along y. Gravity points down.",
            text::literal(oriented)
        ),
        drawing,
    })
}

/// An arrow with its head at `to`.
pub(super) fn arrow(drawing: &mut Drawing, from: (f64, f64), to: (f64, f64)) {
    drawing.line(&[from, to], INK, 0.8, None);
    let length = (to.0 - from.0).hypot(to.1 - from.1).max(1e-9);
    let (dx, dy) = ((to.0 - from.0) / length, (to.1 - from.1) / length);
    let barb = |side: f64| {
        (
            to.0 - 4.0 * dx + 1.7 * side * dy,
            to.1 - 4.0 * dy - 1.7 * side * dx,
        )
    };
    drawing.path(
        &path_data(&[barb(1.0), to, barb(-1.0)], true),
        &format!("fill=\"{INK}\""),
    );
}

fn scale_bar(drawing: &mut Drawing, (x, y): (f64, f64), scale: f64, length: f64) {
    let end = x + scale * length;
    drawing.line(&[(x, y), (end, y)], INK, 1.4, None);
    for at in [x, end] {
        drawing.line(&[(at, y - 2.5), (at, y + 2.5)], INK, HAIR, None);
    }
    drawing.label(
        end + 5.0,
        y + 0.36 * SMALL,
        Anchor::Start,
        SMALL,
        INK,
        &format!("*d* = {} mm", value_text(1e3 * length)),
        false,
    );
}

/// A picture of a shape, `window` [m] wide, on a place of this size [pt]; higher or lower than
/// wide, the middle is shown.
fn cut(shape: &Shape, view: View, window: f64, width: f64, height: f64) -> Raster {
    let pixels = (PIXELS * width) as usize;
    let picture = Picture::of(shape, view, pixels, window, false);
    let rows = ((PIXELS * height) as usize).min(pixels);
    let from = (pixels - rows) / 2;
    let kept = &picture.pixels[from * pixels..(from + rows) * pixels];
    Raster {
        width: pixels,
        height: rows,
        pixels: kept.iter().map(|p| index(*p)).collect(),
        palette: palette(),
    }
}

/// 224 shades of stone, then 32 steps from a dark rim to the paper.
fn palette() -> Vec<[u8; 3]> {
    let shade = |s: f64| STONE.map(|c| (s * c).round() as u8);
    let rim = |w: f64| STONE.map(|c| (255.0 * w + (1.0 - w) * RIM * c).round() as u8);
    let stones = (0..224).map(|i| shade(f64::from(i) / 223.0));
    stones
        .chain((0..32).map(|i| rim(f64::from(i) / 31.0)))
        .collect()
}

/// The nearest colour of the palette: how much stone, and how much paper, is in a pixel.
fn index(pixel: [u8; 3]) -> u8 {
    let [r, _, b] = pixel.map(f64::from);
    let stone = (r - b) / (STONE[0] - STONE[2]);
    let paper = ((r - STONE[0] * stone) / 255.0).clamp(0.0, 1.0);
    if paper < 0.04 {
        (223.0 * stone.clamp(0.0, 1.0)).round() as u8
    } else {
        224 + (31.0 * paper).round() as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_keep_near_those_of_the_picture() {
        let colours = palette();
        assert_eq!(colours.len(), 256);
        for s in [0.12, 0.5, 0.97] {
            let pixel = STONE.map(|c| (s * c) as u8);
            let got = colours[usize::from(index(pixel))];
            assert!(
                got.iter().zip(pixel).all(|(a, b)| a.abs_diff(b) <= 6),
                "{got:?} {pixel:?}"
            );
        }
        assert_eq!(colours[usize::from(index([255; 3]))], [255; 3]);
    }
}
