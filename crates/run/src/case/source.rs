//! Text of a TOML file with its overrides, keys and positions.

use std::cmp::Reverse;
use std::ops::Range;

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue, Deserializer};

use super::error::Problem;
use super::overrides::{override_line, override_table, remove_key};
use super::suggest::{did_you_mean, nearest};
use super::toml_messages::{plainly, wrong_kind};

/// TOML file with its `key=value` overrides. Spans count as if the overrides followed the file, so
/// that one range identifies the origin of a value.
#[derive(Debug)]
pub struct Source {
    name: String,
    text: String,
    overrides: Vec<Override>,
    entries: Vec<Entry>,
}

#[derive(Debug)]
struct Override {
    start: usize,
    line: String,
}

/// Key or value with its position.
#[derive(Debug)]
struct Entry {
    span: Range<usize>,
    path: String,
    kind: EntryKind,
}

/// Kind of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum EntryKind {
    /// A key.
    Key,
    /// A number without a unit.
    Bare,
    /// A list or table whose span contains its contents.
    Inline,
    /// Another value.
    Other,
}

/// Mandatory tables of a case with their mandatory keys.
const NEEDED: [(&str, &str); 2] = [
    ("domain", "size = [...] and cell_size = ..."),
    ("time", "end = ..., for example end = \"1 s\""),
];

/// Tables that a case has once. [run] is missing: other files have a list of that name.
const SINGLE: [&str; 7] = ["domain", "fluid", "coupling", "contact", "time", "output", "expect"];

impl Source {
    /// Reads the text of a file called `name` and applies overrides: `-time.step` removes a key,
    /// `time.end=0.5` sets one. Each applies to the result of those before it.
    ///
    /// # Errors
    /// The first problem, with its position.
    pub fn parse<T: DeserializeOwned>(
        name: &str,
        text: &str,
        overrides: &[String],
    ) -> Result<(Source, T), Problem> {
        admit(name, text)?;
        let mut source = Source {
            name: name.into(),
            text: text.into(),
            overrides: Vec::new(),
            entries: Vec::new(),
        };
        let mut start = text.len() + 1;
        for item in overrides.iter().filter(|item| !item.starts_with('-')) {
            let line = override_line(item)?;
            let length = line.len() + 1;
            source.overrides.push(Override { start, line });
            start += length;
        }
        let mut table = DeTable::parse(text).map_err(|e| source.located(&e))?;
        // Each override is parsed after as many blanks as there is text before it, which makes its
        // spans count from the start of the file.
        let padded: Vec<String> =
            source.overrides.iter().map(|o| format!("{}{}", " ".repeat(o.start), o.line)).collect();
        let mut padded = padded.iter();
        for line in overrides {
            if let Some(key) = line.strip_prefix('-') {
                remove_key(table.get_mut(), key)?;
                continue;
            }
            let Some(item) = padded.next() else { break };
            let extra = DeTable::parse(item).map_err(|e| source.located(&e))?;
            let key = line.split_once('=').map_or(line.as_str(), |(key, _)| key).trim();
            let parts = key.split('.').count();
            override_table(table.get_mut(), extra.into_inner(), parts)
                .map_err(|m| Problem::new(m).key(key).at("--set", line, 0..key.len(), "here"))?;
        }
        collect_keys(table.get_ref(), "", text, &mut source.entries);
        let value = T::deserialize(Deserializer::from(table)).map_err(|e| source.located(&e))?;
        Ok((source, value))
    }

    /// Returns the dotted key of the innermost key or value that contains `span`.
    pub fn key_at(&self, span: &Range<usize>) -> Option<&str> {
        // A list of tables and its first element have the same span.
        let is_element = |path: &str| path.ends_with(|c: char| c.is_ascii_digit());
        self.entries
            .iter()
            .filter(|e| e.span.start <= span.start && span.end <= e.span.end.max(e.span.start + 1))
            .min_by_key(|e| (e.span.len(), !is_element(&e.path)))
            .map(|e| e.path.as_str())
    }

    /// Returns the position of the value of `key`; none if the file does not give it.
    pub(super) fn value_of(&self, key: &str) -> Option<&Range<usize>> {
        let values = self.entries.iter().filter(|entry| entry.kind != EntryKind::Key);
        values.filter(|entry| entry.path == key).map(|entry| &entry.span).next()
    }

