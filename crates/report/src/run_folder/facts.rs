//! Set-up of a run, from `case.resolved.toml` and `summary.json`.

use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec3;
use grainwake_formats::{FormatError, read_text};
use serde_json::Value;

use crate::error::ReportError;

/// A grain as described by the case and the summary.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GrainFacts {
    /// Diameter of the sphere of equal volume [m].
    pub diameter: Option<f64>,
    /// Density [kg/m^3].
    pub density: Option<f64>,
    /// Name of its closed form, or its file.
    pub shape: Option<String>,
}

/// Set-up of a run; entries that the folder does not hold are `None`.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// Title of the case, one line.
    pub title: Option<String>,
    /// Lower corner of the box [m].
    pub lower: DVec3,
    /// Edge lengths of the box [m].
    pub size: Option<DVec3>,
    /// Cells along x, y, z; `None` for a dry run.
    pub cells: Option<[usize; 3]>,
    /// Conditions on the faces, `[axis][side]`.
    pub boundaries: Option<[[String; 2]; 3]>,
    /// Gravity [m/s^2].
    pub gravity: Option<DVec3>,
    /// Density of the fluid [kg/m^3]; `None` for a dry run.
    pub fluid_density: Option<f64>,
    /// Kinematic viscosity of the fluid [m^2/s].
    pub viscosity: Option<f64>,
    /// Velocity of the inflow [m/s]: zero without one, `None` if it differs between faces.
    pub inflow: Option<DVec3>,
    /// Coupling scheme; `None` for a dry run.
    pub scheme: Option<String>,
    /// Whether the fields are in single precision.
    pub single_precision: bool,
    /// Cells of the refined box per cell of the whole one; `None` without a refined box.
    pub refinement: Option<u64>,
    /// Contact law; `None` for the linear one.
    pub contact_law: Option<String>,
    /// Numbers of `[contact]` by key.
    pub contact: BTreeMap<String, f64>,
    /// Grains.
    pub grains: Vec<GrainFacts>,
}

impl Facts {
    /// Returns the cell edge along x [m].
    pub fn cell(&self) -> Option<f64> {
        Some(self.size?.x / self.cells?[0] as f64)
    }

    /// Returns the speed of a grain relative to the inflow [m/s].
    pub fn relative_speed(&self, velocity: DVec3) -> Option<f64> {
        Some((velocity - self.inflow?).length())
    }

    /// Returns the symbol of the relative speed, in label markup.
    pub fn relative_speed_symbol(&self) -> &'static str {
        if self.has_inflow() { "|*v* − *U*|" } else { "|*v*|" }
    }

    /// Returns whether fluid enters through a face.
    pub fn has_inflow(&self) -> bool {
        self.inflow.is_some_and(|inflow| inflow != DVec3::ZERO)
    }

    /// Returns the mean of the known values of all grains.
    fn mean(&self, value: fn(&GrainFacts) -> Option<f64>) -> Option<f64> {
        let known: Vec<f64> = self.grains.iter().filter_map(value).collect();
        (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
    }

    /// Returns the mean equivalent diameter of the grains [m].
    pub fn diameter(&self) -> Option<f64> {
        self.mean(|grain| grain.diameter)
    }

    /// Returns the mean density of the grains divided by that of the fluid.
    pub fn density_ratio(&self) -> Option<f64> {
        Some(self.mean(|grain| grain.density)? / self.fluid_density?)
    }

    /// Returns whether a grain is a sphere.
    pub fn is_sphere(&self, grain: usize) -> bool {
        let facts = self.grains.get(grain);
        facts.is_some_and(|facts| facts.shape.as_deref() == Some("sphere"))
    }

    /// Sets the diameters [m] of grains whose diameter is unknown.
    pub fn add_diameters(&mut self, known: impl Iterator<Item = (usize, f64)>) {
        for (grain, diameter) in known {
            self.reserve_grains(grain + 1);
            self.grains[grain].diameter.get_or_insert(diameter);
        }
    }

    fn reserve_grains(&mut self, count: usize) {
        let count = count.max(self.grains.len());
        self.grains.resize_with(count, GrainFacts::default);
    }
}

/// Reads the resolved case file: SI numbers, with all defaults.
pub fn read_case(file: &Path) -> Result<Facts, ReportError> {
    let text = read_text(file)?;
    let case: Value = toml::from_str(&text).map_err(|error: toml::de::Error| {
        let start = error.span().map_or(0, |span| span.start.min(text.len()));
        let line = 1 + text[..start].matches('\n').count();
        FormatError::line(file, line, error.message())
    })?;
    Ok(facts_of(&case))
}

