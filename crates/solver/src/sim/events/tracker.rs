//! Follows the grains and notes what happens.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{Event, EventKind, EventParams, Phase, StopWhen};
use crate::dem::{Contact, Dof, Grain, Partner};

/// The pair's part of the tracker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Pair {
    phase: Phase,
    leader: usize,
    level_since: Option<f64>,
    parted_since: Option<f64>,
    gap: f64,
    tilt: f64,
}

/// Follows the grains from step to step. Everything that changes is saved with a checkpoint.
#[derive(Clone, Debug)]
pub struct Tracker {
    params: EventParams,
    state: TrackerState,
}

/// The part of a tracker that changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackerState {
    pair: Option<Pair>,
    landed: Vec<Option<f64>>,
    peak_settling_speed: Vec<f64>,
    still_since: Option<f64>,
    events: Vec<Event>,
}

impl Tracker {
    /// A tracker of these grains as they stand at the start; `gap` is the surface gap of a pair [m].
    pub fn new(params: EventParams, grains: &[Grain], gap: Option<f64>) -> Tracker {
        let mut tracker = Tracker {
            params,
            state: TrackerState {
                pair: None,
                landed: vec![None; grains.len()],
                peak_settling_speed: grains.iter().map(|g| g.velocity.dot(params.down)).collect(),
                still_since: None,
                events: Vec::new(),
            },
        };
        if let ([a, b], Some(gap)) = (grains, gap) {
            let line = tracker.line(a, b);
            let leader = usize::from(line.dot(params.down) > 0.0);
            let tilt = tracker.tilt(line);
            tracker.state.pair = Some(Pair {
                phase: Phase::Drafting,
                leader,
                level_since: None,
                parted_since: None,
                gap,
                tilt,
            });
        }
        tracker
    }

    /// From the centre of `a` to that of the nearest image of `b` [m].
    fn line(&self, a: &Grain, b: &Grain) -> DVec3 {
        let mut line = b.pose.position - a.pose.position;
        for (axis, period) in self.params.period.iter().enumerate() {
            if let Some(period) = period {
                line[axis] -= period * (line[axis] / period).round();
            }
        }
        line
    }

    fn tilt(&self, line: DVec3) -> f64 {
        let along = line.dot(self.params.down).abs();
        let across = (line - self.params.down * line.dot(self.params.down)).length();
        across.atan2(along)
    }

    /// Takes in the state after a step and returns what has happened, oldest first.
    pub fn update(
        &mut self,
        time: f64,
        grains: &[Grain],
        contacts: &[Contact],
        gap: Option<f64>,
    ) -> Vec<Event> {
        let first = self.state.events.len();
        for (peak, grain) in self.state.peak_settling_speed.iter_mut().zip(grains) {
            *peak = peak.max(grain.velocity.dot(self.params.down));
        }
        if let ([a, b], Some(gap)) = (grains, gap) {
            let line = self.line(a, b);
            let touching = contacts.iter().any(|c| {
                matches!(
                    (c.grain, c.partner),
                    (0, Partner::Grain(1)) | (1, Partner::Grain(0))
                )
            });
            self.update_pair(time, line, touching || gap <= 0.0, gap);
        }
        self.update_landing(time, contacts);
        self.update_rest(time, grains, contacts);
        self.state.events[first..].to_vec()
    }

    fn update_pair(&mut self, time: f64, line: DVec3, touching: bool, gap: f64) {
        let (params, tilt) = (self.params, self.tilt(line));
        let both_settle = self.state.landed.iter().all(Option::is_none);
        let Some(pair) = self.state.pair.as_mut() else {
            return;
        };
        (pair.gap, pair.tilt) = (gap, tilt);
        let mut happened = Vec::new();

        let ahead = line.dot(params.down);
        let leader = usize::from(ahead > 0.0);
        if leader == pair.leader || !both_settle {
            pair.level_since = None;
        } else {
            let crossed = *pair.level_since.get_or_insert(time);
            if ahead.abs() > params.role_margin {
                pair.leader = leader;
                pair.level_since = None;
                happened.push((EventKind::RoleChange, crossed));
            }
        }

        match pair.phase {
            Phase::Drafting | Phase::Separated => {
                if touching {
                    pair.phase = Phase::Kissing;
                    pair.parted_since = None;
                    happened.push((EventKind::Kiss, time));
                }
            }
            Phase::Kissing | Phase::Tumbling => {
                if pair.phase == Phase::Kissing && tilt >= params.tumble_angle {
                    pair.phase = Phase::Tumbling;
                    happened.push((EventKind::Tumble, time));
                }
                if touching {
                    pair.parted_since = None;
                } else {
                    let parted = *pair.parted_since.get_or_insert(time);
                    if gap > params.separation_gap && time - parted >= params.separation_hold {
                        pair.phase = Phase::Separated;
                        pair.parted_since = None;
                        happened.push((EventKind::Separation, parted));
                    }
                }
            }
        }
        self.state
            .events
            .extend(happened.into_iter().map(|(kind, at)| Event {
                time: at,
                kind,
                grains: vec![0, 1],
                confirmed: time,
                gap: Some(gap),
                tilt: Some(tilt),
            }));
    }

