//! Set-up of the geometry: width of the band, and the narrow-band shapes with distances and mean
//! distances sampled around each surface.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use grainwake_shape::{Field, SampledField, Shape};
use rayon::prelude::*;

use super::Locator;
use super::aperture::{band_variance, forcing_reach};
use super::narrow_band::{NarrowBandShape, NarrowBandShapes};
use super::samples::BandSamples;
use crate::dem::{BroadPhase, Grain};
use crate::flow::Boundaries;
use crate::grid::Mesh;
use grainwake_simd::MAX_SINGLE_INDEX;

/// Half-width of the band in mean spacings of the grid. With a narrower band the force on a grain
/// depends more on where the grid lies; a wider one smooths thin boundary layers
/// (`docs/decisions/0018-pressure-weight.md`).
const BAND_HALF_WIDTH: f64 = 1.25;

/// Half-width of the band around a surface, and distance up to which a grain affects faces [m].
fn half_width_and_reach(mesh: &Mesh) -> [f64; 2] {
    let spacings: Vec<f64> = mesh.resolved_axes().map(|axis| mesh.spacing[axis]).collect();
    let eps = BAND_HALF_WIDTH * spacings.iter().sum::<f64>() / spacings.len().max(1) as f64;
    // Half a link along the axis of the largest spacing beyond the reach of the forcing.
    [eps, forcing_reach(eps) + 0.5 * spacings.into_iter().fold(0.0, f64::max)]
}

/// Expected memory of the distances sampled around the surface of a shape on a grid [bytes].
/// Grains of one shape share them.
pub fn narrow_band_bytes(mesh: &Mesh, shape: &Shape) -> f64 {
    BandSamples::expected_bytes(shape, half_width_and_reach(mesh))
}

/// Least number of samples per half-width of the band.
const SAMPLES_PER_BAND: f64 = 5.0;
/// Least number of samples across the thinnest side of a grain.
const SAMPLES_ACROSS: f64 = 12.0;
/// Largest number of samples per half-width of the band; the flow does not resolve a thinner grain.
const MAX_SAMPLES_PER_BAND: f64 = 20.0;

impl Locator {
    /// Samples the shapes of `grains` for a grid.
    pub fn new(mesh: &Mesh, boundaries: &Boundaries, grains: &[Grain]) -> Locator {
        let [eps, reach] = half_width_and_reach(mesh);
        Locator {
            mesh: *mesh,
            periodic: boundaries.periodic(),
            eps,
            reach,
            shapes: NarrowBandShapes::new(grains, [eps, reach], mesh.resolved_axes().count()),
            search: BroadPhase::default(),
            spheres: Vec::new(),
            pairs: Vec::new(),
            neighbours: Vec::new(),
            first_neighbour: Vec::new(),
        }
    }

    /// Replaces the grid by one of the same spacing.
    pub fn set_grid(&mut self, mesh: &Mesh, boundaries: &Boundaries) {
        self.mesh = *mesh;
        self.periodic = boundaries.periodic();
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        self.shapes.bytes()
    }
}

impl NarrowBandShapes {
    /// Samples the distances up to `reach` [m] from the surfaces; `eps` [m] is the half-width of
    /// the band, `dimensions` those of the flow.
    pub fn new(grains: &[Grain], [eps, reach]: [f64; 2], dimensions: usize) -> NarrowBandShapes {
        // A sphere in two dimensions is a disc, which has half the curvature.
        let variance = band_variance(eps) * 0.5 * (dimensions as f64 - 1.0).max(0.0);
        let key = |grain: &Grain| Arc::as_ptr(&grain.shape).addr();
        let distinct: HashMap<usize, &Arc<Shape>> =
            grains.iter().map(|grain| (key(grain), &grain.shape)).collect();
        let sampled: HashMap<usize, NarrowBandShape> = (distinct.into_par_iter())
            .map(|(key, shape)| (key, NarrowBandShape::new(shape, eps, reach, variance)))
            .collect();
        NarrowBandShapes {
            shapes: grains.iter().map(|grain| sampled[&key(grain)].clone()).collect(),
        }
    }

    /// Memory held in addition to the shapes [bytes].
    pub fn bytes(&self) -> usize {
        let samples = self.shapes.iter().filter_map(|shape| shape.samples.as_ref());
        let mut samples: Vec<_> = samples.collect();
        samples.sort_by_key(|samples| Arc::as_ptr(samples));
        samples.dedup_by_key(|samples| Arc::as_ptr(samples));
        let levels = samples.iter().map(|samples| 2 * samples.mean_excess.len());
        size_of::<f32>() * levels.sum::<usize>()
    }
}

