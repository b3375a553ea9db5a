//! `[[packing]]` -> raw grains.

use glam::{DQuat, DVec3};

use super::check::{Checker, point_into_box};
use super::grains::{Grains, initial, not_too_light, shape};
use crate::case::close_packing::close_places;
use crate::case::located::Located;
use crate::case::packing::{Random, Region, orientation};
use crate::case::quantity::Quantity;
use crate::case::raw::{
    Arrangement, Bounds, MotionLaw, Orientation, PackingOrientation, Position, RawGrain, RawPacking,
};
use crate::case::sphere_cells::Sphere;
use crate::number_format::{number_of_grains, vector};
use grainwake_solver::dem::{Enclosure, Grain};
use rand::{RngExt, SeedableRng};

/// Largest number of grains of a packing.
pub(super) const MOST_GRAINS: usize = 1_000_000;

/// Returns the grains of a packing as raw grains; `None` after a problem.
pub(super) fn packing(
    check: &mut Checker,
    grains: &mut Grains,
    raw: &Located<RawPacking>,
    enclosure: &Enclosure,
    fluid_density: Option<f64>,
) -> Option<Vec<RawGrain>> {
    let count = raw.count.value;
    if raw.files.is_empty() && raw.shapes.is_empty() || count == 0 {
        let help = "give a count and files = [...] or shapes = [...]";
        return check.refuse(&raw.span, "there is nothing to pack", help);
    }
    if count > MOST_GRAINS {
        let message = format!("{count} grains are too many");
        return check.refuse(&raw.count.span, message, format!("at most {MOST_GRAINS} grains"));
    }
    let density = check.positive(&raw.density, "the density of a grain");
    let jitter = check.within(&raw.jitter, 0.0, 1.0);
    let clearance = check.not_negative(&raw.clearance);
    density?;
    let (jitter, clearance) = (jitter?, clearance?);
    if raw.motion.velocity == MotionLaw::Free {
        not_too_light(check, &raw.density, fluid_density);
    }
    let given = raw.velocity.span.is_some().then(|| raw.velocity.clone());
    initial(check, &raw.motion.velocity, &given);
    let mut random = Random::seed_from_u64(raw.seed);
    let (mut written, bodies) = members(check, grains, raw, &mut random)?;

    let (from, to) = (raw.region.as_ref())
        .map_or((enclosure.lower, enclosure.upper), |r| (r.lower.si, r.upper.si));
    let region_span = raw.region.as_ref().map_or(&raw.span, |region| &region.span);
    let corner = |at: DVec3| point_into_box(at, enclosure.lower, enclosure.upper);
    let corners = corner(from).zip(corner(to)).filter(|(from, to)| from.cmplt(*to).all());
    let Some((lower, upper)) = corners else {
        let (from, to) = (vector(enclosure.lower, "m"), vector(enclosure.upper, "m"));
        let message = "the region is empty or reaches out of the box";
        return check.refuse(region_span, message, format!("the box goes from {from} to {to}"));
    };
    let placed: Vec<Grain> = grains.built.iter().flatten().cloned().collect();
    let stop = check.stop;
    let region = Region { lower, upper, clearance, enclosure: *enclosure, placed, stop };
    let vertical = (grains.vertical.axis, grains.vertical.sign);
    let centres = match raw.arrangement {
        Arrangement::Lattice => lattice(&region, &bodies, jitter, vertical, &mut random),
        Arrangement::Random => random_places(&region, &bodies, &mut random),
    };
    let by_count = check.is_overridden(&raw.count.span);
    let span = if by_count { &raw.count.span } else { region_span };
    let refused = |(message, help): (String, &str)| check.fail(span, message, help);
    let centres = centres.map_err(refused).ok()?;
    for (grain, centre) in written.iter_mut().zip(centres) {
        grain.position = Some(Position(centre.to_array().to_vec()).into());
    }
    Some(written)
}

