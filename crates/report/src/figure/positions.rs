//! Final positions of many grains, from the side and from above.

use grainwake_plot::Figure;
use grainwake_plot::axis::{Axis, AxisRange, extent};
use grainwake_plot::colormap::{hex, sequential};
use grainwake_plot::drawing::Drawing;
use grainwake_plot::equal_aspect::{EqualAspectFrame, Window, colour_bar, length_unit};
use grainwake_plot::style::PAGE;

use super::coverage::Coverage;
use super::grain_surface::Outline;
use super::scene::{AXES, Scene};
use crate::features::{length, short};

/// Left margin [pt].
const LEFT: f64 = 38.0;
/// Distance of views side by side [pt].
const MIDDLE: f64 = 44.0;
/// Top margin [pt].
const TOP: f64 = 8.0;

/// Edge of the cells on paper by which hidden grains are found [pt].
const CELL: f64 = 0.5;

/// Returns the style of a grain with this position on the colour scale, 0 to 1.
pub(crate) fn grain_style(position: f64) -> String {
    let colour = hex(sequential(position));
    format!("fill=\"{colour}\" stroke=\"#ffffff\" stroke-width=\"0.35\" stroke-linejoin=\"round\"")
}

/// Returns the colours of a bar whose parts, 0 to 1, have the given positions on the colour scale.
pub(crate) fn palette(position: fn(f64) -> f64) -> Vec<[u8; 3]> {
    (0..256).map(|i| sequential(position(f64::from(i) / 255.0))).collect()
}

/// Returns whether an outline reaches into the window.
fn is_seen(outline: &Outline, window: Window) -> bool {
    let range = |of: fn(&(f64, f64)) -> f64| extent(outline.iter().map(of));
    range(|p| p.0).zip(range(|p| p.1)).is_some_and(|(x, y)| {
        let part = window.intersection(Window { low: (x.0, y.0), high: (x.1, y.1) });
        part.width() > 0.0 && part.height() > 0.0
    })
}

