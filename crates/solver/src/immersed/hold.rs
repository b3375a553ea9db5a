//! How surfaces hold the faces near them: the drag on a face and how much of it they close.
//!
//! Legend: d signed distance, n unit normal out of the grain, eps half-width of the band.

use glam::DVec3;

use super::Scheme;
use super::aperture::{aperture, drag};
use super::forced::Forced;
use super::samples::load_all;
use grainwake_simd::{Kernel, MOST, One, Vector, dispatch};

/// How surfaces hold a face.
#[derive(Clone, Copy, Debug)]
pub struct Hold {
    /// Drag times the step: the face takes strength / (1 + strength) of the rigid velocity.
    pub strength: f64,
    /// Part closed to the pressure gradient.
    pub closed: f64,
}

impl Hold {
    /// Share of the rigid velocity that a face takes where grains hold it with `all` their strength.
    #[inline]
    pub fn share(self, all: Hold) -> f64 {
        if self.strength.is_finite() {
            self.strength / (1.0 + all.strength)
        } else {
            1.0
        }
    }
}

impl std::ops::Add for Hold {
    type Output = Hold;
    fn add(self, other: Hold) -> Hold {
        Hold {
            strength: self.strength + other.strength,
            closed: self.closed + other.closed,
        }
    }
}

/// What the hold on a face depends on beside its place.
#[derive(Clone, Copy)]
pub struct Holding {
    pub scheme: Scheme,
    /// Half-width of the band [m].
    pub eps: f64,
    pub spacing: DVec3,
    /// Kinematic viscosity times the step [m^2].
    pub diffusion: f64,
}

/// The faces that one grain may force, in the order of its lists; what holds them is found for all at
/// once.
#[derive(Debug, Default)]
pub struct Faces {
    count: usize,
    /// Signed distances [m] and unit normals; what follows the last face is of no meaning.
    distance: Vec<f32>,
    normal: [Vec<f32>; 3],
}

impl Faces {
    pub fn clear(&mut self) {
        self.count = 0;
    }
    /// Number of faces.
    pub fn count(&self) -> usize {
        self.count
    }
    /// Makes room for `count` more faces.
    pub fn reserve(&mut self, count: usize) {
        let needed = self.count + count + MOST;
        for list in [&mut self.distance].into_iter().chain(&mut self.normal) {
            list.resize(list.len().max(needed), 0.0);
        }
    }
    /// Adds neighbouring faces of a row, for which there is room; of the lists more than these are read.
    #[inline(always)]
    pub fn extend<V: Vector<Number = f32>>(
        &mut self,
        count: usize,
        distance: &[f32],
        normal: [&[f32]; 3],
    ) {
        let first = self.count;
        self.count += count;
        let [x, y, z] = &mut self.normal;
        for n in (0..count).step_by(V::WIDTH) {
            V::load(&distance[n..]).store(&mut self.distance[first + n..]);
            V::load(&normal[0][n..]).store(&mut x[first + n..]);
            V::load(&normal[1][n..]).store(&mut y[first + n..]);
            V::load(&normal[2][n..]).store(&mut z[first + n..]);
        }
    }
    /// Takes a face from the grain: another one holds it.
    pub fn forgo(&mut self, index: usize, holding: &Holding) {
        self.distance[index] = holding.away() as f32;
    }
    /// Finds the holds on all faces, as far as no other grain is near, for the lists of `forced`.
    pub fn hold(&mut self, holding: &Holding, forced: &mut Forced) {
        let count = self.count;
        let padded = count.next_multiple_of(MOST);
        self.distance.resize(padded.max(self.distance.len()), 0.0);
        self.normal
            .iter_mut()
            .for_each(|n| n.resize(padded.max(n.len()), 0.0));
        self.distance[count..padded].fill(holding.away() as f32);
        forced.share.resize(padded, 0.0);
        forced.closed.resize(padded, 0.0);
        match holding.scheme {
            Scheme::Aperture => dispatch(Apertures {
                holding,
                faces: self,
                forced,
            }),
            Scheme::Paper => {
                for at in 0..count {
                    let hold = self.at(at, holding);
                    forced.share[at] = hold.share(hold) as f32;
                    forced.closed[at] = hold.closed as f32;
                }
            }
        }
        // Zeros follow, which registers may reach into.
        for list in [&mut forced.share, &mut forced.closed] {
            list.truncate(count);
            list.resize(count + MOST, 0.0);
        }
        forced.closed_by_all.clear();
    }
    /// The hold of the grain on a face.
    pub fn at(&self, index: usize, holding: &Holding) -> Hold {
        let normal = self.normal.each_ref().map(|list| f64::from(list[index]));
        let distance = f64::from(self.distance[index]);
        holding.of(distance, DVec3::from_array(normal))
    }
}

