//! The log of what happened (`events.jsonl`).

use std::path::Path;

use serde_json::Value;

use crate::error::ReportError;

/// What happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Two grains touch after having been apart.
    Kiss,
    /// Two touching grains begin to turn about each other.
    Tumble,
    /// The grain behind comes to lie ahead.
    RoleChange,
    /// Two grains that touched have parted.
    Separation,
    /// A grain reaches the floor.
    Landing,
    /// Something else, by its own name.
    Other(String),
}

impl Kind {
    fn from_name(name: &str) -> Kind {
        match name.replace('-', "_").as_str() {
            "kiss" => Kind::Kiss,
            "tumble" | "tumbling" => Kind::Tumble,
            "role_change" => Kind::RoleChange,
            "separation" => Kind::Separation,
            "landing" | "floor" => Kind::Landing,
            other => Kind::Other(other.replace('_', " ")),
        }
    }

    /// Name for people.
    pub fn name(&self) -> &str {
        match self {
            Kind::Kiss => "kiss",
            Kind::Tumble => "tumbling",
            Kind::RoleChange => "role change",
            Kind::Separation => "separation",
            Kind::Landing => "landing",
            Kind::Other(name) => name,
        }
    }
}

/// One line of the log.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// When [s].
    pub time: f64,
    /// What.
    pub kind: Kind,
    /// Which grains.
    pub grains: Vec<usize>,
    /// Further entries of the line, name and value.
    pub details: Vec<(String, String)>,
}

/// Reads the log in order of time; an unfinished last line is left out and noted.
pub fn read(file: &Path, notes: &mut Vec<String>) -> Result<Vec<Event>, ReportError> {
    let text = super::read_text(file)?;
    let whole = text.is_empty() || text.ends_with('\n');
    let lines: Vec<&str> = text.lines().collect();
    let mut out = Vec::new();
    for (i, line) in lines
        .iter()
        .enumerate()
        .filter(|(_, line)| !line.trim().is_empty())
    {
        match parse(line) {
            Ok(event) => out.push(event),
            Err(_) if i + 1 == lines.len() && !whole => {
                notes.push(format!(
                    "events.jsonl: the last line (line {}) is unfinished and was left out",
                    i + 1
                ));
            }
            Err(what) => {
                return Err(ReportError::Line {
                    file: file.to_owned(),
                    line: i + 1,
                    what,
                });
            }
        }
    }
    out.sort_by(|a: &Event, b: &Event| a.time.total_cmp(&b.time));
    Ok(out)
}

fn parse(line: &str) -> Result<Event, String> {
    let value: Value = serde_json::from_str(line).map_err(|error| error.to_string())?;
    let object = value.as_object().ok_or("not a JSON object")?;
    let time = object
        .get("time")
        .and_then(Value::as_f64)
        .ok_or("'time' is missing or not a number")?;
    let name = object
        .get("event")
        .and_then(Value::as_str)
        .ok_or("'event' is missing or not a text")?;
    let grains = match object.get("grains").or_else(|| object.get("grain")) {
        None => Vec::new(),
        Some(Value::Array(list)) => {
            let index = |v: &Value| v.as_u64().map(|i| i as usize);
            list.iter()
                .map(index)
                .collect::<Option<_>>()
                .ok_or("'grains' holds something that is no index")?
        }
        Some(one) => vec![one.as_u64().ok_or("'grain' is not an index")? as usize],
    };
    let details = object
        .iter()
        .filter(|(name, _)| !matches!(name.as_str(), "time" | "event" | "grains" | "grain"))
        .map(|(name, value)| {
            (
                name.clone(),
                value
                    .as_str()
                    .map_or_else(|| value.to_string(), str::to_owned),
            )
        })
        .collect();
    Ok(Event {
        time,
        kind: Kind::from_name(name),
        grains,
        details,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(content: &str) -> (Result<Vec<Event>, ReportError>, Vec<String>) {
        let folder = crate::testing::folder();
        let file = folder.join("events.jsonl");
        std::fs::write(&file, content).unwrap();
        let mut notes = Vec::new();
        let out = read(&file, &mut notes);
        std::fs::remove_dir_all(folder).unwrap();
        (out, notes)
    }

    #[test]
    fn events_come_in_order_with_their_details() {
        let (out, _) = read_text(
            "{\"time\":0.5,\"event\":\"separation\",\"grains\":[0,1],\"gap\":1e-4}\n{\"time\":0.2,\"event\":\"kiss\",\"grains\":[0,1]}\n{\"time\":0.6,\"event\":\"landing\",\"grains\":[1]}\n",
        );
        let out = out.unwrap();
        assert_eq!(
            out.iter().map(|e| e.kind.name()).collect::<Vec<_>>(),
            ["kiss", "separation", "landing"]
        );
        assert_eq!(out[1].details, [("gap".to_owned(), "0.0001".to_owned())]);
        assert_eq!(out[2].grains, [1]);
    }

    #[test]
    fn damage_is_named_with_its_line() {
        let good = "{\"time\":0.2,\"event\":\"kiss\"}\n";
        let message = |bad: &str| {
            read_text(&format!("{good}{bad}\n{good}"))
                .0
                .unwrap_err()
                .to_string()
        };
        assert!(message("{\"event\":\"kiss\"}").contains("line 2: 'time' is missing"));
        assert!(message("{\"time\":1}").contains("'event' is missing"));
        assert!(message("{\"time\":1,\"event\":\"kiss\",\"grains\":[-1]}").contains("no index"));
        assert!(message("[1]").contains("not a JSON object"));
        let (out, notes) = read_text(&format!("{good}{{\"time\":0.3,\"ev"));
        assert_eq!(out.unwrap().len(), 1);
        assert!(notes[0].contains("unfinished"));
    }
}
