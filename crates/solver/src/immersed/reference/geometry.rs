//! Signed distances of faces, and the grain nearest to a face.

use glam::{DVec3, IVec3};

use super::Reference;
use crate::immersed::geometry::aperture::band_variance;

/// Nearest periodic image of a grain, seen from a point.
pub struct NearestImage {
    /// Signed distance d to the surface [m].
    pub distance: f64,
    /// Distance averaged over the kernel of the band [m]: d + sigma^2 / 2 times the Laplacian of d.
    pub mean_distance: f64,
    /// Unit normal n out of the grain, space frame.
    pub normal: DVec3,
    /// Vector from the centroid of the image to the point [m].
    pub lever_arm: DVec3,
}

impl Reference {
    /// Image of grain `index` nearest to `x` [m].
    pub fn nearest_image(&self, index: usize, x: DVec3) -> NearestImage {
        let grain = &self.grains[index];
        let mut nearest: Option<NearestImage> = None;
        for shift in self.shifts() {
            let lever_arm = x - grain.pose.position - shift;
            let in_body = grain.pose.orientation.inverse() * lever_arm;
            let (distance, gradient) = grain.shape.distance_and_gradient(in_body);
            if nearest.as_ref().is_none_or(|n| distance < n.distance) {
                let variance = band_variance(self.eps);
                let step = 1e-3 * self.eps;
                let second = |e: DVec3| {
                    let sides = [in_body + step * e, in_body - step * e];
                    let sides = sides.map(|x| grain.shape.distance(x) - distance);
                    (sides[0] + sides[1]) / (step * step)
                };
                let laplacian: f64 = DVec3::AXES.map(second).iter().sum();
                nearest = Some(NearestImage {
                    distance,
                    mean_distance: distance + 0.5 * variance * laplacian,
                    normal: grain.pose.orientation * gradient.normalize(),
                    lever_arm,
                });
            }
        }
        nearest.expect("the grain itself is an image")
    }

    /// Vectors from a grain to itself and to its periodic images next to the box [m].
    fn shifts(&self) -> Vec<DVec3> {
        let mut shifts = vec![DVec3::ZERO];
        for axis in (0..3).filter(|&axis| self.boundaries.is_periodic(axis)) {
            let period = self.mesh.extent()[axis] * DVec3::AXES[axis];
            let sides = shifts.iter().flat_map(|s| [*s - period, *s, *s + period]);
            shifts = sides.collect();
        }
        shifts
    }

    /// Signed distance d [m] of a face from grain `index`, if no other grain is nearer.
    pub fn distance(&self, index: usize, component: usize, face: IVec3) -> Option<f64> {
        let x = self.position(component, face);
        let d = |index| self.nearest_image(index, x).distance;
        let distance = d(index);
        let others = (0..self.grains.len()).filter(|other| *other != index);
        others.map(d).all(|other| distance < other).then_some(distance)
    }
}
