//! Grey value of the void around one grain, which need not be that of the whole image: grains may
//! lie in a resin or a liquid, and the image around it hold air.

use super::crop::{BAND, Crop, DEEPER, SOME_DEEP};
use super::{Mask, transform};
use crate::filter::gaussian;

/// Distance from the surface of the grain within which the void is sampled [voxels].
const SHELL: f32 = 6.0;
/// Standard deviation of the Gaussian that extends the sampled void to the surface [voxels].
const EXTENT: f64 = 2.0;
/// Weight of the mean among the weights of the samples, which add up to about 0.1 at a surface.
const WEIGHT_OF_MEAN: f32 = 0.002;

/// Deviation from the void of the image that is no noise [standard errors of the mean].
const SIGNIFICANT: f64 = 3.0;

/// Void around a grain.
pub(super) struct Surroundings {
    /// Mean grey value.
    pub mean: f64,
    /// Grey value for each voxel of the crop; `None` for the mean.
    local: Option<Vec<f32>>,
}

impl Surroundings {
    /// Samples the void around the grain of `mask`, at this signed distance from its surface: the
    /// voxels in the shell that belong to no grain and are farther than the blur from any. If they
    /// agree with the void of the `image`, its mean is taken, which has less noise. Returns `None`
    /// if there are too few.
    pub fn measure(crop: &Crop, mask: &Mask, distance: &[f32], image: f64) -> Option<Surroundings> {
        let solid = (0..distance.len()).map(|n| mask.solid[n] || crop.is_solid(n)).collect();
        let apart = transform::to_solid(&Mask { dims: mask.dims, solid });
        let beyond = |limit: f32| -> Vec<(usize, f32)> {
            // The interface lies half a voxel from the centre of the solid voxel.
            let far = (limit + 0.5).powi(2);
            let void = (0..distance.len()).filter(|n| distance[*n] <= SHELL && apart[*n] > far);
            void.filter_map(|n| Some((n, crop.grey(n)?))).collect()
        };
        let mut samples = [BAND + DEEPER, BAND].into_iter().map(beyond);
        let samples = samples.find(|samples| samples.len() >= SOME_DEEP)?;
        let count = samples.len() as f64;
        let mean = samples.iter().map(|(_, grey)| f64::from(*grey)).sum::<f64>() / count;
        // Variance of the noise, from neighbours along x: two phases of void hardly change it.
        let pairs = samples.windows(2).filter(|pair| pair[0].0 + 1 == pair[1].0);
        let steps: Vec<f64> = pairs.map(|p| f64::from(p[1].1 - p[0].1).powi(2)).collect();
        let variance = 0.5 * steps.iter().sum::<f64>() / steps.len().max(1) as f64;
        if (mean - image).abs() <= SIGNIFICANT * (variance / count).sqrt() {
            return Some(Surroundings::uniform(image));
        }
        // Mean of the samples near each voxel, weighted by a Gaussian.
        let mut local = vec![0.0f32; distance.len()];
        let mut weights = local.clone();
        for (n, grey) in samples {
            (local[n], weights[n]) = (grey - mean as f32, 1.0);
        }
        local = gaussian(&local, mask.dims, EXTENT);
        weights = gaussian(&weights, mask.dims, EXTENT);
        for (value, weight) in local.iter_mut().zip(&weights) {
            *value = mean as f32 + *value / (weight + WEIGHT_OF_MEAN);
        }
        Some(Surroundings { mean, local: Some(local) })
    }

    /// Void of one grey value.
    pub fn uniform(mean: f64) -> Surroundings {
        Surroundings { mean, local: None }
    }

    /// Returns the grey value of the void at voxel `n` of the crop.
    pub fn at(&self, n: usize) -> f64 {
        self.local.as_ref().map_or(self.mean, |local| f64::from(local[n]))
    }
}
