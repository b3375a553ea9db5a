//! Grey volumes of bodies with known places: partial volumes, blur, noise.

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::SplitMix64;

/// Returns the fraction of each voxel inside a body, x fastest; voxels at the surface are sampled
/// at 4 x 4 x 4 points.
pub fn shares(
    dims: [usize; 3],
    bodies: &[&dyn Fn(DVec3) -> f64],
    boxes: &[(DVec3, f64)],
) -> Vec<f32> {
    let mut out = vec![0.0f32; dims.iter().product()];
    for (body, (centre, reach)) in bodies.iter().zip(boxes) {
        let low = (*centre - *reach - 2.0).max(DVec3::ZERO).as_usizevec3().to_array();
        let high = (*centre + *reach + 2.0).max(DVec3::ZERO).as_usizevec3().to_array();
        for k in low[2]..=high[2].min(dims[2] - 1) {
            for j in low[1]..=high[1].min(dims[1] - 1) {
                for i in low[0]..=high[0].min(dims[0] - 1) {
                    let corner = DVec3::new(i as f64, j as f64, k as f64);
                    let middle = body(corner + 0.5);
                    let share = if middle.abs() > 1.0 {
                        f64::from(u8::from(middle < 0.0))
                    } else {
                        let inside = (0..64usize).filter(|n| {
                            let at =
                                DVec3::new((n % 4) as f64, (n / 4 % 4) as f64, (n / 16) as f64);
                            body(corner + (at + 0.5) / 4.0) < 0.0
                        });
                        inside.count() as f64 / 64.0
                    };
                    let voxel = &mut out[i + dims[0] * (j + dims[1] * k)];
                    *voxel = (*voxel + share as f32).min(1.0);
                }
            }
        }
    }
    out
}

/// Gaussian blur of standard deviation `sigma` [voxels], the border continued.
pub fn blurred(values: &[f32], dims: [usize; 3], sigma: f64) -> Vec<f32> {
    let reach = (4.0 * sigma).ceil() as isize;
    let weights: Vec<f64> =
        (-reach..=reach).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect();
    let sum: f64 = weights.iter().sum();
    let strides = [1, dims[0], dims[0] * dims[1]];
    let mut values = values.to_vec();
    for axis in 0..3 {
        let old = values.clone();
        for (n, value) in values.iter_mut().enumerate() {
            let i = (n / strides[axis] % dims[axis]) as isize;
            let line = weights.iter().zip(-reach..=reach).map(|(w, s)| {
                let to = (i + s).clamp(0, dims[axis] as isize - 1);
                w * f64::from(old[(n as isize + (to - i) * strides[axis] as isize) as usize])
            });
            *value = (line.sum::<f64>() / sum) as f32;
        }
    }
    values
}

/// Generator of normally distributed numbers.
pub struct Noise(SplitMix64);

impl Noise {
    pub fn new(seed: u64) -> Noise {
        Noise(SplitMix64::seed_from_u64(seed))
    }
    pub fn unit(&mut self) -> f64 {
        self.0.random()
    }
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.unit()).cos()
    }
}

/// Greys of a 16-bit scanner: void 9000, solid 30000, noise as a share of their difference.
pub fn greys(shares: &[f32], noise: f64, seed: u64) -> Vec<u32> {
    let mut random = Noise::new(seed);
    let grey = |s: &f32| 9000.0 + 21000.0 * (f64::from(*s) + noise * random.normal());
    shares.iter().map(grey).map(|g| g.round().clamp(0.0, 65535.0) as u32).collect()
}
