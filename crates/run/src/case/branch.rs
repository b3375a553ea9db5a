//! A case that continues the run of another case: what may differ, and what may not.

use std::path::Path;

use glam::DVec3;

use super::error::{CaseError, Problem};
use super::quantity::{Time, parse_quantity};
use super::{Case, Source};
use crate::number_format::{number_of_grains, quantity, vector};
use crate::{Parent, RESOLVED, RunError};
use grainwake_solver::dem::{Grain, MotionConstraint};

/// Number of grains whose differences are listed.
const LISTED: usize = 3;
/// Advice for a difference in what a checkpoint fixes.
const AS_BEFORE: &str = "the checkpoint fixes the grid, the sides of the box, the precision, and \
    number, shape and nodes of the grains; leave these as they are in the parent's \
    case.resolved.toml, or place the grains of the parent in a new run with [[poses]]";
/// Advice for another state at the start.
const FROM_CHECKPOINT: &str = "the state at the start comes from the checkpoint, so this would have \
    no effect; leave it as it is in the parent's case.resolved.toml";

/// Finds the checkpoint of a run that `text` names: "DIR" or "DIR@TIME", with the meaning of
/// [`Parent::find`].
///
/// # Errors
/// Those of [`Parent::find`], and [`RunError::NoParent`] if the time cannot be read.
pub fn find_parent(text: &str, note: &mut dyn FnMut(&str)) -> Result<Parent, RunError> {
    // The name of a folder may contain the sign.
    let parts = text.rsplit_once('@').filter(|_| !Path::new(text).is_dir());
    let (folder, time) = parts.map_or((text, None), |(folder, time)| (folder, Some(time)));
    let time = time.map(parse_quantity::<Time>).transpose();
    let time = time.map_err(|message| RunError::NoParent {
        what: format!("--from {text}: {message}"),
        remedy: "write DIR@TIME, for example runs/heap@0.5".into(),
    })?;
    Parent::find(Path::new(folder), time, note)
}

impl Case {
    /// Checks that a run of this case can start from the checkpoint of a run.
    ///
    /// Friction and other parameters of contact and fluid, gravity, densities, prescribed motions,
    /// time step, end and outputs may differ.
    ///
    /// # Errors
    /// [`CaseError`] with every difference that the checkpoint does not allow.
    pub fn check_parent(&self, parent: &Parent) -> Result<(), CaseError> {
        let before = Case::load(&parent.folder().join(RESOLVED), &[])?;
        let mut found = Differences { source: &self.source, problems: Vec::new() };
        found.of_box(self, &before);
        found.of_grains(&self.setup.grains, &before.setup.grains);
        found.of_initial_flow(self, &before);
        if self.plan.end <= parent.time() {
            let message = format!(
                "the run ends at {}, and the checkpoint is at {}",
                quantity(self.plan.end, "s"),
                quantity(parent.time(), "s")
            );
            let help = "times go on from the checkpoint: give a later end";
            found.report(&["time.end"], message, help);
        }
        if found.problems.is_empty() { Ok(()) } else { Err(CaseError::Invalid(found.problems)) }
    }
}

/// Collector of the differences that a checkpoint does not allow.
struct Differences<'a> {
    source: &'a Source,
    problems: Vec<Problem>,
}

