//! Cases of the benchmark: grains spread evenly over a box of water.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use grainwake_shape::ShapeOptions;
use grainwake_shape::analytic::ellipsoid;
use grainwake_solver::dem::{ContactParams, MotionConstraint, Grain};
use grainwake_solver::flow::{Advection, Boundaries, Boundary, FluidParams};
use grainwake_solver::grid::Mesh;
use grainwake_solver::immersed::Scheme;
use grainwake_solver::math::{Pose, Precision};
use grainwake_solver::sim::{Setup, StepRule};

use crate::exit::{BAD_INPUT, Exit};

/// Benchmark case.
#[derive(Clone, Copy)]
pub struct Load {
    /// Cells along x, y, z.
    pub cells: [usize; 3],
    /// Number of grains.
    pub grains: usize,
    /// Coupling scheme.
    pub scheme: Scheme,
    /// Precision of the fields.
    pub precision: Precision,
}

/// Least number of cells per grain along each axis: its longest axis and two.
const ROOM: usize = 11;

/// Positions of grains on the widest lattice with enough sites, as fractions of the box.
fn places(cells: [usize; 3], grains: usize) -> Result<Vec<DVec3>, Exit> {
    let narrowest = cells.iter().copied().fold(usize::MAX, usize::min);
    let across = |pitch: usize| cells.map(|n| n / pitch);
    let pitch = (ROOM..=narrowest)
        .rev()
        .find(|pitch| across(*pitch).iter().product::<usize>() >= grains);
    let Some(pitch) = pitch else {
        let most = across(ROOM).iter().product::<usize>();
        return Err(Exit::new(
            BAD_INPUT,
            format!(
                "--grains {grains}: at most {most} fit into {cells:?} cells; a larger --size takes more"
            ),
        ));
    };
    let [nx, ny, nz] = across(pitch);
    let total = nx * ny * nz;
    let middle = |n: usize, of: usize| (n as f64 + 0.5) / of as f64;
    // Grains are spread evenly over the sites.
    let all = (0..grains).map(|n| (2 * n + 1) * total / (2 * grains));
    let all = all.map(|n| {
        DVec3::new(
            middle(n % nx, nx),
            middle(n / nx % ny, ny),
            middle(n / nx / ny, nz),
        )
    });
    Ok(all.collect())
}

/// Set-up: sampled grains of eight cells diameter in water.
pub fn setup(load: &Load) -> Result<Setup, Exit> {
    let Load {
        cells,
        grains,
        scheme,
        precision,
    } = *load;
    let spacing = DVec3::splat(0.25e-3);
    let mesh = Mesh {
        cells,
        spacing,
        origin: DVec3::ZERO,
    };
    let radius = 4.0 * spacing.x;
    let axes = [1.1 * radius, radius, radius / 1.1];
    let shape = ellipsoid(axes[0], axes[1], axes[2], &ShapeOptions::default());
    let shape = Arc::new(shape.expect("a plain ellipsoid"));
    let grain = |place: DVec3| Grain {
        shape: shape.clone(),
        density: 1500.0,
        pose: Pose {
            position: mesh.extent() * place,
            // Each grain has its own orientation.
            orientation: DQuat::from_scaled_axis(7.0 * place),
        },
        velocity: DVec3::ZERO,
        angular_velocity: DVec3::ZERO,
        translation: MotionConstraint::Free,
        rotation: MotionConstraint::Free,
    };
    Ok(Setup {
        prescription: Default::default(),
        mesh,
        boundaries: Boundaries([[Boundary::WALL; 2]; 3]),
        fluid: Some(FluidParams {
            density: 1000.0,
            kinematic_viscosity: 1e-6,
            body_acceleration: DVec3::ZERO,
            initial_velocity: DVec3::ZERO,
            advection: Advection::Central,
        }),
        precision,
        scheme,
        gravity: DVec3::new(0.0, 0.0, -9.81),
        grains: places(cells, grains)?.into_iter().map(grain).collect(),
        contact: ContactParams::default(),
        step: StepRule::Limits {
            cfl: 0.3,
            viscous: 0.2,
            max_step: 1e-3,
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grains_have_room_and_are_spread_evenly() {
        for (cells, grains) in [([100, 100, 390], 2), ([64, 64, 64], 100), ([200; 3], 1000)] {
            let Ok(places) = places(cells, grains) else {
                panic!("no room for {grains} in {cells:?}");
            };
            let size = DVec3::from_array(cells.map(|n| n as f64));
            assert_eq!(places.len(), grains);
            for (n, p) in places.iter().enumerate() {
                let others = places[..n].iter().map(|q| ((*p - *q) * size).length());
                assert!(others.fold(f64::INFINITY, f64::min) >= ROOM as f64);
            }
            let mean = places.iter().sum::<DVec3>() / grains as f64;
            assert!((mean - DVec3::splat(0.5)).length() < 0.06, "{mean}");
        }
        assert!(places([24, 24, 48], 17).is_err());
    }
}
