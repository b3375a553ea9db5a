//! Positions of packed grains, on a jittered lattice or at random, and random orientations.

use glam::{DQuat, DVec3};
use rand::RngExt;
use std::f64::consts::TAU;
use std::sync::atomic::{AtomicBool, Ordering};

use super::sphere_cells::{Sphere, SphereCells};
use grainwake_solver::dem::{Enclosure, Grain};

/// Generator of a packing: the reference sequence of SplitMix64 (Steele, Lea and Flood 2014), on
/// which the packings of published cases depend.
pub(super) type Random = rand_xoshiro::SplitMix64;

/// Returns a uniformly distributed orientation (Shoemake 1992).
pub(super) fn orientation(random: &mut Random) -> DQuat {
    let [u, a, b]: [f64; 3] = random.random();
    let (a, b) = (TAU * a, TAU * b);
    let (low, high) = ((1.0 - u).sqrt(), u.sqrt());
    DQuat::from_xyzw(low * a.sin(), low * a.cos(), high * b.sin(), high * b.cos()).normalize()
}

/// Returns a uniformly distributed point of the unit cube.
fn point(random: &mut Random) -> DVec3 {
    DVec3::from_array(random.random())
}

/// Part of the box to fill, and the grains in it.
pub(super) struct Region<'a> {
    /// Lower corner [m].
    pub lower: DVec3,
    /// Upper corner [m].
    pub upper: DVec3,
    /// Smallest distance between grains, and from them to the faces of the region [m].
    pub clearance: f64,
    /// Box with its periodic axes.
    pub enclosure: Enclosure,
    /// Grains that are placed already.
    pub placed: Vec<Grain>,
    /// Flag that ends the search for places.
    pub stop: &'a AtomicBool,
}

