//! Advection next to a grain, mended where central differences are at their worst.
//!
//! 1. A face value near the surface stands for its open part only, q = A u, so a link's product of
//!    two such values carries A^2 u u where the flux is A u u: the part relative to the grain is
//!    divided by the aperture of the link.
//! 2. The boundary layer is about a cell thick and moves with the grain. Second-order central
//!    differences carry such a profile at about two thirds of its speed; within two cells of the
//!    surface the mean of two faces gives way to the sixth-order mean of six.
//!
//! Both are fluxes between two faces, so they move no momentum in or out
//! (`docs/decisions/0003-advection-next-to-grains.md` has the measurements).
//!
//! Legend: q component carried, c velocity that carries it, d signed distance of a link.

use glam::{DVec3, IVec3};

use super::aperture::aperture;
use super::locate::{Body, Locator};
use crate::dem::Grain;
use crate::flow::Flow;
use crate::grid::FACE_OFFSET;

/// Smallest aperture divided by; smaller ones are unstable on an impulsive start.
const LEAST_APERTURE: f64 = 0.4;

/// Corrects the tendency of the step just predicted; `bodies` are where `grains` were located.
pub fn correct(locator: &Locator, flow: &mut Flow, grains: &[Grain], bodies: &[Body]) {
    let cells = flow.mesh().cells;
    for (grain, body) in grains.iter().zip(bodies) {
        for component in 0..3 {
            for along in (0..3).filter(|&axis| cells[axis] > 1) {
                correct_links(locator, flow, grain, body, component, along);
            }
        }
    }
}

/// Links of `component` along one axis.
fn correct_links(
    locator: &Locator,
    flow: &mut Flow,
    grain: &Grain,
    body: &Body,
    component: usize,
    along: usize,
) {
    let (band, unknowns) = (locator.band(), locator.unknowns());
    let mesh = *flow.mesh();
    let across = mesh.layout().strides()[component];
    let step = IVec3::AXES[along];
    let inverse = 1.0 / mesh.spacing[along];
    let middle = DVec3::from_array(FACE_OFFSET[component]) + 0.5 * step.as_dvec3() - 1.0;
    let last = body.size - step;
    for k in 0..last.z {
        for j in 0..last.y {
            for i in 0..last.x {
                let there = IVec3::new(i, j, k) + step;
                let d = 0.5
                    * (body.own_distance(component, body.local(i, j, k))
                        + body.own_distance(component, body.local(there.x, there.y, there.z)));
                if d >= 2.0 * band || d <= -band {
                    continue;
                }
                let cell = body.first + IVec3::new(i, j, k);
                let face = |shift: i32| unknowns.at(component, cell + shift * step);
                let (Some(from), Some(to)) = (face(0), face(1)) else {
                    continue;
                };
                let q = flow.velocity.component(component);
                let mean = 0.5 * (q[from] + q[to]);
                let carrier = if along == component {
                    mean
                } else {
                    // Two faces of the carrying component share the link.
                    let c = flow.velocity.component(along);
                    0.5 * (c[to] + c[to - across])
                };
                let mut flux = 0.0;
                if d < band {
                    let rigid =
                        grain.velocity_at(mesh.origin + mesh.spacing * (cell.as_dvec3() + middle));
                    let relative = (carrier - rigid[along]) * (mean - rigid[component]);
                    flux += relative * (1.0 / aperture(d, band).max(LEAST_APERTURE) - 1.0);
                }
                if let (Some(a), Some(b), Some(y), Some(z)) = (face(-2), face(-1), face(2), face(3))
                {
                    let sixth = 7.0 * (q[from] + q[to]) - 8.0 * (q[b] + q[y]) + q[a] + q[z];
                    flux += carrier * sixth / 60.0;
                }
                flow.add_tendency(component, from, -flux * inverse);
                flow.add_tendency(component, to, flux * inverse);
            }
        }
    }
}
