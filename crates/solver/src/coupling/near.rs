//! Distances from a grain near it, at a few nanoseconds each wherever the point lies.
//!
//! The grid of a sampled shape ends closer to the surface than the flow asks for, and distances off
//! it are searched for. Here a second, coarser grid about the first holds them.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use grainwake_shape::{Field, SampledField, Shape};

use crate::dem::Grain;
use crate::math::lanes::{MOST, Vector};

/// Samples of the coarse grid in half the band, and across a grain: what counts more.
const SAMPLES: f64 = 3.0;
const ACROSS: f64 = 12.0;

/// The shapes of all grains with what lies about them.
pub struct NearShapes {
    /// Of each grain.
    shapes: Vec<NearShape>,
}

/// A shape and the distances about it.
#[derive(Clone)]
pub struct NearShape {
    shape: Arc<Shape>,
    /// None where the shape answers by itself: a sphere, or a grid that reaches as far.
    about: Option<Arc<About>>,
}

/// The coarse grid about the grid of a shape.
struct About {
    field: SampledField,
    /// Levels of the shape's grid, then those of this one: lanes on either grid find theirs in one list.
    levels: Vec<f32>,
}

impl NearShapes {
    /// For distances up to `reach` [m] about the grains, in a flow with the band `eps` [m].
    pub fn new(grains: &[Grain], eps: f64, reach: f64) -> NearShapes {
        let mut known: HashMap<*const Shape, NearShape> = HashMap::new();
        let of = |grain: &Grain| {
            let near = known.entry(Arc::as_ptr(&grain.shape));
            near.or_insert_with(|| NearShape::new(&grain.shape, eps, reach))
                .clone()
        };
        NearShapes {
            shapes: grains.iter().map(of).collect(),
        }
    }

    /// That of grain `index`.
    pub fn of(&self, index: usize) -> &NearShape {
        &self.shapes[index]
    }

    /// Memory held beside the shapes [bytes].
    pub fn bytes(&self) -> usize {
        let mut grids: Vec<_> = self
            .shapes
            .iter()
            .filter_map(|n| n.about.as_ref())
            .collect();
        grids.sort_by_key(|about| Arc::as_ptr(about));
        grids.dedup_by_key(|about| Arc::as_ptr(about));
        let levels = grids
            .iter()
            .map(|about| about.field.levels().len() + about.levels.len());
        size_of::<f32>() * levels.sum::<usize>()
    }
}

/// Does the grid of a field hold this box?
fn holds(field: &SampledField, lower: DVec3, upper: DVec3) -> bool {
    field.lower().cmple(lower).all() && field.upper().cmpge(upper).all()
}

impl NearShape {
    fn new(shape: &Arc<Shape>, eps: f64, reach: f64) -> NearShape {
        let about = if let Field::Sampled(field) = shape.field()
            && !holds(field, shape.lower() - reach, shape.upper() + reach)
        {
            // No finer than the shape itself, so that large grains cost no more than that.
            let thickness = (shape.upper() - shape.lower()).min_element();
            let spacing = (eps / SAMPLES).min(thickness / ACROSS);
            let spacing = spacing.max(field.spacing());
            // Coarser where that would be too many samples.
            let mut coarser = (0..20).map(|doublings| f64::from(1 << doublings) * spacing);
            let about = coarser.find_map(|spacing| shape.resampled(spacing, reach + spacing).ok());
            about.map(|about| {
                let levels = [field.levels(), about.levels()].concat();
                let field = about;
                Arc::new(About { field, levels })
            })
        } else {
            None
        };
        NearShape {
            shape: shape.clone(),
            about,
        }
    }

