//! Raw case -> validated set-up and plan. No module downstream checks user input again.

mod arrangement;
mod check;
mod domain;
mod expect;
mod grains;
mod materials;
mod overlaps;
mod packings;
mod physics;
mod plan;
mod poses;
mod probes;
mod scales;

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use self::arrangement::Placement;
use self::check::Checker;
use self::grains::{Grains, Vertical};
use super::error::{CaseError, Problem};
use super::expect::Expectation;
use super::located::Located;
use super::raw::{RawCase, RawContact, RawPlane};
use super::shapes::{Library, ShapeFile};
use super::source::Source;
use crate::RunPlan;
use grainwake_solver::dem::{Enclosure, Grain};
use grainwake_solver::flow::Boundaries;
use grainwake_solver::grid::Mesh;
use grainwake_solver::sim::{PrescribedMotion, Prescription, Setup};

/// Validated parts of a case.
pub(super) struct Validated {
    pub setup: Setup,
    pub plan: RunPlan,
    pub expect: Vec<Expectation>,
    pub shapes: Vec<ShapeFile>,
    /// Path of each shape file.
    pub paths: Vec<PathBuf>,
    /// Case with all defaults written out.
    pub resolved: RawCase,
}

/// Validates a case with its library of shapes, until `stop` is set.
pub(super) fn validate(
    source: &Source,
    raw: RawCase,
    library: Library,
    stop: &AtomicBool,
) -> Result<Validated, CaseError> {
    let mut check = Checker::new(source, stop);
    let validated = resolve(&mut check, raw, library);
    if check.stopped() {
        return Err(CaseError::Interrupted);
    }
    match validated.filter(|_| check.problems.is_empty()) {
        Some(validated) => {
            let checked = validated.setup.validate();
            checked.map_err(|error| CaseError::from(Problem::new(error.to_string())))?;
            Ok(validated)
        }
        None => Err(CaseError::Invalid(check.problems)),
    }
}

/// Returns the validated case, or `None` after a problem that hides others.
fn resolve(check: &mut Checker, mut raw: RawCase, library: Library) -> Option<Validated> {
    let dry = raw.fluid.is_none();
    let mut prescription = Prescription::default();
    let fluid = (raw.fluid.as_mut()).and_then(|raw| physics::fluid(check, raw, &mut prescription));
    let mesh = domain::mesh(check, &mut raw.domain.value, dry);
    let boundaries = mesh.and_then(|mesh| domain::boundaries(check, &raw.domain, &mesh, dry));
    let gravity = raw.gravity.si;
    plan::check_threads(check, &raw.run);

    let mut grains = Grains::new(library, Vertical::of(gravity));
    let fluid_density = fluid.map(|fluid| fluid.density);
    for grain in &raw.grain {
        let placement = Placement::of(check, grain, grains.vertical.axis);
        grains.add(check, grain, placement, fluid_density);
    }
    let (mesh, boundaries) = (mesh?, boundaries?);
    if let Some(fluid) = &raw.fluid {
        physics::formulas(check, fluid, &prescription, &mesh, raw.time.end.si);
    }
    let enclosure = Setup::enclosure_of(&mesh, &boundaries);
    add_packed(check, &raw, &mut grains, &enclosure, fluid_density)?;
    let motions = grains.prescribed_motions();
    for PrescribedMotion { grain, velocity, angular_velocity } in &motions {
        let span = &grains.resolved[*grain].motion.span;
        for formula in [velocity, angular_velocity].into_iter().flatten() {
            let end = raw.time.end.si;
            physics::finite_over_time(check, span, end, |time| Some(formula.at(&[time])));
        }
    }
    let Grains { library, vertical, built, resolved, placements } = grains;
    let mut grains = built.into_iter().collect::<Option<Vec<Grain>>>()?;
    prescription.motions = motions;
    prescription.prescribe_motion(&mut grains, 0.0);
    let faces = (&mesh, &boundaries, &enclosure);
    check_arrangement(check, &raw.contact, &grains, &placements, faces, dry);
    let material = materials::materials(check, &raw.contact, &resolved, &mut grains);
    let contact = if dry || fluid.is_some() {
        let raw = &mut raw.contact;
        physics::contact(check, raw, &grains, material, fluid.as_ref(), gravity, &mesh)
    } else {
        None
    };
    let state = [dry, grains.is_empty()];
    let refinement = domain::refinement(check, &raw.domain, &raw.coupling, &mesh, state);
    if refinement > 1 {
        arrangement::check_refined(check, &grains, &placements, &enclosure, &boundaries);
    }
    let margin = domain::refinement_margin(check, &raw.domain, refinement, &mesh);
    let spacing = mesh.spacing / refinement.max(1) as f64;
    let step = plan::step(check, &mut raw.time, spacing, &grains, gravity, &prescription, dry);
    let setup = Setup::new(mesh)
        .with_boundaries(boundaries.0)
        .with_fluid(fluid)
        .with_precision(raw.run.precision.value)
        .with_refinement(refinement)
        .with_refinement_margin(margin)
        .with_scheme(raw.coupling.scheme.value)
        .with_start(raw.coupling.start.value)
        .with_gravity(gravity)
        .with_grains(grains)
        .with_contact(contact?)
        .with_step(step?)
        .with_prescription(prescription);
    let plan = plan::plan(check, &raw.time, &mut raw.output, &mut raw.probe, &setup, vertical.axis);
    let expect = expect::expectations(check, &raw.expect, setup.grains.len());
    let plan = plan?;
    raw.grain = resolved;
    raw.packing = Vec::new();
    raw.poses = Vec::new();
    raw.output.planes = Some(plan.planes.iter().map(|p| RawPlane::from(p).into()).collect());
    let (paths, shapes) = library.into_files().unzip();
    Some(Validated { setup, plan, expect, shapes, paths, resolved: raw })
}

