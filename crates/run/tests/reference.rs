//! The reference page of the case file names every key of the schema.

use grainwake_run::case::schema;
use serde_json::Value;

fn keys(value: &Value, found: &mut Vec<String>) {
    match value {
        Value::Object(object) => {
            if let Some(Value::Object(properties)) = object.get("properties") {
                found.extend(properties.keys().cloned());
            }
            object.values().for_each(|v| keys(v, found));
        }
        Value::Array(items) => items.iter().for_each(|v| keys(v, found)),
        _ => {}
    }
}

#[test]
fn every_key_is_described() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reference/case-file.md");
    let text = std::fs::read_to_string(page).expect("the reference page");
    let mut found = Vec::new();
    keys(&schema(), &mut found);
    found.sort();
    found.dedup();
    assert!(found.len() > 60, "only {} keys: has the schema changed?", found.len());
    let missing: Vec<&String> = found
        .iter()
        .filter(|key| {
            let named =
                [format!("`{key}`"), format!("{key} ="), format!("[{key}]"), format!("[[{key}]]")];
            !named.iter().any(|form| text.contains(form))
        })
        .collect();
    assert!(missing.is_empty(), "not in docs/reference/case-file.md: {missing:?}");
}
