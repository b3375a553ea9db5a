//! Small pictures of a run for tables: its grains at the key instants, seen from the side.

use std::fmt::Write as _;

use glam::DVec3;
use serde::Serialize;

use crate::features::{RunFeatures, short};
use crate::figure::{Scene, surfaces};
use crate::phases::Instant;
use crate::run_folder::RunFolder;

/// Edge of a picture.
const EDGE: f64 = 100.0;
/// Largest number of grains with their true outlines; more are circles.
const OUTLINED: usize = 60;
/// Largest half-width of the picture of a single grain or a pair, in diameters.
const FARTHEST: f64 = 4.0;
/// Largest number of points of a trail.
const TRAIL: usize = 60;

/// Pictures of a run, in order of time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Thumbnail {
    /// Pictures.
    pub frames: Vec<Frame>,
}

/// Picture of one instant. Paths are in the notation of SVG, in a square of edge 100 whose y axis
/// points down.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Frame {
    /// Name and time of the instant.
    pub name: String,
    /// Outlines of the grains.
    pub grains: Vec<Drawn>,
    /// Paths of the centres up to the instant, of at most two grains.
    pub trails: Vec<Drawn>,
}

/// Drawn line of a grain.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Drawn {
    /// Number in the cycle of colours.
    pub colour: usize,
    /// Path.
    pub path: String,
}

/// Square part of the view.
#[derive(Clone, Copy)]
struct Square {
    centre: (f64, f64),
    half: f64,
    /// Direction of the vertical axis of the view.
    up: f64,
}

impl Square {
    fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let scale = 0.5 * EDGE / self.half;
        let along = scale * (x - self.centre.0);
        (0.5 * EDGE + along, 0.5 * EDGE - self.up * scale * (y - self.centre.1))
    }

    fn path(&self, points: impl Iterator<Item = (f64, f64)>, end: &str) -> String {
        let mut path = String::new();
        for (n, point) in points.enumerate() {
            let (x, y) = self.place(point);
            // Writing to a string cannot fail.
            let _ = write!(path, "{}{x:.1} {y:.1}", if n == 0 { "M" } else { "L" });
        }
        path + end
    }
}

