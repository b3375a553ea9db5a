use grainwake_formats::events::EventKind;

use super::*;

#[test]
fn durations_and_times_read_well() {
    assert_eq!([12.34, 605.0, 7300.0].map(duration), ["12.3 s", "10 min 05 s", "2 h 01 min"]);
    assert_eq!([0.0, 0.123_456_7, 12.345_678].map(precise), ["0", "0.12346", "12.346"]);
    let mut event = Event::new(EventKind::Separation, 0.2, &[0, 1]);
    event.confirmed = 0.25;
    event.gap = Some(1.25e-5);
    event.tilt = Some(std::f64::consts::FRAC_PI_4);
    let expected = ["certain at 0.25000 s", "gap 12.5 µm", "pair 45.0° from the vertical"];
    assert_eq!(details(&event), expected);
}

#[test]
fn a_power_of_ten_in_the_provenance_is_a_superscript() {
    let passes = serde_json::json!([{"name": "ghosts_{x}", "wall_s": 4.61e-4}]);
    let value = serde_json::json!({"sessions": [{"passes": passes, "command": ["a^{2}"]}]});
    let run = RunFolder { provenance: Some(value), ..RunFolder::default() };
    let html = provenance(&run).into_string();
    assert!(html.contains("<code>ghosts_{x} 4.61×10<sup>−4</sup> s</code>"), "{html}");
    assert!(html.contains("<code>a^{2}</code>"), "text of files is no markup: {html}");
}

#[test]
fn provenance_cannot_bring_markup_in() {
    let value = serde_json::json!({"command": ["grainwake", "run", "<script>"], "commit": null, "sessions": [{"threads": 2}]});
    let run = RunFolder { provenance: Some(value), ..RunFolder::default() };
    let html = provenance(&run).into_string();
    assert!(html.contains("grainwake run &lt;script&gt;") && html.contains("session 1, threads"));
}
