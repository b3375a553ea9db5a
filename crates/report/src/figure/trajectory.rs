//! Paths of the grains from two sides, with the grains at the key instants.

use glam::DVec3;
use grainwake_plot::axis::extent;
use grainwake_plot::drawing::{Anchor, Drawing};
use grainwake_plot::equal_aspect::{EqualAspectFrame, Window, length_unit, outline_style};
use grainwake_plot::style::{self, COLUMN, SMALL, series_colour};
use grainwake_plot::{Figure, letter};

use super::scene::{AXES, Scene};
use crate::features::{LEAST, length};
use crate::phases::Instant;
use crate::run_folder::History;

/// Left margin [pt].
const LEFT: f64 = 36.0;
/// Distance between the views [pt].
const MIDDLE: f64 = 14.0;
/// Right margin [pt].
const RIGHT: f64 = 18.0;
/// Largest number of grains that are drawn at all key instants.
const OUTLINED: usize = 4;

/// Draws the paths along both horizontal axes.
pub fn figure(scene: &Scene) -> Option<Figure> {
    let grains = scene.moving();
    let (up, sides) = (scene.vertical(), scene.horizontal());
    let windows = sides.map(|side| window(scene, &grains, side, up));
    let shown = shown_instants(scene, &grains);
    let [Some(first), Some(second)] = windows else {
        return None;
    };
    let room = COLUMN - LEFT - MIDDLE - RIGHT;
    let scale = (room / (first.width() + second.width())).min(330.0 / first.height());
    // A damaged case may hold absurd sizes, of which there is no picture.
    let sizes = [first, second].map(|window| [window.width(), window.height()]);
    if !sizes.as_flattened().iter().all(|size| (scale * size).is_finite() && *size > 0.0) {
        return None;
    }
    // The names of a pair are long: one per row; other names are in four columns.
    let columns = if grains.len() > 2 { 4 } else { 1 };
    let top = 8.0 + 10.0 * grains.len().div_ceil(columns) as f64;
    let free = room - scale * (first.width() + second.width());
    let left = LEFT + 0.5 * free;
    let second_left = left + MIDDLE + scale * first.width();
    let frames = [(first, left), (second, second_left)].map(|(window, x)| EqualAspectFrame {
        window,
        corner: (x, top),
        scale,
        flipped: scene.flipped(),
    });
    let mut drawing = Drawing::new(COLUMN, top + frames[0].height() + 26.0);
    for (i, grain) in grains.iter().enumerate() {
        let column = (i % columns) as f64 * (COLUMN - LEFT) / columns as f64;
        let x = column + if columns == 1 { left } else { LEFT };
        let y = 8.0 + 10.0 * (i / columns) as f64;
        let colour = series_colour(scene.features.grain_rank(*grain));
        drawing.line(&[(x, y), (x + 14.0, y)], colour, style::LINE, dash(i));
        drawing.note((x + 17.0, y), Anchor::Start, &scene.features.grain_name(*grain));
    }
    let (unit, _) = length_unit(first.width().max(first.height()));
    for (i, (frame, side)) in frames.iter().zip(sides).enumerate() {
        frame.clip(&mut drawing, &format!("clip-{i}"));
        for (n, grain) in grains.iter().enumerate() {
            draw_path(scene, (*grain, shown), dash(n), frame, (side, up), &mut drawing);
        }
        drawing.end_clip();
        let [across, height] = [side, up].map(|axis| format!("*{}*  [{unit}]", AXES[axis]));
        let height = (i == 0).then_some(height.as_str());
        frame.frame(&mut drawing, (Some(&across), height));
    }
    let marked = longest(scene, &grains, up)?;
    // A single instant needs no letter.
    if shown.len() > 1 {
        label_instants(scene, marked, &frames[1], up, &mut drawing);
    }
    let name = |(i, instant): (usize, &Instant)| {
        let name = match instant.name {
            "" => String::new(),
            name => format!("{name}, "),
        };
        let time = scene.features.time_text(instant.time);
        if shown.len() > 1 { format!("{} {name}{time}", letter(i)) } else { time }
    };
    let named: Vec<String> = shown.iter().enumerate().map(name).collect();
    let mut caption = format!(
        "Paths of the centres seen along {} and {}, at equal scale, with the grains as {}",
        AXES[sides[1]],
        AXES[sides[0]],
        scene.drawn_as(&grains)
    );
    caption += &match named.is_empty() {
        true => ".".to_owned(),
        false => format!(" at the start (pale) and at {}.", named.join("; ")),
    };
    if grains.len() > 1 && named.len() > 1 {
        caption += &format!(" The letters are at the height of grain {marked}.");
    }
    caption += &scene.downwards();
    caption += &scene.left_out(&grains);
    if let Some(drift) = largest_drift(scene, &grains, up) {
        caption += &match scene.run.facts.diameter() {
            Some(d) if drift < LEAST * d => format!(" Sideways drift below {LEAST} *d*."),
            _ => format!(" Largest sideways drift: {}.", length(drift)),
        };
    }
    let title = match grains.len() {
        1 => "Path of the grain",
        _ => "Paths of the grains",
    };
    Some(Figure::new("trajectories", title, caption, drawing))
}

