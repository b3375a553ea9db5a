//! Set-up of the narrow-band shapes: distances and mean distances sampled around each surface.

use std::collections::HashMap;
use std::sync::Arc;

use grainwake_shape::{Field, SampledField, Shape};
use rayon::prelude::*;

use super::aperture::band_variance;
use super::narrow_band::{NarrowBandShape, NarrowBandShapes};
use super::samples::BandSamples;
use crate::dem::Grain;
use grainwake_simd::MAX_SINGLE_INDEX;

/// Least number of samples per half-width of the band.
const SAMPLES_PER_BAND: f64 = 5.0;
/// Least number of samples across the thinnest side of a grain.
const SAMPLES_ACROSS: f64 = 12.0;
/// Largest number of samples per half-width of the band; the flow does not resolve a thinner grain.
const MAX_SAMPLES_PER_BAND: f64 = 20.0;

impl NarrowBandShapes {
    /// Samples the distances up to `reach` [m] from the surfaces; `eps` [m] is the half-width of
    /// the band, `dimensions` those of the flow.
    pub fn new(grains: &[Grain], [eps, reach]: [f64; 2], dimensions: usize) -> NarrowBandShapes {
        // A sphere in two dimensions is a disc, which has half the curvature.
        let variance = band_variance(eps) * 0.5 * (dimensions as f64 - 1.0).max(0.0);
        let mut indices: HashMap<*const Shape, usize> = HashMap::new();
        let mut distinct = Vec::new();
        for grain in grains {
            indices.entry(Arc::as_ptr(&grain.shape)).or_insert_with(|| {
                distinct.push(&grain.shape);
                distinct.len() - 1
            });
        }
        let sampled: Vec<NarrowBandShape> = (distinct.into_par_iter())
            .map(|shape| NarrowBandShape::new(shape, eps, reach, variance))
            .collect();
        let of = |grain: &Grain| sampled[indices[&Arc::as_ptr(&grain.shape)]].clone();
        NarrowBandShapes { shapes: grains.iter().map(of).collect() }
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

impl NarrowBandShape {
    pub fn new(shape: &Arc<Shape>, eps: f64, reach: f64, variance: f64) -> NarrowBandShape {
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
                field.map(|field| Arc::new(BandSamples::new(field, variance)))
            }
            _ => None,
        };
        NarrowBandShape { shape: shape.clone(), samples, variance }
    }
}

impl BandSamples {
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
