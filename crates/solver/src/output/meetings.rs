//! Which of a few grains meet and part: events between grains of runs of three and more. A pair has
//! a story of its own, and a heap too many contacts to tell of.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::dem::{Contact, Partner};
use crate::sim::events::{Event, EventKind};

/// Most grains whose meetings are told.
pub(super) const FEW: usize = 12;

/// Two grains that have met.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Meeting {
    grains: [usize; 2],
    /// Since when they do not touch [s]; none while they do.
    apart_since: Option<f64>,
}

/// What has been seen of the meetings. A checkpoint keeps it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Meetings {
    open: Vec<Meeting>,
    /// Everything that has happened.
    pub(super) events: Vec<Event>,
}

impl Meetings {
    /// Takes in the contacts after a step and returns what has happened. Grains have parted once
    /// they have not touched for `hold` [s].
    pub(super) fn update(&mut self, time: f64, contacts: &[Contact], hold: f64) -> Vec<Event> {
        let mut touching: BTreeMap<[usize; 2], bool> = BTreeMap::new();
        for contact in contacts {
            if let Partner::Grain(other) = contact.partner
                && other != contact.grain
            {
                let pair = [contact.grain.min(other), contact.grain.max(other)];
                touching.insert(pair, true);
            }
        }
        let first = self.events.len();
        let mut tell = |event, time_of, grains: [usize; 2]| {
            self.events.push(Event {
                time: time_of,
                event,
                grains: grains.to_vec(),
                confirmed: time,
                gap: None,
                tilt: None,
            });
        };
        self.open.retain_mut(|meeting| {
            if touching.remove(&meeting.grains).is_some() {
                meeting.apart_since = None;
                return true;
            }
            let since = *meeting.apart_since.get_or_insert(time);
            let parted = time - since >= hold;
            if parted {
                tell(EventKind::Separation, since, meeting.grains);
            }
            !parted
        });
        for grains in touching.into_keys() {
            tell(EventKind::Kiss, time, grains);
            self.open.push(Meeting {
                grains,
                apart_since: None,
            });
        }
        self.events[first..].to_vec()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::math::Load;

    fn touch(a: usize, b: usize) -> Contact {
        Contact {
            grain: a,
            partner: Partner::Grain(b),
            overlap: 0.0,
            load: Load::default(),
            point: DVec3::ZERO,
            normal: DVec3::ZERO,
        }
    }

    #[test]
    fn grains_meet_part_and_meet_again() {
        let mut meetings = Meetings::default();
        let mut told: Vec<(EventKind, f64, Vec<usize>)> = Vec::new();
        let floor = Contact {
            partner: Partner::Wall { axis: 2, side: 0 },
            ..touch(1, 0)
        };
        let steps = [
            vec![floor],
            vec![touch(2, 0), touch(0, 2)],
            vec![touch(2, 0), touch(1, 2)],
            // A bounce shorter than the hold is no parting.
            vec![touch(1, 2)],
            vec![touch(0, 2), touch(1, 2)],
            vec![touch(1, 2)],
            vec![touch(1, 2)],
            vec![touch(1, 2)],
            vec![touch(0, 2), touch(1, 2)],
        ];
        for (step, contacts) in steps.iter().enumerate() {
            for event in meetings.update(step as f64, contacts, 1.5) {
                told.push((event.event, event.time, event.grains));
            }
        }
        assert_eq!(
            told,
            [
                (EventKind::Kiss, 1.0, vec![0, 2]),
                (EventKind::Kiss, 2.0, vec![1, 2]),
                (EventKind::Separation, 5.0, vec![0, 2]),
                (EventKind::Kiss, 8.0, vec![0, 2]),
            ]
        );
        assert_eq!(meetings.events.len(), 4);
    }
}
