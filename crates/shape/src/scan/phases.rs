//! Mean grey values of the phases of an image.

use super::watershed::HALO;
use crate::grid;
use rayon::prelude::*;

/// Number of voxels sufficient for the mean grey values of an image.
const ENOUGH: usize = 1 << 24;
/// Minimum number of deep voxels for the mean grey of a phase.
const FEW_DEEP: u64 = 200;
/// Minimum number of less deep voxels; they are preferable to all voxels, which the blur of the
/// surface darkens.
const SOME_DEEP: u64 = 24;
/// Steps along the axes without a voxel of the other phase that make a voxel deep.
const CLEAR: usize = 4;

/// Distance without void around a voxel of the solid that blur does not darken [voxels].
const UNBLURRED: f64 = 3.7;

/// Mean grey values of void and of solid.
pub(crate) struct Phases {
    pub void: f64,
    pub solid: f64,
    /// Whether some voxels of the solid lie so deep that blur does not darken them.
    pub solid_is_deep: bool,
}

/// Computes the mean grey values of void and of solid from voxels without the other phase within
/// [`CLEAR`] steps along the axes, or from the deepest voxels if there are hardly any. `owner`
/// marks the voxels as in [`Grey`](super::grey::Grey); those with the value `outside` lie outside
/// the field of view.
pub(super) fn phases(
    dims: [usize; 3],
    values: &[f32],
    owner: &[u32],
    outside: Option<f32>,
) -> Phases {
    let is_solid = |n: usize| owner[n] != 0 && owner[n] & HALO == 0;
    // For large images a fraction of the rows suffices, unless few voxels are deep.
    let share = (values.len() / ENOUGH).max(1);
    let mut grey = mean_grey(dims, values, outside, is_solid, share);
    if share > 1 && grey.iter().any(|(_, deep)| *deep < FEW_DEEP) {
        grey = mean_grey(dims, values, outside, is_solid, 1);
    }
    let [(void, _), (solid, _)] = grey;
    Phases { void, solid, solid_is_deep: has_deep_solid(dims, is_solid) }
}

/// Returns whether at least [`SOME_DEEP`] voxels of the solid have no void within [`UNBLURRED`] in
/// any direction: a thin plate oblique to the axes has none, although its voxels may be clear along
/// the axes.
fn has_deep_solid(dims: [usize; 3], is_solid: impl Fn(usize) -> bool + Sync) -> bool {
    let reach = UNBLURRED as isize;
    let steps = || -reach..=reach;
    let around: Vec<[isize; 3]> = steps()
        .flat_map(|k| steps().flat_map(move |j| steps().map(move |i| [i, j, k])))
        .filter(|[i, j, k]| ((i * i + j * j + k * k) as f64) < UNBLURRED * UNBLURRED)
        .collect();
    let is_deep = |n: &usize| {
        let at = grid::place(dims, *n);
        is_solid(*n)
            && clear(dims, *n, |m| !is_solid(m)) == CLEAR
            && around.iter().all(|step| {
                let to: [usize; 3] =
                    std::array::from_fn(|axis| at[axis].wrapping_add_signed(step[axis]));
                (0..3).any(|axis| to[axis] >= dims[axis]) || is_solid(grid::index(dims, to))
            })
    };
    let slice = dims[0] * dims[1];
    let some = SOME_DEEP as usize;
    let slices = (0..dims[2]).into_par_iter().map(|k| slice * k..slice * (k + 1));
    slices.map(|slice| slice.filter(is_deep).take(some).count()).sum::<usize>() >= some
}

/// Returns the number of steps along the axes, in all directions, without a voxel of the kind
/// `other`; at most [`CLEAR`].
fn clear(dims: [usize; 3], n: usize, other: impl Fn(usize) -> bool) -> usize {
    let strides = [1, dims[0], dims[0] * dims[1]];
    let blocked = (1..=CLEAR).find(|s| {
        (0..3).any(|axis| {
            let i = n / strides[axis] % dims[axis];
            let below = *s <= i && other(n - s * strides[axis]);
            below || (i + s < dims[axis] && other(n + s * strides[axis]))
        })
    });
    blocked.map_or(CLEAR, |s| s - 1)
}

