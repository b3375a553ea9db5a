//! Signed distance and its gradient in a narrow band around the surface of a grain or a neighbour.
//!
//! The mean distance is the distance averaged over the kernel of the band, which has the variance
//! sigma^2 along each axis: d + sigma^2 / 2 times the Laplacian of d. Next to a plane it is d, next
//! to a convex surface it is larger. With it the volume closed by the band is that of the grain
//! (`docs/decisions/0021-curved-surfaces.md`).
//!
//! The sampled field of a shape ends closer to the surface than the band of the flow, and is often
//! finer than the flow resolves. A wider and, where possible, coarser sampled field replaces it,
//! which fits the cache and is interpolated for several points at a time, without searching
//! (`sampling.rs`).

use std::ops::Deref;
use std::sync::Arc;

use glam::DVec3;
use grainwake_shape::{Field, Shape};

use super::samples::{BandSamples, INFINITE_DISTANCE, SampleGrid, SurfaceDistance};
use crate::math::Pose;
use grainwake_simd::{MAX_LANES, Scalar, Vector};

/// Narrow-band shapes of all grains; equal shapes share their samples.
pub struct NarrowBandShapes {
    /// Entry i is the shape of grain i.
    pub(super) shapes: Vec<NarrowBandShape>,
}

/// A shape with distances sampled in a band around its surface.
#[derive(Clone)]
pub struct NarrowBandShape {
    pub(super) shape: Arc<Shape>,
    /// `None` if the shape itself is evaluated: a closed form, or a shape that needs too many
    /// samples.
    pub(super) samples: Option<Arc<BandSamples>>,
    /// Variance sigma^2 of the kernel of the band along an axis [m^2]; half of it in two
    /// dimensions.
    pub(super) variance: f64,
}

impl NarrowBandShapes {
    /// Shape of grain `index`.
    pub fn of(&self, index: usize) -> &NarrowBandShape {
        &self.shapes[index]
    }
}

impl NarrowBandShape {
    /// Signed distance [m] and its gradient at `x`, both in the frame of the grain. The distance
    /// may be infinite where it exceeds the reach.
    #[inline(always)]
    pub fn distance_and_gradient(&self, x: DVec3) -> (f64, DVec3) {
        let Some(samples) = &self.samples else {
            return self.shape.distance_and_gradient(x);
        };
        let on_grid = samples.distances.distance_and_gradient_on_grid(x);
        on_grid.unwrap_or((f64::INFINITY, DVec3::ZERO))
    }

    /// Mean distance [m] at `x`, in the frame of the grain, where the distance is `d` [m].
    #[inline(always)]
    pub fn mean_distance(&self, x: DVec3, d: f64) -> f64 {
        if let Field::Sphere(_) = self.shape.field() {
            return d + self.variance / x.length().max(self.variance.sqrt());
        }
        match &self.samples {
            Some(samples) => {
                let x = x.to_array().map(|x| Scalar(x as f32));
                let at = SampleGrid::new(samples).surface_distance(x);
                d + f64::from(at.mean_distance.0 - at.distance.0)
            }
            None => {
                let step = (3.0 * self.variance).sqrt();
                let around = DVec3::AXES.map(|axis| {
                    self.shape.distance(x + step * axis) + self.shape.distance(x - step * axis)
                });
                around.iter().sum::<f64>() / 6.0
            }
        }
    }

    /// Fills the distances and mean distances [m] at the first `count` of `points` [m], in single
    /// precision, and replaces the points by the gradients; all in the frame of the grain. Infinite
    /// distances are at least [`INFINITE_DISTANCE`] here. The lists must be `MAX_LANES` entries
    /// longer than `count`; these are overwritten.
    #[inline(always)]
    pub fn fill_distances<V: Vector<Number = f32>>(
        &self,
        points: &mut [&mut [f32]; 3],
        [distances, mean_distances]: [&mut [f32]; 2],
        count: usize,
    ) {
        if let Some(samples) = &self.samples {
            let grid = SampleGrid::<V>::new(samples);
            for at in (0..count).step_by(V::WIDTH) {
                let surface = grid.surface_distance(load_all(points, at));
                surface.distance.store(&mut distances[at..]);
                surface.mean_distance.store(&mut mean_distances[at..]);
                store_all(surface.gradient, points, at);
            }
            return;
        }
        for at in (0..count).step_by(V::WIDTH) {
            let x: [V; 3] = load_all(points, at);
            let surface = match self.shape.field() {
                Field::Sphere(radius) => sphere_distance(*radius, self.variance, x),
                _ => self.lane_by_lane(x),
            };
            surface.distance.store(&mut distances[at..]);
            surface.mean_distance.store(&mut mean_distances[at..]);
            store_all(surface.gradient, points, at);
        }
    }

