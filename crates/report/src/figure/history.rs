//! Curves of the run as a whole: many grains coming to rest, diagnostics.

use super::curves::{Points, log_panel, panel, series};
use super::{AXES, Figure, Scene};
use crate::run_folder::History;
use crate::story::short;
use grainwake_plot::stacked::{Series, stacked_panels};
use grainwake_plot::style;

/// Mean height, speed and contacts of many grains.
pub fn many(scene: &Scene) -> Option<Figure> {
    let moving = scene.moving();
    let first = &scene.run.grains[*moving.first()?];
    let (_, factor) = scene.story.time_axis();
    let up = scene.story.up;
    let over = |value: &dyn Fn(&History, usize) -> f64| -> Points {
        (0..first.len())
            .map(|row| {
                let present: Vec<&History> = moving
                    .iter()
                    .map(|g| &scene.run.grains[*g])
                    .filter(|h| h.len() > row)
                    .collect();
                let sum: f64 = present.iter().map(|h| value(h, row)).sum();
                (first.time[row] * factor, sum / present.len() as f64)
            })
            .collect()
    };
    let speed = over(&|h, row| h.velocity[row].length_squared());
    let speed: Points = speed.into_iter().map(|(t, v)| (t, v.sqrt())).collect();
    let contacts = over(&|h, row| h.contacts[row]);
    let height = over(&|h, row| 1e3 * h.position[row].dot(up));
    let (last_speed, last_contacts) = (speed.last()?.1, contacts.last()?.1);
    let mut panels = vec![panel(
        "mean height  [mm]",
        vec![series(None, height, style::BLUE)],
        &[],
        70.0,
    )];
    panels.extend(log_panel(
        "rms speed  [m/s]",
        vec![series(None, speed, style::VERMILION)],
        80.0,
    ));
    let mut caption = format!(
        "(a) Mean height of the {} grains. (b) Root mean square of their speeds, {} m/s at the end.",
        moving.len(),
        short(last_speed)
    );
    if last_contacts.is_finite() {
        panels.push(panel(
            "contacts per grain  [–]",
            vec![series(None, contacts, style::GREEN)],
            &[0.0],
            70.0,
        ));
        caption.push_str(&format!(
            " (c) Mean number of contacts of a grain, {} at the end.",
            short(last_contacts)
        ));
    }
    Some(Figure {
        name: "history",
        title: "Coming to rest".to_owned(),
        caption,
        drawing: stacked_panels(&scene.time(), &panels, &[]),
    })
}

/// Most grains that are drawn one by one.
pub const FEW: usize = 12;

/// Height and vertical velocity of each of a few grains.
pub fn each(scene: &Scene) -> Option<Figure> {
    const DASHED: Option<&str> = Some("3.5 1.6");
    let moving = scene.moving();
    if moving.len() > FEW || !scene.story.travels {
        return None;
    }
    let up = scene.story.up;
    let curves = |value: &dyn Fn(&History, usize) -> f64| -> Vec<Series> {
        let one = |(n, grain): (usize, &usize)| Series {
            dash: DASHED.filter(|_| n >= style::SERIES_COLOURS),
            colour: style::series_colour(n),
            ..scene.curve(*grain, value)
        };
        moving.iter().enumerate().map(one).collect()
    };
    let fastest = |grain: &usize| {
        let speeds = scene.run.grains[*grain].velocity.iter().map(|v| -v.dot(up));
        speeds.max_by(|a, b| a.abs().total_cmp(&b.abs()))
    };
    let named: Vec<String> = moving
        .iter()
        .filter_map(|grain| Some(format!("{} of grain {grain}", short(fastest(grain)?))))
        .collect();
    let panels = [
        panel(
            "height  [mm]",
            curves(&|h, row| 1e3 * h.position[row].dot(up)),
            &[],
            110.0,
        ),
        panel(
            "*v*_{z}  [m/s]",
            curves(&|h, row| h.velocity[row].dot(up)),
            &[0.0],
            110.0,
        ),
    ];
    Some(Figure {
        name: "grains",
        title: "Height and velocity of each grain".to_owned(),
        caption: format!(
            "(a) Height of the centre of each grain. (b) Vertical velocity (down is negative); the largest settling speeds [m/s] are {}.",
            named.join(", ")
        ),
        drawing: stacked_panels(&scene.time(), &panels, &scene.marks()),
    })
}

