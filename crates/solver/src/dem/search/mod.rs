//! Contact search: pairs of grains and walls that may touch, their penetrating points and the gaps
//! between surfaces (Eqs 7-8).
//!
//! Broad phase (here): bounding spheres with their periodic images in cell lists, one for each
//! power of two of the radius. Narrow phase (`narrow_phase.rs`): surface patches of each grain in
//! the distance field of its partner, and the deepest point of a sphere.

mod deepest_point;
pub mod gap;
mod narrow_phase;
mod patch_layout;
mod patch_scan;
mod patch_tree;
mod patches;
mod surface;

pub(super) use narrow_phase::{ContactPatch, ContactPoint};
pub(super) use patches::{PatchTree, PosedShape};
pub(crate) use surface::is_sphere;

use glam::{DVec3, IVec3};

use super::enclosure::{Enclosure, PairKey, Partner};

/// Largest image distance in the search [periods]. Grains several times larger than a periodic box
/// are not supported.
const MAX_PERIODS: i32 = 4;
/// Largest number of a cell along an axis; spheres farther away share the last cell.
const CELL_LIMIT: DVec3 = DVec3::splat(1e9);
/// Finest level of the cell lists; it contains all spheres smaller than 2^-20 of the largest.
const FINEST: i32 = 20;

/// Bounding sphere of a grain with a margin, such as its displacement until the next search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoundingSphere {
    /// Centre [m].
    pub centre: DVec3,
    /// Radius with margin [m].
    pub radius: f64,
}

/// Centre of a bounding sphere or of one of its periodic images.
#[derive(Clone, Copy, Debug)]
struct ImageCentre {
    /// Level of the cell list: 0 for radii above half the largest, 1 above a quarter, and so on.
    level: i32,
    /// Cell of that level along z, y and x.
    cell: [i32; 3],
    position: DVec3,
    grain: u32,
    /// Periods from the grain's own position to this centre.
    image: IVec3,
    /// True for the image inside the box.
    inside: bool,
}

/// Cell-list search with its buffers, reused by the next search.
#[derive(Clone, Debug, Default)]
pub(crate) struct BroadPhase {
    /// All centres, sorted by level, then by cell.
    centres: Vec<ImageCentre>,
    /// Pairs that may touch, in ascending order.
    pub pairs: Vec<PairKey>,
}

impl BroadPhase {
    /// Fills `pairs`. A sphere that is not finite is in no pair.
    pub fn search(&mut self, spheres: &[BoundingSphere], enclosure: &Enclosure) {
        let radii = spheres.iter().map(|sphere| sphere.radius);
        let largest = radii.filter(|radius| radius.is_finite()).fold(0.0, f64::max);
        self.list_images(spheres, enclosure, largest);
        self.centres.sort_unstable_by_key(|centre| (centre.level, centre.cell));
        self.pairs.clear();
        // One cell size for all would put every small sphere next to a large one in a few cells.
        let levels = || self.centres.chunk_by(|a, b| a.level == b.level);
        for (index, fine) in levels().enumerate() {
            for coarse in levels().take(index + 1) {
                list_pairs(fine, coarse, spheres, largest, &mut self.pairs);
            }
        }
        for own in self.centres.iter().filter(|centre| centre.inside) {
            let sphere = &spheres[own.grain as usize];
            for face in enclosure.faces() {
                if face.distance(sphere.centre) <= sphere.radius {
                    let partner = face.partner;
                    self.pairs.push(PairKey { grain: own.grain, partner, image: [0; 3] });
                }
            }
        }
        self.pairs.sort_unstable();
    }

