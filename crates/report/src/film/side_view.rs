//! Pictures of the grains of a dry run from the side, coloured by their speed.

use grainwake_plot::Drawing;
use grainwake_plot::axis::{Axis, AxisRange, extent};
use grainwake_plot::drawing::Anchor;
use grainwake_plot::equal_aspect::{EqualAspectFrame, Window, colour_bar, length_unit};
use grainwake_plot::style::{INK, SMALL};

use super::{View, moments};
use crate::features::short;
use crate::figure::Scene;
use crate::figure::positions::{grain_style, palette};
use crate::figure::scene::AXES;

/// Left and top margin [pt].
const MARGIN: (f64, f64) = (38.0, 14.0);
/// Room for the view [pt].
const ROOM: (f64, f64) = (330.0, 260.0);

/// Returns the position of a part of the largest speed on the colour scale. Equal steps of colour
/// are equal steps of the root of the speed: slow grains differ too.
fn shade(part: f64) -> f64 {
    1.0 - part.sqrt()
}

/// Film of the grains from the side.
pub struct SideFilm<'a> {
    scene: &'a Scene<'a>,
    times: Vec<f64>,
    window: Window,
    /// Axes to the right, upwards and towards the viewer.
    axes: [usize; 3],
    fastest: f64,
}

impl<'a> SideFilm<'a> {
    /// Chooses the moments, the displayed range and the colour scale.
    pub fn new(scene: &'a Scene<'a>) -> SideFilm<'a> {
        let run = scene.run;
        let longest = run.grains.iter().max_by_key(|history| history.len());
        let times = longest.map_or(Vec::new(), |history| history.time.clone());
        let times = moments::even(&times).into_iter().map(|i| times[i]).collect();
        let up = scene.vertical();
        let [across, depth] = scene.horizontal();
        let margin = run.facts.diameter().unwrap_or(0.0);
        let span = |axis: usize| {
            let places = run.grains.iter().flat_map(|history| &history.position);
            let places = places.map(|position| run.wrapped(*position)[axis]);
            let (low, high) = extent(places).unwrap_or((0.0, 0.0));
            let (low, high) = (low - margin, high + margin);
            run.facts.size.map_or((low, high), |size| {
                let (floor, ceiling) = (run.facts.lower[axis], run.facts.lower[axis] + size[axis]);
                // The box, without empty height above the highest grain.
                match (axis == up, scene.flipped()) {
                    (false, _) => (floor, ceiling),
                    (true, false) => (floor, high.min(ceiling)),
                    (true, true) => (low.max(floor), ceiling),
                }
            })
        };
        let (x, z) = (span(across), span(up));
        let speeds = run.grains.iter().flat_map(|history| &history.velocity);
        let fastest = speeds.map(|v| v.length()).filter(|v| v.is_finite()).fold(0.0, f64::max);
        SideFilm {
            scene,
            times,
            window: Window { low: (x.0, z.0), high: (x.1, z.1) },
            axes: [across, up, depth],
            fastest: fastest.max(1e-12),
        }
    }
}

impl View for SideFilm<'_> {
    fn times(&self) -> &[f64] {
        &self.times
    }

    fn draw(&self, index: usize) -> Result<Drawing, String> {
        let time = self.times[index];
        let run = self.scene.run;
        let [across, up, depth] = self.axes;
        let window = self.window;
        let scale = (ROOM.0 / window.width()).min(ROOM.1 / window.height());
        if !(scale > 0.0 && scale.is_finite()) {
            return Err("the box and the positions of the grains are not known".to_owned());
        }
        let (width, height) = (scale * window.width(), scale * window.height());
        let total = (MARGIN.0 + width + 10.0).max(240.0);
        let left = MARGIN.0.max(0.5 * (total - width));
        let mut drawing = Drawing::new(total, MARGIN.1 + height + 58.0);
        let flipped = self.scene.flipped();
        let frame = EqualAspectFrame { window, corner: (left, MARGIN.1), scale, flipped };
        let label = format!("*t* = {} s", short(time));
        drawing.label((left + 0.5 * width, 9.5), Anchor::Middle, SMALL, INK, &label);
        let rows = run.grains.iter().enumerate().filter_map(|(grain, history)| {
            let row = history.nearest(time)?;
            // A grain that has left the box has no more rows.
            let last = history.time[history.len() - 1];
            (time <= last * (1.0 + 1e-9)).then_some((grain, row))
        });
        let mut rows: Vec<(usize, usize)> = rows.collect();
        // Grains nearer to the viewer cover others.
        let place =
            |(grain, row): &(usize, usize)| -run.wrapped(run.grains[*grain].position[*row])[depth];
        rows.sort_by(|a, b| place(a).total_cmp(&place(b)).then(a.cmp(b)));
        frame.clip(&mut drawing, "clip-0");
        for (grain, row) in rows {
            let speed = run.grains[grain].velocity[row].length();
            let style = grain_style(shade(speed / self.fastest));
            let outlines = self.scene.outlines(grain, row, across, up);
            drawing.path(&frame.paths(&outlines), &style);
        }
        drawing.end_clip();
        let (unit, _) = length_unit(window.width().max(window.height()));
        let names = [across, up].map(|axis| format!("*{}*  [{unit}]", AXES[axis]));
        frame.frame(&mut drawing, (Some(&names[0]), Some(&names[1])));
        let palette = palette(shade);
        let axis = Axis::linear("speed  [m/s]", 0.0, self.fastest, 4, AxisRange::Tight);
        let corner = (0.5 * total - 90.0, MARGIN.1 + height + 30.0);
        colour_bar(&mut drawing, corner, 180.0, &palette, &axis, (false, false));
        Ok(drawing)
    }
}
