//! Advection through partly closed links near a grain.
//!
//! A face value near the surface stands for its open part only, q = A u, so a link's product of two
//! such values carries A^2 u u where the flux is A u u: the part relative to the grain is divided
//! by the aperture of the link. The correction is a flux between two faces, so it moves no
//! momentum in or out.

use glam::{DVec3, IVec3};

use super::aperture::aperture;
use super::locate::{Body, Locator};
use crate::dem::Grain;
use crate::flow::Flow;
use crate::grid::FACE_OFFSET;

/// Smallest aperture divided by; smaller ones are unstable on an impulsive start.
const LEAST_APERTURE: f64 = 0.4;

/// Corrects the tendency of the step just predicted; `bodies` are where `grains` were located.
pub fn open_links(locator: &Locator, flow: &mut Flow, grains: &[Grain], bodies: &[Body]) {
    for (grain, body) in grains.iter().zip(bodies) {
        open_links_of(locator, flow, grain, body);
    }
}

fn open_links_of(locator: &Locator, flow: &mut Flow, grain: &Grain, body: &Body) {
    let (eps, unknowns) = (locator.band(), locator.unknowns());
    let mesh = *flow.mesh();
    let strides = mesh.layout().strides();
    for component in 0..3 {
        let distance = &body.distance[component];
        for along in 0..3 {
            if mesh.cells[along] == 1 {
                continue;
            }
            let mut step = IVec3::ZERO;
            step[along] = 1;
            let inverse = 1.0 / mesh.spacing[along];
            let last = body.size - step;
            for k in 0..last.z {
                for j in 0..last.y {
                    for i in 0..last.x {
                        let here = IVec3::new(i, j, k);
                        let there = here + step;
                        let d = 0.5
                            * (distance[body.local(i, j, k)] + distance[body.local(there.x, there.y, there.z)]);
                        if d >= eps || d <= -eps {
                            continue;
                        }
                        let cell = body.first + here;
                        let (from, to) = (unknowns.at(component, cell), unknowns.at(component, cell + step));
                        let (Some(from), Some(to)) = (from, to) else { continue };
                        let q = flow.velocity.component(component);
                        let through = flow.velocity.component(along);
                        let mean = 0.5 * (q[from] + q[to]);
                        // Two faces of the advecting component share the link: the one of the
                        // target cell and its neighbour across the component's own face.
                        let carrier =
                            if along == component { mean } else { 0.5 * (through[to] + through[to - strides[component]]) };
                        let x = mesh.origin
                            + mesh.spacing
                                * (cell.as_dvec3() - 1.0 + DVec3::from_array(FACE_OFFSET[component]) + 0.5 * step.as_dvec3());
                        let rigid = grain.velocity_at(x);
                        let relative = (carrier - rigid[along]) * (mean - rigid[component]);
                        let flux = relative * (1.0 / aperture(d, eps).max(LEAST_APERTURE) - 1.0) * inverse;
                        flow.add_tendency(component, from, -flux);
                        flow.add_tendency(component, to, flux);
                    }
                }
            }
        }
    }
}
