//! Orientation and angular speed of the grains against time.

use glam::DVec3;
use grainwake_plot::axis::Axis;
use grainwake_plot::stacked::{Panel, Series};
use grainwake_plot::{Figure, lettered};

use super::grain_surface::PrincipalAxes;
use super::scene::Scene;
use crate::features::short;
use crate::run_folder::History;

/// Smallest total rotation of a grain that is not round-off [rad].
const SMALLEST_ROTATION: f64 = 1e-4;

/// Choice of one axis of a grain.
type Pick = fn(&PrincipalAxes) -> Option<DVec3>;

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
    let axes: Vec<(usize, PrincipalAxes)> =
        moving.iter().filter_map(|g| Some((*g, scene.surfaces.get(g)?.axes()))).collect();
    let mut panels = Vec::new();
    let mut sentences = Vec::new();
    let (long_axis, short_axis): (Pick, Pick) = (|axes| axes.long, |axes| axes.short);
    let angles = [
        (
            "long axis  [°]",
            long_axis,
            "Angle of the longest axis with the vertical; 90° is a grain that lies flat.",
        ),
        (
            "short axis  [°]",
            short_axis,
            "Angle of the shortest axis, the normal of the broad side, with the vertical; 0° is a \
             grain that falls broad side first.",
        ),
    ];
    for (label, pick, sentence) in angles {
        let with_axis = axes.iter().filter_map(|(grain, axes)| Some((*grain, pick(axes)?)));
        let curve = |(grain, axis)| scene.curve(grain, |h, row| angle(h.orientation[row] * axis));
        let curves: Vec<Series> = with_axis.map(curve).collect();
        if !curves.is_empty() {
            panels.push(Panel::with_axis(Axis::degrees(label, 0.0, 90.0), curves, 70.0));
            sentences.push(sentence.to_owned());
        }
    }
    let angles = !panels.is_empty();
    if scene.surfaces.is_empty() && !moving.iter().all(|g| scene.run.facts.is_sphere(*g)) {
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
        sentences.push(format!("Angular speed, up to {fastest}{unit}."));
        panels.push(Panel::linear(label, speeds, &[0.0], 65.0));
    }
    let title = match (angles, rotates) {
        (false, false) => return None,
        (false, true) => "Angular speed",
        (true, true) => "Orientation and angular speed",
        (true, false) => "Orientation",
    };
    Some(scene.with_events("orientation", title, lettered(&sentences), &panels))
}
