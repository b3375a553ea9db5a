//! Signed distance and its gradient in a narrow band around the surface of a grain or a neighbour.
//!
//! The sampled field of a shape ends closer to the surface than the band of the flow, and is often
//! finer than the flow resolves. A wider and, where possible, coarser sampled field replaces it,
//! which fits the cache and is interpolated for several points at a time, without searching.

use std::collections::HashMap;
use std::ops::Deref;
use std::sync::Arc;

use glam::DVec3;
use grainwake_shape::{Field, SampledField, Shape};
use rayon::prelude::*;

use crate::dem::Grain;
use crate::math::Pose;
use grainwake_simd::{MAX_LANES, MAX_SINGLE_INDEX, Vector};

/// Least number of samples per half-width of the band.
const SAMPLES_PER_BAND: f64 = 5.0;
/// Least number of samples across the thinnest side of a grain.
const SAMPLES_ACROSS: f64 = 12.0;
/// Largest number of samples per half-width of the band; the flow does not resolve a thinner grain.
const MAX_SAMPLES_PER_BAND: f64 = 20.0;

/// Narrow-band shapes of all grains; equal shapes share their samples.
pub struct NarrowBandShapes {
    /// Entry i is the shape of grain i.
    shapes: Vec<NarrowBandShape>,
}

/// A shape with distances sampled in a band around its surface.
#[derive(Clone)]
pub struct NarrowBandShape {
    shape: Arc<Shape>,
    /// `None` if the shape itself is evaluated: a closed form, or a shape that needs too many
    /// samples.
    samples: Option<Arc<SampledField>>,
}

impl NarrowBandShapes {
    /// Samples the distances up to `reach` [m] from the surfaces; `eps` [m] is the half-width of
    /// the band.
    pub fn new(grains: &[Grain], eps: f64, reach: f64) -> NarrowBandShapes {
        let mut indices: HashMap<*const Shape, usize> = HashMap::new();
        let mut distinct = Vec::new();
        for grain in grains {
            indices.entry(Arc::as_ptr(&grain.shape)).or_insert_with(|| {
                distinct.push(&grain.shape);
                distinct.len() - 1
            });
        }
        let sampled: Vec<NarrowBandShape> = (distinct.into_par_iter())
            .map(|shape| NarrowBandShape::new(shape, eps, reach))
            .collect();
        let of = |grain: &Grain| sampled[indices[&Arc::as_ptr(&grain.shape)]].clone();
        NarrowBandShapes { shapes: grains.iter().map(of).collect() }
    }

    /// Shape of grain `index`.
    pub fn of(&self, index: usize) -> &NarrowBandShape {
        &self.shapes[index]
    }

    /// Memory held in addition to the shapes [bytes].
    pub fn bytes(&self) -> usize {
        let samples = self.shapes.iter().filter_map(|shape| shape.samples.as_ref());
        let mut samples: Vec<_> = samples.collect();
        samples.sort_by_key(|samples| Arc::as_ptr(samples));
        samples.dedup_by_key(|samples| Arc::as_ptr(samples));
        let levels = samples.iter().map(|samples| samples.levels().len());
        size_of::<f32>() * levels.sum::<usize>()
    }
}

impl NarrowBandShape {
    fn new(shape: &Arc<Shape>, eps: f64, reach: f64) -> NarrowBandShape {
        let samples = match shape.field() {
            Field::Sampled(_) => {
                let thickness = (shape.upper() - shape.lower()).min_element();
                let spacing = (eps / SAMPLES_PER_BAND)
                    .min(thickness / SAMPLES_ACROSS)
                    .max(eps / MAX_SAMPLES_PER_BAND);
                // Doubled until single precision represents the indices of all samples.
                let mut spacings = (0..20).map(|n| spacing * f64::from(1 << n));
                let field = spacings.find_map(|spacing| {
                    let field = shape.distances(spacing, reach + spacing).ok()?;
                    (field.levels().len() <= MAX_SINGLE_INDEX).then_some(field)
                });
                field.map(Arc::new)
            }
            _ => None,
        };
        NarrowBandShape { shape: shape.clone(), samples }
    }