/// Extracts the set-up; entries of a wrong type count as missing.
fn facts_of(case: &Value) -> Facts {
    let density = number(case, "/fluid/density");
    let kinematic = number(case, "/fluid/kinematic_viscosity");
    let dynamic = number(case, "/fluid/viscosity");
    let faces = case.pointer("/domain/boundaries");
    let cells = list(case, "/domain/cells", |n| n.as_u64().filter(|n| *n > 0));
    let sides = ["x", "y", "z"].map(|axis| sides(faces.and_then(|faces| faces.get(axis))));
    // A dry run has no grid, though its resolved case holds the keys.
    let wet = density.is_some();
    Facts {
        title: text(case, "/title").filter(|title| !title.is_empty()),
        lower: vector(case, "/domain/origin").unwrap_or(DVec3::ZERO),
        size: vector(case, "/domain/size").filter(|size| size.min_element() > 0.0),
        cells: cells.filter(|_| wet).map(|cells| cells.map(|n| n as usize)),
        boundaries: faces.map(|_| sides.map(|pair| pair.map(condition))),
        inflow: inflow(sides.as_flattened()),
        gravity: vector(case, "/gravity"),
        fluid_density: density,
        viscosity: kinematic.or_else(|| Some(dynamic? / density?)),
        scheme: text(case, "/coupling/scheme").filter(|_| wet),
        single_precision: wet && text(case, "/run/precision").as_deref() == Some("f32"),
        refinement: case.pointer("/domain/refinement").and_then(Value::as_u64).filter(|n| *n > 1),
        contact_law: text(case, "/contact/law"),
        contact: contact_parameters(case),
        grains: case
            .get("grain")
            .and_then(Value::as_array)
            .map_or(Vec::new(), |grains| grains.iter().map(grain_of).collect()),
    }
}

/// Returns the numbers of `[contact]` by key.
fn contact_parameters(case: &Value) -> BTreeMap<String, f64> {
    let table = case.get("contact").and_then(Value::as_object).into_iter().flatten();
    table.filter_map(|(key, value)| Some((key.clone(), value.as_f64()?))).collect()
}

fn text(value: &Value, path: &str) -> Option<String> {
    value.pointer(path)?.as_str().map(str::to_owned)
}

fn number(value: &Value, path: &str) -> Option<f64> {
    value.pointer(path)?.as_f64()
}

fn vector(value: &Value, path: &str) -> Option<DVec3> {
    list(value, path, Value::as_f64).map(DVec3::from_array)
}

/// Returns a list of three entries.
fn list<T>(value: &Value, path: &str, entry: fn(&Value) -> Option<T>) -> Option<[T; 3]> {
    let entries = value.pointer(path)?.as_array()?.iter().map(entry);
    entries.collect::<Option<Vec<T>>>()?.try_into().ok()
}

/// Returns the entries of the lower and the upper face normal to an axis.
fn sides(axis: Option<&Value>) -> [Option<&Value>; 2] {
    match axis {
        Some(Value::Array(pair)) if pair.len() == 2 => [Some(&pair[0]), Some(&pair[1])],
        both => [both; 2],
    }
}

/// Returns the kind of condition on a face.
fn kind(face: &Value) -> Option<&str> {
    face.as_str().or_else(|| face.get("kind")?.as_str())
}

/// Returns the condition on a face in words.
fn condition(face: Option<&Value>) -> String {
    let kind = face.and_then(kind).unwrap_or("?");
    let velocity = face.and_then(|face| vector(face, "/velocity"));
    let moves = kind == "wall" && velocity.is_some_and(|velocity| velocity != DVec3::ZERO);
    format!("{kind}{}", if moves { " (moving)" } else { "" })
}

/// Returns the velocity of the inflow through these faces [m/s]; zero without an inflow, `None` if
/// it differs between them.
fn inflow(faces: &[Option<&Value>]) -> Option<DVec3> {
    let inflows = faces.iter().flatten().filter(|face| kind(face) == Some("inflow"));
    let velocities: Vec<DVec3> =
        inflows.map(|face| vector(face, "/velocity")).collect::<Option<_>>()?;
    let first = velocities.first().copied().unwrap_or(DVec3::ZERO);
    velocities.iter().all(|velocity| *velocity == first).then_some(first)
}

fn grain_of(grain: &Value) -> GrainFacts {
    let form = text(grain, "/shape/kind");
    let sphere = form.as_deref() == Some("sphere");
    let own = || number(grain, "/shape/diameter").filter(|_| sphere);
    let diameter = number(grain, "/equivalent_diameter").or_else(own);
    GrainFacts {
        diameter: diameter.filter(|d| *d > 0.0),
        density: number(grain, "/density"),
        shape: form.or_else(|| text(grain, "/file")),
    }
}

