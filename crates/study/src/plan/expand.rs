//! Expansion of a study file into models: every combination of the axes, then single models.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

use grainwake_run::case::{Located, Problem, Source, did_you_mean};
use toml::Value;

use super::quantities::is_column;
use super::raw::{RawAxis, RawFactors, RawModel, RawSet, RawStudy, RawValue};
use super::{Factors, Levels};

/// Largest number of runs of a study.
pub(crate) const MOST_RUNS: usize = 100_000;

/// Largest number of characters of the name of a model; members have a suffix.
const LONGEST_NAME: usize = 200;

/// Override of one case key.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Dotted key of the case, "grain.0.file".
    pub key: String,
    /// Value in TOML, on one line.
    pub value: String,
    /// Location in the study file.
    pub span: Option<Range<usize>>,
}

impl Setting {
    /// Returns the override in the syntax of `--set`.
    pub fn text(&self) -> String {
        format!("{}={}", self.key, self.value)
    }
}

/// One point of the parameter space: a base case with overrides.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// Names of its levels joined by "-", as in "g04-o1", or the name of a single model.
    pub name: String,
    /// Base case.
    pub base: PathBuf,
    /// Overrides of the base case; later ones take precedence.
    pub settings: Vec<Setting>,
    /// Level on each axis; empty for a model outside the axes.
    pub levels: Levels,
    /// Numerical factors for the analysis.
    pub factors: Factors,
}

/// Expands a study file into models.
///
/// # Errors
/// All problems found, with their location.
pub(crate) fn expand(
    source: &Source,
    raw: &RawStudy,
    folder: &Path,
) -> Result<Vec<Model>, Vec<Problem>> {
    let mut problems = Problems { source, found: Vec::new() };
    let base = problems.case_file(folder, raw.base.as_ref());
    let common = settings(&raw.set);
    let mut models = Vec::new();
    if !raw.axis.is_empty() {
        models.push(Model {
            base: base.clone().unwrap_or_default(),
            settings: common.clone(),
            ..Model::default()
        });
        for axis in &raw.axis {
            problems.check_axis(axis, &raw.axis);
            problems.check_factors_of_others(axis, &raw.axis);
            if !problems.check_count(axis, models.len()) {
                return Err(problems.found);
            }
            models = models.iter().flat_map(|model| cross(model, axis)).collect();
        }
        if base.is_none() && problems.found.is_empty() {
            let help = "add base = \"case.toml\": the case that the axes vary";
            problems.add("the axes have no base case", help, None, "");
        }
    }
    for own in &raw.model {
        models.extend(single(own, base.as_deref(), &common, folder, &mut problems));
    }
    if models.is_empty() && problems.found.is_empty() {
        let help = "add an [[axis]] with values, or a [[model]]";
        problems.add("the study has no models", help, None, "");
    }
    for rule in &raw.adjust {
        match matching(source, &rule.models, &models) {
            Ok(indices) => {
                let extra = settings(&rule.set);
                for i in indices {
                    models[i].settings.extend(extra.clone());
                }
            }
            Err(problem) => problems.found.push(problem),
        }
    }
    if problems.found.is_empty() {
        problems.check_unique(raw, &models);
    }
    if problems.found.is_empty() { Ok(models) } else { Err(problems.found) }
}

/// Problems of a study file, collected while it is expanded.
struct Problems<'a> {
    source: &'a Source,
    found: Vec<Problem>,
}

