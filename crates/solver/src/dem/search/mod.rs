//! Contact search: pairs of grains and walls that may touch, their penetrating points and the gaps
//! between surfaces (Eqs 7-8).
//!
//! Broad phase (here): bounding spheres in a cell list, with their periodic images. Narrow phase
//! (`narrow_phase.rs`): surface nodes of each grain in the distance field of its partner, and the
//! deepest point of the surface.

mod gap;
mod narrow_phase;
mod node_scan;
mod surface;

pub use gap::{Outside, Overlap, initial_overlaps, outside, surface_gap, wall_gap};
pub(super) use narrow_phase::{ClosestPoint, ContactPatch, ContactPoint, PosedShape};
pub(super) use surface::NodeTree;

use glam::{DVec3, IVec3};

use super::enclosure::{Enclosure, PairKey, Partner};

/// Largest image distance in the search [periods]. Grains several times larger than a periodic box
/// are not supported.
const MAX_PERIODS: i32 = 4;

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
    position: DVec3,
    grain: u32,
    /// Periods from the grain's own position to this centre.
    image: IVec3,
}

/// Cell-list search with its buffers, reused by the next search.
#[derive(Clone, Debug, Default)]
pub(crate) struct BroadPhase {
    centres: Vec<ImageCentre>,
    /// Index into `centres` of the image inside the box, by grain; `None` if it is not finite.
    inside: Vec<Option<u32>>,
    sorted: Vec<ImageCentre>,
    cell_starts: Vec<u32>,
    cells: Vec<u32>,
    /// Pairs that may touch, in ascending order.
    pub pairs: Vec<PairKey>,
}

/// Uniform cells around all centres.
struct CellGrid {
    lower: DVec3,
    inverse_size: f64,
    dims: [usize; 3],
}

impl CellGrid {
    /// Cells at least `size` [m] wide around all centres, at most about eight per centre.
    fn around(centres: &[ImageCentre], size: f64) -> CellGrid {
        let first = centres.first().map_or(DVec3::ZERO, |c| c.position);
        let (lower, upper) = centres.iter().fold((first, first), |(lower, upper), c| {
            (lower.min(c.position), upper.max(c.position))
        });
        let extent = upper - lower;
        let mut size = size.max(1e-9 * extent.max_element()).max(f64::MIN_POSITIVE);
        loop {
            let count = (extent / size).floor();
            let dims = count.to_array().map(|c| c.min(1e9) as usize + 1);
            if dims.iter().map(|&d| d as f64).product::<f64>() <= 8.0 * centres.len() as f64 + 64.0
            {
                return CellGrid { lower, inverse_size: 1.0 / size, dims };
            }
            size *= 1.5;
        }
    }
    fn coordinates(&self, x: DVec3) -> [usize; 3] {
        let c = (x - self.lower) * self.inverse_size;
        [0, 1, 2].map(|axis| (c[axis].max(0.0) as usize).min(self.dims[axis] - 1))
    }
    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.dims[1] + j) * self.dims[0] + i
    }
}

impl BroadPhase {
    /// Fills `pairs`. A sphere that is not finite is in no pair.
    pub fn search(&mut self, spheres: &[BoundingSphere], enclosure: &Enclosure) {
        self.pairs.clear();
        let largest = spheres
            .iter()
            .map(|sphere| sphere.radius)
            .filter(|r| r.is_finite())
            .fold(0.0, f64::max);
        self.list_images(spheres, enclosure, largest);
        let cells = CellGrid::around(&self.centres, 2.0 * largest);
        self.sort_by_cell(&cells);
        for (grain, sphere) in spheres.iter().enumerate() {
            let Some(centre) = self.inside[grain] else { continue };
            self.pair_with_neighbours(grain as u32, centre as usize, spheres, &cells);
            for face in enclosure.faces() {
                if face.distance(sphere.centre) <= sphere.radius {
                    self.pairs.push(PairKey::wall(grain as u32, &face));
                }
            }
        }
    }

    /// Appends the pairs of one grain with images of grains of equal or higher index.
    fn pair_with_neighbours(
        &mut self,
        grain: u32,
        centre: usize,
        spheres: &[BoundingSphere],
        cells: &CellGrid,
    ) {
        let start = self.pairs.len();
        let own = self.centres[centre];
        let radius = spheres[grain as usize].radius;
        let cell = cells.coordinates(own.position);
        let [from, to] = [
            cell.map(|c| c.saturating_sub(1)),
            [0, 1, 2].map(|axis| (cell[axis] + 1).min(cells.dims[axis] - 1)),
        ];
        for k in from[2]..=to[2] {
            for j in from[1]..=to[1] {
                let row = cells.index([from[0], j, k])..cells.index([to[0], j, k]) + 1;
                let range = self.cell_starts[row.start]..self.cell_starts[row.end];
                for other in &self.sorted[range.start as usize..range.end as usize] {
                    let image = other.image - own.image;
                    // Each pair is listed once; a grain may touch its own image.
                    let listed =
                        other.grain > grain || other.grain == grain && image.to_array() > [0, 0, 0];
                    let limit = radius + spheres[other.grain as usize].radius;
                    if listed && own.position.distance_squared(other.position) <= limit * limit {
                        self.pairs.push(PairKey {
                            grain,
                            partner: Partner::Grain(other.grain as usize),
                            image,
                        });
                    }
                }
            }
        }
        self.pairs[start..].sort_unstable();
    }

