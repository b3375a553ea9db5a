//! The study file as written, before validation.

use std::collections::BTreeMap;
use std::path::PathBuf;

use grainwake_run::case::Located;
use serde::Deserialize;
use toml::Value;

/// Case keys and their values, in order of the keys.
pub(crate) type RawSet = BTreeMap<String, Located<Value>>;

/// Numerical factors for the analysis, in order of their names.
pub(crate) type RawFactors = BTreeMap<String, Located<f64>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawStudy {
    pub title: String,
    pub base: Option<Located<PathBuf>>,
    #[serde(default)]
    pub set: RawSet,
    #[serde(default)]
    pub axis: Vec<RawAxis>,
    #[serde(default)]
    pub model: Vec<RawModel>,
    #[serde(default)]
    pub adjust: Vec<RawAdjust>,
    pub ensemble: Option<RawEnsemble>,
    pub analysis: Option<Located<OneOrSeveral<PathBuf>>>,
}

/// One value, or a list.
#[derive(Clone, Deserialize)]
#[serde(untagged)]
pub(crate) enum OneOrSeveral<T> {
    One(T),
    Several(Vec<T>),
}

impl<T> OneOrSeveral<T> {
    pub fn list(&self) -> &[T] {
        match self {
            OneOrSeveral::One(value) => std::slice::from_ref(value),
            OneOrSeveral::Several(values) => values,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawAxis {
    pub name: Located<String>,
    pub key: Option<Located<OneOrSeveral<String>>>,
    pub values: Located<Vec<RawValue>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawValue {
    pub name: Located<String>,
    pub value: Option<Located<Value>>,
    #[serde(default)]
    pub set: RawSet,
    #[serde(default)]
    pub factors: RawFactors,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawModel {
    pub name: Located<String>,
    pub base: Option<Located<PathBuf>>,
    #[serde(default)]
    pub set: RawSet,
    #[serde(default)]
    pub factors: RawFactors,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawAdjust {
    pub models: Located<Vec<String>>,
    #[serde(default)]
    pub set: RawSet,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawEnsemble {
    pub members: Located<usize>,
    pub offset: Option<Located<Size>>,
    pub turn: Option<Located<Size>>,
    #[serde(default)]
    pub cell_shift: bool,
    #[serde(default)]
    pub grain: Option<usize>,
    #[serde(default)]
    pub seed: u64,
    pub models: Option<Located<Vec<String>>>,
}

/// Length in metres or angle in radians, or text with a unit.
#[derive(Clone, Deserialize)]
#[serde(untagged)]
pub(crate) enum Size {
    Number(f64),
    Text(String),
}
