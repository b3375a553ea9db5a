//! Models: what a study file expands to before its cases are read.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use grainwake_solver::case::{Problem, Source, nearest};
use toml::Value;

use crate::plan::raw::{Keys, RawAdjust, RawAxis, RawModel, RawSet, RawStudy};

/// A case key and what it is set to.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Dotted key of the case, "grain.0.file".
    pub key: String,
    /// Value in TOML, on one line.
    pub value: String,
    /// Where the study file says so.
    pub span: Option<Range<usize>>,
}

impl Setting {
    /// As `--set` takes it.
    pub fn text(&self) -> String {
        format!("{}={}", self.key, self.value)
    }
}

/// One point of a study: a case and where it lies on the axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Names of its values joined, "g04-o1", or its own.
    pub name: String,
    /// Base case.
    pub base: PathBuf,
    /// What is set in it, later settings last.
    pub settings: Vec<Setting>,
    /// Name of its value on each axis; none of a model that stands alone.
    pub levels: BTreeMap<String, String>,
    /// Numbers that belong to it, for the analysis.
    pub factors: BTreeMap<String, f64>,
}

/// Expands a study file: every combination of the axes' values, then the models that stand alone.
pub(crate) fn expand(
    source: &Source,
    raw: &RawStudy,
    folder: &Path,
) -> Result<Vec<Model>, Vec<Problem>> {
    let mut problems = Vec::new();
    let base = base(source, raw, folder, &mut problems);
    let common = settings(&raw.set);
    let mut models = Vec::new();
    if !raw.axis.is_empty() {
        models.push(Model {
            name: String::new(),
            base: base.clone().unwrap_or_default(),
            settings: common.clone(),
            levels: BTreeMap::new(),
            factors: BTreeMap::new(),
        });
        for axis in &raw.axis {
            check_axis(source, axis, &raw.axis, &mut problems);
            models = models.iter().flat_map(|model| along(model, axis)).collect();
        }
        if base.is_none() && problems.is_empty() {
            problems.push(
                Problem::new("the axes have no base case")
                    .help("add base = \"case.toml\": the case that the axes vary"),
            );
        }
    }
    for own in &raw.model {
        models.extend(alone(
            source,
            own,
            base.as_deref(),
            &common,
            folder,
            &mut problems,
        ));
    }
    if models.is_empty() && problems.is_empty() {
        problems.push(
            Problem::new("the study has no models")
                .help("add an [[axis]] with values, or a [[model]]"),
        );
    }
    adjust(source, &raw.adjust, &mut models, &mut problems);
    unique(source, raw, &models, &mut problems);
    if problems.is_empty() {
        Ok(models)
    } else {
        Err(problems)
    }
}

fn base(
    source: &Source,
    raw: &RawStudy,
    folder: &Path,
    problems: &mut Vec<Problem>,
) -> Option<PathBuf> {
    let given = raw.base.as_ref()?;
    let path = folder.join(&given.value);
    if !path.is_file() {
        let problem = Problem::new(format!("there is no case file {}", path.display()))
            .help("paths are relative to the study file");
        problems.push(source.locate(problem, given.span.as_ref(), "not found"));
    }
    Some(path)
}

/// The settings of a table, in order of the keys. A dotted key replaces what it names; a section of the
/// case with a table sets the keys of that table.
fn settings(set: &RawSet) -> Vec<Setting> {
    let mut found = Vec::new();
    for (key, value) in set {
        let nested = !key.contains('.');
        spread(key.clone(), &value.value, nested, &mut |key, text| {
            found.push(Setting {
                key,
                value: text,
                span: value.span.clone(),
            });
        });
    }
    found
}

/// Keys of tables that stand for one value.
const ONE_VALUE: [&str; 2] = ["kind", "formula"];

