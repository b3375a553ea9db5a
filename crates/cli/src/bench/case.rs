//! Cases of the benchmark: grains spread evenly over a box of water.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use grainwake_shape::ShapeOptions;
use grainwake_shape::analytic::ellipsoid;
use grainwake_solver::dem::Grain;
use grainwake_solver::flow::FluidParams;
use grainwake_solver::grid::Mesh;
use grainwake_solver::immersed::Scheme;
use grainwake_solver::math::Precision;
use grainwake_solver::sim::{Setup, StepRule};

use crate::exit::Exit;

/// Cells that a grain takes along each axis: its longest axis and two.
const CELLS_PER_GRAIN: usize = 11;

/// Positions of grains on the coarsest lattice with enough points, as fractions of the box.
fn positions(cells: [usize; 3], grains: usize) -> Result<Vec<DVec3>, Exit> {
    let narrowest = cells.iter().copied().fold(usize::MAX, usize::min);
    let across = |pitch: usize| cells.map(|n| n / pitch);
    let pitch = (CELLS_PER_GRAIN..=narrowest)
        .rev()
        .find(|pitch| across(*pitch).iter().product::<usize>() >= grains);
    let Some(pitch) = pitch else {
        let most = across(CELLS_PER_GRAIN).iter().product::<usize>();
        return Err(Exit::input(format!(
            "--grains {grains}: at most {most} fit into {cells:?} cells; a larger --size takes more"
        )));
    };
    let [nx, ny, nz] = across(pitch);
    let total = nx * ny * nz;
    let middle = |n: usize, of: usize| (n as f64 + 0.5) / of as f64;
    // Grains are spread evenly over the lattice points.
    let all = (0..grains).map(|n| (2 * n + 1) * total / (2 * grains));
    let all = all
        .map(|n| DVec3::new(middle(n % nx, nx), middle(n / nx % ny, ny), middle(n / nx / ny, nz)));
    Ok(all.collect())
}

/// Returns a set-up of sampled grains of eight cells diameter in water.
pub fn setup(
    cells: [usize; 3],
    grains: usize,
    scheme: Scheme,
    precision: Precision,
) -> Result<Setup, Exit> {
    let spacing = 0.25e-3;
    let mesh = Mesh::cubic(cells, spacing);
    let radius = 4.0 * spacing;
    let axes = [1.1 * radius, radius, radius / 1.1];
    let shape = ellipsoid(axes[0], axes[1], axes[2], &ShapeOptions::default());
    let shape = Arc::new(shape.expect("a plain ellipsoid"));
    let grain = |position: DVec3| {
        // Every grain has its own orientation.
        let orientation = DQuat::from_scaled_axis(7.0 * position);
        Grain::new(shape.clone(), 1500.0)
            .with_position(mesh.extent() * position)
            .with_orientation(orientation)
    };
    Ok(Setup::new(mesh)
        .with_fluid(FluidParams::new(1000.0, 1e-6))
        .with_precision(precision)
        .with_scheme(scheme)
        .with_gravity(DVec3::new(0.0, 0.0, -9.81))
        .with_grains(positions(cells, grains)?.into_iter().map(grain))
        .with_step(StepRule::Limits { cfl: 0.3, viscous: 0.2, max_step: 1e-3 }))
}
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grains_do_not_overlap_and_are_spread_evenly() {
        for (cells, grains) in [([100, 100, 390], 2), ([64, 64, 64], 100), ([200; 3], 1000)] {
            let Ok(positions) = positions(cells, grains) else {
                panic!("no room for {grains} in {cells:?}");
            };
            let size = DVec3::from_array(cells.map(|n| n as f64));
            assert_eq!(positions.len(), grains);
            for (n, p) in positions.iter().enumerate() {
                let others = positions[..n].iter().map(|q| ((*p - *q) * size).length());
                assert!(others.fold(f64::INFINITY, f64::min) >= CELLS_PER_GRAIN as f64);
            }
            let mean = positions.iter().sum::<DVec3>() / grains as f64;
            assert!((mean - DVec3::splat(0.5)).length() < 0.06, "{mean}");
        }
        assert!(positions([24, 24, 48], 17).is_err());
    }
}
