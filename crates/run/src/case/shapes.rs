//! Shapes of a case: `.grain` files and closed forms, each built once and shared.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use grainwake_shape::{Shape, ShapeError, ShapeOptions, analytic};

use super::loc::Loc;
use super::quantity::{Length, Quantity};
use super::raw::{RawShape, ShapeKind};

/// Nodes of a closed form where none are asked for.
pub(super) const DEFAULT_NODES: usize = 2000;

/// A `.grain` file that a case uses.
#[derive(Clone, Debug)]
pub struct ShapeFile {
    /// Name in the run folder, "shapes/x.grain".
    pub name: String,
    /// Where it was read from.
    pub source: PathBuf,
    /// Its contents.
    pub bytes: Arc<Vec<u8>>,
}

/// Why a shape could not be had: what is wrong, and what to do.
pub(super) type Refusal = (String, String);

/// Every shape that has been asked for.
pub(super) struct Library<'a> {
    folder: &'a Path,
    files: BTreeMap<PathBuf, (ShapeFile, Arc<Shape>)>,
    built: BTreeMap<String, Arc<Shape>>,
}

impl<'a> Library<'a> {
    /// Files are looked for relative to `folder`.
    pub fn new(folder: &'a Path) -> Library<'a> {
        Library {
            folder,
            files: BTreeMap::new(),
            built: BTreeMap::new(),
        }
    }

    /// The files that were read, by name.
    pub fn into_files(self) -> Vec<ShapeFile> {
        self.files.into_values().map(|(file, _)| file).collect()
    }

    /// A shape from a file and the file's name in the run folder.
    pub fn file(&mut self, name: &str) -> Result<(Arc<Shape>, String), Refusal> {
        let path = self.folder.join(name);
        if let Some((file, shape)) = self.files.get(&path) {
            return Ok((shape.clone(), file.name.clone()));
        }
        let bytes = std::fs::read(&path).map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => (
                format!("there is no grain file {}", path.display()),
                "paths are relative to the case file; make a grain file with `grainwake grain from-scan`, `from-mesh` or `make`".to_string(),
            ),
            _ => (format!("cannot read {}: {error}", path.display()), "check the file and its permissions".to_string()),
        })?;
        let shape = Shape::from_bytes(&bytes, &path).map_err(|error| {
            let help = "a case takes .grain files; make one with `grainwake grain from-scan`, `from-mesh` or `make`";
            (error.to_string(), help.to_string())
        })?;
        let stem = path
            .file_stem()
            .map_or_else(|| "grain".into(), |s| s.to_string_lossy().into_owned());
        let taken = |candidate: &str| self.files.values().any(|(f, _)| f.name == candidate);
        let mut name = format!("shapes/{stem}.grain");
        let mut count = 1;
        while taken(&name) {
            count += 1;
            name = format!("shapes/{stem}-{count}.grain");
        }
        let shape = Arc::new(shape);
        let file = ShapeFile {
            name: name.clone(),
            source: path.clone(),
            bytes: Arc::new(bytes),
        };
        self.files.insert(path, (file, shape.clone()));
        Ok((shape, name))
    }

    /// A closed form.
    pub fn closed_form(
        &mut self,
        raw: &RawShape,
        nodes: Option<usize>,
    ) -> Result<Arc<Shape>, Refusal> {
        let nodes = nodes.unwrap_or(DEFAULT_NODES);
        let key = format!("{raw:?} {nodes}");
        if let Some(shape) = self.built.get(&key) {
            return Ok(shape.clone());
        }
        let shape = Arc::new(build(raw, nodes)?);
        self.built.insert(key, shape.clone());
        Ok(shape)
    }

    /// `shape` rescaled to an equal-volume diameter [m].
    pub fn rescaled(&mut self, shape: &Arc<Shape>, diameter: f64) -> Result<Arc<Shape>, Refusal> {
        let key = format!("{:p} {diameter:?}", Arc::as_ptr(shape));
        if let Some(shape) = self.built.get(&key) {
            return Ok(shape.clone());
        }
        let scaled = shape.scaled_to_equivalent_diameter(diameter);
        let scaled = Arc::new(
            scaled.map_err(|error| (error.to_string(), "give a positive length".to_string()))?,
        );
        self.built.insert(key, scaled.clone());
        Ok(scaled)
    }
}

/// Which sizes belong to which kind: diameter, height, size, radius, exponents.
fn wanted(kind: ShapeKind) -> [bool; 5] {
    match kind {
        ShapeKind::Sphere => [true, false, false, false, false],
        ShapeKind::Ellipsoid => [false, false, true, false, false],
        ShapeKind::RoundedBox => [false, false, true, true, false],
        ShapeKind::Cylinder | ShapeKind::Capsule => [true, true, false, false, false],
        ShapeKind::Superquadric => [false, false, true, false, true],
    }
}

const SIZES: [&str; 5] = ["diameter", "height", "size", "radius", "exponents"];

/// Checks that exactly the sizes of this kind are given, and builds it.
fn build(raw: &RawShape, nodes: usize) -> Result<Shape, Refusal> {
    let given = [
        raw.diameter.is_some(),
        raw.height.is_some(),
        raw.size.is_some(),
        raw.radius.is_some(),
        raw.exponents.is_some(),
    ];
    let wanted = wanted(raw.kind.value);
    let list = |which: [bool; 5]| {
        SIZES
            .iter()
            .zip(which)
            .filter(|(_, w)| *w)
            .map(|(n, _)| *n)
            .collect::<Vec<_>>()
            .join(", ")
    };
    for i in 0..5 {
        if wanted[i] != given[i] {
            let message = if wanted[i] {
                format!("`{}` is missing", SIZES[i])
            } else {
                format!("`{}` does not belong to this shape", SIZES[i])
            };
            return Err((message, format!("this kind takes: {}", list(wanted))));
        }
    }
    construct(raw, nodes)
}

fn construct(raw: &RawShape, nodes: usize) -> Result<Shape, Refusal> {
    let options = ShapeOptions {
        nodes: Some(nodes),
        ..ShapeOptions::default()
    };
    let length = |value: &Option<Loc<Quantity<Length>>>| value.as_ref().map_or(f64::NAN, |v| v.si);
    let [a, b, c] = raw.size.as_ref().map_or([f64::NAN; 3], |v| v.si.to_array());
    let exponents = raw.exponents.as_ref().map_or([f64::NAN; 2], |e| e.value);
    let shape = match raw.kind.value {
        ShapeKind::Sphere => analytic::sphere(0.5 * length(&raw.diameter), &options),
        ShapeKind::Ellipsoid => analytic::ellipsoid(0.5 * a, 0.5 * b, 0.5 * c, &options),
        ShapeKind::RoundedBox => analytic::rounded_box(a, b, c, length(&raw.radius), &options),
        ShapeKind::Cylinder => {
            analytic::cylinder(0.5 * length(&raw.diameter), length(&raw.height), &options)
        }
        ShapeKind::Capsule => {
            analytic::capsule(0.5 * length(&raw.diameter), length(&raw.height), &options)
        }
        ShapeKind::Superquadric => analytic::superquadric(
            [0.5 * a, 0.5 * b, 0.5 * c],
            exponents[0],
            exponents[1],
            &options,
        ),
    };
    shape.map_err(|error| {
        let help = match error {
            ShapeError::BadParameter { name: "nodes", .. } => {
                "give another number of surface nodes; without `nodes` there are about 2000"
            }
            _ => "change the sizes of this shape",
        };
        (error.to_string(), help.to_string())
    })
}
