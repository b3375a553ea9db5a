//! Plans of the solver: factors and constants of the transforms, eigenvalues, scratch memory.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use super::axis::{AxisTransform, Chirp, Fourier};
use super::fft::{Fft, Pass, TOGETHER};
use super::plane::{Plane, PlaneLayout};
use super::tridiagonal::{ColumnScratch, Tridiagonal};
use super::{Ends, Poisson, PoissonTimes, Slot};
use crate::grid::Mesh;
use crate::math::{Aligned, Real};

/// Largest number of ranges of planes and of ranges of columns, enough for many threads.
const SLOTS: usize = 32;
/// Smallest number of planes of a range: the planes below and above each range are transformed
/// twice.
const MIN_PLANES_PER_SLOT: usize = 16;
/// Cache for a block of columns [bytes].
const CACHE: usize = 1 << 19;
/// Largest prime factor that is transformed by its definition (measured: decision 0005).
const LARGEST_PRIME: usize = 113;

impl<R: Real> Poisson<R> {
    /// Plans the solver for `mesh` with the given ends along x, y, z.
    pub fn new(mesh: &Mesh, ends: [Ends; 3]) -> Poisson<R> {
        let [nx, ny, nz] = mesh.cells;
        let axes = [0, 1].map(|a| AxisTransform::new(mesh.cells[a], ends[a], mesh.spacing[a]));
        let line = R::LANES;
        let layout = PlaneLayout { nx, ny, line, pitch: line + nx.next_multiple_of(line) + line };
        let buffers = axes[0].fourier.fft.len.max(axes[1].fourier.fft.len);
        let plane = || Aligned::zeros(layout.pitch * (layout.lines() + 2));
        let slot = || Slot {
            planes: [(); 3].map(|()| Plane { layout, values: plane() }),
            buffers: Aligned::zeros(4 * line * buffers),
        };
        // A multiple of two cache lines.
        let unit = 2 * line;
        let width = (CACHE / size_of::<f64>() / 2 / nz / unit * unit).max(unit);
        let width = width.min(layout.modes());
        let blocks = layout.modes().div_ceil(width);
        Poisson {
            mesh: *mesh,
            ends,
            along_z: Tridiagonal {
                n: nz,
                ends: ends[2],
                square: mesh.spacing.z * mesh.spacing.z,
                // A forward and an inverse transform multiply by the number of cells.
                scale: 1.0 / (nx as f64 * ny as f64),
            },
            layout,
            modes: Aligned::zeros(layout.stride() * nz),
            eigenvalues: eigenvalues(layout, &axes, mesh.spacing.y),
            slots: (0..(nz / MIN_PLANES_PER_SLOT).clamp(1, SLOTS)).map(|_| slot()).collect(),
            columns: (0..SLOTS.min(blocks))
                .map(|_| ColumnScratch::new(width, nz, ends[2]))
                .collect(),
            axes,
            times: PoissonTimes::default(),
        }
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        let slot = |slot: &Slot<R>| {
            let planes = slot.planes.iter().map(|plane| plane.values.len());
            slot.buffers.len() + planes.sum::<usize>()
        };
        let numbers = self.modes.len() + self.slots.iter().map(slot).sum::<usize>();
        let columns: usize = self.columns.iter().map(ColumnScratch::bytes).sum();
        R::BYTES * numbers + 8 * self.eigenvalues.len() + columns
    }
}

/// Eigenvalue along x and y of each mode of a plane [1/m^2], in its layout.
fn eigenvalues<R: Real>(layout: PlaneLayout, axes: &[AxisTransform<R>; 2], dy: f64) -> Vec<f64> {
    let [along_x, along_y] = axes.each_ref().map(|axis| &axis.eigenvalues);
    // Padding lines of a block hold round-off of their partners; a singular system would turn it
    // into infinities that return to the partners.
    let filler = dy.powi(-2);
    let mut found = Vec::with_capacity(layout.modes());
    for (first, second) in layout.blocks(layout.ny) {
        for along_x in along_x {
            let lines = first..first + 2 * second;
            found.extend(lines.map(|line| along_x + along_y.get(line).unwrap_or(&filler)));
        }
    }
    found
}

impl ColumnScratch {
    /// Scratch for `width` columns through `nz` planes with the conditions `ends`.
    fn new(width: usize, nz: usize, ends: Ends) -> ColumnScratch {
        let periodic = ends == Ends::Periodic && nz > 1;
        ColumnScratch {
            values: Aligned::zeros(width * (nz + 1)),
            pivots: Aligned::zeros(width * (nz + 1)),
            corner: Aligned::zeros(if periodic { width * (nz + 1) } else { 0 }),
            carry: Aligned::zeros(width),
            mean: [(); 2].map(|()| vec![0.0; nz]),
        }
    }
    /// Memory held [bytes].
    fn bytes(&self) -> usize {
        let Self { values, pivots, corner, carry, mean } = self;
        8 * (values.len() + pivots.len() + corner.len() + carry.len() + 2 * mean[0].len())
    }
}

