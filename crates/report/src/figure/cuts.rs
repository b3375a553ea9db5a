//! Outlines of the grains in the plane of a slice.

use super::Scene;
use super::section::{Section, View};
use super::sheet::Column;
use super::silhouette::{self, Outline};
use grainwake_plot::style::{INK, series_colour};

/// Outlines of the grains in each of the column's sections, in the colours of the grains.
pub fn of_column(scene: &Scene, column: &Column) -> Vec<Vec<(&'static str, Outline)>> {
    let coloured = |(grain, ring): (Option<usize>, Outline)| {
        let colour = |grain| series_colour(scene.story.grain_rank(grain));
        (grain.map_or(INK, colour), ring)
    };
    let of_section = |section: &Option<Section>| match section {
        Some(section) => rings(scene, column, section)
            .into_iter()
            .map(coloured)
            .collect(),
        None => Vec::new(),
    };
    column.sections.iter().map(of_section).collect()
}

/// Where the plane of a slice cuts the grains: exactly where their surfaces are known, for spheres
/// too; else along half solid fraction, where touching grains run together.
fn rings(scene: &Scene, column: &Column, section: &Section) -> Vec<(Option<usize>, Outline)> {
    let exact = |(grain, _): &(usize, (f64, f64))| {
        let (position, turn) = scene.run.grains[*grain].pose(column.at)?;
        let mut position = scene.run.wrapped(position);
        // The image nearest to the plane is the one that it cuts.
        let normal = section.view.normal;
        if let Some(period) = scene.run.period(normal) {
            position[normal] += period * ((section.place - position[normal]) / period).round();
        }
        let loops = match scene.bodies.get(grain) {
            Some(body) => body.section(position, turn, section.view, section.place),
            None => {
                let radius = 0.5 * scene.sphere_diameter(*grain)?;
                let chord = radius * radius - (position[normal] - section.place).powi(2);
                let ring = || silhouette::circle(section.view.seen(position), chord.sqrt());
                (chord > 0.0).then(ring).into_iter().collect()
            }
        };
        Some(
            loops
                .into_iter()
                .map(|ring| (Some(*grain), ring))
                .collect::<Vec<_>>(),
        )
    };
    if let Some(loops) = column.centres.iter().map(exact).collect::<Option<Vec<_>>>() {
        return with_images(scene, section.view, loops.concat());
    }
    let nearest = |ring: Outline| {
        let n = ring.len() as f64;
        let middle = ring
            .iter()
            .fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / n, sum.1 + p.1 / n));
        let distance = |p: &(f64, f64)| (p.0 - middle.0).hypot(p.1 - middle.1);
        let by_distance = |a: &&(usize, (f64, f64)), b: &&(usize, (f64, f64))| {
            distance(&a.1).total_cmp(&distance(&b.1))
        };
        (
            column
                .centres
                .iter()
                .min_by(by_distance)
                .map(|(grain, _)| *grain),
            ring,
        )
    };
    section.outlines().into_iter().map(nearest).collect()
}

/// Adds the images through periodic faces.
fn with_images(
    scene: &Scene,
    view: View,
    loops: Vec<(Option<usize>, Outline)>,
) -> Vec<(Option<usize>, Outline)> {
    let shifts = |axis: usize| match scene.run.period(axis) {
        Some(period) => vec![0.0, -period, period],
        None => vec![0.0],
    };
    let mut out = Vec::new();
    for dx in shifts(view.across) {
        for dz in shifts(view.up) {
            let moved = |ring: &Outline| ring.iter().map(|p| (p.0 + dx, p.1 + dz)).collect();
            out.extend(loops.iter().map(|(grain, ring)| (*grain, moved(ring))));
        }
    }
    out
}
