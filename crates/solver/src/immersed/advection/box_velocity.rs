//! Velocity in the padded box around a grain, with constant strides even across periodic edges.

use crate::flow::OldState;
use crate::immersed::geometry::{LocatedBody, PAD};
use crate::math::Real;
use grainwake_simd::MAX_LANES;

/// Velocity in the padded box around a grain [m/s], either in the fields or copied.
pub struct BoxVelocity<'a, R> {
    pub components: [&'a [R]; 3],
    /// Entries from one face to the next along each axis.
    pub strides: [usize; 3],
    /// Position of the lowest cell of the box, modulo the range of `usize` if it is not in memory.
    origin: usize,
}

impl<'a, R: Real> BoxVelocity<'a, R> {
    /// Refers to the fields if they hold the padded box with constant strides, else fills `copies`.
    pub fn new(
        known: &OldState<'a, R>,
        body: &LocatedBody,
        copies: &'a mut [Vec<R>; 3],
    ) -> BoxVelocity<'a, R> {
        let (layout, velocity) = (known.mesh.layout(), known.velocity);
        let periodic = known.boundaries.periodic();
        // Links end at walls, so only periodic edges and rows shorter than a register need a copy.
        let direct = layout.cells[0] >= MAX_LANES
            && (0..3).all(|axis| {
                let high = body.lowest[axis] + body.size[axis] + PAD - 1;
                !periodic[axis] || body.lowest[axis] >= PAD && high <= layout.cells[axis] as i32 + 1
            });
        if direct {
            let strides = layout.strides();
            let along = |axis: usize| (body.lowest[axis] as usize).wrapping_mul(strides[axis]);
            return BoxVelocity {
                components: [0, 1, 2].map(|axis| velocity.component(axis)),
                strides,
                origin: along(0).wrapping_add(along(1)).wrapping_add(along(2)),
            };
        }
        for (axis, copy) in copies.iter_mut().enumerate() {
            body.index_map.copy(velocity.component(axis), copy);
            copy.resize(copy.len() + MAX_LANES, R::default());
        }
        let wide = (body.size + 2 * PAD).to_array().map(|n| n as usize);
        let strides = [1, wide[0], wide[0] * wide[1]];
        BoxVelocity {
            components: copies.each_ref().map(|copy| &copy[..]),
            strides,
            origin: PAD as usize * strides.iter().sum::<usize>(),
        }
    }

    /// Position of face 0 of row (j, k) of the box.
    #[inline(always)]
    pub fn row(&self, [j, k]: [i32; 2]) -> usize {
        let [_, line, plane] = self.strides;
        self.origin.wrapping_add(j as usize * line + k as usize * plane)
    }
}
