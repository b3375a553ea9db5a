//! Curves of the motion against time: gap, velocities, orientation.

use glam::DVec3;

use super::{Figure, Scene};
use grainwake_formats::events::EventKind;

use crate::run_folder::History;
use crate::story::{galileo, short};
use grainwake_plot::axis::{Axis, extent};
use grainwake_plot::stacked::{Panel, Series, VerticalMark, stacked_panels};
use grainwake_plot::style::{self, series_colour};

/// Points of a curve.
pub type Points = Vec<(f64, f64)>;

/// A curve.
pub fn series(name: Option<String>, points: Points, colour: &'static str) -> Series {
    Series {
        name,
        points,
        colour,
        dash: None,
    }
}

/// A panel whose axis covers its series and `also`.
pub fn panel(label: &str, series: Vec<Series>, also: &[f64], height: f64) -> Panel {
    let values = series.iter().flat_map(|s| s.points.iter().map(|p| p.1));
    let (low, high) = extent(values.chain(also.iter().copied())).unwrap_or((0.0, 1.0));
    Panel {
        y: Axis::linear(label, low, high, 5, false),
        series,
        levels: Vec::new(),
        height,
    }
}

/// A panel with decades; none without positive values.
pub fn log_panel(label: &str, series: Vec<Series>, height: f64) -> Option<Panel> {
    let positive = |v: &f64| *v > 0.0 && v.is_finite();
    let values = series
        .iter()
        .flat_map(|s| s.points.iter().map(|p| p.1))
        .filter(positive);
    let (low, high) = extent(values)?;
    Some(Panel {
        y: Axis::log(label, low, high),
        series,
        levels: Vec::new(),
        height,
    })
}

impl Scene<'_> {
    /// The time axis of all curves.
    pub fn time(&self) -> Axis {
        let (label, factor) = self.story.time_axis();
        Axis::linear(label, 0.0, self.story.end * factor, 6, true)
    }

    /// The events as marks on the time axis.
    pub fn marks(&self) -> Vec<VerticalMark> {
        let (_, factor) = self.story.time_axis();
        let events = self.run.events.iter();
        events
            .map(|event| VerticalMark {
                at: event.time * factor,
                name: event.kind.label().to_owned(),
            })
            .collect()
    }

    /// One curve of a grain over the time axis.
    pub(super) fn curve(&self, grain: usize, value: impl Fn(&History, usize) -> f64) -> Series {
        let (_, factor) = self.story.time_axis();
        let history = &self.run.grains[grain];
        let points = (0..history.len())
            .map(|row| (history.time[row] * factor, value(history, row)))
            .collect();
        let colour = series_colour(self.story.grain_rank(grain));
        series(Some(self.story.grain_name(grain)), points, colour)
    }

    /// The grains with a history; of a pair, the one behind first.
    pub fn moving(&self) -> Vec<usize> {
        match self.story.pair {
            Some(pair) => pair.to_vec(),
            None => (0..self.run.grains.len())
                .filter(|i| !self.run.grains[*i].is_empty())
                .collect(),
        }
    }

    fn pair_curve(&self, value: impl Fn(DVec3) -> f64) -> Option<Points> {
        let [behind, ahead] = self.story.pair?;
        let (a, b) = (&self.run.grains[behind], &self.run.grains[ahead]);
        let (_, factor) = self.story.time_axis();
        let rows = (0..a.len().min(b.len())).filter(|row| a.time[*row] == b.time[*row]);
        let line = |row: usize| self.run.nearest(a.position[row] - b.position[row]);
        Some(
            rows.map(|row| (a.time[row] * factor, value(line(row))))
                .collect(),
        )
    }

    /// The event's time in words, if it happened.
    fn when(&self, kind: EventKind) -> Option<String> {
        let event = self.run.events.iter().find(|event| event.kind == kind)?;
        Some(self.story.time_text(event.time))
    }
}

/// Distance of the pair against time, with the tilt of the line of centres.
pub fn gap(scene: &Scene) -> Option<Figure> {
    let scales = scene.story.scales;
    let unit = scales.map_or(1.0, |s| s.diameter);
    let centres = scene.pair_curve(|r| r.length() / unit)?;
    let up = scene.story.up;
    let tilt = scene.pair_curve(|r| r.angle_between(up).to_degrees())?;
    let closest = centres.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1))?;
    let first = centres.first()?.1;
    let last = centres.last()?.1;
    let mut curves = vec![series(
        Some("centres, *D*_{r}".to_owned()),
        centres,
        style::INK,
    )];
    if let Some(surface) = surface_gap(scene, unit) {
        curves.push(Series {
            dash: Some("4 1.5"),
            ..series(Some("surfaces".to_owned()), surface, style::BLUE)
        });
    }
    let label = if scales.is_some() {
        "distance / *d*  [–]"
    } else {
        "distance  [m]"
    };
    let mut distance = panel(label, curves, &[0.0], 120.0);
    if scales.is_some() {
        distance.levels.push((1.0, "*D*_{r} = *d*".to_owned()));
    }
    let largest = tilt.iter().map(|p| p.1).fold(0.0, f64::max);
    let mut turn = panel(
        "tilt of the pair  [°]",
        vec![series(None, tilt, style::GREEN)],
        &[0.0, 90.0],
        70.0,
    );
    turn.y = Axis::degrees(&turn.y.label, 0.0, largest.max(90.0));
    turn.levels.push((90.0, "side by side".to_owned()));
    let unit_name = if scales.is_some() { "diameters" } else { "m" };
    let mut caption = format!(
        "(a) Distance D_{{r}} of the two centres, from {} {unit_name} at the start down to {} and {} at the end. \
         (b) Angle of the line from the grain that leads at the start to the one that trails, against the vertical: 0° one above the other, 90° side by side, more after they have changed roles.",
        short(first),
        short(closest.1),
        short(last)
    );
    let told = |moment| scene.story.moment_text(moment);
    for (text, when) in [
        ("They touch first at", scene.story.kiss.map(told)),
        ("The roles change at", scene.when(EventKind::RoleChange)),
        ("They part at", scene.story.parting.map(told)),
    ] {
        if let Some(when) = when {
            caption.push_str(&format!(" {text} {when}."));
        }
    }
    Some(Figure {
        name: "gap",
        title: "Gap between the grains".to_owned(),
        caption,
        drawing: stacked_panels(&scene.time(), &[distance, turn], &scene.marks()),
    })
}

