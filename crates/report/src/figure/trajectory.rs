//! Paths of the grains seen from two sides, with the grains drawn at the key instants.

use super::{AXES, Figure, Scene, letter, silhouette};
use crate::story::short;
use grainwake_plot::axis::extent;
use grainwake_plot::drawing::{Anchor, Drawing};
use grainwake_plot::equal_aspect::{EqualAspectFrame, Window, length_unit, outline_style};
use grainwake_plot::style::{self, COLUMN, INK, SMALL, series_colour};

impl Scene<'_> {
    /// Outline of a grain at a row of its history, seen along the axis that is neither.
    pub fn outline(
        &self,
        grain: usize,
        row: usize,
        across: usize,
        up: usize,
    ) -> silhouette::Outline {
        let history = &self.run.grains[grain];
        let position = self.run.wrapped(history.position[row]);
        let turn = history.orientation[row];
        let traced = self
            .bodies
            .get(&grain)
            .map(|body| body.outline(position, turn, across, up));
        traced
            .filter(|outline| !outline.is_empty())
            .unwrap_or_else(|| {
                let facts = self
                    .run
                    .facts
                    .grains
                    .get(grain)
                    .and_then(|facts| facts.diameter);
                let radius = 0.5 * facts.or(self.run.facts.diameter()).unwrap_or(0.0);
                silhouette::circle((position[across], position[up]), radius)
            })
    }

    /// Diameter of a grain that is a sphere [m].
    pub fn sphere_diameter(&self, grain: usize) -> Option<f64> {
        let facts = self.run.facts.grains.get(grain)?;
        facts
            .diameter
            .filter(|_| facts.shape.as_deref() == Some("sphere"))
    }

    /// What the grains are drawn as, in words.
    pub fn drawn_as(&self, grains: &[usize]) -> &'static str {
        let known = |g: &usize| self.bodies.contains_key(g) || self.sphere_diameter(*g).is_some();
        match grains.iter().filter(|g| known(g)).count() {
            n if n == grains.len() => "true outlines",
            0 => "circles of equal volume",
            _ => "true outlines where their surfaces are known, else circles of equal volume",
        }
    }

    /// A sentence on grains whose centres are outside the box at the end, which no picture shows; else nothing.
    pub fn left_out(&self, grains: &[usize]) -> String {
        let Some(size) = self.run.facts.size else {
            return String::new();
        };
        let (low, high) = (self.run.facts.lower, self.run.facts.lower + size);
        let outside = |grain: &&usize| {
            let last = self.run.grains[**grain].position.last();
            last.is_some_and(|x| {
                let x = self.run.wrapped(*x);
                x.cmplt(low).any() || x.cmpgt(high).any()
            })
        };
        let names: Vec<String> = grains
            .iter()
            .filter(outside)
            .map(usize::to_string)
            .collect();
        match names.len() {
            0 => String::new(),
            1 => format!(
                " Grain {} has left the box and is not shown there.",
                names[0]
            ),
            n if n <= 6 => format!(
                " Grains {} have left the box and are not shown there.",
                names.join(", ")
            ),
            n => format!(" {n} grains have left the box and are not shown there."),
        }
    }

    /// The axis nearest to the vertical, and the two others.
    pub fn vertical(&self) -> (usize, [usize; 2]) {
        let up = self.story.up.abs();
        let axis = if up.z >= up.x && up.z >= up.y {
            2
        } else if up.y >= up.x {
            1
        } else {
            0
        };
        (axis, [(axis + 1) % 3, (axis + 2) % 3].map(|a| a.min(2)))
    }
}