    fn update_landing(&mut self, time: f64, contacts: &[Contact]) {
        let (axis, side) = self.params.floor;
        for contact in contacts {
            let on_floor = contact.partner == Partner::Wall { axis, side };
            if let Some(landed) = self
                .state
                .landed
                .get_mut(contact.grain)
                .filter(|l| on_floor && l.is_none())
            {
                *landed = Some(time);
                let grains = vec![contact.grain];
                let kind = EventKind::Landing;
                self.state.events.push(Event {
                    time,
                    kind,
                    grains,
                    confirmed: time,
                    gap: None,
                    tilt: None,
                });
            }
        }
    }

    fn update_rest(&mut self, time: f64, grains: &[Grain], contacts: &[Contact]) {
        let mut supported = vec![false; grains.len()];
        for contact in contacts {
            supported[contact.grain] = true;
            if let Partner::Grain(other) = contact.partner {
                supported[other] = true;
            }
        }
        let still = grains
            .iter()
            .zip(supported)
            .filter(|(g, _)| g.translation == Dof::Free)
            .all(|(g, supported)| {
                let spin = g.angular_velocity.length() * g.shape.bounding_radius();
                supported && g.velocity.length() + spin < self.params.rest_speed
            });
        self.state.still_since = if still {
            self.state.still_since.or(Some(time))
        } else {
            None
        };
    }

    /// Time since which `when` holds, if it does [s].
    pub fn holds_since(&self, when: StopWhen, grains: &[Grain]) -> Option<f64> {
        match when {
            StopWhen::Landing => {
                let mut free = self
                    .state
                    .landed
                    .iter()
                    .zip(grains)
                    .filter(|(_, g)| g.translation == Dof::Free)
                    .peekable();
                free.peek()?;
                free.try_fold(0.0_f64, |last, (landed, _)| landed.map(|t| last.max(t)))
            }
            StopWhen::Rest => self.state.still_since,
            StopWhen::Separation => (self.phase() == Some(Phase::Separated))
                .then(|| self.separation_time())
                .flatten(),
        }
    }

    /// Everything that has happened, in the order in which it became certain.
    pub fn events(&self) -> &[Event] {
        &self.state.events
    }
    /// Phase of a pair.
    pub fn phase(&self) -> Option<Phase> {
        self.state.pair.as_ref().map(|p| p.phase)
    }
    /// Gap between the surfaces of a pair after the last step [m].
    pub fn gap(&self) -> Option<f64> {
        self.state.pair.as_ref().map(|p| p.gap)
    }
    /// Index of the lower grain of a pair.
    pub fn leader(&self) -> Option<usize> {
        self.state.pair.as_ref().map(|p| p.leader)
    }
    /// First contact of the pair [s].
    pub fn kiss_time(&self) -> Option<f64> {
        self.first(EventKind::Kiss)
    }
    /// First start of tumbling [s].
    pub fn tumble_time(&self) -> Option<f64> {
        self.first(EventKind::Tumble)
    }
    /// When the pair parted for the last time; none while it is in contact [s].
    pub fn separation_time(&self) -> Option<f64> {
        let last = self
            .state
            .events
            .iter()
            .rev()
            .find(|e| matches!(e.kind, EventKind::Separation | EventKind::Kiss))?;
        (last.kind == EventKind::Separation).then_some(last.time)
    }
    /// Number of role changes.
    pub fn role_changes(&self) -> usize {
        self.state
            .events
            .iter()
            .filter(|e| e.kind == EventKind::RoleChange)
            .count()
    }
    /// First contact of each grain with the floor [s].
    pub fn landing_times(&self) -> &[Option<f64>] {
        &self.state.landed
    }
    /// Largest speed along gravity of each grain after any step [m/s].
    pub fn peak_settling_speeds(&self) -> &[f64] {
        &self.state.peak_settling_speed
    }
    fn first(&self, kind: EventKind) -> Option<f64> {
        self.state
            .events
            .iter()
            .find(|e| e.kind == kind)
            .map(|e| e.time)
    }