/// Draws the grains at the end of the run, coloured by height.
pub fn figure(scene: &Scene) -> Option<Figure> {
    let run = scene.run;
    let grains = run.remaining();
    let last = |g: usize| run.grains[g].len() - 1;
    let place = |g: usize| run.wrapped(run.grains[g].position[last(g)]);
    let up = scene.vertical();
    let flipped = scene.flipped();
    let [across, depth] = scene.horizontal();
    let (low, high) = extent(grains.iter().map(|g| place(*g)[up]))?;
    // Heights count from the side of the box towards which gravity points.
    let (box_low, box_high) =
        (run.facts.lower[up], run.facts.lower[up] + run.facts.size.map_or(0.0, |size| size[up]));
    let highest = if flipped { box_high - low } else { high - box_low };
    // Equal heights have one colour.
    let (low, high) =
        extent(scene.least_range([low, high].into_iter(), 1.0).into_iter().chain([low, high]))?;
    let default = 0.05 * (high - low);
    let margin = run.facts.diameter().unwrap_or(default).max(1e-9);
    let span = |axis: usize| -> Option<(f64, f64)> {
        let reach = |g: usize| {
            let own = run.facts.grains.get(g).and_then(|facts| facts.diameter);
            margin.max(own.unwrap_or(0.0))
        };
        let ends = |g: &usize| [place(*g)[axis] - reach(*g), place(*g)[axis] + reach(*g)];
        let (a, b) = extent(grains.iter().flat_map(ends))?;
        let Some(size) = run.facts.size else {
            return Some((a, b));
        };
        let (l, h) = (run.facts.lower[axis], run.facts.lower[axis] + size[axis]);
        if run.period(axis).is_some() && (a < l || b > h) {
            // An image may lie at the opposite side.
            return Some((l, h));
        }
        let least = if axis == up { a + margin } else { f64::NEG_INFINITY };
        Some((a.max(l), b.min(h).max(least)))
    };
    let (x, y, z) = (span(across)?, span(depth)?, span(up)?);
    let window = |h: (f64, f64), v: (f64, f64)| Window { low: (h.0, v.0), high: (h.1, v.1) };
    let (side, top) = (window(x, z), window(x, y));
    // The view from above lies below the side view, or beside that of a tall column.
    let tall = side.height() > 1.2 * side.width();
    let (across_room, up_room, stacked) = if tall {
        let room = 0.5 * (PAGE - 2.0 * LEFT - MIDDLE);
        (room, 330.0, side.height())
    } else {
        (300.0, 420.0, side.height() + top.height())
    };
    let scale = (across_room / side.width()).min(up_room / stacked);
    let (width, height) = (scale * side.width(), scale * side.height());
    let depth_height = scale * top.height();
    let (total, bottom, corner) = if tall {
        let corner = (LEFT + width + MIDDLE, (height - depth_height).max(0.0));
        (corner.0 + width + 10.0, height.max(depth_height), corner)
    } else {
        let corner = (LEFT, height + 16.0);
        (LEFT + width + 10.0, corner.1 + depth_height, corner)
    };
    let total = total.max(240.0);
    let mut drawing = Drawing::new(total, TOP + bottom + 26.0 + 36.0);
    let (unit, factor) = length_unit(side.width().max(side.height()).max(top.height()));
    let views = [
        (side, (LEFT, TOP), [across, up, depth], -1.0),
        (top, (corner.0, TOP + corner.1), [across, depth, up], if flipped { -1.0 } else { 1.0 }),
    ];
    for (i, (window, corner, [h, v, hidden], direction)) in views.into_iter().enumerate() {
        let frame = EqualAspectFrame { window, corner, scale, flipped: flipped && v == up };
        // Grains nearer to the viewer cover others.
        let nearness = |g: &usize| direction * place(*g)[hidden];
        let mut order = grains.clone();
        order.sort_by(|a, b| nearness(a).total_cmp(&nearness(b)).then(a.cmp(b)));
        frame.clip(&mut drawing, &format!("clip-{i}"));
        // From the nearest one: grains behind others are left out.
        let mut coverage = Coverage::new(window, CELL / scale);
        let mut seen: Vec<(String, String)> = Vec::new();
        for grain in order.into_iter().rev() {
            let (centre, reach) = (place(grain), scene.reach(grain));
            let hidden =
                |(dx, dy): &(f64, f64)| coverage.hides((centre[h] + dx, centre[v] + dy), reach);
            let shifts = scene.image_shifts(h, v);
            let shifts: Vec<(f64, f64)> = shifts.into_iter().filter(|s| !hidden(s)).collect();
            if shifts.is_empty() {
                continue;
            }
            let style = grain_style((centre[up] - low) / (high - low).max(1e-12));
            let outlines = scene.outlines(grain, last(grain), h, v);
            for (dx, dy) in shifts {
                let shifted = |ring: &Outline| ring.iter().map(|p| (p.0 + dx, p.1 + dy)).collect();
                let image: Vec<Outline> = outlines.iter().map(shifted).collect();
                if image.iter().any(|ring| is_seen(ring, window)) {
                    seen.push((frame.paths(&image), style.clone()));
                    coverage.add(&image);
                }
            }
        }
        seen.iter().rev().for_each(|(path, style)| drawing.path(path, style));
        drawing.end_clip();
        let names = [h, v].map(|axis| format!("*{}*  [{unit}]", AXES[axis]));
        let below = (tall || i == 1).then_some(names[0].as_str());
        frame.frame(&mut drawing, (below, Some(&names[1])));
    }
    let palette = palette(|part| part);
    let label = match flipped {
        true => format!("*{}* of the centre  [{unit}]", AXES[up]),
        false => format!("height of the centre  [{unit}]"),
    };
    let axis = Axis::linear(&label, low * factor, high * factor, 5, AxisRange::Tight);
    let corner = (0.5 * total - 90.0, TOP + bottom + 30.0);
    colour_bar(&mut drawing, corner, 180.0, &palette, &axis, (false, false));
    let time = run.grains[grains[0]].time[last(grains[0])];
    let caption = format!(
        "The {} grains at *t* = {} s, from the side (along {}) and from above, as {}; colour shows \
         {} of the centre. The highest centre lies {} above the lower side of the box.{}",
        grains.len(),
        short(time),
        AXES[depth],
        scene.drawn_as(&grains),
        if flipped { AXES[up] } else { "the height" },
        length(highest),
        scene.downwards() + &scene.left_out(&grains)
    );
    Some(Figure::new("positions", "Positions of the grains", caption, drawing))
}
