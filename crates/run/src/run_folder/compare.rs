//! Differences between two resolved cases.

use std::collections::BTreeMap;
use std::path::Path;

use toml::Value;

use super::RESOLVED;

/// Keys that do not affect the results up to a given time.
const IGNORED: [&str; 8] = [
    "title",
    "expect",
    "run.threads",
    "time.end",
    "time.stop",
    "output.checkpoint",
    "contact.overlap_limit",
    "contact.accept_overlap",
];
/// Largest number of differences that are named.
const MAX_NAMED: usize = 4;
/// Longest value that is quoted [characters].
const MAX_VALUE: usize = 40;

/// Describes how the case of a run folder differs from a resolved case.
pub fn differing(folder: &Path, resolved: &str) -> String {
    let Ok(there) = std::fs::read_to_string(folder.join(RESOLVED)) else {
        return format!("its {RESOLVED} is missing or cannot be read");
    };
    let (Ok(there), Ok(here)) = (there.parse::<toml::Table>(), resolved.parse::<toml::Table>())
    else {
        return format!("its {RESOLVED} is damaged");
    };
    let (there, here) = (flatten(there), flatten(here));
    let mut keys: Vec<&String> = there.keys().chain(here.keys()).collect();
    keys.sort();
    keys.dedup();
    let side = |table: &BTreeMap<String, Value>, key: &String| {
        table.get(key).map_or("not given".to_owned(), |value| {
            let text = value.to_string();
            if text.chars().count() <= MAX_VALUE { text } else { "another value".to_owned() }
        })
    };
    let equal = |key: &String| {
        there.get(key).zip(here.get(key)).is_some_and(|(there, here)| is_equal(there, here))
    };
    let differ: Vec<String> = keys
        .into_iter()
        .filter(|key| !IGNORED.iter().any(|free| key.starts_with(free)))
        .filter(|key| !equal(key))
        .map(|key| format!("{key}: {} there, {} here", side(&there, key), side(&here, key)))
        .collect();
    match differ.len() {
        0 => format!(
            "{RESOLVED} was edited, a grain file has other contents, or another version of the \
             program wrote it"
        ),
        n if n > MAX_NAMED => {
            format!("{}; and {} more", differ[..MAX_NAMED].join("; "), n - MAX_NAMED)
        }
        _ => differ.join("; "),
    }
}

/// Returns whether two values are equal; 2500 and 2500.0 are.
fn is_equal(there: &Value, here: &Value) -> bool {
    match (there, here) {
        (Value::Integer(whole), Value::Float(number))
        | (Value::Float(number), Value::Integer(whole)) => *whole as f64 == *number,
        (Value::Array(there), Value::Array(here)) => {
            there.len() == here.len() && there.iter().zip(here).all(|(a, b)| is_equal(a, b))
        }
        _ => there == here,
    }
}

/// Returns the dotted keys with their values.
fn flatten(table: toml::Table) -> BTreeMap<String, Value> {
    fn walk(key: String, value: Value, out: &mut BTreeMap<String, Value>) {
        let inner = |name: &str| format!("{key}.{name}");
        match value {
            Value::Table(table) => {
                for (name, value) in table {
                    walk(inner(&name), value, out);
                }
            }
            Value::Array(list) if list.iter().any(Value::is_table) => {
                for (i, value) in list.into_iter().enumerate() {
                    walk(inner(&i.to_string()), value, out);
                }
            }
            plain => {
                out.insert(key, plain);
            }
        }
    }
    let mut out = BTreeMap::new();
    for (name, value) in table {
        walk(name, value, &mut out);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_named_and_free_keys_are_not() {
        let folder = std::env::temp_dir().join(format!("grainwake-differ-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let there = "title = \"a\"\n[fluid]\nviscosity = 0.001\n[time]\nend = 1.0\n[[grain]]\ndensity = 2500.0\n[grain.shape]\nkind = \"sphere\"\n";
        std::fs::write(folder.join(RESOLVED), there).unwrap();
        let same = there.replace("end = 1.0", "end = 2.0").replace("\"a\"", "\"b\"");
        assert!(differing(&folder, &same).contains("grain file"));
        let whole = same.replace("2500.0", "2500").replace("[fluid]", "[fluid]\ng = [0, 0, -9.0]");
        let listed = there.replace("[fluid]", "[fluid]\ng = [0.0, 0, -9]");
        std::fs::write(folder.join(RESOLVED), listed).unwrap();
        assert!(differing(&folder, &whole).contains("was edited"), "equal numbers");
        let other = whole.replace("2500", "2501").replace("-9.0", "-8");
        assert_eq!(
            differing(&folder, &other),
            "fluid.g: [0.0, 0, -9] there, [0, 0, -8] here; grain.0.density: 2500.0 there, 2501 here"
        );
        std::fs::write(folder.join(RESOLVED), there).unwrap();
        let other = same.replace("0.001", "0.005").replace("\"sphere\"", "\"cube\"");
        assert_eq!(
            differing(&folder, &other),
            "fluid.viscosity: 0.001 there, 0.005 here; grain.0.shape.kind: \"sphere\" there, \"cube\" here"
        );
        let less = other.replace("density = 2500.0\n", "");
        assert!(
            differing(&folder, &less).contains("grain.0.density: 2500.0 there, not given here")
        );
        std::fs::remove_dir_all(folder).unwrap();
    }
}
