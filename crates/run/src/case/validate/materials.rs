//! Contact law and the materials of grains and walls.

use std::ops::Range;

use super::check::Checker;
use crate::case::loc::Loc;
use crate::case::quantity::{ElasticModulus, Number, Quantity};
use crate::case::raw::{RawContact, RawGrain};
use grainwake_solver::dem::{ContactLawKind, ContactParams, Grain, Material};

/// Place of a key in the case file, if it was given.
type Given<'a> = Option<&'a Option<Range<usize>>>;

fn place<T>(value: &Option<Loc<T>>) -> Given<'_> {
    value.as_ref().map(|value| &value.span)
}

/// Gives each grain its material and returns that of the walls; `None` after a problem.
///
/// Keys that the contact law does not use are refused.
pub(super) fn materials(
    check: &mut Checker,
    contact: &RawContact,
    raw: &[Loc<RawGrain>],
    grains: &mut [Grain],
) -> Option<Material> {
    let before = check.problems.len();
    refuse_unused(check, contact, raw);
    if contact.law.value == ContactLawKind::Linear {
        return (check.problems.len() == before).then_some(Material::RIGID);
    }
    for (index, (raw, grain)) in raw.iter().zip(grains).enumerate() {
        let key = |name: &str| format!("grain.{index}.{name}");
        let modulus = (&raw.youngs_modulus, key("youngs_modulus"));
        let ratio = (&raw.poisson_ratio, key("poisson_ratio"));
        let default_modulus = (&contact.youngs_modulus, "contact.youngs_modulus".into());
        let default_ratio = (&contact.poisson_ratio, "contact.poisson_ratio".into());
        let restitution = match &raw.restitution {
            Some(own) => restitution(check, own, &key("restitution")),
            None => Some(contact.restitution.si),
        };
        let youngs_modulus = youngs_modulus(check, &[modulus, default_modulus]);
        let poisson_ratio = poisson_ratio(check, &[ratio, default_ratio]);
        for (found, name, example) in [
            (youngs_modulus.is_some(), "youngs_modulus", "\"70 GPa\""),
            (poisson_ratio.is_some(), "poisson_ratio", "0.2"),
        ] {
            if !found && check.problems.len() == before {
                check.fail(
                    contact.law.span.as_ref(),
                    "contact.law",
                    format!("the law \"hertz-mindlin\" needs the {name} of grain {index}"),
                    format!("add {name} = {example} to [contact] or to the grain"),
                );
            }
        }
        if check.problems.len() > before {
            // The defaults of [contact] would be reported once a grain.
            return None;
        }
        grain.material = Material {
            youngs_modulus: youngs_modulus?,
            poisson_ratio: poisson_ratio?,
            restitution: restitution?,
        };
    }
    let Some(modulus) = &contact.wall_youngs_modulus else {
        return Some(Material::RIGID);
    };
    let modulus = check.positive(modulus, "contact.wall_youngs_modulus", "Young's modulus");
    let wall_ratio = (
        &contact.wall_poisson_ratio,
        "contact.wall_poisson_ratio".into(),
    );
    let default_ratio = (&contact.poisson_ratio, "contact.poisson_ratio".into());
    let ratio = poisson_ratio(check, &[wall_ratio, default_ratio]);
    if ratio.is_none() && check.problems.len() == before {
        let span = contact.wall_youngs_modulus.as_ref();
        check.fail(
            span.and_then(|modulus| modulus.span.as_ref()),
            "contact.wall_youngs_modulus",
            "the Poisson ratio of the walls is missing",
            "add wall_poisson_ratio = 0.2",
        );
    }
    Some(Material {
        youngs_modulus: modulus?,
        poisson_ratio: ratio?,
        restitution: contact.restitution.si,
    })
}

/// First value given, if it is positive.
fn youngs_modulus(
    check: &mut Checker,
    choices: &[(&Option<Loc<Quantity<ElasticModulus>>>, String)],
) -> Option<f64> {
    let given = choices.iter().find_map(|(v, key)| Some((v.as_ref()?, key)));
    given.and_then(|(value, key)| check.positive(value, key, "Young's modulus"))
}

/// First value given, if it lies between 0 and 0.5.
fn poisson_ratio(
    check: &mut Checker,
    choices: &[(&Option<Loc<Quantity<Number>>>, String)],
) -> Option<f64> {
    let given = choices.iter().find_map(|(v, key)| Some((v.as_ref()?, key)));
    given.and_then(|(value, key)| check.within(value, key, 0.0, 0.5))
}

/// A coefficient of restitution in its range.
pub(super) fn restitution(
    check: &mut Checker,
    value: &Loc<Quantity<Number>>,
    key: &str,
) -> Option<f64> {
    check.within(value, key, ContactParams::MIN_RESTITUTION, 1.0)
}

/// Refuses keys that the contact law does not use.
fn refuse_unused(check: &mut Checker, contact: &RawContact, raw: &[Loc<RawGrain>]) {
    let (law, other) = match contact.law.value {
        ContactLawKind::Linear => ("linear", "hertz-mindlin"),
        ContactLawKind::HertzMindlin => ("hertz-mindlin", "linear"),
    };
    let mut refuse = |key: String, given: Given| {
        if let Some(span) = given {
            let name = key.rsplit('.').next().unwrap_or(&key);
            check.fail(
                span.as_ref(),
                &key,
                format!("the contact law \"{law}\" does not use {name}"),
                format!("remove `{name}`, or set [contact] law = \"{other}\""),
            );
        }
    };
    if contact.law.value == ContactLawKind::HertzMindlin {
        for (name, given) in [
            ("stiffness", place(&contact.stiffness)),
            ("maximum_overlap", place(&contact.maximum_overlap)),
            ("tangential_ratio", place(&contact.tangential_ratio)),
            ("tangential_damping", place(&contact.tangential_damping)),
        ] {
            refuse(format!("contact.{name}"), given);
        }
        return;
    }
    for (name, given) in [
        ("youngs_modulus", place(&contact.youngs_modulus)),
        ("poisson_ratio", place(&contact.poisson_ratio)),
        ("wall_youngs_modulus", place(&contact.wall_youngs_modulus)),
        ("wall_poisson_ratio", place(&contact.wall_poisson_ratio)),
    ] {
        refuse(format!("contact.{name}"), given);
    }
    for (index, grain) in raw.iter().enumerate() {
        for (name, given) in [
            ("youngs_modulus", place(&grain.youngs_modulus)),
            ("poisson_ratio", place(&grain.poisson_ratio)),
            ("restitution", place(&grain.restitution)),
        ] {
            refuse(format!("grain.{index}.{name}"), given);
        }
    }
}