    /// Lists the image of every grain inside the box, and the images that may touch a sphere whose
    /// centre is in the box; `largest` is the largest radius [m].
    fn list_images(&mut self, spheres: &[BoundingSphere], enclosure: &Enclosure, largest: f64) {
        self.centres.clear();
        let period = enclosure.period();
        let most = IVec3::splat(MAX_PERIODS);
        for (grain, sphere) in spheres.iter().enumerate() {
            if !(sphere.centre.is_finite() && sphere.radius.is_finite()) {
                continue;
            }
            let wrap = -enclosure.periods_outside(sphere.centre);
            let inside = sphere.centre + wrap.as_dvec3() * period;
            let is_above = |level: &i32| sphere.radius > largest_radius(largest, level + 1);
            let level = (0..FINEST).find(is_above).unwrap_or(FINEST);
            let reach = sphere.radius + largest;
            let down = enclosure.periods(inside - (enclosure.lower - reach), f64::floor);
            let up = enclosure.periods(enclosure.upper + reach - inside, f64::floor);
            for shift in shifts(-down.clamp(IVec3::ZERO, most), up.clamp(IVec3::ZERO, most)) {
                let position = inside + shift.as_dvec3() * period;
                self.centres.push(ImageCentre {
                    level,
                    cell: cell_of(position, largest_radius(largest, level)),
                    position,
                    grain: grain as u32,
                    image: wrap + shift,
                    inside: shift == IVec3::ZERO,
                });
            }
        }
    }
}

/// Largest radius of the spheres of a level [m], if that of all is `largest`.
fn largest_radius(largest: f64, level: i32) -> f64 {
    largest * 0.5f64.powi(level)
}

/// Cell `[z, y, x]` of a position in a list for radii up to `radius` [m].
fn cell_of(position: DVec3, radius: f64) -> [i32; 3] {
    let size = (2.0 * radius).max(f64::MIN_POSITIVE);
    // The limit keeps the numbers of neighbour cells in the range of the integers.
    let cell = (position / size).floor().clamp(-CELL_LIMIT, CELL_LIMIT).as_ivec3();
    [cell.z, cell.y, cell.x]
}

/// Adds the pairs of a sphere of the list `fine` with one of `coarse`, the same list or one with
/// larger cells; `largest` is the largest radius of all spheres [m].
fn list_pairs(
    fine: &[ImageCentre],
    coarse: &[ImageCentre],
    spheres: &[BoundingSphere],
    largest: f64,
    pairs: &mut Vec<PairKey>,
) {
    let (level, is_same) = (coarse[0].level, coarse[0].level == fine[0].level);
    for own in fine.iter().filter(|own| own.inside || !is_same) {
        let radius = spheres[own.grain as usize].radius;
        for other in centres_around(coarse, cell_of(own.position, largest_radius(largest, level))) {
            let is_first = is_same || own.grain < other.grain;
            let [first, second] = if is_first { [own, other] } else { [other, own] };
            let image = (second.image - first.image).to_array();
            // Each pair is listed once, with its first grain in the box; a grain may touch its own
            // image.
            let listed = first.inside && (second.grain, image) > (first.grain, [0; 3]);
            let limit = radius + spheres[other.grain as usize].radius;
            if listed && own.position.distance_squared(other.position) <= limit * limit {
                let partner = Partner::Grain(second.grain as usize);
                pairs.push(PairKey { grain: first.grain, partner, image });
            }
        }
    }
}

/// Centres in the cell `[z, y, x]` and the 26 cells around it; `centres` is sorted by cell.
fn centres_around(
    centres: &[ImageCentre],
    [z, y, x]: [i32; 3],
) -> impl Iterator<Item = &ImageCentre> {
    let row = move |k: i32, j: i32| {
        let (first, last) = ([k, j, x - 1], [k, j, x + 1]);
        let start = centres.partition_point(|centre| centre.cell < first);
        centres[start..].iter().take_while(move |centre| centre.cell <= last)
    };
    (z - 1..=z + 1).flat_map(move |k| (y - 1..=y + 1).flat_map(move |j| row(k, j)))
}