/// Reads a JSON file; an error names the line.
pub fn read_json(file: &Path) -> Result<Value, ReportError> {
    let text = read_text(file)?;
    let value = serde_json::from_str(&text);
    Ok(value.map_err(|error| FormatError::line(file, error.line().max(1), error.to_string()))?)
}

/// Adds the properties of the grains in the summary.
pub fn add_summary(facts: &mut Facts, summary: &Value) {
    let Some(list) = summary.get("grains").and_then(Value::as_array) else {
        return;
    };
    facts.reserve_grains(list.len());
    for (grain, entry) in facts.grains.iter_mut().zip(list) {
        let positive = |path: &str| number(entry, path).filter(|v| *v > 0.0);
        grain.diameter = positive("/equivalent_diameter_m").or(grain.diameter);
        let density = positive("/density").or_else(|| positive("/density_kg_per_m3"));
        grain.density = density.or(grain.density);
        grain.shape = grain.shape.take().or_else(|| text(entry, "/shape"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Facts {
        facts_of(&toml::from_str(text).unwrap())
    }

    #[test]
    fn a_resolved_case_is_understood() {
        let facts = read(
            "gravity = [0.0, 0.0, -9.81]\n\
            [domain]\nsize = [0.025, 0.025, 0.0975]\ncells = [100, 100, 390]\norigin = [0.0, 0.0, 0.0]\n\
            [domain.boundaries]\nx = ['wall', 'wall']\ny = 'slip'\nz = ['wall', { kind = 'wall', velocity = [1, 0, 0] }]\n\
            [fluid]\ndensity = 1000.0\nviscosity = 0.001\n\
            [[grain]]\nfile = 'a.grain'\ndensity = 1500\nequivalent_diameter = 2e-3\n\
            [[grain]]\nshape = { kind = 'sphere', diameter = 4e-3 }\ndensity = 1500.0\n",
        );
        assert_eq!(facts.gravity, Some(DVec3::new(0.0, 0.0, -9.81)));
        assert_eq!(facts.viscosity, Some(1e-6));
        assert_eq!(facts.cell(), Some(0.00025));
        assert_eq!(facts.diameter(), Some(3e-3));
        assert_eq!(facts.grains[0].shape.as_deref(), Some("a.grain"));
        assert!(facts.refinement.is_none() && facts.contact.is_empty());
        let faces = facts.boundaries.unwrap();
        assert_eq!(faces[1], ["slip", "slip"]);
        assert_eq!(faces[2], ["wall", "wall (moving)"]);
        assert_eq!(facts.inflow, Some(DVec3::ZERO));
    }

    #[test]
    fn a_dry_run_has_no_grid() {
        let text = "[domain]\nsize = [1, 1, 2]\ncells = [1, 1, 1]\n\
                    [coupling]\nscheme = 'aperture'\n[run]\nprecision = 'f32'\n";
        let facts = read(text);
        assert!(facts.cell().is_none() && facts.scheme.is_none() && !facts.single_precision);
        let facts = read(&format!("{text}[fluid]\ndensity = 1000\n"));
        assert!(facts.cell().is_some() && facts.scheme.is_some() && facts.single_precision);
    }

    #[test]
    fn an_inflow_is_no_moving_wall() {
        let with = |z: &str| read(&format!("[domain.boundaries]\nx = 'slip'\nz = {z}\n"));
        let inflow = "{ kind = 'inflow', velocity = [0, 0.0, 0.1] }";
        let facts = with(&format!("[{inflow}, 'outflow']"));
        assert_eq!(facts.boundaries.as_ref().unwrap()[2], ["inflow", "outflow"]);
        assert!(facts.has_inflow());
        let speed = facts.relative_speed(DVec3::new(0.03, 0.0, 0.06)).unwrap();
        assert!((speed - 0.05).abs() < 1e-15, "{speed}");
        let facts = with(&format!("[{inflow}, {{ kind = 'inflow', velocity = [0, 0, -0.1] }}]"));
        assert_eq!(facts.relative_speed(DVec3::ZERO), None);
        let facts = with("{ kind = 'wall', velocity = [0, 0, 0] }");
        assert_eq!(facts.boundaries.unwrap()[2], ["wall", "wall"]);
    }

    #[test]
    fn the_summary_fills_gaps() {
        let mut facts = read("[[grain]]\nfile = 'a.grain'\ndensity = 1500\n");
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
    fn entries_of_a_wrong_type_count_as_missing() {
        let facts = read(
            "[domain]\nsize = [1, 'x', 2]\ncells = [0, 1, 2]\ngravity = 3\n\
             [fluid]\nviscosity = nan\n",
        );
        assert!(
            facts.size.is_none()
                && facts.cells.is_none()
                && facts.gravity.is_none()
                && facts.viscosity.is_none()
        );
    }
}
