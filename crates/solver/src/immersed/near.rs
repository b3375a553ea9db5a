//! Distances from a grain near it, at a few nanoseconds each wherever the point lies.
//!
//! The grid of a sampled shape ends closer to the surface than the flow asks for, and distances off
//! it are searched for; where the grain is a few cells across it is also finer than the flow can tell, and
//! what is read from it would not stay near the processor. Here a wider and, if so, coarser grid holds them.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use grainwake_shape::{Field, Shape};

use super::samples::{Grid, Samples, Spot, load_all, store_all};
use crate::dem::Grain;
use crate::math::Aligned;
use grainwake_simd::{MOST, MOST_PLACES, Vector};

/// Samples in half the band, and across a grain, as far as the shape has them: what counts more. No more than
/// `MOST_SAMPLES` in half the band: the flow does not tell a grain that thin from none.
const SAMPLES: f64 = 4.0;
const ACROSS: f64 = 12.0;
const MOST_SAMPLES: f64 = 16.0;

/// The shapes of all grains with what lies about them.
pub struct NearShapes {
    /// Of each grain.
    shapes: Vec<NearShape>,
}

/// A shape and the distances about it.
#[derive(Clone)]
pub struct NearShape {
    shape: Arc<Shape>,
    /// None where the shape answers by itself: a sphere, or one for which there would be too many.
    samples: Option<Arc<Samples>>,
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
        let samples = self.shapes.iter().filter_map(|near| near.samples.as_ref());
        let mut samples: Vec<_> = samples.collect();
        samples.sort_by_key(|samples| Arc::as_ptr(samples));
        samples.dedup_by_key(|samples| Arc::as_ptr(samples));
        samples.iter().map(|samples| samples.bytes()).sum()
    }
}

impl NearShape {
    fn new(shape: &Arc<Shape>, eps: f64, reach: f64) -> NearShape {
        let samples = match shape.field() {
            Field::Sampled(_) => {
                let thickness = (shape.upper() - shape.lower()).min_element();
                let spacing = (eps / SAMPLES)
                    .min(thickness / ACROSS)
                    .max(eps / MOST_SAMPLES);
                // Coarser where that would be too many samples.
                let mut coarser = (0..20).map(|n| spacing * f64::from(1 << n));
                let field = coarser.find_map(|fine| {
                    let field = shape.distances(fine, reach + fine).ok()?;
                    (field.levels().len() <= MOST_PLACES).then_some(field)
                });
                // Interpolated distances up to the reach are true.
                field.map(|field| {
                    let most = reach + 2.0 * field.spacing();
                    Arc::new(Samples::of(&field, most))
                })
            }
            _ => None,
        };
        NearShape {
            shape: shape.clone(),
            samples,
        }
    }

    /// Signed distance [m] and its gradient at `x`, both in the frame of the grain; the distance may
    /// be infinite where it is more than the reach.
    #[inline(always)]
    pub fn distance_and_gradient(&self, x: DVec3) -> (f64, DVec3) {
        let Some(samples) = &self.samples else {
            return self.shape.distance_and_gradient(x);
        };
        let found = samples.distance_and_gradient(x);
        found.unwrap_or((f64::INFINITY, DVec3::ZERO))
    }