/// Spacing of the samples of a shape [m]; `eps` [m] is the half-width of the band.
fn sample_spacing(shape: &Shape, eps: f64) -> f64 {
    let thickness = (shape.upper() - shape.lower()).min_element();
    (eps / SAMPLES_PER_BAND).min(thickness / SAMPLES_ACROSS).max(eps / MAX_SAMPLES_PER_BAND)
}

impl NarrowBandShape {
    pub fn new(shape: &Arc<Shape>, eps: f64, reach: f64, variance: f64) -> NarrowBandShape {
        let samples = match shape.field() {
            Field::Sampled(_) => {
                let spacing = sample_spacing(shape, eps);
                // Doubled until single precision represents the indices of all samples.
                let mut spacings = (0..20).map(|n| spacing * f64::from(1 << n));
                let field = spacings.find_map(|spacing| {
                    let field = shape.distances(spacing, reach + spacing).ok()?;
                    (field.levels().len() <= MAX_SINGLE_INDEX).then_some(field)
                });
                field.map(|field| Arc::new(BandSamples::new(field, variance)))
            }
            _ => None,
        };
        NarrowBandShape { shape: shape.clone(), samples, variance }
    }
}

impl BandSamples {
    /// Expected memory of the samples of a shape up to `reach` [m] from its surface [bytes].
    pub fn expected_bytes(shape: &Shape, [eps, reach]: [f64; 2]) -> f64 {
        let Field::Sampled(own) = shape.field() else {
            return 0.0;
        };
        let spacing = sample_spacing(shape, eps);
        let size = shape.upper() - shape.lower() + 2.0 * (reach + spacing);
        let across = if own.spacing() < 0.9 * spacing {
            size / spacing + 1.5
        } else {
            // A coarser shape keeps its own samples, and gets more around them.
            let own_size = DVec3::from_array(own.dims().map(|n| n as f64));
            (size / own.spacing() + 1.5).max(own_size)
        };
        let count = across.element_product().min(MAX_SINGLE_INDEX as f64);
        2.0 * size_of::<f32>() as f64 * count
    }

    /// Samples with the mean distances over a kernel of the given `variance` [m^2]: the mean of six
    /// samples around a sample has the variance of their distance squared over 3.
    pub fn new(distances: SampledField, variance: f64) -> BandSamples {
        let deviation = (3.0 * variance).sqrt() / distances.spacing();
        let reach = deviation.round().max(1.0);
        let factor = (deviation / reach).powi(2);
        let (dims, levels) = (distances.dims(), distances.levels());
        let strides = [1, dims[0], dims[0] * dims[1]];
        let mean_excess = |at: usize| {
            let around = (0..3).map(|axis| {
                let index = at / strides[axis] % dims[axis];
                let below = index.min(reach as usize);
                let above = (dims[axis] - 1 - index).min(reach as usize);
                f64::from(levels[at - below * strides[axis]])
                    + f64::from(levels[at + above * strides[axis]])
            });
            (factor * (around.sum::<f64>() / 6.0 - f64::from(levels[at]))) as f32
        };
        let mean_excess = (0..levels.len()).map(mean_excess).collect();
        BandSamples { distances, mean_excess }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use grainwake_shape::{ShapeOptions, analytic};

    #[test]
    fn the_expected_memory_of_the_samples_is_theirs() {
        let options = ShapeOptions::default();
        let shapes = [
            analytic::ellipsoid(1.0, 0.8, 0.7, &options),
            analytic::rounded_box(1.0, 0.6, 0.1, 0.02, &options),
            analytic::sphere(1.0, &options),
        ];
        for shape in shapes.map(|shape| Arc::new(shape.unwrap())) {
            for eps in [0.02, 0.12, 0.3] {
                let reach = 2.5 * eps;
                let band = NarrowBandShape::new(&shape, eps, reach, band_variance(eps));
                let held = NarrowBandShapes { shapes: vec![band] }.bytes() as f64;
                let expected = BandSamples::expected_bytes(&shape, [eps, reach]);
                assert!((expected - held).abs() <= 0.02 * held, "{expected} for {held}, eps {eps}");
            }
        }
    }
}