    /// Evaluates the shape at the points `x`, lane by lane.
    #[cold]
    fn lane_by_lane<V: Vector<Number = f32>>(&self, x: [V; 3]) -> SurfaceDistance<V> {
        let mut points = [[0.0; MAX_LANES]; 3];
        x.iter().zip(&mut points).for_each(|(x, lanes)| x.store(lanes));
        let [mut distances, mut mean_distances] = [[0.0; MAX_LANES]; 2];
        for n in 0..V::WIDTH {
            let x = DVec3::from_array(points.map(|lanes| f64::from(lanes[n])));
            let (d, gradient) = self.distance_and_gradient(x);
            distances[n] = d.min(INFINITE_DISTANCE) as f32;
            mean_distances[n] = self.mean_distance(x, d).min(INFINITE_DISTANCE) as f32;
            for axis in 0..3 {
                points[axis][n] = gradient[axis] as f32;
            }
        }
        SurfaceDistance {
            distance: V::load(&distances),
            mean_distance: V::load(&mean_distances),
            gradient: points.map(|lanes| V::load(&lanes)),
        }
    }
}

/// Distance from a sphere around the origin, mean distance and gradient; `variance` [m^2] is that
/// of the kernel.
#[inline(always)]
fn sphere_distance<V: Vector>(radius: f64, variance: f64, [x, y, z]: [V; 3]) -> SurfaceDistance<V> {
    let length = (x * x + y * y + z * z).sqrt();
    let divisor = length.max(V::constant(1.0 / INFINITE_DISTANCE));
    let distance = length - V::constant(radius);
    // The Laplacian of the distance is 2 / r; near the centre the kernel spans the sphere.
    let excess = V::constant(variance).div(length.max(V::constant(variance.sqrt())));
    SurfaceDistance {
        distance,
        mean_distance: distance + excess,
        gradient: [x.div(divisor), y.div(divisor), z.div(divisor)],
    }
}

/// A neighbouring grain, or a periodic image of the grain itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NeighbourGrain {
    /// Index of the neighbour.
    pub grain: usize,
    /// Pose of the grain itself, without the shift.
    pub pose: Pose,
    /// Radius of the bounding sphere [m].
    pub bounding_radius: f64,
    /// Vector from the grain to its image [m].
    pub shift: DVec3,
    /// Added to the distance [m], so that both grains of a pair decide a tie alike.
    pub tie_breaker: f64,
}

impl NeighbourGrain {
    /// Signed distance from `x` to the surface of the neighbour [m], and its gradient in the frame
    /// of the neighbour. A distance above `limit` [m] may be returned as infinity.
    #[inline(always)]
    pub fn distance_and_gradient(
        &self,
        shapes: &NarrowBandShapes,
        x: DVec3,
        limit: f64,
    ) -> (f64, DVec3) {
        let x = x - self.shift;
        let far = self.bounding_radius + limit;
        if x.distance_squared(self.pose.position) > far * far {
            return (f64::INFINITY, DVec3::ZERO);
        }
        let shape = shapes.of(self.grain);
        shape.distance_and_gradient(self.pose.to_body(x))
    }

    /// Returns whether points between `start` and `end`, on a line along x, may be within `limit`
    /// [m] of the neighbour.
    pub fn is_near_row(&self, [start, end]: [DVec3; 2], limit: f64) -> bool {
        let centre = self.pose.position + self.shift;
        let closest = DVec3::new(centre.x.max(start.x).min(end.x), start.y, start.z);
        // Larger by more than rounding.
        let far = (1.0 + 1e-9) * (self.bounding_radius + limit);
        closest.distance_squared(centre) <= far * far
    }

