//! Outlines of the grains in the plane of a slice.

use grainwake_plot::style::{INK, series_colour};

use super::grain_surface::{self, Outline};
use super::scene::Scene;
use super::section::{Section, SliceView};
use super::slice_grid::Column;

/// Returns the outlines of the grains in each section of a column, in the colours of the grains.
pub fn of_column(scene: &Scene, column: &Column) -> Vec<Vec<(&'static str, Outline)>> {
    let coloured = |(grain, ring): (Option<usize>, Outline)| {
        let colour = |grain| series_colour(scene.features.grain_rank(grain));
        (grain.map_or(INK, colour), ring)
    };
    let of_section = |section: &Option<Section>| {
        let rings = section.iter().flat_map(|section| rings(scene, column, section));
        rings.map(coloured).collect()
    };
    column.sections.iter().map(of_section).collect()
}

/// Returns the intersections of the grains with the plane of a slice: exact for known surfaces and
/// spheres, else the contour of solid fraction 0.5, in which grains in contact are joined.
fn rings(scene: &Scene, column: &Column, section: &Section) -> Vec<(Option<usize>, Outline)> {
    let exact = |(grain, _): &(usize, (f64, f64))| -> Option<Vec<(Option<usize>, Outline)>> {
        let (position, rotation) = scene.run.grains[*grain].pose(column.at)?;
        let mut position = scene.run.wrapped(position);
        // The plane intersects the nearest periodic image.
        let normal = section.view.normal;
        if let Some(period) = scene.run.period(normal) {
            position[normal] += period * ((section.place - position[normal]) / period).round();
        }
        let loops = match scene.surfaces.get(grain) {
            Some(body) => body.section(position, rotation, section.view, section.place),
            None => {
                let radius = 0.5 * scene.sphere_diameter(*grain)?;
                let square = radius * radius - (position[normal] - section.place).powi(2);
                let centre = section.view.seen(position);
                let ring = (square > 0.0).then(|| grain_surface::circle(centre, square.sqrt()));
                ring.into_iter().collect()
            }
        };
        Some(loops.into_iter().map(|ring| (Some(*grain), ring)).collect())
    };
    if let Some(loops) = column.centres.iter().map(exact).collect::<Option<Vec<_>>>() {
        return with_images(scene, section.view, &loops.concat());
    }
    let nearest = |ring: Outline| {
        let n = ring.len() as f64;
        let sum = |a: (f64, f64), p: &(f64, f64)| (a.0 + p.0 / n, a.1 + p.1 / n);
        let middle = ring.iter().fold((0.0, 0.0), sum);
        let distance = |p: (f64, f64)| (p.0 - middle.0).hypot(p.1 - middle.1);
        let centres = column.centres.iter();
        let nearest = centres.min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
        (nearest.map(|(grain, _)| *grain), ring)
    };
    section.outlines().into_iter().map(nearest).collect()
}

/// Returns the outlines with their images through periodic faces.
fn with_images(
    scene: &Scene,
    view: SliceView,
    loops: &[(Option<usize>, Outline)],
) -> Vec<(Option<usize>, Outline)> {
    let mut out = Vec::new();
    for (dx, dz) in scene.image_shifts(view.across, view.up) {
        let moved = |ring: &Outline| ring.iter().map(|p| (p.0 + dx, p.1 + dz)).collect();
        out.extend(loops.iter().map(|(grain, ring)| (*grain, moved(ring))));
    }
    out
}
