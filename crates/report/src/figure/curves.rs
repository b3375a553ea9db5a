//! Curves against time: distance and velocities of a pair, velocity of a single grain.

use grainwake_formats::events::EventKind;
use grainwake_plot::axis::Axis;
use grainwake_plot::stacked::{Panel, Series};
use grainwake_plot::style;
use grainwake_plot::{Figure, lettered};

use super::scene::Scene;
use crate::features::{galileo, short};
use crate::run_folder::History;

/// Draws the distance of the pair against time, and the tilt of the line of centres.
pub fn gap(scene: &Scene) -> Option<Figure> {
    let features = scene.features;
    let scaled = features.scales.is_some();
    let unit = features.scales.map_or(1.0, |s| s.diameter);
    let centres = scene.pair_curve(|r| r.length() / unit)?;
    let tilt = scene.pair_curve(|r| r.angle_between(features.back).to_degrees())?;
    let closest = centres.iter().map(|p| p.1).min_by(f64::total_cmp)?;
    let (first, last) = (centres.first()?.1, centres.last()?.1);
    let mut curves = vec![Series::new(centres, style::INK).named("centres, *D*_{r}")];
    let surfaces = scene.diagnostic(&["surface_gap", "gap", "min_gap"]);
    if let Some(surfaces) = surfaces.filter(|gap| gap.iter().any(|p| p.1.is_finite())) {
        let points = surfaces.into_iter().map(|(time, gap)| (time, gap / unit)).collect();
        let curve = Series::new(points, style::BLUE).named("surfaces");
        curves.push(curve.dashed("4 1.5"));
    }
    let left = scene.run.events.iter().find(|event| event.kind == EventKind::Left);
    let end = left.and_then(|event| event.grains.first());
    let end = end.map_or("at the end".to_owned(), |n| format!("when grain {n} leaves the box"));
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
        "(a) Distance D_{{r}} of the two centres: {} {unit} at the start, at least {}, and {} \
         {end}. (b) Angle between {} and the line from the grain that leads at the start to the \
         one that trails: 0° one behind the other, 90° side by side, larger after a role change.",
        short(first),
        short(closest),
        short(last),
        if features.has_gravity { "the vertical" } else { "the mean direction of motion" }
    );
    let role_change = scene.run.events.iter().find(|event| event.kind == EventKind::RoleChange);
    for (text, time) in [
        ("First contact at", features.kiss.map(|kiss| features.pair_event_text(kiss))),
        ("Role change at", role_change.map(|event| features.time_text(event.time))),
        (
            "Separation at",
            features.separation.map(|separation| features.pair_event_text(separation)),
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
    let [trailing, leading] =
        vertical.each_ref().map(|curve| short(curve.peak().map_or(0.0, |peak| peak.1)));
    let sideways = horizontal.iter().flat_map(Series::values).fold(0.0, f64::max);
    let symbol = scene.features.vertical_symbol();
    let (v, h, unit) = match scene.features.scales {
        Some(_) => {
            (format!("{symbol} / √(*d* *g*)  [–]"), "|*v*_{h}| / √(*d* *g*)  [–]", " √(d g)")
        }
        None => (format!("{symbol}  [m/s]"), "|*v*_{h}|  [m/s]", " m/s"),
    };
    let caption = format!(
        "(a) {} of both grains: the grain that trails at the start reaches {trailing}{unit}, the \
         other {leading}{unit}. (b) {}, up to {}{unit}.",
        scene.features.vertical_velocity(),
        scene.features.horizontal_speed(),
        short(sideways)
    );
    let panels = [
        Panel::linear(&v, vertical.to_vec(), &[0.0], 110.0),
        Panel::linear(h, horizontal.to_vec(), &[0.0], 65.0),
    ];
    Some(scene.with_events("velocity", "Velocity of the grains", caption, &panels))
}

/// Part of the largest speed below which a component of the velocity is round-off.
const ROUND_OFF: f64 = 1e-6;
/// Part of the largest speed above which a horizontal motion is drawn.
const SIDEWAYS: f64 = 0.05;

/// Draws the velocity of one grain in m/s, relative to sqrt(d g), and as a Reynolds number.
pub fn single_velocity(scene: &Scene) -> Option<Figure> {
    let grain = *scene.moving().first()?;
    let (up, facts) = (scene.features.up, &scene.run.facts);
    let curve =
        |value: &dyn Fn(&History, usize) -> f64| Series { name: None, ..scene.curve(grain, value) };
    let vertical = curve(&|h, row| h.velocity[row].dot(up));
    let horizontal = curve(&|h, row| h.velocity[row].reject_from_normalized(up).length());
    let (peak, sideways) = (vertical.peak()?, horizontal.peak()?);
    let fastest = peak.1.abs().max(sideways.1);
    let mut panels = Vec::new();
    let mut sentences = Vec::new();
    if peak.1.abs() >= ROUND_OFF * fastest {
        sentences.push(format!(
            "{}; the largest is {} m/s at *t* = {} s.",
            scene.features.vertical_velocity(),
            short(peak.1),
            short(peak.0)
        ));
        let symbol = scene.features.vertical_symbol();
        panels.push(Panel::linear(&format!("{symbol}  [m/s]"), vec![vertical], &[0.0], 100.0));
        if let Some(scales) = scene.features.scales {
            let scaled = curve(&|h, row| h.velocity[row].dot(up) / scales.velocity());
            let label = format!("{symbol} / √(*d* *g*)  [–]");
            panels.push(Panel::linear(&label, vec![scaled], &[0.0], 65.0));
            sentences.push("Vertical velocity divided by √(d g).".to_owned());
        }
    }
    if sideways.1 > SIDEWAYS * fastest {
        let name = scene.features.horizontal_speed();
        sentences.push(format!("{name}, up to {} m/s.", short(sideways.1)));
        panels.push(Panel::linear("|*v*_{h}|  [m/s]", vec![horizontal], &[0.0], 65.0));
    }
    let fluid = facts.viscosity.filter(|_| facts.inflow.is_some());
    if let (Some(diameter), Some(viscosity)) = (facts.diameter(), fluid) {
        let speed = |h: &History, row: usize| facts.relative_speed(h.velocity[row]);
        let number = |speed: f64| speed * diameter / viscosity;
        let reynolds = curve(&|h, row| speed(h, row).map_or(f64::NAN, number));
        let highest = short(reynolds.values().fold(0.0, f64::max));
        let label = format!("Re = {} *d*/*ν*  [–]", facts.relative_speed_symbol());
        panels.push(Panel::linear(&label, vec![reynolds], &[0.0], 65.0));
        let number = scene.features.scales.zip(facts.density_ratio());
        let galileo = number.map_or(String::new(), |(scales, ratio)| {
            format!(" (Galileo number {})", short(galileo(scales, ratio, viscosity)))
        });
        let relative = if facts.has_inflow() { " of the speed relative to the inflow" } else { "" };
        sentences.push(format!("Reynolds number{relative}, up to {highest}{galileo}."));
    }
    let caption = lettered(&sentences);
    Some(scene.with_events("velocity", "Velocity of the grain", caption, &panels))
}
