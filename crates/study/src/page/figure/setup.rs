//! Fig. 7: the box with the pair at the start, to scale, and the pair enlarged.

use grainwake_report::figure::plan::{Plan, Window, grain_style, length_unit};
use grainwake_report::figure::silhouette::{Body, Outline};
use grainwake_report::figure::style::{BLUE, COLUMN, FAINT, HAIR, INK, SMALL, VERMILION};
use grainwake_report::figure::svg::{Anchor, Drawing};
use grainwake_report::figure::text;
use grainwake_solver::case::Case;
use grainwake_solver::dem::Grain;

use super::grains::arrow;
use super::{FigureData, StudyFigure, value_text};

/// The set-up of a model.
pub fn figure(data: &FigureData, notes: &mut Vec<String>) -> Option<StudyFigure> {
    let name = data.plan.analysis.figures.setup.as_ref()?;
    let Some(case) = data.run(name).and_then(|run| data.case(run)) else {
        notes.push(format!(
            "figure 7 is left out: the case of {name} cannot be read"
        ));
        return None;
    };
    draw(name, &case)
}

fn draw(name: &str, case: &Case) -> Option<StudyFigure> {
    let mesh = &case.setup.mesh;
    let (low, high) = (mesh.origin, mesh.upper());
    let [first, second] = case.setup.grains.as_slice() else {
        return None;
    };
    let (ahead, behind) = if first.pose.position.z <= second.pose.position.z {
        (first, second)
    } else {
        (second, first)
    };
    let outlines = [behind, ahead].map(outline);
    let whole = Window {
        low: (low.x, low.z),
        high: (high.x, high.z),
    };
    let scale = (0.40 * COLUMN / whole.width()).min(300.0 / whole.height());
    let plan = Plan {
        window: whole,
        corner: (34.0, 10.0),
        scale,
    };
    let reach = |pick: fn(&(f64, f64)) -> f64, start: f64, join: fn(f64, f64) -> f64| {
        outlines.iter().flatten().map(pick).fold(start, join)
    };
    let (x0, x1) = (
        reach(|p| p.0, f64::INFINITY, f64::min),
        reach(|p| p.0, f64::NEG_INFINITY, f64::max),
    );
    let (z0, z1) = (
        reach(|p| p.1, f64::INFINITY, f64::min),
        reach(|p| p.1, f64::NEG_INFINITY, f64::max),
    );
    let margin = 0.12 * (z1 - z0);
    let middle = 0.5 * (x0 + x1);
    let half = (0.5 * (x1 - x0) + margin).max(0.30 * (z1 - z0));
    let near = Window {
        low: (middle - half, z0 - margin),
        high: (middle + half, z1 + margin),
    };
    let right = plan.corner.0 + plan.width() + 30.0;
    let zoom = ((COLUMN - right - 46.0) / near.width()).min(plan.height() / near.height());
    let close = Plan {
        window: near,
        corner: (right, 10.0),
        scale: zoom,
    };
    let mut drawing = Drawing::new(COLUMN, 10.0 + plan.height() + 26.0);
    let corner = plan.at((near.low.0, near.high.1));
    let (w, h) = (near.width() * scale, near.height() * scale);
    drawing.rectangle(
        corner.0,
        corner.1,
        w,
        h,
        &format!("fill=\"none\" stroke=\"{FAINT}\" stroke-width=\"{HAIR}\""),
    );
    for (from, to) in [
        ((corner.0 + w, corner.1), (right, 10.0)),
        ((corner.0 + w, corner.1 + h), (right, 10.0 + close.height())),
    ] {
        drawing.line(&[from, to], FAINT, HAIR, Some("2 2"));
    }
    for p in [&plan, &close] {
        for (outline, colour) in outlines.iter().zip([BLUE, VERMILION]) {
            drawing.path(&p.path(outline, true), &grain_style(colour, 1.0));
        }
    }
    let (unit, _) = length_unit(whole.height());
    plan.frame(
        &mut drawing,
        (
            Some(&format!("*x*  [{unit}]")),
            Some(&format!("*z*  [{unit}]")),
        ),
    );
    drawing.rectangle(
        close.corner.0,
        close.corner.1,
        close.width(),
        close.height(),
        &format!("fill=\"none\" stroke=\"{FAINT}\" stroke-width=\"{HAIR}\""),
    );
    // The gap between the lowest point of the upper grain and the highest of the lower one.
    let bottom = outlines[0]
        .iter()
        .map(|p| p.1)
        .fold(f64::INFINITY, f64::min);
    let top = outlines[1]
        .iter()
        .map(|p| p.1)
        .fold(f64::NEG_INFINITY, f64::max);
    let (from, to) = (close.at((middle, top)), close.at((middle, bottom)));
    let centre = (from.0, 0.5 * (from.1 + to.1));
    arrow(&mut drawing, centre, from);
    arrow(&mut drawing, centre, to);
    let side = close.corner.0 + close.width() + 4.0;
    let gap = format!("{} mm", value_text(1e3 * (bottom - top)));
    drawing.label(
        side,
        centre.1 + 0.36 * SMALL,
        Anchor::Start,
        SMALL,
        INK,
        &gap,
        false,
    );
    for (grain, word, colour) in [(behind, "trailing", BLUE), (ahead, "leading", VERMILION)] {
        let y = close.at((0.0, grain.pose.position.z)).1;
        drawing.label(
            side,
            y + 0.36 * SMALL,
            Anchor::Start,
            SMALL,
            colour,
            word,
            false,
        );
    }
    let foot = close.corner.1 + close.height() + 24.0;
    arrow(
        &mut drawing,
        (close.corner.0 + 6.0, foot - 12.0),
        (close.corner.0 + 6.0, foot + 8.0),
    );
    drawing.label(
        close.corner.0 + 12.0,
        foot,
        Anchor::Start,
        SMALL,
        INK,
        "*g*",
        false,
    );
    let size = high - low;
    let d = ahead.shape.equivalent_diameter();
    let caption = format!(
        "The pair {} at the start, seen along y: the whole box of {} × {} × {} mm ({} × {} × {} cells), and the pair enlarged. The gap of {:.2} mm between the surfaces is {:.2} equal-volume diameters.",
        text::literal(name),
        value_text(1e3 * size.x),
        value_text(1e3 * size.y),
        value_text(1e3 * size.z),
        mesh.cells[0],
        mesh.cells[1],
        mesh.cells[2],
        1e3 * (bottom - top),
        (bottom - top) / d
    );
    Some(StudyFigure {
        name: "fig07-setup".into(),
        number: "7".into(),
        title: "The set-up".into(),
        caption,
        drawing,
    })
}

fn outline(grain: &Grain) -> Outline {
    let (points, triangles) = grain.shape.surface_mesh();
    let triangles = triangles.iter().map(|t| t.map(|i| i as usize)).collect();
    Body::new(points, triangles).outline(grain.pose.position, grain.pose.orientation, 0, 2)
}
