use glam::DVec3;
use grainwake_shape::Shape;

use super::*;
use crate::dem::{Contact, Enclosure, Partner};
use crate::math::{Load, RigidVelocity};

fn grain(x: f64, z: f64) -> Grain {
    Grain::new(Shape::sphere(0.5, 50), 2.0).with_position(DVec3::new(x, 0.0, z))
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

/// Box of edge 10 without walls, periodic along x or not.
fn open_box(periodic: bool) -> Enclosure {
    Enclosure {
        lower: DVec3::ZERO,
        upper: DVec3::splat(10.0),
        periodic: [periodic, false, false],
        sides: Default::default(),
    }
}

/// Velocities with which the grains move, those of their state.
fn velocity(grains: &[Grain]) -> impl Fn(usize) -> RigidVelocity {
    |index| grains[index].rigid_velocity()
}

/// Runs positions (grain 0 at the origin, grain 1 at x, z) through a tracker; g = d = 1.
fn follow(path: &[(f64, f64, f64)]) -> Tracker {
    let grains = |x: f64, z: f64| [grain(0.0, 0.0), grain(x, z)];
    let gap = |x: f64, z: f64| x.hypot(z) - 1.0;
    let start = grains(path[0].1, path[0].2);
    let params = EventParams::for_grains(&start, DVec3::new(0.0, 0.0, -1.0), 0.0, open_box(false));
    let mut tracker = Tracker::new(params, &start, Some(gap(path[0].1, path[0].2)));
    for &(t, x, z) in path {
        let contacts = if gap(x, z) <= 0.0 { vec![touch(0, Partner::Grain(1))] } else { vec![] };
        let grains = grains(x, z);
        tracker.update(t, &grains, velocity(&grains), &contacts, Some(gap(x, z)));
    }
    tracker
}

#[test]
fn without_gravity_there_is_no_vertical_and_no_tumble() {
    let pair = [grain(0.0, 0.0), grain(1.2, 0.0)];
    for (gravity, expected) in [(DVec3::ZERO, None), (DVec3::NEG_Z, Some(0.3))] {
        let params = EventParams::for_grains(&pair, gravity, 0.0, open_box(false));
        let mut tracker = Tracker::new(params, &pair, Some(0.2));
        for (time, x) in [(0.1, 1.1), (0.2, 0.999), (0.3, 1.1)] {
            let contacts = [touch(0, Partner::Grain(1))];
            let touching = if x < 1.0 { &contacts[..] } else { &[] };
            let grains = [grain(0.0, 0.0), grain(x, 0.0)];
            tracker.update(time, &grains, velocity(&grains), touching, Some(x - 1.0));
        }
        assert_eq!(tracker.tumble_time(), expected);
    }
}

/// Trailer comes down on the leader, rolls over it, and leads.
fn dkt() -> Vec<(f64, f64, f64)> {
    let mut path: Vec<(f64, f64, f64)> =
        (0..=10).map(|i| (0.1 * f64::from(i), 0.0, 2.0 - 0.1 * f64::from(i))).collect();
    path.extend((1..=24).map(|i| {
        let angle = f64::from(i) * 5f64.to_radians();
        (1.0 + 0.1 * f64::from(i), 0.9999 * angle.sin(), 0.9999 * angle.cos())
    }));
    let (t, x, z) = path[path.len() - 1];
    path.extend(
        (1..=30)
            .map(|i| (t + 0.1 * f64::from(i), x + 0.02 * f64::from(i), z - 0.02 * f64::from(i))),
    );
    path
}

#[test]
fn phases_of_a_pair_come_in_order() {
    let tracker = follow(&dkt());
    let kinds: Vec<EventKind> = tracker.events().iter().map(|e| e.kind).collect();
    assert_eq!(
        kinds,
        [EventKind::Kiss, EventKind::Tumble, EventKind::RoleChange, EventKind::Separation]
    );
    assert_eq!(tracker.phase(), Some(Phase::Separated));
    assert!((tracker.kiss_time().unwrap() - 1.0).abs() < 1e-12);
    assert!((tracker.tumble_time().unwrap() - 1.9).abs() < 1e-12);
    assert!((tracker.separation_time().unwrap() - 3.5).abs() < 1e-9);
    let leader = &serde_json::to_value(tracker.state()).unwrap()["pair"]["leader"];
    assert_eq!((tracker.role_changes(), leader), (1, &serde_json::json!(1)));
    let separation = &tracker.events()[3];
    assert!(separation.confirmed >= separation.time + 1.0 && separation.gap.unwrap() > 0.05);
}

#[test]
fn a_grain_that_lands_beside_one_on_the_floor_does_not_change_roles() {
    let grains = |z: f64| [grain(0.0, 0.0), grain(3.0, z)];
    let params =
        EventParams::for_grains(&grains(1.0), DVec3::new(0.0, 0.0, -1.0), 0.0, open_box(false));
    let (axis, side) = params.floor;
    for (contacts, changes) in [(vec![touch(0, Partner::Wall { axis, side })], 0), (vec![], 1)] {
        let mut tracker = Tracker::new(params, &grains(1.0), Some(2.0));
        for (t, z) in [(1.0, 0.5), (2.0, -0.5), (3.0, -0.5)] {
            let grains = grains(z);
            tracker.update(t, &grains, velocity(&grains), &contacts, Some(2.0));
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
    assert_eq!((tracker.phase(), tracker.separation_time()), (Some(Phase::Kissing), None));
}

#[test]
fn a_second_kiss_withdraws_the_separation() {
    let path =
        [(0.0, 0.0, 1.5), (1.0, 0.0, 0.999), (2.0, 0.0, 1.2), (4.0, 0.0, 1.3), (5.0, 0.0, 0.999)];
    let tracker = follow(&path);
    let kinds: Vec<EventKind> = tracker.events().iter().map(|e| e.kind).collect();
    assert_eq!(kinds, [EventKind::Kiss, EventKind::Separation, EventKind::Kiss]);
    assert_eq!((tracker.separation_time(), tracker.kiss_time()), (None, Some(1.0)));
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
    assert_eq!((tracker.events()[0].time, tracker.events()[0].confirmed), (3.0, 4.0));
}

#[test]
fn landing_and_rest_need_all_free_grains() {
    let mut grains = [grain(0.0, 0.5), grain(3.0, 0.5), grain(6.0, 5.0)];
    grains[2].translation = MotionConstraint::Prescribed(DVec3::ZERO);
    let params = EventParams::for_grains(&grains, DVec3::new(0.0, 0.0, -1.0), 0.0, open_box(false));
    let mut tracker = Tracker::new(params, &grains, None);
    let floor = Partner::Wall { axis: 2, side: 0 };
    let events = tracker.update(
        1.0,
        &grains,
        velocity(&grains),
        &[touch(0, floor), touch(1, Partner::Wall { axis: 0, side: 1 })],
        None,
    );
    assert_eq!(
        (events.len(), events[0].kind, events[0].grains.as_slice()),
        (1, EventKind::Landing, &[0][..])
    );
    assert_eq!(tracker.holds_since(StopWhen::Landing, &grains), None);
    assert_eq!(tracker.holds_since(StopWhen::Rest, &grains), Some(1.0));
    grains[0].velocity.z = -0.1;
    let contacts = [touch(0, floor), touch(1, floor)];
    let added = RigidVelocity { linear: DVec3::new(0.0, 0.0, -0.04), angular: DVec3::ZERO };
    // The velocity of the path counts, not that of the state.
    let of_path = |index| velocity(&grains)(index) - added;
    assert_eq!(tracker.update(2.0, &grains, of_path, &contacts, None).len(), 1);
    assert_eq!(tracker.holds_since(StopWhen::Landing, &grains), Some(2.0));
    assert_eq!(tracker.holds_since(StopWhen::Rest, &grains), None);
    assert_eq!(tracker.peak_settling_speeds()[0], 0.1 - 0.04);
}

#[test]
fn the_nearest_image_counts() {
    let grains = [grain(0.1, 0.0), grain(9.9, 1.2)];
    let params = EventParams::for_grains(&grains, DVec3::new(0.0, 0.0, -1.0), 0.0, open_box(true));
    let line = params.line_of_centres(&grains[0], &grains[1]);
    assert!((line - DVec3::new(-0.2, 0.0, 1.2)).length() < 1e-12);
}

#[test]
fn a_restored_tracker_goes_on_with_the_same_bits() {
    let path = dkt();
    let whole = follow(&path);
    let text = serde_json::to_string(follow(&path[..20]).state()).unwrap();
    let start = [grain(0.0, 0.0), grain(path[0].1, path[0].2)];
    let params = EventParams::for_grains(&start, DVec3::new(0.0, 0.0, -1.0), 0.0, open_box(false));
    let mut tracker = Tracker::new(params, &start, Some(1.0));
    tracker.restore(serde_json::from_str(&text).unwrap());
    for &(t, x, z) in &path[20..] {
        let gap = x.hypot(z) - 1.0;
        let contacts = if gap <= 0.0 { vec![touch(0, Partner::Grain(1))] } else { vec![] };
        let grains = [grain(0.0, 0.0), grain(x, z)];
        tracker.update(t, &grains, velocity(&grains), &contacts, Some(gap));
    }
    assert_eq!(tracker.state(), whole.state());
}

#[test]
fn grains_that_left_are_reported_once() {
    let count = 300;
    let mut grains = vec![grain(0.0, 0.0); count];
    let params = EventParams::for_grains(&grains, DVec3::new(0.0, 0.0, -1.0), 0.0, open_box(false));
    let mut tracker = Tracker::new(params, &grains, None);
    grains[1..].iter_mut().for_each(Grain::leave);
    let left = tracker.update(1.0, &grains, velocity(&grains), &[], None);
    assert_eq!((left.len(), left[0].grains.as_slice()), (count - 1, &[1][..]));
    for n in 2..10 {
        assert!(tracker.update(f64::from(n), &grains, velocity(&grains), &[], None).is_empty());
    }
    let text = serde_json::to_string(tracker.state()).unwrap();
    let mut restored = Tracker::new(params, &grains, None);
    restored.restore(serde_json::from_str(&text).unwrap());
    assert!(restored.update(10.0, &grains, velocity(&grains), &[], None).is_empty());
    grains[0].leave();
    let left = restored.update(11.0, &grains, velocity(&grains), &[], None);
    assert_eq!((left.len(), left[0].grains.as_slice()), (1, &[0][..]));
}