impl Holding {
    /// The hold on one face.
    pub fn of(&self, d: f64, normal: DVec3) -> Hold {
        match self.scheme {
            Scheme::Aperture => {
                let mut hold = Hold {
                    strength: 0.0,
                    closed: 0.0,
                };
                dispatch(OneFace {
                    holding: self,
                    d,
                    normal,
                    hold: &mut hold,
                });
                hold
            }
            Scheme::Paper => self.blend(d, normal),
        }
    }

    /// A distance that is far away [m].
    fn away(&self) -> f64 {
        4.0 * self.eps
    }

    /// Strength of the hold on faces, as the quotient of two numbers, and closed part.
    #[inline(always)]
    fn near<V: Vector>(&self, d: V, normal: [V; 3]) -> ([V; 2], V) {
        let [drag, depth] = drag(d, normal, self.spacing.to_array(), self.eps);
        let strength = V::constant(self.diffusion) * drag;
        // The grain does nothing beyond its faces, which may enclose some where it is concave.
        let outside = V::constant(2.0 * self.eps);
        let strength = d.where_below(outside, strength, V::constant(0.0));
        let closed = V::constant(1.0) - aperture(d, self.eps);
        ([strength, depth], closed)
    }

    /// The paper's hold: a share of the rigid velocity as large as the solid fraction.
    fn blend(&self, d: f64, normal: DVec3) -> Hold {
        let width = normal.abs().dot(self.spacing);
        let share = (0.5 - d / width).clamp(0.0, 1.0);
        Hold {
            strength: share / (1.0 - share),
            closed: 0.0,
        }
    }
}

/// The hold on one face, with the instructions of the machine.
struct OneFace<'a> {
    holding: &'a Holding,
    d: f64,
    normal: DVec3,
    hold: &'a mut Hold,
}

impl Kernel for OneFace<'_> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let [x, y, z] = self.normal.to_array();
        let ([strength, depth], closed) = self.holding.near(One(self.d), [One(x), One(y), One(z)]);
        *self.hold = Hold {
            strength: strength.0 / depth.0,
            closed: closed.0,
        };
    }
}

struct Apertures<'a> {
    holding: &'a Holding,
    faces: &'a Faces,
    forced: &'a mut Forced,
}

impl Kernel for Apertures<'_> {
    type Number = f32;
    #[inline(always)]
    fn run<V: Vector<Number = f32>>(self) {
        let Faces {
            distance, normal, ..
        } = self.faces;
        let Forced { share, closed, .. } = self.forced;
        let one = V::constant(1.0);
        let inside = V::constant(-self.holding.eps);
        for at in (0..share.len()).step_by(V::WIDTH) {
            let d = V::load(&distance[at..]);
            // Faces deep inside take all of the grain's motion.
            let shallow = inside.is_below(d);
            if shallow.is_zero() {
                one.store(&mut share[at..]);
                one.store(&mut closed[at..]);
                continue;
            }
            let ([strength, depth], part) = self.holding.near(d, load_all(normal, at));
            // strength / (1 + strength), by one division.
            let taken = strength.over(depth + strength);
            inside.where_below(d, taken, one).store(&mut share[at..]);
            inside.where_below(d, part, one).store(&mut closed[at..]);
        }
    }
}