    /// Lists the image of every grain inside the box and the images that reach into the box.
    fn list_images(&mut self, spheres: &[BoundingSphere], enclosure: &Enclosure, largest: f64) {
        self.centres.clear();
        self.inside.clear();
        let period = enclosure.period();
        for (grain, sphere) in spheres.iter().enumerate() {
            if !(sphere.centre.is_finite() && sphere.radius.is_finite()) {
                self.inside.push(None);
                continue;
            }
            let wrap = -enclosure.periods_outside(sphere.centre);
            let inside = sphere.centre + wrap.as_dvec3() * period;
            let reach = sphere.radius + largest;
            let range = [0, 1, 2].map(|axis| {
                let l = period[axis];
                if l <= 0.0 {
                    return (0, 0);
                }
                let down = ((inside[axis] - (enclosure.lower[axis] - reach)) / l).floor();
                let up = ((enclosure.upper[axis] + reach - inside[axis]) / l).floor();
                let limit = f64::from(MAX_PERIODS);
                (-(down.clamp(0.0, limit) as i32), up.clamp(0.0, limit) as i32)
            });
            for k in range[2].0..=range[2].1 {
                for j in range[1].0..=range[1].1 {
                    for i in range[0].0..=range[0].1 {
                        let shift = IVec3::new(i, j, k);
                        if shift == IVec3::ZERO {
                            self.inside.push(Some(self.centres.len() as u32));
                        }
                        self.centres.push(ImageCentre {
                            position: inside + shift.as_dvec3() * period,
                            grain: grain as u32,
                            image: wrap + shift,
                        });
                    }
                }
            }
        }
    }

    /// Counting sort of the centres by cell.
    fn sort_by_cell(&mut self, cells: &CellGrid) {
        let count = cells.dims.iter().product::<usize>();
        self.cell_starts.clear();
        self.cell_starts.resize(count + 2, 0);
        self.cells.clear();
        for centre in &self.centres {
            let cell = cells.index(cells.coordinates(centre.position));
            self.cells.push(cell as u32);
            self.cell_starts[cell + 2] += 1;
        }
        for i in 2..self.cell_starts.len() {
            self.cell_starts[i] += self.cell_starts[i - 1];
        }
        self.sorted.clear();
        self.sorted.extend_from_slice(&self.centres);
        for (centre, &cell) in self.centres.iter().zip(&self.cells) {
            let end = &mut self.cell_starts[cell as usize + 1];
            self.sorted[*end as usize] = *centre;
            *end += 1;
        }
    }
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

    fn naive(spheres: &[BoundingSphere], enclosure: &Enclosure) -> Vec<PairKey> {
        let mut pairs = Vec::new();
        for (i, a) in spheres.iter().enumerate() {
            for (j, b) in spheres.iter().enumerate().skip(i) {
                for code in 0..9 * 9 * 9 {
                    let image = IVec3::new(code % 9 - 4, code / 9 % 9 - 4, code / 81 - 4);
                    let periodic = (0..3).all(|axis| enclosure.periodic[axis] || image[axis] == 0);
                    let apart = a.centre - b.centre - image.as_dvec3() * enclosure.size();
                    let listed = i < j || image.to_array() > [0, 0, 0];
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
                solid: [[false; 2]; 3],
            };
            let spheres = scatter(120, seed);
            let mut broad = BroadPhase::default();
            broad.search(&spheres, &enclosure);
            let expected = naive(&spheres, &enclosure);
            assert!(expected.len() > 20);
            assert_eq!(broad.pairs, expected, "{periodic:?}");
        }
    }

    #[test]
    fn a_sphere_that_is_not_finite_is_in_no_pair() {
        let enclosure = Enclosure {
            lower: DVec3::ZERO,
            upper: DVec3::ONE,
            periodic: [true; 3],
            solid: [[false; 2]; 3],
        };
        let mut spheres = scatter(10, 5);
        spheres[3].centre.x = f64::NAN;
        let mut broad = BroadPhase::default();
        broad.search(&spheres, &enclosure);
        assert!(broad.pairs.iter().all(|p| p.grain != 3 && p.partner != Partner::Grain(3)));
    }
}
