//! Drafting, kissing and tumbling of a pair.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{Event, EventKind, EventParams, Phase};
use crate::dem::Grain;

/// State of a pair between steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Pair {
    pub phase: Phase,
    /// Index of the lower grain.
    pub leader: usize,
    /// Time at which the grains were level, until a role change is confirmed [s].
    level_since: Option<f64>,
    /// End of the last contact, until a separation is confirmed [s].
    parted_since: Option<f64>,
    /// Gap between the surfaces [m].
    pub gap: f64,
    /// Angle between line of centres and vertical [rad].
    tilt: f64,
}

impl Pair {
    /// Pair at the start of a run.
    pub fn new(params: &EventParams, line: DVec3, gap: f64) -> Pair {
        Pair {
            phase: Phase::Drafting,
            leader: params.leader(line),
            level_since: None,
            parted_since: None,
            gap,
            tilt: params.tilt(line),
        }
    }

    /// Updates the pair after a step and returns its events. `line` leads from the centroid of the
    /// first grain to the nearest image of the second [m], `gap` is the distance of the surfaces
    /// [m]; roles are fixed once a grain has `landed`.
    pub fn update(
        &mut self,
        params: &EventParams,
        time: f64,
        line: DVec3,
        gap: f64,
        touching: bool,
        landed: bool,
    ) -> Vec<Event> {
        (self.gap, self.tilt) = (gap, params.tilt(line));
        let role_change = self.update_roles(params, time, line, landed);
        let change = self.update_phase(params, time, touching);
        let events = role_change.into_iter().chain(change);
        let events = events.map(|(kind, at)| Event {
            time: at,
            kind,
            grains: vec![0, 1],
            wall: None,
            confirmed: time,
            gap: Some(self.gap),
            tilt: Some(self.tilt),
        });
        events.collect()
    }

    fn update_roles(
        &mut self,
        params: &EventParams,
        time: f64,
        line: DVec3,
        landed: bool,
    ) -> Option<(EventKind, f64)> {
        let leader = params.leader(line);
        if leader == self.leader || landed {
            self.level_since = None;
            return None;
        }
        let level = *self.level_since.get_or_insert(time);
        if line.dot(params.down).abs() <= params.role_margin {
            return None;
        }
        self.leader = leader;
        self.level_since = None;
        Some((EventKind::RoleChange, level))
    }

    fn update_phase(
        &mut self,
        params: &EventParams,
        time: f64,
        touching: bool,
    ) -> Vec<(EventKind, f64)> {
        let mut events = Vec::new();
        match self.phase {
            Phase::Drafting | Phase::Separated => {
                if touching {
                    self.phase = Phase::Kissing;
                    self.parted_since = None;
                    events.push((EventKind::Kiss, time));
                }
            }
            Phase::Kissing | Phase::Tumbling => {
                if self.phase == Phase::Kissing && self.tilt >= params.tumble_angle {
                    self.phase = Phase::Tumbling;
                    events.push((EventKind::Tumble, time));
                }
                if touching {
                    self.parted_since = None;
                } else {
                    let parted = *self.parted_since.get_or_insert(time);
                    let held = time - parted >= params.separation_hold;
                    if self.gap > params.separation_gap && held {
                        self.phase = Phase::Separated;
                        self.parted_since = None;
                        events.push((EventKind::Separation, parted));
                    }
                }
            }
        }
        events
    }
}

impl EventParams {
    /// Vector from the centroid of `a` to that of the nearest image of `b` [m].
    pub(super) fn line_of_centres(&self, a: &Grain, b: &Grain) -> DVec3 {
        self.enclosure.nearest_image(b.pose.position - a.pose.position)
    }

    /// Angle between the line of centres and the vertical [rad].
    fn tilt(&self, line: DVec3) -> f64 {
        let vertical = line.dot(self.down);
        let horizontal = (line - self.down * vertical).length();
        horizontal.atan2(vertical.abs())
    }

    /// Index of the lower grain.
    fn leader(&self, line: DVec3) -> usize {
        usize::from(line.dot(self.down) > 0.0)
    }
}
