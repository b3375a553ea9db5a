//! Kiss and separation events between three to twelve grains. A pair has its own event tracker, and
//! a heap has too many contacts to list.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use grainwake_formats::events::{Event, EventKind};
use grainwake_solver::dem::{Contact, Partner};

/// Largest number of grains whose contacts are events.
pub(crate) const MAX_GRAINS: usize = 12;

/// Pair of grains that has been in contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct ContactPair {
    grains: [usize; 2],
    /// Start of the present gap [s]; none during contact.
    apart_since: Option<f64>,
}

/// Contacts between grains and their events; part of a checkpoint.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactEvents {
    open: Vec<ContactPair>,
    /// All events.
    pub(crate) events: Vec<Event>,
}

impl ContactEvents {
    /// Updates the pairs with the contacts after a step and returns the new events. Grains are
    /// separated after `hold` [s] without contact.
    pub(crate) fn update(&mut self, time: f64, contacts: &[Contact], hold: f64) -> Vec<Event> {
        let mut touching: BTreeSet<[usize; 2]> = BTreeSet::new();
        for contact in contacts {
            if let Partner::Grain(other) = contact.partner
                && other != contact.grain
            {
                touching.insert([contact.grain.min(other), contact.grain.max(other)]);
            }
        }
        let first = self.events.len();
        let mut record = |kind, start, grains: [usize; 2]| {
            let event = Event::new(kind, start, &grains);
            self.events.push(Event { confirmed: time, ..event });
        };
        self.open.retain_mut(|pair| {
            if touching.remove(&pair.grains) {
                pair.apart_since = None;
                return true;
            }
            let since = *pair.apart_since.get_or_insert(time);
            let parted = time - since >= hold;
            if parted {
                record(EventKind::Separation, since, pair.grains);
            }
            !parted
        });
        for grains in touching {
            record(EventKind::Kiss, time, grains);
            self.open.push(ContactPair { grains, apart_since: None });
        }
        self.events[first..].to_vec()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use grainwake_solver::math::Load;

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
    fn grains_touch_part_and_touch_again() {
        let mut contacts_of_grains = ContactEvents::default();
        let mut events: Vec<(EventKind, f64, Vec<usize>)> = Vec::new();
        let floor = Contact { partner: Partner::Wall { axis: 2, side: 0 }, ..touch(1, 0) };
        let steps = [
            vec![floor],
            vec![touch(2, 0), touch(0, 2)],
            vec![touch(2, 0), touch(1, 2)],
            // A bounce shorter than the hold is no separation.
            vec![touch(1, 2)],
            vec![touch(0, 2), touch(1, 2)],
            vec![touch(1, 2)],
            vec![touch(1, 2)],
            vec![touch(1, 2)],
            vec![touch(0, 2), touch(1, 2)],
        ];
        for (step, contacts) in steps.iter().enumerate() {
            for event in contacts_of_grains.update(step as f64, contacts, 1.5) {
                events.push((event.kind, event.time, event.grains));
            }
        }
        assert_eq!(
            events,
            [
                (EventKind::Kiss, 1.0, vec![0, 2]),
                (EventKind::Kiss, 2.0, vec![1, 2]),
                (EventKind::Separation, 5.0, vec![0, 2]),
                (EventKind::Kiss, 8.0, vec![0, 2]),
            ]
        );
        assert_eq!(contacts_of_grains.events.len(), 4);
    }
}
