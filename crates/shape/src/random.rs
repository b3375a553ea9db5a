//! Reproducible pseudo-random numbers.

use glam::DVec3;

/// SplitMix64 (Steele, Lea and Flood 2014), kept instead of a crate because committed grains depend
/// on its sequence bit for bit.
pub(crate) struct Random(u64);

impl Random {
    /// Creates a generator from a seed.
    pub(crate) fn new(seed: u64) -> Random {
        Random(seed)
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a uniformly distributed number in 0..1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns a uniformly distributed direction: a point of the unit ball by rejection,
    /// normalised.
    pub(crate) fn direction(&mut self) -> DVec3 {
        loop {
            let x = 2.0 * DVec3::new(self.unit(), self.unit(), self.unit()) - DVec3::ONE;
            let squared = x.length_squared();
            if (1e-6..=1.0).contains(&squared) {
                return x / squared.sqrt();
            }
        }
    }
}
