//! VTK files of a run: slices, full fields, grain surfaces.

use std::path::Path;

use grainwake_formats::contacts::{self, ContactRow};
use grainwake_formats::disk;
use grainwake_formats::pvd::Entry;
use grainwake_formats::vti::{self, Frame, Source};
use grainwake_formats::vtp;
use grainwake_solver::sim::{CELL_FIELDS, Simulation};

use super::contacts::contacts as contacts_of;
use super::surfaces::Surfaces;
use crate::error::{Context, RunError};
use crate::plan::{Plane, PlanePosition};

/// Subfolders of the VTK files that every run has.
pub const FOLDERS: [&str; 2] = ["slices", "grains"];
/// Subfolder of the full fields, in runs that write them.
pub const FULL_FIELDS: &str = "fields";

/// Writer of the VTK files of a run.
pub struct VtkOutput {
    planes: Vec<Plane>,
    surfaces: Surfaces,
    has_fluid: bool,
}

impl VtkOutput {
    /// Prepares the output of a simulation with these slice planes.
    pub fn new(planes: &[Plane], sim: &Simulation) -> VtkOutput {
        VtkOutput {
            planes: planes.to_vec(),
            surfaces: Surfaces::new(sim.grains()),
            has_fluid: sim.setup().fluid.is_some(),
        }
    }

    /// Writes one slice for each plane; `tag` ends the file names. A plane through a grain that has
    /// left the box is left out.
    pub fn slices(&self, run: &Path, sim: &Simulation, tag: &str) -> Result<Vec<Entry>, RunError> {
        let mut written = Vec::new();
        let planes = self.planes.iter().filter(|_| self.has_fluid).enumerate();
        for (index, plane) in planes {
            let name = plane.name(index);
            let Some(layer) = layer(plane, sim) else { continue };
            let (mut first, mut count) = ([0; 3], sim.mesh().cells);
            (first[plane.axis], count[plane.axis]) = (layer, 1);
            let file = format!("slices/{name}_{tag}.vti");
            write_image(&run.join(&file), sim, first, count)?;
            written.push(Entry { time: sim.time(), group: format!("slice {name}"), file });
        }
        Ok(written)
    }

    /// Writes the full fields.
    pub fn fields(&self, run: &Path, sim: &Simulation, tag: &str) -> Result<Vec<Entry>, RunError> {
        if !self.has_fluid {
            return Ok(Vec::new());
        }
        let folder = run.join(FULL_FIELDS);
        disk::create_folder(&folder).context("create", &folder)?;
        let file = format!("{FULL_FIELDS}/fields_{tag}.vti");
        write_image(&run.join(&file), sim, [0; 3], sim.mesh().cells)?;
        Ok(vec![Entry { time: sim.time(), group: "fields".into(), file }])
    }

    /// Writes the surfaces of the grains.
    pub fn grains(&self, run: &Path, sim: &Simulation, tag: &str) -> Result<Vec<Entry>, RunError> {
        if sim.grains().is_empty() {
            return Ok(Vec::new());
        }
        let file = format!("grains/grains_{tag}.vtp");
        let path = run.join(&file);
        let surface = self.surfaces.at(sim);
        vtp::write(&path, &surface).context("write", &path)?;
        Ok(vec![Entry { time: sim.time(), group: "grains".into(), file }])
    }
}

/// Writes contact points and contact network.
pub(crate) fn contact_files(
    run: &Path,
    sim: &Simulation,
    tag: &str,
) -> Result<Vec<Entry>, RunError> {
    type Write = fn(&Path, f64, &[ContactRow]) -> std::io::Result<()>;
    let folder = run.join(contacts::FOLDER);
    disk::create_folder(&folder).context("create", &folder)?;
    let rows = contacts_of(sim);
    let files: [(&str, Write); 2] =
        [("points", contacts::write_points), ("network", contacts::write_network)];
    let mut written = Vec::new();
    for (name, write) in files {
        let file = format!("{}/{name}_{tag}.vtp", contacts::FOLDER);
        let path = run.join(&file);
        write(&path, sim.time(), &rows).context("write", &path)?;
        written.push(Entry { time: sim.time(), group: format!("contact {name}"), file });
    }
    Ok(written)
}

/// Returns the layer of cells that a plane cuts; none if it follows a grain that has left the box.
fn layer(plane: &Plane, sim: &Simulation) -> Option<usize> {
    let (mesh, axis) = (sim.mesh(), plane.axis);
    let position = match plane.position {
        PlanePosition::At(position) => position,
        PlanePosition::Grain(grain) if sim.grains()[grain].has_left() => return None,
        PlanePosition::Grain(grain) => sim.grains()[grain].pose.position[axis],
    };
    let cells = mesh.cells[axis];
    let mut layer = (position - mesh.origin[axis]) / mesh.spacing[axis];
    if sim.setup().boundaries.is_periodic(axis) {
        layer = layer.rem_euclid(cells as f64);
    }
    // The conversion saturates: a plane outside the box cuts the nearest layer.
    Some((layer.floor() as usize).min(cells - 1))
}

/// Writes `count` cells along each axis, beginning with cell `first`.
fn write_image(
    path: &Path,
    sim: &Simulation,
    first: [usize; 3],
    count: [usize; 3],
) -> Result<(), RunError> {
    let mesh = sim.mesh();
    let cell = |c: [usize; 3]| [first[0] + c[0], first[1] + c[1], first[2] + c[2]];
    let corner = glam::DVec3::from_array(first.map(|i| i as f64));
    let frame = Frame {
        cells: count,
        spacing: mesh.spacing,
        origin: mesh.origin + mesh.spacing * corner,
        time: sim.time(),
    };
    let values: Vec<_> = CELL_FIELDS
        .iter()
        .map(|field| move |c: [usize; 3]| field.at(sim, cell(c)).as_vec3().to_array())
        .collect();
    let sources: Vec<Source> = (CELL_FIELDS.iter().zip(&values))
        .map(|(field, value)| Source { name: field.name, components: field.components, value })
        .collect();
    vti::write_from(path, &frame, &sources).context("write", path)
}
