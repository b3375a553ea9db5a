//! How grains lie and turn against time.

use glam::DVec3;

use super::curves::panel;
use super::silhouette::Axes;
use super::{Figure, Scene};
use crate::run_folder::History;
use crate::story::short;
use grainwake_plot::axis::Axis;
use grainwake_plot::stacked::{Series, stacked_panels};

/// A grain that turns by less than this in all does not turn but for round-off [rad].
const TURNED: f64 = 1e-4;

/// The angle that a grain turns by, there and back counted twice [rad].
fn way_turned(history: &History) -> f64 {
    let speed = |row: usize| history.angular_velocity[row].length();
    (1..history.len())
        .map(|row| {
            0.5 * (speed(row) + speed(row - 1)) * (history.time[row] - history.time[row - 1])
        })
        .filter(|angle| angle.is_finite())
        .sum()
}

/// Angles of the long and short axis with gravity, and the angular speed where anything turns.
pub fn figure(scene: &Scene, notes: &mut Vec<String>) -> Option<Figure> {
    let moving = scene.moving();
    let up = scene.story.up;
    let unit = scene.story.scales.map_or(1.0, |s| 1.0 / s.time());
    let spin: Vec<Series> = moving
        .iter()
        .map(|g| scene.curve(*g, |h, row| h.angular_velocity[row].length() / unit))
        .collect();
    let fastest = spin
        .iter()
        .flat_map(|s| s.points.iter().map(|p| p.1))
        .fold(0.0, f64::max);
    let angle = |row_axis: DVec3| row_axis.dot(up).abs().min(1.0).acos().to_degrees();
    let axes: Vec<_> = moving
        .iter()
        .filter_map(|g| Some((*g, scene.bodies.get(g)?.axes()?)))
        .collect();
    let mut panels = Vec::new();
    let mut caption = String::new();
    if axes.is_empty() {
        let round = moving.iter().all(|g| {
            scene
                .run
                .facts
                .grains
                .get(*g)
                .is_some_and(|f| f.shape.as_deref() == Some("sphere"))
        });
        if !round && scene.bodies.is_empty() {
            notes.push(
                "the axes of the grains are not drawn: there is no surface of them in grains/"
                    .to_owned(),
            );
        }
    } else {
        let curves = |pick: fn(&Axes) -> DVec3| -> Vec<Series> {
            axes.iter()
                .map(|(g, axes)| scene.curve(*g, |h, row| angle(h.orientation[row] * pick(axes))))
                .collect()
        };
        let mut long = panel("long axis  [°]", curves(|a| a.long), &[0.0, 90.0], 70.0);
        let mut short_axis = panel("short axis  [°]", curves(|a| a.short), &[0.0, 90.0], 70.0);
        for panel in [&mut long, &mut short_axis] {
            panel.y = Axis::degrees(&panel.y.label, 0.0, 90.0);
        }
        panels.extend([long, short_axis]);
        caption.push_str("(a) Angle of the longest axis with the vertical and (b) of the shortest axis, the normal of the broad side: 0° in (b) is a grain that falls broad side first.");
    }
    let turns = moving
        .iter()
        .any(|g| way_turned(&scene.run.grains[*g]) > TURNED);
    let label = if scene.story.scales.is_some() {
        "|*ω*| √(*d*/*g*)  [–]"
    } else {
        "|*ω*|  [rad/s]"
    };
    if turns {
        caption.push_str(if panels.is_empty() { "" } else { " (c) " });
        caption.push_str(&format!(
            "Angular speed, up to {}{}.",
            short(fastest),
            if scene.story.scales.is_some() {
                " √(g/d)"
            } else {
                " rad/s"
            }
        ));
        panels.push(panel(label, spin, &[0.0], 65.0));
    }
    if panels.is_empty() {
        return None;
    }
    Some(Figure {
        name: "orientation",
        title: match (axes.is_empty(), turns) {
            (true, _) => "Angular speed",
            (false, true) => "Orientation and angular speed",
            (false, false) => "Orientation",
        }
        .to_owned(),
        caption,
        drawing: stacked_panels(&scene.time(), &panels, &scene.marks()),
    })
}