/// Calls `found` with the dotted key and the text of a value, or of all values in a `nested` table.
fn spread(key: String, value: &Value, nested: bool, found: &mut dyn FnMut(String, String)) {
    match value {
        // A shape or a formula is one value.
        Value::Table(table) if nested && !ONE_VALUE.iter().any(|key| table.contains_key(*key)) => {
            for (inner, value) in table {
                let nested = !inner.contains('.');
                spread(format!("{key}.{inner}"), value, nested, found);
            }
        }
        value => found(key, inline(value)),
    }
}

/// A value on one line.
fn inline(value: &Value) -> String {
    match value {
        Value::Table(table) => {
            let entries: Vec<String> = table
                .iter()
                .map(|(key, value)| format!("{} = {}", Value::String(key.clone()), inline(value)))
                .collect();
            format!("{{ {} }}", entries.join(", "))
        }
        Value::Array(items) => {
            let items: Vec<String> = items.iter().map(inline).collect();
            format!("[{}]", items.join(", "))
        }
        Value::String(text) if text.contains(['\n', '\'']) => {
            let plain = text
                .replace('\\', "\\\\")
                .replace('"', "\\\"")
                .replace('\n', "\\n");
            format!("\"{plain}\"")
        }
        plain => plain.to_string(),
    }
}

fn along(model: &Model, axis: &RawAxis) -> Vec<Model> {
    let keys = match axis.key.as_ref().map(|k| &k.value) {
        None => Vec::new(),
        Some(Keys::One(key)) => vec![key.clone()],
        Some(Keys::Several(keys)) => keys.clone(),
    };
    let at = |value: &crate::plan::raw::RawValue| {
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
        model
            .levels
            .insert(axis.name.value.clone(), value.name.value.clone());
        model.factors.extend(value.factors.clone());
        model
    };
    axis.values.value.iter().map(at).collect()
}

fn check_axis(source: &Source, axis: &RawAxis, all: &[RawAxis], problems: &mut Vec<Problem>) {
    let mut fail = |text: String, help: &str, span: Option<&Range<usize>>, label: &str| {
        problems.push(source.locate(Problem::new(text).help(help), span, label));
    };
    let name = &axis.name.value;
    if all.iter().filter(|a| a.name.value == *name).count() > 1 {
        let text = format!("there are two axes called \"{name}\"");
        fail(
            text,
            "give each axis a name of its own",
            axis.name.span.as_ref(),
            "this one",
        );
    }
    if axis.values.value.is_empty() {
        let text = format!("the axis \"{name}\" has no values");
        fail(
            text,
            "values = [{ name = \"a\", value = ... }, ...]",
            axis.values.span.as_ref(),
            "empty",
        );
    }
    for value in &axis.values.value {
        check_name(
            source,
            &value.name.value,
            value.name.span.as_ref(),
            &mut *problems,
        );
        if let (Some(given), None) = (&value.value, &axis.key) {
            let text = format!("the axis \"{name}\" has no key to set this value to");
            let help = "add key = \"fluid.viscosity\" (or a list of keys) to the axis, or use set = { ... }";
            problems.push(source.locate(
                Problem::new(text).help(help),
                given.span.as_ref(),
                "of what?",
            ));
        }
        if value.value.is_none() && axis.key.is_some() && value.set.is_empty() {
            let text = format!("\"{}\" sets nothing", value.name.value);
            let help = "add value = ..., or leave out the axis";
            problems.push(source.locate(
                Problem::new(text).help(help),
                value.name.span.as_ref(),
                "no value",
            ));
        }
    }
}

/// Names become folders: letters, digits, `.`, `_`, `+` and `-`.
fn check_name(
    source: &Source,
    name: &str,
    span: Option<&Range<usize>>,
    problems: &mut Vec<Problem>,
) {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._+-".contains(c);
    if !name.is_empty() && !name.starts_with('.') && name.chars().all(plain) {
        return;
    }
    let problem = Problem::new(format!("\"{name}\" cannot be a name")).help(
        "names become folders: letters, digits, `.`, `_`, `+` and `-`, not beginning with a dot",
    );
    problems.push(source.locate(problem, span, "not a name"));
}

