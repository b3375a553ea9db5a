//! Curves against time: distance and velocities of a pair, velocity of a single grain.

use glam::DVec3;
use grainwake_plot::axis::Axis;
use grainwake_plot::stacked::{Panel, Series, VerticalMark, stacked_panels};
use grainwake_plot::style::{self, series_colour};
use grainwake_plot::{Figure, letter};

use super::Scene;
use crate::features::{galileo, short};
use crate::run_folder::{History, Kind};

/// Points of a curve.
pub type Points = Vec<(f64, f64)>;

impl Scene<'_> {
    /// Returns the time axis of all curves.
    fn time(&self) -> Axis {
        let (label, factor) = self.features.time_axis();
        Axis::linear(label, 0.0, self.features.end * factor, 6, true)
    }

    /// Returns the events as marks on the time axis.
    fn marks(&self) -> Vec<VerticalMark> {
        let (_, factor) = self.features.time_axis();
        let shown = |kind: &Kind| !matches!(kind, Kind::Other(_));
        let events = self.run.events.iter().filter(|event| shown(&event.kind));
        let mark = events.map(|event| VerticalMark {
            at: event.time * factor,
            name: event.kind.name().to_owned(),
        });
        mark.collect()
    }

    /// Draws panels against time with the events marked.
    pub fn with_events(
        &self,
        name: &str,
        title: &str,
        caption: String,
        panels: &[Panel],
    ) -> Figure {
        let drawing = stacked_panels(&self.time(), panels, &self.marks());
        Figure::new(name, title, caption, drawing)
    }

    /// Draws panels against time.
    pub fn without_events(
        &self,
        name: &str,
        title: &str,
        caption: String,
        panels: &[Panel],
    ) -> Figure {
        Figure::new(
            name,
            title,
            caption,
            stacked_panels(&self.time(), panels, &[]),
        )
    }

    /// Returns a curve of a grain against time.
    pub fn curve(&self, grain: usize, value: impl Fn(&History, usize) -> f64) -> Series {
        let (_, factor) = self.features.time_axis();
        let history = &self.run.grains[grain];
        let point = |row: usize| (history.time[row] * factor, value(history, row));
        let colour = series_colour(self.features.grain_rank(grain));
        let points = (0..history.len()).map(point).collect();
        Series::new(points, colour).named(self.features.grain_name(grain))
    }

    /// Returns two columns of the diagnostics as points against time: the first column found.
    pub fn diagnostic(&self, names: &[&str]) -> Option<Points> {
        let table = self.run.diagnostics.as_ref()?;
        let (_, factor) = self.features.time_axis();
        let column = names.iter().find_map(|name| table.column(name))?;
        let rows = table.column("time")?.iter().zip(column);
        Some(rows.map(|(time, value)| (time * factor, *value)).collect())
    }

    /// Returns the grains with a history; of a pair, the trailing one first.
    pub fn moving(&self) -> Vec<usize> {
        let pair = self.features.pair;
        pair.map_or_else(|| self.run.moving(), |pair| pair.to_vec())
    }

    /// Returns a function of the line of centres of the pair against time.
    fn pair_curve(&self, value: impl Fn(DVec3) -> f64) -> Option<Points> {
        let [a, b] = self.features.pair?.map(|grain| &self.run.grains[grain]);
        let (_, factor) = self.features.time_axis();
        let rows = (0..a.len().min(b.len())).filter(|row| a.time[*row] == b.time[*row]);
        let line = |row: usize| self.run.nearest(a.position[row] - b.position[row]);
        let points = rows.map(|row| (a.time[row] * factor, value(line(row))));
        Some(points.collect())
    }
}

/// Draws the distance of the pair against time, and the tilt of the line of centres.
pub fn gap(scene: &Scene) -> Option<Figure> {
    let features = scene.features;
    let scaled = features.scales.is_some();
    let unit = features.scales.map_or(1.0, |s| s.diameter);
    let centres = scene.pair_curve(|r| r.length() / unit)?;
    let tilt = scene.pair_curve(|r| r.angle_between(features.up).to_degrees())?;
    let closest = centres.iter().map(|p| p.1).min_by(f64::total_cmp)?;
    let (first, last) = (centres.first()?.1, centres.last()?.1);
    let mut curves = vec![Series::new(centres, style::INK).named("centres, *D*_{r}")];
    let surfaces = scene.diagnostic(&["surface_gap", "gap", "min_gap"]);
    if let Some(surfaces) = surfaces.filter(|gap| gap.iter().any(|p| p.1.is_finite())) {
        let points = surfaces
            .into_iter()
            .map(|(time, gap)| (time, gap / unit))
            .collect();
        let curve = Series::new(points, style::BLUE).named("surfaces");
        curves.push(curve.dashed("4 1.5"));
    }
    let (label, unit) = match scaled {
        true => ("distance / *d*  [–]", "diameters"),
        false => ("distance  [m]", "m"),
    };
    let mut distance = Panel::linear(label, curves, &[0.0], 120.0);
    if scaled {
        distance.levels.push((1.0, "*D*_{r} = *d*".to_owned()));
    }
    let largest = tilt.iter().map(|p| p.1).fold(90.0, f64::max);
    let axis = Axis::degrees("tilt of the pair  [°]", 0.0, largest);
    let mut angle = Panel::with_axis(axis, vec![Series::new(tilt, style::GREEN)], 70.0);
    angle.levels.push((90.0, "side by side".to_owned()));
    let mut caption = format!(
        "(a) Distance D_{{r}} of the two centres: {} {unit} at the start, at least {}, and {} at \
         the end. (b) Angle between the vertical and the line from the grain that leads at the \
         start to the one that trails: 0° one above the other, 90° side by side, larger after a \
         role change.",
        short(first),
        short(closest),
        short(last)
    );
    let role_change = scene
        .run
        .events
        .iter()
        .find(|event| event.kind == Kind::RoleChange);
    for (text, time) in [
        (
            "First contact at",
            features.kiss.map(|kiss| features.pair_event_text(kiss)),
        ),
        (
            "Role change at",
            role_change.map(|event| features.time_text(event.time)),
        ),
        (
            "Separation at",
            features
                .separation
                .map(|separation| features.pair_event_text(separation)),
        ),
    ] {
        if let Some(time) = time {
            caption += &format!(" {text} {time}.");
        }
    }
    Some(scene.with_events("gap", "Gap between the grains", caption, &[distance, angle]))
}

