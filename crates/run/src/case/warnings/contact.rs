//! Warnings about contact.

use crate::case::settling::{impact_speed, is_free, terminal_speed};
use crate::number_format::{length, number};
use grainwake_shape::Field;
use grainwake_solver::dem::{
    ContactDynamics, ContactLawKind, ContactParams, Grain, initial_overlaps,
};
use grainwake_solver::math::Load;
use grainwake_solver::sim::Setup;

/// Overlap at impact that is a reason for a warning [diameters].
const WARNED_OVERLAP: f64 = 0.05;

/// Ratio of contact forces and weight at the start from which contact is out of balance.
const UNBALANCED: f64 = 3.0;
/// Lubrication gap [cells] from which the force is too large, and its inverse too small.
const ONE_CELL: f64 = 1.25;
/// Least height of asperities without a warning [m].
const LEAST_ROUGHNESS: f64 = 1e-10;
/// Time over which the contact forces at the start act [s]; the grains hardly move.
const MOMENT: f64 = 1e-12;

/// Sub-steps per contact below which a flat grain on a wall never rests, `results/flat-grains`.
const STABLE_SUBSTEPS: f64 = 12.0;

/// Sub-steps that are too long for a flat grain, which resists tilting more than a push.
pub(super) fn long_substeps(setup: &Setup) -> Option<String> {
    let is_sphere = |grain: &Grain| matches!(grain.shape.field(), Field::Sphere(_));
    let may_be_flat = setup.grains.iter().any(|grain| is_free(grain) && !is_sphere(grain));
    let substeps = setup.contact.substeps_per_contact;
    (may_be_flat && substeps < STABLE_SUBSTEPS).then(|| {
        format!(
            "{} sub-steps per contact are unstable for flat faces, which never come to rest: take [contact] substeps_per_contact of {STABLE_SUBSTEPS} or more",
            number(substeps)
        )
    })
}

/// Sub-steps that are too few for the restitution of a dashpot.
pub(super) fn few_substeps(setup: &Setup) -> Option<String> {
    let contact = &setup.contact;
    let least = match contact.law {
        ContactLawKind::Linear => Some(contact.restitution),
        ContactLawKind::HertzMindlin => {
            setup.grains.iter().map(|grain| grain.material.restitution).reduce(f64::min)
        }
    };
    let substeps = contact.substeps_per_contact;
    let defaults = ContactParams::default().substeps_per_contact;
    (least.is_some_and(|least| least < 1.0) && substeps < defaults).then(|| {
        format!(
            "{} sub-steps per contact do not resolve the dashpots: impacts return another speed than the restitution; take [contact] substeps_per_contact of {} or more",
            number(substeps),
            number(defaults)
        )
    })
}

/// A lubrication force that does not complete the film that the grid resolves.
pub(super) fn film_off_the_grid(setup: &Setup) -> Option<String> {
    let gap = setup.contact.lubrication_gap;
    let cell = setup.finest_spacing().min_element();
    let amount = match gap / cell {
        _ if gap == 0.0 => return None,
        ratio if ratio > ONE_CELL => "large",
        ratio if ratio < 1.0 / ONE_CELL => "small",
        _ => return None,
    };
    Some(format!(
        "a lubrication_gap of {} makes the lubrication force too {amount}: set [contact] lubrication_gap to one cell, {}",
        length(gap),
        length(cell)
    ))
}

/// Asperities of a lubrication film that are thinner than atoms, as of a forgotten unit.
pub(super) fn tiny_asperities(setup: &Setup) -> Option<String> {
    let roughness = setup.contact.roughness;
    let tiny = setup.contact.lubrication_gap > 0.0 && roughness < LEAST_ROUGHNESS;
    tiny.then(|| {
        format!(
            "a roughness of {} is less than the size of an atom, and contacts in the film need very short sub-steps: check its unit",
            length(roughness)
        )
    })
}

/// Contacts at the start that do not carry the weight: the stiffness is not that of the run in
/// which the grains settled.
pub(super) fn start_out_of_balance(setup: &Setup) -> Option<String> {
    let up = -setup.gravity.try_normalize()?;
    // Most cases begin without contact, and need no patches of the surfaces for this.
    if initial_overlaps(&setup.grains, &setup.enclosure()).is_empty() {
        return None;
    }
    let mut grains = setup.grains.clone();
    let mut contact = vec![Load::default(); grains.len()];
    let mut dynamics = ContactDynamics::new(setup.contact, setup.enclosure());
    dynamics.advance(&mut grains, &[], MOMENT, &mut contact);
    let fluid_density = setup.fluid.map_or(0.0, |fluid| fluid.density);
    let (mut carried, mut weight) = (0.0, 0.0);
    for (grain, load) in setup.grains.iter().zip(&contact).filter(|(grain, _)| is_free(grain)) {
        carried += load.force.dot(up);
        weight += (grain.density - fluid_density) * grain.shape.volume() * setup.gravity.length();
    }
    let ratio = (carried / weight).abs();
    let touching = dynamics.contacts().iter().any(|contact| contact.overlap > 0.0);
    (touching && ratio > UNBALANCED).then(|| {
        let name = match setup.contact.law {
            ContactLawKind::Linear => "[contact] stiffness",
            ContactLawKind::HertzMindlin => "youngs_modulus",
        };
        format!(
            "the contacts at the start push the grains up with {} times their weight and throw them apart: take {name} of the run in which they settled",
            number((10.0 * ratio).round() / 10.0)
        )
    })
}

/// Impacts with a large overlap: at the settling speed, in a dry run after a fall through the box.
pub(super) fn deep_impacts(setup: &Setup) -> Option<String> {
    let g = setup.gravity.length();
    let relative_overlap = |grain: &Grain| {
        let speed = match &setup.fluid {
            Some(fluid) => terminal_speed(grain, fluid, g).max(grain.velocity.length()),
            None => impact_speed(grain, None, setup.gravity, &setup.mesh),
        };
        setup.contact.impact_overlap(grain, speed) / grain.shape.equivalent_diameter()
    };
    let free = setup.grains.iter().filter(|grain| is_free(grain));
    let of_free = free.map(|grain| (relative_overlap(grain), grain));
    let (overlap, grain) = of_free.max_by(|a, b| a.0.total_cmp(&b.0))?;
    if overlap.is_nan() || overlap <= WARNED_OVERLAP {
        return None;
    }
    let diameter = grain.shape.equivalent_diameter();
    let wanted = 0.01 * diameter;
    let factor = setup.contact.stiffening(grain, None, 0.0, overlap * diameter, wanted);
    let remedy = match setup.contact.law {
        ContactLawKind::Linear => {
            format!("[contact] stiffness to {:.1e} N/m", factor * setup.contact.normal_stiffness)
        }
        ContactLawKind::HertzMindlin => {
            format!("youngs_modulus to {:.1e} Pa", factor * grain.material.youngs_modulus)
        }
    };
    let speed = match setup.fluid {
        Some(_) => "at its settling speed",
        None => "that falls through the box",
    };
    let limit = setup.contact.overlap_limit;
    let stops = match overlap > limit {
        true => format!(" (the run stops at {:.0} %)", 100.0 * limit),
        false => String::new(),
    };
    let depth = match overlap < 1.0 {
        true => format!("{:.0} % of", 100.0 * overlap),
        false => "more than".into(),
    };
    Some(format!(
        "a grain {speed} would overlap by {depth} its diameter at impact{stops}: raise {remedy} for 1 %"
    ))
}
