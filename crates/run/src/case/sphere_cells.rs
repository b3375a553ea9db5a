//! Spheres of a packing in a grid of cells, so that only those near a new sphere are compared with
//! it.

use std::collections::HashMap;

use glam::DVec3;

use grainwake_solver::dem::{Enclosure, Grain};

/// Relative depth below which an overlap is a rounding error.
pub(super) const ROUNDING: f64 = 1e-9;

/// Bounding sphere of a grain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sphere {
    /// Centre [m].
    pub centre: DVec3,
    /// Radius [m].
    pub radius: f64,
}

impl Sphere {
    /// The sphere around a grain.
    pub fn around(grain: &Grain) -> Sphere {
        Sphere { centre: grain.pose.position, radius: grain.shape.bounding_radius() }
    }
}

/// Spheres that keep a clearance from each other; each is in the cell of its centre.
pub(super) struct SphereCells<'a> {
    enclosure: &'a Enclosure,
    /// Smallest distance between two spheres [m].
    clearance: f64,
    /// Edges of a cell [m]: spheres in cells that are not neighbours do not touch.
    edges: DVec3,
    /// Cells along the period of each axis; cells of other axes have any index.
    periods: [Option<i64>; 3],
    spheres: HashMap<[i64; 3], Vec<Sphere>>,
}

impl<'a> SphereCells<'a> {
    /// Empty cells for spheres of at most the given radius [m].
    pub fn new(enclosure: &'a Enclosure, clearance: f64, largest_radius: f64) -> SphereCells<'a> {
        let least = 2.0 * largest_radius + clearance;
        let mut edges = DVec3::splat(least);
        let periods = [0, 1, 2].map(|axis| {
            let size = enclosure.size()[axis];
            let count = (size / least).floor().max(1.0);
            enclosure.periodic[axis].then(|| {
                edges[axis] = size / count;
                count as i64
            })
        });
        SphereCells { enclosure, clearance, edges, periods, spheres: HashMap::new() }
    }

    /// Adds a sphere.
    pub fn insert(&mut self, sphere: Sphere) {
        self.spheres.entry(self.cell(sphere, [0; 3])).or_default().push(sphere);
    }

    /// Returns whether a sphere keeps the clearance from all others.
    pub fn free(&self, sphere: Sphere) -> bool {
        let offsets = (0..27).map(|n| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1]);
        let near = offsets.filter_map(|offset| self.spheres.get(&self.cell(sphere, offset)));
        near.flatten().all(|other| self.apart(sphere, *other))
    }

    /// Index of the cell at an offset from that of a sphere's centre.
    fn cell(&self, sphere: Sphere, offset: [i64; 3]) -> [i64; 3] {
        let place = ((sphere.centre - self.enclosure.lower) / self.edges).floor();
        [0, 1, 2].map(|axis| {
            let index = place[axis] as i64 + offset[axis];
            self.periods[axis].map_or(index, |count| index.rem_euclid(count))
        })
    }

    /// Returns whether two spheres keep the clearance, periodic images included.
    fn apart(&self, sphere: Sphere, other: Sphere) -> bool {
        let mut arm = sphere.centre - other.centre;
        for axis in 0..3 {
            if self.enclosure.periodic[axis] {
                let period = self.enclosure.size()[axis];
                arm[axis] -= period * (arm[axis] / period).round();
            }
        }
        // Neighbours on a full lattice touch, up to rounding.
        arm.length() >= (sphere.radius + other.radius + self.clearance) * (1.0 - ROUNDING)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::SplitMix64;

    #[test]
    fn spheres_are_free_as_found_by_comparing_all() {
        let mut random = SplitMix64::seed_from_u64(5);
        for periodic in [[false; 3], [true, false, true], [true; 3]] {
            // Cells along the axes: one, three and nine.
            let enclosure = Enclosure {
                lower: DVec3::new(-0.4, 0.0, 1.0),
                upper: DVec3::new(0.1, 1.1, 4.0),
                periodic,
                sides: Default::default(),
            };
            let mut cells = SphereCells::new(&enclosure, 0.01, 0.16);
            let mut all: Vec<Sphere> = Vec::new();
            let mut refused = 0;
            for _ in 0..2000 {
                let [x, y, z, size]: [f64; 4] = random.random();
                let centre = enclosure.lower + enclosure.size() * DVec3::new(x, y, z);
                let sphere = Sphere { centre, radius: 0.02 + 0.14 * size };
                let free = all.iter().all(|other| cells.apart(sphere, *other));
                assert_eq!(cells.free(sphere), free, "{periodic:?}, {sphere:?}");
                if free {
                    cells.insert(sphere);
                    all.push(sphere);
                } else {
                    refused += 1;
                }
            }
            assert!(all.len() > 30 && refused > 1000, "{} placed", all.len());
        }
    }
}
