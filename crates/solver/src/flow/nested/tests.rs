//! Flow through a refined box.

use std::f64::consts::TAU;

use super::*;
use crate::flow::{Boundaries, Boundary};
use crate::grid::Mesh;

const PERIODIC: [Boundary; 2] = [Boundary::Periodic; 2];
const BOX: RefinedBox = RefinedBox { corner: [5, 4, 6], cells: [6, 8, 5] };

/// Flow with a start velocity `component(axis, position)` in a cube of edge 1 with `n` cells along
/// each axis, and a refined box.
fn nested(
    n: usize,
    boundaries: Boundaries,
    nu: f64,
    place: RefinedBox,
    component: impl Fn(usize, DVec3) -> f64,
) -> NestedFlow {
    let params = FluidParams::new(1.0, nu);
    let mesh = Mesh::cubic([n; 3], 1.0 / n as f64);
    let mut whole = Flow::new(&mesh, boundaries, &params);
    whole.start_from(component);
    let mut flow = NestedFlow::new(whole, &params);
    flow.refine(place);
    flow.make_solenoidal();
    flow
}

/// Largest difference and root mean square of the difference of the velocity on the faces of a grid
/// from `exact`.
fn errors(flow: &Flow, exact: impl Fn(usize, DVec3) -> f64) -> [f64; 2] {
    let (mesh, mut largest, mut squares) = (flow.mesh(), 0.0_f64, 0.0);
    let offsets = crate::grid::FACE_OFFSET;
    let [nx, ny, nz] = mesh.cells;
    for axis in 0..3 {
        for k in 1..=nz {
            for j in 1..=ny {
                for i in 1..=nx {
                    let value = flow.velocity.component(axis)[mesh.layout().index(i, j, k)];
                    let x = mesh.position(offsets[axis], [i, j, k]);
                    let difference = (value - exact(axis, x)).abs();
                    largest = largest.max(difference);
                    squares += difference * difference;
                }
            }
        }
    }
    [largest, (squares / (3 * mesh.cell_count()) as f64).sqrt()]
}

fn advance(flow: &mut NestedFlow, dt: f64, steps: usize) {
    for _ in 0..steps {
        flow.predict(dt);
        let measures = flow.project(dt);
        assert!(measures.max_divergence < 1e-11 * measures.max_rate, "{measures:?}");
    }
}

#[test]
fn shear_between_walls_passes_through_unchanged() {
    let lid = Boundary::Wall { velocity: DVec3::new(1.0, 0.5, 0.0) };
    let boundaries = Boundaries([PERIODIC, PERIODIC, [Boundary::WALL, lid]]);
    let exact = |axis: usize, x: DVec3| [x.z, 0.5 * x.z, 0.0][axis];
    // Inside, across a periodic side, on a wall, and as wide as the box.
    for (corner, cells) in
        [([5, 4, 6], [6, 8, 5]), ([-3, 14, 0], [6, 8, 5]), ([0, 0, 10], [16, 16, 6])]
    {
        let mut flow = nested(16, boundaries, 0.01, RefinedBox { corner, cells }, exact);
        advance(&mut flow, 0.02, 20);
        for (grid, flow) in flow.flows().enumerate() {
            let [error, _] = errors(flow, exact);
            assert!(error < 1e-12, "grid {grid}, box at {corner:?}: {error:e}");
        }
    }
}

/// Decaying vortices that a stream carries across the grid along all axes.
fn vortices(time: f64, nu: f64) -> impl Fn(usize, DVec3) -> f64 {
    let stream = DVec3::new(0.3, 0.2, 0.4);
    move |axis, x| {
        let y = TAU * (x - stream * time);
        let decay = (-2.0 * TAU * TAU * nu * time).exp();
        let vortex = [y.x.sin() * y.y.cos(), -y.x.cos() * y.y.sin(), 0.0][axis];
        stream[axis] + decay * vortex
    }
}