    /// Signed distance [m] and its gradient at `x`, both in the frame of the grain; the distance may
    /// be infinite where it is more than the reach.
    #[inline]
    pub fn distance_and_gradient(&self, x: DVec3) -> (f64, DVec3) {
        const FAR: (f64, DVec3) = (f64::INFINITY, DVec3::ZERO);
        let Field::Sampled(field) = self.shape.field() else {
            return self.shape.distance_and_gradient(x);
        };
        let found = field.distance_and_gradient_on_grid(x);
        // Without a second grid the first reaches as far as is asked for.
        let about = || self.about.as_ref()?.field.distance_and_gradient_on_grid(x);
        found.or_else(about).unwrap_or(FAR)
    }

    /// The same at the points whose coordinates are the lanes of `x`, bit for bit; what is infinite
    /// there may be merely farther than anything here.
    #[inline(always)]
    pub fn lanes<V: Vector<Number = f64>>(&self, x: [V; 3]) -> (V, [V; 3]) {
        match (self.shape.field(), &self.about) {
            (Field::Sphere(radius), _) => about_sphere(*radius, x),
            (Field::Sampled(field), None) => {
                let off = off_grid(field, x);
                let (d, slope) = on_grid(Grid::of(field), field.levels(), x);
                (d + off * V::constant(FAR), slope)
            }
            (Field::Sampled(field), Some(about)) => {
                let off = off_grid(field, x);
                if off.is_zero() {
                    return on_grid(Grid::of(field), &about.levels, x);
                }
                let mut beyond = Grid::of(&about.field);
                beyond.first = V::constant(field.levels().len() as f64);
                let grid = Grid::of(field).or_where(off, beyond);
                let (d, slope) = on_grid(grid, &about.levels, x);
                (d + off_grid(&about.field, x) * V::constant(FAR), slope)
            }
            _ => self.one_by_one(x),
        }
    }

    /// The same for any other kind of field.
    #[cold]
    fn one_by_one<V: Vector<Number = f64>>(&self, x: [V; 3]) -> (V, [V; 3]) {
        let mut points = [[0.0; MOST]; 3];
        x.iter()
            .zip(&mut points)
            .for_each(|(x, lanes)| x.store(lanes));
        let mut distances = [0.0; MOST];
        for n in 0..V::WIDTH {
            let x = DVec3::from_array(points.map(|lanes| lanes[n]));
            let (d, slope) = self.distance_and_gradient(x);
            distances[n] = d.min(FAR);
            for axis in 0..3 {
                points[axis][n] = slope[axis];
            }
        }
        (V::load(&distances), points.map(|lanes| V::load(&lanes)))
    }
}

/// Farther than anything [m].
const FAR: f64 = 1e100;

#[inline(always)]
fn about_sphere<V: Vector<Number = f64>>(radius: f64, [x, y, z]: [V; 3]) -> (V, [V; 3]) {
    let length = (x * x + y * y + z * z).root();
    let divisor = length.larger(V::constant(f64::MIN_POSITIVE));
    let normal = [x.over(divisor), y.over(divisor), z.over(divisor)];
    (length - V::constant(radius), normal)
}

/// 1 where a point is off the grid of a field, else 0.
#[inline(always)]
fn off_grid<V: Vector<Number = f64>>(field: &SampledField, x: [V; 3]) -> V {
    let zero = V::constant(0.0);
    let inverse = V::constant(1.0 / field.spacing());
    let mut outside = zero;
    for axis in 0..3 {
        let last = V::constant(field.dims()[axis] as f64 - 1.0);
        let s = (x[axis] - V::constant(field.lower()[axis])) * inverse;
        outside = outside + (s - s.larger(zero).smaller(last)).magnitude();
    }
    // Whatever is off the grid is so by more than a rounding.
    zero.is_below(outside)
}

/// The grid of a field, which may be another one for each lane.
#[derive(Clone, Copy)]
struct Grid<V> {
    lower: [V; 3],
    inverse: V,
    /// Number of the last sample along each axis.
    last: [V; 3],
    /// From one row and one plane of samples to the next.
    strides: [V; 2],
    /// Place of the first sample in the list of levels.
    first: V,
    /// What a level is [m], and that over the spacing.
    quantum: V,
    slope: V,
}

