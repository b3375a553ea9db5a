//! Grains as they look from one side: the true outline where the surface is known, else a circle.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};

use super::section::View;
use grainwake_formats::vtp::Surface;

use crate::run_folder::{History, RunFolder};
use grainwake_plot::contour;

/// A closed line in two of the three coordinates [m].
pub type Outline = Vec<(f64, f64)>;

/// Samples across an outline.
const SAMPLES: usize = 72;

/// The surface of a grain in its own frame.
#[derive(Clone, Debug)]
pub struct Body {
    points: Vec<DVec3>,
    triangles: Vec<[usize; 3]>,
}

/// The principal axes that a reader can see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// Longest extent, body frame.
    pub long: DVec3,
    /// Shortest extent (normal of the broad side), body frame.
    pub short: DVec3,
}

impl Body {
    /// A body from its closed surface, positions in its own frame [m].
    pub fn new(points: Vec<DVec3>, triangles: Vec<[usize; 3]>) -> Body {
        Body { points, triangles }
    }

    /// Outline of the body at a pose, seen along the axis that is neither `across` nor `up`.
    pub fn outline(&self, position: DVec3, turn: DQuat, across: usize, up: usize) -> Outline {
        let place = |p: &DVec3| {
            let x = position + turn * *p;
            (x[across], x[up])
        };
        largest_outline(
            &self.points.iter().map(place).collect::<Vec<_>>(),
            &self.triangles,
        )
    }

    /// Loops in which a plane across the view's normal at `place` cuts the body at a pose.
    pub fn section(&self, position: DVec3, turn: DQuat, view: View, place: f64) -> Vec<Outline> {
        let points: Vec<DVec3> = self.points.iter().map(|p| position + turn * *p).collect();
        let above = |i: usize| points[i][view.normal] >= place;
        let cross = |a: usize, b: usize| {
            let (p, q) = (points[a], points[b]);
            let (from, to) = (p[view.normal], q[view.normal]);
            view.seen(p.lerp(q, (place - from) / (to - from)))
        };
        // Each cut triangle joins two of its edges; both are shared with the next cut triangle.
        let mut next: BTreeMap<(usize, usize), (usize, usize)> = BTreeMap::new();
        for triangle in &self.triangles {
            let [a, b, c] = *triangle;
            let edges = [(a, b), (b, c), (c, a)];
            let into = edges.iter().find(|(i, j)| !above(*i) && above(*j));
            let out = edges.iter().find(|(i, j)| above(*i) && !above(*j));
            if let (Some(into), Some(out)) = (into, out) {
                let name = |edge: &(usize, usize)| (edge.0.min(edge.1), edge.0.max(edge.1));
                next.insert(name(into), name(out));
            }
        }
        let mut loops = Vec::new();
        while let Some((&start, _)) = next.first_key_value() {
            let mut ring = Outline::new();
            let mut edge = start;
            while let Some(following) = next.remove(&edge) {
                ring.push(cross(edge.0, edge.1));
                edge = following;
            }
            if ring.len() > 2 {
                loops.push(ring);
            }
        }
        loops
    }

    /// Diameter of the sphere of equal volume [m].
    pub fn diameter(&self) -> Option<f64> {
        let volume = self
            .corners()
            .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
            .sum::<f64>()
            .abs();
        Some((6.0 * volume / std::f64::consts::PI).cbrt()).filter(|d| d.is_finite() && *d > 0.0)
    }

    fn corners(&self) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        self.triangles.iter().map(|t| t.map(|i| self.points[i]))
    }

    /// Long and short axis from the second moments of the volume about the body axes; none for a
    /// body whose moments hardly differ (a sphere, a cube).
    pub fn axes(&self) -> Option<Axes> {
        let mut moments = DVec3::ZERO;
        for [a, b, c] in self.corners() {
            let six_volumes = a.dot(b.cross(c));
            moments += six_volumes * (a * a + b * b + c * c + a * b + b * c + c * a) / 60.0;
        }
        let moments = moments.abs().to_array();
        let by_size = |i: &usize, j: &usize| moments[*i].total_cmp(&moments[*j]);
        let (long, short) = ((0..3).max_by(by_size)?, (0..3).min_by(by_size)?);
        let clear = moments[long] > 1.04 * moments[short];
        clear.then_some(Axes {
            long: DVec3::AXES[long],
            short: DVec3::AXES[short],
        })
    }
}