impl Region<'_> {
    /// Returns whether the search was ended.
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Returns the volume of the region [m^3].
    pub fn volume(&self) -> f64 {
        (self.upper - self.lower).element_product()
    }

    /// Cells with the spheres around the placed grains, for further spheres of the given radii [m].
    fn cells(&self, radii: impl Iterator<Item = f64>) -> SphereCells<'_> {
        let placed: Vec<Sphere> = self.placed.iter().map(Sphere::around).collect();
        let largest = radii.chain(placed.iter().map(|sphere| sphere.radius)).fold(0.0, f64::max);
        let mut cells = SphereCells::new(&self.enclosure, self.clearance, largest);
        placed.into_iter().for_each(|sphere| cells.insert(sphere));
        cells
    }

    /// Returns the distance of a sphere's centre from the faces of the region along each axis [m];
    /// zero where the region spans a periodic axis.
    fn margin(&self, radius: f64) -> DVec3 {
        let along = |axis| if self.spans_period(axis) { 0.0 } else { radius + self.clearance };
        DVec3::from_array([0, 1, 2].map(along))
    }

    /// Returns whether the region spans the box along a periodic axis.
    pub fn spans_period(&self, axis: usize) -> bool {
        self.enclosure.periodic[axis]
            && (self.upper - self.lower)[axis] >= self.enclosure.size()[axis] * (1.0 - 1e-9)
    }

    /// Returns random centres without overlap of the spheres [m]; none if a sphere finds no place,
    /// or the search was ended.
    pub fn random(&self, radii: &[f64], random: &mut Random) -> Option<Vec<DVec3>> {
        let mut cells = self.cells(radii.iter().copied());
        let mut centres = Vec::with_capacity(radii.len());
        for &radius in radii {
            let margin = self.margin(radius);
            let room = self.upper - self.lower - 2.0 * margin;
            if room.min_element() < 0.0 || self.stopped() {
                return None;
            }
            let found = (0..20_000).find_map(|_| {
                let sphere = Sphere { centre: self.lower + margin + room * point(random), radius };
                cells.free(sphere).then_some(sphere)
            });
            let sphere = found?;
            cells.insert(sphere);
            centres.push(sphere.centre);
        }
        Some(centres)
    }

    /// Returns centres on a cubic lattice [m], filled layer by layer along `up`. Each centre is
    /// shifted by up to `jitter` of its free space. The error is the number of lattice sites.
    pub fn lattice(
        &self,
        radii: &[f64],
        jitter: f64,
        up: (usize, f64),
        random: &mut Random,
    ) -> Result<Vec<DVec3>, usize> {
        let largest = radii.iter().copied().fold(0.0, f64::max);
        let margin = self.margin(largest);
        let smallest_pitch = 2.0 * largest + self.clearance;
        let room = self.upper - self.lower - 2.0 * margin;
        if room.min_element() < 0.0 {
            return Err(0);
        }
        let sites = room.to_array().map(|length| length / smallest_pitch);
        let sites: [usize; 3] = std::array::from_fn(|axis| {
            // A periodic axis has as many gaps as sites.
            let whole = (sites[axis] * (1.0 + 1e-12)).floor() as usize;
            if margin[axis] == 0.0 { whole } else { whole + 1 }
        });
        let capacity: usize = sites.iter().product();
        if capacity < radii.len() {
            return Err(capacity);
        }
        let (axis, sign) = up;
        let [across, along] = match axis {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        };
        let layer = sites[across] * sites[along];
        let layers = radii.len().div_ceil(layer);
        let mut pitch = DVec3::ZERO;
        for a in 0..3 {
            let gaps = if margin[a] == 0.0 { sites[a] } else { sites[a] - 1 };
            pitch[a] = if gaps == 0 { 0.0 } else { room[a] / gaps as f64 };
        }
        // Stacked tightly along the vertical, spread evenly across.
        pitch[axis] = if layers > 1 { pitch[axis].min(1.2 * smallest_pitch) } else { 0.0 };
        let mut centres = Vec::with_capacity(radii.len());
        for (n, &radius) in radii.iter().enumerate() {
            let (level, rest) = (n / layer, n % layer);
            let mut site = [0.0; 3];
            (site[across], site[along], site[axis]) =
                ((rest % sites[across]) as f64, (rest / sites[across]) as f64, level as f64);
            let free = (pitch - smallest_pitch).max(DVec3::ZERO) + 2.0 * (largest - radius);
            let offset =
                pitch * DVec3::from_array(site) + jitter * 0.5 * free * (2.0 * point(random) - 1.0);
            let corner = self.lower + margin;
            let mut centre = corner + offset;
            if sign < 0.0 {
                centre[axis] = self.lower[axis] + self.upper[axis] - centre[axis];
            }
            // Jitter may not push a sphere out of the region.
            let inner = self.margin(radius);
            centre = centre.max(self.lower + inner).min(self.upper - inner);
            centres.push(centre);
        }
        Ok(centres)
    }

    /// Returns whether no sphere overlaps another one or a placed one.
    pub fn clear(&self, spheres: &[Sphere]) -> bool {
        let mut cells = self.cells(spheres.iter().map(|sphere| sphere.radius));
        spheres.iter().all(|sphere| {
            let free = cells.free(*sphere);
            cells.insert(*sphere);
            free
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use grainwake_shape::Shape;
    use grainwake_solver::dem::Side;
    use rand::SeedableRng;

    fn space(enclosure: Enclosure, placed: Vec<Grain>) -> Region<'static> {
        Region {
            lower: DVec3::ZERO,
            upper: DVec3::new(1.0, 1.0, 3.0),
            clearance: 0.01,
            enclosure,
            placed,
            stop: &crate::case::NEVER,
        }
    }

    fn closed() -> Enclosure {
        Enclosure {
            lower: DVec3::ZERO,
            upper: DVec3::new(1.0, 1.0, 3.0),
            periodic: [false; 3],
            sides: [[Side::WALL; 2]; 3],
        }
    }

    fn spheres(centres: &[DVec3], radii: &[f64]) -> Vec<Sphere> {
        centres
            .iter()
            .zip(radii)
            .map(|(centre, radius)| Sphere { centre: *centre, radius: *radius })
            .collect()
    }

    #[test]
    fn lattices_keep_clear_and_inside() {
        for periodic in [false, true] {
            let enclosure = Enclosure { periodic: [periodic; 3], ..closed() };
            let space = space(enclosure, Vec::new());
            let radii: Vec<f64> = (0..150).map(|i| 0.06 + 0.0002 * f64::from(i)).collect();
            for jitter in [0.0, 0.5, 1.0] {
                let centres =
                    space.lattice(&radii, jitter, (2, 1.0), &mut Random::seed_from_u64(7)).unwrap();
                assert!(
                    space.clear(&spheres(&centres, &radii)),
                    "periodic {periodic}, jitter {jitter}"
                );
                if !periodic {
                    assert!(centres.iter().zip(&radii).all(|(c, r)| (*c - r).min_element() >= 0.0
                        && (*c + *r).cmple(space.upper).all()));
                }
            }
        }
    }

    #[test]
    fn random_places_are_clear_and_repeat() {
        let ball = Grain::new(Shape::sphere(0.3, 0), 1.0).with_position(DVec3::splat(0.5));
        let (enclosure, placed) = (closed(), vec![ball]);
        let space = space(enclosure, placed);
        let radii = [0.1; 60];
        let centres = space.random(&radii, &mut Random::seed_from_u64(3)).unwrap();
        assert!(space.clear(&spheres(&centres, &radii)));
        assert_eq!(centres, space.random(&radii, &mut Random::seed_from_u64(3)).unwrap());
        assert_ne!(centres, space.random(&radii, &mut Random::seed_from_u64(4)).unwrap());
    }

    #[test]
    fn too_many_are_refused() {
        let enclosure = closed();
        let space = space(enclosure, Vec::new());
        assert_eq!(space.lattice(&[0.4; 9], 0.0, (2, 1.0), &mut Random::seed_from_u64(0)), Err(3));
        assert_eq!(space.random(&[0.4; 9], &mut Random::seed_from_u64(0)), None);
    }

    #[test]
    fn orientations_are_of_unit_length_and_even() {
        let mut random = Random::seed_from_u64(1);
        let mut mean = DVec3::ZERO;
        for _ in 0..4000 {
            let q = orientation(&mut random);
            assert!((q.length_squared() - 1.0).abs() < 1e-14);
            mean += q * DVec3::Z / 4000.0;
        }
        assert!(mean.length() < 0.05, "{mean}");
    }
}