impl<V: Vector<Number = f64>> Grid<V> {
    #[inline(always)]
    fn of(field: &SampledField) -> Grid<V> {
        let (lower, dims, inverse) = (field.lower(), field.dims(), 1.0 / field.spacing());
        let last = |axis: usize| V::constant(dims[axis] as f64 - 1.0);
        Grid {
            lower: [lower.x, lower.y, lower.z].map(V::constant),
            inverse: V::constant(inverse),
            last: [last(0), last(1), last(2)],
            strides: [dims[0], dims[0] * dims[1]].map(|stride| V::constant(stride as f64)),
            first: V::constant(0.0),
            quantum: V::constant(field.quantum()),
            slope: V::constant(field.quantum() * inverse),
        }
    }

    /// This one where `off` is 0, `other` where it is 1.
    #[inline(always)]
    fn or_where(self, off: V, other: Grid<V>) -> Grid<V> {
        let half = V::constant(0.5);
        let mut both = self;
        for axis in 0..3 {
            both.lower[axis] = off.where_below(half, self.lower[axis], other.lower[axis]);
            both.last[axis] = off.where_below(half, self.last[axis], other.last[axis]);
        }
        for n in 0..2 {
            both.strides[n] = off.where_below(half, self.strides[n], other.strides[n]);
        }
        both.inverse = off.where_below(half, self.inverse, other.inverse);
        both.first = off.where_below(half, self.first, other.first);
        both.quantum = off.where_below(half, self.quantum, other.quantum);
        both.slope = off.where_below(half, self.slope, other.slope);
        both
    }
}

/// Distance and gradient on a grid whose samples are in `levels`; of points off it, those of the nearest
/// point on it.
#[inline(always)]
fn on_grid<V: Vector<Number = f64>>(grid: Grid<V>, levels: &[f32], x: [V; 3]) -> (V, [V; 3]) {
    let (zero, one) = (V::constant(0.0), V::constant(1.0));
    let mut cell = [zero; 3];
    let mut fraction = [zero; 3];
    for axis in 0..3 {
        let s = (x[axis] - grid.lower[axis]) * grid.inverse;
        let place = s.larger(zero).smaller(grid.last[axis]);
        cell[axis] = place.floor().smaller(grid.last[axis] - one);
        fraction[axis] = place - cell[axis];
    }
    let [row, plane] = grid.strides;
    let at = grid.first + cell[0] + row * cell[1] + plane * cell[2];
    let [fx, fy, fz] = fraction;
    // Value and slope on the four edges along x.
    let (a, s) = edge(levels, at, fx);
    let (b, t) = edge(levels, at + row, fx);
    let (c, u) = edge(levels, at + plane, fx);
    let (d, v) = edge(levels, at + plane + row, fx);
    let (low, high) = (a + fy * (b - a), c + fy * (d - c));
    let (slope_low, slope_high) = (s + fy * (t - s), u + fy * (v - u));
    let gradient = [
        grid.slope * (slope_low + fz * (slope_high - slope_low)),
        grid.slope * ((b - a) + fz * ((d - c) - (b - a))),
        grid.slope * (high - low),
    ];
    (grid.quantum * (low + fz * (high - low)), gradient)
}

