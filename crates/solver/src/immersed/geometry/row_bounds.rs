//! Bounds of the faces in each row that may lie within reach of a grain, several rows at a time.

use glam::{DMat3, DVec3};

use super::lists::RowSpan;
use crate::dem::Grain;
use grainwake_simd::{MAX_LANES, Vector};

/// Ball and box around a grain that contain all points within reach of its surface.
pub struct RowBounds {
    /// Square of the radius of the ball around the centroid [m^2].
    far: f64,
    /// Corners of the box in the frame of the grain [m].
    lower: DVec3,
    upper: DVec3,
    spacing: DVec3,
    to_body: DMat3,
    /// Step from a face of a row to the next in the frame of the grain [m].
    pub step: DVec3,
    /// Inverse of each component of `step` [1/m].
    per_step: DVec3,
}

impl RowBounds {
    pub fn new(grain: &Grain, reach: f64, spacing: DVec3, to_body: DMat3) -> RowBounds {
        let far = grain.shape.bounding_radius() + reach;
        let step = to_body * (DVec3::X * spacing.x);
        // Limited so that it fits single precision if a row is parallel to a side of the box.
        let least = 1e-8 * spacing.x;
        let per_step = step.map(|s| 1.0 / if s.abs() > least { s } else { least });
        RowBounds {
            far: far * far,
            lower: grain.shape.lower() - reach,
            upper: grain.shape.upper() + reach,
            spacing,
            to_body,
            step,
            per_step,
        }
    }

    /// Bounds the rows (j, k), (j + 1, k), ... of a register, of `count` faces each; `arm` leads from
    /// the centroid to face (0, 0, 0) [m].
    #[inline(always)]
    pub fn rows<V: Vector<Number = f32>>(
        &self,
        arm: DVec3,
        [j, k]: [i32; 2],
        count: i32,
    ) -> CandidateRows {
        let zero = V::constant(0.0);
        let z = V::constant(arm.z + self.spacing.z * f64::from(k));
        let step = V::constant(f64::from(j)) + V::ramp();
        let y = V::constant(arm.y) + V::constant(self.spacing.y) * step;
        let square = V::constant(self.far) - y * y - z * z;
        let half = square.max(zero).sqrt();
        let per_step = V::constant(1.0 / self.spacing.x);
        let x = V::constant(arm.x);
        let (mut from, mut to) = ((zero - half - x) * per_step, (half - x) * per_step);
        let mut rows = CandidateRows::default();
        let [a, b, c] = [
            self.to_body.x_axis,
            self.to_body.y_axis,
            self.to_body.z_axis,
        ];
        for axis in 0..3 {
            let first =
                V::constant(a[axis]) * x + V::constant(b[axis]) * y + V::constant(c[axis]) * z;
            let per_step = V::constant(self.per_step[axis]);
            let low = (V::constant(self.lower[axis]) - first) * per_step;
            let high = (V::constant(self.upper[axis]) - first) * per_step;
            from = from.max(low.min(high));
            to = to.min(low.max(high));
            first.store(&mut rows.first[axis]);
        }
        // Rows that miss the ball are empty.
        let end = V::constant(f64::from(count));
        let start = (zero - (zero - from).floor()).max(zero).min(end);
        let stop = (to.floor() + V::constant(1.0)).max(start).min(end);
        start.store(&mut rows.start);
        zero.select_below(square, stop, start).store(&mut rows.end);
        rows
    }
}

/// Faces of several rows that may lie within reach, one row per lane.
#[derive(Default)]
pub struct CandidateRows {
    /// Face 0 of each row in the frame of the grain [m], by axis.
    first: [[f32; MAX_LANES]; 3],
    start: [f32; MAX_LANES],
    end: [f32; MAX_LANES],
}

impl CandidateRows {
    /// Candidate faces of row `n`, listed from entry `first` on, and the position of face 0.
    #[inline(always)]
    pub fn of(&self, n: usize, first: usize) -> (RowSpan, [f32; 3]) {
        let [start, end] = [self.start[n] as i32, self.end[n] as i32];
        let span = RowSpan { start, end, first };
        let [x, y, z] = &self.first;
        (span, [x[n], y[n], z[n]])
    }
}