/// Surfaces of the grains in their own frames, from the first surface file of each; what cannot be
/// used is added to `notes`.
pub fn bodies(run: &RunFolder, notes: &mut Vec<String>) -> BTreeMap<usize, Body> {
    let mut out = BTreeMap::new();
    for frame in &run.surfaces {
        let wanted = match frame.grain {
            Some(grain) => !out.contains_key(&grain),
            None => out.is_empty() || out.len() < run.grains.len(),
        };
        if !wanted || (frame.grain.is_none() && !out.is_empty()) {
            continue;
        }
        match run.surface(frame) {
            Ok(surface) => collect(&surface, frame.grain, frame.time, &run.grains, &mut out),
            Err(what) => notes.push(format!(
                "{} was left out: {what}",
                run.short_name(&frame.file)
            )),
        }
    }
    out
}

fn collect(
    surface: &Surface,
    file_grain: Option<usize>,
    time: f64,
    histories: &[History],
    out: &mut BTreeMap<usize, Body>,
) {
    let mut parts: BTreeMap<usize, Vec<[usize; 3]>> = BTreeMap::new();
    for (i, triangle) in surface.triangles.iter().enumerate() {
        let listed = surface
            .grains
            .as_ref()
            .and_then(|grains| grains.get(i).copied());
        let grain = listed
            .or(file_grain)
            .or((histories.len() == 1).then_some(0));
        if let Some(grain) = grain {
            parts.entry(grain).or_default().push(*triangle);
        }
    }
    for (grain, triangles) in parts {
        let Some(history) = histories.get(grain) else {
            continue;
        };
        let Some((position, turn)) = history.pose(time) else {
            continue;
        };
        let back = turn.conjugate();
        let mut renumbered: BTreeMap<usize, usize> = BTreeMap::new();
        let mut points = Vec::new();
        let mut number = |i: usize| {
            *renumbered.entry(i).or_insert_with(|| {
                points.push(back * (surface.points[i] - position));
                points.len() - 1
            })
        };
        let triangles = triangles.into_iter().map(|t| t.map(&mut number)).collect();
        out.entry(grain).or_insert(Body { points, triangles });
    }
}

/// A circle as an outline.
pub fn circle(centre: (f64, f64), radius: f64) -> Outline {
    (0..48)
        .map(|i| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / 48.0).sin_cos();
            (centre.0 + radius * cos, centre.1 + radius * sin)
        })
        .collect()
}

/// Outline of the union of projected triangles: painted on a grid, smoothed, and traced.
fn largest_outline(points: &[(f64, f64)], triangles: &[[usize; 3]]) -> Outline {
    let range =
        |pick: fn(&(f64, f64)) -> f64| grainwake_plot::axis::extent(points.iter().map(pick));
    let (Some((x0, x1)), Some((y0, y1))) = (range(|p| p.0), range(|p| p.1)) else {
        return Outline::new();
    };
    let step = (x1 - x0).max(y1 - y0) / (SAMPLES as f64 - 10.0);
    if !(step > 0.0 && step.is_finite()) {
        return Outline::new();
    }
    let (x0, y0) = (x0 - 4.5 * step, y0 - 4.5 * step);
    let local: Vec<(f64, f64)> = points
        .iter()
        .map(|(x, y)| ((x - x0) / step, (y - y0) / step))
        .collect();
    let mut mask = vec![0.0; SAMPLES * SAMPLES];
    for triangle in triangles {
        paint(&mut mask, triangle.map(|i| local[i]));
    }
    let smooth = blur(&blur(&mask));
    let loops = contour::closed_contours(SAMPLES, SAMPLES, |i, j| smooth[i + SAMPLES * j], 0.5);
    let longest = loops.into_iter().max_by_key(Vec::len).unwrap_or_default();
    longest
        .into_iter()
        .map(|(i, j)| (x0 + i * step, y0 + j * step))
        .collect()
}

