//! Quantities of a pair on histories with known results.

use glam::{DQuat, DVec3};
use grainwake_formats::events::{Event, EventKind};
use grainwake_report::features::Scales;
use grainwake_report::run_folder::History;
use grainwake_study::plan::quantities::PAIR_QUANTITIES;
use grainwake_study::{PairHistory, PairMeasures};

/// d = 2 mm and g = 8 m/s2: the units are 1/63.2 s and 0.1265 m/s.
const SCALES: Scales = Scales { diameter: 2e-3, gravity: 8.0 };

fn history(place: impl Fn(f64) -> DVec3, turn: impl Fn(f64) -> DQuat, end: f64) -> History {
    let mut h = History::default();
    let rows = 1000;
    for row in 0..=rows {
        let t = end * row as f64 / rows as f64;
        h.time.push(t);
        h.position.push(place(t));
        h.velocity.push((place(t + 1e-6) - place(t - 1e-6)) / 2e-6);
        h.orientation.push(turn(t));
        h.angular_velocity.push(DVec3::ZERO);
        h.force.push(Some(DVec3::ZERO));
        h.contacts.push(Some(0));
    }
    h
}

fn log(events: &[(f64, EventKind)]) -> Vec<Event> {
    let event = |(time, kind): &(f64, EventKind)| Event::new(*kind, *time, &[0, 1]);
    events.iter().map(event).collect()
}

fn measures(events: &[(f64, EventKind)], oblong: bool) -> PairMeasures {
    // The leading grain falls at 0.1 m/s; the trailing one, 10 mm above it, at 0.15 m/s until
    // they touch at 0.16 s.
    let ahead = history(|t| DVec3::Z * -0.1 * t, |_| DQuat::from_rotation_y(-1.0), 1.0);
    let behind = history(
        |t| DVec3::new(0.0, 0.0, 0.010 - 0.15 * t.min(0.16) - 0.1 * (t - 0.16).max(0.0)),
        |_| DQuat::IDENTITY,
        1.0,
    );
    let events = log(events);
    PairMeasures::from_history(&PairHistory {
        grains: [&behind, &ahead],
        up: DVec3::Z,
        scales: SCALES,
        events: &events,
        periods: [None; 3],
        oblong,
    })
}

#[test]
fn times_speeds_and_angles_are_those_of_the_history() {
    let m = measures(
        &[
            (0.16, EventKind::Kiss),
            (0.24, EventKind::Tumble),
            (0.30, EventKind::RoleChange),
            (0.32, EventKind::Separation),
            (0.8, EventKind::Landing),
            (0.85, EventKind::RoleChange),
            (0.9, EventKind::Kiss),
        ],
        true,
    );
    let t = (2e-3_f64 / 8.0).sqrt();
    let v = (2e-3_f64 * 8.0).sqrt();
    let near = |got: Option<f64>, wanted: f64| {
        assert!((got.unwrap() - wanted).abs() < 1e-3 * wanted.abs().max(1e-3), "{got:?} {wanted}")
    };
    near(m.kiss_time, 0.16 / t);
    near(m.kissing_stage, 0.08 / t);
    near(m.contact_stage, 0.16 / t);
    near(m.tumble_time, 0.24 / t);
    near(m.pass_time, 0.30 / t);
    near(m.separation_time, 0.32 / t);
    near(m.landing_time, 0.8 / t);
    near(m.closest, 1.0);
    near(m.final_distance, 1.0);
    near(m.draft_speed_leading, 0.1 / v);
    near(m.draft_speed_trailing, 0.15 / v);
    near(m.mean_speed_leading, 0.1 / v);
    near(m.mean_speed_trailing, (0.15 * 0.16 + 0.1 * 0.64) / 0.8 / v);
    near(m.peak_speed_trailing, 0.15 / v);
    near(m.long_axis_trailing, 90.0);
    near(m.long_axis_leading, 90.0 - 1f64.to_degrees());
    assert_eq!(
        (m.parted, m.kisses, m.repeated, m.role_changes),
        (Some(true), Some(1.0), Some(false), Some(1.0))
    );
    assert_eq!(m.get("parted"), Some(1.0));
    assert_eq!(m.get("nonsense"), None);
}

