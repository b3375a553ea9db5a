//! Which pairs may touch: cells that hold bounding spheres and their periodic images.

use glam::{DVec3, IVec3};

use super::Partner;
use super::enclosure::Enclosure;
use super::history::PairKey;

/// Images further than this many periods are not looked for: a grain, with what it may move or reach, several
/// times larger than a periodic box has no meaning.
const MOST_PERIODS: i32 = 4;

/// A bounding sphere, grown by what the grain may move, or by how far from it the flow minds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ball {
    /// Centre [m].
    pub center: DVec3,
    /// Radius with margin [m].
    pub radius: f64,
}

#[derive(Clone, Copy, Debug)]
struct Point {
    at: DVec3,
    grain: u32,
    /// Periods from the grain's own position to this point.
    image: IVec3,
}

/// Buffers of the search, kept from one to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct BroadPhase {
    points: Vec<Point>,
    /// Index into `points` of each grain itself, inside the box along periodic axes.
    homes: Vec<Option<u32>>,
    sorted: Vec<Point>,
    starts: Vec<u32>,
    cells: Vec<u32>,
    /// Pairs that may touch, ascending.
    pub pairs: Vec<PairKey>,
}

struct Cells {
    lower: DVec3,
    inverse: f64,
    dims: [usize; 3],
}

impl Cells {
    /// Cells at least `size` wide that cover all points, not many more of them than points.
    fn covering(points: &[Point], size: f64) -> Cells {
        let first = points.first().map_or(DVec3::ZERO, |p| p.at);
        let (lower, upper) = points
            .iter()
            .fold((first, first), |(lo, up), p| (lo.min(p.at), up.max(p.at)));
        let extent = upper - lower;
        let mut size = size.max(1e-9 * extent.max_element()).max(f64::MIN_POSITIVE);
        loop {
            let count = (extent / size).floor();
            let dims = count.to_array().map(|c| c.min(1e9) as usize + 1);
            if dims.iter().map(|&d| d as f64).product::<f64>() <= 8.0 * points.len() as f64 + 64.0 {
                return Cells {
                    lower,
                    inverse: 1.0 / size,
                    dims,
                };
            }
            size *= 1.5;
        }
    }
    fn coordinates(&self, x: DVec3) -> [usize; 3] {
        let c = (x - self.lower) * self.inverse;
        [0, 1, 2].map(|axis| (c[axis].max(0.0) as usize).min(self.dims[axis] - 1))
    }
    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.dims[1] + j) * self.dims[0] + i
    }
}

impl BroadPhase {
    /// Fills `pairs`. A ball that is not finite touches nothing.
    pub fn search(&mut self, balls: &[Ball], enclosure: &Enclosure) {
        self.pairs.clear();
        let largest = balls
            .iter()
            .map(|b| b.radius)
            .filter(|r| r.is_finite())
            .fold(0.0, f64::max);
        self.place(balls, enclosure, largest);
        let cells = Cells::covering(&self.points, 2.0 * largest);
        self.sort_into(&cells);
        for (grain, ball) in balls.iter().enumerate() {
            let grain = grain as u32;
            let start = self.pairs.len();
            if let Some(home) = self.homes[grain as usize] {
                let own = self.points[home as usize];
                let around = cells.coordinates(own.at);
                let [from, to] = [
                    around.map(|c| c.saturating_sub(1)),
                    [0, 1, 2].map(|axis| (around[axis] + 1).min(cells.dims[axis] - 1)),
                ];
                for k in from[2]..=to[2] {
                    for j in from[1]..=to[1] {
                        let row = cells.index([from[0], j, k])..cells.index([to[0], j, k]) + 1;
                        let run = self.starts[row.start] as usize..self.starts[row.end] as usize;
                        for other in &self.sorted[run] {
                            let image = other.image - own.image;
                            let once = other.grain > grain
                                || other.grain == grain && image.to_array() > [0, 0, 0];
                            let limit = ball.radius + balls[other.grain as usize].radius;
                            if once && own.at.distance_squared(other.at) <= limit * limit {
                                let partner = Partner::Grain(other.grain as usize);
                                self.pairs.push(PairKey {
                                    grain,
                                    partner,
                                    image,
                                });
                            }
                        }
                    }
                }
                self.pairs[start..].sort_unstable();
            }
            for face in enclosure.faces() {
                if face.distance(ball.center) <= ball.radius {
                    let partner = Partner::Wall {
                        axis: face.axis as u8,
                        side: face.side as u8,
                    };
                    self.pairs.push(PairKey {
                        grain,
                        partner,
                        image: IVec3::ZERO,
                    });
                }
            }
        }
    }

