//! Assembly of a shape from a distance function in the principal frame.

use crate::distance::Distance;
use crate::error::{Defect, Result, ShapeError, check_length, positive, within};
use crate::field::{SAMPLES, SampledField};
use crate::morphology::Morphology;
use crate::nodes::SurfaceNode;
use crate::provenance::Provenance;
use crate::quality::{self, Quality, QualityBounds};
use crate::shape::{Field, Shape};
use crate::triangles::TriangleMesh;
use crate::{inscribed, mass, nodes, roundness, specks, surface};
use glam::DVec3;

/// Resolution, surface nodes and bounds of a sampled shape.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeOptions {
    /// Grid cells across the longest extent; `None` for 56, fewer for the small grains of a scan.
    pub cells: Option<usize>,
    /// Minimum number of grid cells across the shortest extent; refines the grid of flat grains.
    pub least_cells: usize,
    /// Number of surface nodes; `None` for about one per (equivalent diameter / 20)^2 of surface.
    pub nodes: Option<usize>,
    /// Whether to measure the inscribed sphere and the roundness, which doubles the build time.
    pub roundness: bool,
    /// Bounds of the quality check.
    pub bounds: QualityBounds,
}

/// Default number of grid cells across the longest extent.
pub(crate) const DEFAULT_CELLS: usize = 56;

impl Default for ShapeOptions {
    fn default() -> ShapeOptions {
        ShapeOptions {
            cells: None,
            least_cells: 16,
            nodes: None,
            roundness: true,
            bounds: QualityBounds::default(),
        }
    }
}

/// Minimum margin of the grid around the surface, relative to the longest extent.
const MARGIN: f64 = 0.125;
/// Relative change of the margin that outweighs rounding errors.
const ROUNDING: f64 = 1e-9;
/// Minimum margin of the grid around the surface [cells].
const MARGIN_CELLS: f64 = 4.0;

/// A solid body in (nearly) its principal frame.
pub(crate) struct Body<D> {
    /// Signed distance [m].
    pub distance: D,
    /// Lower corner of the bounding box [m].
    pub lower: DVec3,
    /// Upper corner of the bounding box [m].
    pub upper: DVec3,
    /// Exact volume [m^3] if known.
    pub volume: Option<f64>,
    /// Surface area [m^2] if known. Sampling truncates edges, which biases the area more than scan
    /// noise.
    pub area: Option<f64>,
    /// Vertices of the surface [m] if it is a mesh. Sampling truncates them, which shortens the
    /// Feret diameters.
    pub corners: Option<Vec<DVec3>>,
    /// Origin of the surface.
    pub surface: roundness::Surface,
}

impl ShapeOptions {
    /// Refuses a resolution that no shape can have.
    pub(crate) fn check(&self) -> Result<()> {
        let cells = self.cells.unwrap_or(DEFAULT_CELLS);
        for (name, value) in [("cells", cells), ("least_cells", self.least_cells)] {
            within(name, value as f64, 8.0..=1024.0, "must be 8 to 1024")?;
        }
        self.nodes.map_or(Ok(()), |nodes| {
            within("nodes", nodes as f64, 16.0..=1e6, "must be 16 to 1000000")
        })
    }

    fn spacing(&self, extent: DVec3) -> Result<f64> {
        self.check()?;
        let cells = self.cells.unwrap_or(DEFAULT_CELLS);
        positive("shortest extent of the body", extent.min_element())?;
        check_length("longest extent of the body", extent.max_element())?;
        Ok((extent.max_element() / cells as f64).min(self.thinnest_spacing(extent)))
    }

    /// Largest spacing [m] with the least number of cells across the thinnest extent.
    fn thinnest_spacing(&self, extent: DVec3) -> f64 {
        extent.min_element() / self.least_cells as f64
    }

    /// Error of a body with too many samples, if its thinnest extent asks for them.
    fn too_thin(&self, extent: DVec3) -> Option<ShapeError> {
        let cells = self.cells.unwrap_or(DEFAULT_CELLS);
        let ratio = (extent.max_element() / extent.min_element()).round();
        (self.thinnest_spacing(extent) < extent.max_element() / cells as f64).then(|| {
            let reason = format!(
                "too flat or too long: {} cells across the thinnest extent need too many samples; \
                 make the body thicker",
                self.least_cells
            );
            ShapeError::parameter("longest over thinnest extent", ratio, &reason)
        })
    }
}

