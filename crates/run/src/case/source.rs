//! The text of a TOML file with its overrides, its keys and their places.

use std::cmp::Reverse;
use std::ops::Range;

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue, Deserializer};

use super::error::Problem;
use super::overrides::{lay_over, override_line};
use super::suggest::nearest;
use super::wording::{plainly, wrong_kind};

/// A TOML file and the `key=value` overrides that follow it. Spans count on through the
/// overrides as if they stood below the file, so that one range says where a value came from.
pub struct Source {
    name: String,
    text: String,
    overrides: Vec<Override>,
    places: Vec<Place>,
}

struct Override {
    start: usize,
    line: String,
}

/// A key or a value, and where it stands.
struct Place {
    span: Range<usize>,
    path: String,
    written: Written,
}

/// What stands at a place.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Written {
    /// A key.
    Key,
    /// A number without a unit.
    Bare,
    /// A list or table whose contents lie within its place.
    Inline,
    /// Another value.
    Other,
}

/// Tables that a case cannot do without, and what they need.
const NEEDED: [(&str, &str); 2] = [
    ("domain", "size = [...] and cell_size = ..."),
    ("time", "end = ..., for example end = \"1 s\""),
];

impl Source {
    /// Reads the text of a file called `name` and applies overrides such as `time.end=0.5`.
    ///
    /// # Errors
    /// What is wrong, with its place.
    pub fn parse<T: DeserializeOwned>(
        name: &str,
        text: &str,
        overrides: &[String],
    ) -> Result<(Source, T), Problem> {
        let mut source = Source {
            name: name.into(),
            text: text.into(),
            overrides: Vec::new(),
            places: Vec::new(),
        };
        let mut start = text.len() + 1;
        for item in overrides {
            let line = override_line(item)?;
            let length = line.len() + 1;
            source.overrides.push(Override { start, line });
            start += length;
        }
        let mut table = DeTable::parse(text).map_err(|e| source.located(&e))?;
        // Each override is parsed behind as many blanks as there is text before it: its spans are right as they come.
        let padded: Vec<String> = source
            .overrides
            .iter()
            .map(|o| format!("{}{}", " ".repeat(o.start), o.line))
            .collect();
        for (item, line) in padded.iter().zip(overrides) {
            let extra = DeTable::parse(item).map_err(|e| source.located(&e))?;
            let parts = line
                .split('=')
                .next()
                .map_or(1, |key| key.split('.').count());
            lay_over(table.get_mut(), extra.into_inner(), parts)
                .map_err(|m| Problem::new(format!("--set {line}: {m}")))?;
        }
        collect_keys(table.get_ref(), "", text, &mut source.places);
        let value = T::deserialize(Deserializer::from(table)).map_err(|e| source.located(&e))?;
        Ok((source, value))
    }

    /// Dotted key of the innermost key or value that holds `span`.
    pub fn key_at(&self, span: &Range<usize>) -> Option<&str> {
        self.places
            .iter()
            .filter(|p| p.span.start <= span.start && span.end <= p.span.end.max(p.span.start + 1))
            .min_by_key(|p| p.span.len())
            .map(|p| p.path.as_str())
    }

