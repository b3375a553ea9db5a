//! `[[poses]]` -> raw grains.

use std::collections::BTreeSet;
use std::path::Path;

use glam::DVec3;

use super::check::Checker;
use super::grains::{Grains, not_too_light, shape};
use super::packings::MOST_GRAINS;
use crate::RESOLVED;
use crate::case::located::{Located, Span};
use crate::case::quantity::{Quantity, Triple};
use crate::case::raw::{MotionLaw, Orientation, Position, RawCase, RawGrain, RawPoses, Turns};
use crate::case::source::Source;
use crate::number_format::{number_of_grains, quantity};
use grainwake_formats::bounded_file::{SETTINGS, read_text};
use grainwake_formats::poses::{Origin, Pose, Poses, read};
use grainwake_formats::{grains as grains_table, summary};
use grainwake_solver::dem::{ContactLawKind, Enclosure};

/// Returns the grains of a table as raw grains; `None` after a problem.
pub(super) fn poses(
    check: &mut Checker,
    grains: &mut Grains,
    raw: &Located<RawPoses>,
    enclosure: &Enclosure,
    law: ContactLawKind,
    fluid_density: Option<f64>,
) -> Option<Vec<Located<RawGrain>>> {
    let (table, grain_of) = match (&raw.run, &raw.file) {
        (Some(run), None) => of_run(check, grains, raw, run)?,
        (None, Some(file)) => of_file(check, grains, raw, file)?,
        (Some(_), Some(file)) => {
            return check.refuse(&file.span, "both run and file are given", "keep one of them");
        }
        (None, None) => {
            let help = "add run = \"../../runs/heap\" or file = \"heap.csv\"";
            return check.refuse(&raw.span, "there is no table of poses", help);
        }
    };
    if table.poses.len() > MOST_GRAINS {
        let message = format!("{} grains are too many", table.poses.len());
        return check.refuse(&raw.span, message, format!("at most {MOST_GRAINS} grains"));
    }
    let mut placed = Vec::with_capacity(table.poses.len());
    let mut densities = BTreeSet::new();
    for pose in &table.poses {
        let mut grain = grain_of(check, pose)?;
        if law == ContactLawKind::Linear {
            (grain.youngs_modulus, grain.poisson_ratio, grain.restitution) = (None, None, None);
        }
        let position = enclosure.wrap(pose.position + raw.offset.si);
        grain.position = Some(Position(position.to_array().to_vec()).into());
        grain.orientation = Orientation::Quaternion(pose.orientation).into();
        grain.rotate = Turns::default();
        grain.gap_above = None;
        if let Some(motion) = &raw.motion {
            grain.motion = motion.clone();
        }
        // A prescribed motion decides the velocity at the start.
        let velocity = if raw.velocities.value { pose.velocity } else { DVec3::ZERO };
        let spin = if raw.velocities.value { pose.angular_velocity } else { DVec3::ZERO };
        let free = grain.motion.velocity == MotionLaw::Free;
        grain.velocity = free.then(|| Triple::new(velocity).into());
        let free = grain.motion.angular_velocity == MotionLaw::Free;
        grain.angular_velocity = free.then(|| Triple::new(spin).into());
        let grain = Located::at(grain, raw.span.clone());
        // The first grain whose shape is refused ends the list.
        shape(check, &mut grains.library, &grain, &mut grain.value.clone())?;
        let moves = grain.motion.velocity == MotionLaw::Free;
        if moves && densities.insert(grain.density.si.to_bits()) {
            not_too_light(check, &grain.density, fluid_density);
        }
        placed.push(grain);
    }
    Some(placed)
}

/// Function that returns a grain without its pose.
type GrainOf<'a> = Box<dyn Fn(&mut Checker, &Pose) -> Option<RawGrain> + 'a>;

