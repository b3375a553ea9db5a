//! The text of a TOML file with its overrides, its keys and their places.

use std::ops::Range;

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue, Deserializer};

use super::error::Problem;
use super::suggest::nearest;

/// A TOML file and the `key=value` overrides that follow it. Spans count on through the
/// overrides as if they stood below the file, so that one range says where a value came from.
pub struct Source {
    name: String,
    text: String,
    overrides: Vec<Override>,
    keys: Vec<(Range<usize>, String)>,
}

struct Override {
    start: usize,
    line: String,
}

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
            keys: Vec::new(),
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
            merge(table.get_mut(), extra.into_inner())
                .map_err(|m| Problem::new(format!("--set {line}: {m}")))?;
        }
        collect_keys(table.get_ref(), "", &mut source.keys);
        let value = T::deserialize(Deserializer::from(table)).map_err(|e| source.located(&e))?;
        Ok((source, value))
    }

    /// Dotted key of the innermost key or value that holds `span`.
    pub fn key_at(&self, span: &Range<usize>) -> Option<&str> {
        self.keys
            .iter()
            .filter(|(range, _)| {
                range.start <= span.start && span.end <= range.end.max(range.start + 1)
            })
            .min_by_key(|(range, _)| range.len())
            .map(|(_, key)| key.as_str())
    }

    /// Fills in the place and key of a problem.
    pub fn locate(&self, problem: Problem, span: Option<&Range<usize>>, label: &str) -> Problem {
        let Some(span) = span else { return problem };
        let problem = match (&problem.key, self.key_at(span)) {
            (None, Some(key)) => problem.key(key),
            _ => problem,
        };
        match self.overrides.iter().rev().find(|o| o.start <= span.start) {
            Some(o) => problem.at(
                "--set",
                &o.line,
                span.start - o.start..span.end - o.start,
                label,
            ),
            None => problem.at(&self.name, &self.text, span.clone(), label),
        }
    }

    /// Rewords an error of the TOML reader in the terms of the file.
    fn located(&self, error: &toml::de::Error) -> Problem {
        let message = error.message();
        let span = error.span();
        let words: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
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
                format!("wrong kind of value: found {rest}"),
                "here".into(),
                None,
            )
        } else {
            (message.trim_end().replace('\n', "; "), "here".into(), None)
        };
        let mut problem = Problem::new(text);
        problem.help = help;
        self.locate(problem, span.as_ref(), &label)
    }
}

/// "time.end=0.5" -> "time.end = 0.5"; a value that is not TOML is taken as a string.
fn override_line(item: &str) -> Result<String, Problem> {
    let usage = "write key=value, for example --set time.end=0.5 or --set grain.0.density=2600";
    let (key, value) = item
        .split_once('=')
        .ok_or_else(|| Problem::new(format!("--set {item}: there is no `=`")).help(usage))?;
    let (key, value) = (key.trim(), value.trim());
    let plain = |part: &str| {
        !part.is_empty()
            && part
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
    };
    if !key.split('.').all(plain) {
        return Err(Problem::new(format!("--set {item}: `{key}` is not a key")).help(usage));
    }
    let as_toml = format!("{key} = {value}");
    if !value.is_empty() && !value.contains('\n') && DeTable::parse(&as_toml).is_ok() {
        return Ok(as_toml);
    }
    let escaped: String = value.chars().flat_map(char::escape_default).collect();
    Ok(format!(
        "{key} = \"{}\"",
        if value.is_ascii() {
            escaped
        } else {
            value.replace('\\', "\\\\").replace('"', "\\\"")
        }
    ))
}

fn merge<'i>(base: &mut DeTable<'i>, extra: DeTable<'i>) -> Result<(), String> {
    for (key, value) in extra {
        let name = key.get_ref().to_string();
        let old = base.get_mut(&key).map(|v| v.get_mut());
        match (old, value.get_ref()) {
            (Some(DeValue::Table(_)), DeValue::Table(_)) => {
                if let (Some(DeValue::Table(old)), DeValue::Table(new)) =
                    (base.get_mut(&key).map(|v| v.get_mut()), value.into_inner())
                {
                    merge(old, new)?;
                }
            }
            // `{ formula = ... }` in place of `[x, y, z]`, not `vector.0 = ...`.
            (Some(DeValue::Array(items)), DeValue::Table(new))
                if items.iter().all(|item| !item.get_ref().is_table())
                    && new
                        .keys()
                        .all(|key| key.get_ref().parse::<usize>().is_err()) =>
            {
                base.remove(&key);
                base.insert(key, value);
            }
            (Some(DeValue::Array(items)), DeValue::Table(_)) => {
                let DeValue::Table(new) = value.into_inner() else {
                    continue;
                };
                let count = items.len();
                for (index, item) in new {
                    let at: usize = index.get_ref().parse().map_err(|_| {
                        format!("`{name}` is a list: write {name}.0 for its first element")
                    })?;
                    let slot = items.get_mut(at).ok_or_else(|| format!("`{name}` has {count} elements, there is no number {at} (they count from 0)"))?;
                    match (slot.get_mut(), item.get_ref()) {
                        (DeValue::Table(_), DeValue::Table(_)) => {
                            if let (DeValue::Table(old), DeValue::Table(new)) =
                                (slot.get_mut(), item.into_inner())
                            {
                                merge(old, new)?;
                            }
                        }
                        _ => *slot = item,
                    }
                }
            }
            _ => {
                // The map would keep the old key and its place.
                base.remove(&key);
                base.insert(key, value);
            }
        }
    }
    Ok(())
}

fn collect_keys(table: &DeTable<'_>, prefix: &str, keys: &mut Vec<(Range<usize>, String)>) {
    for (key, value) in table {
        let path = if prefix.is_empty() {
            key.get_ref().to_string()
        } else {
            format!("{prefix}.{}", key.get_ref())
        };
        keys.push((key.span(), path.clone()));
        collect_value(value, &path, keys);
    }
}

fn collect_value(
    value: &serde_spanned::Spanned<DeValue<'_>>,
    path: &str,
    keys: &mut Vec<(Range<usize>, String)>,
) {
    keys.push((value.span(), path.to_string()));
    match value.get_ref() {
        DeValue::Table(table) => collect_keys(table, path, keys),
        DeValue::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                collect_value(item, &format!("{path}.{index}"), keys);
            }
        }
        _ => {}
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
    fn broken_toml_is_located() {
        let p = problem("[fluid\ndensity = 1\n", &[]);
        assert_eq!(p.place().unwrap().1, 1);
    }
}
