//! Log of events (`events.jsonl`): one JSON object a line.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::{FormatError, read_text, unfinished_line};

/// Name of the file in a run folder.
pub const FILE: &str = "events.jsonl";

/// Kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// Two grains come into contact.
    Kiss,
    /// After a kiss, the line of centres of a pair turns past the tumbling angle.
    #[serde(alias = "tumbling")]
    Tumble,
    /// The upper grain of a pair passes the lower one.
    #[serde(alias = "role_change")]
    RoleChange,
    /// Two grains that were in contact have parted.
    Separation,
    /// A grain touches the floor for the first time.
    #[serde(alias = "floor")]
    Landing,
    /// A grain comes into contact with a wall.
    WallContact,
    /// A grain that was in contact with a wall has parted from it.
    WallSeparation,
    /// A grain has left the box through an open side.
    Left,
}

impl EventKind {
    /// Returns the name in file names and in the log.
    pub fn name(self) -> &'static str {
        match self {
            EventKind::Kiss => "kiss",
            EventKind::Tumble => "tumble",
            EventKind::RoleChange => "role-change",
            EventKind::Separation => "separation",
            EventKind::Landing => "landing",
            EventKind::WallContact => "wall-contact",
            EventKind::WallSeparation => "wall-separation",
            EventKind::Left => "left",
        }
    }
    /// Returns the name in figures and pages.
    pub fn label(self) -> &'static str {
        match self {
            EventKind::Tumble => "tumbling",
            EventKind::RoleChange => "role change",
            EventKind::WallContact => "wall contact",
            EventKind::WallSeparation => "wall separation",
            other => other.name(),
        }
    }
}

/// Event of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Time of the event [s]: the end of contact for a separation, the moment of equal height for
    /// a role change.
    pub time: f64,
    /// Kind of the event.
    #[serde(rename = "event")]
    pub kind: EventKind,
    /// Indices of the grains.
    #[serde(default)]
    pub grains: Vec<usize>,
    /// Wall of a contact with a wall: "lower z".
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub wall: Option<String>,
    /// Time at which the event was certain [s]: a separation and a role change need some distance.
    pub confirmed: f64,
    /// Gap between the surfaces of the pair when confirmed [m].
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub gap: Option<f64>,
    /// Angle of the line of centres from the vertical when confirmed [rad], 0 to pi/2.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub tilt: Option<f64>,
}

impl Event {
    /// Returns an event that was certain at once.
    pub fn new(kind: EventKind, time: f64, grains: &[usize]) -> Event {
        Event {
            time,
            kind,
            grains: grains.to_vec(),
            wall: None,
            confirmed: time,
            gap: None,
            tilt: None,
        }
    }

    /// Returns the line of the log, with its line break.
    ///
    /// # Errors
    /// [`serde_json::Error`] for a number that is not finite.
    pub fn to_line(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string(self).map(|text| text + "\n")
    }
}

/// Reads the log in order of time. An unfinished last line is left out and noted.
///
/// # Errors
/// [`FormatError`] with the first damaged line.
pub fn read(file: &Path, notes: &mut Vec<String>) -> Result<Vec<Event>, FormatError> {
    let text = read_text(file)?;
    let complete = text.is_empty() || text.ends_with('\n');
    let count = text.lines().count();
    let mut events: Vec<Event> = Vec::new();
    for (i, line) in text.lines().enumerate() {
        if line.trim().is_empty() {
            continue;
        }
        match serde_json::from_str(line) {
            Ok(event) => events.push(event),
            Err(_) if i + 1 == count && !complete => notes.push(unfinished_line(file, count)),
            Err(error) => return Err(FormatError::line(file, i + 1, error.to_string())),
        }
    }
    events.sort_by(|a, b| a.time.total_cmp(&b.time));
    Ok(events)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_content(content: &str) -> (Result<Vec<Event>, FormatError>, Vec<String>) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("events.jsonl");
        std::fs::write(&file, content).unwrap();
        let mut notes = Vec::new();
        (read(&file, &mut notes), notes)
    }

    #[test]
    fn a_log_survives_a_round_trip_in_order_of_time() {
        let mut separation = Event::new(EventKind::Separation, 0.5, &[0, 1]);
        separation.gap = Some(1e-4);
        let kiss = Event::new(EventKind::Kiss, 0.2, &[0, 1]);
        let log = separation.to_line().unwrap() + &kiss.to_line().unwrap();
        assert_eq!(read_content(&log).0.unwrap(), [kiss, separation]);
    }

    #[test]
    fn damage_is_reported_with_its_line() {
        let good = Event::new(EventKind::Kiss, 0.2, &[]).to_line().unwrap();
        let message = |bad: &str| {
            let (read, _) = read_content(&format!("{good}{bad}\n{good}"));
            read.unwrap_err().to_string()
        };
        assert!(message("{\"event\":\"kiss\"}").contains("line 2: missing field `time`"));
        assert!(message("{\"time\":1}").contains("missing field `event`"));
        let negative = "{\"time\":1,\"event\":\"kiss\",\"grains\":[-1],\"confirmed\":1}";
        assert!(message(negative).contains("invalid value"));
        assert!(message("[1]").contains("line 2"));
        let (events, notes) = read_content(&format!("{good}{{\"time\":0.3,\"ev"));
        assert_eq!(events.unwrap().len(), 1);
        assert!(notes[0].contains("unfinished"));
    }
}
