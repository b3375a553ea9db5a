//! Access of the immersed boundary to the flow between prediction and projection.

use std::ops::Range;

use glam::DVec3;

use super::{Boundaries, Flow};
use crate::grid::{Centre, FaceVector, Field, Mesh, SharedRows, for_slabs};
use crate::math::Real;
use grainwake_simd::Vector;

/// State at t^n from which the prediction was computed.
pub struct OldState<'a, R> {
    /// Grid of the box.
    pub mesh: &'a Mesh,
    /// Conditions on the faces of the box.
    pub boundaries: &'a Boundaries,
    /// Velocity u^n [m/s].
    pub velocity: &'a FaceVector<R>,
    /// Dynamic pressure over density p^n [m^2/s^2].
    pub pressure: &'a Field<Centre, R>,
    /// Uniform acceleration that drives the flow [m/s^2].
    pub body_acceleration: DVec3,
}

/// One component of the predicted velocity u* and of the tendency H^n, of the box or of a slab.
pub struct Prediction<'a, R> {
    /// Weight of H^n in u* [s].
    weight: f64,
    tendency: SharedRows<'a, R>,
    velocity: SharedRows<'a, R>,
}

impl<R: Real> Flow<R> {
    /// State at t^n, and the prediction of each component.
    pub fn prediction(&mut self) -> (OldState<'_, R>, [Prediction<'_, R>; 3]) {
        let weight = self.weight;
        let old = OldState {
            mesh: &self.mesh,
            boundaries: &self.boundaries,
            velocity: &self.velocity,
            pressure: &self.pressure,
            body_acceleration: self.coefficients.acceleration,
        };
        let predictions = fields(&mut self.tendency, &mut self.predicted);
        let predictions =
            predictions.map(|[tendency, velocity]| Prediction::new(weight, 0, tendency, velocity));
        (old, predictions)
    }

    /// Calls `each(component, prediction)` for slabs of all components in parallel.
    pub fn for_predictions(&mut self, each: impl Fn(usize, Prediction<R>) + Sync) {
        let (weight, layout) = (self.weight, self.mesh.layout());
        let fields = fields(&mut self.tendency, &mut self.predicted);
        for_slabs(layout, fields, |component, start, [tendency, velocity]| {
            each(component, Prediction::new(weight, start, tendency, velocity));
        });
    }
}

/// Components of two vector fields, paired by axis.
fn fields<'a, R>(
    one: &'a mut FaceVector<R>,
    other: &'a mut FaceVector<R>,
) -> [[&'a mut [R]; 2]; 3] {
    let FaceVector { x, y, z } = one;
    let FaceVector { x: ox, y: oy, z: oz } = other;
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
            tendency: SharedRows::new(start, tendency),
            velocity: SharedRows::new(start, velocity),
        }
    }

    /// Second handle to the same faces.
    ///
    /// # Safety
    /// While both exist, no face that one handle changes is read or changed through the other.
    pub unsafe fn alias(&self) -> Prediction<'a, R> {
        // SAFETY: guaranteed by the caller.
        unsafe {
            Prediction {
                weight: self.weight,
                tendency: self.tendency.alias(),
                velocity: self.velocity.alias(),
            }
        }
    }

    /// Positions of the faces in the memory of the field.
    pub fn range(&self) -> &Range<usize> {
        self.velocity.range()
    }

    /// u* of `count` faces from position `at` on [m/s].
    #[inline(always)]
    pub fn velocity(&self, at: usize, count: usize) -> &[R] {
        self.velocity.row(at, count)
    }

    /// Mutable u* of `count` faces from position `at` on [m/s].
    #[inline(always)]
    pub fn velocity_mut(&mut self, at: usize, count: usize) -> &mut [R] {
        self.velocity.row_mut(at, count)
    }

    /// Adds the first `count` entries of `extra` [m/s^2] to H^n of the faces from position `at` on,
    /// and updates u*. `extra` must be padded to whole vectors.
    #[inline(always)]
    pub fn add_tendency<V: Vector<Number = f64>>(
        &mut self,
        at: usize,
        count: usize,
        extra: &[f64],
    ) {
        let (tendency, velocity) =
            (self.tendency.row_mut(at, count), self.velocity.row_mut(at, count));
        let weight = V::constant(self.weight);
        for n in (0..count).step_by(V::WIDTH) {
            let extra = V::load(&extra[n..]);
            extra.add_partial(&mut tendency[n..]);
            (weight * extra).add_partial(&mut velocity[n..]);
        }
    }
}
