//! The solver against its definition: the residual of the seven-point Laplacian.

use super::plan::root;
use super::*;
use crate::grid::{Centre, Field};
use glam::DVec3;
use grainwake_simd::Vector;

impl<R: Real> Poisson<R> {
    /// Replaces the right-hand side in the interior of `field` by the solution; ghosts keep
    /// their values.
    pub fn solve_field(&mut self, field: &mut Field<Centre, R>) {
        let layout = self.mesh.layout();
        let [nx, ny, nz] = layout.cells;
        let given = field.clone();
        let source = |k: usize, plane: &mut Plane<R>| {
            for j in 1..=ny {
                plane.row_mut(j)[1..=nx].copy_from_slice(&given.row(j, k)[1..=nx]);
            }
        };
        self.solve(false, source, [field], &mut vec![(); nz], |_, solution, [plane], ()| {
            for j in 1..=ny {
                let at = layout.row() * j;
                plane[at + 1..=at + nx].copy_from_slice(&solution.here.row(j)[1..=nx]);
            }
        });
    }
}

/// Small deterministic generator of values in (-1, 1).
fn noise(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Largest residual over the largest right-hand side.
fn residual(cells: [usize; 3], ends: [Ends; 3]) -> f64 {
    let mesh = Mesh { cells, spacing: DVec3::new(0.5, 0.7, 0.6), origin: DVec3::ZERO };
    let [nx, ny, nz] = cells;
    let mut f = Field::<Centre>::zeros(&mesh);
    let mut state = 7;
    let mut sum = 0.0;
    for k in 1..=nz {
        for j in 1..=ny {
            for i in 1..=nx {
                let value = noise(&mut state);
                sum += value;
                f.set(i, j, k, value);
            }
        }
    }
    let mean = sum / mesh.cell_count() as f64;
    for k in 1..=nz {
        for j in 1..=ny {
            for i in 1..=nx {
                let value = f.at(i, j, k) - mean;
                f.set(i, j, k, value);
            }
        }
    }
    let rhs = f.clone();
    Poisson::new(&mesh, ends).solve_field(&mut f);
    for axis in 0..3 {
        match ends[axis] {
            Ends::Periodic => f.wrap(axis),
            Ends::Neumann => {
                f.copy_layer(axis, 1, 0);
                f.copy_layer(axis, cells[axis], cells[axis] + 1);
            }
        }
    }
    let (mut worst, mut scale) = (0.0f64, 0.0f64);
    for k in 1..=nz {
        for j in 1..=ny {
            for i in 1..=nx {
                let c = f.at(i, j, k);
                let lap = (f.at(i - 1, j, k) - 2.0 * c + f.at(i + 1, j, k))
                    / mesh.spacing.x.powi(2)
                    + (f.at(i, j - 1, k) - 2.0 * c + f.at(i, j + 1, k)) / mesh.spacing.y.powi(2)
                    + (f.at(i, j, k - 1) - 2.0 * c + f.at(i, j, k + 1)) / mesh.spacing.z.powi(2);
                assert!(lap.is_finite(), "{cells:?} {ends:?}: {lap}");
                worst = worst.max((lap - rhs.at(i, j, k)).abs());
                scale = scale.max(rhs.at(i, j, k).abs());
            }
        }
    }
    worst / scale
}

#[test]
fn residual_is_round_off_for_every_pairing_and_awkward_sizes() {
    use Ends::{Neumann as N, Periodic as P};
    let pairings =
        [[N, N, N], [P, N, N], [N, P, N], [P, P, N], [N, N, P], [P, N, P], [N, P, P], [P, P, P]];
    let sizes = [
        [67, 97, 131],
        [67, 31, 12],
        [12, 97, 31],
        [9, 10, 131],
        [16, 20, 24],
        [1, 15, 30],
        [14, 1, 9],
        [8, 11, 1],
        [2, 3, 2],
        [1, 1, 5],
        [64, 1, 64],
        // Beyond the largest prime that is transformed by its definition.
        [127, 16, 4],
        [6, 254, 3],
    ];
    for ends in pairings {
        for cells in sizes {
            let r = residual(cells, ends);
            assert!(r <= 1e-12, "{cells:?} {ends:?}: relative residual {r:e}");
        }
    }
}

/// A smooth right-hand side of zero mean with noise, solved in both precisions: largest difference
/// over the largest value.
fn single_against_double(cells: [usize; 3], spacing: DVec3, ends: [Ends; 3]) -> f64 {
    let mesh = Mesh { cells, spacing, origin: DVec3::ZERO };
    let mut state = 7;
    let mut double = Field::<Centre>::zeros(&mesh);
    double.fill_with(&mesh, |x| (std::f64::consts::PI * x.x / mesh.extent().x).cos());
    double.iter_mut().for_each(|value| *value += 0.1 * noise(&mut state));
    let inside: Vec<usize> = (1..=cells[2])
        .flat_map(|k| (1..=cells[1]).map(move |j| (j, k)))
        .flat_map(|(j, k)| (1..=cells[0]).map(move |i| (i, j, k)))
        .map(|(i, j, k)| mesh.layout().index(i, j, k))
        .collect();
    let of_inside = |field: &[f64], f: fn(f64, f64) -> f64, from: f64| {
        inside.iter().fold(from, |sum, &at| f(sum, field[at]))
    };
    let mean = of_inside(&double, |a, b| a + b, 0.0) / inside.len() as f64;
    let mut single = Field::<Centre, f32>::zeros(&mesh);
    for (double, single) in double.iter_mut().zip(single.iter_mut()) {
        *double -= mean;
        *single = f32::of(*double);
    }
    Poisson::new(&mesh, ends).solve_field(&mut double);
    Poisson::new(&mesh, ends).solve_field(&mut single);
    let single: Vec<f64> = single.iter().map(|value| value.wide()).collect();
    // Both are defined up to a constant.
    let shift = (of_inside(&single, |a, b| a + b, 0.0) - of_inside(&double, |a, b| a + b, 0.0))
        / inside.len() as f64;
    let off = |at: usize| (single[at] - double[at] - shift).abs();
    let worst = inside.iter().fold(0.0, |worst, &at| off(at).max(worst));
    worst / of_inside(&double, |a, b| a.max(b.abs()), 0.0)
}

#[test]
fn single_precision_solves_to_its_round_off_in_flat_boxes_too() {
    use Ends::{Neumann as N, Periodic as P};
    let cube = DVec3::new(0.5, 0.7, 0.6);
    let flat = |ratio: f64| DVec3::new(1.0, 1.0, ratio);
    for ends in [[N; 3], [P; 3], [N, P, N], [P, N, P], [N, N, P], [N, P, P]] {
        for (cells, spacing) in [
            ([67, 31, 12], cube),
            ([12, 97, 31], cube),
            ([40, 36, 200], cube),
            ([8, 11, 1], cube),
            ([127, 16, 4], cube),
            ([1, 15, 30], cube),
            ([2, 3, 2], cube),
            ([64, 1, 64], cube),
            // The lowest modes are next to singular.
            ([1000, 1, 64], flat(1.0)),
            ([1000, 1, 64], flat(0.1)),
            ([400, 1, 128], flat(0.1)),
        ] {
            let off = single_against_double(cells, spacing, ends);
            assert!(off <= 2e-5, "{cells:?} {spacing} {ends:?}: {off:e}");
        }
    }
}

#[test]
fn transforms_of_every_length_match_their_definition() {
    use grainwake_simd::{Complex, Scalar};
    for n in (1..=130).chain([143, 251]) {
        let given: Vec<[f64; 2]> =
            (0..n).map(|t| [(1.3 * t as f64).sin(), (0.7 * (t * t) as f64).cos()]).collect();
        let plan = axis::Fourier::new(n);
        let len = plan.fft.len;
        let lanes = |values: &[f64]| {
            let mut a = vec![Complex::<Scalar<f64>>::zero(); len];
            for (a, value) in a.iter_mut().zip(values.chunks(2)) {
                (a.re, a.im) = (Scalar::splat(value[0]), Scalar::splat(value[1]));
            }
            a
        };
        let (mut a, mut b) = (lanes(given.as_flattened()), lanes(&[]));
        let [found, _] = plan.run(&mut a, &mut b);
        for (k, found) in found[..n].iter().enumerate() {
            let mut sum = [0.0; 2];
            for (t, [re, im]) in given.iter().enumerate() {
                let [c, s] = root(k * t, n);
                sum[0] += re * c - im * s;
                sum[1] += re * s + im * c;
            }
            let mut out = [0.0; 2];
            found.re.store(&mut out);
            found.im.store(&mut out[1..]);
            let error = (out[0] - sum[0]).hypot(out[1] - sum[1]);
            assert!(error <= 1e-13 * n as f64, "n {n}, k {k}: {error:e}");
        }
    }
}

/// Bits of a solution that meets whole and half blocks of lines, odd lengths and all stages.
fn bits<R: Real>(mesh: &Mesh, ends: [Ends; 3]) -> Vec<u64> {
    let mut state = 3;
    let mut f = Field::<Centre, R>::zeros(mesh);
    f.iter_mut().for_each(|value| *value = R::of(noise(&mut state)));
    let mut poisson = Poisson::new(mesh, ends);
    // The second solve meets what the first has left in the buffers.
    let mut g = f.clone();
    poisson.solve_field(&mut f);
    poisson.solve_field(&mut g);
    assert_eq!(f[..], g[..]);
    f.iter().map(|value| value.wide().to_bits()).collect()
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let mesh = Mesh { cells: [30, 21, 17], spacing: DVec3::ONE, origin: DVec3::ZERO };
    let solve = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let ends = [Ends::Neumann, Ends::Periodic, Ends::Neumann];
        pool.install(|| bits::<f64>(&mesh, ends))
    };
    let one = solve(1);
    assert_eq!(one, solve(2));
    assert_eq!(one, solve(3));
}