    /// Every grain inside the box, and its images that reach into it.
    fn place(&mut self, balls: &[Ball], enclosure: &Enclosure, largest: f64) {
        self.points.clear();
        self.homes.clear();
        let period = enclosure.period();
        for (grain, ball) in balls.iter().enumerate() {
            if !(ball.center.is_finite() && ball.radius.is_finite()) {
                self.homes.push(None);
                continue;
            }
            let home = -enclosure.periods_outside(ball.center);
            let inside = ball.center + home.as_dvec3() * period;
            let reach = ball.radius + largest;
            let range = [0, 1, 2].map(|axis| {
                let l = period[axis];
                if l <= 0.0 {
                    return (0, 0);
                }
                let down = ((inside[axis] - (enclosure.lower[axis] - reach)) / l).floor();
                let up = ((enclosure.upper[axis] + reach - inside[axis]) / l).floor();
                let limit = f64::from(MOST_PERIODS);
                (
                    -(down.clamp(0.0, limit) as i32),
                    up.clamp(0.0, limit) as i32,
                )
            });
            for k in range[2].0..=range[2].1 {
                for j in range[1].0..=range[1].1 {
                    for i in range[0].0..=range[0].1 {
                        let shift = IVec3::new(i, j, k);
                        if shift == IVec3::ZERO {
                            self.homes.push(Some(self.points.len() as u32));
                        }
                        let at = inside + shift.as_dvec3() * period;
                        self.points.push(Point {
                            at,
                            grain: grain as u32,
                            image: home + shift,
                        });
                    }
                }
            }
        }
    }

    /// Counting sort of the points by cell.
    fn sort_into(&mut self, cells: &Cells) {
        let count = cells.dims.iter().product::<usize>();
        self.starts.clear();
        self.starts.resize(count + 2, 0);
        self.cells.clear();
        for point in &self.points {
            let cell = cells.index(cells.coordinates(point.at));
            self.cells.push(cell as u32);
            self.starts[cell + 2] += 1;
        }
        for i in 2..self.starts.len() {
            self.starts[i] += self.starts[i - 1];
        }
        self.sorted.clear();
        self.sorted.extend_from_slice(&self.points);
        for (point, &cell) in self.points.iter().zip(&self.cells) {
            let slot = &mut self.starts[cell as usize + 1];
            self.sorted[*slot as usize] = *point;
            *slot += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scatter(count: usize, seed: u64) -> Vec<Ball> {
        let mut state = seed;
        let mut next = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..count)
            .map(|_| Ball {
                center: DVec3::new(3.0 * next() - 1.0, 3.0 * next() - 1.0, next()),
                radius: 0.02 + 0.2 * next().powi(3),
            })
            .collect()
    }

    fn naive(balls: &[Ball], enclosure: &Enclosure) -> Vec<PairKey> {
        let mut pairs = Vec::new();
        for (i, a) in balls.iter().enumerate() {
            for (j, b) in balls.iter().enumerate().skip(i) {
                for code in 0..9 * 9 * 9 {
                    let image = IVec3::new(code % 9 - 4, code / 9 % 9 - 4, code / 81 - 4);
                    let periodic = (0..3).all(|axis| enclosure.periodic[axis] || image[axis] == 0);
                    let apart = a.center - b.center - image.as_dvec3() * enclosure.size();
                    let once = i < j || image.to_array() > [0, 0, 0];
                    if periodic && once && apart.length() <= a.radius + b.radius {
                        pairs.push(PairKey {
                            grain: i as u32,
                            partner: Partner::Grain(j),
                            image,
                        });
                    }
                }
            }
        }
        pairs.sort();
        pairs
    }

    #[test]
    fn finds_the_same_pairs_as_the_double_loop() {
        for (seed, periodic) in [(1, [false; 3]), (2, [true, false, true]), (3, [true; 3])] {
            // The box is short along z, so that large balls meet their own images.
            let enclosure = Enclosure {
                lower: DVec3::ZERO,
                upper: DVec3::new(1.0, 1.0, 0.4),
                periodic,
                solid: [[false; 2]; 3],
            };
            let balls = scatter(120, seed);
            let mut broad = BroadPhase::default();
            broad.search(&balls, &enclosure);
            let expected = naive(&balls, &enclosure);
            assert!(expected.len() > 20);
            assert_eq!(broad.pairs, expected, "{periodic:?}");
        }
    }

    #[test]
    fn a_ball_that_is_not_finite_is_left_out() {
        let enclosure = Enclosure {
            lower: DVec3::ZERO,
            upper: DVec3::ONE,
            periodic: [true; 3],
            solid: [[false; 2]; 3],
        };
        let mut balls = scatter(10, 5);
        balls[3].center.x = f64::NAN;
        let mut broad = BroadPhase::default();
        broad.search(&balls, &enclosure);
        assert!(
            broad
                .pairs
                .iter()
                .all(|p| p.grain != 3 && p.partner != Partner::Grain(3))
        );
    }
}
