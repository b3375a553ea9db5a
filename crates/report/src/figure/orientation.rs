//! Orientation and angular speed of the grains against time.

use glam::DVec3;
use grainwake_plot::Figure;
use grainwake_plot::axis::Axis;
use grainwake_plot::stacked::{Panel, Series};

use super::grain_surface::PrincipalAxes;
use super::scene::Scene;
use crate::features::short;
use crate::run_folder::History;

/// Smallest total rotation of a grain that is not round-off [rad].
const SMALLEST_ROTATION: f64 = 1e-4;

/// Returns the integral of the angular speed over the history [rad].
fn total_rotation(history: &History) -> f64 {
    let speed = |row: usize| history.angular_velocity[row].length();
    let step = |row: usize| history.time[row] - history.time[row - 1];
    let angles = (1..history.len()).map(|row| 0.5 * (speed(row) + speed(row - 1)) * step(row));
    angles.filter(|angle| angle.is_finite()).sum()
}

/// Draws the angles of the long and the short axis with the vertical, and the angular speed if any
/// grain rotates.
pub fn figure(scene: &Scene, notes: &mut Vec<String>) -> Option<Figure> {
    let moving = scene.moving();
    let up = scene.features.up;
    let angle = |axis: DVec3| axis.dot(up).abs().min(1.0).acos().to_degrees();
    let known = moving.iter().filter_map(|g| Some((*g, scene.surfaces.get(g)?.axes()?)));
    let axes: Vec<(usize, PrincipalAxes)> = known.collect();
    let mut panels = Vec::new();
    let mut caption = String::new();
    if !axes.is_empty() {
        let panel = |label: &str, pick: fn(&PrincipalAxes) -> DVec3| {
            let curve = |(grain, axes): &(usize, PrincipalAxes)| {
                scene.curve(*grain, |h, row| angle(h.orientation[row] * pick(axes)))
            };
            let curves = axes.iter().map(curve).collect();
            Panel::with_axis(Axis::degrees(label, 0.0, 90.0), curves, 70.0)
        };
        panels.push(panel("long axis  [°]", |axes| axes.long));
        panels.push(panel("short axis  [°]", |axes| axes.short));
        caption += "(a) Angle of the longest axis with the vertical and (b) of the shortest axis, \
                    the normal of the broad side: 0° in (b) is a grain that falls broad side \
                    first.";
    } else if scene.surfaces.is_empty() && !moving.iter().all(|g| scene.run.facts.is_sphere(*g)) {
        let note = "the axes of the grains are not drawn: there are no surfaces in grains/";
        notes.push(note.to_owned());
    }
    let rotates = |grain: &usize| total_rotation(&scene.run.grains[*grain]) > SMALLEST_ROTATION;
    let rotates = moving.iter().any(rotates);
    if rotates {
        let (label, unit) = match scene.features.scales {
            Some(_) => ("|*ω*| √(*d*/*g*)  [–]", " √(g/d)"),
            None => ("|*ω*|  [rad/s]", " rad/s"),
        };
        let scale = scene.features.scales.map_or(1.0, |s| 1.0 / s.time());
        let speed = |grain| scene.curve(grain, |h, row| h.angular_velocity[row].length() / scale);
        let speeds: Vec<Series> = moving.iter().map(|grain| speed(*grain)).collect();
        let fastest = short(speeds.iter().flat_map(Series::values).fold(0.0, f64::max));
        caption += if panels.is_empty() { "" } else { " (c) " };
        caption += &format!("Angular speed, up to {fastest}{unit}.");
        panels.push(Panel::linear(label, speeds, &[0.0], 65.0));
    }
    let title = match (axes.is_empty(), rotates) {
        (true, false) => return None,
        (true, true) => "Angular speed",
        (false, true) => "Orientation and angular speed",
        (false, false) => "Orientation",
    };
    Some(scene.with_events("orientation", title, caption, &panels))
}
