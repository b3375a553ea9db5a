//! Distances in a narrow band around a grain, a few nanoseconds each.
//!
//! The sampled field of a shape ends closer to the surface than the band of the flow, and distances
//! beyond it are searched for. It may also be finer than the flow resolves and so too large for the
//! cache. Here a wider and, where possible, coarser grid of 16-bit samples replaces it.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use grainwake_shape::{Field, Shape};

use super::samples::{DistanceSamples, FAR, SampleGrid, SampleLocation, load_all, store_all};
use crate::dem::Grain;
use crate::math::Aligned;
use grainwake_simd::{MAX_LANES, MAX_SINGLE_INDEX, Vector};

/// Samples per half-width of the band.
const SAMPLES_PER_BAND: f64 = 4.0;
/// Samples across the thinnest side of a grain, if that needs more of them.
const SAMPLES_ACROSS: f64 = 12.0;
/// Upper limit of samples per half-width of the band: the flow does not resolve a thinner grain.
const MOST_SAMPLES_PER_BAND: f64 = 16.0;

/// Narrow-band shapes of all grains; equal shapes share their samples.
pub struct NarrowBandShapes {
    /// One per grain.
    shapes: Vec<NarrowBandShape>,
}

/// A shape with distances sampled in a band around its surface.
#[derive(Clone)]
pub struct NarrowBandShape {
    shape: Arc<Shape>,
    /// `None` if the shape itself is evaluated: a sphere, or one that would need too many samples.
    samples: Option<Arc<DistanceSamples>>,
}

impl NarrowBandShapes {
    /// Samples distances up to `reach` [m] for a flow with the band half-width `eps` [m].
    pub fn new(grains: &[Grain], eps: f64, reach: f64) -> NarrowBandShapes {
        let mut known: HashMap<*const Shape, NarrowBandShape> = HashMap::new();
        let sampled = |grain: &Grain| {
            let shape = known.entry(Arc::as_ptr(&grain.shape));
            shape
                .or_insert_with(|| NarrowBandShape::new(&grain.shape, eps, reach))
                .clone()
        };
        NarrowBandShapes {
            shapes: grains.iter().map(sampled).collect(),
        }
    }

    /// Shape of grain `index`.
    pub fn of(&self, index: usize) -> &NarrowBandShape {
        &self.shapes[index]
    }

    /// Memory held in addition to the shapes [bytes].
    pub fn bytes(&self) -> usize {
        let samples = self
            .shapes
            .iter()
            .filter_map(|shape| shape.samples.as_ref());
        let mut samples: Vec<_> = samples.collect();
        samples.sort_by_key(|samples| Arc::as_ptr(samples));
        samples.dedup_by_key(|samples| Arc::as_ptr(samples));
        samples.iter().map(|samples| samples.bytes()).sum()
    }
}

impl NarrowBandShape {
    fn new(shape: &Arc<Shape>, eps: f64, reach: f64) -> NarrowBandShape {
        let samples = match shape.field() {
            Field::Sampled(_) => {
                let thickness = (shape.upper() - shape.lower()).min_element();
                let spacing = (eps / SAMPLES_PER_BAND)
                    .min(thickness / SAMPLES_ACROSS)
                    .max(eps / MOST_SAMPLES_PER_BAND);
                // Doubled until positions fit single precision.
                let mut spacings = (0..20).map(|n| spacing * f64::from(1 << n));
                let field = spacings.find_map(|spacing| {
                    let field = shape.distances(spacing, reach + spacing).ok()?;
                    (field.levels().len() <= MAX_SINGLE_INDEX).then_some(field)
                });
                // With this margin interpolated distances are exact up to `reach`.
                field.map(|field| {
                    let most = reach + 2.0 * field.spacing();
                    Arc::new(DistanceSamples::new(&field, most))
                })
            }
            _ => None,
        };
        NarrowBandShape {
            shape: shape.clone(),
            samples,
        }
    }

    /// Signed distance [m] and its gradient at `x`, both in the frame of the grain. The distance may
    /// be infinite where it exceeds the reach.
    #[inline(always)]
    pub fn distance_and_gradient(&self, x: DVec3) -> (f64, DVec3) {
        let Some(samples) = &self.samples else {
            return self.shape.distance_and_gradient(x);
        };
        let found = samples.distance_and_gradient(x);
        found.unwrap_or((f64::INFINITY, DVec3::ZERO))
    }

    /// Fills the distances at the first `count` of `points`, in single precision, and replaces the
    /// points by the gradients. Infinite distances are at least [`FAR`] here. The lists must be
    /// `MAX_LANES` entries longer than `count`; these are overwritten.
    #[inline(always)]
    pub fn fill_distances<V: Vector<Number = f32>>(
        &self,
        points: &mut [&mut [f32]; 3],
        distances: &mut [f32],
        count: usize,
        scratch: &mut SampleScratch,
    ) {
        let Some(samples) = &self.samples else {
            for at in (0..count).step_by(V::WIDTH) {
                let x: [V; 3] = load_all(points, at);
                let (distance, gradient) = match self.shape.field() {
                    Field::Sphere(radius) => sphere_distance(*radius, x),
                    _ => self.lane_by_lane(x),
                };
                distance.store(&mut distances[at..]);
                store_all(gradient, points, at);
            }
            return;
        };
        // Two loops: the second contains little but loads, so that those of several vectors overlap.
        let grid = SampleGrid::<V>::new(samples);
        let SampleScratch { cell, off_grid } = scratch;
        cell.make_room(count + MAX_LANES);
        off_grid.make_room(count + MAX_LANES);
        let (cell, off_grid) = (&mut cell[..], &mut off_grid[..]);
        for at in (0..count).step_by(V::WIDTH) {
            let location = grid.locate(load_all(points, at));
            location.cell.store(&mut cell[at..]);
            location.off_grid.store(&mut off_grid[at..]);
            store_all(location.fraction, points, at);
        }
        for at in (0..count).step_by(V::WIDTH) {
            let (distance, gradient) = grid.interpolate(SampleLocation {
                cell: V::load(&cell[at..]),
                off_grid: V::load(&off_grid[at..]),
                fraction: load_all(points, at),
            });
            distance.store(&mut distances[at..]);
            store_all(gradient, points, at);
        }
    }

