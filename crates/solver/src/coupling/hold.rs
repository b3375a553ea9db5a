//! How surfaces hold the faces near them: the drag on a face and how much of it they close.
//!
//! Legend: d signed distance, n unit normal out of the grain, eps half-width of the band.

use glam::DVec3;

use super::Scheme;
use super::aperture::{aperture, drag};
use crate::math::lanes::{Kernel, MOST, One, Vector, dispatch};

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

/// Faces about one surface; what holds them is found for all at once.
#[derive(Debug, Default)]
pub struct Faces {
    distance: Vec<f64>,
    normal: [Vec<f64>; 3],
    strength: Vec<f64>,
    closed: Vec<f64>,
}

impl Faces {
    pub fn clear(&mut self) {
        self.distance.clear();
        self.normal.iter_mut().for_each(Vec::clear);
    }
    /// Adds a face; returns its number.
    pub fn push(&mut self, distance: f64, normal: [f64; 3]) -> usize {
        self.distance.push(distance);
        for (list, n) in self.normal.iter_mut().zip(normal) {
            list.push(n);
        }
        self.distance.len() - 1
    }
    /// Finds the holds on all faces.
    pub fn hold(&mut self, holding: &Holding) {
        let count = self.distance.len();
        // What fills up the last vector is far away.
        let padded = count.next_multiple_of(MOST);
        self.distance.resize(padded, 4.0 * holding.eps);
        self.normal.iter_mut().for_each(|n| n.resize(padded, 0.0));
        self.strength.resize(padded, 0.0);
        self.closed.resize(padded, 0.0);
        match holding.scheme {
            Scheme::Aperture => dispatch(Apertures {
                holding,
                faces: self,
            }),
            Scheme::Paper => {
                for at in 0..count {
                    let normal = DVec3::from_array([0, 1, 2].map(|axis| self.normal[axis][at]));
                    let hold = holding.blend(self.distance[at], normal);
                    (self.strength[at], self.closed[at]) = (hold.strength, hold.closed);
                }
            }
        }
    }
    /// The hold on a face, by the number that `push` gave it.
    pub fn at(&self, index: usize) -> Hold {
        Hold {
            strength: self.strength[index],
            closed: self.closed[index],
        }
    }
}

impl Holding {
    /// The hold on one face.
    pub fn of(&self, d: f64, normal: DVec3) -> Hold {
        match self.scheme {
            Scheme::Aperture => {
                let normal = normal.to_array().map(One);
                let (strength, closed) = self.near(One(d), normal);
                Hold {
                    strength: strength.0,
                    closed: closed.0,
                }
            }
            Scheme::Paper => self.blend(d, normal),
        }
    }

    /// Strength and closed part of faces.
    #[inline(always)]
    fn near<V: Vector<Number = f64>>(&self, d: V, normal: [V; 3]) -> (V, V) {
        let drag = drag(d, normal, self.spacing.to_array(), self.eps);
        let closed = V::constant(1.0) - aperture(d, self.eps);
        (V::constant(self.diffusion) * drag, closed)
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

struct Apertures<'a> {
    holding: &'a Holding,
    faces: &'a mut Faces,
}

impl Kernel for Apertures<'_> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let Faces {
            distance,
            normal: [x, y, z],
            strength,
            closed,
        } = self.faces;
        for at in (0..distance.len()).step_by(V::WIDTH) {
            let load = |values: &[f64]| V::load(&values[at..]);
            let normal = [load(x), load(y), load(z)];
            let (drag, part) = self.holding.near(load(distance), normal);
            drag.store(&mut strength[at..]);
            part.store(&mut closed[at..]);
        }
    }
}
