//! Changes of the keys of a case on the command line.

use clap::Args;

/// Options `--set` and `--unset`.
#[derive(Debug, Args)]
pub struct Overrides {
    /// Override a value of the case, or of every case, for example time.end=0.5 or
    /// grain.0.density=2600
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Remove a key of the case, so that its default applies, for example time.step; before --set
    #[arg(long = "unset", value_name = "KEY")]
    unset: Vec<String>,
}

impl Overrides {
    /// Returns the changes in the syntax of `Case::load`, removals first.
    pub fn list(&self) -> Vec<String> {
        self.unset.iter().map(|key| format!("-{key}")).chain(self.set.iter().cloned()).collect()
    }
}