impl<R: Real> AxisTransform<R> {
    /// Transforms of `n` cells, `spacing` [m] apart, with the conditions `ends`.
    fn new(n: usize, ends: Ends, spacing: f64) -> AxisTransform<R> {
        let neumann = ends == Ends::Neumann;
        let order = |i: usize| match i {
            _ if !neumann => i,
            _ if i.is_multiple_of(2) => i / 2,
            _ => n - 1 - i / 2,
        };
        let turn = |k: usize| {
            let angle = PI * k as f64 / (2 * n) as f64;
            if neumann { [angle.cos(), angle.sin()] } else { [1.0, 0.0] }
        };
        let eigenvalue = |k: usize| {
            let angle = match ends {
                Ends::Periodic => PI * k.min(n - k) as f64 / n as f64,
                Ends::Neumann => PI * k as f64 / (2 * n) as f64,
            };
            (2.0 * angle.sin() / spacing).powi(2)
        };
        AxisTransform {
            n,
            order: (0..n).map(order).collect(),
            eigenvalues: (0..n).map(eigenvalue).collect(),
            fourier: Fourier::new(n),
            turn: (0..n).map(|k| turn(k).map(R::of)).collect(),
            middle: if neumann {
                [FRAC_1_SQRT_2, 2.0 * FRAC_1_SQRT_2].map(R::of)
            } else {
                [R::of(1.0); 2]
            },
        }
    }
}

impl<R: Real> Fourier<R> {
    /// Plans for `n` points.
    pub fn new(n: usize) -> Fourier<R> {
        if factors(n).into_iter().all(|factor| factor <= LARGEST_PRIME) {
            return Fourier { fft: Fft::new(n), chirp: None };
        }
        // Smallest length with butterflies alone that holds the convolution.
        let padded = (2 * n - 1..)
            .find(|len| factors(*len).into_iter().all(|factor| [2, 3, 4, 5, 8].contains(&factor)))
            .unwrap_or(2 * n);
        // t^2 modulo 2n keeps the angle exact for long lines.
        let chirp: Vec<[f64; 2]> = (0..n).map(|t| root(t * t, 2 * n)).collect();
        let mut kernel = vec![[0.0; 2]; padded];
        for (t, [re, im]) in chirp.iter().enumerate() {
            kernel[t] = [*re, -im];
            kernel[(padded - t) % padded] = [*re, -im];
        }
        let roots: Vec<[f64; 2]> = (0..padded).map(|t| root(t, padded)).collect();
        let spectrum = (0..padded)
            .map(|k| {
                let mut sum = [0.0; 2];
                for (t, [re, im]) in kernel.iter().enumerate() {
                    let [c, s] = roots[k * t % padded];
                    sum[0] += re * c - im * s;
                    sum[1] += re * s + im * c;
                }
                sum.map(|value| R::of(value / padded as f64))
            })
            .collect();
        let turn = chirp.into_iter().map(|turn| turn.map(R::of)).collect();
        Fourier { fft: Fft::new(padded), chirp: Some(Chirp { turn, spectrum }) }
    }
}

impl<R: Real> Fft<R> {
    /// Plans for `n` points.
    fn new(n: usize) -> Fft<R> {
        let (mut left, mut stride) = (n, 1);
        let pass = |radix: usize| {
            let blocks = left / radix;
            let turn = (0..blocks)
                .flat_map(|p| (1..radix).map(move |t| root(p * t, left).map(R::of)))
                .collect();
            let circle = if radix > 8 { circle(radix) } else { Vec::new() };
            let pass = Pass { radix, blocks, stride, turn, circle };
            left = blocks;
            stride *= radix;
            pass
        };
        Fft { len: n, passes: factors(n).into_iter().map(pass).collect() }
    }
}

/// Factors in the order of the passes.
pub fn factors(mut n: usize) -> Vec<usize> {
    let mut found = Vec::new();
    // As few passes as possible for the powers of two.
    let mut twos = n.trailing_zeros();
    n >>= twos;
    while twos > 0 {
        let taken = match twos {
            1 | 2 => twos,
            4 => 2,
            _ => 3,
        };
        found.push(1 << taken);
        twos -= taken;
    }
    let mut radix = 3;
    while n > 1 {
        if radix * radix > n {
            radix = n;
        }
        if n.is_multiple_of(radix) {
            found.push(radix);
            n /= radix;
        } else {
            radix += 2;
        }
    }
    found
}

/// Cosines and minus sines of 2 pi k t / r in the order of [`Pass::circle`].
fn circle<R: Real>(r: usize) -> Vec<[R; 2]> {
    let half = r / 2;
    let mut found = Vec::new();
    for group in (1..=half).step_by(TOGETHER) {
        for t in 1..=half {
            for k in group..group + TOGETHER {
                let [cos, sin] = root(k * t, r);
                found.push([cos, -sin].map(R::of));
            }
        }
    }
    found
}

/// exp(-2 pi i numerator / denominator).
pub fn root(numerator: usize, denominator: usize) -> [f64; 2] {
    let angle = -2.0 * PI * (numerator % denominator) as f64 / denominator as f64;
    [angle.cos(), angle.sin()]
}