    /// What a checkpoint keeps.
    pub fn state(&self) -> &TrackerState {
        &self.state
    }
    /// Continues from a kept state.
    pub fn restore(&mut self, state: TrackerState) {
        self.state = state;
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DQuat;
    use grainwake_shape::Shape;

    use super::*;
    use crate::math::{Load, Pose};

    fn grain(x: f64, z: f64) -> Grain {
        Grain {
            shape: Arc::new(Shape::sphere(0.5, 50)),
            density: 2.0,
            material: crate::dem::Material::default(),
            pose: Pose {
                position: DVec3::new(x, 0.0, z),
                orientation: DQuat::IDENTITY,
            },
            velocity: DVec3::ZERO,
            angular_velocity: DVec3::ZERO,
            translation: Dof::Free,
            rotation: Dof::Free,
        }
    }

    fn touch(grain: usize, partner: Partner) -> Contact {
        Contact {
            grain,
            partner,
            overlap: 1e-3,
            load: Load::default(),
            point: DVec3::ZERO,
            normal: DVec3::Z,
        }
    }

    /// Runs positions (grain 0 at the origin, grain 1 at x, z) through a tracker; g = d = 1.
    fn follow(path: &[(f64, f64, f64)]) -> Tracker {
        let grains = |x: f64, z: f64| [grain(0.0, 0.0), grain(x, z)];
        let gap = |x: f64, z: f64| x.hypot(z) - 1.0;
        let start = grains(path[0].1, path[0].2);
        let params = EventParams::for_grains(&start, DVec3::new(0.0, 0.0, -1.0), 0.0, [None; 3]);
        let mut tracker = Tracker::new(params, &start, Some(gap(path[0].1, path[0].2)));
        for &(t, x, z) in path {
            let contacts = if gap(x, z) <= 0.0 {
                vec![touch(0, Partner::Grain(1))]
            } else {
                vec![]
            };
            tracker.update(t, &grains(x, z), &contacts, Some(gap(x, z)));
        }
        tracker
    }

    /// Trailer comes down on the leader, rolls over it, and leads.
    fn dkt() -> Vec<(f64, f64, f64)> {
        let mut path: Vec<(f64, f64, f64)> = (0..=10)
            .map(|i| (0.1 * f64::from(i), 0.0, 2.0 - 0.1 * f64::from(i)))
            .collect();
        path.extend((1..=24).map(|i| {
            let angle = f64::from(i) * 5f64.to_radians();
            (
                1.0 + 0.1 * f64::from(i),
                0.9999 * angle.sin(),
                0.9999 * angle.cos(),
            )
        }));
        let (t, x, z) = path[path.len() - 1];
        path.extend((1..=30).map(|i| {
            (
                t + 0.1 * f64::from(i),
                x + 0.02 * f64::from(i),
                z - 0.02 * f64::from(i),
            )
        }));
        path
    }

    #[test]
    fn phases_of_a_pair_come_in_order() {
        let tracker = follow(&dkt());
        let kinds: Vec<EventKind> = tracker.events().iter().map(|e| e.kind).collect();
        assert_eq!(
            kinds,
            [
                EventKind::Kiss,
                EventKind::Tumble,
                EventKind::RoleChange,
                EventKind::Separation
            ]
        );
        assert_eq!(tracker.phase(), Some(Phase::Separated));
        assert!((tracker.kiss_time().unwrap() - 1.0).abs() < 1e-12);
        assert!((tracker.tumble_time().unwrap() - 1.9).abs() < 1e-12);
        assert!((tracker.separation_time().unwrap() - 3.5).abs() < 1e-9);
        assert_eq!((tracker.role_changes(), tracker.leader()), (1, Some(1)));
        let separation = &tracker.events()[3];
        assert!(separation.confirmed >= separation.time + 1.0 && separation.gap.unwrap() > 0.05);
    }

    #[test]
    fn a_grain_that_lands_beside_one_on_the_floor_does_not_change_roles() {
        let grains = |z: f64| [grain(0.0, 0.0), grain(3.0, z)];
        let params =
            EventParams::for_grains(&grains(1.0), DVec3::new(0.0, 0.0, -1.0), 0.0, [None; 3]);
        let (axis, side) = params.floor;
        for (contacts, changes) in [
            (vec![touch(0, Partner::Wall { axis, side })], 0),
            (vec![], 1),
        ] {
            let mut tracker = Tracker::new(params, &grains(1.0), Some(2.0));
            for (t, z) in [(1.0, 0.5), (2.0, -0.5), (3.0, -0.5)] {
                tracker.update(t, &grains(z), &contacts, Some(2.0));
            }
            assert_eq!(tracker.role_changes(), changes);
        }
    }

    #[test]
    fn a_bounce_is_not_a_separation() {
        let path = [
            (0.0, 0.0, 1.5),
            (1.0, 0.0, 0.999),
            (1.1, 0.0, 1.2),
            (1.2, 0.0, 0.999),
            (1.3, 0.0, 1.04),
            (9.0, 0.0, 1.04),
        ];
        let tracker = follow(&path);
        assert_eq!(tracker.events().len(), 1);
        assert_eq!(
            (tracker.phase(), tracker.separation_time()),
            (Some(Phase::Kissing), None)
        );
    }

    #[test]
    fn a_second_kiss_withdraws_the_separation() {
        let path = [
            (0.0, 0.0, 1.5),
            (1.0, 0.0, 0.999),
            (2.0, 0.0, 1.2),
            (4.0, 0.0, 1.3),
            (5.0, 0.0, 0.999),
        ];
        let tracker = follow(&path);
        let kinds: Vec<EventKind> = tracker.events().iter().map(|e| e.kind).collect();
        assert_eq!(
            kinds,
            [EventKind::Kiss, EventKind::Separation, EventKind::Kiss]
        );
        assert_eq!(
            (tracker.separation_time(), tracker.kiss_time()),
            (None, Some(1.0))
        );
    }

    #[test]
    fn level_grains_do_not_chatter() {
        let path = [
            (0.0, 2.0, 0.01),
            (1.0, 2.0, -0.01),
            (2.0, 2.0, 0.01),
            (3.0, 2.0, -0.01),
            (4.0, 2.0, -0.03),
        ];
        let tracker = follow(&path);
        assert_eq!(tracker.role_changes(), 1);
        assert_eq!(
            (tracker.events()[0].time, tracker.events()[0].confirmed),
            (3.0, 4.0)
        );
    }

    #[test]
    fn landing_and_rest_need_all_free_grains() {
        let mut grains = [grain(0.0, 0.5), grain(3.0, 0.5), grain(6.0, 5.0)];
        grains[2].translation = Dof::Prescribed(DVec3::ZERO);
        let params = EventParams::for_grains(&grains, DVec3::new(0.0, 0.0, -1.0), 0.0, [None; 3]);
        let mut tracker = Tracker::new(params, &grains, None);
        let floor = Partner::Wall { axis: 2, side: 0 };
        let events = tracker.update(
            1.0,
            &grains,
            &[
                touch(0, floor),
                touch(1, Partner::Wall { axis: 0, side: 1 }),
            ],
            None,
        );
        assert_eq!(
            (events.len(), events[0].kind, events[0].grains.as_slice()),
            (1, EventKind::Landing, &[0][..])
        );
        assert_eq!(tracker.holds_since(StopWhen::Landing, &grains), None);
        assert_eq!(tracker.holds_since(StopWhen::Rest, &grains), Some(1.0));
        grains[0].velocity.z = -0.1;
        assert_eq!(
            tracker
                .update(2.0, &grains, &[touch(0, floor), touch(1, floor)], None)
                .len(),
            1
        );
        assert_eq!(tracker.holds_since(StopWhen::Landing, &grains), Some(2.0));
        assert_eq!(tracker.holds_since(StopWhen::Rest, &grains), None);
        assert_eq!(tracker.peak_settling_speeds()[0], 0.1);
    }

    #[test]
    fn the_nearest_image_counts() {
        let grains = [grain(0.1, 0.0), grain(9.9, 1.2)];
        let params = EventParams::for_grains(
            &grains,
            DVec3::new(0.0, 0.0, -1.0),
            0.0,
            [Some(10.0), None, None],
        );
        let tracker = Tracker::new(params, &grains, Some(0.2));
        assert!(
            (tracker.line(&grains[0], &grains[1]) - DVec3::new(-0.2, 0.0, 1.2)).length() < 1e-12
        );
    }

    #[test]
    fn a_restored_tracker_goes_on_with_the_same_bits() {
        let path = dkt();
        let whole = follow(&path);
        let text = serde_json::to_string(follow(&path[..20]).state()).unwrap();
        let start = [grain(0.0, 0.0), grain(path[0].1, path[0].2)];
        let params = EventParams::for_grains(&start, DVec3::new(0.0, 0.0, -1.0), 0.0, [None; 3]);
        let mut tracker = Tracker::new(params, &start, Some(1.0));
        tracker.restore(serde_json::from_str(&text).unwrap());
        for &(t, x, z) in &path[20..] {
            let gap = x.hypot(z) - 1.0;
            let contacts = if gap <= 0.0 {
                vec![touch(0, Partner::Grain(1))]
            } else {
                vec![]
            };
            tracker.update(t, &[grain(0.0, 0.0), grain(x, z)], &contacts, Some(gap));
        }
        assert_eq!(tracker.state(), whole.state());
    }
}