/// Draws the vertical and the horizontal velocity of both grains of a pair.
pub fn pair_velocity(scene: &Scene) -> Option<Figure> {
    let pair = scene.features.pair?;
    let up = scene.features.up;
    let unit = scene.features.scales.map_or(1.0, |s| s.velocity());
    let vertical = pair.map(|grain| scene.curve(grain, |h, row| h.velocity[row].dot(up) / unit));
    let speed = |h: &History, row: usize| h.velocity[row].reject_from_normalized(up).length();
    let horizontal = pair.map(|grain| scene.curve(grain, |h, row| speed(h, row) / unit));
    let fastest = vertical
        .each_ref()
        .map(|curve| curve.values().fold(0.0, f64::min));
    let sideways = horizontal
        .iter()
        .flat_map(Series::values)
        .fold(0.0, f64::max);
    let (v, h, unit) = match scene.features.scales {
        Some(_) => (
            "*v*_{z} / √(*d* *g*)  [–]",
            "|*v*_{h}| / √(*d* *g*)  [–]",
            " √(d g)",
        ),
        None => ("*v*_{z}  [m/s]", "|*v*_{h}|  [m/s]", " m/s"),
    };
    let caption = format!(
        "(a) Vertical velocity of both grains (down is negative): the grain that trails at the \
         start reaches {}{unit}, the other {}{unit}. (b) Horizontal speed, up to {}{unit}.",
        short(fastest[0]),
        short(fastest[1]),
        short(sideways)
    );
    let panels = [
        Panel::linear(v, vertical.to_vec(), &[0.0], 110.0),
        Panel::linear(h, horizontal.to_vec(), &[0.0], 65.0),
    ];
    Some(scene.with_events("velocity", "Velocity of the grains", caption, &panels))
}

/// Draws the velocity of one grain in m/s, relative to sqrt(d g), and as a Reynolds number.
pub fn single_velocity(scene: &Scene) -> Option<Figure> {
    let grain = *scene.moving().first()?;
    let (up, facts) = (scene.features.up, &scene.run.facts);
    let curve = |value: &dyn Fn(&History, usize) -> f64| Series {
        name: None,
        ..scene.curve(grain, value)
    };
    let vertical = curve(&|h, row| h.velocity[row].dot(up));
    let points = vertical.points.iter().copied();
    let peak = points.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let mut caption = format!(
        "(a) Vertical velocity (down is negative); the largest is {} m/s at *t* = {} s.",
        short(peak.1),
        short(peak.0)
    );
    let mut panels = vec![Panel::linear(
        "*v*_{z}  [m/s]",
        vec![vertical],
        &[0.0],
        100.0,
    )];
    if let Some(scales) = scene.features.scales {
        let scaled = curve(&|h, row| h.velocity[row].dot(up) / scales.velocity());
        let label = "*v*_{z} / √(*d* *g*)  [–]";
        panels.push(Panel::linear(label, vec![scaled], &[0.0], 65.0));
        caption += " (b) Vertical velocity divided by √(d g).";
    }
    if let (Some(diameter), Some(viscosity)) = (facts.diameter(), facts.viscosity) {
        let reynolds = curve(&|h, row| h.velocity[row].length() * diameter / viscosity);
        let highest = short(reynolds.values().fold(0.0, f64::max));
        caption += &format!(" {} Reynolds number, up to {highest}", letter(panels.len()));
        let label = "Re = |*v*| *d*/*ν*  [–]";
        panels.push(Panel::linear(label, vec![reynolds], &[0.0], 65.0));
        caption += &match scene.features.scales.zip(facts.density_ratio()) {
            Some((scales, ratio)) => {
                format!(
                    " (Galileo number {}).",
                    short(galileo(scales, ratio, viscosity))
                )
            }
            None => ".".to_owned(),
        };
    }
    Some(scene.with_events("velocity", "Velocity of the grain", caption, &panels))
}