    /// Signed distance [m] and its gradient at `x`, both in the frame of the grain. The distance
    /// may be infinite where it exceeds the reach.
    #[inline(always)]
    pub fn distance_and_gradient(&self, x: DVec3) -> (f64, DVec3) {
        let Some(samples) = &self.samples else {
            return self.shape.distance_and_gradient(x);
        };
        let on_grid = samples.distance_and_gradient_on_grid(x);
        on_grid.unwrap_or((f64::INFINITY, DVec3::ZERO))
    }

    /// Fills the distances [m] at the first `count` of `points` [m], in single precision, and
    /// replaces the points by the gradients; both in the frame of the grain. Infinite distances are
    /// at least [`INFINITE_DISTANCE`] here. The lists must be `MAX_LANES` entries longer than
    /// `count`; these are overwritten.
    #[inline(always)]
    pub fn fill_distances<V: Vector<Number = f32>>(
        &self,
        points: &mut [&mut [f32]; 3],
        distances: &mut [f32],
        count: usize,
    ) {
        if let Some(samples) = &self.samples {
            let grid = SampleGrid::<V>::new(samples);
            for at in (0..count).step_by(V::WIDTH) {
                let (distance, gradient) = grid.distance_and_gradient(load_all(points, at));
                distance.store(&mut distances[at..]);
                store_all(gradient, points, at);
            }
            return;
        }
        for at in (0..count).step_by(V::WIDTH) {
            let x: [V; 3] = load_all(points, at);
            let (distance, gradient) = match self.shape.field() {
                Field::Sphere(radius) => sphere_distance(*radius, x),
                _ => self.lane_by_lane(x),
            };
            distance.store(&mut distances[at..]);
            store_all(gradient, points, at);
        }
    }

    /// Evaluates the shape at the points `x`, lane by lane.
    #[cold]
    fn lane_by_lane<V: Vector<Number = f32>>(&self, x: [V; 3]) -> (V, [V; 3]) {
        let mut points = [[0.0; MAX_LANES]; 3];
        x.iter().zip(&mut points).for_each(|(x, lanes)| x.store(lanes));
        let mut distances = [0.0; MAX_LANES];
        for n in 0..V::WIDTH {
            let x = DVec3::from_array(points.map(|lanes| f64::from(lanes[n])));
            let (d, gradient) = self.distance_and_gradient(x);
            distances[n] = d.min(INFINITE_DISTANCE) as f32;
            for axis in 0..3 {
                points[axis][n] = gradient[axis] as f32;
            }
        }
        (V::load(&distances), points.map(|lanes| V::load(&lanes)))
    }
}

/// Distance from a sphere around the origin, and its gradient.
#[inline(always)]
fn sphere_distance<V: Vector>(radius: f64, [x, y, z]: [V; 3]) -> (V, [V; 3]) {
    let length = (x * x + y * y + z * z).sqrt();
    let divisor = length.max(V::constant(1.0 / INFINITE_DISTANCE));
    let normal = [x.div(divisor), y.div(divisor), z.div(divisor)];
    (length - V::constant(radius), normal)
}

/// A neighbouring grain, or a periodic image of the grain itself.
#[derive(Clone, Copy, Debug)]
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
}

/// Smallest distance from `x` to a neighbour, tie breaker included [m]; infinite beyond `limit`
/// [m].
pub fn nearest_distance(
    neighbours: &[NeighbourGrain],
    shapes: &NarrowBandShapes,
    x: DVec3,
    limit: f64,
) -> f64 {
    let distances = neighbours
        .iter()
        .map(|other| other.distance_and_gradient(shapes, x, limit).0 + other.tie_breaker);
    distances.fold(f64::INFINITY, f64::min)
}

/// Distance that stands for infinity in single precision [m].
pub const INFINITE_DISTANCE: f64 = 1e30;

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

