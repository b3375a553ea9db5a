//! Surfaces of the grains, with their projected outlines and plane sections.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};
use grainwake_formats::vtp::Surface;

use grainwake_plot::axis::extent;
use grainwake_plot::contour;

use super::section::SliceView;
use crate::run_folder::{History, RunFolder};

/// Closed polygon in two of the three coordinates [m].
pub type Outline = Vec<(f64, f64)>;

/// Known surfaces of the grains in the body frame, by index of the grain.
pub type Surfaces = BTreeMap<usize, GrainSurface>;

/// Edge of a surface: two points, the lower index first.
type Edge = (usize, usize);

/// Samples along the longer side of the mask from which an outline is traced: at least, at most.
const SAMPLES: (f64, f64) = (62.0, 400.0);
/// Samples across the thinnest part of a grain, if the most along the longer side allow it.
const SAMPLES_ACROSS: f64 = 24.0;
/// Parts of a sample of the mask along each axis, over which it is averaged.
const PARTS: usize = 3;
/// Empty samples around the mask.
const EMPTY: f64 = 4.5;

/// Closed triangulated surface of a grain, in the body frame.
#[derive(Clone, Debug)]
pub struct GrainSurface {
    points: Vec<DVec3>,
    triangles: Vec<[usize; 3]>,
}

/// Principal axes of a grain, in the body frame; `None` where two axes are equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipalAxes {
    /// Axis of the longest extent; a disc has none.
    pub long: Option<DVec3>,
    /// Axis of the shortest extent, normal of the broad side; a needle has none.
    pub short: Option<DVec3>,
}

impl GrainSurface {
    /// Creates a body from its closed surface; points in the body frame [m].
    pub fn new(points: Vec<DVec3>, triangles: Vec<[usize; 3]>) -> GrainSurface {
        GrainSurface { points, triangles }
    }

    /// Returns the points, in the body frame [m].
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// Returns the triangles as indices of points.
    pub fn triangles(&self) -> &[[usize; 3]] {
        &self.triangles
    }

    /// Returns the outlines of the body at a pose, projected to the axes `across` and `up`: the
    /// outer one, and those of its holes, which turn the other way.
    pub fn outlines(
        &self,
        position: DVec3,
        rotation: DQuat,
        across: usize,
        up: usize,
    ) -> Vec<Outline> {
        let project = |p: &DVec3| {
            let x = position + rotation * *p;
            (x[across], x[up])
        };
        let points: Vec<(f64, f64)> = self.points.iter().map(project).collect();
        let thin = (0..3).filter_map(|axis| extent(self.points.iter().map(|p| p[axis])));
        let thinnest = thin.map(|(low, high)| high - low).fold(f64::INFINITY, f64::min);
        outlines(&points, &self.triangles, thinnest)
    }

    /// Returns the intersection of the body at a pose with the plane at `place` along the normal of
    /// the view.
    pub fn section(
        &self,
        position: DVec3,
        rotation: DQuat,
        view: SliceView,
        place: f64,
    ) -> Vec<Outline> {
        let points = self.points.iter().map(|p| position + rotation * *p);
        let points: Vec<DVec3> = points.collect();
        let above = |i: usize| points[i][view.normal] >= place;
        let cross = |a: usize, b: usize| {
            let (p, q) = (points[a], points[b]);
            let (from, to) = (p[view.normal], q[view.normal]);
            view.seen(p.lerp(q, (place - from) / (to - from)))
        };
        // An intersected triangle connects two edges, which its neighbours share. Where a coarsened
        // surface touches itself, several pairs of triangles share an edge.
        let mut next: BTreeMap<Edge, Vec<Edge>> = BTreeMap::new();
        for triangle in &self.triangles {
            let [a, b, c] = *triangle;
            let edges = [(a, b), (b, c), (c, a)];
            let into = edges.iter().find(|(i, j)| !above(*i) && above(*j));
            let out = edges.iter().find(|(i, j)| above(*i) && !above(*j));
            if let (Some(into), Some(out)) = (into, out) {
                let name = |edge: &(usize, usize)| (edge.0.min(edge.1), edge.0.max(edge.1));
                next.entry(name(into)).or_default().push(name(out));
            }
        }
        let mut loops = Vec::new();
        while let Some((&start, _)) = next.first_key_value() {
            let mut ring = Outline::new();
            let mut edge = start;
            while let Some(following) = take(&mut next, edge) {
                ring.push(cross(edge.0, edge.1));
                edge = following;
                if edge == start {
                    break;
                }
            }
            if ring.len() > 2 {
                loops.push(ring);
            }
        }
        loops
    }

