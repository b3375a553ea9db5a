//! `output.scales` -> scales of the dimensionless columns.

use grainwake_formats::summary::Scales;
use grainwake_solver::sim::Setup;

use super::check::Checker;
use crate::case::located::Located;
use crate::case::quantity::Quantity;
use crate::case::raw::{RawScales, ScalePreset, ScaleTable};

const GIVE: &str = "give them: scales = { length = \"2 mm\", velocity = \"0.1 m/s\" }";

/// Returns the scales and writes them as numbers.
pub(super) fn scales(
    check: &mut Checker,
    raw: &mut Option<Located<RawScales>>,
    setup: &Setup,
) -> Option<Scales> {
    let raw = raw.as_mut()?;
    let found = match &raw.value {
        RawScales::Preset(preset) => of_preset(*preset, setup)
            .map_err(|(message, help)| check.fail(&raw.span, message, help)),
        RawScales::Given(table) => given(check, table, setup).ok_or(()),
    };
    let scales = found.ok()?;
    raw.value = RawScales::Given(ScaleTable {
        length: Quantity::new(scales.length_m).into(),
        time: Some(Quantity::new(scales.time_s).into()),
        velocity: Some(Quantity::new(scales.velocity_m_per_s).into()),
        density: Some(Quantity::new(scales.density_kg_per_m3).into()),
    });
    Some(scales)
}

/// Mean of a property of the grains; `None` without grains.
fn mean(setup: &Setup, of: impl Fn(&grainwake_solver::dem::Grain) -> f64) -> Option<f64> {
    let count = setup.grains.len();
    (count > 0).then(|| setup.grains.iter().map(of).sum::<f64>() / count as f64)
}

/// Density of the fluid, or the mean density of the grains [kg/m3].
fn density(setup: &Setup) -> f64 {
    let fluid = setup.fluid.map(|fluid| fluid.density);
    fluid.or_else(|| mean(setup, |grain| grain.density)).unwrap_or(1.0)
}

/// Returns the scales of a preset; the error is a message and a help.
fn of_preset(preset: ScalePreset, setup: &Setup) -> Result<Scales, (String, String)> {
    let refused = |what: &str, help: &str| Err((what.to_owned(), help.to_owned()));
    let g = setup.gravity.length();
    let Some(length) = mean(setup, |grain| grain.shape.equivalent_diameter()) else {
        return refused("there is no grain whose diameter could be the length", GIVE);
    };
    let gravity = |factor: f64| (factor * g * length).sqrt();
    let velocity = match (preset, &setup.fluid) {
        (ScalePreset::Gravity | ScalePreset::Buoyancy, _) if g == 0.0 => {
            return refused("there is no gravity", GIVE);
        }
        (ScalePreset::Gravity, _) => gravity(1.0),
        (ScalePreset::Buoyancy, None) => {
            return refused("there is no fluid", "use scales = \"gravity\"");
        }
        (ScalePreset::Buoyancy, Some(fluid)) => {
            let mean = mean(setup, |grain| grain.density).unwrap_or(fluid.density);
            let excess = (mean / fluid.density - 1.0).abs();
            if excess < 1e-9 {
                let what = "the mean density of the grains is that of the fluid";
                return refused(what, "use scales = \"viscous\", or give them");
            }
            gravity(excess)
        }
        (ScalePreset::Viscous, None) => return refused("there is no fluid", GIVE),
        (ScalePreset::Viscous, Some(fluid)) => fluid.kinematic_viscosity / length,
    };
    Ok(Scales {
        length_m: length,
        time_s: length / velocity,
        velocity_m_per_s: velocity,
        density_kg_per_m3: density(setup),
    })
}

/// Returns the scales of a table.
fn given(check: &mut Checker, table: &ScaleTable, setup: &Setup) -> Option<Scales> {
    let length = check.positive(&table.length, "the length scale");
    let time = table.time.as_ref().map(|time| check.positive(time, "the time scale"));
    let velocity = table.velocity.as_ref().map(|v| check.positive(v, "the velocity scale"));
    let given = table.density.as_ref().map(|d| check.positive(d, "the density scale"));
    let density = given.unwrap_or_else(|| Some(density(setup)))?;
    let length = length?;
    let (time, velocity) = match (time, velocity) {
        (Some(time), Some(velocity)) => (time?, velocity?),
        (Some(time), None) => (time?, length / time?),
        (None, Some(velocity)) => (length / velocity?, velocity?),
        (None, None) => {
            let message = "a length alone gives no time and no velocity";
            return check.refuse(&table.length.span, message, "add `time` or `velocity`");
        }
    };
    Some(Scales {
        length_m: length,
        time_s: time,
        velocity_m_per_s: velocity,
        density_kg_per_m3: density,
    })
}