/// A sampled distance field with its constants in vector registers.
pub struct SampleGrid<'a, V> {
    lower: [V; 3],
    inverse: V,
    /// Index of the last sample along each axis.
    last: [V; 3],
    /// Samples from one row and one plane to the next.
    strides: [V; 2],
    /// Distance per level [m].
    quantum: V,
    /// Gradient per level and spacing.
    slope: V,
    levels: &'a [f32],
}

impl<'a, V: Vector> SampleGrid<'a, V> {
    #[inline(always)]
    pub fn new(field: &'a SampledField) -> SampleGrid<'a, V> {
        let (dims, inverse) = (field.dims(), 1.0 / field.spacing());
        let mut lower = [V::constant(0.0); 3];
        let mut last = lower;
        for axis in 0..3 {
            lower[axis] = V::constant(field.lower()[axis]);
            last[axis] = V::constant(dims[axis] as f64 - 1.0);
        }
        let (row, plane) = (dims[0], dims[0] * dims[1]);
        SampleGrid {
            lower,
            inverse: V::constant(inverse),
            last,
            strides: [V::constant(row as f64), V::constant(plane as f64)],
            quantum: V::constant(field.quantum()),
            slope: V::constant(field.quantum() * inverse),
            levels: field.levels(),
        }
    }

    /// Interpolates signed distance [m] and gradient at `x`, in the frame of the grain. Off the
    /// grid the distance is [`INFINITE_DISTANCE`].
    #[inline(always)]
    pub fn distance_and_gradient(&self, x: [V; 3]) -> (V, [V; 3]) {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let mut cell = [zero; 3];
        let mut fraction = [zero; 3];
        let mut off_grid = zero;
        for axis in 0..3 {
            let s = (x[axis] - self.lower[axis]) * self.inverse;
            let nearest = s.max(zero).min(self.last[axis]);
            off_grid = off_grid + (s - nearest).abs();
            cell[axis] = nearest.floor().min(self.last[axis] - one);
            fraction[axis] = nearest - cell[axis];
        }
        let [row, plane] = self.strides;
        let [fx, fy, fz] = fraction;
        // Value and slope on the four edges along x.
        let (at, levels) = (cell[0] + row * cell[1] + plane * cell[2], self.levels);
        let [a, s] = edge(levels, at, fx);
        let [b, t] = edge(levels, at + row, fx);
        let [c, u] = edge(levels, at + plane, fx);
        let [d, v] = edge(levels, at + plane + row, fx);
        let (low, high) = (a + fy * (b - a), c + fy * (d - c));
        let (slope_low, slope_high) = (s + fy * (t - s), u + fy * (v - u));
        let gradient = [
            self.slope * (slope_low + fz * (slope_high - slope_low)),
            self.slope * ((b - a) + fz * ((d - c) - (b - a))),
            self.slope * (high - low),
        ];
        let distance = self.quantum * (low + fz * (high - low));
        (zero.select_below(off_grid, V::constant(INFINITE_DISTANCE), distance), gradient)
    }
}

/// Value at the fraction `x` of the edge from sample `at` to the next along x, and their
/// difference.
#[inline(always)]
fn edge<V: Vector>(levels: &[f32], at: V, x: V) -> [V; 2] {
    let [low, high] = V::gather_pairs(levels, at);
    let slope = high - low;
    [low + x * slope, slope]
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
            let band = NarrowBandShape::new(&shape, eps, reach);
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
                let (mut slopes, mut distance) = (points.clone(), [0.0_f32; 2 * MAX_LANES]);
                let mut lists = slopes.each_mut().map(|list| &mut list[..]);
                (self.0).fill_distances::<V>(&mut lists, &mut distance, MAX_LANES);
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
            let band = NarrowBandShape::new(&shape, eps, 2.5 * eps);
            dispatch(CompareLanes(&band));
            CompareLanes(&band).run::<<f32 as Registers>::Baseline>();
            CompareLanes(&band).run::<Scalar<f32>>();
        }
    }
}