/// Force of the fluid on a grain that is held or driven.
pub fn force(scene: &Scene) -> Option<Figure> {
    let driven = !scene.story.travels || scene.story.scales.is_none();
    let grain = scene.moving().first().copied().filter(|_| driven)?;
    let history = &scene.run.grains[grain];
    let (_, factor) = scene.story.time_axis();
    let part = |axis: usize| -> Points {
        let rows = 0..history.len();
        rows.map(|row| (history.time[row] * factor, history.force[row][axis]))
            .collect()
    };
    let curves: Vec<Series> = [style::BLUE, style::VERMILION, style::GREEN]
        .into_iter()
        .enumerate()
        .map(|(axis, colour)| series(Some(format!("*F*_{{{}}}", AXES[axis])), part(axis), colour))
        .collect();
    let any = curves
        .iter()
        .flat_map(|s| &s.points)
        .any(|p| p.1.is_finite() && p.1 != 0.0);
    let last = history.force.last().filter(|_| any)?;
    let caption = format!(
        "Force of the fluid on grain {grain}: ({}, {}, {}) N at the end.",
        short(last.x),
        short(last.y),
        short(last.z)
    );
    let panels = [panel("force  [N]", curves, &[0.0], 110.0)];
    Some(Figure {
        name: "force",
        title: "Force of the fluid".to_owned(),
        caption,
        drawing: stacked_panels(&scene.time(), &panels, &scene.marks()),
    })
}

/// What the method may break, against time.
pub fn diagnostics(scene: &Scene) -> Option<Figure> {
    let table = scene.run.diagnostics.as_ref()?;
    let time = table.column("time")?;
    let (_, factor) = scene.story.time_axis();
    let points = |names: &[&str]| -> Option<Points> {
        let column = names.iter().find_map(|name| table.column(name))?;
        let points: Points = time
            .iter()
            .zip(column)
            .map(|(t, v)| (t * factor, *v))
            .collect();
        points
            .iter()
            .any(|p| p.1.is_finite() && p.1 != 0.0)
            .then_some(points)
    };
    let peak = |points: &Points| {
        points
            .iter()
            .map(|p| p.1.abs())
            .filter(|v| v.is_finite())
            .fold(0.0, f64::max)
    };
    // The summary knows all steps, the table those that were written.
    let highest = |name: &str, points: &Points| {
        let of_all = scene
            .run
            .summary
            .as_ref()
            .and_then(|s| s.get(name)?.as_f64());
        of_all.unwrap_or(0.0).max(peak(points))
    };
    let mut panels = Vec::new();
    let mut parts = Vec::new();
    if let Some(divergence) = points(&["max_divergence", "divergence"]) {
        parts.push(format!(
            "largest divergence after projection, {} 1/s at most after any step",
            short(highest("max_divergence", &divergence))
        ));
        panels.extend(log_panel(
            "max |div *u*|  [1/s]",
            vec![series(None, divergence, style::BLUE)],
            65.0,
        ));
    }
    if let Some(cfl) = points(&["cfl"]) {
        parts.push(format!(
            "Courant number, {} at most in any step",
            short(highest("max_cfl", &cfl))
        ));
        panels.push(panel(
            "CFL  [–]",
            vec![series(None, cfl, style::INK)],
            &[0.0],
            60.0,
        ));
    }
    if let Some(residual) = points(&["momentum_residual"]) {
        let residual: Points = residual.into_iter().map(|(t, v)| (t, v.abs())).collect();
        parts.push(format!("momentum of fluid, grains and walls that a step leaves unaccounted for, as a fraction of the mass of the fluid times its largest velocity, {} at most in the rows of the table", short(peak(&residual))));
        panels.extend(log_panel(
            "residual  [–]",
            vec![series(None, residual, style::PURPLE)],
            65.0,
        ));
    }
    let energies: Vec<Series> = [
        ("fluid", "fluid_kinetic_energy", style::BLUE),
        ("grains", "grain_kinetic_energy", style::VERMILION),
    ]
    .into_iter()
    .filter_map(|(name, column, colour)| {
        Some(series(Some(name.to_owned()), points(&[column])?, colour))
    })
    .collect();
    if !energies.is_empty() {
        parts.push("kinetic energy".to_owned());
        panels.push(panel("energy  [J]", energies, &[0.0], 80.0));
    }
    if panels.is_empty() {
        return None;
    }
    let letters = parts
        .iter()
        .enumerate()
        .map(|(i, part)| format!("({}) {part}", char::from(b'a' + i as u8)));
    let caption = format!(
        "What the method may break: {}.",
        letters.collect::<Vec<_>>().join("; ")
    );
    Some(Figure {
        name: "diagnostics",
        title: "Diagnostics".to_owned(),
        caption,
        drawing: stacked_panels(&scene.time(), &panels, &[]),
    })
}
