//! The phases of a settling pair (drafting, kissing, tumbling, separated) and the instants at which
//! the figures show it.

use crate::run_folder::{Event, Kind};

/// What a pair is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhaseKind {
    /// Apart, the one behind catching up (also between two kisses).
    Drafting,
    /// In touch, in the order of the start.
    Kissing,
    /// Turning about each other, in touch or just parted.
    Tumbling,
    /// Apart after having touched.
    Separated,
    /// One or both have reached the floor.
    Landed,
}

impl PhaseKind {
    /// Name for people.
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

/// A stretch of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase {
    /// What the pair does.
    pub kind: PhaseKind,
    /// From [s].
    pub start: f64,
    /// To [s].
    pub end: f64,
}

/// Phases from the log. `tumble` [s] is when the summary says that the tumbling begins; without it,
/// the first role change in touch begins it. `end` [s] is the last time of the run.
pub fn phases(events: &[Event], tumble: Option<f64>, end: f64) -> Vec<Phase> {
    use PhaseKind::{Drafting, Kissing, Landed, Separated, Tumbling};
    let mut turns: Vec<(f64, Option<&Kind>)> = events
        .iter()
        .map(|event| (event.time, Some(&event.kind)))
        .collect();
    if let Some(tumble) = tumble {
        turns.push((tumble, None));
    }
    turns.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut out: Vec<Phase> = Vec::new();
    let (mut state, mut since) = (Drafting, 0.0);
    for (time, kind) in turns {
        let next = match (kind, state) {
            (_, Landed) => Landed,
            (Some(Kind::Kiss), Drafting | Separated) => Kissing,
            (Some(Kind::RoleChange | Kind::Tumble) | None, Kissing) => Tumbling,
            // A pair may turn on after a touch that has ended, before the separation is certain.
            (Some(Kind::Tumble) | None, Separated) => Tumbling,
            (Some(Kind::Separation), Kissing | Tumbling) => Separated,
            (Some(Kind::Landing), _) => Landed,
            (_, same) => same,
        };
        if next != state {
            let caught_again = state == Separated && next == Kissing;
            out.push(Phase {
                kind: if caught_again { Drafting } else { state },
                start: since,
                end: time,
            });
            (state, since) = (next, time);
        }
    }
    out.push(Phase {
        kind: state,
        start: since,
        end: end.max(since),
    });
    out.retain(|phase| phase.end > phase.start);
    out
}

/// When a pair met or parted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairEvent {
    /// Time [s].
    pub time: f64,
    /// Whether a grain had landed before.
    pub landed: bool,
}

/// First contact of the pair.
pub fn kiss(events: &[Event]) -> Option<PairEvent> {
    let time = first(events, &Kind::Kiss)?;
    let landed = first(events, &Kind::Landing).is_some_and(|landing| landing <= time);
    Some(PairEvent { time, landed })
}

/// The separation of a pair that has touched: its last separation before the first landing, unless it
/// has met again by then; else its last separation of all, unless it has met again.
pub fn separation(events: &[Event]) -> Option<PairEvent> {
    let kiss = first(events, &Kind::Kiss)?;
    let landing = first(events, &Kind::Landing).unwrap_or(f64::INFINITY);
    let before = |end: f64| {
        let meets = |event: &&Event| matches!(event.kind, Kind::Kiss | Kind::Separation);
        let last = events
            .iter()
            .rfind(|event| meets(event) && event.time < end)?;
        (last.kind == Kind::Separation && last.time >= kiss).then_some(last.time)
    };
    let time = before(landing).or_else(|| before(f64::INFINITY))?;
    Some(PairEvent {
        time,
        landed: time >= landing,
    })
}

/// Time of the first event of a kind [s].
fn first(events: &[Event], kind: &Kind) -> Option<f64> {
    events
        .iter()
        .find(|event| event.kind == *kind)
        .map(|event| event.time)
}

/// A named instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Instant {
    /// Time [s].
    pub time: f64,
    /// What it shows; empty for an instant that is only a time.
    pub name: &'static str,
}