/// Draws the pictures of a run; `None` without grains that have a history.
pub fn thumbnail(run: &RunFolder) -> Option<Thumbnail> {
    let features = RunFeatures::of(run);
    let moving = run.moving();
    // Surfaces that cannot be read are circles.
    let surfaces =
        if moving.len() <= OUTLINED { surfaces(run, &mut Vec::new()) } else { Default::default() };
    let scene = Scene { run, features: &features, surfaces, instants: features.instants.clone() };
    let diameter = run.facts.diameter().filter(|d| *d > 0.0)?;
    let up = scene.vertical();
    let across = across(&scene, &moving);
    let shown: Vec<(Moment, &Instant)> = (scene.instants.iter())
        .filter_map(|instant| Some((Moment::of(&scene, &moving, instant.time)?, instant)))
        .collect();
    let half = |(moment, _): &(Moment, &Instant)| {
        let far = moment.grains.iter().map(|(_, _, p)| (*p - moment.centre).abs());
        far.fold(0.0, |far: f64, p| far.max(p[across]).max(p[up])) + 0.8 * diameter
    };
    let few = moving.len() <= 2;
    let mut widest = shown.iter().map(half).fold(0.0, f64::max);
    let mut fixed = None;
    if few {
        widest = widest.min(FARTHEST * diameter);
    } else {
        let all = || shown.iter().flat_map(|(moment, _)| moment.grains.iter().map(|(_, _, p)| *p));
        let low = all().fold(DVec3::INFINITY, DVec3::min);
        let high = all().fold(DVec3::NEG_INFINITY, DVec3::max);
        let size = high - low;
        fixed = Some(0.5 * (low + high));
        widest = 0.5 * size[across].max(size[up]) + 0.8 * diameter;
    }
    let sign = if features.up[up] < 0.0 { -1.0 } else { 1.0 };
    let frames = shown.iter().map(|(moment, instant)| {
        let centre = fixed.unwrap_or(moment.centre);
        let square = Square { centre: (centre[across], centre[up]), half: widest, up: sign };
        let colour = |grain: usize| features.grain_rank(grain);
        let outline = |&(grain, row, position): &(usize, usize, DVec3)| {
            // The outline is that of the wrapped position; the picture needs the one beside the
            // other grain.
            let wrapped = run.wrapped(run.grains[grain].position[row]);
            let shift = position - wrapped;
            let outlines = scene.outlines(grain, row, across, up).into_iter();
            let shifted = |(x, y): (f64, f64)| (x + shift[across], y + shift[up]);
            let path =
                outlines.map(|ring| square.path(ring.into_iter().map(shifted), "Z")).collect();
            Drawn { colour: colour(grain), path }
        };
        let trail = |&(grain, row, position): &(usize, usize, DVec3)| {
            let history = &run.grains[grain];
            let offset = position - history.position[row];
            let near = |p: &DVec3| {
                let far = (*p - centre).abs();
                far[across].max(far[up]) < 1.5 * widest
            };
            let points: Vec<DVec3> = history.position[..=row]
                .iter()
                .map(|p| *p + offset)
                .rev()
                .take_while(near)
                .collect();
            let stride = points.len().div_ceil(TRAIL).max(1);
            let thinned = points.iter().step_by(stride).map(|p| (p[across], p[up]));
            Drawn { colour: colour(grain), path: square.path(thinned, "") }
        };
        let name = match instant.name {
            "" => format!("t = {} s", short(instant.time)),
            name => format!("{name}, t = {} s", short(instant.time)),
        };
        Frame {
            name,
            grains: moment.grains.iter().map(outline).collect(),
            trails: moment.grains.iter().filter(|_| few).map(trail).collect(),
        }
    });
    let frames: Vec<Frame> = frames.collect();
    (!frames.is_empty()).then_some(Thumbnail { frames })
}

/// Grains at an instant.
struct Moment {
    /// Index, row of the history and position of each grain; on periodic axes beside the first.
    grains: Vec<(usize, usize, DVec3)>,
    /// Mean of the positions.
    centre: DVec3,
}

impl Moment {
    fn of(scene: &Scene, moving: &[usize], time: f64) -> Option<Moment> {
        let run = scene.run;
        let mut grains: Vec<(usize, usize, DVec3)> = Vec::new();
        for &grain in moving {
            let history = &run.grains[grain];
            // A grain that has left the box has no later rows.
            let Some(row) = history.nearest(time).filter(|_| history.pose(time).is_some()) else {
                continue;
            };
            let own = run.wrapped(history.position[row]);
            let position = match grains.first() {
                Some((_, _, first)) if moving.len() <= 2 => *first + run.nearest(own - *first),
                _ => own,
            };
            grains.push((grain, row, position));
        }
        let count = grains.len() as f64;
        let centre = grains.iter().map(|(_, _, p)| *p).sum::<DVec3>() / count;
        (!grains.is_empty()).then_some(Moment { grains, centre })
    }
}

/// Returns the horizontal axis of the view: of a pair, the one along which it lies apart more.
fn across(scene: &Scene, moving: &[usize]) -> usize {
    let [first, second] = scene.horizontal();
    let apart = |axis: usize| {
        let moments = scene.instants.iter().filter_map(|i| Moment::of(scene, moving, i.time));
        let far = moments.flat_map(|m| {
            let centre = m.centre;
            m.grains.into_iter().map(move |(_, _, p)| (p - centre)[axis].abs())
        });
        far.fold(0.0, f64::max)
    };
    if scene.features.pair.is_some() && apart(second) > apart(first) { second } else { first }
}
