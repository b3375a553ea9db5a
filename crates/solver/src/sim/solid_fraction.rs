//! Solid fraction of cells, for output.

use glam::DVec3;

use super::Simulation;
use crate::dem::Grain;

/// Sub-cells along each axis of a cell, or of its face, cut by a surface.
pub(super) const SUBCELLS: usize = 4;

/// Part inside a grain of a sub-cell, which the tangent plane of the nearest surface cuts; for a
/// sub-cell of a face, the line in which the two meet. `lever_arm` leads from the centroid to its
/// centre. Along the normal, the extent given by its `edges` counts as `thinnest` at least [m].
pub(super) fn fraction_within(grain: &Grain, lever_arm: DVec3, edges: DVec3, thinnest: f64) -> f64 {
    let orientation = grain.pose.orientation;
    let point = orientation.conjugate() * lever_arm;
    let (distance, gradient) = grain.shape.distance_and_gradient(point);
    let normal = orientation * gradient.normalize_or_zero();
    let width = normal.abs().dot(edges).max(thinnest);
    (0.5 - distance / width).clamp(0.0, 1.0)
}

/// Returns the images of `separation` [m], a multiple of `period` [m] apart, whose magnitude is at
/// most `reach` [m]; without a period `separation` itself.
pub(super) fn images(
    separation: f64,
    period: Option<f64>,
    reach: f64,
) -> impl Iterator<Item = f64> + Clone {
    let (first, period, counts) = match period {
        Some(period) => {
            let nearest = separation - (separation / period).round() * period;
            let count = |end: f64| (end - nearest) / period;
            (nearest, period, count(-reach).ceil() as i64..=count(reach).floor() as i64)
        }
        None => (separation, 0.0, 0..=0),
    };
    let images = counts.map(move |count| first + count as f64 * period);
    images.filter(move |image| image.abs() <= reach)
}

impl Simulation {
    /// Solid fraction of cell (i, j, k), counted from 0. A cell near a surface is divided into
    /// sub-cells, and each of these is cut by the plane of the nearest surface.
    pub fn solid_fraction_at(&self, cell: [usize; 3]) -> f64 {
        let mesh = &self.setup.mesh;
        // An axis of one cell is evaluated in its middle plane.
        let counts = [0, 1, 2].map(|axis| if mesh.is_resolved(axis) { SUBCELLS } else { 1 });
        let edge = DVec3::from_array(
            [0, 1, 2].map(|axis| if mesh.is_resolved(axis) { mesh.spacing[axis] } else { 0.0 }),
        );
        let Some(near) = self.grains_near(cell, edge) else { return 1.0 };
        if near.is_empty() {
            return 0.0;
        }
        let along = DVec3::from_array(counts.map(|n| n as f64));
        let subcell = edge / along;
        let thinnest = mesh.resolved_axes().map(|axis| subcell[axis]).fold(f64::INFINITY, f64::min);
        let (count, [_, ny, nz]) = (counts.iter().product::<usize>(), counts);
        let mut sum = 0.0;
        for n in 0..count {
            let index = [n / (ny * nz), n / nz % ny, n % nz].map(|i| i as f64);
            let offset = (DVec3::from_array(index) + 0.5 - 0.5 * along) * subcell;
            let fractions = near.iter().map(|(grain, lever_arm)| {
                fraction_within(grain, *lever_arm + offset, subcell, thinnest)
            });
            sum += fractions.fold(0.0, f64::max);
        }
        sum / count as f64
    }

    /// Grains and images whose surface may cut a cell with these edges [m], with the vector from
    /// centroid to cell centre [m]; `None` if the cell lies inside a grain.
    fn grains_near(&self, cell: [usize; 3], edge: DVec3) -> Option<Vec<(&Grain, DVec3)>> {
        let mesh = &self.setup.mesh;
        let centre = mesh.position([0.5; 3], cell.map(|i| i + 1));
        let periods = [0, 1, 2].map(|axis| self.image_period(axis));
        let mut near = Vec::new();
        for grain in &self.setup.grains {
            let reach = grain.shape.bounding_radius() + mesh.spacing.length();
            let to_body = grain.pose.orientation.conjugate();
            let [x, y, z] = [0, 1, 2].map(|axis| {
                let separation = centre[axis] - grain.pose.position[axis];
                images(separation, periods[axis], reach)
            });
            let (xy, reach_squared) =
                (x.flat_map(|x| y.clone().map(move |y| (x, y))), reach * reach);
            let levers = xy.flat_map(|(x, y)| z.clone().map(move |z| DVec3::new(x, y, z)));
            for lever_arm in levers.filter(|lever| lever.length_squared() <= reach_squared) {
                let (distance, _) = grain.shape.distance_and_gradient(to_body * lever_arm);
                // From the centre to a corner, the distance changes by at most half the diagonal.
                if distance <= -0.5 * edge.length() {
                    return None;
                }
                if distance < 0.5 * edge.length() {
                    near.push((grain, lever_arm));
                }
            }
        }
        Some(near)
    }

    /// Distance of the images of a grain along an axis [m]; none along an axis that is not periodic
    /// or has one cell.
    pub(super) fn image_period(&self, axis: usize) -> Option<f64> {
        let mesh = &self.setup.mesh;
        let has_images = self.setup.boundaries.is_periodic(axis) && mesh.is_resolved(axis);
        has_images.then(|| mesh.extent()[axis])
    }
}
