//! Grains that share rows of faces, coupled on several threads. The thread sanitizer and Miri run
//! this test too (`.ci/sanitize.sh`); Miri steps two grains on a small grid.

use glam::DVec3;
use grainwake_shape::Shape;
use grainwake_solver::dem::{ContactParams, Grain};
use grainwake_solver::flow::{Boundary, FluidParams};
use grainwake_solver::grid::Mesh;
use grainwake_solver::immersed::Scheme;
use grainwake_solver::math::Precision;
use grainwake_solver::sim::{Setup, Simulation, StepRule};

/// Spheres of unit diameter on a lattice, each of which overlaps its neighbours a little and falls
/// with another velocity, below a single sphere that touches none.
fn case(precision: Precision, scheme: Scheme) -> Setup {
    let (lattice, cells, across) =
        if cfg!(miri) { ([2, 1, 1], [8, 5, 5], 3) } else { ([3, 3, 2], [24, 20, 30], 5) };
    let (spacing, pitch) = (1.0 / f64::from(across), 0.999);
    let mesh = Mesh::cubic(cells, spacing);
    let shape = Shape::sphere(0.5, if cfg!(miri) { 12 } else { 200 });
    let corner = DVec3::new(0.53, 0.52, 0.51);
    let mut grains = Vec::new();
    for i in 0..lattice[0] {
        for j in 0..lattice[1] {
            for k in 0..lattice[2] {
                let place = DVec3::new(f64::from(i), f64::from(j), f64::from(k));
                let velocity = DVec3::new(0.01, -0.02, -0.03) * (1.0 + place.element_sum());
                let velocity = if cfg!(miri) { DVec3::ZERO } else { velocity };
                grains.push((corner + pitch * place, velocity));
            }
        }
    }
    if !cfg!(miri) {
        grains.push((mesh.extent() - DVec3::splat(0.6), DVec3::ZERO));
    }
    let grains = grains.into_iter().map(|(position, velocity)| {
        Grain::new(shape.clone(), 2.5).with_position(position).with_velocity(velocity)
    });
    // The box is periodic along x, where the lattice ends near the edge.
    Setup::new(mesh)
        .with_boundaries([[Boundary::Periodic; 2], [Boundary::WALL; 2], [Boundary::WALL; 2]])
        .with_fluid(FluidParams::new(1.0, 0.02))
        .with_precision(precision)
        .with_scheme(scheme)
        .with_gravity(DVec3::new(0.0, 0.0, -1.0))
        .with_grains(grains.collect::<Vec<Grain>>())
        .with_contact(ContactParams { normal_stiffness: 50.0, ..ContactParams::default() })
        .with_step(StepRule::Fixed(2e-3))
}

/// State after some steps on this many threads.
fn state(threads: usize, precision: Precision, scheme: Scheme) -> Vec<u8> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let mut sim = Simulation::new(case(precision, scheme)).unwrap();
        for _ in 0..if cfg!(miri) { 1 } else { 5 } {
            sim.step(f64::INFINITY).unwrap();
        }
        assert!(!sim.contacts().is_empty());
        let mut state = Vec::new();
        sim.save(&mut state).unwrap();
        state
    })
}

#[test]
fn sharing_rows_gives_the_same_bits_on_several_threads() {
    if cfg!(miri) {
        // Miri finds races and undefined behaviour in one run.
        state(2, Precision::Double, Scheme::Aperture);
        return;
    }
    for scheme in [Scheme::Aperture, Scheme::Paper] {
        for precision in [Precision::Double, Precision::Single] {
            let one = state(1, precision, scheme);
            for threads in 2..5 {
                let several = state(threads, precision, scheme);
                assert!(several == one, "{scheme:?} {precision:?} {threads}");
            }
        }
    }
}
