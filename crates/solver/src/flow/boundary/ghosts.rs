//! Ghost layers: values beyond the boundary that make the stencil at the boundary hold.

use crate::math::Real;

/// Rule by which a ghost layer follows from the interior.
#[derive(Clone, Copy)]
pub(super) enum Mirror {
    /// The ghost layer is not read.
    None,
    /// Copy of the outermost layer at the opposite end of the box.
    Wrap,
    /// Copy of the adjacent interior layer: zero normal gradient.
    Copy,
    /// Extrapolation through this value at the wall.
    About(f64),
}

/// Second interior layer from the end at which `inner` is the first, of layers 1..=n.
pub(super) fn second(inner: usize, n: usize) -> usize {
    if inner == 1 { 2.min(n) } else { inner - 1 }
}

/// Ghost value beyond a wall of velocity `wall` [m/s], on the parabola through the wall and the two
/// nearest values, which makes the shear at the wall second-order.
pub(super) fn beyond_wall<R: Real>(wall: f64, near: R, next: R, n: usize) -> R {
    R::of(if n == 1 {
        2.0 * wall - near.wide()
    } else {
        (8.0 * wall - 6.0 * near.wide() + next.wide()) / 3.0
    })
}

/// Fills the layer `ghost` of `layer` entries; `inner` is adjacent, 1..=n are interior.
pub(super) fn reflect<R: Real>(
    values: &mut [R],
    layer: usize,
    mirror: Mirror,
    ghost: usize,
    inner: usize,
    n: usize,
) {
    let from = match mirror {
        Mirror::None => return,
        Mirror::Wrap => n + 1 - inner,
        Mirror::Copy => inner,
        Mirror::About(wall) => {
            let next = second(inner, n);
            for i in 0..layer {
                let [near, next] = [inner, next].map(|from| values[from * layer + i]);
                values[ghost * layer + i] = beyond_wall(wall, near, next, n);
            }
            return;
        }
    };
    values.copy_within(from * layer..(from + 1) * layer, ghost * layer);
}