    /// Whether a value at `key` or under it is a number without a unit.
    pub(super) fn is_bare(&self, key: &str) -> bool {
        let under = |path: &str| {
            path.strip_prefix(key)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        self.places
            .iter()
            .any(|p| p.written == Written::Bare && under(&p.path))
    }

    /// Whether an override set what stands at `span`, or a part of it.
    pub(super) fn is_overridden(&self, span: &Range<usize>) -> bool {
        self.override_at(span.start).is_some() || self.changed_part(span).is_some()
    }

    /// The override in which this byte lies.
    fn override_at(&self, start: usize) -> Option<&Override> {
        self.overrides.iter().rev().find(|o| o.start <= start)
    }

    /// Of a list or table of the file: the part that the last override changed. What stands at
    /// `span` is then not what counts.
    fn changed_part(&self, span: &Range<usize>) -> Option<Range<usize>> {
        let is_whole = |p: &&Place| p.span == *span && p.written == Written::Inline;
        let under = format!("{}.", self.places.iter().find(is_whole)?.path);
        let parts = self
            .places
            .iter()
            .filter(|p| p.written != Written::Key && p.path.starts_with(&under));
        let last = parts
            .filter_map(|p| Some((self.override_at(p.span.start)?.start, p)))
            .max_by_key(|(start, p)| (*start, Reverse(p.path.len())));
        last.map(|(_, part)| part.span.clone())
    }

    /// Fills in the place and key of a problem.
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
            Some(o) => problem.at(
                "--set",
                &o.line,
                span.start - o.start..span.end - o.start,
                label,
            ),
            None => problem.at(&self.name, &self.text, span, label),
        }
    }

    /// Rewords an error of the TOML reader in the terms of the file.
    fn located(&self, error: &toml::de::Error) -> Problem {
        let message = error.message();
        let span = error.span();
        let words: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
        // The whole file has an empty span.
        let of_file = span.as_ref().is_none_or(Range::is_empty);
        if let (true, true, [key, ..]) = (of_file, message.starts_with("missing field"), &words[..])
        {
            return self.missing_in_file(key);
        }
        let owner = span
            .as_ref()
            .and_then(|s| self.key_at(s))
            .unwrap_or_default()
            .to_string();
        let (text, label, help) = if message.starts_with("unknown field") && !words.is_empty() {
            let known = &words[1..];
            let parent = owner
                .rsplit_once('.')
                .map_or("the file".to_string(), |(p, _)| format!("`{p}`"));
            let hint = nearest(words[0], known.iter().copied());
            let help = match hint {
                Some(key) => format!(
                    "did you mean `{key}`? Keys of {parent}: {}",
                    known.join(", ")
                ),
                None => format!("keys of {parent}: {}", known.join(", ")),
            };
            (
                format!("unknown key `{}`", words[0]),
                hint.map_or("not a key here".into(), |k| format!("did you mean `{k}`?")),
                Some(help),
            )
        } else if message.starts_with("missing field") && !words.is_empty() {
            (
                format!("the key `{}` is missing", words[0]),
                format!("`{}` is needed here", words[0]),
                Some(format!(
                    "add `{} = ...`; `grainwake schema` lists every key",
                    words[0]
                )),
            )
        } else if message.starts_with("unknown variant") && !words.is_empty() {
            let known = &words[1..];
            let hint = nearest(words[0], known.iter().copied())
                .map_or(String::new(), |w| format!("did you mean \"{w}\"? "));
            (
                format!("unknown value \"{}\"", words[0]),
                "not accepted".into(),
                Some(format!("{hint}Accepted: {}", known.join(", "))),
            )
        } else if let Some(rest) = message
            .strip_prefix("invalid type: ")
            .or_else(|| message.strip_prefix("invalid value: "))
        {
            (
                format!("wrong kind of value: {}", wrong_kind(rest)),
                "here".into(),
                None,
            )
        } else {
            (plainly(message), "here".into(), None)
        };
        let mut problem = Problem::new(text);
        problem.help = help;
        self.locate(problem, span.as_ref(), &label)
    }

    /// A key or table of the file as a whole is missing: there is no line to point at.
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

fn collect_keys(table: &DeTable<'_>, prefix: &str, text: &str, places: &mut Vec<Place>) {
    for (key, value) in table {
        let path = if prefix.is_empty() {
            key.get_ref().to_string()
        } else {
            format!("{prefix}.{}", key.get_ref())
        };
        places.push(Place {
            span: key.span(),
            path: path.clone(),
            written: Written::Key,
        });
        collect_value(value, &path, text, places);
    }
}

fn collect_value(
    value: &serde_spanned::Spanned<DeValue<'_>>,
    path: &str,
    text: &str,
    places: &mut Vec<Place>,
) {
    places.push(Place {
        span: value.span(),
        path: path.to_string(),
        written: written(value, text),
    });
    match value.get_ref() {
        DeValue::Table(table) => collect_keys(table, path, text, places),
        DeValue::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                collect_value(item, &format!("{path}.{index}"), text, places);
            }
        }
        _ => {}
    }
}

