//! Samples of the flow at points and on planes of the grid.

use glam::DVec3;

use super::Simulation;
use super::probe::SampledGrid;
use super::solid_fraction::{SUBCELLS, fraction_within, images};
use crate::dem::Grain;
use crate::grid::Axis;

/// Distance of a plane from a layer of faces below which it counts as that layer [cells].
const ON_FACES: f64 = 1e-9;

/// State of the flow at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointSample {
    /// Velocity [m/s]; inside a grain that of the field which the solver keeps there.
    pub velocity: DVec3,
    /// Dynamic pressure [Pa].
    pub pressure: f64,
    /// Solid fraction of the cells around the point.
    pub solid_fraction: f64,
}

/// State of the flow on a plane across the box.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlaneSample {
    /// Volume of fluid and grains that crosses the plane [m^3/s], positive along the normal.
    pub volume_flux: f64,
    /// Volume of grains in `volume_flux` [m^3/s].
    pub grain_flux: f64,
    /// Part of the plane that lies inside grains.
    pub solid_fraction: f64,
    /// Mean dynamic pressure over the part outside grains [Pa]; NaN if there is none.
    pub pressure: f64,
}

impl Simulation {
    /// Samples the flow at a point: velocity and pressure as [`Simulation::interpolate_velocity`]
    /// does, exact for linear fields. `None` outside the box or without fluid.
    pub fn sample_point(&self, x: DVec3) -> Option<PointSample> {
        let grid = self.sampled_grid();
        let solid_fraction = grid.interpolate_cells(x, |cell| self.solid_fraction_at(cell))?;
        Some(PointSample {
            velocity: self.interpolate_velocity(x)?,
            pressure: grid.interpolate_cells(x, |cell| self.pressure_at(cell))?,
            solid_fraction: solid_fraction.clamp(0.0, 1.0),
        })
    }

    /// Samples the flow on the plane normal to `axis` at the coordinate `at` [m]. `None` outside
    /// the box or without fluid.
    ///
    /// The volume flux is the sum over the faces in the plane, which the projection conserves from
    /// plane to plane to round-off; between two layers of faces it is interpolated linearly.
    pub fn sample_plane(&self, axis: Axis, at: f64) -> Option<PlaneSample> {
        let normal = axis as usize;
        let mesh = &self.setup.mesh;
        let [a, b] = [(normal + 1) % 3, (normal + 2) % 3];
        let volume_flux = mesh.spacing[a] * mesh.spacing[b] * self.face_sum(axis, at)?;
        let count = mesh.cells[a] * mesh.cells[b];
        let mut solid = SolidFaces { fraction: vec![0.0; count], flux: 0.0 };
        for grain in self.setup.grains.iter().filter(|grain| !grain.has_left()) {
            self.add_cross_section(&mut solid, grain, normal, at);
        }
        let grid = self.sampled_grid();
        let (mut solid_sum, mut pressure_sum) = (0.0, 0.0);
        let mut x = mesh.position([0.5; 3], [1; 3]);
        x[normal] = at;
        for (n, fraction) in solid.fraction.iter().enumerate() {
            solid_sum += fraction;
            x[a] = mesh.origin[a] + ((n % mesh.cells[a]) as f64 + 0.5) * mesh.spacing[a];
            x[b] = mesh.origin[b] + ((n / mesh.cells[a]) as f64 + 0.5) * mesh.spacing[b];
            if *fraction < 1.0 {
                let pressure = grid.interpolate_cells(x, |cell| self.pressure_at(cell))?;
                pressure_sum += (1.0 - fraction) * pressure;
            }
        }
        Some(PlaneSample {
            volume_flux,
            grain_flux: solid.flux,
            solid_fraction: solid_sum / count as f64,
            pressure: pressure_sum / (count as f64 - solid_sum),
        })
    }