/// Adds the grains of tables of poses and of packings; `None` after a problem.
fn add_packed(
    check: &mut Checker,
    raw: &RawCase,
    grains: &mut Grains,
    enclosure: &Enclosure,
    fluid_density: Option<f64>,
) -> Option<()> {
    let before_packings = check.problems.len();
    for raw_poses in &raw.poses {
        let law = raw.contact.law.value;
        let placed = poses::poses(check, grains, raw_poses, enclosure, law, fluid_density);
        for grain in placed.into_iter().flatten() {
            let placement = Placement::packed(check, &grain.span);
            // The densities of a table are checked once for all its grains.
            grains.add(check, &grain, placement, None);
        }
    }
    for raw in &raw.packing {
        let packed = packings::packing(check, grains, raw, enclosure, fluid_density);
        for grain in packed.into_iter().flatten() {
            let grain = Located::at(grain, raw.span.clone());
            // The density of a packing is checked once for all its grains.
            grains.add(check, &grain, Placement::packed(check, &raw.span), None);
        }
    }
    // Checks of the arrangement need all grains.
    (check.problems.len() == before_packings).then_some(())
}

/// Checks where the grains lie: in the box, apart from each other, in the plane of a flat box.
fn check_arrangement(
    check: &mut Checker,
    contact: &RawContact,
    grains: &[Grain],
    placements: &[Placement],
    (mesh, boundaries, enclosure): (&Mesh, &Boundaries, &Enclosure),
    dry: bool,
) {
    let accepted = physics::accepted_overlap(check, contact);
    if grains.iter().all(|grain| grain.pose.position.is_finite()) {
        arrangement::check_faces(check, grains, placements, enclosure, boundaries, accepted);
        overlaps::check_overlaps(check, grains, placements, enclosure, accepted);
    }
    if let Some(normal) = (0..3).find(|axis| !dry && !mesh.is_resolved(*axis)) {
        arrangement::check_plane(check, grains, placements, normal);
    }
    if dry && grains.is_empty() {
        let message = "there is neither a fluid nor a grain";
        check.fail_key("grain", message, "add [fluid] or [[grain]]");
    }
}
