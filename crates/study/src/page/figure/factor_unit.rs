//! Units of the factors of a study file, which are plain numbers.

use std::collections::BTreeSet;

use grainwake_plot::text;

use crate::format::title;
use crate::page::label::{known, label};
use crate::plan::Run;

/// Returns the label of an axis with the unit, if it is known.
pub fn label_with_unit(runs: &[Run], name: &str) -> String {
    match unit(runs, name).filter(|_| !known(name)) {
        None => label(name),
        Some(unit) => {
            let name = title(name);
            // A factor "diameter_mm" names its unit already.
            let bare = name.strip_suffix(&unit).map_or(name.as_str(), str::trim_end);
            format!("{}  [{}]", text::literal(bare), with_powers(&unit))
        }
    }
}

/// Returns the unit of a factor: that of a setting which has the value of the factor in every run,
/// such as "1500 kg/m3" and 1500. None if no setting or several with different units agree, or if
/// the factor has one value only.
fn unit(runs: &[Run], factor: &str) -> Option<String> {
    let mut values = BTreeSet::new();
    let mut common: Option<BTreeSet<(String, String)>> = None;
    for run in runs {
        let Some(value) = run.factors.get(factor) else {
            continue;
        };
        values.insert(value.to_bits());
        let own: BTreeSet<_> = run.set.iter().flat_map(|set| quantities(set, *value)).collect();
        common = Some(match common {
            None => own,
            Some(common) => common.intersection(&own).cloned().collect(),
        });
    }
    let mut units: Vec<String> = common?.into_iter().map(|(_, unit)| unit).collect();
    units.dedup();
    let unit = units.pop().filter(|_| units.is_empty() && values.len() > 1)?;
    Some(unit)
}

/// Returns key and unit of each quoted quantity of a setting "key=value" that has this value.
fn quantities(setting: &str, value: f64) -> Vec<(String, String)> {
    let Some((key, text)) = setting.split_once('=') else {
        return Vec::new();
    };
    let quoted = text.split('"').skip(1).step_by(2).enumerate();
    let quantity = |(n, text): (usize, &str)| {
        let (number, unit) = text.trim().split_once(' ')?;
        let equal = number.parse::<f64>().ok()? == value;
        equal.then(|| (format!("{key} {n}"), unit.trim().to_owned()))
    };
    quoted.filter_map(quantity).collect()
}

/// Returns a unit such as "kg/m3" with its powers raised, in label markup.
fn with_powers(unit: &str) -> String {
    let mut out = String::new();
    let mut after_letter = false;
    for c in unit.chars() {
        match c.is_ascii_digit() && after_letter {
            true => out += &format!("^{{{c}}}"),
            false => out += &text::literal(&c.to_string()),
        }
        after_letter = c.is_alphabetic();
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(factors: &[(&str, f64)], set: &[&str]) -> Run {
        let factors = factors.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        Run { factors, set: set.iter().map(|s| (*s).to_owned()).collect(), ..Run::default() }
    }

    fn label_of(name: &str, settings: [&[&str]; 2]) -> String {
        let [one, two] = settings;
        label_with_unit(&[run(&[(name, 1500.0)], one), run(&[(name, 2500.0)], two)], name)
    }

    #[test]
    fn a_factor_has_the_unit_of_the_setting_with_its_value() {
        let light = ["grain.0.density=\"1500 kg/m3\"", "grain.1.density=\"1500 kg/m3\"", "a=7"];
        let heavy = ["grain.0.density=\"2500 kg/m3\"", "grain.1.density=\"2500 kg/m3\"", "a=7"];
        assert_eq!(label_of("density", [&light, &heavy]), "density  [kg/m^{3}]");
        assert_eq!(label_of("density_kg/m3", [&light, &heavy]), "density  [kg/m^{3}]");
        // A quantity inside a list; another one is the same in both runs.
        let list = ["domain.size=[\"1 m\", \"1500 mm\"]", "domain.size=[\"1 m\", \"2500 mm\"]"];
        assert_eq!(label_of("height", [&list[..1], &list[1..]]), "height  [mm]");
    }

    #[test]
    fn a_factor_without_or_with_several_units_has_none() {
        assert_eq!(label_of("density", [&["a=1500"], &["a=2500"]]), "density");
        let two = ["a=\"1500 m\"", "b=\"1500 s\""];
        assert_eq!(label_of("density", [&two, &["a=\"2500 m\"", "b=\"2500 s\""]]), "density");
        assert_eq!(label_of("density", [&two, &["a=\"2500 m\"", "b=\"2600 s\""]]), "density  [m]");
        let one = [run(&[("density", 1500.0)], &["a=\"1500 kg/m3\""])];
        assert_eq!(label_with_unit(&one, "density"), "density");
        let known = label_of("kiss_time", [&["a=\"1500 s\""], &["a=\"2500 s\""]]);
        assert_eq!(known, label("kiss_time"));
    }
}
