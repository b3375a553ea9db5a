//! Curves against time: several or many grains, the force of the fluid, the diagnostics.

use grainwake_plot::stacked::{Panel, Series};
use grainwake_plot::{Figure, lettered, style};

use super::scene::{AXES, Points, Scene};
use crate::features::{ROUND_OFF, short};
use crate::run_folder::History;

/// Draws the mean height, speed and number of contacts of many grains.
pub fn many(scene: &Scene) -> Option<Figure> {
    let moving = scene.moving();
    // Grains that leave the box have shorter histories.
    let longest = moving.iter().map(|g| &scene.run.grains[*g]).max_by_key(|h| h.len())?;
    let (_, factor) = scene.features.time_axis();
    let mean = |value: &dyn Fn(&History, usize) -> f64| -> Points {
        let at = |row: usize| {
            let histories = moving.iter().map(|g| &scene.run.grains[*g]);
            let values = histories.filter(|h| h.len() > row).map(|h| value(h, row));
            let (sum, count) = values.fold((0.0, 0), |(sum, n), v| (sum + v, n + 1));
            (longest.time[row] * factor, sum / f64::from(count))
        };
        (0..longest.len()).map(at).collect()
    };
    let squares = mean(&|h, row| h.velocity[row].length_squared());
    let speed: Points = squares.into_iter().map(|(t, v)| (t, v.sqrt())).collect();
    let contacts = mean(&|h, row| h.contacts[row].map_or(f64::NAN, f64::from));
    let (unit, factor) = scene.height_unit();
    let height = mean(&|h, row| factor * scene.height(h.position[row]));
    let (last_speed, last_contacts) = (speed.last()?.1, contacts.last()?.1);
    let curve = |points, colour| vec![Series::new(points, colour)];
    let height = curve(height, style::BLUE);
    let around = scene.least_range(height.iter().flat_map(Series::values), factor);
    let label = format!("mean height  [{unit}]");
    let mut panels = vec![Panel::linear(&label, height, &around, 70.0)];
    let speed = curve(speed, style::VERMILION);
    panels.extend(Panel::log("rms speed  [m/s]", speed, 80.0));
    let mut caption = format!(
        "(a) Mean height of the {} grains. (b) Root mean square of their speeds, {} m/s at the \
         end.",
        moving.len(),
        short(last_speed)
    );
    if last_contacts.is_finite() {
        let contacts = curve(contacts, style::GREEN);
        // A count begins at 0, also if there are none.
        let highest = contacts.iter().flat_map(Series::values).fold(0.0, f64::max);
        let also = [0.0, if highest > 0.0 { 0.0 } else { 1.0 }];
        panels.push(Panel::linear("contacts per grain  [–]", contacts, &also, 70.0));
        let last = short(last_contacts);
        caption += &format!(" (c) Mean number of contacts of a grain, {last} at the end.");
    }
    Some(scene.without_events("history", "Height, speed and contacts", caption, &panels))
}

/// Largest number of grains that have curves of their own.
pub const FEW: usize = 12;

/// Draws the height and the vertical velocity of each of a few grains.
pub fn each(scene: &Scene) -> Option<Figure> {
    let moving = scene.moving();
    if moving.len() > FEW || !scene.features.travels {
        return None;
    }
    let up = scene.features.up;
    let curves = |value: &dyn Fn(&History, usize) -> f64| -> Vec<Series> {
        let one = |(n, grain): (usize, &usize)| Series {
            dash: (n >= style::SERIES_COLOURS).then_some("3.5 1.6"),
            colour: style::series_colour(n),
            ..scene.curve(*grain, value)
        };
        moving.iter().enumerate().map(one).collect()
    };
    let (unit, factor) = scene.height_unit();
    let height = curves(&|h, row| factor * scene.height(h.position[row]));
    let velocity = curves(&|h, row| h.velocity[row].dot(up));
    let peak = |(grain, curve): (&usize, &Series)| {
        Some(format!("{} of grain {grain}", short(curve.peak()?.1)))
    };
    let peaks: Vec<String> = moving.iter().zip(&velocity).filter_map(peak).collect();
    let around = scene.least_range(height.iter().flat_map(Series::values), factor);
    let symbol = scene.features.vertical_symbol();
    let panels = [
        Panel::linear(&format!("height  [{unit}]"), height, &around, 110.0),
        Panel::linear(&format!("{symbol}  [m/s]"), velocity, &[0.0], 110.0),
    ];
    let caption = format!(
        "(a) Height of the centre of each grain. (b) {}; the values of largest magnitude [m/s] \
         are {}.",
        scene.features.vertical_velocity(),
        peaks.join(", ")
    );
    let title = "Height and velocity of each grain";
    Some(scene.with_events("grains", title, caption, &panels))
}