    /// Returns the diameter of the sphere of equal volume [m].
    pub fn diameter(&self) -> Option<f64> {
        let volumes = self.corners().map(|[a, b, c]| a.dot(b.cross(c)) / 6.0);
        let volume = volumes.sum::<f64>().abs();
        Some((6.0 * volume / std::f64::consts::PI).cbrt()).filter(|d| d.is_finite() && *d > 0.0)
    }

    fn corners(&self) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        self.triangles.iter().map(|t| t.map(|i| self.points[i]))
    }

    /// Returns the axes of the largest and the smallest second moment of the volume, each if it
    /// differs by more than 1.5 % from the middle one.
    pub fn axes(&self) -> PrincipalAxes {
        let mut moments = DVec3::ZERO;
        for [a, b, c] in self.corners() {
            let six_volumes = a.dot(b.cross(c));
            moments += six_volumes * (a * a + b * b + c * c + a * b + b * c + c * a) / 60.0;
        }
        let moments = moments.abs().to_array();
        let mut order = [0, 1, 2];
        order.sort_by(|i, j| moments[*i].total_cmp(&moments[*j]));
        let [short, middle, long] = order;
        let clear = |larger: usize, smaller: usize| moments[larger] > 1.015 * moments[smaller];
        PrincipalAxes {
            long: clear(long, middle).then_some(DVec3::AXES[long]),
            short: clear(middle, short).then_some(DVec3::AXES[short]),
        }
    }
}

/// Removes and returns an edge that follows `edge`.
fn take(next: &mut BTreeMap<Edge, Vec<Edge>>, edge: Edge) -> Option<Edge> {
    let following = next.get_mut(&edge)?;
    let taken = following.pop();
    if following.is_empty() {
        next.remove(&edge);
    }
    taken
}

/// Reads the surface of each grain from its first surface file; unusable files are added to
/// `notes`.
pub fn surfaces(run: &RunFolder, notes: &mut Vec<String>) -> Surfaces {
    let mut out = Surfaces::new();
    for frame in &run.surfaces {
        let known = match frame.grain {
            Some(grain) => out.contains_key(&grain),
            None => !out.is_empty(),
        };
        if known {
            continue;
        }
        match run.surface(frame) {
            Ok(surface) => add_surfaces(&surface, frame.grain, frame.time, &run.grains, &mut out),
            Err(what) => notes.push(run.left_out(frame, &what)),
        }
    }
    out
}

/// Splits a surface by grain and transforms each part to the body frame.
fn add_surfaces(
    surface: &Surface,
    grain_of_file: Option<usize>,
    time: f64,
    histories: &[History],
    out: &mut Surfaces,
) {
    let only = (histories.len() == 1).then_some(0);
    let mut parts: BTreeMap<usize, Vec<[usize; 3]>> = BTreeMap::new();
    for (i, triangle) in surface.triangles.iter().enumerate() {
        let listed = surface.grains.as_ref().and_then(|grains| grains.get(i).copied());
        if let Some(grain) = listed.or(grain_of_file).or(only) {
            parts.entry(grain).or_default().push(*triangle);
        }
    }
    for (grain, triangles) in parts {
        let Some((position, rotation)) = histories.get(grain).and_then(|h| h.pose(time)) else {
            continue;
        };
        let inverse = rotation.conjugate();
        let mut renumbered: BTreeMap<usize, usize> = BTreeMap::new();
        let mut points = Vec::new();
        let mut number = |i: usize| {
            *renumbered.entry(i).or_insert_with(|| {
                points.push(inverse * (surface.points[i] - position));
                points.len() - 1
            })
        };
        let triangles = triangles.into_iter().map(|t| t.map(&mut number)).collect();
        out.entry(grain).or_insert(GrainSurface { points, triangles });
    }
}

