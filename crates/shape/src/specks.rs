//! Specks: small bodies apart from the largest, left by noise in an image, or at a sharp tip of a
//! mesh where the grid has samples inside the tip that are no neighbours.

use crate::field::SampledField;
use crate::runs::{fill_cavities, pieces};

/// Largest fraction of the volume of a grain that counts as specks. More is a second body, and the
/// grain is refused.
pub(crate) const LIMIT: f64 = 0.02;

/// Largest number of samples of a speck at the tip of a mesh. More is a detail that the grid breaks
/// off, and the mesh is refused.
const TIP: u64 = 8;

/// End of the names of the provenance parameters that hold a removed fraction of the volume.
pub(crate) const REMOVED: &str = "specks_removed";

/// Removes specks outside the grain and bubbles inside it from a distance field by a change of
/// sign. Returns the fraction of the volume that changed; 0 if there is none, or more than
/// [`LIMIT`], or in a field that was not `scanned` a speck of more than [`TIP`] samples.
pub(crate) fn remove(field: &mut SampledField, scanned: bool) -> f64 {
    let (dims, levels) = (field.dims(), field.levels());
    let (number, sizes) = pieces(dims, |n| levels[n] < 0.0);
    let largest = (0..sizes.len()).max_by_key(|n| (sizes[*n], std::cmp::Reverse(*n)));
    let Some(largest) = largest else {
        return 0.0;
    };
    let kept = largest as u32 + 1;
    let mut inside: Vec<bool> = number.iter().map(|n| *n == kept).collect();
    let bubbles = fill_cavities(dims, &mut inside);
    let specks: u64 = sizes.iter().sum::<u64>() - sizes[largest];
    let share = (specks + bubbles) as f64 / sizes[largest] as f64;
    let detail = |(n, size): (usize, &u64)| n != largest && *size > TIP;
    let details = !scanned && sizes.iter().enumerate().any(detail);
    if share == 0.0 || share > LIMIT || details {
        return 0.0;
    }
    for (level, inside) in field.levels_mut().iter_mut().zip(inside) {
        if (*level < 0.0) != inside {
            let size = level.abs().max(1.0);
            *level = if inside { -size } else { size };
        }
    }
    share
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// A ball of radius 8 in 24^3 samples with other signs at these samples.
    fn ball(changed: &[usize]) -> SampledField {
        let level = |n: usize| {
            let x = DVec3::new((n % 24) as f64, (n / 24 % 24) as f64, (n / 576) as f64);
            let level = (1000.0 * (x.distance(DVec3::splat(11.6)) - 8.0)).round() as f32;
            if changed.contains(&n) { -level } else { level }
        };
        let levels = (0..24 * 24 * 24).map(level).collect();
        SampledField::from_levels(DVec3::ZERO, 1.0, [24; 3], 1e-3, levels)
    }

    #[test]
    fn specks_and_bubbles_change_sign_and_large_bodies_stay() {
        let at = |i: usize, j: usize, k: usize| i + 24 * (j + 24 * k);
        let clean = ball(&[]);
        let mut field = clean.clone();
        assert_eq!(remove(&mut field, true), 0.0);
        assert_eq!(field, clean);
        // A speck of two samples, and a bubble of one.
        let mut field = ball(&[at(2, 2, 2), at(3, 2, 2), at(12, 12, 12)]);
        let solid = clean.levels().iter().filter(|l| **l < 0.0).count() as f64;
        let share = remove(&mut field, false);
        assert!((share - 3.0 / (solid - 1.0)).abs() < 1e-6, "{share}");
        assert_eq!(field, clean);
        // Beyond the limit nothing changes.
        let many: Vec<usize> = (0..50).map(|n| at(2 + n % 5, 2 + n / 5, 2)).collect();
        let two = ball(&many);
        let mut field = two.clone();
        assert_eq!(remove(&mut field, true), 0.0);
        assert_eq!(field, two);
        // Nine samples are noise in a scan and a detail of a mesh.
        let nine: Vec<usize> = (2..11).map(|n| at(n, 2, 2)).collect();
        let two = ball(&nine);
        let mut field = two.clone();
        assert_eq!(remove(&mut field, false), 0.0);
        assert_eq!(field, two);
        assert!(remove(&mut field, true) > 0.0);
        assert_eq!(field, clean);
    }
}