fn alone(
    source: &Source,
    own: &RawModel,
    base: Option<&Path>,
    common: &[Setting],
    folder: &Path,
    problems: &mut Vec<Problem>,
) -> Option<Model> {
    check_name(source, &own.name.value, own.name.span.as_ref(), problems);
    let path = own.base.as_ref().map(|b| folder.join(&b.value));
    if let (Some(path), Some(given)) = (&path, &own.base)
        && !path.is_file()
    {
        let problem = Problem::new(format!("there is no case file {}", path.display()))
            .help("paths are relative to the study file");
        problems.push(source.locate(problem, given.span.as_ref(), "not found"));
    }
    let Some(path) = path.or_else(|| base.map(Path::to_owned)) else {
        let problem = Problem::new(format!("the model \"{}\" has no base case", own.name.value))
            .help("add base = \"case.toml\" to it, or to the study");
        problems.push(source.locate(problem, own.name.span.as_ref(), "without a case"));
        return None;
    };
    Some(Model {
        name: own.name.value.clone(),
        base: path,
        settings: common.iter().cloned().chain(settings(&own.set)).collect(),
        levels: BTreeMap::new(),
        factors: own.factors.clone(),
    })
}

fn adjust(source: &Source, rules: &[RawAdjust], models: &mut [Model], problems: &mut Vec<Problem>) {
    for rule in rules {
        let found = matching(
            source,
            &rule.models.value,
            rule.models.span.as_ref(),
            models,
        );
        match found {
            Ok(which) => {
                let extra = settings(&rule.set);
                which
                    .into_iter()
                    .for_each(|i| models[i].settings.extend(extra.clone()));
            }
            Err(problem) => problems.push(problem),
        }
    }
}

/// Indices of the models whose names match any of the patterns; every pattern must match one.
pub(crate) fn matching(
    source: &Source,
    patterns: &[String],
    span: Option<&Range<usize>>,
    models: &[Model],
) -> Result<Vec<usize>, Problem> {
    let mut which: Vec<usize> = Vec::new();
    for text in patterns {
        let pattern = glob::Pattern::new(text).map_err(|error| {
            let problem = Problem::new(format!("\"{text}\" is not a pattern: {error}")).help(
                "a pattern is a name with * (any text), ? (one character) and [13] (one of them)",
            );
            source.locate(problem, span, "here")
        })?;
        let before = which.len();
        which.extend((0..models.len()).filter(|i| pattern.matches(&models[*i].name)));
        if which.len() == before {
            let names = models.iter().map(|m| m.name.as_str());
            let hint =
                nearest(text, names).map_or(String::new(), |n| format!("did you mean \"{n}\"? "));
            let problem = Problem::new(format!("no model is called \"{text}\"")).help(format!(
                "{hint}the names are those of the axes' values, joined by -"
            ));
            return Err(source.locate(problem, span, "matches nothing"));
        }
    }
    which.sort_unstable();
    which.dedup();
    Ok(which)
}

fn unique(source: &Source, raw: &RawStudy, models: &[Model], problems: &mut Vec<Problem>) {
    let mut seen = std::collections::BTreeSet::new();
    for model in models {
        if !seen.insert(&model.name) {
            let values = raw
                .axis
                .iter()
                .flat_map(|a| a.values.value.iter().map(|v| &v.name));
            let names = values.chain(raw.model.iter().map(|m| &m.name));
            let place = names
                .rev()
                .find(|n| {
                    model.name.split('-').any(|part| part == n.value) || model.name == n.value
                })
                .and_then(|n| n.span.clone());
            let problem = Problem::new(format!("there are two models called \"{}\"", model.name))
                .help("give every value of an axis and every model a name of its own");
            problems.push(source.locate(problem, place.as_ref(), "again"));
            return;
        }
    }
}