/// Mean errors on the whole and on the refined grid after `time`, with a box that moves by `shift`
/// cells along all axes every eight steps.
fn vortex_errors(n: usize, time: f64, shift: isize) -> Vec<f64> {
    let (nu, steps) = (0.01, 8 * n);
    let half = n / 2;
    let mut place = RefinedBox { corner: [n as isize / 4; 3], cells: [half; 3] };
    let mut flow = nested(n, Boundaries([PERIODIC; 3]), nu, place, vortices(0.0, nu));
    for step in 0..steps {
        advance(&mut flow, time / steps as f64, 1);
        if step % 8 == 7 && shift != 0 {
            place.corner = place.corner.map(|c| c + shift);
            flow.refine(place);
        }
    }
    flow.flows().map(|flow| errors(flow, vortices(time, nu))[1]).collect()
}

#[test]
fn vortices_through_a_box_at_rest_and_in_motion_converge_with_second_order() {
    for shift in [0, 1] {
        let [coarse, fine] = [16, 32].map(|n| vortex_errors(n, 0.5, shift));
        for (coarse, fine) in coarse.iter().zip(&fine) {
            let order = (coarse / fine).log2();
            println!("shift {shift}: {coarse:.2e} {fine:.2e} order {order:.2}");
            assert!(order > 1.8, "{coarse:e} to {fine:e}: order {order}");
        }
    }
}

#[test]
fn the_refined_grid_gives_the_means_of_the_whole_grid() {
    let nu = 0.01;
    let mut flow = nested(16, Boundaries([PERIODIC; 3]), nu, BOX, vortices(0.0, nu));
    advance(&mut flow, 0.005, 5);
    let (whole, fine) = (&flow.whole, flow.finest());
    let [from, to] = [fine, whole].map(|flow| flow.mesh().layout());
    let mut compared = 0;
    for axis in 0..3 {
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3].map(|axis| from.strides()[axis]);
        let [u, v] = [fine, whole].map(|flow| flow.velocity.component(axis));
        for k in 0..BOX.cells[2] {
            for j in 0..BOX.cells[1] {
                for i in 0..BOX.cells[0] {
                    let at = from.index(2 * i + 1, 2 * j + 1, 2 * k + 1);
                    let mean = 0.25 * (u[at] + u[at + a] + u[at + b] + u[at + a + b]);
                    let [x, y, z] = [i, j, k]
                        .iter()
                        .zip(BOX.corner)
                        .map(|(c, corner)| c + corner as usize + 1)
                        .collect::<Vec<_>>()[..]
                    else {
                        panic!()
                    };
                    assert!(
                        (mean - v[to.index(x, y, z)]).abs() < 1e-13,
                        "component {axis} at {i} {j} {k}"
                    );
                    compared += 1;
                }
            }
        }
    }
    assert_eq!(compared, 3 * 6 * 8 * 5);
}

#[test]
fn a_refined_box_begins_with_the_divergence_of_the_whole_grid() {
    let nu = 0.01;
    let mut flow = nested(16, Boundaries([PERIODIC; 3]), nu, BOX, vortices(0.0, nu));
    // Noise of the size of a cell, made divergence-free on the whole grid.
    let mut state = 7_u64;
    for axis in 0..3 {
        for value in flow.whole.velocity.component_mut(axis).iter_mut() {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            *value += (state >> 11) as f64 / (1u64 << 53) as f64;
        }
    }
    flow.whole.make_solenoidal();
    flow.refine(RefinedBox { corner: [-9, 1, 11], cells: [6, 8, 5] });
    let (u, mesh) = (&flow.finest().velocity, flow.finest().mesh());
    let (layout, h) = (mesh.layout(), mesh.spacing.x);
    let mut largest = 0.0_f64;
    for k in 1..=mesh.cells[2] {
        for j in 1..=mesh.cells[1] {
            for i in 1..=mesh.cells[0] {
                let flux = |axis: usize| {
                    let at = layout.index(i, j, k);
                    let q = u.component(axis);
                    q[at + layout.strides()[axis]] - q[at]
                };
                largest = largest.max((flux(0) + flux(1) + flux(2)).abs() / h);
            }
        }
    }
    assert!(largest < 1e-10, "divergence {largest:e}");
}