/// Draws the force of the fluid on a held or driven grain.
pub fn force(scene: &Scene) -> Option<Figure> {
    let driven = !scene.features.travels || scene.features.scales.is_none();
    let grain = scene.moving().first().copied().filter(|_| driven)?;
    let history = &scene.run.grains[grain];
    let forces = history.force.iter().flatten().flat_map(|force| force.to_array());
    let largest = forces.filter(|f| f.is_finite()).map(f64::abs).fold(0.0, f64::max);
    // A component that is round-off of the others is zero.
    let shown = |f: f64| if f.abs() < ROUND_OFF * largest { 0.0 } else { f };
    let component = |(axis, colour): (usize, &'static str)| Series {
        name: Some(format!("*F*_{{{}}}", AXES[axis])),
        colour,
        ..scene.curve(grain, |h, row| h.force[row].map_or(f64::NAN, |force| shown(force[axis])))
    };
    let colours = [style::BLUE, style::VERMILION, style::GREEN];
    let curves: Vec<Series> = colours.into_iter().enumerate().map(component).collect();
    let known = |v: f64| v.is_finite() && v != 0.0;
    let known = curves.iter().flat_map(Series::values).any(known);
    let last = history.force.last().copied().flatten().filter(|_| known)?.to_array();
    let size = last.iter().fold(0.0, |size: f64, f| size.max(f.abs()));
    let last = last.map(|f| short(if f.abs() < ROUND_OFF * size { 0.0 } else { f }));
    let caption =
        format!("Force of the fluid on grain {grain}: ({}) N at the end.", last.join(", "));
    let panels = [Panel::linear("force  [N]", curves, &[0.0], 110.0)];
    Some(scene.with_events("force", "Force of the fluid", caption, &panels))
}

/// Draws the divergence, the CFL number, the residual of the momentum and the kinetic energy.
pub fn diagnostics(scene: &Scene) -> Option<Figure> {
    let points = |names: &[&str]| {
        let points = scene.diagnostic(names).filter(|points| points.len() > 1)?;
        let known = |p: &(f64, f64)| p.1.is_finite() && p.1 != 0.0;
        points.iter().any(known).then_some(points)
    };
    let peak = |points: &Points| {
        let sizes = points.iter().map(|p| p.1.abs());
        sizes.filter(|v| v.is_finite()).fold(0.0, f64::max)
    };
    // The summary covers all steps, the table only those with output.
    let highest = |name: &str, points: &Points| {
        let overall = scene.run.summary_number(name).unwrap_or(0.0);
        short(overall.max(peak(points)))
    };
    let mut panels = Vec::new();
    let mut sentences = Vec::new();
    if let Some(divergence) = points(&["max_divergence", "divergence"]) {
        sentences.push(format!(
            "Largest divergence after projection, at most {} 1/s after any step.",
            highest("max_divergence", &divergence)
        ));
        let curve = Series::new(divergence, style::BLUE);
        panels.extend(Panel::log("max |div *u*|  [1/s]", vec![curve], 65.0));
    }
    if let Some(cfl) = points(&["cfl"]) {
        let largest = highest("max_cfl", &cfl);
        sentences.push(format!("CFL number, at most {largest} in any step."));
        let curve = Series::new(cfl, style::INK);
        panels.push(Panel::linear("CFL  [–]", vec![curve], &[0.0], 60.0));
    }
    if let Some(residual) = points(&["momentum_residual"]) {
        let residual: Points = residual.into_iter().map(|(t, v)| (t, v.abs())).collect();
        sentences.push(format!(
            "Change of the momentum of fluid, grains and walls in a step that no force accounts \
             for, relative to the mass of the fluid times its largest velocity, at most {} in the \
             rows of the table; above round-off with free grains lighter than the fluid or a \
             refined box.",
            short(peak(&residual))
        ));
        let curve = Series::new(residual, style::PURPLE);
        panels.extend(Panel::log("residual  [–]", vec![curve], 65.0));
    }
    let fluid = ("fluid", "fluid_kinetic_energy", style::BLUE);
    let grains = ("grains", "grain_kinetic_energy", style::VERMILION);
    let energy = |(name, column, colour): (&str, &str, &'static str)| {
        Some(Series::new(points(&[column])?, colour).named(name))
    };
    let energies: Vec<Series> = [fluid, grains].into_iter().filter_map(energy).collect();
    if !energies.is_empty() {
        let names: Vec<&str> = energies.iter().filter_map(|e| e.name.as_deref()).collect();
        sentences.push(format!("Kinetic energy of the {}.", names.join(" and of the ")));
        panels.push(Panel::linear("energy  [J]", energies, &[0.0], 80.0));
    }
    if panels.is_empty() {
        return None;
    }
    let caption = lettered(&sentences);
    Some(scene.without_events("diagnostics", "Diagnostics", caption, &panels))
}