#[test]
fn pairs_that_do_not_separate_or_kiss_give_bounds_or_nothing() {
    let t = (2e-3_f64 / 8.0).sqrt();
    let m = measures(
        &[(0.16, EventKind::Kiss), (0.8, EventKind::Landing), (0.9, EventKind::Separation)],
        false,
    );
    assert_eq!((m.parted, m.separation_time, m.tumble_time), (Some(false), None, None));
    assert!((m.contact_stage.unwrap() - 0.64 / t).abs() < 1e-9, "a lower bound: until the landing");
    assert_eq!(m.long_axis_leading, None, "a sphere has no long axis");
    let m = measures(&[(0.05, EventKind::RoleChange)], true);
    assert_eq!(
        (m.kiss_time, m.contact_stage, m.parted, m.draft_speed_leading, m.landing_time),
        (None, None, None, None, None)
    );
    assert_eq!((m.role_changes, m.kisses), (Some(1.0), Some(0.0)));
    assert!(m.mean_speed_leading.is_some());
    let m = measures(
        &[
            (0.1, EventKind::Kiss),
            (0.2, EventKind::Separation),
            (0.3, EventKind::Kiss),
            (0.4, EventKind::Separation),
        ],
        true,
    );
    assert_eq!((m.repeated, m.kisses), (Some(true), Some(2.0)));
    assert!((m.separation_time.unwrap() - 0.2 / t).abs() < 1e-9, "the first one");
    // If the line of centres reaches 45 degrees after the contact, kissing ends with the contact.
    let m = measures(
        &[(0.1, EventKind::Kiss), (0.2, EventKind::Separation), (0.21, EventKind::Tumble)],
        true,
    );
    assert_eq!(m.kissing_stage, m.contact_stage);
}

#[test]
fn every_quantity_has_a_column() {
    let object = serde_json::to_value(PairMeasures::default()).unwrap();
    let mut names: Vec<&str> = object.as_object().unwrap().keys().map(String::as_str).collect();
    let mut listed = PAIR_QUANTITIES.to_vec();
    names.sort_unstable();
    listed.sort_unstable();
    assert_eq!(names, listed);
}

#[test]
fn distances_are_those_of_the_nearest_periodic_images() {
    let at = |x: f64| history(move |_| DVec3::X * x, |_| DQuat::IDENTITY, 1.0);
    let (left, right) = (at(0.5e-3), at(9.5e-3));
    let closest = |periods| {
        let pair = PairHistory {
            grains: [&left, &right],
            up: DVec3::Z,
            scales: SCALES,
            events: &[],
            oblong: false,
            periods,
        };
        let measures = PairMeasures::from_history(&pair);
        assert_eq!(measures.closest, measures.final_distance);
        measures.closest.unwrap() * SCALES.diameter
    };
    assert!((closest([None; 3]) - 9e-3).abs() < 1e-12);
    assert!((closest([Some(10e-3), None, None]) - 1e-3).abs() < 1e-12);
}

#[test]
fn the_observation_ends_when_a_grain_leaves() {
    let t = (2e-3_f64 / 8.0).sqrt();
    let m = measures(
        &[(0.1, EventKind::RoleChange), (0.3, EventKind::Left), (0.4, EventKind::Landing)],
        true,
    );
    assert_eq!((m.landing_time, m.role_changes), (None, Some(1.0)));
    assert!((m.left_time.unwrap() - 0.3 / t).abs() < 1e-9);
    let m = measures(&[(0.3, EventKind::Landing), (0.4, EventKind::Left)], true);
    assert!((m.landing_time.unwrap() - 0.3 / t).abs() < 1e-9 && m.left_time.is_none());
}

#[test]
fn the_peak_speed_of_grains_that_rise_is_negative() {
    let rising =
        |from: f64| history(move |t| DVec3::Z * (from + 0.1 * t * t), |_| DQuat::IDENTITY, 1.0);
    let m = PairMeasures::from_history(&PairHistory {
        grains: [&rising(0.0), &rising(0.01)],
        up: DVec3::Z,
        scales: SCALES,
        events: &[],
        periods: [None; 3],
        oblong: false,
    });
    let v = (2e-3_f64 * 8.0).sqrt();
    assert!((m.peak_speed_leading.unwrap() + 0.2 / v).abs() < 1e-3, "{:?}", m.peak_speed_leading);
}