    /// Returns whether a value at `key` or below it is a number without a unit.
    pub(super) fn is_bare(&self, key: &str) -> bool {
        let under = |path: &str| {
            path.strip_prefix(key).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        self.entries.iter().any(|p| p.kind == EntryKind::Bare && under(&p.path))
    }

    /// Returns whether an override set the value at `span` or a part of it.
    pub(super) fn is_overridden(&self, span: &Range<usize>) -> bool {
        self.override_at(span.start).is_some() || self.changed_part(span).is_some()
    }

    /// Returns the override that contains this byte.
    fn override_at(&self, start: usize) -> Option<&Override> {
        self.overrides.iter().rev().find(|o| o.start <= start)
    }

    /// Returns the part of a list or table of the file that the last override changed: the text at
    /// `span` is then outdated.
    fn changed_part(&self, span: &Range<usize>) -> Option<Range<usize>> {
        let is_whole = |p: &&Entry| p.span == *span && p.kind == EntryKind::Inline;
        let under = format!("{}.", self.entries.iter().find(is_whole)?.path);
        let parts =
            self.entries.iter().filter(|p| p.kind != EntryKind::Key && p.path.starts_with(&under));
        let last = parts
            .filter_map(|p| Some((self.override_at(p.span.start)?.start, p)))
            .max_by_key(|(start, p)| (*start, Reverse(p.path.len())));
        last.map(|(_, part)| part.span.clone())
    }

    /// Adds the position and key to a problem.
    pub fn locate(&self, problem: Problem, span: Option<&Range<usize>>, label: &str) -> Problem {
        let Some(span) = span else { return problem };
        let problem = match (&problem.key, self.key_at(span)) {
            (None, Some(key)) => problem.key(key),
            _ => problem,
        };
        let (span, label) = match self.changed_part(span) {
            Some(part) => (part, "changed here"),
            None => (span.clone(), label),
        };
        match self.override_at(span.start) {
            Some(o) => {
                problem.at("--set", &o.line, span.start - o.start..span.end - o.start, label)
            }
            None => problem.at(&self.name, &self.text, span, label),
        }
    }

    /// Returns a problem of the value at `span`, with its remedy, position and key.
    pub fn problem(
        &self,
        message: impl Into<String>,
        help: impl Into<String>,
        span: Option<&Range<usize>>,
        label: &str,
    ) -> Problem {
        self.locate(Problem::new(message).help(help), span, label)
    }

    /// Rewords an error of the TOML reader in the terms of the file.
    fn located(&self, error: &toml::de::Error) -> Problem {
        if let Some(problem) = self.doubled_brackets() {
            return problem;
        }
        let message = error.message();
        let span = error.span();
        let words: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
        // The whole file has an empty span.
        let of_file = span.as_ref().is_none_or(Range::is_empty);
        if let (true, true, [key, ..]) = (of_file, message.starts_with("missing field"), &words[..])
        {
            return self.missing_in_file(key);
        }
        let owner = span.as_ref().and_then(|s| self.key_at(s)).unwrap_or_default().to_string();
        let (text, label, help) = match words[..] {
            [key, ref known @ ..] if message.starts_with("unknown field") => {
                let parent = (owner.rsplit_once('.'))
                    .map_or("the file".into(), |(parent, _)| format!("`{parent}`"));
                let hint = nearest(key, known.iter().copied());
                let known = known.join(", ");
                let help = match (hint, shape_help(&owner)) {
                    (Some(hint), _) => format!("did you mean `{hint}`? Keys of {parent}: {known}"),
                    (None, Some(help)) => format!("{help}; keys of {parent}: {known}"),
                    (None, None) => format!("keys of {parent}: {known}"),
                };
                let label =
                    hint.map_or("not a key here".into(), |hint| format!("did you mean `{hint}`?"));
                (format!("unknown key `{key}`"), label, Some(help))
            }
            [key, ..] if message.starts_with("missing field") => (
                format!("the key `{key}` is missing"),
                format!("`{key}` is needed here"),
                Some(format!("add `{key} = ...`; `grainwake schema` lists every key")),
            ),
            [word, ref known @ ..] if message.starts_with("unknown variant") => {
                let hint = did_you_mean(word, known.iter().copied());
                let help = format!("{hint}Accepted: {}", known.join(", "));
                (format!("unknown value \"{word}\""), "not accepted".into(), Some(help))
            }
            _ => {
                let kind = (message.strip_prefix("invalid type: "))
                    .or_else(|| message.strip_prefix("invalid value: "));
                let text = match kind {
                    Some(kind) => {
                        let text = format!("wrong kind of value: {}", wrong_kind(kind));
                        match owner.starts_with("domain.cells") {
                            true => text.replace("zero or more", "1 or more"),
                            false => text,
                        }
                    }
                    None => plainly(message),
                };
                let help = match message {
                    "duplicate key" => Some(
                        "each key and table is written once; rows of a list such as the grains \
                         have double brackets: [[grain]]"
                            .to_owned(),
                    ),
                    _ if text.ends_with("found a table, expected a list") => {
                        Some(format!("each row of this list has double brackets: [[{owner}]]"))
                    }
                    _ => shape_help(&owner),
                };
                (text, "here".into(), help)
            }
        };
        let mut problem = Problem::new(text);
        problem.help = help;
        self.locate(problem, span.as_ref(), &label)
    }

    /// Returns the problem of a list of tables in place of a single one. The reader would take its
    /// first table for the value of the first key.
    fn doubled_brackets(&self) -> Option<Problem> {
        let is_list = |name: &&str| {
            let first = self.value_of(&format!("{name}.0"));
            let text = first.and_then(|span| self.text.get(span.clone()));
            text.is_some_and(|text| text.starts_with("[["))
        };
        let name = SINGLE.into_iter().find(is_list)?;
        let problem = Problem::new("found a list of tables, expected one table").key(name);
        let help = format!("write it once, with single brackets: [{name}]");
        Some(self.locate(problem.help(help), self.value_of(name), "here"))
    }

    /// Returns the problem of a missing top-level key or table, which has no position.
    fn missing_in_file(&self, key: &str) -> Problem {
        let (what, help) = match NEEDED.iter().find(|(table, _)| *table == key) {
            Some((table, with)) => (format!("table [{table}]"), format!("[{table}] with {with}")),
            None => (format!("key `{key}`"), format!("`{key} = ...`")),
        };
        Problem::new(format!("the {what} is missing in {}", self.name))
            .key(key)
            .help(format!("add {help}; `grainwake schema` lists every key"))
    }
}

/// Refuses text of another kind than TOML, for which the messages of its reader make no sense.
fn admit(name: &str, text: &str) -> Result<(), Problem> {
    let is_binary = text.chars().any(|c| c.is_ascii_control() && !c.is_whitespace());
    let is_json = text.trim_start().starts_with('{');
    if !is_binary && !is_json {
        return Ok(());
    }
    let what = if is_binary { "not a file of text" } else { "JSON, not TOML" };
    let help = "expected is a TOML file with lines such as `key = value` and `[table]`";
    Err(Problem::new(format!("{name} is {what}")).help(help))
}

/// Remedy for a wrong value of a key `shape` or `shapes`, or inside of it.
fn shape_help(path: &str) -> Option<String> {
    let word = path.split('.').find_map(|word| match word {
        "shape" => Some("`file = \"x.grain\"`"),
        "shapes" => Some("`files = [\"x.grain\"]`"),
        _ => None,
    })?;
    Some(format!(
        "a closed form is {{ kind = \"sphere\", diameter = \"2 mm\" }}; a grain file is {word} instead"
    ))
}

fn collect_keys(table: &DeTable<'_>, prefix: &str, text: &str, entries: &mut Vec<Entry>) {
    for (key, value) in table {
        let path = if prefix.is_empty() {
            key.get_ref().to_string()
        } else {
            format!("{prefix}.{}", key.get_ref())
        };
        entries.push(Entry { span: key.span(), path: path.clone(), kind: EntryKind::Key });
        collect_value(value, &path, text, entries);
    }
}

fn collect_value(
    value: &serde_spanned::Spanned<DeValue<'_>>,
    path: &str,
    text: &str,
    entries: &mut Vec<Entry>,
) {
    entries.push(Entry { span: value.span(), path: path.to_string(), kind: kind(value, text) });
    match value.get_ref() {
        DeValue::Table(table) => collect_keys(table, path, text, entries),
        DeValue::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                collect_value(item, &format!("{path}.{index}"), text, entries);
            }
        }
        _ => {}
    }
}

fn kind(value: &serde_spanned::Spanned<DeValue<'_>>, text: &str) -> EntryKind {
    // The span of a table with a header is its header; a list of tables has the first header.
    let starts_with =
        |span: Range<usize>, mark: char| text.get(span).is_some_and(|text| text.starts_with(mark));
    match value.get_ref() {
        DeValue::Integer(_) | DeValue::Float(_) => EntryKind::Bare,
        DeValue::String(word) if word.trim().parse::<f64>().is_ok() => EntryKind::Bare,
        DeValue::Table(_) if starts_with(value.span(), '{') => EntryKind::Inline,
        DeValue::Array(items)
            if starts_with(value.span(), '[') && items.iter().all(|i| !i.get_ref().is_table()) =>
        {
            EntryKind::Inline
        }
        _ => EntryKind::Other,
    }
}

#[cfg(test)]
mod tests;