    /// The same at the first `count` points of lists of coordinates, in single precision; what is infinite there
    /// may be merely farther than anything here. The gradients come in the place of the points. More entries
    /// must follow, which are overwritten.
    #[inline(always)]
    pub fn measure<V: Vector<Number = f32>>(
        &self,
        points: &mut [&mut [f32]; 3],
        distances: &mut [f32],
        count: usize,
        spare: &mut Spare,
    ) {
        let Some(samples) = &self.samples else {
            for at in (0..count).step_by(V::WIDTH) {
                let x: [V; 3] = load_all(points, at);
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
        let grid = Grid::<V>::of(samples);
        let Spare { cell, off } = spare;
        cell.make_room(count + MOST);
        off.make_room(count + MOST);
        let (cell, off) = (&mut cell[..], &mut off[..]);
        for at in (0..count).step_by(V::WIDTH) {
            let spot = grid.find(load_all(points, at));
            spot.cell.store(&mut cell[at..]);
            spot.off.store(&mut off[at..]);
            store_all(spot.fraction, points, at);
        }
        for at in (0..count).step_by(V::WIDTH) {
            let (distance, slope) = grid.read(Spot {
                cell: V::load(&cell[at..]),
                off: V::load(&off[at..]),
                fraction: load_all(points, at),
            });
            distance.store(&mut distances[at..]);
            store_all(slope, points, at);
        }
    }

    /// The same for any other kind of field.
    #[cold]
    fn one_by_one<V: Vector<Number = f32>>(&self, x: [V; 3]) -> (V, [V; 3]) {
        let mut points = [[0.0; MOST]; 3];
        x.iter()
            .zip(&mut points)
            .for_each(|(x, lanes)| x.store(lanes));
        let mut distances = [0.0; MOST];
        for n in 0..V::WIDTH {
            let x = DVec3::from_array(points.map(|lanes| f64::from(lanes[n])));
            let (d, slope) = self.distance_and_gradient(x);
            distances[n] = d.min(FAR) as f32;
            for axis in 0..3 {
                points[axis][n] = slope[axis] as f32;
            }
        }
        (V::load(&distances), points.map(|lanes| V::load(&lanes)))
    }
}

/// Lists that [`NearShape::measure`] needs.
#[derive(Default)]
pub struct Spare {
    cell: Aligned<f32>,
    off: Aligned<f32>,
}

/// Farther than anything [m].
pub const FAR: f64 = 1e30;

#[inline(always)]
fn about_sphere<V: Vector>(radius: f64, [x, y, z]: [V; 3]) -> (V, [V; 3]) {
    let length = (x * x + y * y + z * z).root();
    let divisor = length.larger(V::constant(1.0 / FAR));
    let normal = [x.over(divisor), y.over(divisor), z.over(divisor)];
    (length - V::constant(radius), normal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use grainwake_shape::{ShapeOptions, analytic};
    use grainwake_simd::{Kernel, One, Registers, dispatch};

    /// An ellipsoid of half-axes 1, .8 and .7.
    fn ellipsoid() -> Arc<Shape> {
        Arc::new(analytic::ellipsoid(1.0, 0.8, 0.7, &ShapeOptions::default()).unwrap())
    }

    #[test]
    fn distances_about_a_shape_are_those_of_the_shape_and_go_on_where_its_grid_ends() {
        let edges = analytic::rounded_box(0.7, 0.6, 0.5, 0.02, &ShapeOptions::default());
        let edges = Arc::new(edges.unwrap());
        // 17, 8 and 3 cells of the flow across, 10, 5 and 3 of the box, whose edges are rounded by less than two
        // of its own samples. Errors: the most and their mean near the surface, and the most beyond.
        for (shape, eps, most, mean, about) in [
            (ellipsoid(), 0.12, 7e-6, 1e-7, 0.001),
            (ellipsoid(), 0.25, 0.0015, 0.00003, 0.003),
            (ellipsoid(), 0.67, 0.01, 0.0001, 0.02),
            (edges.clone(), 0.05, 4e-6, 1e-7, 0.01),
            (edges.clone(), 0.1, 0.007, 0.0003, 0.01),
            (edges, 0.2, 0.013, 0.001, 0.03),
        ] {
            let Field::Sampled(field) = shape.field() else {
                unreachable!("they are sampled")
            };
            let reach = 2.5 * eps;
            let near = NearShape::new(&shape, eps, reach);
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
                    assert!(error.abs() < about, "{error} at {x}, eps {eps}");
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

    /// Compares lanes with single points in double precision.
    struct Alike<'a>(&'a NearShape);
    impl Kernel for Alike<'_> {
        type Number = f32;
        #[inline(always)]
        fn run<V: Vector<Number = f32>>(self) {
            let mut far = 0;
            let mut spare = Spare::default();
            for i in 0..2000 {
                let mut points = [0; 3].map(|_| vec![0.0_f32; 2 * MOST]);
                for n in 0..MOST {
                    let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779);
                    let u = u * f64::from(i * 16 + n as i32);
                    let x = 2.0 * (2.0 * u.fract() - DVec3::ONE);
                    (0..3).for_each(|axis| points[axis][n] = x[axis] as f32);
                }
                let (mut slopes, mut distance) = (points.clone(), [0.0_f32; 2 * MOST]);
                let mut lists = slopes.each_mut().map(|list| &mut list[..]);
                self.0
                    .measure::<V>(&mut lists, &mut distance, MOST, &mut spare);
                for n in 0..MOST {
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
                    // Slopes jump from cell to cell of the samples.
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
    fn lanes_are_the_single_points() {
        let sphere = Arc::new(Shape::sphere(0.8, 100));
        for (shape, eps) in [(ellipsoid(), 0.25), (ellipsoid(), 0.05), (sphere, 0.25)] {
            let near = NearShape::new(&shape, eps, 2.5 * eps);
            dispatch(Alike(&near));
            Alike(&near).run::<<f32 as Registers>::Common>();
            Alike(&near).run::<One<f32>>();
        }
    }
}
