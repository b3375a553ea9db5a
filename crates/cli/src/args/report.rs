//! Arguments of `report`.

use clap::Args;
use std::path::PathBuf;

/// Arguments of `report`.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Run folder or study folder
    pub run: PathBuf,
    /// Write a film of a run folder instead: film.gif, and film/frame-0001.png, ... for ffmpeg
    #[arg(long)]
    pub film: bool,
}