/// Paths seen along both horizontal axes.
pub fn figure(scene: &Scene) -> Option<Figure> {
    const LEFT: f64 = 36.0;
    const MIDDLE: f64 = 14.0;
    const RIGHT: f64 = 18.0;
    let grains: Vec<usize> = match scene.story.pair {
        Some(pair) => pair.to_vec(),
        None => (0..scene.run.grains.len())
            .filter(|g| !scene.run.grains[*g].is_empty())
            .collect(),
    };
    let (up, mut sides) = scene.vertical();
    sides.sort_unstable();
    let windows = sides.map(|side| window(scene, &grains, side, up));
    let [Some(first), Some(second)] = windows else {
        return None;
    };
    let room = COLUMN - LEFT - MIDDLE - RIGHT;
    let scale = (room / (first.width() + second.width())).min(330.0 / first.height());
    // The names of a pair are long, those of more grains stand side by side.
    let columns = if grains.len() > 2 { 4 } else { 1 };
    let top = 8.0 + 10.0 * grains.len().div_ceil(columns) as f64;
    let free = room - scale * (first.width() + second.width());
    let plans = [
        EqualAspectFrame {
            window: first,
            corner: (LEFT + 0.5 * free, top),
            scale,
        },
        EqualAspectFrame {
            window: second,
            corner: (LEFT + 0.5 * free + MIDDLE + scale * first.width(), top),
            scale,
        },
    ];
    let mut drawing = Drawing::new(COLUMN, top + plans[0].height() + 26.0);
    for (i, grain) in grains.iter().enumerate() {
        let column = (i % columns) as f64 * (COLUMN - LEFT) / columns as f64;
        let left = if columns == 1 {
            plans[0].corner.0
        } else {
            LEFT
        };
        let (x, y) = (left + column, 8.0 + 10.0 * (i / columns) as f64);
        let colour = series_colour(scene.story.grain_rank(*grain));
        drawing.line(&[(x, y), (x + 14.0, y)], colour, style::LINE, dash(i));
        drawing.label(
            x + 17.0,
            y + 0.36 * SMALL,
            Anchor::Start,
            SMALL,
            INK,
            &scene.story.grain_name(*grain),
            false,
        );
    }
    let (unit, _) = length_unit(first.width().max(first.height()));
    for (i, (plan, side)) in plans.iter().zip(sides).enumerate() {
        plan.clip(&mut drawing, &format!("clip-{i}"));
        draw_paths(scene, &grains, plan, side, up, &mut drawing);
        drawing.end_clip();
        let across = format!("*{}*  [{unit}]", AXES[side]);
        let height = format!("*{}*  [{unit}]", AXES[up]);
        plan.frame(
            &mut drawing,
            (Some(&across), (i == 0).then_some(height.as_str())),
        );
    }
    label_instants(scene, &grains, &plans[1], up, &mut drawing);
    let named: Vec<String> = scene
        .instants
        .iter()
        .enumerate()
        .map(|(i, instant)| {
            let name = if instant.name.is_empty() {
                String::new()
            } else {
                format!("{}, ", instant.name)
            };
            format!(
                "{} {name}{}",
                letter(i),
                scene.story.time_text(instant.time)
            )
        })
        .collect();
    let drawn = scene.drawn_as(&grains);
    let mut caption = format!(
        "Paths of the centres seen along {} and {}, at equal scale, with the grains as {drawn}",
        AXES[sides[1]], AXES[sides[0]]
    );
    caption.push_str(&if named.is_empty() {
        ".".to_owned()
    } else {
        format!(" at the start (pale) and at {}.", named.join("; "))
    });
    caption.push_str(&scene.left_out(&grains));
    if let Some(drift) = drift(scene, &grains, up) {
        caption.push_str(&format!(
            " Largest sideways drift: {} mm.",
            short(1e3 * drift)
        ));
    }
    let title = if grains.len() == 1 {
        "Path of the grain"
    } else {
        "Paths of the grains"
    };
    Some(Figure {
        name: "trajectories",
        title: title.to_owned(),
        caption,
        drawing,
    })
}

/// Dashes tell grains of one colour apart.
fn dash(n: usize) -> Option<&'static str> {
    (n >= style::SERIES_COLOURS).then_some("3.5 1.6")
}

/// The box, or the part of it that the paths fill.
fn window(scene: &Scene, grains: &[usize], side: usize, up: usize) -> Option<Window> {
    let over = |axis: usize| {
        extent(
            grains
                .iter()
                .flat_map(|g| scene.run.grains[*g].position.iter())
                .map(|p| scene.run.wrapped(*p)[axis]),
        )
    };
    let ((x0, x1), (z0, z1)) = (over(side)?, over(up)?);
    let margin = 2.0
        * scene
            .run
            .facts
            .diameter()
            .unwrap_or(0.1 * (z1 - z0).max(x1 - x0))
            .max(1e-9);
    let tight = Window {
        low: (x0 - margin, z0 - margin),
        high: (x1 + margin, z1 + margin),
    };
    let Some(size) = scene.run.facts.size else {
        return Some(tight);
    };
    let lower = scene.run.facts.lower;
    let (low, high) = (
        (lower[side], lower[up]),
        (lower[side] + size[side], lower[up] + size[up]),
    );
    let part = tight.height() < 0.6 * size[up];
    let (z0, z1) = if part {
        (tight.low.1.max(low.1), tight.high.1.min(high.1))
    } else {
        (low.1, high.1)
    };
    Some(Window {
        low: (low.0, z0),
        high: (high.0, z1.max(z0 + margin)),
    })
}