fn paint(mask: &mut [f64], [a, b, c]: [(f64, f64); 3]) {
    let side = |p: (f64, f64), q: (f64, f64), x: f64, y: f64| {
        (q.0 - p.0) * (y - p.1) - (q.1 - p.1) * (x - p.0)
    };
    let low = |p: f64, q: f64, r: f64| p.min(q).min(r).floor().max(0.0) as usize;
    let high = |p: f64, q: f64, r: f64| (p.max(q).max(r).ceil().max(0.0) as usize).min(SAMPLES - 1);
    for j in low(a.1, b.1, c.1)..=high(a.1, b.1, c.1) {
        for i in low(a.0, b.0, c.0)..=high(a.0, b.0, c.0) {
            let (x, y) = (i as f64, j as f64);
            let sides = [side(a, b, x, y), side(b, c, x, y), side(c, a, x, y)];
            if sides.iter().all(|s| *s >= -1e-9) || sides.iter().all(|s| *s <= 1e-9) {
                mask[i + SAMPLES * j] = 1.0;
            }
        }
    }
}

fn blur(mask: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; mask.len()];
    for j in 1..SAMPLES - 1 {
        for i in 1..SAMPLES - 1 {
            let at = i + SAMPLES * j;
            let rows = [at - SAMPLES, at, at + SAMPLES];
            out[at] = rows
                .iter()
                .map(|k| mask[k - 1] + mask[*k] + mask[k + 1])
                .sum::<f64>()
                / 9.0;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box with half edges a, b, c.
    fn block(a: f64, b: f64, c: f64) -> Body {
        let corner = |i: usize| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            DVec3::new(a * sign(0), b * sign(1), c * sign(2))
        };
        let quads = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        let triangles = quads
            .iter()
            .flat_map(|[p, q, r, s]| [[*p, *q, *r], [*p, *r, *s]])
            .collect();
        Body {
            points: (0..8).map(corner).collect(),
            triangles,
        }
    }

    fn area(ring: &[(f64, f64)]) -> f64 {
        0.5 * ring
            .iter()
            .zip(ring.iter().cycle().skip(1))
            .map(|(a, b)| a.0 * b.1 - b.0 * a.1)
            .sum::<f64>()
            .abs()
    }

    #[test]
    fn outlines_have_the_size_of_the_body() {
        let body = block(2e-3, 1e-3, 0.5e-3);
        let at = DVec3::new(0.1, 0.2, 0.3);
        let side = body.outline(at, DQuat::IDENTITY, 0, 2);
        assert!((area(&side) / 4e-6 - 1.0).abs() < 0.03, "{}", area(&side));
        let turned = body.outline(
            at,
            DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2),
            0,
            2,
        );
        assert!(
            (area(&turned) / 2e-6 - 1.0).abs() < 0.03,
            "{}",
            area(&turned)
        );
        let centre = side.iter().map(|p| p.0).sum::<f64>() / side.len() as f64;
        assert!((centre - 0.1).abs() < 1e-4);
    }

    #[test]
    fn sections_are_loops_of_the_body() {
        let body = block(2e-3, 1e-3, 0.5e-3);
        let at = DVec3::new(0.1, 0.2, 0.3);
        let view = View::along(1, 2);
        let cut = body.section(at, DQuat::IDENTITY, view, 0.2004);
        assert_eq!(cut.len(), 1);
        assert!((area(&cut[0]) - 4e-6).abs() < 1e-12, "{}", area(&cut[0]));
        assert!(body.section(at, DQuat::IDENTITY, view, 0.2011).is_empty());
    }

    #[test]
    fn axes_follow_the_extents() {
        let axes = block(1.0, 3.0, 2.0).axes().unwrap();
        assert_eq!((axes.long, axes.short), (DVec3::Y, DVec3::X));
        assert!(block(1.0, 1.0, 1.0).axes().is_none());
        let diameter = block(1.0, 3.0, 2.0).diameter().unwrap();
        assert!((diameter - (6.0 * 48.0 / std::f64::consts::PI).cbrt()).abs() < 1e-12);
    }

    #[test]
    fn flat_or_empty_bodies_have_no_outline() {
        let body = Body {
            points: vec![DVec3::ZERO; 3],
            triangles: vec![[0, 1, 2]],
        };
        assert!(body.outline(DVec3::ZERO, DQuat::IDENTITY, 0, 2).is_empty());
        assert_eq!(circle((1.0, 2.0), 0.5).len(), 48);
    }
}