/// Value between the samples at `at` and the next along x, and the slope from one to the other.
#[inline(always)]
fn edge<V: Vector<Number = f64>>(levels: &[f32], at: V, x: V) -> (V, V) {
    let [low, high] = V::pairs(levels, at);
    let slope = high - low;
    (low + x * slope, slope)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::{Kernel, One, Registers, dispatch};
    use grainwake_shape::{ShapeOptions, analytic};

    /// An ellipsoid of half-axes 1, .8 and .7.
    fn ellipsoid() -> Arc<Shape> {
        Arc::new(analytic::ellipsoid(1.0, 0.8, 0.7, &ShapeOptions::default()).unwrap())
    }

    #[test]
    fn distances_about_a_shape_go_on_where_its_grid_ends() {
        let shape = ellipsoid();
        let Field::Sampled(field) = shape.field() else {
            unreachable!("ellipsoids are sampled")
        };
        // 8 and 3 cells of the flow across.
        for (eps, tolerance) in [(0.25, 0.01), (0.67, 0.03)] {
            let reach = 2.5 * eps;
            let near = NearShape::new(&shape, eps, reach);
            let mut beyond = 0;
            for i in 0..20_000 {
                let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * f64::from(i);
                let x = (1.1 + reach) * (2.0 * u.fract() - DVec3::ONE);
                let (exact, gradient) = shape.distance_and_gradient(x);
                let (distance, slope) = near.distance_and_gradient(x);
                if exact > reach {
                    assert!(distance > 0.97 * reach, "at {x}");
                } else if field.distance_and_gradient_on_grid(x).is_some() {
                    assert_eq!(distance, exact, "at {x}");
                } else {
                    beyond += 1;
                    let off = (distance - exact).abs() / eps;
                    assert!(off < tolerance, "{off} of the band at {x}");
                    assert!(slope.normalize().dot(gradient) > 0.99, "at {x}");
                }
            }
            assert!(beyond > 1000, "{beyond}");
        }
    }

    /// Compares lanes with single points.
    struct Alike<'a>(&'a NearShape);
    impl Kernel for Alike<'_> {
        type Number = f64;
        #[inline(always)]
        fn run<V: Vector<Number = f64>>(self) {
            let mut far = 0;
            for i in 0..4000 {
                let mut points = [[0.0; MOST]; 3];
                for n in 0..V::WIDTH {
                    let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779);
                    let u = u * f64::from(i * 16 + n as i32);
                    let x = 2.0 * (2.0 * u.fract() - DVec3::ONE);
                    (0..3).for_each(|axis| points[axis][n] = x[axis]);
                }
                let (d, slope) = self.0.lanes(points.map(|lanes| V::load(&lanes)));
                let (mut distance, mut slopes) = ([0.0; MOST], [[0.0; MOST]; 3]);
                d.store(&mut distance);
                slope
                    .iter()
                    .zip(&mut slopes)
                    .for_each(|(v, lanes)| v.store(lanes));
                for n in 0..V::WIDTH {
                    let x = DVec3::from_array(points.map(|lanes| lanes[n]));
                    let (d, slope) = self.0.distance_and_gradient(x);
                    if d == f64::INFINITY {
                        far += 1;
                        assert!(distance[n] > 1e90, "at {x}");
                    } else {
                        assert_eq!(distance[n], d, "at {x}");
                        assert_eq!(slopes.map(|lanes| lanes[n]), slope.to_array(), "at {x}");
                    }
                }
            }
            let sphere = matches!(self.0.shape.field(), Field::Sphere(_));
            assert_eq!(far > 0, !sphere);
        }
    }

    #[test]
    fn lanes_are_the_single_points() {
        let sphere = Arc::new(Shape::sphere(0.8, 100));
        for (shape, eps) in [(ellipsoid(), 0.25), (ellipsoid(), 0.05), (sphere, 0.25)] {
            let near = NearShape::new(&shape, eps, 2.5 * eps);
            dispatch(Alike(&near));
            Alike(&near).run::<<f64 as Registers>::Common>();
            Alike(&near).run::<One<f64>>();
        }
    }

    #[test]
    fn a_grid_that_reaches_far_enough_is_not_doubled() {
        let near = |eps| NearShape::new(&ellipsoid(), eps, 2.5 * eps);
        assert!(near(0.25).about.is_some());
        let near = near(0.05);
        assert!(near.about.is_none());
        let distance = |z: f64| near.distance_and_gradient(DVec3::new(0.0, 0.0, z)).0;
        assert!(distance(5.0) > 0.125);
        assert!((distance(0.8) - 0.1).abs() < 1e-3);
    }
}