/// All shifts in periods from `first` to `last`, both included.
fn shifts(first: IVec3, last: IVec3) -> impl Iterator<Item = IVec3> {
    let along = move |axis: usize| first[axis]..=last[axis];
    along(2)
        .flat_map(move |k| along(1).flat_map(move |j| along(0).map(move |i| IVec3::new(i, j, k))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scatter(count: usize, seed: u64) -> Vec<BoundingSphere> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..count)
            .map(|_| BoundingSphere {
                centre: DVec3::new(3.0 * next() - 1.0, 3.0 * next() - 1.0, next()),
                radius: 0.02 + 0.2 * next().powi(3),
            })
            .collect()
    }

    /// Spheres whose radii range over four orders of magnitude.
    fn polydisperse(count: usize, seed: u64) -> Vec<BoundingSphere> {
        let mut spheres = scatter(count, seed);
        for (n, sphere) in spheres.iter_mut().enumerate() {
            sphere.radius = 0.3 * 0.1f64.powi(n as i32 % 5);
        }
        spheres
    }

    fn naive(spheres: &[BoundingSphere], enclosure: &Enclosure) -> Vec<PairKey> {
        let mut pairs = Vec::new();
        for (i, a) in spheres.iter().enumerate() {
            for (j, b) in spheres.iter().enumerate().skip(i) {
                for code in 0..9 * 9 * 9 {
                    let image = [code % 9 - 4, code / 9 % 9 - 4, code / 81 - 4];
                    let periodic = (0..3).all(|axis| enclosure.periodic[axis] || image[axis] == 0);
                    let apart =
                        a.centre - b.centre - IVec3::from(image).as_dvec3() * enclosure.size();
                    let listed = i < j || image > [0, 0, 0];
                    if periodic && listed && apart.length() <= a.radius + b.radius {
                        pairs.push(PairKey { grain: i as u32, partner: Partner::Grain(j), image });
                    }
                }
            }
        }
        pairs.sort();
        pairs
    }

    #[test]
    fn search_equals_the_double_loop() {
        for (seed, periodic) in [(1, [false; 3]), (2, [true, false, true]), (3, [true; 3])] {
            // The box is short along z, so that large spheres meet their own images.
            let enclosure = Enclosure {
                lower: DVec3::ZERO,
                upper: DVec3::new(1.0, 1.0, 0.4),
                periodic,
                sides: Default::default(),
            };
            for spheres in [scatter(120, seed), polydisperse(120, seed)] {
                let mut broad = BroadPhase::default();
                broad.search(&spheres, &enclosure);
                let expected = naive(&spheres, &enclosure);
                assert!(expected.len() > 20);
                assert_eq!(broad.pairs, expected, "{periodic:?}");
            }
        }
    }

    /// With cells as large as the largest sphere, the small ones were compared all with all.
    #[test]
    fn one_large_sphere_adds_few_comparisons() {
        let enclosure = Enclosure {
            lower: DVec3::ZERO,
            upper: DVec3::ONE,
            periodic: [true; 3],
            sides: Default::default(),
        };
        let mut spheres = scatter(40_000, 4);
        spheres.iter_mut().for_each(|sphere| sphere.radius = 2e-3);
        // Spheres that are compared with one another.
        let comparisons = |spheres: &[BoundingSphere], largest: f64| -> usize {
            let mut broad = BroadPhase::default();
            broad.search(spheres, &enclosure);
            let levels = || broad.centres.chunk_by(|a, b| a.level == b.level);
            let around = |own: &ImageCentre, list: &[ImageCentre]| {
                let radius = largest_radius(largest, list[0].level);
                centres_around(list, cell_of(own.position, radius)).count()
            };
            let pairs = levels()
                .enumerate()
                .flat_map(|(n, fine)| levels().take(n + 1).map(move |coarse| (fine, coarse)));
            pairs
                .map(|(fine, coarse)| fine.iter().map(|own| around(own, coarse)).sum::<usize>())
                .sum()
        };
        assert!(comparisons(&spheres, 2e-3) < 5 * spheres.len());
        spheres[7].radius = 0.2;
        let mixed = comparisons(&spheres, 0.2);
        // Each small sphere is compared with the images of the large one.
        assert!(mixed < 10 * spheres.len(), "{mixed}");
    }

    #[test]
    fn a_sphere_that_is_not_finite_is_in_no_pair() {
        let enclosure = Enclosure {
            lower: DVec3::ZERO,
            upper: DVec3::ONE,
            periodic: [true; 3],
            sides: Default::default(),
        };
        let mut spheres = scatter(10, 5);
        spheres[3].centre.x = f64::NAN;
        let mut broad = BroadPhase::default();
        broad.search(&spheres, &enclosure);
        assert!(broad.pairs.iter().all(|p| p.grain != 3 && p.partner != Partner::Grain(3)));
    }
}