/// Returns centres on a lattice [m]; the error is a message and the help.
fn lattice(
    region: &Region,
    grains: &[Grain],
    jitter: f64,
    vertical: (usize, f64),
    random: &mut Random,
) -> Result<Vec<DVec3>, (String, &'static str)> {
    let radii: Vec<f64> = grains.iter().map(|grain| grain.shape.bounding_radius()).collect();
    let centres = region.lattice(&radii, jitter, vertical, random).map_err(|sites| {
        let count = number_of_grains(grains.len());
        let message = format!("the lattice has {sites} sites for {count}");
        let help = "take fewer or smaller grains, a larger region, or less clearance; arrangement = \"random\" may hold more grains that are not round";
        (message, help)
    })?;
    let pairs = centres.iter().zip(radii);
    let spheres: Vec<Sphere> =
        pairs.map(|(centre, radius)| Sphere { centre: *centre, radius }).collect();
    if !region.clear(&spheres) {
        let message = "the packing runs into grains that already stand there";
        let help = "choose a region that is free, or arrangement = \"random\"";
        return Err((message.into(), help));
    }
    Ok(centres)
}

/// Returns random centres [m]: of separate bounding spheres, or else of grains whose surfaces are
/// separate. The error is a message and the help.
fn random_places(
    region: &Region,
    grains: &[Grain],
    random: &mut Random,
) -> Result<Vec<DVec3>, (String, &'static str)> {
    let radii: Vec<f64> = grains.iter().map(|grain| grain.shape.bounding_radius()).collect();
    let found = region.random(&radii, random);
    found.or_else(|| close_places(region, grains, random)).ok_or_else(|| {
        let volume: f64 = grains.iter().map(|grain| grain.shape.volume()).sum();
        let percent = 100.0 * volume / region.volume();
        let who = match grains.len() {
            1 => "1 grain finds no place".to_owned(),
            n => format!("{n} grains find no places"),
        };
        let apart = match region.clearance > 0.0 {
            true => "with this clearance",
            false => "without touching",
        };
        let message =
            format!("{who} {apart}; their volume is {percent:.0} % of that of the region");
        (message, "take fewer or smaller grains, a larger region, less clearance, or another seed")
    })
}

/// Returns the grains of a packing without their positions: as a case file has them, and as bodies
/// at the origin.
fn members(
    check: &mut Checker,
    grains: &mut Grains,
    raw: &Located<RawPacking>,
    random: &mut Random,
) -> Option<(Vec<RawGrain>, Vec<Grain>)> {
    let diameters = raw.equivalent_diameter.as_ref().map(|range| {
        let Bounds { from, to } = range.value.0;
        (from.si, to.si, &range.span)
    });
    if let Some((_, _, span)) = diameters.filter(|(from, to, _)| !(*from > 0.0 && to >= from)) {
        let message = "the range of diameters is empty or not positive";
        return check.refuse(span, message, "write { from = \"1 mm\", to = \"2 mm\" }");
    }
    let files = raw.files.len();
    let mut packed = Vec::with_capacity(raw.count.value);
    let mut bodies = Vec::with_capacity(raw.count.value);
    for n in 0..raw.count.value {
        let kind = n % (files + raw.shapes.len());
        let mut grain = RawGrain {
            density: raw.density.clone(),
            velocity: (raw.motion.velocity == MotionLaw::Free).then(|| raw.velocity.clone()),
            motion: raw.motion.clone(),
            file: raw.files.get(kind).cloned(),
            ..RawGrain::default()
        };
        if kind >= files {
            grain.shape = Some(raw.shapes[kind - files].clone());
            grain.nodes = raw.nodes.clone();
        }
        if let Some((from, to, span)) = diameters {
            let d = if to > from { from + (to - from) * random.random::<f64>() } else { from };
            grain.equivalent_diameter = Some(Located::at(Quantity::new(d), span.clone()));
        }
        let mut quaternion = DQuat::IDENTITY;
        if raw.orientation == PackingOrientation::Random {
            quaternion = orientation(random);
            grain.orientation = Orientation::Quaternion(quaternion).into();
        }
        let located = Located::at(grain.clone(), raw.span.clone());
        let shape = shape(check, &mut grains.library, &located, &mut grain.clone())?;
        let turned = Grain::new(shape, raw.density.si).with_orientation(quaternion);
        bodies.push(turned);
        packed.push(grain);
    }
    Some((packed, bodies))
}