    /// Evaluates the shape for one lane after the other.
    #[cold]
    fn lane_by_lane<V: Vector<Number = f32>>(&self, x: [V; 3]) -> (V, [V; 3]) {
        let mut points = [[0.0; MAX_LANES]; 3];
        x.iter()
            .zip(&mut points)
            .for_each(|(x, lanes)| x.store(lanes));
        let mut distances = [0.0; MAX_LANES];
        for n in 0..V::WIDTH {
            let x = DVec3::from_array(points.map(|lanes| f64::from(lanes[n])));
            let (d, gradient) = self.distance_and_gradient(x);
            distances[n] = d.min(FAR) as f32;
            for axis in 0..3 {
                points[axis][n] = gradient[axis] as f32;
            }
        }
        (V::load(&distances), points.map(|lanes| V::load(&lanes)))
    }
}

/// Buffers of [`NarrowBandShape::fill_distances`].
#[derive(Default)]
pub struct SampleScratch {
    cell: Aligned<f32>,
    off_grid: Aligned<f32>,
}

/// Distance from a sphere around the origin, and its gradient.
#[inline(always)]
fn sphere_distance<V: Vector>(radius: f64, [x, y, z]: [V; 3]) -> (V, [V; 3]) {
    let length = (x * x + y * y + z * z).sqrt();
    let divisor = length.max(V::constant(1.0 / FAR));
    let normal = [x.div(divisor), y.div(divisor), z.div(divisor)];
    (length - V::constant(radius), normal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use grainwake_shape::{ShapeOptions, analytic};
    use grainwake_simd::{Kernel, Registers, Scalar, dispatch};

    /// Ellipsoid with the half-axes 1, 0.8 and 0.7.
    fn ellipsoid() -> Arc<Shape> {
        Arc::new(analytic::ellipsoid(1.0, 0.8, 0.7, &ShapeOptions::default()).unwrap())
    }

    #[test]
    fn sampled_distances_match_the_shape_and_extend_beyond_its_grid() {
        let edges = analytic::rounded_box(0.7, 0.6, 0.5, 0.02, &ShapeOptions::default());
        let edges = Arc::new(edges.unwrap());
        // The ellipsoid is 17, 8 and 3 flow cells across, the box 10, 5 and 3; its edges are rounded by
        // less than two of its own samples. Bounds: largest and mean error near the surface, largest
        // error beyond the grid of the shape.
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
            let near = NarrowBandShape::new(&shape, eps, reach);
            let (mut beyond, mut errors) = (0, Vec::new());
            for i in 0..20_000 {
                let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * f64::from(i);
                let x = (1.1 + reach) * (2.0 * u.fract() - DVec3::ONE);
                let (exact, gradient) = shape.distance_and_gradient(x);
                let (distance, slope) = near.distance_and_gradient(x);
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
            let found = errors.iter().sum::<f64>() / errors.len() as f64;
            println!(
                "{eps}: mean {found}, beyond {beyond}, near {}",
                errors.len()
            );
            assert!(found.abs() <= mean, "{found} at {eps}");
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
            let mut scratch = SampleScratch::default();
            for i in 0..2000 {
                let mut points = [0; 3].map(|_| vec![0.0_f32; 2 * MAX_LANES]);
                for n in 0..MAX_LANES {
                    let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779);
                    let u = u * f64::from(i * 16 + n as i32);
                    let x = 2.0 * (2.0 * u.fract() - DVec3::ONE);
                    (0..3).for_each(|axis| points[axis][n] = x[axis] as f32);
                }
                let (mut slopes, mut distance) = (points.clone(), [0.0_f32; 2 * MAX_LANES]);
                let mut lists = slopes.each_mut().map(|list| &mut list[..]);
                self.0
                    .fill_distances::<V>(&mut lists, &mut distance, MAX_LANES, &mut scratch);
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
                    // Gradients jump from one cell of the samples to the next.
                    let step = DVec3::splat(1e-6);
                    let sides = [x - step, x + step].map(|x| self.0.distance_and_gradient(x).1);
                    let mut sides = sides.into_iter().chain([slope]);
                    let near = |side: DVec3| (of(&slopes) - side).length() < 1e-4;
                    assert!(sides.any(near), "{} for {slope} at {x}", of(&slopes));
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
            let near = NarrowBandShape::new(&shape, eps, 2.5 * eps);
            dispatch(CompareLanes(&near));
            CompareLanes(&near).run::<<f32 as Registers>::Baseline>();
            CompareLanes(&near).run::<Scalar<f32>>();
        }
    }
}