/// Returns the dash pattern that distinguishes grains of one colour.
fn dash(n: usize) -> Option<&'static str> {
    (n >= style::SERIES_COLOURS).then_some("3.5 1.6")
}

/// Returns the box, or the heights of the paths with a margin if they cover less than 60 % of it.
fn window(scene: &Scene, grains: &[usize], side: usize, up: usize) -> Option<Window> {
    let range = |axis: usize| {
        let positions = grains.iter().flat_map(|g| &scene.run.grains[*g].position);
        extent(positions.map(|p| scene.run.wrapped(*p)[axis]))
    };
    let ((x0, x1), (z0, z1)) = (range(side)?, range(up)?);
    let default = 0.1 * (z1 - z0).max(x1 - x0);
    let margin = 2.0 * scene.run.facts.diameter().unwrap_or(default).max(1e-9);
    let tight = Window { low: (x0 - margin, z0 - margin), high: (x1 + margin, z1 + margin) };
    let Some(size) = scene.run.facts.size else {
        return Some(tight);
    };
    let lower = scene.run.facts.lower;
    let mut whole = Window {
        low: (lower[side], lower[up]),
        high: (lower[side] + size[side], lower[up] + size[up]),
    };
    if tight.height() < 0.6 * size[up] {
        let part = tight.intersection(whole);
        (whole.low.1, whole.high.1) = (part.low.1, part.high.1);
    }
    whole.high.1 = whole.high.1.max(whole.low.1 + margin);
    Some(whole)
}

/// Draws the path of a grain, and the grain at the start and at the key instants.
fn draw_path(
    scene: &Scene,
    (grain, shown): (usize, &[Instant]),
    dash: Option<&str>,
    frame: &EqualAspectFrame,
    (side, up): (usize, usize),
    drawing: &mut Drawing,
) {
    let history = &scene.run.grains[grain];
    let colour = series_colour(scene.features.grain_rank(grain));
    let rows = shown.iter().filter_map(|instant| history.nearest(instant.time));
    for (row, strength) in [(0, 0.35)].into_iter().chain(rows.map(|row| (row, 1.0))) {
        let outlines = frame.paths(&scene.outlines(grain, row, side, up));
        drawing.path(&outlines, &outline_style(colour, strength));
    }
    // The path is interrupted where it crosses a periodic face.
    let jump = |axis: usize, a: f64, b: f64| {
        let period = scene.run.period(axis);
        period.is_some_and(|period| (a - b).abs() > 0.5 * period)
    };
    let crosses = |a: &(f64, f64), b: &(f64, f64)| jump(side, a.0, b.0) || jump(up, a.1, b.1);
    let every = (history.len() / 1500).max(1);
    let kept = (0..history.len()).filter(|i| i % every == 0 || i + 1 == history.len());
    let points = kept.map(|i| scene.run.wrapped(history.position[i])).map(|p| (p[side], p[up]));
    let points: Vec<(f64, f64)> = points.collect();
    for part in points.chunk_by(|a, b| !crosses(a, b)) {
        let placed: Vec<(f64, f64)> = part.iter().map(|p| frame.at(*p)).collect();
        drawing.line(&placed, colour, 0.9, dash);
    }
}

