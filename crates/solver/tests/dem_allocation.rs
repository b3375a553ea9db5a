//! No allocation in a sub-step once the buffers have grown.

#[path = "dem/clouds.rs"]
mod clouds;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use clouds::{cloud, step, weights};
use glam::DVec3;
use grainwake_solver::dem::{
    ContactDynamics, ContactParams, Enclosure, Grain, GrainResponse, RigidState, Side,
};
use grainwake_solver::math::Load;

struct Counting;

static COUNT: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is forwarded to the system allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        unsafe { System.dealloc(at, layout) }
    }
    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn a_heap_at_rest_steps_without_allocating() {
    let tank = Enclosure {
        lower: DVec3::splat(-0.05),
        upper: DVec3::new(0.05, 0.05, 0.2),
        periodic: [true, false, false],
        sides: [[Side::Open; 2], [Side::WALL; 2], [Side::WALL, Side::Open]],
    };
    let params = ContactParams {
        normal_stiffness: 500.0,
        restitution: 0.3,
        global_damping: 5.0,
        ..Default::default()
    };
    let mut grains = cloud(80, 0.043, 0.007, 0.1, 3);
    let mut dynamics = ContactDynamics::new(params, tank);
    let gravity = DVec3::new(0.0, 0.0, -9.81);
    for _ in 0..800 {
        step(&mut dynamics, &mut grains, gravity, 1e-3);
    }
    let loads = weights(&grains, gravity);
    let mut mean = vec![Load::default(); grains.len()];
    let before = COUNT.load(Ordering::Relaxed);
    let mut substeps = 0;
    for _ in 0..50 {
        substeps += dynamics.advance(&mut grains, &loads, 1e-3, &mut mean);
    }
    let count = COUNT.load(Ordering::Relaxed) - before;
    println!("{count} allocations in {substeps} sub-steps, {} contacts", dynamics.contacts().len());
    assert!(dynamics.contacts().len() > 80);
    assert!(count * 20 < substeps, "{count} allocations in {substeps} sub-steps");

    // One allocation in each step exceeds the bound.
    let mut ends: Vec<_> = grains.iter().map(RigidState::of).collect();
    let mut responses = Vec::with_capacity(grains.len());
    let mut before = 0;
    for n in 0..55 {
        if n == 5 {
            before = COUNT.load(Ordering::Relaxed);
        }
        responses.clear();
        responses.extend(grains.iter().map(|grain| response(grain, gravity)));
        let trial = dynamics.trial_step(&mut grains, &loads, 1e-3, &mut mean);
        dynamics.resolve_with_response(trial, &mut grains, &responses, &mut mean, &mut ends);
        for (grain, end) in grains.iter_mut().zip(&ends) {
            end.apply_to(grain);
        }
    }
    let count = COUNT.load(Ordering::Relaxed) - before;
    println!("{count} allocations in 50 repeated steps");
    assert!(dynamics.contacts().len() > 80);
    assert!(count < 50, "{count} allocations in 50 repeated steps");
}

/// Response of a sphere to contact without fluid.
fn response(grain: &Grain, gravity: DVec3) -> GrainResponse {
    let [mass, inertia] = [grain.mass(), grain.principal_inertia().x];
    let mut inverse = [[0.0; 6]; 6];
    for (n, row) in inverse.iter_mut().enumerate() {
        row[n] = 1.0 / if n < 3 { mass } else { inertia };
    }
    let [x, y, z] = (mass * gravity).to_array();
    GrainResponse::new(grain.rigid_velocity(), [x, y, z, 0.0, 0.0, 0.0], inverse)
}
