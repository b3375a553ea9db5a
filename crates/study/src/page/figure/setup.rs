//! Fig. 7: the box with the pair at the start, to scale, and the pair enlarged.

use grainwake_plot::drawing::{Anchor, Drawing};
use grainwake_plot::equal_aspect::{EqualAspectFrame, Window, length_unit, outline_style};
use grainwake_plot::style::{BLUE, COLUMN, FAINT, HAIR, INK, SMALL, VERMILION};
use grainwake_plot::{Figure, text};
use grainwake_report::figure::grain_surface::{GrainSurface, Outline};
use grainwake_run::case::Case;
use grainwake_solver::dem::Grain;

use super::data::{FigureData, value_text};
use super::grains::arrow;

/// Top of both views [pt].
const TOP: f64 = 10.0;

/// Draws the initial state of the requested model.
pub fn figure(data: &FigureData, notes: &mut Vec<String>) -> Option<Figure> {
    let name = data.plan.analysis.figures.setup.as_ref()?;
    let case = data.run(name).and_then(|run| data.case(run));
    if case.is_none() {
        notes.push(format!(
            "the figure of the set-up is left out: the case of {name} cannot be read"
        ));
    }
    draw(name, &case?)
}

fn draw(name: &str, case: &Case) -> Option<Figure> {
    let mesh = &case.setup.mesh;
    let (low, high) = (mesh.origin, mesh.upper());
    let [first, second] = case.setup.grains.as_slice() else {
        return None;
    };
    let (leading, trailing) = match first.pose.position.z <= second.pose.position.z {
        true => (first, second),
        false => (second, first),
    };
    let loops = [trailing, leading].map(outlines);
    let whole = Window { low: (low.x, low.z), high: (high.x, high.z) };
    let scale = (0.40 * COLUMN / whole.width()).min(300.0 / whole.height());
    let overall = EqualAspectFrame { window: whole, corner: (34.0, TOP), scale, flipped: false };
    let pair = pair_window(&loops);
    let right = overall.corner.0 + overall.width() + 30.0;
    let zoom = ((COLUMN - right - 46.0) / pair.width()).min(overall.height() / pair.height());
    let detail =
        EqualAspectFrame { window: pair, corner: (right, TOP), scale: zoom, flipped: false };
    let frame_style = format!("fill=\"none\" stroke=\"{FAINT}\" stroke-width=\"{HAIR}\"");
    let mut drawing = Drawing::new(COLUMN, TOP + overall.height() + 26.0);
    let (x, y) = overall.at((pair.low.0, pair.high.1));
    let (w, h) = (pair.width() * scale, pair.height() * scale);
    drawing.rectangle(x, y, w, h, &frame_style);
    for (from, to) in [(y, TOP), (y + h, TOP + detail.height())] {
        drawing.line(&[(x + w, from), (right, to)], FAINT, HAIR, Some("2 2"));
    }
    for view in [&overall, &detail] {
        for (outlines, colour) in loops.iter().zip([BLUE, VERMILION]) {
            drawing.path(&view.paths(outlines), &outline_style(colour, 1.0));
        }
    }
    let (unit, _) = length_unit(whole.height());
    let [x_label, z_label] = ["x", "z"].map(|axis| format!("*{axis}*  [{unit}]"));
    overall.frame(&mut drawing, (Some(&x_label), Some(&z_label)));
    let (width, height) = (detail.width(), detail.height());
    drawing.rectangle(right, TOP, width, height, &frame_style);
    // The gap between the lowest point of the upper grain and the highest of the lower one.
    let heights = |i: usize| loops[i].iter().flatten().map(|p| p.1);
    let bottom = heights(0).fold(f64::INFINITY, f64::min);
    let top = heights(1).fold(f64::NEG_INFINITY, f64::max);
    let middle = 0.5 * (pair.low.0 + pair.high.0);
    let (from, to) = (detail.at((middle, top)), detail.at((middle, bottom)));
    let centre = (from.0, 0.5 * (from.1 + to.1));
    arrow(&mut drawing, centre, from);
    arrow(&mut drawing, centre, to);
    let side = right + width + 4.0;
    let gap = format!("{} mm", value_text(1e3 * (bottom - top)));
    drawing.note((side, centre.1), Anchor::Start, &gap);
    for (grain, word, colour) in [(trailing, "trailing", BLUE), (leading, "leading", VERMILION)] {
        let y = detail.at((0.0, grain.pose.position.z)).1 + 0.36 * SMALL;
        drawing.label((side, y), Anchor::Start, SMALL, colour, word);
    }
    let foot = TOP + height + 24.0;
    let arrow_end = |y: f64| (right + 6.0, foot + y);
    arrow(&mut drawing, arrow_end(-12.0), arrow_end(8.0));
    drawing.label((right + 12.0, foot), Anchor::Start, SMALL, INK, "*g*");
    let size = (high - low).to_array().map(|length| value_text(1e3 * length)).join(" × ");
    let cells = mesh.cells.map(|n| n.to_string()).join(" × ");
    let caption = format!(
        "The pair {} at the start, seen along y: the whole box of {size} mm ({cells} cells), and \
         the pair enlarged. The gap between the surfaces is {:.2} mm, or {:.2} equal-volume \
         diameters.",
        text::literal(name),
        1e3 * (bottom - top),
        (bottom - top) / leading.shape.equivalent_diameter()
    );
    Some(Figure::new("fig07-setup", "The set-up", caption, drawing).numbered(7))
}

/// Window around both outlines, with a margin; at least 0.6 times as wide as the pair is high.
fn pair_window(loops: &[Vec<Outline>; 2]) -> Window {
    let points = || loops.iter().flatten().flatten();
    let low = |pick: fn(&(f64, f64)) -> f64| points().map(pick).fold(f64::INFINITY, f64::min);
    let high = |pick: fn(&(f64, f64)) -> f64| points().map(pick).fold(f64::NEG_INFINITY, f64::max);
    let (x0, x1, z0, z1) = (low(|p| p.0), high(|p| p.0), low(|p| p.1), high(|p| p.1));
    let margin = 0.12 * (z1 - z0);
    let middle = 0.5 * (x0 + x1);
    let half = (0.5 * (x1 - x0) + margin).max(0.30 * (z1 - z0));
    Window { low: (middle - half, z0 - margin), high: (middle + half, z1 + margin) }
}

fn outlines(grain: &Grain) -> Vec<Outline> {
    let (points, triangles) = grain.shape.surface_mesh();
    let triangles = triangles.iter().map(|t| t.map(|i| i as usize)).collect();
    GrainSurface::new(points, triangles).outlines(grain.pose.position, grain.pose.orientation, 0, 2)
}
