//! Distances from a grain near it, at a few nanoseconds each wherever the point lies.
//!
//! The grid of a sampled shape ends closer to the surface than the flow asks for, and distances off
//! it are searched for. Here a second, coarser grid about the first holds them.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use grainwake_shape::{Field, SampledField, Shape};

use super::samples::{Grids, Spot, load_all, store_all};
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
pub struct About {
    pub field: SampledField,
    /// Levels of the shape's grid, then those of this one: lanes on either grid find theirs in one list.
    pub levels: Vec<f32>,
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

    /// The same at the first `count` points of lists of coordinates, bit for bit; what is infinite there
    /// may be merely farther than anything here. The gradients come in the place of the points. More entries
    /// must follow, which are overwritten.
    #[inline(always)]
    pub fn measure<V: Vector<Number = f64>>(
        &self,
        points: &mut [Vec<f64>; 3],
        distances: &mut [f64],
        count: usize,
        spare: &mut Spare,
    ) {
        let Field::Sampled(field) = self.shape.field() else {
            for at in (0..count).step_by(V::WIDTH) {
                let x = load_all::<V>(points, at);
                let (distance, slope) = match self.shape.field() {
                    Field::Sphere(radius) => about_sphere(*radius, x),
                    _ => self.one_by_one(x),
                };
                distance.store(&mut distances[at..]);
                store_all(slope, points, at);
            }
            return;
        };
        // Samples are far apart in memory. Little but their loads is in the second loop, so that the
        // processor has those of several vectors under way at once.
        let grids = Grids::of(field, self.about.as_deref());
        let Spare { cell, which } = spare;
        for list in [&mut *cell, &mut *which] {
            list.resize(list.len().max(count + MOST), 0.0);
        }
        for at in (0..count).step_by(V::WIDTH) {
            let spot = grids.find(load_all::<V>(points, at));
            spot.cell.store(&mut cell[at..]);
            spot.which.store(&mut which[at..]);
            store_all(spot.fraction, points, at);
        }
        for at in (0..count).step_by(V::WIDTH) {
            let (distance, slope) = grids.read(Spot {
                cell: V::load(&cell[at..]),
                which: V::load(&which[at..]),
                fraction: load_all::<V>(points, at),
            });
            distance.store(&mut distances[at..]);
            store_all(slope, points, at);
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

/// Lists that [`NearShape::measure`] needs.
#[derive(Default)]
pub struct Spare {
    cell: Vec<f64>,
    which: Vec<f64>,
}

/// Farther than anything [m].
pub const FAR: f64 = 1e100;

#[inline(always)]
fn about_sphere<V: Vector<Number = f64>>(radius: f64, [x, y, z]: [V; 3]) -> (V, [V; 3]) {
    let length = (x * x + y * y + z * z).root();
    let divisor = length.larger(V::constant(f64::MIN_POSITIVE));
    let normal = [x.over(divisor), y.over(divisor), z.over(divisor)];
    (length - V::constant(radius), normal)
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
            let mut spare = Spare::default();
            for i in 0..2000 {
                let mut points = [0; 3].map(|_| vec![0.0; 2 * MOST]);
                for n in 0..MOST {
                    let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779);
                    let u = u * f64::from(i * 16 + n as i32);
                    let x = 2.0 * (2.0 * u.fract() - DVec3::ONE);
                    (0..3).for_each(|axis| points[axis][n] = x[axis]);
                }
                let (mut slopes, mut distance) = (points.clone(), [0.0; 2 * MOST]);
                self.0
                    .measure::<V>(&mut slopes, &mut distance, MOST, &mut spare);
                for n in 0..MOST {
                    let of = |lists: &[Vec<f64>; 3]| {
                        DVec3::from_array(lists.each_ref().map(|list| list[n]))
                    };
                    let x = of(&points);
                    let (d, slope) = self.0.distance_and_gradient(x);
                    if d == f64::INFINITY {
                        far += 1;
                        assert!(distance[n] > 1e90, "at {x}");
                    } else {
                        assert_eq!(distance[n], d, "at {x}");
                        assert_eq!(of(&slopes), slope, "at {x}");
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
