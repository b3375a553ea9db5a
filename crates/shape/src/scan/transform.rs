//! Exact Euclidean distance transform of a mask, in both directions.

use super::Mask;
use crate::filter::transpose;
use rayon::prelude::*;

/// Squared distance if the line has no target voxel.
const FAR: f32 = 1e30;

/// Returns the signed distance [voxels] of every voxel centre from the interface of the mask,
/// negative inside: the exact distance to the nearest voxel centre of the other phase minus half a
/// voxel.
pub(crate) fn signed(mask: &Mask) -> Vec<f32> {
    let (to_solid, to_void) = (squared(mask, true), squared(mask, false));
    let distance = |(to_solid, to_void): (&f32, &f32)| {
        if *to_void > 0.0 { 0.5 - to_void.sqrt() } else { to_solid.sqrt() - 0.5 }
    };
    to_solid.par_iter().zip(&to_void).map(distance).collect()
}

/// Returns the squared distance [voxels^2] of every voxel centre to the nearest void voxel; 0 in
/// the void.
pub(crate) fn to_void(mask: &Mask) -> Vec<f32> {
    squared(mask, false)
}

/// Returns the squared distance [voxels^2] of every voxel centre to the nearest solid voxel; 0 in
/// the solid.
pub(crate) fn to_solid(mask: &Mask) -> Vec<f32> {
    squared(mask, true)
}

/// Returns the squared distance of every voxel to the nearest voxel with mask value `target`.
fn squared(mask: &Mask, target: bool) -> Vec<f32> {
    let [nx, ny, nz] = mask.dims;
    let mut field: Vec<f32> =
        mask.solid.iter().map(|s| if *s == target { 0.0 } else { FAR }).collect();
    let mut scratch = vec![0.0f32; field.len()];
    lower_lines(&mut field, nx);
    // Lines along y and z are made contiguous first.
    transpose(&field, &mut scratch, [nx, ny, nz]);
    lower_lines(&mut scratch, ny);
    transpose(&scratch, &mut field, [ny, nz, nx]);
    lower_lines(&mut field, nz);
    transpose(&field, &mut scratch, [nz, nx, ny]);
    scratch
}

/// A parabola of the lower envelope: position, height of the vertex, and start of the interval in
/// which it is lowest.
#[derive(Clone, Copy)]
struct Parabola {
    centre: f64,
    foot: f64,
    start: f64,
}

/// One-dimensional transform: min over q of (p - q)^2 + line[q], by the lower envelope of parabolas
/// (Felzenszwalb and Huttenlocher 2012). `envelope` is scratch space.
fn lower(line: &mut [f32], envelope: &mut Vec<Parabola>) {
    envelope.clear();
    // Parabolas of infinite height are not part of the envelope.
    let feet = line.iter().enumerate().filter(|(_, v)| **v < FAR);
    for (q, foot) in feet {
        let (q, foot) = (q as f64, f64::from(*foot));
        let mut start = f64::NEG_INFINITY;
        while let Some(last) = envelope.last() {
            let rise = (foot + q * q) - (last.foot + last.centre * last.centre);
            start = rise / (2.0 * (q - last.centre));
            if start > last.start {
                break;
            }
            envelope.pop();
            start = f64::NEG_INFINITY;
        }
        let centre = q;
        envelope.push(Parabola { centre, foot, start });
    }
    let mut lowest = envelope.iter().copied().peekable();
    let Some(mut now) = lowest.next() else {
        return;
    };
    for (p, out) in line.iter_mut().enumerate() {
        let p = p as f64;
        while let Some(next) = lowest.next_if(|next| next.start < p) {
            now = next;
        }
        *out = ((p - now.centre).powi(2) + now.foot) as f32;
    }
}

/// Applies [`lower`] to every line of `length` values.
fn lower_lines(field: &mut [f32], length: usize) {
    let lines = field.par_chunks_mut(length);
    // Uniform lines do not change.
    lines.for_each_init(Vec::new, |envelope, line| {
        if line.iter().any(|v| *v > 0.0) {
            lower(line, envelope);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn the_transform_is_exact() {
        let dims = [9, 7, 8];
        let mut random = Random::seed_from_u64(5);
        let solid: Vec<bool> =
            (0..dims.iter().product()).map(|_| random.random_bool(0.2)).collect();
        let mask = Mask { dims, solid };
        let found = signed(&mask);
        let at = |n: usize| [n % 9, n / 9 % 7, n / 63].map(|v| v as f64);
        for n in 0..found.len() {
            let nearest = (0..found.len())
                .filter(|m| mask.solid[*m] != mask.solid[n])
                .map(|m| {
                    let (p, q) = (at(n), at(m));
                    (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>().sqrt()
                })
                .fold(f64::INFINITY, f64::min);
            let exact = if mask.solid[n] { 0.5 - nearest } else { nearest - 0.5 };
            assert!((f64::from(found[n]) - exact).abs() < 1e-5, "voxel {n}");
        }
    }
}
