//! What happens to the grains: kiss, tumbling, role change, separation, landing.
//!
//! Pure logic on positions, contacts and the gap of a pair; it neither moves nor writes anything.
//! The states of a pair (exactly two grains) follow the paper: drafting until the first contact,
//! kissing until the line of centres has turned far from the vertical, tumbling until the grains
//! part for good, separated until they touch again.

mod tracker;

use glam::DVec3;
use serde::{Deserialize, Serialize};

pub use grainwake_formats::events::{Event, EventKind};

use crate::dem::{Dof, Grain};

pub use tracker::{Tracker, TrackerState};

/// What ends a run early.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StopWhen {
    /// Every free grain has touched the floor.
    Landing,
    /// Every free grain touches something and lies still.
    Rest,
    /// The pair has parted after kissing.
    Separation,
}

/// State of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Not yet in contact.
    Drafting,
    /// In contact, one above the other.
    Kissing,
    /// Turning about each other.
    Tumbling,
    /// Parted.
    Separated,
}

impl Phase {
    /// Name as written in files.
    pub fn name(self) -> &'static str {
        match self {
            Phase::Drafting => "drafting",
            Phase::Kissing => "kissing",
            Phase::Tumbling => "tumbling",
            Phase::Separated => "separated",
        }
    }
}

/// Thresholds. `for_grains` chooses them from the grains and gravity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventParams {
    /// Unit vector the way the grains settle: along gravity, or against it if all free grains are
    /// lighter than the fluid; -z without gravity.
    pub down: DVec3,
    /// The face that grains land on: axis and side.
    pub floor: (u8, u8),
    /// Period of the box along periodic axes [m].
    pub period: [Option<f64>; 3],
    /// A pair has parted beyond this gap [m].
    pub separation_gap: f64,
    /// ... held without contact this long [s].
    pub separation_hold: f64,
    /// Tumbling begins at this angle of the line of centres from the vertical [rad].
    pub tumble_angle: f64,
    /// A role change counts beyond this difference in height [m].
    pub role_margin: f64,
    /// A grain lies still below this speed of its fastest point [m/s].
    pub rest_speed: f64,
}

impl EventParams {
    /// Separation beyond 0.05 d for sqrt(d/g), tumbling from 45 degrees, role change beyond
    /// 0.02 d, rest below 0.001 sqrt(g d); d is the mean equal-volume diameter.
    pub fn for_grains(
        grains: &[Grain],
        gravity: DVec3,
        fluid_density: f64,
        period: [Option<f64>; 3],
    ) -> EventParams {
        let mut free = grains
            .iter()
            .filter(|grain| grain.translation == Dof::Free)
            .peekable();
        let rise = free.peek().is_some() && free.all(|grain| grain.density < fluid_density);
        let down = gravity.try_normalize().unwrap_or(DVec3::NEG_Z);
        let down = if rise && gravity != DVec3::ZERO {
            -down
        } else {
            down
        };
        let magnitude = down.abs();
        let axis = if magnitude.z >= magnitude.x && magnitude.z >= magnitude.y {
            2
        } else if magnitude.y >= magnitude.x {
            1
        } else {
            0
        };
        let d = grains
            .iter()
            .map(|g| g.shape.equivalent_diameter())
            .sum::<f64>()
            / grains.len().max(1) as f64;
        let g = gravity.length();
        EventParams {
            down,
            floor: (axis as u8, u8::from(down[axis] > 0.0)),
            period,
            separation_gap: 0.05 * d,
            separation_hold: if g > 0.0 { (d / g).sqrt() } else { 0.0 },
            tumble_angle: std::f64::consts::FRAC_PI_4,
            role_margin: 0.02 * d,
            rest_speed: 1e-3 * (g * d).sqrt(),
        }
    }
}
