//! JSON schema of the case file.

use super::raw::RawCase;

/// JSON schema (2020-12) of the case file, with the meaning and default of every key.
pub fn schema() -> serde_json::Value {
    schemars::schema_for!(RawCase).to_value()
}

#[cfg(test)]
mod tests {
    #[test]
    fn keys_have_descriptions_and_defaults() {
        let schema = super::schema();
        let contact = &schema["$defs"]["RawContact"]["properties"];
        assert_eq!(contact["friction"]["default"], 0.5);
        assert!(contact["friction"]["description"].as_str().is_some_and(|d| d.contains("Coulomb")));
        for (name, table) in schema["$defs"].as_object().unwrap() {
            for (key, value) in table["properties"].as_object().into_iter().flatten() {
                let described = value["description"].is_string()
                    || value["$ref"].is_string()
                    || value["anyOf"].is_array();
                assert!(
                    described || value["type"].is_string() || value["allOf"].is_array(),
                    "{name}.{key} says nothing: {value}"
                );
            }
        }
    }
}