/// Returns the mean grey values of void and of solid, each with its number of sampled deep voxels,
/// from those or from the deepest class with enough voxels. One in `share` rows is sampled.
fn mean_grey(
    dims: [usize; 3],
    values: &[f32],
    outside: Option<f32>,
    is_solid: impl Fn(usize) -> bool + Sync,
    share: usize,
) -> [(f64, u64); 2] {
    let row = |j: usize, k: usize| {
        let start = dims[0] * (j + dims[1] * k);
        start..start + dims[0]
    };
    // Sum and number of the voxels of both phases by clear steps, for each slice.
    let slices: Vec<[[(f64, u64); CLEAR + 1]; 2]> = (0..dims[2])
        .into_par_iter()
        .map(|k| {
            let mut sums = [[(0.0, 0); CLEAR + 1]; 2];
            let rows = (0..dims[1]).filter(|j| (j + k) % share == 0);
            for n in rows.flat_map(|j| row(j, k)).filter(|n| Some(values[*n]) != outside) {
                let phase = is_solid(n);
                let sum = &mut sums[usize::from(phase)][clear(dims, n, |m| is_solid(m) != phase)];
                *sum = (sum.0 + f64::from(values[n]), sum.1 + 1);
            }
            sums
        })
        .collect();
    [0, 1].map(|phase| {
        let total = |steps: usize| {
            let sums = slices.iter().flat_map(|s| &s[phase][steps..]);
            sums.fold((0.0, 0), |t, s| (t.0 + s.0, t.1 + s.1))
        };
        let deep = total(CLEAR);
        let some = |sum: &(f64, u64)| sum.1 >= SOME_DEEP;
        let (sum, count) = if deep.1 >= FEW_DEEP {
            deep
        } else {
            let shallower = [CLEAR - 1, CLEAR - 2].map(total);
            shallower.into_iter().find(some).unwrap_or_else(|| total(0))
        };
        (sum / count.max(1) as f64, deep.1)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oblique_plates_have_no_deep_solid() {
        let dims = [40, 40, 40];
        // Distance from the middle plane along the diagonal of the image [voxels].
        let plate = |half: f64| {
            move |n: usize| {
                let at = [n % 40, n / 40 % 40, n / 1600];
                (at.iter().sum::<usize>() as f64 - 58.5).abs() / 3f64.sqrt() < half
            }
        };
        for (half, deep) in [(2.5, false), (3.0, false), (4.5, true)] {
            assert_eq!(has_deep_solid(dims, plate(half)), deep, "{half}");
        }
        let clear = |n: usize| clear(dims, n, |m| !plate(3.0)(m)) == CLEAR;
        assert!((0..64_000).filter(|n| plate(3.0)(*n) && clear(*n)).count() > 100);
    }

    #[test]
    fn a_share_of_the_rows_gives_the_grey_of_all() {
        let dims = [40, 40, 40];
        let inside = |n: usize| {
            let at = [n % 40, n / 40 % 40, n / 1600];
            at.iter().all(|i| (8..32).contains(i))
        };
        // Solid 3, void 1, with a ripple, and a darker rim of the solid.
        let value = |n: usize| {
            let at = [n % 40, n / 40 % 40, n / 1600];
            let rim = inside(n) && at.iter().any(|i| *i == 8 || *i == 31);
            1.0 + 2.0 * f32::from(u8::from(inside(n))) - f32::from(u8::from(rim))
                + 0.1 * (n as f32 * 0.7).sin()
        };
        let values: Vec<f32> = (0..64_000).map(value).collect();
        for share in [1, 4] {
            let [void, solid] = mean_grey(dims, &values, None, inside, share);
            assert!((void.0 - 1.0).abs() < 0.01, "{}", void.0);
            assert!((solid.0 - 3.0).abs() < 0.01, "deep voxels alone: {}", solid.0);
            // 16^3 voxels are deep.
            assert_eq!(solid.1 as usize, 4096 / share);
        }
    }
}