fn draw_paths(
    scene: &Scene,
    grains: &[usize],
    plan: &EqualAspectFrame,
    side: usize,
    up: usize,
    drawing: &mut Drawing,
) {
    for (n, grain) in grains.iter().enumerate() {
        let history = &scene.run.grains[*grain];
        let colour = series_colour(scene.story.grain_rank(*grain));
        let start = plan.path(&scene.outline(*grain, 0, side, up), true);
        drawing.path(&start, &outline_style(colour, 0.35));
        for instant in &scene.instants {
            if let Some(row) = history.nearest(instant.time) {
                drawing.path(
                    &plan.path(&scene.outline(*grain, row, side, up), true),
                    &outline_style(colour, 1.0),
                );
            }
        }
        // A path that leaves through a periodic face goes on at the other side.
        let jump = |axis: usize, a: f64, b: f64| {
            scene
                .run
                .period(axis)
                .is_some_and(|p| (a - b).abs() > 0.5 * p)
        };
        let mut run: Vec<(f64, f64)> = Vec::new();
        let every = (history.len() / 1500).max(1);
        let kept = history
            .position
            .iter()
            .enumerate()
            .filter(|(i, _)| i % every == 0 || i + 1 == history.len());
        for point in kept
            .map(|(_, p)| scene.run.wrapped(*p))
            .map(|p| (p[side], p[up]))
        {
            if run
                .last()
                .is_some_and(|last| jump(side, last.0, point.0) || jump(up, last.1, point.1))
            {
                drawing.line(
                    &run.drain(..).map(|p| plan.at(p)).collect::<Vec<_>>(),
                    colour,
                    0.9,
                    dash(n),
                );
            }
            run.push(point);
        }
        drawing.line(
            &run.iter().map(|p| plan.at(*p)).collect::<Vec<_>>(),
            colour,
            0.9,
            dash(n),
        );
    }
}

/// Letters of the instants beside the frame, at the height of the grains, moved apart where needed.
fn label_instants(
    scene: &Scene,
    grains: &[usize],
    plan: &EqualAspectFrame,
    up: usize,
    drawing: &mut Drawing,
) {
    let mut places: Vec<(f64, String)> = Vec::new();
    for (i, instant) in scene.instants.iter().enumerate() {
        let heights: Vec<f64> = grains
            .iter()
            .filter_map(|g| {
                scene.run.grains[*g]
                    .nearest(instant.time)
                    .map(|row| scene.run.wrapped(scene.run.grains[*g].position[row])[up])
            })
            .collect();
        let mean = heights.iter().sum::<f64>() / heights.len().max(1) as f64;
        places.push((plan.at((0.0, mean)).1, letter(i)));
    }
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut last = f64::NEG_INFINITY;
    for (y, name) in places {
        last = y.clamp(last + SMALL + 1.0, f64::INFINITY);
        let x = plan.corner.0 + plan.width();
        drawing.line(&[(x, y), (x + 3.0, last)], style::FAINT, style::HAIR, None);
        drawing.label(
            x + 4.0,
            last + 0.36 * SMALL,
            Anchor::Start,
            SMALL,
            INK,
            &name,
            false,
        );
    }
}

fn drift(scene: &Scene, grains: &[usize], up: usize) -> Option<f64> {
    let of = |grain: &usize| {
        let positions = &scene.run.grains[*grain].position;
        let start = *positions.first()?;
        let mut axis = glam::DVec3::ONE;
        axis[up] = 0.0;
        Some(
            positions
                .iter()
                .map(|p| ((*p - start) * axis).length())
                .fold(0.0, f64::max),
        )
    };
    grains.iter().filter_map(of).reduce(f64::max)
}