impl Differences<'_> {
    /// Reports a problem at the first of `keys` that the file gives.
    fn report(&mut self, keys: &[&str], message: impl Into<String>, help: &str) {
        let place = keys.iter().find_map(|key| self.source.value_of(key));
        let problem = Problem::new(message).help(help);
        let located = match place {
            Some(_) => self.source.locate(problem, place, "here"),
            None => problem.key(keys.first().copied().unwrap_or_default()),
        };
        self.problems.push(located);
    }

    fn of_box(&mut self, now: &Case, before: &Case) {
        let (now, before) = (&now.setup, &before.setup);
        if now.fluid.is_some() != before.fluid.is_some() {
            let which = |wet: bool| if wet { "wet" } else { "dry" };
            let (now, before) = (which(now.fluid.is_some()), which(before.fluid.is_some()));
            let message = format!("the case is {now} and the parent run is {before}");
            return self.report(&["fluid", "domain"], message, AS_BEFORE);
        }
        let wet = now.fluid.is_some();
        let (mesh, old) = (&now.mesh, &before.mesh);
        if mesh.cells != old.cells || mesh.spacing != old.spacing {
            let size = |mesh: &grainwake_solver::grid::Mesh| {
                let [x, y, z] = mesh.cells;
                let cells = if wet { format!(" in {x} x {y} x {z} cells") } else { String::new() };
                format!("{}{cells}", vector(mesh.extent(), "m"))
            };
            let message =
                format!("the box is {}, and that of the parent run is {}", size(mesh), size(old));
            let keys = ["domain.cell_size", "domain.cells", "domain.size", "domain"];
            self.report(&keys, message, AS_BEFORE);
        }
        if now.refinement != before.refinement {
            let (here, there) = (now.refinement, before.refinement);
            let message =
                format!("the refinement is {here}, and that of the parent run is {there}");
            self.report(&["domain.refinement", "domain"], message, AS_BEFORE);
        }
        if mesh.origin != old.origin {
            let (here, there) = (vector(mesh.origin, "m"), vector(old.origin, "m"));
            let message =
                format!("the box begins at {here}, and that of the parent run at {there}");
            self.report(&["domain.origin", "domain"], message, AS_BEFORE);
        }
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let sides = [now, before].map(|setup| setup.boundaries.0[axis]);
            let [here, there] = sides.map(|sides| sides.map(|side| std::mem::discriminant(&side)));
            if here != there {
                let message = format!(
                    "the sides normal to {name} are of another kind than in the parent run"
                );
                let key = format!("domain.boundaries.{name}");
                self.report(&[&key, "domain.boundaries", "domain"], message, AS_BEFORE);
            }
        }
        if wet && now.precision != before.precision {
            let message = "the precision is not that of the parent run";
            self.report(&["run.precision"], message, AS_BEFORE);
        }
    }

    fn of_grains(&mut self, now: &[Grain], before: &[Grain]) {
        if now.len() != before.len() {
            let [now, before] = [now, before].map(|grains| number_of_grains(grains.len()));
            let message = format!("the case has {now}, and the parent run has {before}");
            return self.report(&["packing", "grain", "domain"], message, AS_BEFORE);
        }
        let pairs = || now.iter().zip(before).enumerate();
        for aspect in ASPECTS {
            let mut other = pairs().filter(|(_, (now, before))| !(aspect.same)(now, before));
            let help = if aspect.of_shape { AS_BEFORE } else { FROM_CHECKPOINT };
            for (index, _) in other.by_ref().take(LISTED) {
                let message =
                    format!("grain {index} has another {} than in the parent run", aspect.name);
                let of_grain = |key: &&str| format!("grain.{index}.{key}");
                let mut keys: Vec<String> = aspect.keys.iter().map(of_grain).collect();
                keys.extend([format!("grain.{index}"), "packing".into(), "grain".into()]);
                let keys: Vec<&str> = keys.iter().map(String::as_str).collect();
                self.report(&keys, message, help);
            }
            let more = other.count();
            if more > 0 {
                let message = format!("{more} more grains have another {}", aspect.name);
                self.report(&["packing", "grain"], message, help);
            }
        }
    }

    fn of_initial_flow(&mut self, now: &Case, before: &Case) {
        let initial = |case: &Case| {
            let formula = case.setup.prescription.initial_velocity.clone();
            (formula, case.setup.fluid.map_or(DVec3::ZERO, |fluid| fluid.initial_velocity))
        };
        if initial(now) != initial(before) {
            let message = "the initial velocity is not that of the parent run";
            self.report(&["fluid.initial_velocity", "fluid"], message, FROM_CHECKPOINT);
        }
        if now.setup.start != before.setup.start {
            let message = "the start of the grains is not that of the parent run";
            self.report(&["coupling.start", "coupling"], message, FROM_CHECKPOINT);
        }
    }
}

/// Property of a grain that a checkpoint fixes.
struct Aspect {
    name: &'static str,
    /// Keys of a grain that decide it.
    keys: &'static [&'static str],
    /// Whether it belongs to the shape, or else to the state at the start.
    of_shape: bool,
    same: fn(&Grain, &Grain) -> bool,
}

const ASPECTS: [Aspect; 6] = [
    Aspect {
        name: "shape",
        keys: &["equivalent_diameter", "shape", "file"],
        of_shape: true,
        same: |a, b| a.shape.field() == b.shape.field() && a.shape.inertia() == b.shape.inertia(),
    },
    Aspect {
        name: "set of surface nodes",
        keys: &["nodes", "file"],
        of_shape: true,
        // Nodes of another shape differ anyway.
        same: |a, b| a.shape.nodes() == b.shape.nodes() || a.shape.field() != b.shape.field(),
    },
    Aspect {
        name: "position at the start",
        keys: &["position", "gap_above"],
        of_shape: false,
        same: |a, b| a.pose.position == b.pose.position,
    },
    Aspect {
        name: "orientation at the start",
        keys: &["rotate", "orientation"],
        of_shape: false,
        same: |a, b| a.pose.orientation == b.pose.orientation,
    },
    Aspect {
        name: "velocity at the start",
        keys: &["velocity"],
        of_shape: false,
        same: |a, b| !both_free(a.translation, b.translation) || a.velocity == b.velocity,
    },
    Aspect {
        name: "angular velocity at the start",
        keys: &["angular_velocity"],
        of_shape: false,
        same: |a, b| !both_free(a.rotation, b.rotation) || a.angular_velocity == b.angular_velocity,
    },
];

/// Returns whether both motions are free: prescribed velocities may differ.
fn both_free(a: MotionConstraint, b: MotionConstraint) -> bool {
    (a, b) == (MotionConstraint::Free, MotionConstraint::Free)
}
