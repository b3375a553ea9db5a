//! Raw case -> validated set-up and plan. Nothing downstream checks again.

mod arrangement;
mod check;
mod domain;
mod grains;
mod materials;
mod packings;
mod physics;
mod plan;

use std::path::Path;

use self::arrangement::Site;
use self::check::Checker;
use super::error::{CaseError, Problem};
use super::expect::{Expectation, expectations};
use super::loc::Loc;
use super::raw::{RawCase, RawGrain};
use super::shapes::{Library, ShapeFile};
use super::source::Source;
use crate::RunPlan;
use grainwake_solver::dem::{Enclosure, Grain};
use grainwake_solver::sim::{Prescription, Setup};

/// What a good case gives.
pub(super) struct Validated {
    pub setup: Setup,
    pub plan: RunPlan,
    pub threads: usize,
    pub expect: Vec<Expectation>,
    pub shapes: Vec<ShapeFile>,
    /// The case with everything spelled out.
    pub resolved: RawCase,
}

/// Checks a case; files are looked for in `folder`.
pub(super) fn validate(
    source: &Source,
    mut raw: RawCase,
    folder: &Path,
) -> Result<Validated, CaseError> {
    let mut check = Checker::new(source);
    let dry = raw.fluid.is_none();
    let mut prescription = Prescription::default();
    let fluid = raw
        .fluid
        .as_mut()
        .map(|fluid| physics::fluid(&mut check, fluid, &mut prescription));
    let mesh = domain::mesh(&mut check, &mut raw.domain.value, dry);
    let boundaries = mesh.and_then(|mesh| domain::boundaries(&mut check, &raw.domain, &mesh, dry));
    let gravity = raw.gravity.si;
    let mut library = Library::new(folder);
    let threads = plan::run(&mut check, &raw.run);

    let vertical = grains::up(gravity);
    let mut standing: Vec<Option<Grain>> = Vec::new();
    let mut resolved: Vec<Loc<RawGrain>> = Vec::new();
    let mut sites: Vec<Site> = Vec::new();
    let fluid_density = fluid.as_ref().and_then(|f| f.as_ref()).map(|f| f.density);
    for (index, grain) in raw.grain.iter().enumerate() {
        let built = grains::grain(
            &mut check,
            &mut library,
            grain,
            index,
            &standing,
            vertical,
            fluid_density,
        );
        sites.push(Site::of(&check, grain, index, vertical.0));
        let (grain, raw_grain) = built.unzip();
        standing.push(grain);
        resolved.extend(raw_grain.map(Loc::none));
    }
    let (Some(mesh), Some(boundaries)) = (mesh, boundaries) else {
        return Err(CaseError::Invalid(check.problems));
    };
    if let Some(fluid) = &raw.fluid {
        physics::defined(&mut check, fluid, &prescription, &mesh);
    }
    let enclosure = Enclosure {
        lower: mesh.origin,
        upper: mesh.upper(),
        periodic: boundaries.periodic(),
        solid: boundaries.0.map(|sides| sides.map(|b| b.is_solid())),
    };
    let before_packings = check.problems.len();
    for (index, packing) in raw.packing.iter().enumerate() {
        let there: Vec<Grain> = standing.iter().flatten().cloned().collect();
        for grain in packings::packing(
            &mut check,
            &mut library,
            packing,
            index,
            &there,
            &enclosure,
            vertical,
            fluid_density,
        ) {
            let located = Loc {
                value: grain,
                span: packing.span.clone(),
            };
            let built = grains::grain(
                &mut check,
                &mut library,
                &located,
                standing.len(),
                &standing,
                vertical,
                // Told of the packing as a whole.
                None,
            );
            sites.push(Site::packed(packing.span.as_ref(), index));
            let (grain, raw_grain) = built.unzip();
            standing.push(grain);
            resolved.extend(raw_grain.map(Loc::none));
        }
    }
    // Without grains that are meant to be there, more would be said that is not so.
    let packed = check.problems.len() == before_packings;
    if !packed || standing.iter().any(Option::is_none) {
        return Err(CaseError::Invalid(check.problems));
    }
    let mut grains: Vec<Grain> = standing.into_iter().flatten().collect();
    prescription.motions = grains::prescribed_motions(&resolved);
    prescription.prescribe_motion(&mut grains, 0.0);
    arrangement::check(&mut check, &grains, &sites, &enclosure);
    if dry && grains.is_empty() {
        check.fail(
            None,
            "grain",
            "there is neither a fluid nor a grain",
            "add [fluid] or [[grain]]",
        );
    }

    let fluid_params = fluid.as_ref().and_then(|f| f.as_ref());
    let wall_material = materials::materials(&mut check, &raw.contact, &resolved, &mut grains);
    let contact = if fluid.is_some() == fluid_params.is_some() {
        physics::contact(
            &mut check,
            &mut raw.contact,
            &grains,
            wall_material,
            fluid_params,
            gravity,
            &mesh,
        )
    } else {
        None
    };
    let step = plan::step(&mut check, &mut raw.time, &mesh, &grains, gravity, dry);
    let (Some(contact), Some(step)) = (contact, step) else {
        return Err(CaseError::Invalid(check.problems));
    };
    let setup = Setup::new(mesh)
        .with_boundaries(boundaries.0)
        .with_fluid(fluid_params.copied())
        .with_precision(raw.run.precision.value)
        .with_scheme(raw.coupling.scheme.value)
        .with_gravity(gravity)
        .with_grains(grains)
        .with_contact(contact)
        .with_step(step)
        .with_prescription(prescription);
    let plan = plan::plan(&mut check, &raw.time, &mut raw.output, &setup, vertical.0);
    let expect = expectations(
        &raw.expect,
        setup.grains.len(),
        &mut |span, key, message, help| check.fail(span, key, message, help),
    );
    let (Some(plan), true) = (plan, check.problems.is_empty()) else {
        return Err(CaseError::Invalid(check.problems));
    };
    setup
        .validate()
        .map_err(|error| CaseError::from(Problem::new(error.to_string())))?;
    raw.grain = resolved;
    raw.packing = Vec::new();
    raw.output.planes = Some(plan.planes.iter().map(|p| Loc::none(p.into())).collect());
    raw.run.threads = threads.into();
    Ok(Validated {
        setup,
        plan,
        threads,
        expect,
        shapes: library.into_files(),
        resolved: raw,
    })
}
