use super::*;

fn texts(axis: &Axis) -> Vec<&str> {
    axis.ticks.iter().map(|(_, text)| text.as_str()).collect()
}

#[test]
fn ticks_are_round() {
    let axis = Axis::linear("t [s]", -0.13, 0.43, 6, AxisRange::Rounded);
    assert_eq!(texts(&axis), ["−0.2", "−0.1", "0.0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
    assert_eq!((axis.low(), axis.high()), (-0.2, 0.5));
    let tight = Axis::linear("t [s]", 0.0, 0.97, 5, AxisRange::Tight);
    assert_eq!(texts(&tight), ["0.0", "0.2", "0.4", "0.6", "0.8"]);
    assert_eq!(tight.high(), 0.97);
}

#[test]
fn a_little_beyond_a_round_value_costs_a_little() {
    let axis = Axis::linear("gap", -0.0004, 2.0, 4, AxisRange::Rounded);
    assert!(
        (axis.low() + 0.1).abs() < 1e-12 && axis.high() == 2.0,
        "{} {}",
        axis.low(),
        axis.high()
    );
    assert_eq!(texts(&axis), ["0.0", "0.5", "1.0", "1.5", "2.0"]);
}

#[test]
fn a_tight_axis_has_two_ticks_at_least() {
    for (low, high) in [(3.1, 8.9), (0.6, 1.9), (11.0, 14.0), (-0.4, 0.9), (52.0, 61.0)] {
        for count in [1, 2, 3] {
            let axis = Axis::linear("x", low, high, count, AxisRange::Tight);
            assert!(axis.ticks.len() >= 2, "{low} {high} {count}: {:?}", texts(&axis));
            let inside = |v: &f64| *v > low - 1e-5 && *v < high + 1e-5;
            assert!(axis.ticks.iter().all(|(v, _)| inside(v)));
        }
    }
}

#[test]
fn angles_have_ticks_of_their_own() {
    let quarter = Axis::degrees("tilt", 0.0, 90.0);
    assert_eq!(texts(&quarter), ["0", "30", "60", "90"]);
    let half = Axis::degrees("tilt", 0.0, 133.7);
    assert_eq!(texts(&half), ["0", "45", "90", "135"]);
    assert_eq!((half.low(), half.high()), (0.0, 135.0));
    assert_eq!(texts(&Axis::degrees("tilt", 0.0, 180.0)).last(), Some(&"180"));
}

#[test]
fn a_power_of_ten_goes_to_the_unit() {
    let axis = Axis::linear("*E* [J]", 0.0, 4.2e-7, 4, AxisRange::Rounded);
    assert_eq!(axis.label, "*E* [10^{−9} J]");
    assert_eq!(texts(&axis), ["0", "200", "400"]);
    assert_eq!(
        Axis::linear("*D*_{r}/*d*", 0.0, 5e4, 4, AxisRange::Rounded).label,
        "*D*_{r}/*d* [10^{3}]"
    );
}

#[test]
fn log_axes_take_whole_decades() {
    let axis = Axis::log("div [1/s]", 3e-14, 2e-12);
    assert_eq!((axis.low(), axis.high()), (1e-14, 1e-11));
    assert_eq!(axis.fraction(1e-14), Some(0.0));
    assert!(axis.fraction(0.0).is_none());
    assert!(texts(&axis).contains(&"10^{−14}"));
}

#[test]
fn close_log_axes_end_and_are_labelled_between_decades() {
    let axis = Axis::log_rounded("*Re*", 20.0, 350.0, AxisRange::Rounded);
    assert!((axis.low() - 20.0).abs() < 1e-9 && (axis.high() - 500.0).abs() < 1e-9);
    let named: Vec<&str> = texts(&axis).into_iter().filter(|t| !t.is_empty()).collect();
    assert_eq!(named, ["20", "50", "100", "200", "500"]);
    let fine = Axis::log_rounded("error", 0.0031, 0.04, AxisRange::Tight);
    assert_eq!((fine.low(), fine.high()), (0.0031, 0.04));
    let named: Vec<&str> = texts(&fine).into_iter().filter(|t| !t.is_empty()).collect();
    assert_eq!(named, ["0.005", "0.01", "0.02"]);
    let wide = Axis::log_rounded("error", 3e-8, 0.4, AxisRange::Rounded);
    assert!(texts(&wide).contains(&"10^{−4}"));
    assert!((wide.low() / 2e-8 - 1.0).abs() < 1e-9);
    for (low, high) in [(0.0, 1.0), (f64::NAN, 2.0), (3.0, 3.0)] {
        let axis = Axis::log_rounded("x", low, high, AxisRange::Rounded);
        assert!(axis.high() > axis.low() && axis.low() > 0.0, "{low} {high}");
    }
    let cells = axis.with_ticks(&[8.0, 16.0]);
    assert_eq!(texts(&cells), ["8", "16"]);
}

#[test]
fn empty_or_broken_ranges_can_be_drawn() {
    for (low, high) in [(1.0, 1.0), (0.0, 0.0), (f64::NAN, 2.0), (5.0, -5.0)] {
        let axis = Axis::linear("x", low, high, 5, AxisRange::Rounded);
        assert!(axis.high() > axis.low() && axis.ticks.len() >= 2, "{low} {high}");
    }
    assert_eq!(extent([f64::NAN, 2.0, -1.0, f64::INFINITY]), Some((-1.0, 2.0)));
    assert_eq!(extent([f64::NAN]), None);
}