fn written(value: &serde_spanned::Spanned<DeValue<'_>>, text: &str) -> Written {
    // The place of a table with a header is that header, and of a list of them the first.
    let starts_with = |span: Range<usize>, mark: char| {
        text.get(span)
            .is_some_and(|written| written.starts_with(mark))
    };
    match value.get_ref() {
        DeValue::Integer(_) | DeValue::Float(_) => Written::Bare,
        DeValue::String(word) if word.trim().parse::<f64>().is_ok() => Written::Bare,
        DeValue::Table(_) if starts_with(value.span(), '{') => Written::Inline,
        DeValue::Array(items)
            if starts_with(value.span(), '[') && items.iter().all(|i| !i.get_ref().is_table()) =>
        {
            Written::Inline
        }
        _ => Written::Other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASE: &str = "[fluid]\ndensity = 1000\nviscosity = \"1 mPa s\"\n\n[domain]\nsize = [1, 1, 1]\ncells = [4, 4, 4]\n\n[time]\nend = 1\n\n[[grain]]\ndensity = 2000\nshape = { kind = \"sphere\", diameter = 0.1 }\n";

    use super::super::raw::RawCase;

    fn problem(text: &str, sets: &[&str]) -> Problem {
        let sets: Vec<String> = sets.iter().map(|s| (*s).to_string()).collect();
        match Source::parse::<RawCase>("case.toml", text, &sets) {
            Ok(_) => panic!("accepted"),
            Err(problem) => problem,
        }
    }

    #[test]
    fn a_good_case_is_read() {
        let (_, case): (_, RawCase) = Source::parse("case.toml", CASE, &[]).unwrap();
        assert_eq!(case.fluid.unwrap().viscosity.as_ref().unwrap().si, 1e-3);
        assert_eq!(case.time.end.si, 1.0);
        assert_eq!(case.grain.len(), 1);
    }

    #[test]
    fn a_mistyped_key_is_located_and_corrected() {
        let p = problem(&CASE.replace("viscosity", "visocsity"), &[]);
        assert_eq!(p.place(), Some(("case.toml", 3, 1)));
        assert_eq!(p.key.as_deref(), Some("fluid.visocsity"));
        assert!(p.help.unwrap().contains("`viscosity`"));
    }

    #[test]
    fn a_wrong_unit_is_located() {
        let p = problem(&CASE.replace("1 mPa s", "1 mm"), &[]);
        assert_eq!(p.place(), Some(("case.toml", 3, 13)));
        assert!(
            p.message.contains("is a length") && p.message.contains("1 mPa s"),
            "{p}"
        );
        let p = problem(&CASE.replace("diameter = 0.1", "diameter = \"1 s\""), &[]);
        assert_eq!(p.key.as_deref(), Some("grain.0.shape.diameter"));
    }

    #[test]
    fn overrides_reach_tables_and_lists() {
        let sets = [
            "time.end=2".to_string(),
            "fluid.viscosity=2 mPa s".into(),
            "grain.0.density=\"2 g/cm3\"".into(),
            "contact.friction=0.1".into(),
        ];
        let (_, case): (_, RawCase) = Source::parse("case.toml", CASE, &sets).unwrap();
        assert_eq!(case.time.end.si, 2.0);
        assert_eq!(case.fluid.unwrap().viscosity.as_ref().unwrap().si, 2e-3);
        assert_eq!(case.grain[0].density.si, 2000.0);
        assert_eq!(case.contact.friction.si, 0.1);
    }

    #[test]
    fn a_wrong_override_is_located_on_its_own_line() {
        let p = problem(CASE, &["time.end=1", "time.endd=2"]);
        assert_eq!(p.place(), Some(("--set", 1, 6)));
        assert!(p.help.unwrap().contains("`end`"));
        let p = problem(CASE, &["time.end=2 mm"]);
        assert_eq!(p.place().unwrap().0, "--set");
        assert!(problem(CASE, &["nonsense"]).message.contains("no `=`"));
        assert!(
            problem(CASE, &["grain.3.density=1"])
                .message
                .contains("no number 3")
        );
    }

    #[test]
    fn what_an_override_changed_is_shown_instead_of_the_file() {
        let text = CASE.replace(
            "end = 1",
            "end = 1\nstop = { when = \"rest\", hold = \"1 s\" }",
        );
        let set = [
            "time.stop.hold=-1".to_string(),
            "grain.0.shape.diameter=2".into(),
        ];
        let (source, case): (_, RawCase) = Source::parse("case.toml", &text, &set).unwrap();
        let stop = case.time.stop.unwrap();
        let p = source.locate(Problem::new("wrong"), stop.span.as_ref(), "here");
        assert_eq!(p.place(), Some(("--set", 1, 18)));
        assert_eq!(p.key.as_deref(), Some("time.stop"));
        assert!(source.is_overridden(&stop.span.unwrap()));
        // A header does not hold its values: it is right whatever they are.
        let grain = case.grain[0].span.clone().unwrap();
        let p = source.locate(Problem::new("wrong"), Some(&grain), "here");
        assert_eq!(p.place().map(|(name, ..)| name), Some("case.toml"));
        assert!(!source.is_overridden(&grain));
    }

    #[test]
    fn bare_numbers_are_known() {
        let set = [
            "time.end=2 s".to_string(),
            "grain.0.shape.diameter=2".into(),
        ];
        let (source, _): (_, RawCase) = Source::parse("case.toml", CASE, &set).unwrap();
        assert!(source.is_bare("grain.0.density") && source.is_bare("grain.0.shape"));
        assert!(source.is_bare("domain.size.1") && !source.is_bare("domain.size.3"));
        assert!(!source.is_bare("time.end") && !source.is_bare("fluid.visc"));
    }

    #[test]
    fn a_missing_table_is_named() {
        let p = problem(&CASE.replace("[time]\nend = 1\n", ""), &[]);
        assert_eq!(p.message, "the table [time] is missing in case.toml");
        assert!(
            p.help.as_ref().unwrap().contains("add [time] with end ="),
            "{p:?}"
        );
        assert_eq!((p.key.as_deref(), p.place()), (Some("time"), None));
        // What is missing in a table is told of that table.
        let two = format!("{CASE}\n[[grain]]\nshape = {{ kind = \"sphere\", diameter = 0.1 }}\n");
        let p = problem(&two, &[]);
        assert_eq!(p.key.as_deref(), Some("grain.1"));
        assert_eq!(p.place().map(|(_, line, _)| line), Some(16));
    }

    #[test]
    fn kinds_of_values_have_plain_names() {
        for (set, words) in [
            (
                "run.threads=-1",
                "found -1, expected a whole number, zero or more",
            ),
            (
                "run.threads=1.5",
                "found 1.5, expected a whole number, zero or more",
            ),
            ("fluid=3", "found 3, expected a table of keys and values"),
            ("packing=3", "found 3, expected a list"),
            ("title=3", "found 3, expected text in quotes"),
            ("output.at_events=3", "found 3, expected true or false"),
            ("grain.0.file=true", "found true, expected text in quotes"),
            (
                "grain.0.orientation=[1, 2, \"a\", 3]",
                "the text \"a\", expected a number",
            ),
            (
                "domain.cells=[5, 5]",
                "found 2 values, expected a list of 3 values",
            ),
            ("fluid.advection=3", "expected text in quotes"),
        ] {
            let p = problem(CASE, &[set]);
            assert!(p.message.contains(words), "{set}: {p}");
        }
    }

    #[test]
    fn broken_toml_is_located() {
        let p = problem("[fluid\ndensity = 1\n", &[]);
        assert_eq!(p.place().unwrap().1, 1);
    }
}