    /// Mean distance [m] from `x` to the surface of the neighbour, where the distance is `d` [m].
    pub fn mean_distance(&self, shapes: &NarrowBandShapes, x: DVec3, d: f64) -> f64 {
        shapes.of(self.grain).mean_distance(self.pose.to_body(x - self.shift), d)
    }
}

/// Loads a vector from each list. Kernels use no closures on vectors, which would not be inlined.
#[inline(always)]
pub fn load_all<V: Vector>([x, y, z]: &[impl Deref<Target = [V::Number]>; 3], at: usize) -> [V; 3] {
    [V::load(&x[at..]), V::load(&y[at..]), V::load(&z[at..])]
}

/// Stores a vector in each list.
#[inline(always)]
pub fn store_all<V: Vector>(values: [V; 3], [x, y, z]: &mut [&mut [V::Number]; 3], at: usize) {
    values[0].store(&mut x[at..]);
    values[1].store(&mut y[at..]);
    values[2].store(&mut z[at..]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::immersed::geometry::aperture::{band_variance, forcing_reach, reference};
    use grainwake_shape::{ShapeOptions, analytic};
    use grainwake_simd::{Kernel, Registers, dispatch};

    /// Ellipsoid with the half-axes 1, 0.8 and 0.7.
    fn ellipsoid() -> Arc<Shape> {
        Arc::new(analytic::ellipsoid(1.0, 0.8, 0.7, &ShapeOptions::default()).unwrap())
    }

    #[test]
    fn sampled_distances_match_the_shape_and_extend_beyond_its_grid() {
        let edges = analytic::rounded_box(0.7, 0.6, 0.5, 0.02, &ShapeOptions::default());
        let edges = Arc::new(edges.unwrap());
        // The ellipsoid is 17, 8 and 3 half-widths across, the box 10, 5 and 3; its edges are
        // rounded by less than two of its own samples. Bounds: largest and mean error near the
        // surface, largest error beyond the grid of the shape.
        for (shape, eps, most, mean, most_beyond) in [
            (ellipsoid(), 0.12, 7e-6, 1e-7, 0.001),
            (ellipsoid(), 0.25, 0.0015, 0.00003, 0.003),
            (ellipsoid(), 0.67, 0.01, 0.0001, 0.02),
            (edges.clone(), 0.05, 4e-6, 1e-7, 0.01),
            (edges.clone(), 0.1, 0.007, 0.0003, 0.01),
            (edges, 0.2, 0.013, 0.001, 0.03),
        ] {
            let Field::Sampled(field) = shape.field() else {
                unreachable!("the shapes are sampled")
            };
            let reach = 2.5 * eps;
            let band = NarrowBandShape::new(&shape, eps, reach, band_variance(eps));
            let (mut beyond, mut errors) = (0, Vec::new());
            for i in 0..20_000 {
                let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * f64::from(i);
                let x = (1.1 + reach) * (2.0 * u.fract() - DVec3::ONE);
                let (exact, gradient) = shape.distance_and_gradient(x);
                let (distance, slope) = band.distance_and_gradient(x);
                if exact > reach {
                    assert!(distance > 0.97 * reach, "at {x}");
                    continue;
                }
                let error = distance - exact;
                if field.distance_and_gradient_on_grid(x).is_some() {
                    if exact.abs() < 0.1 {
                        errors.push(error);
                        assert!(error.abs() <= most, "{error} at {x}, eps {eps}");
                    }
                } else {
                    beyond += 1;
                    assert!(error.abs() < most_beyond, "{error} at {x}, eps {eps}");
                    assert!(slope.normalize().dot(gradient) > 0.99, "at {x}");
                }
            }
            let mean_error = errors.iter().sum::<f64>() / errors.len() as f64;
            println!("{eps}: mean {mean_error}, beyond {beyond}, near {}", errors.len());
            assert!(mean_error.abs() <= mean, "{mean_error} at {eps}");
            assert!(errors.len() > 200, "{}", errors.len());
        }
    }

    /// Compares lanes with scalar evaluation in double precision.
    struct CompareLanes<'a>(&'a NarrowBandShape);
    impl Kernel for CompareLanes<'_> {
        type Number = f32;
        #[inline(always)]
        fn run<V: Vector<Number = f32>>(self) {
            let mut far = 0;
            for i in 0..2000 {
                let mut points = [0; 3].map(|_| vec![0.0_f32; 2 * MAX_LANES]);
                for n in 0..MAX_LANES {
                    let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779);
                    let u = u * f64::from(i * 16 + n as i32);
                    let x = 2.0 * (2.0 * u.fract() - DVec3::ONE);
                    (0..3).for_each(|axis| points[axis][n] = x[axis] as f32);
                }
                let mut slopes = points.clone();
                let [mut distance, mut mean] = [[0.0_f32; 2 * MAX_LANES]; 2];
                let mut lists = slopes.each_mut().map(|list| &mut list[..]);
                let distances: [&mut [f32]; 2] = [&mut distance, &mut mean];
                (self.0).fill_distances::<V>(&mut lists, distances, MAX_LANES);
                for n in 0..MAX_LANES {
                    let of = |lists: &[Vec<f32>; 3]| {
                        DVec3::from_array(lists.each_ref().map(|list| f64::from(list[n])))
                    };
                    let (x, found) = (of(&points), f64::from(distance[n]));
                    let (d, slope) = self.0.distance_and_gradient(x);
                    if d == f64::INFINITY {
                        far += 1;
                        assert!(distance[n] > 1e29, "at {x}");
                        continue;
                    }
                    assert!((found - d).abs() < 1e-6, "{found} for {d} at {x}");
                    let (found, exact) = (f64::from(mean[n]), self.0.mean_distance(x, d));
                    assert!((found - exact).abs() < 1e-6, "mean {found} for {exact} at {x}");
                    // Gradients jump from one cell of the samples to the next.
                    let step = DVec3::splat(1e-6);
                    let sides = [x - step, x + step].map(|x| self.0.distance_and_gradient(x).1);
                    let mut sides = sides.into_iter().chain([slope]);
                    let close = |side: DVec3| (of(&slopes) - side).length() < 1e-4;
                    assert!(sides.any(close), "{} for {slope} at {x}", of(&slopes));
                }
            }
            let sphere = matches!(self.0.shape.field(), Field::Sphere(_));
            assert_eq!(far > 0, !sphere);
        }
    }

    #[test]
    fn lanes_match_scalar_evaluation() {
        let sphere = Arc::new(Shape::sphere(0.8, 100));
        for (shape, eps) in [(ellipsoid(), 0.25), (ellipsoid(), 0.05), (sphere, 0.25)] {
            let band = NarrowBandShape::new(&shape, eps, 2.5 * eps, band_variance(eps));
            dispatch(CompareLanes(&band));
            CompareLanes(&band).run::<<f32 as Registers>::Baseline>();
            CompareLanes(&band).run::<Scalar<f32>>();
        }
    }

    #[test]
    fn the_mean_distance_closes_the_volume_of_the_grain() {
        let sphere = Arc::new(Shape::sphere(0.8, 100));
        let edges = analytic::rounded_box(0.7, 0.6, 0.5, 0.02, &ShapeOptions::default());
        // Excess of the volume with the mean distance and, at least, with the distance itself.
        for (shape, most, without) in [
            (sphere, 0.003, 0.03),
            (ellipsoid(), 0.003, 0.03),
            (Arc::new(edges.unwrap()), 0.01, 0.03),
        ] {
            let eps = 0.25;
            let band = NarrowBandShape::new(&shape, eps, 2.5 * eps, band_variance(eps));
            let (step, count) = (0.031, 90);
            let [mut with_mean, mut with_distance] = [0.0; 2];
            for n in 0..count * count * count {
                let index = [n % count, n / count % count, n / (count * count)];
                let x = step * DVec3::from_array(index.map(|i| i as f64 - 44.3));
                let d = band.distance_and_gradient(x).0;
                if d < forcing_reach(eps) {
                    let mean = band.mean_distance(x, d);
                    with_mean += step.powi(3) * (1.0 - reference::aperture(mean, eps));
                    with_distance += step.powi(3) * (1.0 - reference::aperture(d, eps));
                }
            }
            let excess = |volume: f64| volume / shape.volume() - 1.0;
            let [found, plain] = [with_mean, with_distance].map(excess);
            println!("mean distance {found:.5}, distance {plain:.5}");
            assert!(found.abs() < most, "{found}");
            assert!(plain > without, "{plain}");
        }
    }
}
