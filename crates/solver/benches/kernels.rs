//! Kernels that `grainwake bench` does not take apart: distances of a sampled grain, and contact in
//! a packed heap. `cargo bench -p grainwake-solver`.

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{DQuat, DVec3};
use grainwake_shape::{Shape, ShapeOptions, analytic};
use grainwake_solver::dem::{ContactDynamics, ContactParams, Enclosure, Grain};
use grainwake_solver::math::Load;

const DIAMETER: f64 = 2e-3;
/// Grains along each edge of the heap.
const EDGE: usize = 6;
/// Between neighbours in the heap, in diameters: they overlap a little.
const APART: f64 = 0.985;

/// A sampled grain, not quite a sphere, as fine as those of the study.
fn grain() -> Shape {
    let r = 0.5 * DIAMETER;
    analytic::ellipsoid(1.05 * r, r, r / 1.05, &ShapeOptions::default()).expect("a plain ellipsoid")
}

/// Points that fill a cube about the origin evenly.
fn points(half: f64, count: usize) -> Vec<DVec3> {
    let step = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779);
    (0..count).map(|i| half * (2.0 * (step * i as f64).fract() - 1.0)).collect()
}

fn distances(c: &mut Criterion) {
    let shape = grain();
    let near = points(0.5 * DIAMETER, 4096);
    let around = points(DIAMETER, 4096);
    let mut group = c.benchmark_group("distance of a sampled grain");
    group.throughput(Throughput::Elements(near.len() as u64));
    group.bench_function("on its grid", |b| {
        b.iter(|| near.iter().map(|x| shape.distance(*x)).sum::<f64>())
    });
    group.bench_function("with its gradient", |b| {
        b.iter(|| {
            let all = near.iter().map(|x| shape.distance_and_gradient(*x));
            all.map(|(d, n)| d + n.x).sum::<f64>()
        })
    });
    group.bench_function("around it, up to a third of d", |b| {
        b.iter(|| {
            let all = around.iter().map(|x| shape.distance_within(*x, DIAMETER / 3.0));
            all.filter(|d| d.is_finite()).sum::<f64>()
        })
    });
    group.finish();
}

/// Grains on a cubic lattice, turned at random and pressed together.
fn heap() -> (ContactDynamics, Vec<Grain>) {
    let shape = Arc::new(grain());
    let size = EDGE as f64 * APART * DIAMETER;
    let mut grains = Vec::new();
    for (n, u) in points(1.0, EDGE.pow(3)).into_iter().enumerate() {
        let cell =
            DVec3::new((n % EDGE) as f64, (n / EDGE % EDGE) as f64, (n / EDGE / EDGE) as f64);
        let grain = Grain::new(shape.clone(), 2500.0)
            .with_position((cell + 0.5) * APART * DIAMETER)
            .with_orientation(DQuat::from_scaled_axis(3.0 * u));
        grains.push(grain);
    }
    let enclosure = Enclosure {
        lower: DVec3::ZERO,
        upper: DVec3::splat(size),
        periodic: [true; 3],
        sides: Default::default(),
    };
    (ContactDynamics::new(ContactParams::default(), enclosure), grains)
}

/// Nodes of both grains of every pair in touch count as tested, in every sub-step.
fn contact(c: &mut Criterion) {
    let (mut dynamics, mut grains) = heap();
    let mut mean = vec![Load::default(); grains.len()];
    // A step far shorter than a contact: one sub-step, and the heap stays as it is.
    let step = 1e-9;
    let substeps = dynamics.advance(&mut grains, &[], step, &mut mean);
    let nodes = grains[0].shape.nodes().len();
    let pairs = dynamics.contacts().len();
    let tested = 2 * nodes * pairs * substeps;
    println!(
        "{} grains of {nodes} nodes, {pairs} contacts, {substeps} sub-steps per step",
        grains.len()
    );
    let mut group = c.benchmark_group("contact in a packed heap");
    group.sample_size(20);
    group.throughput(Throughput::Elements(tested as u64));
    group.bench_function("surface nodes", |b| {
        b.iter(|| black_box(dynamics.advance(&mut grains, &[], step, &mut mean)))
    });
    group.finish();
}

criterion_group!(kernels, distances, contact);
criterion_main!(kernels);
