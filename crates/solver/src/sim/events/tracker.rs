//! Detection of events from step to step.

use serde::{Deserialize, Serialize};

use super::pair::Pair;
use super::{Event, EventKind, EventParams, Phase, StopWhen};
use crate::dem::{Contact, Grain, MotionConstraint, Partner};
use crate::math::RigidVelocity;

/// Detects events of the grains from step to step; its state is part of a checkpoint.
#[derive(Clone, Debug)]
pub struct Tracker {
    params: EventParams,
    state: TrackerState,
    /// Whether each grain has left, as the events say.
    has_left: Vec<bool>,
}

/// Variable part of a tracker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackerState {
    pair: Option<Pair>,
    landed: Vec<Option<f64>>,
    peak_settling_speed: Vec<f64>,
    still_since: Option<f64>,
    events: Vec<Event>,
}

impl Tracker {
    /// Tracker of `grains` at the start of a run; `gap` is the surface gap of a pair [m].
    pub fn new(params: EventParams, grains: &[Grain], gap: Option<f64>) -> Tracker {
        let pair = match (grains, gap) {
            ([a, b], Some(gap)) => Some(Pair::new(&params, params.line_of_centres(a, b), gap)),
            _ => None,
        };
        let settling_speed = |grain: &Grain| grain.velocity.dot(params.down);
        let state = TrackerState {
            pair,
            landed: vec![None; grains.len()],
            peak_settling_speed: grains.iter().map(settling_speed).collect(),
            still_since: None,
            events: Vec::new(),
        };
        Tracker { params, state, has_left: vec![false; grains.len()] }
    }

    /// Processes the state after a step and returns its events, oldest first; `velocity` returns
    /// the velocity with which a grain moves
    /// ([`Simulation::grain_velocity`](crate::sim::Simulation::grain_velocity)).
    pub fn update(
        &mut self,
        time: f64,
        grains: &[Grain],
        velocity: impl Fn(usize) -> RigidVelocity,
        contacts: &[Contact],
        gap: Option<f64>,
    ) -> Vec<Event> {
        let first = self.state.events.len();
        for (index, peak) in self.state.peak_settling_speed.iter_mut().enumerate() {
            *peak = peak.max(velocity(index).linear.dot(self.params.down));
        }
        self.update_left(time, grains);
        if let ([a, b], Some(gap), Some(pair)) = (grains, gap, &mut self.state.pair) {
            let of_pair = |contact: &Contact| {
                let pair = (contact.grain, contact.partner);
                matches!(pair, (0, Partner::Grain(1)) | (1, Partner::Grain(0)))
            };
            let line = self.params.line_of_centres(a, b);
            let touching = contacts.iter().any(of_pair) || gap <= 0.0;
            let landed = self.state.landed.iter().any(Option::is_some);
            let events = pair.update(&self.params, time, line, gap, touching, landed);
            self.state.events.extend(events);
        }
        self.update_landing(time, contacts);
        self.update_rest(time, grains, velocity, contacts);
        self.state.events[first..].to_vec()
    }

    fn update_left(&mut self, time: f64, grains: &[Grain]) {
        for (index, (grain, has_left)) in grains.iter().zip(&mut self.has_left).enumerate() {
            if grain.has_left() && !std::mem::replace(has_left, true) {
                self.state.events.push(Event::new(EventKind::Left, time, &[index]));
            }
        }
    }

    fn update_landing(&mut self, time: f64, contacts: &[Contact]) {
        let (axis, side) = self.params.floor;
        for contact in contacts {
            if contact.partner != (Partner::Wall { axis, side }) {
                continue;
            }
            let Some(landed @ None) = self.state.landed.get_mut(contact.grain) else {
                continue;
            };
            *landed = Some(time);
            let landing = Event::new(EventKind::Landing, time, &[contact.grain]);
            self.state.events.push(landing);
        }
    }

