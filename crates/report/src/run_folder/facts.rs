//! What was run: the parts of `case.resolved.toml` and `summary.json` that a report speaks of.

use std::path::Path;

use glam::DVec3;
use serde_json::Value as Json;
use toml::{Table, Value};

use grainwake_formats::{FormatError, read_text};

use crate::error::ReportError;

/// A grain as the case and the summary describe it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GrainFacts {
    /// Diameter of the sphere of equal volume [m].
    pub diameter: Option<f64>,
    /// Density [kg/m^3].
    pub density: Option<f64>,
    /// What it is: a closed form or a file.
    pub shape: Option<String>,
}

/// The set-up of a run; what the folder does not tell is none.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// One line that says what the case is.
    pub title: Option<String>,
    /// Lower corner of the box [m].
    pub lower: DVec3,
    /// Edge lengths of the box [m].
    pub size: Option<DVec3>,
    /// Cells along x, y, z.
    pub cells: Option<[usize; 3]>,
    /// Conditions on the faces, `[axis][side]`.
    pub boundaries: Option<[[String; 2]; 3]>,
    /// Gravity [m/s^2].
    pub gravity: Option<DVec3>,
    /// Density of the fluid [kg/m^3]; none for a dry run.
    pub fluid_density: Option<f64>,
    /// Kinematic viscosity of the fluid [m^2/s].
    pub viscosity: Option<f64>,
    /// Coupling scheme.
    pub scheme: Option<String>,
    /// Whether the fields are in single precision.
    pub single_precision: bool,
    /// The grains.
    pub grains: Vec<GrainFacts>,
}

impl Facts {
    /// Cell edge along x [m].
    pub fn cell(&self) -> Option<f64> {
        Some(self.size?.x / self.cells?[0] as f64)
    }

