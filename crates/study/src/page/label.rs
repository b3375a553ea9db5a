//! Labels of quantities and factors in the figures of a study: name, symbol and unit.

use grainwake_plot::text;

use crate::analysis::factor_mean::KISSING_SHARE;
use crate::format::title;

const TIME: &str = "*t* √(*g*/*d*)  [–]";
const SPEED: &str = "*v* / √(*d* *g*)  [–]";
const LENGTH: &str = "*D*_{r}/*d*  [–]";

/// Name of a quantity or factor, and its symbol and unit, if the name alone is ambiguous.
const LABELS: [(&str, &str, &str); 40] = [
    (KISSING_SHARE, "share that kisses", "[–]"),
    ("kiss_time", "kissing time", TIME),
    ("kissing_stage", "kissing stage", TIME),
    ("contact_stage", "contact stage", TIME),
    ("parted", "share that parted", "[–]"),
    ("tumble_time", "tumble time", TIME),
    ("pass_time", "pass time", TIME),
    ("separation_time", "separation time", TIME),
    ("landing_time", "landing time", TIME),
    ("last_landing", "last landing", TIME),
    ("kisses", "kisses", "[–]"),
    ("repeated", "share that kissed again", "[–]"),
    ("role_changes", "role changes", "[–]"),
    ("closest", "closest distance", LENGTH),
    ("closest_gap", "closest gap", "*δ*/*d*  [–]"),
    ("final_distance", "final distance", LENGTH),
    ("mean_speed_leading", "mean speed, leading", SPEED),
    ("mean_speed_trailing", "mean speed, trailing", SPEED),
    ("peak_speed_leading", "peak speed, leading", SPEED),
    ("peak_speed_trailing", "peak speed, trailing", SPEED),
    ("draft_speed_leading", "draft speed, leading", SPEED),
    ("draft_speed_trailing", "draft speed, trailing", SPEED),
    ("long_axis_leading", "long axis, leading", "[°]"),
    ("long_axis_trailing", "long axis, trailing", "[°]"),
    ("grains", "grains", "[–]"),
    ("landed", "landed grains", "[–]"),
    ("peak_speed", "peak speed", SPEED),
    ("final_speed", "final speed", SPEED),
    ("mean_speed", "mean speed", SPEED),
    ("speed_change", "change of speed", "[–]"),
    ("peak_speed_m_per_s", "peak speed", "*v*  [m/s]"),
    ("final_speed_m_per_s", "final speed", "*v*  [m/s]"),
    ("peak_reynolds", "peak Reynolds number", "*Re*  [–]"),
    ("final_reynolds", "final Reynolds number", "*Re*  [–]"),
    ("landing_time_s", "landing time", "*t*  [s]"),
    ("drift", "drift", "*s*/*d*  [–]"),
    ("long_axis", "long axis", "[°]"),
    ("turned", "rotation", "[°]"),
    ("krumbein_sphericity", "Krumbein sphericity", "[–]"),
    ("wadell_roundness", "Wadell roundness", "[–]"),
];

/// Returns whether the label of a quantity or factor is part of the program.
pub(super) fn known(quantity: &str) -> bool {
    LABELS.iter().any(|(key, ..)| *key == quantity)
}

/// Returns the label of an axis with name, symbol and unit; the name alone for a factor of the
/// study file, which has no unit of its own.
pub(super) fn label(quantity: &str) -> String {
    match LABELS.iter().find(|(key, ..)| *key == quantity) {
        Some((_, name, unit)) => format!("{name}  {unit}"),
        None => text::literal(&title(quantity)),
    }
}

/// Returns the name of a quantity or factor in a figure, as label markup.
pub(super) fn name_of(quantity: &str) -> String {
    match LABELS.iter().find(|(key, ..)| *key == quantity) {
        Some((_, name, _)) => (*name).to_owned(),
        None => text::literal(&title(quantity)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::quantities::{PAIR_QUANTITIES, SETTLING_QUANTITIES, SHAPE_FACTORS};

    #[test]
    fn every_quantity_has_a_label_with_a_unit() {
        let all = PAIR_QUANTITIES.iter().chain(&SETTLING_QUANTITIES).chain(&SHAPE_FACTORS);
        for quantity in all {
            assert!(label(quantity).contains('['), "{quantity}: {}", label(quantity));
        }
        assert_eq!(label("viscosity_Pas"), "viscosity Pas");
    }
}
