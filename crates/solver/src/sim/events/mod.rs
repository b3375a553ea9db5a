//! Events of the grains: kiss, tumbling, role change, separation, landing.
//!
//! Events depend on positions, contacts and the gap of a pair alone. The phases of a pair (exactly
//! two grains) follow the paper: drafting until the first contact, kissing until the line of
//! centres has turned far from the vertical, tumbling until the grains stay apart, separated until
//! they touch again.

mod pair;
#[cfg(test)]
mod tests;
mod tracker;

use glam::DVec3;
use serde::{Deserialize, Serialize};

pub use grainwake_formats::events::{Event, EventKind};

use crate::dem::{Enclosure, Grain, MotionConstraint};

pub use tracker::{Tracker, TrackerState};

/// Condition that ends a run early.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StopWhen {
    /// Every free grain has touched the floor.
    Landing,
    /// Every free grain has contact and is at rest.
    Rest,
    /// The pair has separated after a kiss.
    Separation,
}

/// Phase of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Not yet in contact.
    Drafting,
    /// In contact, one above the other.
    Kissing,
    /// Rotating about each other.
    Tumbling,
    /// Apart after contact.
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

/// Thresholds of the events; [`EventParams::for_grains`] derives them from grains and gravity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventParams {
    /// Settling direction, a unit vector: along gravity, or against it if all free grains are
    /// lighter than the fluid; -z without gravity.
    pub down: DVec3,
    /// Face of the box on which grains land: axis and side.
    pub floor: (u8, u8),
    /// Box, for the nearest images along periodic axes.
    pub enclosure: Enclosure,
    /// Smallest gap of a separated pair [m].
    pub separation_gap: f64,
    /// Time without contact after which a pair counts as separated [s].
    pub separation_hold: f64,
    /// Angle between line of centres and vertical at which tumbling begins [rad]; infinite without
    /// gravity, where there is no vertical.
    pub tumble_angle: f64,
    /// Difference in height that confirms a role change [m].
    pub role_margin: f64,
    /// Largest speed of the fastest point of a grain at rest [m/s].
    pub rest_speed: f64,
}

impl EventParams {
    /// Default thresholds: separation beyond 0.05 d for sqrt(d/g), tumbling from 45 degrees, role
    /// change beyond 0.02 d, rest below 0.001 sqrt(g d); d is the mean equivalent diameter.
    pub fn for_grains(
        grains: &[Grain],
        gravity: DVec3,
        fluid_density: f64,
        enclosure: Enclosure,
    ) -> EventParams {
        let mut free =
            grains.iter().filter(|grain| grain.translation == MotionConstraint::Free).peekable();
        let rise = free.peek().is_some() && free.all(|grain| grain.density < fluid_density);
        let down = gravity.try_normalize().unwrap_or(DVec3::NEG_Z);
        let down = if rise && gravity != DVec3::ZERO { -down } else { down };
        // Of equal components the last one counts.
        let along = |axis: usize| down[axis].abs();
        let axis = (0..3).max_by(|a, b| along(*a).total_cmp(&along(*b))).unwrap_or(2);
        let d = grains.iter().map(|g| g.shape.equivalent_diameter()).sum::<f64>()
            / grains.len().max(1) as f64;
        let g = gravity.length();
        EventParams {
            down,
            floor: (axis as u8, u8::from(down[axis] > 0.0)),
            enclosure,
            separation_gap: 0.05 * d,
            separation_hold: if g > 0.0 { (d / g).sqrt() } else { 0.0 },
            tumble_angle: if g > 0.0 { std::f64::consts::FRAC_PI_4 } else { f64::INFINITY },
            role_margin: 0.02 * d,
            rest_speed: 1e-3 * (g * d).sqrt(),
        }
    }
}
