//! `--root`, `--strict`: how scene files are read.

use crate::scene::LoadOptions;
use clap::Args;
use std::path::PathBuf;

/// Shared by the subcommands that load scenes.
#[derive(Debug, Args)]
pub struct LoadArgs {
    /// Let the scene refer to any file in this folder, by paths that leave its own (../textures)
    /// and by symbolic links [default: only to files in its own folder]
    #[arg(long, value_name = "DIR")]
    pub root: Option<PathBuf>,

    /// Refuse files that break a rule of glTF, also those that are otherwise read with a warning
    #[arg(long, conflicts_with = "root")]
    pub strict: bool,
}

impl LoadArgs {
    pub fn options(&self) -> LoadOptions {
        LoadOptions {
            root: self.root.clone(),
            strict: self.strict,
        }
    }
}