impl Problems<'_> {
    fn add(
        &mut self,
        message: impl Into<String>,
        help: &str,
        span: Option<&Range<usize>>,
        label: &str,
    ) {
        self.found.push(self.source.problem(message, help, span, label));
    }

    /// Returns the path of a case file, and reports it if the file does not exist.
    fn case_file(&mut self, folder: &Path, given: Option<&Located<PathBuf>>) -> Option<PathBuf> {
        let given = given?;
        let path = folder.join(&given.value);
        if !path.is_file() {
            let message = format!("there is no case file {}", path.display());
            let help = "paths are relative to the study file";
            self.add(message, help, given.span.as_ref(), "not found");
        }
        Some(path)
    }

    fn check_axis(&mut self, axis: &RawAxis, all: &[RawAxis]) {
        let name = &axis.name.value;
        if all.iter().filter(|a| a.name.value == *name).count() > 1 {
            let message = format!("there are two axes called \"{name}\"");
            let help = "give each axis a unique name";
            self.add(message, help, axis.name.span.as_ref(), "this one");
        }
        if all.iter().flat_map(|a| &a.values.value).any(|v| v.factors.contains_key(name)) {
            let message = format!("the axis \"{name}\" has the name of a factor");
            let help = "both are columns of the table: give the factor another name";
            self.add(message, help, axis.name.span.as_ref(), "this axis");
        }
        self.check_column("axis", name, axis.name.span.as_ref());
        if axis.values.value.is_empty() {
            let message = format!("the axis \"{name}\" has no values");
            let help = "values = [{ name = \"a\", value = ... }, ...]";
            self.add(message, help, axis.values.span.as_ref(), "empty");
        }
        let mut seen = BTreeSet::new();
        for value in &axis.values.value {
            if !seen.insert(&value.name.value) {
                let message = format!("there are two values called \"{}\"", value.name.value);
                let help = "give every value of an axis a unique name";
                self.add(message, help, value.name.span.as_ref(), "again");
            }
            self.check_name(&value.name);
            self.check_factors(&value.factors);
            match (&value.value, &axis.key) {
                (Some(given), None) => {
                    let message = format!("the axis \"{name}\" has no key to set this value to");
                    let help = "add key = \"fluid.viscosity\" (or a list of keys) to the axis, \
                                or use set = { ... }";
                    self.add(message, help, given.span.as_ref(), "without a key");
                }
                (None, Some(_)) if value.set.is_empty() => {
                    let message = format!("\"{}\" sets nothing", value.name.value);
                    let help = "add value = ..., or remove the axis";
                    self.add(message, help, value.name.span.as_ref(), "no value");
                }
                _ => {}
            }
        }
    }

    /// Checks the number of models that the axes up to this one give.
    fn check_count(&mut self, axis: &RawAxis, before: usize) -> bool {
        let count = before.saturating_mul(axis.values.value.len());
        if count > MOST_RUNS {
            let message = format!("the axes up to \"{}\" give {count} models", axis.name.value);
            let help = format!(
                "a study has at most {MOST_RUNS} runs: take fewer values, or several studies"
            );
            self.add(message, &help, axis.values.span.as_ref(), "these values");
        }
        count <= MOST_RUNS
    }

    /// Checks the name of an axis or factor, which becomes a column of the table.
    fn check_column(&mut self, kind: &str, name: &str, span: Option<&Range<usize>>) {
        if name.is_empty() || is_column(name) {
            let message = match name {
                "" => format!("the {kind} has no name"),
                name => format!("the {kind} \"{name}\" has the name of a column of the table"),
            };
            let help = "axes, factors and results are columns of one table: choose another name";
            self.add(message, help, span, "this name");
        }
    }

    /// Checks factors, which are numbers of the analysis.
    fn check_factors(&mut self, factors: &RawFactors) {
        for (name, factor) in factors {
            self.check_column("factor", name, factor.span.as_ref());
        }
        for (name, factor) in factors.iter().filter(|(_, factor)| !factor.value.is_finite()) {
            let message = format!("the factor \"{name}\" is {}", factor.value);
            let help = "a factor is a finite number; leave it out where there is none";
            self.add(message, help, factor.span.as_ref(), "not finite");
        }
    }

    /// Refuses factors that an earlier axis has too, whose values would be lost.
    fn check_factors_of_others(&mut self, axis: &RawAxis, all: &[RawAxis]) {
        for other in all.iter().take_while(|other| other.name.value != axis.name.value) {
            let is_known = |name: &String| {
                other.values.value.iter().any(|value| value.factors.contains_key(name))
            };
            let factors = axis.values.value.iter().flat_map(|value| &value.factors);
            let mut seen = BTreeSet::new();
            for (name, factor) in factors.filter(|(name, _)| is_known(name) && seen.insert(*name)) {
                let message =
                    format!("the axis \"{}\" has the factor \"{name}\" too", other.name.value);
                let help = "give the factors of different axes different names";
                self.add(message, help, factor.span.as_ref(), "given twice");
            }
        }
    }

    /// Checks a name, which becomes the name of a folder.
    fn check_name(&mut self, name: &Located<String>) {
        let allowed = |c: char| c.is_ascii_alphanumeric() || "._+-".contains(c);
        let text = &name.value;
        if text.is_empty() || text.starts_with('.') || !text.chars().all(allowed) {
            let help = "names become folders: use letters, digits, `.`, `_`, `+` and `-`, and no \
                        dot at the beginning";
            let message = format!("\"{text}\" cannot be a name");
            self.add(message, help, name.span.as_ref(), "not a name");
        }
    }

    fn check_unique(&mut self, raw: &RawStudy, models: &[Model]) {
        if let Some(long) = models.iter().find(|model| model.name.len() > LONGEST_NAME) {
            let message = format!("the name of a model has {} characters", long.name.len());
            let help = format!("names become folders: at most {LONGEST_NAME} characters");
            self.add(message, &help, None, "");
        }
        // Names that differ by case alone share a folder on some disks.
        let mut seen = BTreeSet::new();
        let Some(model) = models.iter().find(|model| !seen.insert(model.name.to_lowercase()))
        else {
            return;
        };
        let own = raw.model.iter().map(|own| &own.name).rfind(|name| name.value == model.name);
        // Names of values may contain the "-" that joins them.
        let level = raw.axis.last().and_then(|axis| {
            let level = model.levels.get(&axis.name.value)?;
            axis.values.value.iter().map(|value| &value.name).find(|name| name.value == *level)
        });
        let name = own.or(level);
        let message = format!("there are two models called \"{}\"", model.name);
        let help = "give every value of an axis and every model a unique name, whatever the case of \
                    its letters";
        self.add(message, help, name.and_then(|name| name.span.as_ref()), "again");
    }
}

