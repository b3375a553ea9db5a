//! Phases of a settling pair (drafting, kissing, tumbling, separated), and the key instants, which
//! the figures show.

use grainwake_formats::events::{Event, EventKind};

/// Phase of the motion of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhaseKind {
    /// Apart, with the trailing grain catching up; also between two contacts.
    Drafting,
    /// In contact, in the initial order.
    Kissing,
    /// Rotation about each other, in contact.
    Tumbling,
    /// Apart after a contact.
    Separated,
    /// At least one grain has reached the floor.
    Landed,
}

impl PhaseKind {
    /// Returns the name on the page.
    pub fn name(self) -> &'static str {
        match self {
            PhaseKind::Drafting => "drafting",
            PhaseKind::Kissing => "kissing",
            PhaseKind::Tumbling => "tumbling",
            PhaseKind::Separated => "separated",
            PhaseKind::Landed => "landed",
        }
    }
}

/// Time interval of a phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase {
    /// Phase.
    pub kind: PhaseKind,
    /// Start [s].
    pub start: f64,
    /// End [s].
    pub end: f64,
}

/// Derives the phases from the events of a pair that is observed until `end` [s].
///
/// `tumble` [s] is the start of the tumbling according to the summary; without it, the first role
/// change in contact starts the tumbling. A later tumble of a separated pair starts no phase.
pub fn phases(events: &[Event], tumble: Option<f64>, end: f64) -> Vec<Phase> {
    use PhaseKind::{Drafting, Kissing, Landed, Separated, Tumbling};
    let events = events.iter().map(|event| (event.time, event.kind));
    let mut changes: Vec<(f64, EventKind)> = events.collect();
    changes.extend(tumble.map(|time| (time, EventKind::Tumble)));
    changes.retain(|(time, _)| *time <= end);
    changes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut out: Vec<Phase> = Vec::new();
    let (mut state, mut start) = (Drafting, 0.0);
    for (time, kind) in changes {
        let next = match (kind, state) {
            (_, Landed) => Landed,
            (EventKind::Kiss, Drafting | Separated) => Kissing,
            (EventKind::RoleChange | EventKind::Tumble, Kissing) => Tumbling,
            (EventKind::Separation, Kissing | Tumbling) => Separated,
            (EventKind::Landing, _) => Landed,
            (_, same) => same,
        };
        if next != state {
            let renewed = state == Separated && next == Kissing;
            out.push(Phase { kind: if renewed { Drafting } else { state }, start, end: time });
            (state, start) = (next, time);
        }
    }
    out.push(Phase { kind: state, start, end });
    out.retain(|phase| phase.end > phase.start);
    out
}

/// First contact or separation of a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairEvent {
    /// Time [s].
    pub time: f64,
    /// Whether a grain had landed before.
    pub landed: bool,
}

/// Returns the first contact of the pair.
pub fn kiss(events: &[Event]) -> Option<PairEvent> {
    let time = first(events, EventKind::Kiss)?;
    let landed = first(events, EventKind::Landing).is_some_and(|landing| landing <= time);
    Some(PairEvent { time, landed })
}

/// Returns the last separation before the first landing, unless a contact follows it before the
/// landing; else the last separation of the run, unless a contact follows it.
pub fn separation(events: &[Event]) -> Option<PairEvent> {
    let kiss = first(events, EventKind::Kiss)?;
    let landing = first(events, EventKind::Landing).unwrap_or(f64::INFINITY);
    let last_before = |end: f64| {
        let relevant =
            |event: &&Event| matches!(event.kind, EventKind::Kiss | EventKind::Separation);
        let mut events = events.iter().filter(relevant);
        let last = events.rfind(|event| event.time < end)?;
        (last.kind == EventKind::Separation && last.time >= kiss).then_some(last.time)
    };
    let time = last_before(landing).or_else(|| last_before(f64::INFINITY))?;
    let landed = time >= landing;
    Some(PairEvent { time, landed })
}

/// Returns the time of the first event of a kind [s].
pub fn first(events: &[Event], kind: EventKind) -> Option<f64> {
    Some(events.iter().find(|event| event.kind == kind)?.time)
}

/// Part of the run at its start or end that contains the closest approach of a pair that only
/// parts or only approaches.
const ONE_WAY: f64 = 0.05;

/// Key instant of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Instant {
    /// Time [s].
    pub time: f64,
    /// Name; empty for an instant without one.
    pub name: &'static str,
}

fn instant(time: f64, name: &'static str) -> Instant {
    Instant { time, name }
}

/// Returns the key instants of a pair: before the first contact; first contact; the following role
/// change, or else the middle of the tumbling or of the contact; after the separation, or the end.
///
/// Without contact: before, at the role change and at the `closest` approach [s], and afterwards;
/// four even times if the pair only approaches or only parts.
pub fn pair_instants(phases: &[Phase], events: &[Event], closest: f64, end: f64) -> Vec<Instant> {
    let of = |kind| phases.iter().find(|phase| phase.kind == kind);
    let landing = of(PhaseKind::Landed).map_or(end, |phase| phase.start);
    let role_change_after = |start: f64| {
        let mut changes = events.iter().filter(|event| event.kind == EventKind::RoleChange);
        let change = changes.find(|event| event.time >= start && event.time < landing)?;
        Some(instant(change.time, "role change"))
    };
    let Some(kiss) = of(PhaseKind::Kissing).map(|phase| phase.start) else {
        if closest < ONE_WAY * end || closest > (1.0 - ONE_WAY) * end {
            return even_instants(end);
        }
        let mut out = vec![instant(closest, "closest")];
        out.extend(role_change_after(0.0));
        out.sort_by(|a, b| a.time.total_cmp(&b.time));
        let (first, last) = (out[0].time, out[out.len() - 1].time);
        out.insert(0, instant(0.6 * first, "drafting"));
        out.push(instant(0.5 * (last + landing.max(last)), "apart"));
        return out;
    };
    let mut reversed = phases.iter().rev();
    let separated = reversed.find(|phase| phase.kind == PhaseKind::Separated);
    let third = role_change_after(kiss).unwrap_or_else(|| match of(PhaseKind::Tumbling) {
        Some(phase) => instant(0.5 * (phase.start + phase.end), "tumbling"),
        None => {
            let contact_end = separated.map_or(landing, |phase| phase.start);
            instant(0.5 * (kiss + contact_end), "in contact")
        }
    });
    let late = |phase: &Phase| 0.5 * (phase.start.max(third.time) + phase.end);
    let fourth = match separated {
        Some(phase) => instant(late(phase), "separated"),
        None => instant(landing, if landing < end { "landing" } else { "end" }),
    };
    let (first, second) = (instant(0.6 * kiss, "drafting"), instant(kiss, "kiss"));
    vec![first, second, third, fourth]
}

/// Returns four evenly spaced times up to `end` [s].
pub fn even_instants(end: f64) -> Vec<Instant> {
    let quarters = (1..=4).map(f64::from);
    quarters.map(|i| instant(end * i / 4.0, "")).collect()
}

/// Moves each instant to the nearest of the `available` times; equal times are kept once.
pub fn snap(instants: &[Instant], available: &[f64]) -> Vec<Instant> {
    let mut out: Vec<Instant> = Vec::new();
    for Instant { time, name } in instants {
        let distance = |at: &f64| (at - time).abs();
        let nearest = available.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        if let Some(time) = nearest.filter(|time| out.iter().all(|other| other.time != **time)) {
            out.push(instant(*time, name));
        }
    }
    out
}

#[cfg(test)]
mod tests;
