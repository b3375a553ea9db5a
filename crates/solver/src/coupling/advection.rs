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
use rayon::prelude::*;

use super::aperture::aperture;
use super::locate::Body;
use crate::dem::Grain;
use crate::flow::Flow;
use crate::grid::FACE_OFFSET;
use crate::math::Real;

/// Smallest aperture divided by; smaller ones are unstable on an impulsive start.
const LEAST_APERTURE: f64 = 0.4;

/// A correction of the flux from one face to the next, over the length of the link [m/s^2].
#[derive(Clone, Copy, Debug)]
pub struct Link {
    from: usize,
    to: usize,
    flux: f64,
}

/// Corrects the tendency of the step just predicted; `bodies` are where `grains` were located, in a
/// band of half-width `band` [m].
pub fn correct<R: Real>(band: f64, flow: &mut Flow<R>, grains: &[Grain], bodies: &mut [Body]) {
    let flow_before = &*flow;
    let each = bodies.par_iter_mut().zip(grains);
    each.for_each(|(body, grain)| {
        let mut links = std::mem::take(&mut body.links);
        for (component, links) in links.iter_mut().enumerate() {
            links.clear();
            for along in (0..3).filter(|&axis| flow_before.mesh().cells[axis] > 1) {
                correct_links(band, flow_before, grain, body, component, along, links);
            }
        }
        body.links = links;
    });
    let bodies = &*bodies;
    flow.add_tendency(|component, add| {
        for link in bodies.iter().flat_map(|body| &body.links[component]) {
            add(link.from, -link.flux);
            add(link.to, link.flux);
        }
    });
}

/// Links of `component` along one axis.
fn correct_links<R: Real>(
    band: f64,
    flow: &Flow<R>,
    grain: &Grain,
    body: &Body,
    component: usize,
    along: usize,
    links: &mut Vec<Link>,
) {
    let mesh = *flow.mesh();
    let across = mesh.layout().strides()[component];
    let step = IVec3::AXES[along];
    let inverse = 1.0 / mesh.spacing[along];
    let middle = DVec3::from_array(FACE_OFFSET[component]) + 0.5 * step.as_dvec3() - 1.0;
    let last = body.size - step;
    let next = body.local(step.x, step.y, step.z);
    let (carried, carrying) = (
        flow.velocity.component(component),
        flow.velocity.component(along),
    );
    let (q, c) = (
        |at: usize| carried[at].wide(),
        |at: usize| carrying[at].wide(),
    );
    for k in 0..last.z {
        for j in 0..last.y {
            let row = body.local(0, j, k);
            for i in 0..last.x {
                let here = row + i as usize;
                let d = 0.5
                    * (body.own_distance(component, here)
                        + body.own_distance(component, here + next));
                if d >= 2.0 * band || d <= -band {
                    continue;
                }
                let place = IVec3::new(i, j, k);
                let face = |shift: i32| body.places.at(component, place + shift * step);
                let (Some(from), Some(to)) = (face(0), face(1)) else {
                    continue;
                };
                let mean = 0.5 * (q(from) + q(to));
                let carrier = if along == component {
                    mean
                } else {
                    // Two faces of the carrying component share the link.
                    0.5 * (c(to) + c(to - across))
                };
                let mut flux = 0.0;
                if d < band {
                    let cell = (body.first + place).as_dvec3();
                    let rigid = grain.velocity_at(mesh.origin + mesh.spacing * (cell + middle));
                    let relative = (carrier - rigid[along]) * (mean - rigid[component]);
                    flux += relative * (1.0 / aperture(d, band).max(LEAST_APERTURE) - 1.0);
                }
                if let (Some(a), Some(b), Some(y), Some(z)) = (face(-2), face(-1), face(2), face(3))
                {
                    let sixth = 7.0 * (q(from) + q(to)) - 8.0 * (q(b) + q(y)) + q(a) + q(z);
                    flux += carrier * sixth / 60.0;
                }
                let flux = flux * inverse;
                links.push(Link { from, to, flux });
            }
        }
    }
}