/// Returns a circle as a polygon of 48 points.
pub fn circle(centre: (f64, f64), radius: f64) -> Outline {
    (0..48)
        .map(|i| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / 48.0).sin_cos();
            (centre.0 + radius * cos, centre.1 + radius * sin)
        })
        .collect()
}

/// Returns the contours of the union of projected triangles, from a smoothed mask that resolves
/// parts of the thickness `thinnest`.
fn outlines(points: &[(f64, f64)], triangles: &[[usize; 3]], thinnest: f64) -> Vec<Outline> {
    let range = |pick: fn(&(f64, f64)) -> f64| extent(points.iter().map(pick));
    let (Some((x0, x1)), Some((y0, y1))) = (range(|p| p.0), range(|p| p.1)) else {
        return Vec::new();
    };
    let longer = (x1 - x0).max(y1 - y0);
    if !(longer > 0.0 && longer.is_finite()) {
        return Vec::new();
    }
    let step = (thinnest / SAMPLES_ACROSS).clamp(longer / SAMPLES.1, longer / SAMPLES.0);
    if step <= 0.0 {
        return Vec::new();
    }
    let (x0, y0) = (x0 - EMPTY * step, y0 - EMPTY * step);
    let samples = |low: f64, high: f64| ((high - low) / step + EMPTY).ceil() as usize + 1;
    let (nx, ny) = (samples(x0, x1), samples(y0, y1));
    let mut mask = Mask::new(PARTS * nx, PARTS * ny);
    let scale = PARTS as f64 / step;
    let local = points.iter().map(|(x, y)| (scale * (x - x0), scale * (y - y0)));
    let local: Vec<(f64, f64)> = local.collect();
    for triangle in triangles {
        mask.paint(triangle.map(|i| local[i]));
    }
    // The mean over the parts of a sample is the covered share, whose contour keeps edges straight.
    let covered = mask.blurred();
    let mut smooth = Mask::new(nx, ny);
    for (n, value) in smooth.values.iter_mut().enumerate() {
        *value = covered.at(PARTS * (n % nx), PARTS * (n / nx));
    }
    let smooth = smooth.blurred();
    let loops = contour::closed_contours(smooth.nx, smooth.ny, |i, j| smooth.at(i, j), 0.5);
    let place = |(i, j): (f64, f64)| (x0 + i * step, y0 + j * step);
    loops.into_iter().map(|ring| ring.into_iter().map(place).collect()).collect()
}

/// Values at the nodes of a plane grid, x fastest: 1 inside the projection, 0 outside.
struct Mask {
    nx: usize,
    ny: usize,
    values: Vec<f64>,
}

impl Mask {
    fn new(nx: usize, ny: usize) -> Mask {
        Mask { nx, ny, values: vec![0.0; nx * ny] }
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.values[i + self.nx * j]
    }

    /// Sets the nodes inside a triangle.
    fn paint(&mut self, [a, b, c]: [(f64, f64); 3]) {
        let side = |p: (f64, f64), q: (f64, f64), x: f64, y: f64| {
            (q.0 - p.0) * (y - p.1) - (q.1 - p.1) * (x - p.0)
        };
        let low = |p: f64, q: f64, r: f64| p.min(q).min(r).floor().max(0.0) as usize;
        let high = |p: f64, q: f64, r: f64, count: usize| {
            (p.max(q).max(r).ceil().max(0.0) as usize).min(count - 1)
        };
        for j in low(a.1, b.1, c.1)..=high(a.1, b.1, c.1, self.ny) {
            for i in low(a.0, b.0, c.0)..=high(a.0, b.0, c.0, self.nx) {
                let (x, y) = (i as f64, j as f64);
                let sides = [side(a, b, x, y), side(b, c, x, y), side(c, a, x, y)];
                if sides.iter().all(|s| *s >= -1e-9) || sides.iter().all(|s| *s <= 1e-9) {
                    self.values[i + self.nx * j] = 1.0;
                }
            }
        }
    }

