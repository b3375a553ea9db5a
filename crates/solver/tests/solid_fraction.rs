//! Solid fraction of cells: its sum is the volume of the grains.

use std::f64::consts::PI;

use glam::{DQuat, DVec3};
use grainwake_shape::{Shape, analytic};
use grainwake_solver::dem::Grain;
use grainwake_solver::flow::{Boundary, FluidParams};
use grainwake_solver::grid::{Axis, Mesh};
use grainwake_solver::sim::{Setup, Simulation, StepRule};

const PERIODIC: [Boundary; 2] = [Boundary::Periodic; 2];
const WALLS: [Boundary; 2] = [Boundary::WALL; 2];

fn grain(shape: Shape, position: DVec3, orientation: DQuat) -> Grain {
    Grain::new(shape, 2.0).with_position(position).with_orientation(orientation)
}

/// Sum of the solid fractions times the cell volume [m^3].
fn solid(cells: [usize; 3], spacing: DVec3, sides: [Boundary; 2], grains: Vec<Grain>) -> f64 {
    let mesh = Mesh { cells, spacing, origin: DVec3::ZERO };
    let setup = Setup::new(mesh)
        .with_boundaries([sides, WALLS, WALLS])
        .with_grains(grains)
        .with_step(StepRule::Fixed(1e-3));
    let sim = Simulation::new(setup).unwrap();
    let mut sum = 0.0;
    for k in 0..cells[2] {
        for j in 0..cells[1] {
            for i in 0..cells[0] {
                let fraction = sim.solid_fraction_at([i, j, k]);
                assert!((0.0..=1.0).contains(&fraction));
                sum += fraction;
            }
        }
    }
    sum * spacing.element_product()
}

fn assert_volume(found: f64, exact: f64, what: &str) {
    let error = found / exact - 1.0;
    assert!(error.abs() < 5e-3, "{what}: {:.2} % off", 100.0 * error);
}

const H: f64 = 0.1;

#[test]
fn fractions_of_a_sphere_sum_to_its_volume() {
    for (cells_across, shift) in [(7.5, 0.0), (7.5, 0.37), (8.0, 0.21)] {
        let radius = 0.5 * cells_across * H;
        let at = DVec3::new(0.6 + shift * H, 0.6 - 0.5 * shift * H, 0.6);
        let ball = grain(Shape::sphere(radius, 200), at, DQuat::IDENTITY);
        let found = solid([12; 3], DVec3::splat(H), WALLS, vec![ball]);
        assert_volume(found, 4.0 / 3.0 * PI * radius.powi(3), "sphere");
    }
}

#[test]
fn fractions_of_a_turned_ellipsoid_sum_to_its_volume() {
    let turn = DQuat::from_rotation_z(0.7) * DQuat::from_rotation_x(0.4);
    let (a, b, c) = (0.52, 0.4, 0.31);
    let shape = || analytic::ellipsoid(a, b, c, &Default::default()).unwrap();
    let exact = 4.0 / 3.0 * PI * a * b * c;
    let middle = DVec3::new(0.63, 0.7, 0.68);
    let found = solid([14; 3], DVec3::splat(H), WALLS, vec![grain(shape(), middle, turn)]);
    assert_volume(found, exact, "ellipsoid");
    // Anisotropic cells, and the grain across a periodic boundary.
    let found = solid(
        [14, 18, 20],
        DVec3::new(0.1, 0.08, 0.07),
        PERIODIC,
        vec![grain(shape(), DVec3::new(0.03, 0.7, 0.68), turn)],
    );
    assert_volume(found, exact, "ellipsoid across the edge");
}

#[test]
fn grains_that_overlap_are_not_counted_twice() {
    let ball = |x: f64| grain(Shape::sphere(0.4, 200), DVec3::new(x, 0.6, 0.6), DQuat::IDENTITY);
    let one = solid([14, 12, 12], DVec3::splat(H), WALLS, vec![ball(0.6)]);
    let both = solid([14, 12, 12], DVec3::splat(H), WALLS, vec![ball(0.6), ball(0.6)]);
    assert!((both / one - 1.0).abs() < 1e-12);
    let (r, half): (f64, f64) = (0.4, 0.1);
    let lens = PI / 12.0 * (4.0 * r + 2.0 * half) * (2.0 * r - 2.0 * half).powi(2);
    let found = solid([14, 12, 12], DVec3::splat(H), WALLS, vec![ball(0.6), ball(0.8)]);
    assert_volume(found, 8.0 / 3.0 * PI * r.powi(3) - lens, "two spheres");
}

/// A rod longer than a periodic box: each cell has the fraction of all images that reach it.
#[test]
fn fractions_of_a_rod_longer_than_a_periodic_box_sum_to_its_volume() {
    let (radius, length) = (0.5, 9.0);
    let turn = DQuat::from_rotation_arc(DVec3::X, DVec3::new(0.913, 0.365, 0.18).normalize());
    let rod = analytic::capsule(radius, length, &Default::default()).unwrap();
    let mesh = Mesh { cells: [24; 3], spacing: DVec3::splat(0.25), origin: DVec3::ZERO };
    let setup = Setup::new(mesh)
        .with_boundaries([PERIODIC; 3])
        .with_fluid(FluidParams::new(1.0, 0.1))
        .with_grains(vec![grain(rod, DVec3::splat(3.0), turn)])
        .with_step(StepRule::Fixed(1e-3));
    let sim = Simulation::new(setup).unwrap();
    let cells = (0..24usize.pow(3)).map(|n| [n % 24, n / 24 % 24, n / 576]);
    let sum: f64 = cells.map(|cell| sim.solid_fraction_at(cell)).sum();
    let volume = PI * radius * radius * (length + 4.0 / 3.0 * radius);
    assert_volume(sum * 0.25_f64.powi(3), volume, "rod");
    // The planes add up to the volume too; that of x = 5.9 cuts the rod twice.
    let planes = (0..240).map(|n| 0.025 * (f64::from(n) + 0.5));
    let areas = planes.map(|x| 36.0 * sim.sample_plane(Axis::X, x).unwrap().solid_fraction);
    assert_volume(0.025 * areas.sum::<f64>(), volume, "planes across the rod");
    // Far from its ends the section of a cylinder is pi r^2 over the cosine of its slope.
    let section = PI * radius * radius / (turn * DVec3::X).x;
    let twice = 36.0 * sim.sample_plane(Axis::X, 5.9).unwrap().solid_fraction;
    assert!((twice / (2.0 * section) - 1.0).abs() < 0.02, "{twice}, not twice {section}");
}