/// Returns the instants at which grains are drawn: all of a few grains, the last one of more, whose
/// outlines would hide each other.
fn shown_instants<'a>(scene: &'a Scene, grains: &[usize]) -> &'a [Instant] {
    let first = if grains.len() > OUTLINED { scene.instants.len().saturating_sub(1) } else { 0 };
    &scene.instants[first..]
}

/// Returns the grain whose heights place the letters: one with the longest history, which is in the
/// box at all key instants. Of more than two, one that moves along the vertical axis if there is
/// any; a grain on a prescribed path may keep its height.
fn longest(scene: &Scene, grains: &[usize], up: usize) -> Option<usize> {
    let least = 0.1 * scene.run.facts.diameter().unwrap_or(0.0);
    let moves = |history: &History| {
        let ends = extent(history.position.iter().map(|position| position[up]));
        grains.len() > 2 && ends.is_some_and(|(low, high)| high - low > least)
    };
    let rank = |grain: &usize| {
        let history = &scene.run.grains[*grain];
        (history.len(), moves(history))
    };
    // The first one of equals.
    grains.iter().copied().rev().max_by_key(rank)
}

/// Draws the letters of the instants to the right of the frame, at the heights of a grain, without
/// overlap.
fn label_instants(
    scene: &Scene,
    grain: usize,
    frame: &EqualAspectFrame,
    up: usize,
    drawing: &mut Drawing,
) {
    let history = &scene.run.grains[grain];
    let ((left, top), bottom) = (frame.corner, frame.corner.1 + frame.height());
    let place = |(i, instant): (usize, &Instant)| {
        let position = scene.run.wrapped(history.position[history.nearest(instant.time)?]);
        // Equal heights but for round-off keep the order of the instants.
        let y = (2.0 * frame.at((0.0, position[up])).1).round() / 2.0;
        Some((y.clamp(top, bottom), letter(i)))
    };
    let mut places: Vec<(f64, String)> =
        scene.instants.iter().enumerate().filter_map(place).collect();
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut texts: Vec<f64> = places.iter().map(|(y, _)| *y).collect();
    spread(&mut texts, SMALL + 1.0, bottom);
    let x = left + frame.width();
    for ((y, name), text) in places.iter().zip(texts) {
        drawing.line(&[(x, *y), (x + 3.0, text)], style::FAINT, style::HAIR, None);
        drawing.note((x + 4.0, text), Anchor::Start, name);
    }
}

/// Moves ascending positions apart to at least `distance`: first forwards, then back below `limit`.
fn spread(positions: &mut [f64], distance: f64, mut limit: f64) {
    let mut least = f64::NEG_INFINITY;
    for position in &mut *positions {
        *position = position.max(least);
        least = *position + distance;
    }
    for position in positions.iter_mut().rev() {
        *position = position.min(limit);
        limit = *position - distance;
    }
}

/// Returns the largest horizontal distance from the start [m].
fn largest_drift(scene: &Scene, grains: &[usize], up: usize) -> Option<f64> {
    let drift = |grain: &usize| {
        let positions = &scene.run.grains[*grain].position;
        let start = *positions.first()?;
        let horizontal = DVec3::ONE - DVec3::AXES[up];
        let distances = positions.iter().map(|p| ((*p - start) * horizontal).length());
        Some(distances.fold(0.0, f64::max))
    };
    grains.iter().filter_map(drift).reduce(f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn close_letters_are_spread_within_the_frame() {
        let mut positions = [1.0, 2.0, 19.0, 20.0];
        spread(&mut positions, 5.0, 20.0);
        assert_eq!(positions, [1.0, 6.0, 15.0, 20.0]);
    }
}