/// Converts a table to settings, in order of the keys.
///
/// A dotted key replaces the value it names. A section of the case given as a table sets the keys
/// of that table one by one.
fn settings(set: &RawSet) -> Vec<Setting> {
    let mut found = Vec::new();
    for (key, value) in set {
        flatten(key.clone(), &value.value, !key.contains('.'), &mut |key, text| {
            found.push(Setting { key, value: text, span: value.span.clone() });
        });
    }
    found
}

/// Keys that mark a table as a single value: a shape or a formula.
const SINGLE_VALUE: [&str; 2] = ["kind", "formula"];

/// Calls `found` with the dotted key and the text of a value, or of all values in a `nested` table.
fn flatten(key: String, value: &Value, nested: bool, found: &mut dyn FnMut(String, String)) {
    match value {
        Value::Table(table) if nested && !SINGLE_VALUE.iter().any(|k| table.contains_key(*k)) => {
            for (inner, value) in table {
                flatten(format!("{key}.{inner}"), value, !inner.contains('.'), found);
            }
        }
        value => found(key, inline(value)),
    }
}

/// Writes a TOML value on one line.
fn inline(value: &Value) -> String {
    match value {
        Value::Table(table) => {
            let entry = |(key, value): (&String, &Value)| {
                format!("{} = {}", Value::String(key.clone()), inline(value))
            };
            format!("{{ {} }}", table.iter().map(entry).collect::<Vec<_>>().join(", "))
        }
        Value::Array(items) => {
            format!("[{}]", items.iter().map(inline).collect::<Vec<_>>().join(", "))
        }
        Value::String(text) if text.contains(['\n', '\'']) => {
            let escaped = text.replace('\\', "\\\\").replace('"', "\\\"");
            format!("\"{}\"", escaped.replace('\n', "\\n"))
        }
        scalar => scalar.to_string(),
    }
}

/// Combines a model with every value of an axis.
fn cross(model: &Model, axis: &RawAxis) -> Vec<Model> {
    let keys = axis.key.as_ref().map_or(&[][..], |key| key.value.list());
    let at = |value: &RawValue| {
        let mut model = model.clone();
        if !model.name.is_empty() {
            model.name.push('-');
        }
        model.name.push_str(&value.name.value);
        if let Some(given) = &value.value {
            model.settings.extend(keys.iter().map(|key| Setting {
                key: key.clone(),
                value: inline(&given.value),
                span: given.span.clone(),
            }));
        }
        model.settings.extend(settings(&value.set));
        model.levels.insert(axis.name.value.clone(), value.name.value.clone());
        model.factors.extend(numbers(&value.factors));
        model
    };
    axis.values.value.iter().map(at).collect()
}

/// Returns factors without their positions.
fn numbers(factors: &RawFactors) -> impl Iterator<Item = (String, f64)> + '_ {
    factors.iter().map(|(name, factor)| (name.clone(), factor.value))
}

/// Builds a model outside the axes.
fn single(
    own: &RawModel,
    base: Option<&Path>,
    common: &[Setting],
    folder: &Path,
    problems: &mut Problems,
) -> Option<Model> {
    problems.check_name(&own.name);
    problems.check_factors(&own.factors);
    let path = problems.case_file(folder, own.base.as_ref());
    let Some(path) = path.or_else(|| base.map(Path::to_owned)) else {
        let message = format!("the model \"{}\" has no base case", own.name.value);
        let help = "add base = \"case.toml\" to it, or to the study";
        problems.add(message, help, own.name.span.as_ref(), "without a case");
        return None;
    };
    Some(Model {
        name: own.name.value.clone(),
        base: path,
        settings: common.iter().cloned().chain(settings(&own.set)).collect(),
        levels: Levels::new(),
        factors: numbers(&own.factors).collect(),
    })
}

/// Returns the indices of the models whose names match any of the patterns.
///
/// # Errors
/// If a pattern is invalid or matches no model.
pub(crate) fn matching(
    source: &Source,
    patterns: &Located<Vec<String>>,
    models: &[Model],
) -> Result<Vec<usize>, Problem> {
    let span = patterns.span.as_ref();
    let mut indices = BTreeSet::new();
    for text in &patterns.value {
        let pattern = glob::Pattern::new(text).map_err(|error| {
            let message = format!("\"{text}\" is not a pattern: {error}");
            let help = "a pattern is a name with * (any text), ? (one character) and [13] (1 or 3)";
            source.problem(message, help, span, "here")
        })?;
        let found = (0..models.len()).filter(|i| pattern.matches(&models[*i].name));
        let found: Vec<usize> = found.collect();
        indices.extend(&found);
        if found.is_empty() {
            let hint = did_you_mean(text, models.iter().map(|m| m.name.as_str()));
            let message = format!("no model is called \"{text}\"");
            let help = format!(
                "{hint}the name of a model consists of the names of its values, joined by -"
            );
            return Err(source.problem(message, help, span, "matches nothing"));
        }
    }
    Ok(indices.into_iter().collect())
}
