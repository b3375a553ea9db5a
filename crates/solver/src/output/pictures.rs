//! Slices, full fields and grain surfaces.

use std::path::Path;

use super::error::{Context, RunError};
use super::plan::{Place, Plane};
use super::pvd::Picture;
use super::vti::{self, Frame, Source};
use super::vtp::Surfaces;
use crate::sim::Simulation;

/// Folders of the pictures.
pub(super) const FOLDERS: [&str; 3] = ["slices", "fields", "grains"];

/// Writes the pictures of a run into its folder.
pub(super) struct Pictures {
    planes: Vec<Plane>,
    surfaces: Surfaces,
    wet: bool,
}

impl Pictures {
    /// For a simulation with these slice planes.
    pub fn new(planes: &[Plane], sim: &Simulation) -> Pictures {
        Pictures {
            planes: planes.to_vec(),
            surfaces: Surfaces::new(sim.grains()),
            wet: sim.setup().fluid.is_some(),
        }
    }

    /// One slice for each plane; `tag` ends the file names.
    pub fn slices(
        &self,
        run: &Path,
        sim: &Simulation,
        tag: &str,
    ) -> Result<Vec<Picture>, RunError> {
        if !self.wet {
            return Ok(Vec::new());
        }
        let mut written = Vec::new();
        for (index, plane) in self.planes.iter().enumerate() {
            let name = plane.name(index);
            let file = format!("slices/{name}_{tag}.vti");
            let path = run.join(&file);
            let mesh = sim.mesh();
            let at = match plane.place {
                Place::At(at) => at,
                Place::Grain(grain) => sim.grains()[grain].pose.position[plane.axis],
            };
            let (n, h, lower) = (
                mesh.cells[plane.axis],
                mesh.spacing[plane.axis],
                mesh.origin[plane.axis],
            );
            let mut layer = (at - lower) / h;
            if sim.setup().boundaries.is_periodic(plane.axis) {
                layer = layer.rem_euclid(n as f64);
            }
            // A float beyond the range becomes the nearest layer.
            let layer = (layer.floor() as usize).min(n - 1);
            let (mut first, mut count) = ([0; 3], mesh.cells);
            (first[plane.axis], count[plane.axis]) = (layer, 1);
            image(&path, sim, first, count).context("write", &path)?;
            written.push(Picture {
                time: sim.time(),
                group: format!("slice {name}"),
                file,
            });
        }
        Ok(written)
    }

    /// The full fields.
    pub fn fields(
        &self,
        run: &Path,
        sim: &Simulation,
        tag: &str,
    ) -> Result<Vec<Picture>, RunError> {
        if !self.wet {
            return Ok(Vec::new());
        }
        let file = format!("fields/fields_{tag}.vti");
        let path = run.join(&file);
        image(&path, sim, [0; 3], sim.mesh().cells).context("write", &path)?;
        Ok(vec![Picture {
            time: sim.time(),
            group: "fields".into(),
            file,
        }])
    }

    /// The surfaces of the grains.
    pub fn grains(
        &self,
        run: &Path,
        sim: &Simulation,
        tag: &str,
    ) -> Result<Vec<Picture>, RunError> {
        if sim.grains().is_empty() {
            return Ok(Vec::new());
        }
        let file = format!("grains/grains_{tag}.vtp");
        let path = run.join(&file);
        self.surfaces
            .write(&path, sim.grains(), sim.time())
            .context("write", &path)?;
        Ok(vec![Picture {
            time: sim.time(),
            group: "grains".into(),
            file,
        }])
    }
}

/// The cells from `first` on, `count` along each axis.
fn image(
    path: &Path,
    sim: &Simulation,
    first: [usize; 3],
    count: [usize; 3],
) -> std::io::Result<()> {
    let mesh = sim.mesh();
    let at = |c: [usize; 3]| [first[0] + c[0], first[1] + c[1], first[2] + c[2]];
    let corner = glam::DVec3::from_array(first.map(|i| i as f64));
    let frame = Frame {
        cells: count,
        spacing: mesh.spacing,
        origin: mesh.origin + mesh.spacing * corner,
        time: sim.time(),
    };
    let single = |x: f64| [x as f32, 0.0, 0.0];
    let sources = [
        Source {
            name: "velocity",
            components: 3,
            value: &|c| sim.velocity_at(at(c)).as_vec3().to_array(),
        },
        Source {
            name: "vorticity",
            components: 3,
            value: &|c| sim.vorticity_at(at(c)).as_vec3().to_array(),
        },
        Source {
            name: "pressure",
            components: 1,
            value: &|c| single(sim.pressure_at(at(c))),
        },
        Source {
            name: "solid_fraction",
            components: 1,
            value: &|c| single(sim.solid_fraction_at(at(c))),
        },
    ];
    vti::write_from(path, &frame, &sources)
}