/// Reads the poses and grains of a run.
fn of_run<'a>(
    check: &mut Checker,
    grains: &Grains,
    raw: &'a Located<RawPoses>,
    run: &'a Located<String>,
) -> Option<(Poses, GrainOf<'a>)> {
    let own = [
        (!raw.files.is_empty(), "files"),
        (!raw.shapes.is_empty(), "shapes"),
        (raw.nodes.is_some(), "nodes"),
        (raw.equivalent_diameter.is_some(), "equivalent_diameter"),
    ];
    if let Some((_, key)) = own.into_iter().find(|(given, _)| *given) {
        let message = format!("the run gives the shapes of its grains, and so does `{key}`");
        let help = format!(
            "leave out `{key}`, or take the table with file = \"{}/grains.csv\"",
            run.value
        );
        return check.refuse(&run.span, message, help);
    }
    let folder = grains.library.path(&run.value);
    let path = folder.join(RESOLVED);
    let help = "give the folder of a run, relative to the case file";
    let text = match read_text(&path, SETTINGS) {
        Ok(text) => text,
        Err(error) => {
            let message = match error.kind() {
                std::io::ErrorKind::NotFound => format!("there is no run in {}", folder.display()),
                _ => format!("cannot read {}: {error}", path.display()),
            };
            return check.refuse(&run.span, message, help);
        }
    };
    let parsed = Source::parse::<RawCase>(&path.display().to_string(), &text, &[]);
    let case = match parsed {
        Ok((_, case)) => case,
        Err(problem) => {
            let message = format!("the case of the run cannot be read: {problem}");
            return check.refuse(&run.span, message, help);
        }
    };
    let path = folder.join(grains_table::FILE);
    let table = read_table(check, raw, &path, Origin::Run, &run.span)?;
    let finished = folder.join(summary::FILE).is_file();
    if !finished && raw.time.is_none() && table.rows_before.is_some_and(|n| n > table.poses.len()) {
        let time = quantity(table.time.unwrap_or(0.0), "s");
        let message = format!(
            "the rows at {time} are incomplete: the run has not finished, and they give {} of {}",
            table.poses.len(),
            number_of_grains(table.rows_before.unwrap_or(0))
        );
        return check.refuse(&run.span, message, "continue the run, or give an earlier `time`");
    }
    let grain_of = move |check: &mut Checker, pose: &Pose| {
        let Some(grain) = case.grain.get(pose.grain) else {
            let (file, count) = (grains_table::FILE, number_of_grains(case.grain.len()));
            let message = format!("{file} has grain {}, but its run has {count}", pose.grain);
            return check.refuse(&run.span, message, "the folder is damaged: run its case again");
        };
        let mut grain = moved(&grain.value, &run.span);
        if let Some(file) = &mut grain.file {
            // The grain files of a run lie in its folder.
            file.value = Path::new(&run.value).join(&file.value).to_string_lossy().into_owned();
        }
        if let Some(density) = &raw.density {
            grain.density = density.clone();
        }
        Some(grain)
    };
    Some((table, Box::new(grain_of)))
}

/// Reads the poses of a table; shapes and densities are those of the case, in turn.
fn of_file<'a>(
    check: &mut Checker,
    grains: &Grains,
    raw: &'a Located<RawPoses>,
    file: &'a Located<String>,
) -> Option<(Poses, GrainOf<'a>)> {
    if raw.files.is_empty() && raw.shapes.is_empty() {
        let help = "add files = [...] or shapes = [...], or name the run with run = ...";
        return check.refuse(&raw.span, "the grains of the table have no shape", help);
    }
    let path = grains.library.path(&file.value);
    let table = read_table(check, raw, &path, Origin::Own, &file.span)?;
    let grain_of = move |check: &mut Checker, pose: &Pose| {
        let files = raw.files.len();
        let kind = pose.grain % (files + raw.shapes.len());
        let of_file = || file.span.clone();
        let density = pose.density.map(|value| Located::at(Quantity::new(value), of_file()));
        let Some(density) = density.or_else(|| raw.density.clone()) else {
            let help = "add density = ..., or a column density to the table";
            return check.refuse(&raw.span, "the grains of the table have no density", help);
        };
        let diameter = pose.equivalent_diameter;
        let diameter = diameter.map(|value| Located::at(Quantity::new(value), of_file()));
        let mut grain = RawGrain {
            density,
            file: raw.files.get(kind).cloned(),
            equivalent_diameter: diameter.or_else(|| raw.equivalent_diameter.clone()),
            ..RawGrain::default()
        };
        if kind >= files {
            grain.shape = Some(raw.shapes[kind - files].clone());
            grain.nodes = raw.nodes.clone();
        }
        Some(grain)
    };
    Some((table, Box::new(grain_of)))
}

fn read_table(
    check: &mut Checker,
    raw: &RawPoses,
    path: &Path,
    origin: Origin,
    span: &Span,
) -> Option<Poses> {
    let at = raw.time.as_ref().map(|time| time.si);
    match read(path, origin, at) {
        Ok(table) if raw.velocities.value && !table.has_velocities => {
            let message = format!("{} has no velocities", path.display());
            let help = "add the columns vx, vy, vz or wx, wy, wz, or leave out `velocities`";
            check.refuse(&raw.velocities.span, message, help)
        }
        Ok(table) => Some(table),
        Err(error) => {
            let span = raw.time.as_ref().map_or(span, |time| &time.span);
            let help = "a table has the columns x, y, z and may have those of grains.csv; paths \
                        are relative to the case file";
            check.refuse(span, error.to_string(), help)
        }
    }
}

/// Returns a grain of another case, whose values are at `span` in this one.
fn moved(grain: &RawGrain, span: &Span) -> RawGrain {
    fn at<T: Clone>(value: &Located<T>, span: &Span) -> Located<T> {
        Located::at(value.value.clone(), span.clone())
    }
    fn given<T: Clone>(value: &Option<Located<T>>, span: &Span) -> Option<Located<T>> {
        value.as_ref().map(|value| at(value, span))
    }
    RawGrain {
        file: given(&grain.file, span),
        shape: given(&grain.shape, span),
        equivalent_diameter: given(&grain.equivalent_diameter, span),
        nodes: given(&grain.nodes, span),
        density: at(&grain.density, span),
        youngs_modulus: given(&grain.youngs_modulus, span),
        poisson_ratio: given(&grain.poisson_ratio, span),
        restitution: given(&grain.restitution, span),
        motion: at(&grain.motion, span),
        ..RawGrain::default()
    }
}