    fn sampled_grid(&self) -> SampledGrid<'_> {
        SampledGrid { mesh: &self.setup.mesh, boundaries: &self.setup.boundaries }
    }

    /// Sum of the normal velocity over the faces of a plane [m/s], in the order of memory.
    fn face_sum(&self, axis: Axis, at: f64) -> Option<f64> {
        let (mesh, normal) = (&self.setup.mesh, axis as usize);
        let n = mesh.cells[normal];
        let s = (at - mesh.origin[normal]) / mesh.spacing[normal];
        if !(-ON_FACES..=n as f64 + ON_FACES).contains(&s) {
            return None;
        }
        let view = self.velocity(axis)?;
        let layer = |index: usize| {
            let mut shape = view.shape();
            // Entries are in the order z, y, x.
            let along = 2 - normal;
            shape[along] = 1;
            let mut sum = 0.0;
            for n in 0..shape.iter().product() {
                let mut entry = [n / (shape[1] * shape[2]), n / shape[2] % shape[1], n % shape[2]];
                entry[along] = index;
                sum += view.get(entry);
            }
            sum
        };
        let nearest = s.round();
        if (s - nearest).abs() <= ON_FACES {
            return Some(layer(nearest as usize));
        }
        let below = s.floor();
        let [low, high] = [0, 1].map(|n| layer(below as usize + n));
        Some(low + (s - below) * (high - low))
    }

    /// Adds the cross-section of a grain and of its periodic images with a plane.
    fn add_cross_section(&self, faces: &mut SolidFaces, grain: &Grain, normal: usize, at: f64) {
        let mut to_plane = DVec3::ZERO;
        to_plane[normal] = at - grain.pose.position[normal];
        let height = self.setup.enclosure().nearest_image(to_plane)[normal];
        let radius = grain.shape.bounding_radius();
        for height in images(height, self.image_period(normal), radius) {
            self.add_section_of_image(faces, grain, normal, height);
        }
    }

    /// Adds the cross-sections of a grain with a plane at `height` [m] above its centroid, or above
    /// the centroid of an image, and of the images in the directions of the plane.
    fn add_section_of_image(
        &self,
        faces: &mut SolidFaces,
        grain: &Grain,
        normal: usize,
        height: f64,
    ) {
        let (mesh, radius) = (&self.setup.mesh, grain.shape.bounding_radius());
        let [a, b] = [(normal + 1) % 3, (normal + 2) % 3];
        let reach = (radius * radius - height * height).sqrt();
        // An axis of one cell is evaluated in its middle plane.
        let resolved = [a, b].map(|axis| mesh.is_resolved(axis));
        let parts = resolved.map(|resolved| if resolved { SUBCELLS } else { 1 });
        let edges = [a, b].map(|axis| mesh.spacing[axis]);
        let area = edges[0] * edges[1] / (parts[0] * parts[1]) as f64;
        let mut width = DVec3::ZERO;
        for (n, axis) in [a, b].into_iter().enumerate().filter(|(n, _)| resolved[*n]) {
            width[axis] = edges[n] / parts[n] as f64;
        }
        let [columns, rows] = [a, b].map(|axis| {
            let periodic = self.setup.boundaries.is_periodic(axis);
            let cells = mesh.cells_near(axis, periodic, grain.pose.position[axis], reach);
            cells.map(move |(cell, along)| (cell, if mesh.is_resolved(axis) { along } else { 0.0 }))
        });
        for (cell_b, centre_b) in rows {
            for (cell_a, centre_a) in columns.clone() {
                let cell = cell_a + mesh.cells[a] * cell_b;
                for part in 0..parts[0] * parts[1] {
                    let offset =
                        |n: usize, i: usize| ((i as f64 + 0.5) / parts[n] as f64 - 0.5) * edges[n];
                    let mut lever_arm = DVec3::ZERO;
                    lever_arm[normal] = height;
                    lever_arm[a] = centre_a + offset(0, part % parts[0]);
                    lever_arm[b] = centre_b + offset(1, part / parts[0]);
                    let fraction = fraction_within(grain, lever_arm, width, f64::MIN_POSITIVE);
                    if fraction > 0.0 {
                        let share = fraction / (parts[0] * parts[1]) as f64;
                        faces.fraction[cell] = (faces.fraction[cell] + share).min(1.0);
                        let velocity = grain.velocity + grain.angular_velocity.cross(lever_arm);
                        faces.flux += fraction * area * velocity[normal];
                    }
                }
            }
        }
    }
}

/// Cross-sections of the grains with a plane.
struct SolidFaces {
    /// Solid fraction of each face cell, the first axis after the normal fastest.
    fraction: Vec<f64>,
    /// Volume of grains that crosses the plane [m^3/s].
    flux: f64,
}
