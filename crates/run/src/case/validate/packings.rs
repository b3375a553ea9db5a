//! `[[packing]]` -> raw grains.

use super::check::Checker;
use super::grains::{not_too_light, shape};
use crate::case::loc::Loc;
use crate::case::packing::{Ball, Random, Space, orientation};
use crate::case::quantity::Quantity;
use crate::case::raw::{
    Arrangement, Orientation, PackingOrientation, Position, RawGrain, RawPacking,
};
use crate::case::readable::vector;
use crate::case::shapes::Library;
use grainwake_solver::dem::{Enclosure, Grain};
use rand::{RngExt, SeedableRng};

/// Grains of a packing as the raw grains that stand for them.
pub(super) fn packing(
    check: &mut Checker,
    library: &mut Library,
    raw: &Loc<RawPacking>,
    index: usize,
    standing: &[Grain],
    enclosure: &Enclosure,
    vertical: (usize, f64),
    fluid_density: Option<f64>,
) -> Vec<RawGrain> {
    let key = |name: &str| format!("packing.{index}.{name}");
    let count = raw.count.value;
    let kinds = raw.files.len() + raw.shapes.len();
    if kinds == 0 || count == 0 {
        check.fail(
            raw.span.as_ref(),
            &format!("packing.{index}"),
            "there is nothing to pack",
            "give a count and files = [...] or shapes = [...]",
        );
        return Vec::new();
    }
    if count > 1_000_000 {
        check.fail(
            raw.count.span.as_ref(),
            &key("count"),
            format!("{count} grains are too many"),
            "at most 1000000 grains",
        );
        return Vec::new();
    }
    let (Some(_), Some(jitter), Some(clearance)) = (
        check.positive(&raw.density, &key("density"), "the density of a grain"),
        check.within(&raw.jitter, &key("jitter"), 0.0, 1.0),
        check.within(&raw.clearance, &key("clearance"), 0.0, f64::INFINITY),
    ) else {
        return Vec::new();
    };
    not_too_light(check, &raw.density, &key("density"), fluid_density);
    let diameters = raw.equivalent_diameter.as_ref();
    if let Some(range) = diameters.filter(|r| !(r.from > 0.0 && r.to >= r.from)) {
        check.fail(
            range.span.as_ref(),
            &key("equivalent_diameter"),
            "the range of diameters is empty or not positive",
            "write { from = \"1 mm\", to = \"2 mm\" }",
        );
        return Vec::new();
    }
    let mut random = Random::seed_from_u64(raw.seed);
    let mut grains = Vec::with_capacity(count);
    let mut radii = Vec::with_capacity(count);
    for n in 0..count {
        let kind = n % kinds;
        let mut grain = RawGrain {
            density: raw.density.clone(),
            velocity: Some(raw.velocity.clone()),
            nodes: if kind < raw.files.len() {
                None
            } else {
                raw.nodes.clone()
            },
            ..RawGrain::default()
        };
        if kind < raw.files.len() {
            grain.file = Some(raw.files[kind].clone());
        } else {
            grain.shape = Some(raw.shapes[kind - raw.files.len()].clone());
        }
        if let Some(range) = diameters {
            let d = if range.to > range.from {
                range.from + (range.to - range.from) * random.random::<f64>()
            } else {
                range.from
            };
            grain.equivalent_diameter = Some(Loc {
                value: Quantity::new(d),
                span: range.span.clone(),
            });
        }
        if raw.orientation == PackingOrientation::Random {
            grain.orientation = Orientation::Quaternion(orientation(&mut random)).into();
        }
        let mut scratch = grain.clone();
        let located = Loc {
            value: grain.clone(),
            span: raw.span.clone(),
        };
        // The key would name a grain that is not in the file: a packing's shape is its own.
        let problems = check.problems.len();
        let Some(shape) = shape(check, library, &located, &mut scratch, n) else {
            for problem in &mut check.problems[problems..] {
                problem.key = Some(format!("packing.{index}"));
            }
            return Vec::new();
        };
        radii.push(shape.bounding_radius());
        grains.push(grain);
    }
    let (lower, upper) = raw
        .region
        .as_ref()
        .map_or((enclosure.lower, enclosure.upper), |r| {
            (r.lower.si, r.upper.si)
        });
    let region_span = raw
        .region
        .as_ref()
        .map_or(raw.span.as_ref(), |r| r.span.as_ref());
    if (lower.cmplt(enclosure.lower) | upper.cmpgt(enclosure.upper) | upper.cmple(lower)).any() {
        check.fail(
            region_span,
            &key("region"),
            "the region is empty or reaches out of the box",
            format!(
                "the box goes from {} to {}",
                vector(enclosure.lower, "m"),
                vector(enclosure.upper, "m")
            ),
        );
        return Vec::new();
    }
    let taken: Vec<Ball> = standing
        .iter()
        .map(|g| Ball {
            centre: g.pose.position,
            radius: g.shape.bounding_radius(),
        })
        .collect();
    let space = Space {
        lower,
        upper,
        clearance,
        enclosure,
        taken: &taken,
    };
    let centres = match raw.arrangement {
        Arrangement::Lattice => space.lattice(&radii, jitter, vertical, &mut random),
        Arrangement::Random => space.random(&radii, &mut random),
    };
    let centres = match centres {
        Ok(centres) => centres,
        Err(fit) => {
            let count_span = raw.count.span.as_ref();
            let span = count_span.filter(|span| check.is_overridden(span));
            check.fail(span.or(region_span), &format!("packing.{index}"), format!("only {fit} of {count} grains find a place without touching"), "take fewer or smaller grains, a larger region, or less clearance; a lattice holds more than random places");
            return Vec::new();
        }
    };
    let balls: Vec<Ball> = centres
        .iter()
        .zip(&radii)
        .map(|(c, r)| Ball {
            centre: *c,
            radius: *r,
        })
        .collect();
    if !space.clear(&balls) {
        check.fail(
            region_span,
            &format!("packing.{index}"),
            "the packing runs into grains that already stand there",
            "choose a region that is free, or arrangement = \"random\"",
        );
        return Vec::new();
    }
    for (grain, centre) in grains.iter_mut().zip(centres) {
        grain.position = Some(Position(centre.to_array().to_vec()).into());
    }
    grains
}
