use super::*;

#[test]
fn durations_and_times_read_well() {
    assert_eq!(
        [12.34, 605.0, 7300.0].map(duration),
        ["12.3 s", "10 min 05 s", "2 h 01 min"]
    );
    assert_eq!(
        [0.0, 0.123_456_7, 12.345_678].map(precise),
        ["0", "0.12346", "12.346"]
    );
    assert_eq!(detail("gap", "1.25e-5"), "gap 0.0125 mm");
    assert_eq!(
        detail("tilt", "0.7853981633974483"),
        "pair 45.0° from the vertical"
    );
    assert_eq!(detail("confirmed", "0.25"), "certain at 0.25000 s");
    assert_eq!(detail("my_key", "7"), "my\\_key 7");
}

#[test]
fn provenance_cannot_bring_markup_in() {
    let value = serde_json::json!({"command": ["grainwake", "run", "<script>"], "commit": null, "sessions": [{"threads": 2}]});
    let run = RunFolder {
        provenance: Some(value),
        ..RunFolder::default()
    };
    let html = provenance(&run).into_string();
    assert!(html.contains("grainwake run &lt;script&gt;") && html.contains("session 1, threads"));
}
