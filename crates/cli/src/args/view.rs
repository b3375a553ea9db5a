//! Arguments of `view`.

use clap::Args;
use std::path::PathBuf;

/// Arguments of `view`.
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// Run folders, or one study folder; a run that is still going is followed
    #[arg(required = true, value_name = "DIR")]
    pub folders: Vec<PathBuf>,
    /// Port on 127.0.0.1; 0 takes any free port
    #[arg(long, value_name = "N", default_value_t = 8317, conflicts_with = "save")]
    pub port: u16,
    /// Open the page in the default browser
    #[arg(long, conflicts_with = "save")]
    pub open: bool,
    /// Write one self-contained page that works from disk, instead of serving
    #[arg(long, value_name = "PAGE.html")]
    pub save: Option<PathBuf>,
}
