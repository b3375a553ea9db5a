//! The flow between prediction and projection, as grains see and change it.

use std::ops::Range;

use glam::DVec3;

use super::{Boundaries, Flow};
use crate::grid::{Centre, FaceVector, Field, Mesh, Part, for_slabs};
use crate::math::Real;
use grainwake_simd::Vector;

/// What the prediction was made of.
pub struct Known<'a, R> {
    pub mesh: &'a Mesh,
    pub boundaries: &'a Boundaries,
    /// Velocity u^n [m/s].
    pub velocity: &'a FaceVector<R>,
    /// Dynamic pressure over density p^n [m^2/s^2].
    pub pressure: &'a Field<Centre, R>,
    /// [m/s^2]
    pub body_acceleration: DVec3,
}

/// One component of the predicted velocity u* and of the tendency H^n it came of, or a slab of them.
pub struct Prediction<'a, R> {
    /// Weight of H^n in u* [s].
    weight: f64,
    tendency: Part<'a, R>,
    velocity: Part<'a, R>,
}

impl<R: Real> Flow<R> {
    /// What is known, and what has been predicted of each component.
    pub fn prediction(&mut self) -> (Known<'_, R>, [Prediction<'_, R>; 3]) {
        let weight = self.weight;
        let known = Known {
            mesh: &self.mesh,
            boundaries: &self.boundaries,
            velocity: &self.velocity,
            pressure: &self.pressure,
            body_acceleration: self.coefficients.acceleration,
        };
        let predictions = fields(&mut self.tendency, &mut self.predicted);
        let predictions =
            predictions.map(|[tendency, velocity]| Prediction::new(weight, 0, tendency, velocity));
        (known, predictions)
    }

    /// Calls `each(component, prediction)` for slabs of all components in parallel.
    pub fn for_predictions(&mut self, each: impl Fn(usize, Prediction<R>) + Sync) {
        let (weight, layout) = (self.weight, self.mesh.layout());
        let fields = fields(&mut self.tendency, &mut self.predicted);
        for_slabs(layout, fields, |component, start, [tendency, velocity]| {
            each(
                component,
                Prediction::new(weight, start, tendency, velocity),
            );
        });
    }
}

/// Two fields by component.
fn fields<'a, R>(
    one: &'a mut FaceVector<R>,
    other: &'a mut FaceVector<R>,
) -> [[&'a mut [R]; 2]; 3] {
    let FaceVector { x, y, z } = one;
    let FaceVector {
        x: ox,
        y: oy,
        z: oz,
    } = other;
    [[&mut **x, &mut **ox], [y, oy], [z, oz]]
}

impl<'a, R: Real> Prediction<'a, R> {
    fn new(
        weight: f64,
        start: usize,
        tendency: &'a mut [R],
        velocity: &'a mut [R],
    ) -> Prediction<'a, R> {
        Prediction {
            weight,
            tendency: Part::new(start, tendency),
            velocity: Part::new(start, velocity),
        }
    }

    /// The same once more.
    ///
    /// # Safety
    /// As long as both are in use, no face that is changed by one is read or changed by the other.
    pub unsafe fn again(&self) -> Prediction<'a, R> {
        // SAFETY: as the caller has promised.
        unsafe {
            Prediction {
                weight: self.weight,
                tendency: self.tendency.again(),
                velocity: self.velocity.again(),
            }
        }
    }

    /// Where in memory it lies.
    pub fn range(&self) -> &Range<usize> {
        self.velocity.range()
    }

    /// u* of `count` faces from position `at` on [m/s].
    #[inline(always)]
    pub fn velocity(&self, at: usize, count: usize) -> &[R] {
        self.velocity.row(at, count)
    }

    /// The same, to be changed.
    #[inline(always)]
    pub fn velocity_mut(&mut self, at: usize, count: usize) -> &mut [R] {
        self.velocity.row_mut(at, count)
    }

    /// Adds the first `count` of `extra` [m/s^2] to the tendency of the faces from position `at` on, as if they had
    /// been part of H^n. Vectors reach beyond what counts of that list.
    #[inline(always)]
    pub fn push<V: Vector<Number = f64>>(&mut self, at: usize, count: usize, extra: &[f64]) {
        let (tendency, velocity) = (
            self.tendency.row_mut(at, count),
            self.velocity.row_mut(at, count),
        );
        let weight = V::constant(self.weight);
        for n in (0..count).step_by(V::WIDTH) {
            let extra = V::load(&extra[n..]);
            extra.add_partial(&mut tendency[n..]);
            (weight * extra).add_partial(&mut velocity[n..]);
        }
    }
}
