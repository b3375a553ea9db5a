//! Tables of the probes of a run.

use grainwake_formats::probes::{FOLDER, PLANE_HEADER, POINTS_HEADER, PlaneRow, PointRow};
use grainwake_solver::grid::Axis;
use grainwake_solver::sim::Simulation;

use crate::plan::{Probe, ProbePlace};

impl Probe {
    /// Returns the path of the table in the run folder.
    pub fn file(&self) -> String {
        format!("{FOLDER}/{}.csv", self.name)
    }

    /// Returns the first line of the table, without its line break.
    pub(super) fn header(&self) -> &'static str {
        match self.place {
            ProbePlace::Points(_) => POINTS_HEADER,
            ProbePlace::Plane { .. } => PLANE_HEADER,
        }
    }

    /// Returns the rows of the table for the present state; none for what the box does not hold.
    pub(super) fn rows(&self, sim: &Simulation) -> String {
        let (time, mut text) = (sim.time(), String::new());
        match &self.place {
            ProbePlace::Points(points) => {
                for (point, position) in points.iter().enumerate() {
                    let Some(sample) = sim.sample_point(*position) else { continue };
                    let row = PointRow {
                        time,
                        point,
                        position: *position,
                        velocity: sample.velocity,
                        pressure: sample.pressure,
                        solid_fraction: sample.solid_fraction,
                    };
                    row.append_to(&mut text);
                }
            }
            ProbePlace::Plane { axis, at } => {
                let axis = [Axis::X, Axis::Y, Axis::Z][*axis];
                if let Some(sample) = sim.sample_plane(axis, *at) {
                    let row = PlaneRow {
                        time,
                        volume_flux: sample.volume_flux,
                        grain_flux: sample.grain_flux,
                        solid_fraction: sample.solid_fraction,
                        pressure: sample.pressure,
                    };
                    row.append_to(&mut text);
                }
            }
        }
        text
    }
}
