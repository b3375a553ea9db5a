//! Shapes of a case: `.grain` files and closed forms. Grains of equal shape share it.

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use grainwake_formats::bounded_file::read_bytes;
use grainwake_shape::{ReadLimits, Shape, ShapeError, ShapeOptions, analytic};

use super::located::Located;
use super::quantity::{Length, Quantity};
use super::raw::{RawShape, ShapeKind};

/// Default number of surface nodes of a closed form.
pub(super) const DEFAULT_NODES: usize = 2000;

/// `.grain` file of a case: name in the run folder, "shapes/x.grain", and contents.
pub type ShapeFile = (String, Arc<Vec<u8>>);

/// Message and help of a shape that cannot be built.
pub(super) type Refusal = (String, String);

/// Largest number of closed forms that are kept.
const KEPT: usize = 64;

/// Closed forms that several cases share, so that each is built once; the oldest are dropped beyond
/// 64.
#[derive(Debug, Default)]
pub struct ClosedForms {
    /// Shapes with their definitions, the oldest first.
    known: Mutex<VecDeque<(String, Arc<Shape>)>>,
}

impl ClosedForms {
    /// Returns the shape with this definition; it is built if it is not known.
    fn get(
        &self,
        definition: String,
        build: impl FnOnce() -> Result<Shape, Refusal>,
    ) -> Result<Arc<Shape>, Refusal> {
        // The list stays valid if another thread panics.
        let lock = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let find = |known: &VecDeque<(String, Arc<Shape>)>| {
            known.iter().find(|(key, _)| *key == definition).map(|(_, shape)| shape.clone())
        };
        if let Some(shape) = find(&lock()) {
            return Ok(shape);
        }
        // Without the lock, because threads may work for each other while one builds a shape.
        let shape = Arc::new(build()?);
        let mut known = lock();
        if let Some(shape) = find(&known) {
            return Ok(shape);
        }
        if known.len() >= KEPT {
            known.pop_front();
        }
        known.push_back((definition, shape.clone()));
        Ok(shape)
    }
}

/// Cache of the shapes of a case.
pub(super) struct Library<'a> {
    folder: PathBuf,
    /// Contents of files that need not be read, by path.
    known: BTreeMap<PathBuf, Arc<Vec<u8>>>,
    shared: &'a ClosedForms,
    files: BTreeMap<PathBuf, (ShapeFile, Arc<Shape>)>,
    built: BTreeMap<String, Arc<Shape>>,
}

impl<'a> Library<'a> {
    /// Returns an empty cache; files are relative to `folder`, closed forms are `shared`.
    pub fn new(folder: &Path, shared: &'a ClosedForms) -> Library<'a> {
        let (known, files, built) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        Library { folder: folder.into(), known, shared, files, built }
    }

    /// Adds the contents of files by path, which are used in place of those on the disk.
    pub fn knowing(mut self, files: impl Iterator<Item = (PathBuf, Arc<Vec<u8>>)>) -> Library<'a> {
        self.known.extend(files);
        self
    }

    /// Returns a library of these files alone, by name.
    pub fn of_files(files: &[ShapeFile], shared: &'a ClosedForms) -> Result<Library<'a>, Refusal> {
        let mut library = Library::new(Path::new(""), shared);
        for file in files {
            let shape = library.shape(&file.1, Path::new(&file.0))?;
            library.files.insert(PathBuf::from(&file.0), (file.clone(), shape));
        }
        Ok(library)
    }

    /// Returns the path of a file that the case names.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Returns the files that were read, with their paths.
    pub fn into_files(self) -> impl Iterator<Item = (PathBuf, ShapeFile)> {
        self.files.into_iter().map(|(path, (file, _))| (path, file))
    }

    /// Returns the shape in a file, and the file's name in the run folder.
    pub fn file(&mut self, name: &str) -> Result<(Arc<Shape>, String), Refusal> {
        let path = self.folder.join(name);
        if let Some((file, shape)) = self.files.get(&path) {
            return Ok((shape.clone(), file.0.clone()));
        }
        let limit = ReadLimits::default().file_bytes;
        let read = || read_bytes(&path, limit).map(Arc::new);
        let known = self.known.get(&path).cloned();
        let bytes = known.map_or_else(read, Ok).map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => (
                format!("there is no grain file {}", path.display()),
                "paths are relative to the case file; make a grain file with `grainwake grain from-scan`, `from-mesh` or `make`".to_string(),
            ),
            _ => (format!("cannot read {}: {error}", path.display()), "check the file and its permissions".to_string()),
        })?;
        let shape = self.shape(&bytes, &path)?;
        let stem =
            path.file_stem().map_or_else(|| "grain".into(), |s| s.to_string_lossy().into_owned());
        let taken = |candidate: &str| self.files.values().any(|((name, _), _)| name == candidate);
        let mut name = format!("shapes/{stem}.grain");
        let mut count = 1;
        while taken(&name) {
            count += 1;
            name = format!("shapes/{stem}-{count}.grain");
        }
        self.files.insert(path, ((name.clone(), bytes), shape.clone()));
        Ok((shape, name))
    }

    /// Returns the shape of the contents of a file. A copy of a file under another name has the
    /// same shape.
    fn shape(&self, bytes: &[u8], path: &Path) -> Result<Arc<Shape>, Refusal> {
        let copy = self.files.values().find(|((_, known), _)| known.as_slice() == bytes);
        if let Some((_, shape)) = copy {
            return Ok(shape.clone());
        }
        let shape = Shape::from_bytes(bytes, path).map_err(|error| {
            let help = "a case takes .grain files; make one with `grainwake grain from-scan`, `from-mesh` or `make`";
            (error.to_string(), help.to_string())
        })?;
        Ok(Arc::new(shape))
    }

    /// Returns a closed form with this number of surface nodes.
    pub fn closed_form(&mut self, raw: &RawShape, nodes: usize) -> Result<Arc<Shape>, Refusal> {
        // Positions in the case file are no part of the shape.
        let text = toml::to_string(raw);
        let text = text.map_err(|error| (error.to_string(), "change the shape".to_owned()))?;
        self.shared.get(format!("{text} {nodes}"), || build(raw, nodes))
    }

    /// Returns `shape` rescaled to an equivalent diameter [m].
    pub fn rescaled(&mut self, shape: &Arc<Shape>, diameter: f64) -> Result<Arc<Shape>, Refusal> {
        self.built(format!("{:p} {diameter:?}", Arc::as_ptr(shape)), || {
            let scaled = shape.scaled_to_equivalent_diameter(diameter);
            scaled.map_err(|error| (error.to_string(), "give a positive length".to_string()))
        })
    }

    /// Returns the shape of this key; the first time it is built.
    fn built(
        &mut self,
        key: String,
        build: impl FnOnce() -> Result<Shape, Refusal>,
    ) -> Result<Arc<Shape>, Refusal> {
        if let Some(shape) = self.built.get(&key) {
            return Ok(shape.clone());
        }
        let shape = Arc::new(build()?);
        self.built.insert(key, shape.clone());
        Ok(shape)
    }
}

