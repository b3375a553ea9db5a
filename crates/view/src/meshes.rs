//! Surfaces of the grains: one mesh per shape, and the size of each grain relative to it.

use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec3;
use grainwake_report::figure::{GrainSurface, surfaces};
use grainwake_report::run_folder::RunFolder;
use grainwake_shape::Shape;
use serde::Serialize;

use crate::packed::Packed;

/// Largest distance of corresponding points of equal shapes, relative to their mean radius. Points
/// are read in single precision, far from the origin.
const EQUAL: f64 = 2e-4;

/// Surface in the body frame with a mean radius of 1, or a sphere of radius 1.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Mesh {
    /// Sphere, of which the page makes a mesh.
    Sphere,
    /// Triangles.
    Surface {
        /// Coordinates of the points.
        points: Packed,
        /// Indices of the corners.
        triangles: Packed,
    },
}

/// Mesh and size of each grain.
#[derive(Clone, Debug, Default)]
pub struct Bodies {
    /// Meshes, one per shape.
    pub meshes: Vec<Mesh>,
    /// Mesh of each grain and factor of its points [m].
    pub grains: Vec<(usize, f64)>,
    /// Diameter of the sphere of equal volume of each grain [m], if known.
    pub diameters: Vec<Option<f64>>,
}

/// Normalised surface of a shape.
struct Body {
    points: Vec<DVec3>,
    triangles: Vec<[usize; 3]>,
}

/// Finds the bodies of all grains: from the surface files, else the grain files, else as spheres.
pub fn bodies(run: &RunFolder, notes: &mut Vec<String>) -> Bodies {
    let count = run.grains.len().max(run.facts.grains.len());
    let read = surfaces(run, notes);
    let mut out = Bodies::default();
    let mut known: Vec<(usize, Body)> = Vec::new();
    let mut files: BTreeMap<String, Option<GrainSurface>> = BTreeMap::new();
    let mut sphere = None;
    let mut unknown = 0;
    for grain in 0..count {
        let facts = run.facts.grains.get(grain);
        let diameter = facts.and_then(|facts| facts.diameter);
        let from_vtk = read.get(&grain);
        let name = facts.and_then(|f| f.shape.as_deref()).filter(|n| n.ends_with(".grain"));
        let is_sphere = run.facts.is_sphere(grain);
        let surface = match (from_vtk, name) {
            _ if is_sphere => None,
            (Some(surface), _) => Some(surface),
            (None, Some(name)) => {
                let file = files.entry(name.to_owned());
                file.or_insert_with(|| grain_file(&run.path, name)).as_ref()
            }
            (None, None) => None,
        };
        let own = surface.and_then(GrainSurface::diameter);
        let diameter = diameter.or(own);
        out.diameters.push(diameter);
        match surface.and_then(normalised) {
            Some((body, radius)) => {
                // A grain file has the size of its source, not that of the grain.
                let factor = diameter.zip(own).map_or(1.0, |(wanted, found)| wanted / found);
                let factor = if from_vtk.is_some() { 1.0 } else { factor };
                let mesh = match known.iter().find(|(_, other)| other.equals(&body)) {
                    Some((mesh, _)) => *mesh,
                    None => {
                        out.meshes.push(body.packed());
                        known.push((out.meshes.len() - 1, body));
                        out.meshes.len() - 1
                    }
                };
                out.grains.push((mesh, radius * factor));
            }
            None => {
                unknown += usize::from(!is_sphere || diameter.is_none());
                let mesh = *sphere.get_or_insert_with(|| {
                    out.meshes.push(Mesh::Sphere);
                    out.meshes.len() - 1
                });
                out.grains.push((mesh, 0.5 * diameter.unwrap_or_else(|| small(run))));
            }
        }
    }
    if unknown > 0 {
        notes.push(format!(
            "no surface of {unknown} of {count} grains was found: they are shown as spheres"
        ));
    }
    out
}

/// Returns a diameter [m] for grains of unknown size.
fn small(run: &RunFolder) -> f64 {
    run.facts.diameter().or(run.facts.size.map(|s| 0.05 * s.min_element())).unwrap_or(1e-3)
}

/// Reads the surface of a grain file of the run folder; names that leave the folder are refused.
fn grain_file(run: &Path, name: &str) -> Option<GrainSurface> {
    let inside = Path::new(name).components().all(|c| matches!(c, std::path::Component::Normal(_)));
    let shape = inside.then(|| Shape::load(&run.join(name)).ok())??;
    let (points, triangles) = shape.surface_mesh();
    let triangles = triangles.into_iter().map(|t| t.map(|i| i as usize)).collect();
    Some(GrainSurface::new(points, triangles))
}

/// Scales a surface to a mean radius of 1; also returns the mean radius [m].
fn normalised(surface: &GrainSurface) -> Option<(Body, f64)> {
    let points = surface.points();
    let radius = points.iter().map(|p| p.length()).sum::<f64>() / points.len() as f64;
    let usable = radius > 0.0 && radius.is_finite() && !surface.triangles().is_empty();
    usable.then(|| {
        let points = points.iter().map(|p| *p / radius).collect();
        (Body { points, triangles: surface.triangles().to_vec() }, radius)
    })
}

impl Body {
    fn equals(&self, other: &Body) -> bool {
        self.points.len() == other.points.len()
            && self.triangles == other.triangles
            && self.points.iter().zip(&other.points).all(|(a, b)| a.distance(*b) < EQUAL)
    }

    fn packed(&self) -> Mesh {
        let points: Vec<f64> = self.points.iter().flat_map(|p| p.to_array()).collect();
        let corners: Vec<usize> = self.triangles.iter().flatten().copied().collect();
        Mesh::Surface { points: Packed::quantised(&points), triangles: Packed::indices(&corners) }
    }
}
