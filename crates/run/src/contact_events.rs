//! Events of contacts: kiss and separation between three to twelve grains, and contacts with walls.
//! A pair has its own event tracker, and a heap has too many contacts to list.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use grainwake_formats::contacts::wall_name;
use grainwake_formats::events::{Event, EventKind};
use grainwake_solver::dem::{Contact, Partner};

/// Largest number of grains whose contacts are events.
pub(crate) const MAX_GRAINS: usize = 12;

/// Two bodies that have been in contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct OpenContact<K> {
    /// The bodies.
    #[serde(rename = "grains")]
    bodies: K,
    /// Start of the present gap [s]; none during contact.
    apart_since: Option<f64>,
}

/// Contacts between bodies and their events; part of a checkpoint.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactEvents<K> {
    open: Vec<OpenContact<K>>,
    /// All events.
    pub(crate) events: Vec<Event>,
}

/// Contacts between two grains.
pub type PairEvents = ContactEvents<[usize; 2]>;
/// Contacts with walls: grain, axis and side of each.
pub type WallEvents = ContactEvents<(usize, u8, u8)>;

impl<K: Copy + Ord> ContactEvents<K> {
    /// Updates the contacts with the bodies that touch after a step, and returns the new events.
    /// `event` gives those of the beginning or the end of a contact at a time [s]. Bodies are
    /// separated after `hold` [s] without contact.
    fn update_with(
        &mut self,
        time: f64,
        mut touching: BTreeSet<K>,
        hold: f64,
        event: impl Fn(K, bool, f64) -> Event,
    ) -> Vec<Event> {
        let mut new = Vec::new();
        self.open.retain_mut(|contact| {
            if touching.remove(&contact.bodies) {
                contact.apart_since = None;
                return true;
            }
            let since = *contact.apart_since.get_or_insert(time);
            let parted = time - since >= hold;
            if parted {
                new.push(Event { confirmed: time, ..event(contact.bodies, false, since) });
            }
            !parted
        });
        for bodies in touching {
            new.push(event(bodies, true, time));
            self.open.push(OpenContact { bodies, apart_since: None });
        }
        self.events.extend_from_slice(&new);
        new
    }
}

impl PairEvents {
    /// Updates the pairs with the contacts after a step and returns the new events. Grains are
    /// separated after `hold` [s] without contact.
    pub(crate) fn update(&mut self, time: f64, contacts: &[Contact], hold: f64) -> Vec<Event> {
        let pairs = contacts.iter().filter_map(|contact| match contact.partner {
            Partner::Grain(other) if other != contact.grain => {
                Some([contact.grain.min(other), contact.grain.max(other)])
            }
            _ => None,
        });
        self.update_with(time, pairs.collect(), hold, |grains, begins, at| {
            let kind = if begins { EventKind::Kiss } else { EventKind::Separation };
            Event::new(kind, at, &grains)
        })
    }
}

impl WallEvents {
    /// Updates the contacts with walls after a step and returns the new events. A grain is
    /// separated from a wall after `hold` [s] without contact.
    pub(crate) fn update(&mut self, time: f64, contacts: &[Contact], hold: f64) -> Vec<Event> {
        let touching = contacts.iter().filter_map(|contact| match contact.partner {
            Partner::Wall { axis, side } => Some((contact.grain, axis, side)),
            Partner::Grain(_) => None,
        });
        self.update_with(time, touching.collect(), hold, |(grain, axis, side), begins, at| {
            let kind = if begins { EventKind::WallContact } else { EventKind::WallSeparation };
            let wall = Some(wall_name(axis, side).to_owned());
            Event { wall, ..Event::new(kind, at, &[grain]) }
        })
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
        let mut contacts_of_grains = PairEvents::default();
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

    #[test]
    fn a_bounce_off_a_wall_is_one_contact_and_two_walls_are_two() {
        let wall = |grain, axis, side| Contact {
            partner: Partner::Wall { axis, side },
            ..touch(grain, 0)
        };
        let (floor, lid) = (wall(1, 2, 0), wall(1, 2, 1));
        let mut walls = WallEvents::default();
        let steps = [vec![touch(0, 1), floor], vec![], vec![floor], vec![], vec![], vec![lid]];
        let mut events = Vec::new();
        for (step, contacts) in steps.iter().enumerate() {
            events.extend(walls.update(step as f64, contacts, 1.5));
        }
        let found: Vec<_> =
            events.iter().map(|e| (e.kind, e.time, e.confirmed, e.wall.as_deref())).collect();
        assert_eq!(
            found,
            [
                (EventKind::WallContact, 0.0, 0.0, Some("lower z")),
                (EventKind::WallSeparation, 3.0, 5.0, Some("lower z")),
                (EventKind::WallContact, 5.0, 5.0, Some("upper z")),
            ]
        );
        assert!(events.iter().all(|event| event.grains == [1]));
    }
}
