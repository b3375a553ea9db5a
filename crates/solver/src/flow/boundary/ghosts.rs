//! Ghost layers: values beyond the boundary that make the stencil at the boundary hold.

use crate::math::Real;

/// Rule by which a ghost layer follows from the interior.
#[derive(Clone, Copy)]
pub(super) enum GhostRule {
    /// No stencil reads the ghost layer.
    Unused,
    /// Copy of the outermost layer at the opposite end of the box.
    Periodic,
    /// Copy of the adjacent interior layer.
    ZeroGradient,
    /// Extrapolation through this velocity at the wall [m/s].
    Wall(f64),
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
pub(super) fn fill_ghost_layer<R: Real>(
    values: &mut [R],
    layer: usize,
    rule: GhostRule,
    ghost: usize,
    inner: usize,
    n: usize,
) {
    let from = match rule {
        GhostRule::Unused => return,
        GhostRule::Periodic => n + 1 - inner,
        GhostRule::ZeroGradient => inner,
        GhostRule::Wall(wall) => {
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