    /// Mean equal-volume diameter of the grains [m].
    pub fn diameter(&self) -> Option<f64> {
        let known: Vec<f64> = self
            .grains
            .iter()
            .filter_map(|grain| grain.diameter)
            .collect();
        (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
    }

    /// Takes the diameters [m] of grains whose diameter is not known otherwise.
    pub fn add_diameters(&mut self, known: impl Iterator<Item = (usize, f64)>) {
        for (grain, diameter) in known {
            if self.grains.len() <= grain {
                self.grains.resize_with(grain + 1, GrainFacts::default);
            }
            self.grains[grain].diameter.get_or_insert(diameter);
        }
    }

    /// Mean density of the grains [kg/m^3].
    pub fn grain_density(&self) -> Option<f64> {
        let known: Vec<f64> = self
            .grains
            .iter()
            .filter_map(|grain| grain.density)
            .collect();
        (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
    }
}

/// Reads the case file as it was resolved: SI numbers, all defaults spelled out.
pub fn read_case(file: &Path) -> Result<Facts, ReportError> {
    let text = read_text(file)?;
    let table: Table = text.parse().map_err(|error: toml::de::Error| {
        let line = error.span().map_or(1, |span| {
            1 + text[..span.start.min(text.len())].matches('\n').count()
        });
        FormatError::line(file, line, error.message())
    })?;
    Ok(facts_of(&table))
}

fn facts_of(table: &Table) -> Facts {
    let empty = Table::new();
    let section = |name: &str| table.get(name).and_then(Value::as_table).unwrap_or(&empty);
    let (domain, fluid) = (section("domain"), section("fluid"));
    let faces = domain.get("boundaries").and_then(Value::as_table);
    let boundaries = faces.map(|faces| ["x", "y", "z"].map(|axis| faces_of(faces.get(axis))));
    let density = number(fluid, "density");
    let dynamic = number(fluid, "viscosity");
    let kinematic = number(fluid, "kinematic_viscosity");
    Facts {
        title: word(table, "title"),
        lower: vector(domain, "origin").unwrap_or(DVec3::ZERO),
        size: vector(domain, "size").filter(|size| size.min_element() > 0.0),
        cells: cells_of(domain),
        boundaries,
        gravity: vector(table, "gravity"),
        fluid_density: density,
        viscosity: kinematic.or_else(|| Some(dynamic? / density?)),
        scheme: word(section("coupling"), "scheme"),
        single_precision: word(section("run"), "precision").as_deref() == Some("f32"),
        grains: table
            .get("grain")
            .and_then(Value::as_array)
            .into_iter()
            .flatten()
            .map(grain_of)
            .collect(),
    }
}

fn word(table: &Table, name: &str) -> Option<String> {
    table
        .get(name)?
        .as_str()
        .map(str::to_owned)
        .filter(|word| !word.is_empty())
}

fn number(table: &Table, name: &str) -> Option<f64> {
    as_number(table.get(name)?)
}

fn as_number(value: &Value) -> Option<f64> {
    value
        .as_float()
        .or_else(|| value.as_integer().map(|i| i as f64))
        .filter(|v| v.is_finite())
}

fn vector(table: &Table, name: &str) -> Option<DVec3> {
    let list = table.get(name)?.as_array()?;
    let numbers: Vec<f64> = list.iter().filter_map(as_number).collect();
    (numbers.len() == 3).then(|| DVec3::from_slice(&numbers))
}

fn cells_of(domain: &Table) -> Option<[usize; 3]> {
    let list: Vec<usize> = domain
        .get("cells")?
        .as_array()?
        .iter()
        .filter_map(|v| usize::try_from(v.as_integer()?).ok().filter(|n| *n > 0))
        .collect();
    list.try_into().ok()
}

fn faces_of(axis: Option<&Value>) -> [String; 2] {
    let kind = |value: &Value| {
        let word = value
            .as_str()
            .or_else(|| value.get("kind")?.as_str())
            .unwrap_or("?");
        let moving = value.get("velocity").is_some();
        if moving {
            format!("{word} (moving)")
        } else {
            word.to_owned()
        }
    };
    match axis {
        Some(Value::Array(pair)) if pair.len() == 2 => [kind(&pair[0]), kind(&pair[1])],
        Some(one) => [kind(one), kind(one)],
        None => ["?".to_owned(), "?".to_owned()],
    }
}

fn grain_of(value: &Value) -> GrainFacts {
    let empty = Table::new();
    let grain = value.as_table().unwrap_or(&empty);
    let form = grain.get("shape").and_then(Value::as_table);
    let kind = form
        .and_then(|form| form.get("kind"))
        .and_then(Value::as_str);
    let round = kind == Some("sphere");
    let diameter = number(grain, "equivalent_diameter")
        .or_else(|| {
            form.filter(|_| round)
                .and_then(|form| number(form, "diameter"))
        })
        .filter(|d| *d > 0.0);
    let file = grain.get("file").and_then(Value::as_str);
    GrainFacts {
        diameter,
        density: number(grain, "density"),
        shape: kind.or(file).map(str::to_owned),
    }
}

/// Reads a JSON file; the line of a damage is named.
pub fn read_json(file: &Path) -> Result<Json, ReportError> {
    let text = read_text(file)?;
    serde_json::from_str(&text)
        .map_err(|error| FormatError::line(file, error.line().max(1), error.to_string()).into())
}

/// Fills in what the summary knows of the grains.
pub fn add_summary(facts: &mut Facts, summary: &Json) {
    let Some(list) = summary.get("grains").and_then(Json::as_array) else {
        return;
    };
    if facts.grains.len() < list.len() {
        facts.grains.resize_with(list.len(), GrainFacts::default);
    }
    for (grain, entry) in facts.grains.iter_mut().zip(list) {
        let number = |name: &str| {
            entry
                .get(name)
                .and_then(Json::as_f64)
                .filter(|v| v.is_finite() && *v > 0.0)
        };
        grain.diameter = number("equivalent_diameter_m").or(grain.diameter);
        grain.density = number("density")
            .or_else(|| number("density_kg_per_m3"))
            .or(grain.density);
        let shape = entry.get("shape").and_then(Json::as_str).map(str::to_owned);
        grain.shape = grain.shape.take().or(shape);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resolved_case_is_understood() {
        let table: Table = "gravity = [0.0, 0.0, -9.81]\n\
            [domain]\nsize = [0.025, 0.025, 0.0975]\ncells = [100, 100, 390]\norigin = [0.0, 0.0, 0.0]\n\
            [domain.boundaries]\nx = ['wall', 'wall']\ny = 'slip'\nz = ['wall', { kind = 'wall', velocity = [1, 0, 0] }]\n\
            [fluid]\ndensity = 1000.0\nviscosity = 0.001\n\
            [[grain]]\nfile = 'a.grain'\ndensity = 1500\nequivalent_diameter = 2e-3\n\
            [[grain]]\nshape = { kind = 'sphere', diameter = 4e-3 }\ndensity = 1500.0\n"
            .parse()
            .unwrap();
        let facts = facts_of(&table);
        assert_eq!(facts.gravity, Some(DVec3::new(0.0, 0.0, -9.81)));
        assert_eq!(facts.viscosity, Some(1e-6));
        assert_eq!(facts.cell(), Some(0.00025));
        assert_eq!(facts.diameter(), Some(3e-3));
        assert_eq!(facts.grains[0].shape.as_deref(), Some("a.grain"));
        let faces = facts.boundaries.unwrap();
        assert_eq!(faces[1], ["slip", "slip"]);
        assert_eq!(faces[2], ["wall", "wall (moving)"]);
    }

    #[test]
    fn the_summary_fills_gaps() {
        let mut facts = facts_of(
            &"[[grain]]\nfile = 'a.grain'\ndensity = 1500\n"
                .parse()
                .unwrap(),
        );
        let summary = serde_json::json!({"grains": [{"equivalent_diameter_m": 2e-3}, {"density": 7800.0, "shape": "ball"}]});
        add_summary(&mut facts, &summary);
        assert_eq!(
            facts.grains[0],
            GrainFacts {
                diameter: Some(2e-3),
                density: Some(1500.0),
                shape: Some("a.grain".into())
            }
        );
        assert_eq!(facts.grains[1].density, Some(7800.0));
    }

    #[test]
    fn nonsense_is_left_out_rather_than_believed() {
        let facts = facts_of(&"[domain]\nsize = [1, 'x', 2]\ncells = [0, 1, 2]\ngravity = 3\n[fluid]\nviscosity = nan\n".parse().unwrap());
        assert!(
            facts.size.is_none()
                && facts.cells.is_none()
                && facts.gravity.is_none()
                && facts.viscosity.is_none()
        );
    }
}
