use super::*;
use PhaseKind::*;

fn log(events: &[(f64, EventKind)]) -> Vec<Event> {
    let event = |(time, kind): &(f64, EventKind)| Event::new(*kind, *time, &[0, 1]);
    events.iter().map(event).collect()
}

fn kinds(phases: &[Phase]) -> Vec<(PhaseKind, f64, f64)> {
    phases.iter().map(|p| (p.kind, p.start, p.end)).collect()
}

#[test]
fn a_plain_pair() {
    let events = log(&[
        (1.0, EventKind::Kiss),
        (2.0, EventKind::RoleChange),
        (3.0, EventKind::Separation),
        (5.0, EventKind::Landing),
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
    let names: Vec<_> =
        pair_instants(&got, &events, 1.2, 6.0).iter().map(|i| (i.name, i.time)).collect();
    assert_eq!(names, [("drafting", 0.6), ("kiss", 1.0), ("role change", 2.0), ("separated", 4.0)]);
    let got = phases(&events, None, 6.0);
    assert_eq!(
        got[2],
        Phase { kind: Tumbling, start: 2.0, end: 3.0 },
        "a role change begins the tumbling"
    );
}

#[test]
fn a_second_catching_up_is_drafting_again() {
    let events = log(&[
        (1.0, EventKind::Kiss),
        (2.0, EventKind::Separation),
        (3.0, EventKind::Kiss),
        (4.0, EventKind::Separation),
    ]);
    let got: Vec<_> = phases(&events, None, 5.0).iter().map(|p| p.kind).collect();
    assert_eq!(got, [Drafting, Kissing, Drafting, Kissing, Separated]);
}

#[test]
fn a_pair_that_tumbles_after_the_separation_stays_separated() {
    let events = log(&[
        (1.0, EventKind::Kiss),
        (2.0, EventKind::Separation),
        (2.5, EventKind::Tumble),
        (5.0, EventKind::Landing),
    ]);
    let got = phases(&events, Some(2.5), 6.0);
    assert_eq!(
        kinds(&got),
        [(Drafting, 0.0, 1.0), (Kissing, 1.0, 2.0), (Separated, 2.0, 5.0), (Landed, 5.0, 6.0)]
    );
    let instants: Vec<_> =
        pair_instants(&got, &events, 1.2, 6.0).iter().map(|i| (i.name, i.time)).collect();
    assert_eq!(instants[2..], [("in contact", 1.5), ("separated", 3.5)]);
}

#[test]
fn kiss_and_separation_before_and_after_the_landing() {
    let of = |events: &[(f64, EventKind)]| {
        let events = log(events);
        let pair = |event: PairEvent| (event.time, event.landed);
        (kiss(&events).map(pair), separation(&events).map(pair))
    };
    let (touch, part, land) = (EventKind::Kiss, EventKind::Separation, EventKind::Landing);
    assert_eq!(of(&[(1.0, part)]), (None, None));
    // A bounce is not the final separation.
    let bounce = [(1.0, touch), (1.1, part), (2.0, touch), (3.0, part), (5.0, land)];
    assert_eq!(of(&bounce), (Some((1.0, false)), Some((3.0, false))));
    assert_eq!(of(&bounce[..3]), (Some((1.0, false)), None));
    // A separation before the landing takes precedence over later ones.
    let mut again = bounce.to_vec();
    again.extend([(6.0, touch), (7.0, part)]);
    assert_eq!(of(&again).1, Some((3.0, false)));
    let late = [(1.0, land), (2.0, touch), (3.0, part)];
    assert_eq!(of(&late), (Some((2.0, true)), Some((3.0, true))));
    let landed_in_touch = [(1.0, touch), (2.0, land), (3.0, part)];
    assert_eq!(of(&landed_in_touch), (Some((1.0, false)), Some((3.0, true))));
}

#[test]
fn no_kiss_and_interrupted_runs() {
    assert_eq!(kinds(&phases(&[], None, 2.0)), [(Drafting, 0.0, 2.0)]);
    let early = log(&[(1.0, EventKind::RoleChange), (1.5, EventKind::Separation)]);
    assert_eq!(
        kinds(&phases(&early, None, 2.0)),
        [(Drafting, 0.0, 2.0)],
        "nothing to tumble or part without a kiss"
    );
    let events = log(&[(1.0, EventKind::Kiss)]);
    let got = phases(&events, None, 2.0);
    assert_eq!(kinds(&got), [(Drafting, 0.0, 1.0), (Kissing, 1.0, 2.0)]);
    let names: Vec<_> =
        pair_instants(&got, &events, 1.2, 2.0).iter().map(|i| (i.name, i.time)).collect();
    assert_eq!(names, [("drafting", 0.6), ("kiss", 1.0), ("in contact", 1.5), ("end", 2.0)]);
    assert!(phases(&[], None, 0.0).is_empty());
}

#[test]
fn instants_follow_events() {
    let names = |events: &[Event], closest: f64, end: f64| -> Vec<(&str, f64)> {
        let instants = pair_instants(&phases(events, None, end), events, closest, end);
        instants.iter().map(|i| (i.name, i.time)).collect()
    };
    // Passing without contact.
    let events = log(&[(2.0, EventKind::RoleChange), (8.0, EventKind::Landing)]);
    assert_eq!(
        names(&events, 4.0, 9.0),
        [("drafting", 1.2), ("role change", 2.0), ("closest", 4.0), ("apart", 6.0)]
    );
    assert_eq!(names(&[], 5.0, 9.0), [("drafting", 3.0), ("closest", 5.0), ("apart", 7.0)]);
    // A pair that only approaches, or only parts.
    for closest in [0.0, 8.0] {
        let even = [("", 2.0), ("", 4.0), ("", 6.0), ("", 8.0)];
        assert_eq!(names(&[], closest, 8.0), even);
    }
    // A pair that lands in contact, long before the end.
    let events = log(&[(1.0, EventKind::Kiss), (3.0, EventKind::Landing)]);
    assert_eq!(names(&events, 1.0, 9.0)[2..], [("in contact", 2.0), ("landing", 3.0)]);
    // A role change after the separation.
    let events = log(&[
        (1.0, EventKind::Kiss),
        (1.1, EventKind::Tumble),
        (1.5, EventKind::Separation),
        (2.0, EventKind::RoleChange),
        (4.0, EventKind::Landing),
    ]);
    assert_eq!(
        names(&events, 1.0, 5.0),
        [("drafting", 0.6), ("kiss", 1.0), ("role change", 2.0), ("separated", 3.0)]
    );
}

#[test]
fn instants_move_to_what_was_written() {
    let instants = even_instants(4.0);
    let got: Vec<f64> = snap(&instants, &[0.0, 1.1, 3.8]).iter().map(|i| i.time).collect();
    assert_eq!(got, [1.1, 3.8], "two instants on one file are shown once");
    assert!(snap(&instants, &[]).is_empty());
}

#[test]
fn events_after_the_observation_change_no_phase() {
    let events = log(&[(1.0, EventKind::Kiss), (2.0, EventKind::Left), (3.0, EventKind::Landing)]);
    assert_eq!(kinds(&phases(&events, None, 2.0)), [(Drafting, 0.0, 1.0), (Kissing, 1.0, 2.0)]);
}