    /// Returns the mean over the 3 x 3 neighbours of each node; zero at the edge.
    fn blurred(&self) -> Mask {
        let mut out = Mask::new(self.nx, self.ny);
        for j in 1..self.ny - 1 {
            for i in 1..self.nx - 1 {
                let at = i + self.nx * j;
                let rows = [at - self.nx, at, at + self.nx];
                let sums =
                    rows.iter().map(|k| self.values[k - 1] + self.values[*k] + self.values[k + 1]);
                out.values[at] = sums.sum::<f64>() / 9.0;
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box with half edges a, b, c.
    fn block(a: f64, b: f64, c: f64) -> GrainSurface {
        let corner = |i: usize| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            DVec3::new(a * sign(0), b * sign(1), c * sign(2))
        };
        let quads =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles =
            quads.iter().flat_map(|[p, q, r, s]| [[*p, *q, *r], [*p, *r, *s]]).collect();
        GrainSurface { points: (0..8).map(corner).collect(), triangles }
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
        let [side] = &body.outlines(at, DQuat::IDENTITY, 0, 2)[..] else { panic!("one outline") };
        assert!((area(side) / 4e-6 - 1.0).abs() < 0.03, "{}", area(side));
        let turned =
            &body.outlines(at, DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2), 0, 2)[0];
        assert!((area(turned) / 2e-6 - 1.0).abs() < 0.03, "{}", area(turned));
        let centre = side.iter().map(|p| p.0).sum::<f64>() / side.len() as f64;
        assert!((centre - 0.1).abs() < 1e-4);
    }

    #[test]
    fn straight_edges_stay_straight() {
        let body = block(2e-3, 1.2e-3, 0.5e-3);
        for turn in [0.1, 0.35, 0.7] {
            let pose = DQuat::from_rotation_y(turn);
            let [ring] = &body.outlines(DVec3::ZERO, pose, 0, 2)[..] else { panic!("one outline") };
            let (sin, cos) = turn.sin_cos();
            let mut largest = 0.0_f64;
            for (x, z) in ring {
                // Distance from the edges of the rectangle, away from its corners.
                let (along, across) = ((cos * x - sin * z).abs(), (sin * x + cos * z).abs());
                if along < 1.8e-3 && across > 0.3e-3 {
                    largest = largest.max((across - 0.5e-3).abs());
                }
            }
            // 0.07 samples of the mask; without its parts 0.2 to 0.3.
            assert!(largest < 3e-6, "turned by {turn}: {largest:e}");
        }
    }

    /// A needle is thinner than a sample of a mask with a fixed number of samples.
    #[test]
    fn outlines_of_needles_have_their_thickness() {
        let body = block(2e-3, 0.08e-3, 0.08e-3);
        for turn in [0.0, 0.6] {
            let rings = body.outlines(DVec3::ZERO, DQuat::from_rotation_y(turn), 0, 2);
            assert_eq!(rings.len(), 1);
            assert!((area(&rings[0]) / 0.64e-6 - 1.0).abs() < 0.05, "{}", area(&rings[0]));
        }
    }

    #[test]
    fn the_hole_of_a_frame_is_seen() {
        // Four bars around a hole of 2 by 2.
        let mut body = GrainSurface { points: Vec::new(), triangles: Vec::new() };
        for (at, half) in [
            (DVec3::new(0.0, 1.5, 0.0), [2.0, 0.5]),
            (DVec3::new(0.0, -1.5, 0.0), [2.0, 0.5]),
            (DVec3::new(1.5, 0.0, 0.0), [0.5, 1.0]),
            (DVec3::new(-1.5, 0.0, 0.0), [0.5, 1.0]),
        ] {
            let (first, bar) = (body.points.len(), block(half[0], half[1], 0.5));
            body.points.extend(bar.points.iter().map(|p| *p + at));
            body.triangles.extend(bar.triangles.iter().map(|t| t.map(|i| first + i)));
        }
        let rings = body.outlines(DVec3::ZERO, DQuat::IDENTITY, 0, 1);
        let mut areas: Vec<f64> = rings.iter().map(|ring| area(ring)).collect();
        areas.sort_by(f64::total_cmp);
        assert_eq!(areas.len(), 2, "{areas:?}");
        assert!((areas[0] / 4.0 - 1.0).abs() < 0.05 && (areas[1] / 16.0 - 1.0).abs() < 0.05);
        // They turn in opposite directions, so that a fill leaves the hole.
        let turn = |ring: &Outline| -> f64 {
            let next = ring.iter().cycle().skip(1);
            ring.iter().zip(next).map(|(a, b)| a.0 * b.1 - b.0 * a.1).sum()
        };
        assert!(turn(&rings[0]) * turn(&rings[1]) < 0.0);
        assert_eq!(body.outlines(DVec3::ZERO, DQuat::IDENTITY, 0, 2).len(), 1);
    }

    #[test]
    fn sections_are_loops_of_the_body() {
        let body = block(2e-3, 1e-3, 0.5e-3);
        let at = DVec3::new(0.1, 0.2, 0.3);
        let view = SliceView::along(1, 2);
        let cut = body.section(at, DQuat::IDENTITY, view, 0.2004);
        assert_eq!(cut.len(), 1);
        assert!((area(&cut[0]) - 4e-6).abs() < 1e-12, "{}", area(&cut[0]));
        assert!(body.section(at, DQuat::IDENTITY, view, 0.2011).is_empty());
    }

    /// Coarsening may merge points of two parts of a surface, which then share an edge.
    #[test]
    fn sections_of_a_surface_that_touches_itself_are_whole() {
        let (first, second) = (block(1.0, 1.0, 1.0), block(1.0, 1.0, 1.0));
        // The blocks share the edge from (1, 1, -1) to (1, 1, 1): points 3 and 7 of the first.
        let shared = |i: usize| match i {
            0 => 3,
            4 => 7,
            _ => 8 + i,
        };
        let mut body = first.clone();
        body.points.extend(second.points.iter().map(|p| *p + DVec3::new(2.0, 2.0, 0.0)));
        body.triangles.extend(second.triangles.iter().map(|t| t.map(shared)));
        for place in [-0.7, 0.3] {
            let view = SliceView::along(2, 2);
            let cut = body.section(DVec3::ZERO, DQuat::IDENTITY, view, place);
            let whole: f64 = cut.iter().map(|ring| area(ring)).sum();
            assert!((whole - 8.0).abs() < 1e-12, "{place}: {whole} in {} rings", cut.len());
        }
    }

    #[test]
    fn axes_follow_the_extents() {
        let axes = |a, b, c| {
            let PrincipalAxes { long, short } = block(a, b, c).axes();
            (long, short)
        };
        assert_eq!(axes(1.0, 3.0, 2.0), (Some(DVec3::Y), Some(DVec3::X)));
        assert_eq!(axes(1.0, 1.0, 1.0), (None, None));
        // Moments 1.3 % and 1.7 % apart.
        assert_eq!(axes(1.0, 1.0065, 9.0), (Some(DVec3::Z), None));
        assert_eq!(axes(1.0, 1.0085, 9.0), (Some(DVec3::Z), Some(DVec3::X)));
        // A needle has no short axis, a plate no long one.
        assert_eq!(axes(1.0, 1.0, 9.0), (Some(DVec3::Z), None));
        assert_eq!(axes(1.0, 9.0, 9.0), (None, Some(DVec3::X)));
        let diameter = block(1.0, 3.0, 2.0).diameter().unwrap();
        assert!((diameter - (6.0 * 48.0 / std::f64::consts::PI).cbrt()).abs() < 1e-12);
    }

    #[test]
    fn flat_or_empty_bodies_have_no_outline() {
        let body = GrainSurface { points: vec![DVec3::ZERO; 3], triangles: vec![[0, 1, 2]] };
        assert!(body.outlines(DVec3::ZERO, DQuat::IDENTITY, 0, 2).is_empty());
        assert_eq!(circle((1.0, 2.0), 0.5).len(), 48);
    }
}