    fn update_rest(
        &mut self,
        time: f64,
        grains: &[Grain],
        velocity: impl Fn(usize) -> RigidVelocity,
        contacts: &[Contact],
    ) {
        let mut supported = vec![false; grains.len()];
        for contact in contacts {
            supported[contact.grain] = true;
            if let Partner::Grain(other) = contact.partner {
                supported[other] = true;
            }
        }
        let mut free = (0..grains.len()).filter(|index| may_settle(&grains[*index])).peekable();
        let still = free.peek().is_some()
            && free.all(|index| {
                let RigidVelocity { linear, angular } = velocity(index);
                let spin = angular.length() * grains[index].shape.bounding_radius();
                supported[index] && linear.length() + spin < self.params.rest_speed
            });
        self.state.still_since = if still { self.state.still_since.or(Some(time)) } else { None };
    }

    /// Time since which the condition `when` has held [s]; none if it does not hold.
    pub fn holds_since(&self, when: StopWhen, grains: &[Grain]) -> Option<f64> {
        match when {
            StopWhen::Landing => {
                let landed = self.state.landed.iter().zip(grains);
                let mut free = landed.filter(|(_, grain)| may_settle(grain)).peekable();
                free.peek()?;
                free.try_fold(0.0_f64, |last, (landed, _)| landed.map(|t| last.max(t)))
            }
            StopWhen::Rest => self.state.still_since,
            StopWhen::Separation => {
                (self.phase() == Some(Phase::Separated)).then(|| self.separation_time()).flatten()
            }
        }
    }

    /// All events, in the order of their confirmation.
    pub fn events(&self) -> &[Event] {
        &self.state.events
    }
    /// Phase of a pair.
    pub fn phase(&self) -> Option<Phase> {
        self.state.pair.as_ref().map(|p| p.phase)
    }
    /// Gap between the surfaces of a pair after the last step [m]; none once a grain has left.
    pub fn gap(&self) -> Option<f64> {
        let pair = self.state.pair.as_ref().filter(|_| !self.has_left.contains(&true));
        pair.map(|pair| pair.gap)
    }
    /// Time of the first contact of the pair [s].
    pub fn kiss_time(&self) -> Option<f64> {
        self.first(EventKind::Kiss)
    }
    /// Time at which the pair first tumbled [s].
    pub fn tumble_time(&self) -> Option<f64> {
        self.first(EventKind::Tumble)
    }
    /// Last separation of the pair; none while it is in contact [s].
    pub fn separation_time(&self) -> Option<f64> {
        let decides = |e: &&Event| matches!(e.kind, EventKind::Separation | EventKind::Kiss);
        let last = self.state.events.iter().rev().find(decides)?;
        (last.kind == EventKind::Separation).then_some(last.time)
    }
    /// Number of role changes.
    pub fn role_changes(&self) -> usize {
        self.state.events.iter().filter(|e| e.kind == EventKind::RoleChange).count()
    }
    /// Time of the first contact of each grain with the floor [s].
    pub fn landing_times(&self) -> &[Option<f64>] {
        &self.state.landed
    }
    /// Largest settling speed of each grain after any step [m/s].
    pub fn peak_settling_speeds(&self) -> &[f64] {
        &self.state.peak_settling_speed
    }
    fn first(&self, kind: EventKind) -> Option<f64> {
        self.state.events.iter().find(|e| e.kind == kind).map(|e| e.time)
    }

    /// State for a checkpoint.
    pub fn state(&self) -> &TrackerState {
        &self.state
    }
    /// Restores the state of a checkpoint.
    pub fn restore(&mut self, state: TrackerState) {
        self.state = state;
        self.has_left.fill(false);
        let left = self.state.events.iter().filter(|event| event.kind == EventKind::Left);
        for grain in left.flat_map(|event| &event.grains) {
            if let Some(has_left) = self.has_left.get_mut(*grain) {
                *has_left = true;
            }
        }
    }
}

/// Returns whether a grain moves freely in the box.
fn may_settle(grain: &Grain) -> bool {
    grain.translation == MotionConstraint::Free && !grain.has_left()
}
