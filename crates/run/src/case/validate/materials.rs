//! Materials of grains and walls.

use super::check::Checker;
use crate::case::located::{Located, Span};
use crate::case::quantity::{ElasticModulus, Number, Quantity};
use crate::case::raw::{RawContact, RawGrain};
use grainwake_solver::dem::{ContactLawKind, ContactParams, Grain, Material};

/// Sets the material of each grain and returns that of the walls; `None` after a problem.
///
/// Keys that the contact law does not use are refused.
pub(super) fn materials(
    check: &mut Checker,
    contact: &RawContact,
    raw: &[Located<RawGrain>],
    grains: &mut [Grain],
) -> Option<Material> {
    let before = check.problems.len();
    refuse_unused(check, contact, raw);
    if contact.law.value == ContactLawKind::Linear {
        return (check.problems.len() == before).then_some(Material::RIGID);
    }
    for (index, (raw, grain)) in raw.iter().zip(grains).enumerate() {
        let modulus = (raw.youngs_modulus.as_ref()).or(contact.youngs_modulus.as_ref());
        let ratio = (raw.poisson_ratio.as_ref()).or(contact.poisson_ratio.as_ref());
        let missing = match (modulus, ratio) {
            (None, _) => Some(("youngs_modulus", "\"70 GPa\"")),
            (_, None) => Some(("poisson_ratio", "0.2")),
            _ => None,
        };
        if let Some((name, example)) = missing {
            let message = format!("the law \"hertz-mindlin\" needs the {name} of grain {index}");
            let help = format!("add {name} = {example} to [contact] or to the grain");
            check.fail(&contact.law.span, message, help);
        }
        let restitution =
            restitution(check, raw.restitution.as_ref().unwrap_or(&contact.restitution));
        let material = material(check, modulus, ratio, restitution);
        if check.problems.len() > before {
            // A wrong default of [contact] would be reported once for each grain.
            return None;
        }
        grain.material = material?;
    }
    let Some(modulus) = &contact.wall_youngs_modulus else {
        if let Some(ratio) = &contact.wall_poisson_ratio {
            let message =
                "walls without wall_youngs_modulus are rigid: wall_poisson_ratio has no effect";
            check.fail(
                &ratio.span,
                message,
                "add wall_youngs_modulus, or remove wall_poisson_ratio",
            );
        }
        return Some(Material::RIGID);
    };
    let ratio = (contact.wall_poisson_ratio.as_ref()).or(contact.poisson_ratio.as_ref());
    if ratio.is_none() {
        let message = "the Poisson ratio of the walls is missing";
        check.fail(&modulus.span, message, "add wall_poisson_ratio = 0.2");
    }
    material(check, Some(modulus), ratio, Some(contact.restitution.si))
}

fn material(
    check: &mut Checker,
    modulus: Option<&Located<Quantity<ElasticModulus>>>,
    ratio: Option<&Located<Quantity<Number>>>,
    restitution: Option<f64>,
) -> Option<Material> {
    let youngs_modulus = modulus.and_then(|value| check.positive(value, "Young's modulus"));
    let poisson_ratio = ratio.and_then(|value| check.within(value, 0.0, 0.5));
    Some(Material {
        youngs_modulus: youngs_modulus?,
        poisson_ratio: poisson_ratio?,
        restitution: restitution?,
    })
}

/// Returns a coefficient of restitution in its range.
pub(super) fn restitution(check: &mut Checker, value: &Located<Quantity<Number>>) -> Option<f64> {
    check.within(value, ContactParams::MIN_RESTITUTION, 1.0)
}

/// Refuses keys that the contact law does not use.
fn refuse_unused(check: &mut Checker, contact: &RawContact, raw: &[Located<RawGrain>]) {
    let (law, other) = match contact.law.value {
        ContactLawKind::Linear => ("linear", "hertz-mindlin"),
        ContactLawKind::HertzMindlin => ("hertz-mindlin", "linear"),
    };
    fn span<T>(value: &Option<Located<T>>) -> Option<Span> {
        value.as_ref().map(|value| value.span.clone())
    }
    let unused = match contact.law.value {
        ContactLawKind::HertzMindlin => vec![
            span(&contact.stiffness),
            span(&contact.maximum_overlap),
            span(&contact.tangential_ratio),
            span(&contact.tangential_damping),
        ],
        ContactLawKind::Linear => {
            let of_contact = [
                span(&contact.youngs_modulus),
                span(&contact.poisson_ratio),
                span(&contact.wall_youngs_modulus),
                span(&contact.wall_poisson_ratio),
            ];
            let of_grain = |grain: &Located<RawGrain>| {
                [span(&grain.youngs_modulus), span(&grain.poisson_ratio), span(&grain.restitution)]
            };
            of_contact.into_iter().chain(raw.iter().flat_map(of_grain)).collect()
        }
    };
    for span in unused.into_iter().flatten() {
        let key = check.key(&span).to_owned();
        let name = key.rsplit('.').next().unwrap_or_default();
        let message = format!("the contact law \"{law}\" does not use {name}");
        let help = format!("remove `{name}`, or set [contact] law = \"{other}\"");
        check.fail(&span, message, help);
    }
}