/// The four instants at which a pair is shown: before the kiss, at it, at the role change that
/// follows (else while tumbling), and after both have happened (or at the end). Without a kiss:
/// before, at the role change and when they were `closest` [s], and afterwards.
pub fn pair_instants(phases: &[Phase], events: &[Event], closest: f64, end: f64) -> Vec<Instant> {
    let of = |kind| phases.iter().find(|phase| phase.kind == kind);
    let instant = |time, name| Instant { time, name };
    let landing = of(PhaseKind::Landed).map_or(end, |phase| phase.start);
    let role_after = |start: f64| {
        let mut roles = events.iter().filter(|event| event.kind == Kind::RoleChange);
        roles
            .find(|event| event.time >= start && event.time < landing)
            .map(|event| event.time)
    };
    let Some(kiss) = of(PhaseKind::Kissing).map(|phase| phase.start) else {
        let mut out = vec![instant(closest, "closest")];
        out.extend(role_after(0.0).map(|time| instant(time, "role change")));
        out.sort_by(|a, b| a.time.total_cmp(&b.time));
        let (first, last) = (out[0].time, out[out.len() - 1].time);
        out.insert(0, instant(0.6 * first, "drafting"));
        out.push(instant(0.5 * (last + landing.max(last)), "apart"));
        return out;
    };
    let middle = |phase: &Phase| 0.5 * (phase.start + phase.end);
    let parted = phases
        .iter()
        .rfind(|phase| phase.kind == PhaseKind::Separated);
    let tumbling = of(PhaseKind::Tumbling);
    // Where the tumbling comes after the separation, it takes the last place.
    let apart = tumbling.filter(|t| parted.is_some_and(|p| p.start < t.start));
    let third = match (role_after(kiss), tumbling.filter(|_| apart.is_none())) {
        (Some(time), _) => instant(time, "role change"),
        (None, Some(tumbling)) => instant(middle(tumbling), "tumbling"),
        (None, None) => instant(
            0.5 * (kiss + parted.map_or(landing, |phase| phase.start)),
            "in contact",
        ),
    };
    let late = |phase: &Phase| 0.5 * (phase.start.max(third.time) + phase.end);
    let fourth = match (apart, parted) {
        (Some(phase), _) => instant(late(phase), "tumbling"),
        (None, Some(phase)) => instant(late(phase), "separated"),
        (None, None) => instant(landing, if landing < end { "landing" } else { "end" }),
    };
    vec![
        instant(0.6 * kiss, "drafting"),
        instant(kiss, "kiss"),
        third,
        fourth,
    ]
}

/// Four even times up to `end` [s].
pub fn even_instants(end: f64) -> Vec<Instant> {
    (1..=4)
        .map(|i| Instant {
            time: end * f64::from(i) / 4.0,
            name: "",
        })
        .collect()
}

