//! Reproducible pseudo-random numbers.

use glam::DVec3;
use rand::RngExt;

/// Generator of the grain family: the reference sequence of SplitMix64 (Steele, Lea and Flood
/// 2014), on which committed grains depend exactly.
pub(crate) type Random = rand_xoshiro::SplitMix64;

/// Returns a uniformly distributed direction: a point of the unit ball by rejection, normalised.
pub(crate) fn direction(random: &mut Random) -> DVec3 {
    loop {
        let x = 2.0 * DVec3::from_array(random.random()) - DVec3::ONE;
        let squared = x.length_squared();
        if (1e-6..=1.0).contains(&squared) {
            return x / squared.sqrt();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    /// Values of the reference implementation, and uniform numbers of 53 bits.
    #[test]
    fn the_sequence_is_fixed() {
        let mut random = Random::seed_from_u64(1477776061723855037);
        assert_eq!(random.next_u64(), 1985237415132408290);
        let unit: f64 = random.random();
        assert_eq!(unit, (2979275885539914483u64 >> 11) as f64 / (1u64 << 53) as f64);
    }
}
