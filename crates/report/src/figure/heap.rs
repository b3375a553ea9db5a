//! Where many grains lie, from the side and from above.

use super::{AXES, Figure, Scene};
use crate::story::short;
use grainwake_plot::axis::{Axis, extent};
use grainwake_plot::colormap::{hex, sequential};
use grainwake_plot::drawing::Drawing;
use grainwake_plot::equal_aspect::{EqualAspectFrame, Window, colour_bar, length_unit};
use grainwake_plot::style::PAGE;

/// The grains at the end of the run, coloured by height.
pub fn positions(scene: &Scene) -> Option<Figure> {
    const LEFT: f64 = 38.0;
    const MIDDLE: f64 = 44.0;
    let run = scene.run;
    let grains: Vec<usize> = (0..run.grains.len())
        .filter(|g| !run.grains[*g].is_empty())
        .collect();
    let last = |g: usize| run.grains[g].len() - 1;
    let place = |g: usize| run.wrapped(run.grains[g].position[last(g)]);
    let (up, mut sides) = scene.vertical();
    sides.sort_unstable();
    let [across, depth] = sides;
    let heights: Vec<f64> = grains.iter().map(|g| place(*g)[up]).collect();
    let (low, high) = extent(heights.iter().copied())?;
    let margin = run
        .facts
        .diameter()
        .unwrap_or(0.05 * (high - low))
        .max(1e-9);
    let span = |axis: usize| -> Option<(f64, f64)> {
        let reach = |g: usize| {
            let own = run.facts.grains.get(g).and_then(|facts| facts.diameter);
            margin.max(own.unwrap_or(0.0))
        };
        let ends = grains
            .iter()
            .flat_map(|g| [place(*g)[axis] - reach(*g), place(*g)[axis] + reach(*g)]);
        let (a, b) = extent(ends)?;
        let Some(size) = run.facts.size else {
            return Some((a, b));
        };
        let (l, h) = (run.facts.lower[axis], run.facts.lower[axis] + size[axis]);
        Some(if axis == up {
            (a.max(l), b.min(h).max(a + margin))
        } else {
            (a.max(l), b.min(h))
        })
    };
    let (x, y, z) = (span(across)?, span(depth)?, span(up)?);
    let side = Window {
        low: (x.0, z.0),
        high: (x.1, z.1),
    };
    let top = Window {
        low: (x.0, y.0),
        high: (x.1, y.1),
    };
    // A low heap is shown below its side view, a tall column beside it.
    let tall = side.height() > 1.2 * side.width();
    let (across_room, up_room) = if tall {
        (0.5 * (PAGE - 2.0 * LEFT - MIDDLE), 330.0)
    } else {
        (300.0, 420.0)
    };
    let stacked = if tall {
        side.height()
    } else {
        side.height() + top.height()
    };
    let scale = (across_room / side.width()).min(up_room / stacked);
    let (width, height) = (scale * side.width(), scale * side.height());
    let (total, frame, second) = if tall {
        let low = height - scale * top.height();
        (
            LEFT + 2.0 * width + MIDDLE + 10.0,
            height.max(scale * top.height()),
            (LEFT + width + MIDDLE, low.max(0.0)),
        )
    } else {
        (
            LEFT + width + 10.0,
            height + 16.0 + scale * top.height(),
            (LEFT, height + 16.0),
        )
    };
    let total = total.max(240.0);
    let plans = [
        EqualAspectFrame {
            window: side,
            corner: (LEFT, 8.0),
            scale,
        },
        EqualAspectFrame {
            window: top,
            corner: (second.0, 8.0 + second.1),
            scale,
        },
    ];
    let mut drawing = Drawing::new(total, 8.0 + frame + 26.0 + 36.0);
    let (unit, factor) = length_unit(side.width().max(side.height()).max(top.height()));
    let views = [(across, up, depth, -1.0), (across, depth, up, 1.0)];
    for (i, (plan, (h, v, hidden, towards))) in plans.iter().zip(views).enumerate() {
        let mut order = grains.clone();
        // What is nearer to the eye is drawn later.
        order.sort_by(|a, b| {
            let nearness = |g: usize| towards * place(g)[hidden];
            nearness(*a).total_cmp(&nearness(*b)).then(a.cmp(b))
        });
        plan.clip(&mut drawing, &format!("clip-{i}"));
        for grain in order {
            let height = place(grain)[up];
            let colour = hex(sequential((height - low) / (high - low).max(1e-12)));
            let style = format!(
                "fill=\"{colour}\" stroke=\"#ffffff\" stroke-width=\"0.35\" stroke-linejoin=\"round\""
            );
            drawing.path(
                &plan.path(&scene.outline(grain, last(grain), h, v), true),
                &style,
            );
        }
        drawing.end_clip();
        let names = [h, v].map(|axis| format!("*{}*  [{unit}]", AXES[axis]));
        let below = (tall || i == 1).then_some(names[0].as_str());
        plan.frame(&mut drawing, (below, Some(&names[1])));
    }
    let palette: Vec<[u8; 3]> = (0..256).map(|i| sequential(f64::from(i) / 255.0)).collect();
    let axis = Axis::linear(
        &format!("height of the centre  [{unit}]"),
        low * factor,
        high * factor,
        5,
        true,
    );
    colour_bar(
        &mut drawing,
        (0.5 * total - 90.0, 8.0 + frame + 30.0),
        180.0,
        &palette,
        &axis,
        (false, false),
    );
    let time = run.grains[grains[0]].time[last(grains[0])];
    let caption = format!(
        "The {} grains at *t* = {} s, from the side (along {}) and from above, as {}; colour shows the height of the centre. The highest centre lies {} mm above the floor of the box.",
        grains.len(),
        short(time),
        AXES[depth],
        scene.drawn_as(&grains),
        short(1e3 * (high - run.facts.lower[up]))
    ) + &scene.left_out(&grains);
    Some(Figure {
        name: "positions",
        title: "Where the grains lie".to_owned(),
        caption,
        drawing,
    })
}