fn surface_gap(scene: &Scene, unit: f64) -> Option<Points> {
    let table = scene.run.diagnostics.as_ref()?;
    let (_, factor) = scene.story.time_axis();
    let gap = ["surface_gap", "gap", "min_gap"]
        .iter()
        .find_map(|name| table.column(name))?;
    let points: Points = table
        .column("time")?
        .iter()
        .zip(gap)
        .map(|(t, g)| (t * factor, g / unit))
        .collect();
    points.iter().any(|p| p.1.is_finite()).then_some(points)
}

/// Settling and horizontal speed of both grains.
pub fn pair_velocity(scene: &Scene) -> Option<Figure> {
    let pair = scene.story.pair?;
    let up = scene.story.up;
    let unit = scene.story.scales.map_or(1.0, |s| s.velocity());
    let vertical = pair.map(|grain| scene.curve(grain, |h, row| h.velocity[row].dot(up) / unit));
    let across = pair.map(|grain| {
        scene.curve(grain, |h, row| {
            h.velocity[row].reject_from_normalized(up).length() / unit
        })
    });
    let fastest = vertical
        .iter()
        .map(|s| s.points.iter().map(|p| p.1).fold(0.0, f64::min))
        .collect::<Vec<_>>();
    let sideways = across
        .iter()
        .flat_map(|s| s.points.iter().map(|p| p.1))
        .fold(0.0, f64::max);
    let (v, h, of) = if scene.story.scales.is_some() {
        (
            "*v*_{z} / √(*d* *g*)  [–]",
            "|*v*_{h}| / √(*d* *g*)  [–]",
            " √(d g)",
        )
    } else {
        ("*v*_{z}  [m/s]", "|*v*_{h}|  [m/s]", " m/s")
    };
    let caption = format!(
        "(a) Vertical velocity of both grains (down is negative): the grain that trails at the start reaches {}{of}, the other {}{of}. (b) Horizontal speed, up to {}{of}.",
        short(fastest[0]),
        short(fastest[1]),
        short(sideways)
    );
    let panels = [
        panel(v, vertical.to_vec(), &[0.0], 110.0),
        panel(h, across.to_vec(), &[0.0], 65.0),
    ];
    Some(Figure {
        name: "velocity",
        title: "Velocity of the grains".to_owned(),
        caption,
        drawing: stacked_panels(&scene.time(), &panels, &scene.marks()),
    })
}

/// Speed of one grain: in m/s, against sqrt(d g), and as a Reynolds number.
pub fn single_velocity(scene: &Scene) -> Option<Figure> {
    let grain = *scene.moving().first()?;
    let up = scene.story.up;
    let plain = |value: &dyn Fn(&History, usize) -> f64| Series {
        name: None,
        ..scene.curve(grain, value)
    };
    let vertical = plain(&|h, row| h.velocity[row].dot(up));
    let peak = vertical
        .points
        .iter()
        .copied()
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    let mut caption = format!(
        "(a) Vertical velocity (down is negative); the largest is {} m/s at *t* = {} s.",
        short(peak.1),
        short(peak.0)
    );
    let mut panels = vec![panel("*v*_{z}  [m/s]", vec![vertical], &[0.0], 100.0)];
    if let Some(scales) = scene.story.scales {
        let unit = scales.velocity();
        panels.push(panel(
            "*v*_{z} / √(*d* *g*)  [–]",
            vec![plain(&|h, row| h.velocity[row].dot(up) / unit)],
            &[0.0],
            65.0,
        ));
        caption.push_str(" (b) The same over √(d g).");
    }
    if let (Some(diameter), Some(viscosity)) =
        (scene.run.facts.diameter(), scene.run.facts.viscosity)
    {
        let reynolds = plain(&|h, row| h.velocity[row].length() * diameter / viscosity);
        let highest = reynolds.points.iter().map(|p| p.1).fold(0.0, f64::max);
        panels.push(panel(
            "Re = |*v*| *d*/*ν*  [–]",
            vec![reynolds],
            &[0.0],
            65.0,
        ));
        caption.push_str(&format!(
            " ({}) Reynolds number, up to {}",
            char::from(b'a' + panels.len() as u8 - 1),
            short(highest)
        ));
        let ratio = scene
            .run
            .facts
            .grain_density()
            .zip(scene.run.facts.fluid_density)
            .map(|(grain, fluid)| grain / fluid);
        match scene.story.scales.zip(ratio) {
            Some((scales, ratio)) => caption.push_str(&format!(
                " (Galileo number {}).",
                short(galileo(scales, ratio, viscosity))
            )),
            None => caption.push('.'),
        }
    }
    Some(Figure {
        name: "velocity",
        title: "Velocity of the grain".to_owned(),
        caption,
        drawing: stacked_panels(&scene.time(), &panels, &scene.marks()),
    })
}