/// Samples the body, centres the field on its own centroid, measures it, distributes the surface
/// nodes and applies the quality check.
pub(crate) fn assemble<D: Distance>(
    body: &Body<D>,
    mut provenance: Provenance,
    options: &ShapeOptions,
) -> Result<Shape> {
    let extent = body.upper - body.lower;
    let spacing = options.spacing(extent)?;
    let mut margin = (MARGIN * extent.max_element()).max(MARGIN_CELLS * spacing);
    if !matches!(body.surface, roundness::Surface::Family) {
        // The rounding error of a whole number of cells, which depends on the unit, must not add a
        // layer of samples. One grain of the study has that layer and keeps it.
        margin *= 1.0 - ROUNDING;
    }
    let sampled = SampledField::sample(&body.distance, body.lower, body.upper, spacing, margin);
    let mut field = sampled.map_err(|error| match error {
        ShapeError::BadParameter { name: SAMPLES, .. } => options.too_thin(extent).unwrap_or(error),
        _ => error,
    })?;
    let scanned = matches!(body.surface, roundness::Surface::Scanned { .. });
    let removed = specks::remove(&mut field, scanned);
    if removed > 0.0 {
        provenance = provenance.with(specks::REMOVED, removed);
    }
    let off = mass::of_field(&field).centroid;
    if !off.is_finite() {
        return Err(ShapeError::quality(Defect::Empty, "the sampled body is empty"));
    }
    provenance.centroid += provenance.rotation * off;
    let field = field.shifted(-off);
    let mass = mass::of_field(&field);
    quality::check_axes(&mass.second)?;

    let mesh = surface::of_field(&field);
    mesh.check_closed().map_err(|e| {
        let reason = format!(
            "the surface of the sampled body is not one closed surface ({e}); ask for more cells \
             across the grain"
        );
        ShapeError::quality(Defect::Surface, reason)
    })?;
    let diameter = (6.0 * mass.volume / std::f64::consts::PI).cbrt();
    let count = options.nodes.unwrap_or_else(|| {
        ((mesh.area() / (diameter / 20.0).powi(2)).round() as usize).clamp(16, 1_000_000)
    });
    let mut nodes = nodes::spread(&field, &mesh, count);
    let area = body.area.unwrap_or_else(|| mesh.area());
    if body.area.is_some() {
        let share = area / mesh.area();
        nodes.iter_mut().for_each(|n| n.area *= share);
    }
    let quality = Quality {
        gradient_error: quality::gradient_error(&field, &mesh),
        volume_error: body.volume.map(|v| mass.volume / v - 1.0),
    };
    options.bounds.check(&quality)?;

    let (lower, upper, radius) = bounds(&field, &mesh, &nodes);
    let mut morphology = Morphology::measure(&mesh, upper - lower, mass.volume, area);
    if let Some(corners) = &body.corners {
        morphology.set_feret(corners);
    }
    if options.roundness {
        // Scans have meshes of small faces, on which distance queries are slow.
        let about = |x: DVec3, hint: &mut u32| {
            if scanned { field.distance(x - off) } else { body.distance.near(x, hint) }
        };
        let (_, inscribed) = inscribed::sphere(&body.distance, &about, body.lower, body.upper);
        morphology.inscribed_radius = Some(inscribed);
        let reading =
            roundness::measure(&body.distance, body.lower, body.upper, inscribed, &body.surface);
        morphology.wadell_roundness = reading.map(|reading| reading.roundness);
        if let Some(lost) = reading.and_then(|reading| reading.lost) {
            morphology.set_area(lost.restored(area), mass.volume);
        }
    }
    let second = DVec3::new(mass.second.x_axis.x, mass.second.y_axis.y, mass.second.z_axis.z);
    Ok(Shape {
        nodes,
        volume: mass.volume,
        inertia: DVec3::splat(second.element_sum()) - second,
        lower,
        upper,
        bounding_radius: radius,
        morphology,
        quality: Some(quality),
        provenance,
        field: Field::Sampled(field),
    })
}

/// Returns the bounding box and the bounding radius of the surface. Mesh vertices lie on grid
/// lines; face centres projected onto the surface account for the curvature between them.
fn bounds(field: &SampledField, mesh: &TriangleMesh, nodes: &[SurfaceNode]) -> (DVec3, DVec3, f64) {
    let middles = (0..mesh.triangles.len()).map(|f| {
        let middle = mesh.corners(f).iter().sum::<DVec3>() / 3.0;
        nodes::project(field, middle)
    });
    let on_surface =
        mesh.vertices.iter().copied().chain(middles).chain(nodes.iter().map(|n| n.position));
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY, 0.0f64);
    let (lower, upper, squared) = on_surface.fold(start, |(lower, upper, squared), x| {
        (lower.min(x), upper.max(x), squared.max(x.length_squared()))
    });
    // Margin for extrema between the samples, a fraction of a percent of a cell.
    (lower, upper, squared.sqrt() + 2e-3 * field.spacing())
}
