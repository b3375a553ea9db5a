//! The study file as written, before validation.

use std::collections::BTreeMap;
use std::path::PathBuf;

use grainwake_run::case::Loc;
use serde::Deserialize;
use toml::Value;

/// Case keys and their values, in order of the keys.
pub(crate) type RawSet = BTreeMap<String, Loc<Value>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawStudy {
    pub title: String,
    pub base: Option<Loc<PathBuf>>,
    #[serde(default)]
    pub set: RawSet,
    #[serde(default)]
    pub axis: Vec<RawAxis>,
    #[serde(default)]
    pub model: Vec<RawModel>,
    #[serde(default)]
    pub adjust: Vec<RawAdjust>,
    pub ensemble: Option<RawEnsemble>,
    pub analysis: Option<Loc<PathBuf>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawAxis {
    pub name: Loc<String>,
    pub key: Option<Loc<Keys>>,
    pub values: Loc<Vec<RawValue>>,
}

#[derive(Clone, Deserialize)]
#[serde(untagged)]
pub(crate) enum Keys {
    One(String),
    Several(Vec<String>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawValue {
    pub name: Loc<String>,
    pub value: Option<Loc<Value>>,
    #[serde(default)]
    pub set: RawSet,
    #[serde(default)]
    pub factors: BTreeMap<String, f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawModel {
    pub name: Loc<String>,
    pub base: Option<Loc<PathBuf>>,
    #[serde(default)]
    pub set: RawSet,
    #[serde(default)]
    pub factors: BTreeMap<String, f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawAdjust {
    pub models: Loc<Vec<String>>,
    #[serde(default)]
    pub set: RawSet,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawEnsemble {
    pub members: Loc<usize>,
    pub offset: Loc<Length>,
    #[serde(default)]
    pub grain: Option<usize>,
    #[serde(default)]
    pub seed: u64,
    pub models: Option<Loc<Vec<String>>>,
}

/// Length in metres, or as text with a unit.
#[derive(Clone, Deserialize)]
#[serde(untagged)]
pub(crate) enum Length {
    Metres(f64),
    Text(String),
}