/// Moves each instant to the nearest of the `available` times; what falls on the same time is shown once.
pub fn snap(instants: &[Instant], available: &[f64]) -> Vec<Instant> {
    let mut out: Vec<Instant> = Vec::new();
    for instant in instants {
        let nearest = available.iter().min_by(|a, b| {
            (*a - instant.time)
                .abs()
                .total_cmp(&(*b - instant.time).abs())
        });
        if let Some(time) = nearest.filter(|time| out.iter().all(|other| other.time != **time)) {
            out.push(Instant {
                time: *time,
                name: instant.name,
            });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use PhaseKind::*;

    fn log(events: &[(f64, Kind)]) -> Vec<Event> {
        let event = |(time, kind): &(f64, Kind)| Event {
            time: *time,
            kind: kind.clone(),
            grains: vec![0, 1],
            details: Vec::new(),
        };
        events.iter().map(event).collect()
    }

    fn kinds(phases: &[Phase]) -> Vec<(PhaseKind, f64, f64)> {
        phases.iter().map(|p| (p.kind, p.start, p.end)).collect()
    }

    #[test]
    fn a_plain_pair() {
        let events = log(&[
            (1.0, Kind::Kiss),
            (2.0, Kind::RoleChange),
            (3.0, Kind::Separation),
            (5.0, Kind::Landing),
        ]);
        let got = phases(&events, Some(1.5), 6.0);
        assert_eq!(
            kinds(&got),
            [
                (Drafting, 0.0, 1.0),
                (Kissing, 1.0, 1.5),
                (Tumbling, 1.5, 3.0),
                (Separated, 3.0, 5.0),
                (Landed, 5.0, 6.0)
            ]
        );
        let names: Vec<_> = pair_instants(&got, &events, 1.2, 6.0)
            .iter()
            .map(|i| (i.name, i.time))
            .collect();
        assert_eq!(
            names,
            [
                ("drafting", 0.6),
                ("kiss", 1.0),
                ("role change", 2.0),
                ("separated", 4.0)
            ]
        );
        let got = phases(&events, None, 6.0);
        assert_eq!(
            got[2],
            Phase {
                kind: Tumbling,
                start: 2.0,
                end: 3.0
            },
            "a role change begins the tumbling"
        );
    }

    #[test]
    fn a_second_catching_up_is_drafting_again() {
        let events = log(&[
            (1.0, Kind::Kiss),
            (2.0, Kind::Separation),
            (3.0, Kind::Kiss),
            (4.0, Kind::Separation),
        ]);
        let got: Vec<_> = phases(&events, None, 5.0).iter().map(|p| p.kind).collect();
        assert_eq!(got, [Drafting, Kissing, Drafting, Kissing, Separated]);
    }

    #[test]
    fn tumbling_after_the_separation_is_kept() {
        let events = log(&[
            (1.0, Kind::Kiss),
            (2.0, Kind::Separation),
            (2.5, Kind::Tumble),
            (5.0, Kind::Landing),
        ]);
        let got = phases(&events, Some(2.5), 6.0);
        assert_eq!(
            kinds(&got),
            [
                (Drafting, 0.0, 1.0),
                (Kissing, 1.0, 2.0),
                (Separated, 2.0, 2.5),
                (Tumbling, 2.5, 5.0),
                (Landed, 5.0, 6.0)
            ]
        );
        let instants: Vec<_> = pair_instants(&got, &events, 1.2, 6.0)
            .iter()
            .map(|i| (i.name, i.time))
            .collect();
        assert_eq!(instants[2..], [("in contact", 1.5), ("tumbling", 3.75)]);
    }

    #[test]
    fn kiss_and_parting_have_one_meaning() {
        let of = |events: &[(f64, Kind)]| {
            let events = log(events);
            let report = |moment: PairEvent| (moment.time, moment.landed);
            (kiss(&events).map(report), separation(&events).map(report))
        };
        let (touch, part, land) = (Kind::Kiss, Kind::Separation, Kind::Landing);
        assert_eq!(of(&[(1.0, part.clone())]), (None, None));
        // A bounce is no separation.
        let bounce = [
            (1.0, touch.clone()),
            (1.1, part.clone()),
            (2.0, touch.clone()),
            (3.0, part.clone()),
            (5.0, land.clone()),
        ];
        assert_eq!(of(&bounce), (Some((1.0, false)), Some((3.0, false))));
        assert_eq!(of(&bounce[..3]), (Some((1.0, false)), None));
        // What happens on the floor comes second.
        let mut again = bounce.to_vec();
        again.extend([(6.0, touch.clone()), (7.0, part.clone())]);
        assert_eq!(of(&again).1, Some((3.0, false)));
        let late = [
            (1.0, land.clone()),
            (2.0, touch.clone()),
            (3.0, part.clone()),
        ];
        assert_eq!(of(&late), (Some((2.0, true)), Some((3.0, true))));
        let landed_in_touch = [(1.0, touch), (2.0, land), (3.0, part)];
        assert_eq!(
            of(&landed_in_touch),
            (Some((1.0, false)), Some((3.0, true)))
        );
    }

    #[test]
    fn no_kiss_and_interrupted_runs() {
        assert_eq!(kinds(&phases(&[], None, 2.0)), [(Drafting, 0.0, 2.0)]);
        let early = log(&[(1.0, Kind::RoleChange), (1.5, Kind::Separation)]);
        assert_eq!(
            kinds(&phases(&early, None, 2.0)),
            [(Drafting, 0.0, 2.0)],
            "nothing to tumble or part without a kiss"
        );
        let events = log(&[(1.0, Kind::Kiss)]);
        let got = phases(&events, None, 2.0);
        assert_eq!(kinds(&got), [(Drafting, 0.0, 1.0), (Kissing, 1.0, 2.0)]);
        let names: Vec<_> = pair_instants(&got, &events, 1.2, 2.0)
            .iter()
            .map(|i| (i.name, i.time))
            .collect();
        assert_eq!(
            names,
            [
                ("drafting", 0.6),
                ("kiss", 1.0),
                ("in contact", 1.5),
                ("end", 2.0)
            ]
        );
        assert!(phases(&[], None, 0.0).is_empty());
    }

    #[test]
    fn instants_follow_what_happened() {
        let names = |events: &[Event], closest: f64, end: f64| -> Vec<(&str, f64)> {
            let instants = pair_instants(&phases(events, None, end), events, closest, end);
            instants.iter().map(|i| (i.name, i.time)).collect()
        };
        // Passing without a touch.
        let events = log(&[(2.0, Kind::RoleChange), (8.0, Kind::Landing)]);
        assert_eq!(
            names(&events, 4.0, 9.0),
            [
                ("drafting", 1.2),
                ("role change", 2.0),
                ("closest", 4.0),
                ("apart", 6.0)
            ]
        );
        assert_eq!(
            names(&[], 5.0, 9.0),
            [("drafting", 3.0), ("closest", 5.0), ("apart", 7.0)]
        );
        // A pair that lands in touch, and lies there for long.
        let events = log(&[(1.0, Kind::Kiss), (3.0, Kind::Landing)]);
        assert_eq!(
            names(&events, 1.0, 9.0)[2..],
            [("in contact", 2.0), ("landing", 3.0)]
        );
        // Roles that change after the grains have parted.
        let events = log(&[
            (1.0, Kind::Kiss),
            (1.1, Kind::Tumble),
            (1.5, Kind::Separation),
            (2.0, Kind::RoleChange),
            (4.0, Kind::Landing),
        ]);
        assert_eq!(
            names(&events, 1.0, 5.0),
            [
                ("drafting", 0.6),
                ("kiss", 1.0),
                ("role change", 2.0),
                ("separated", 3.0)
            ]
        );
    }

    #[test]
    fn instants_move_to_what_was_written() {
        let instants = even_instants(4.0);
        let got: Vec<f64> = snap(&instants, &[0.0, 1.1, 3.8])
            .iter()
            .map(|i| i.time)
            .collect();
        assert_eq!(got, [1.1, 3.8], "two instants on one file are shown once");
        assert!(snap(&instants, &[]).is_empty());
    }
}