/// Builds a shape; exactly the sizes of its kind must be given.
fn build(raw: &RawShape, nodes: usize) -> Result<Shape, Refusal> {
    let kind = raw.kind.value;
    let expected: &[&str] = match kind {
        ShapeKind::Sphere => &["diameter"],
        ShapeKind::Ellipsoid => &["size"],
        ShapeKind::RoundedBox => &["size", "radius"],
        ShapeKind::Cylinder | ShapeKind::Capsule => &["diameter", "height"],
        ShapeKind::Superquadric => &["size", "exponents"],
    };
    for (name, given) in [
        ("diameter", raw.diameter.is_some()),
        ("height", raw.height.is_some()),
        ("size", raw.size.is_some()),
        ("radius", raw.radius.is_some()),
        ("exponents", raw.exponents.is_some()),
    ] {
        let message = match (expected.contains(&name), given) {
            (true, false) => format!("`{name}` is missing"),
            (false, true) => format!("`{name}` does not belong to this shape"),
            _ => continue,
        };
        return Err((message, format!("this kind takes: {}", expected.join(", "))));
    }
    let options = ShapeOptions { nodes: Some(nodes), ..ShapeOptions::default() };
    let length =
        |value: &Option<Located<Quantity<Length>>>| value.as_ref().map_or(f64::NAN, |v| v.si);
    let (diameter, height) = (length(&raw.diameter), length(&raw.height));
    for (name, value) in [("diameter", diameter), ("height", height)] {
        if value <= 0.0 {
            let help = "give a positive length with its unit, such as \"2 mm\"";
            return Err((format!("`{name}` is {value}"), help.to_owned()));
        }
    }
    let [a, b, c] = raw.size.as_ref().map_or([f64::NAN; 3], |v| v.si.to_array());
    let [e1, e2] = raw.exponents.as_ref().map_or([f64::NAN; 2], |e| e.value.0);
    let shape = match kind {
        ShapeKind::Sphere => analytic::sphere(0.5 * diameter, &options),
        ShapeKind::Ellipsoid => analytic::ellipsoid(0.5 * a, 0.5 * b, 0.5 * c, &options),
        ShapeKind::RoundedBox => analytic::rounded_box(a, b, c, length(&raw.radius), &options),
        ShapeKind::Cylinder => analytic::cylinder(0.5 * diameter, height, &options),
        ShapeKind::Capsule => analytic::capsule(0.5 * diameter, height, &options),
        ShapeKind::Superquadric => {
            analytic::superquadric([0.5 * a, 0.5 * b, 0.5 * c], e1, e2, &options)
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_closed_form_is_built_once() {
        let forms = ClosedForms::default();
        let sphere = |radius: f64| {
            let options = ShapeOptions { nodes: Some(100), ..ShapeOptions::default() };
            analytic::sphere(radius, &options).map_err(|e| (e.to_string(), String::new()))
        };
        let first = forms.get("a".into(), || sphere(1e-3)).unwrap();
        let again = forms.get("a".into(), || panic!("built before")).unwrap();
        assert!(Arc::ptr_eq(&first, &again));
        assert!(forms.get("b".into(), || Err(("no".into(), String::new()))).is_err());
        for i in 0..KEPT {
            forms.get(i.to_string(), || sphere(2e-3)).unwrap();
        }
        let later = forms.get("a".into(), || sphere(1e-3)).unwrap();
        assert!(!Arc::ptr_eq(&first, &later), "the oldest is dropped");
    }
}
