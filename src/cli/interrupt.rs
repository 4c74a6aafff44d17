//! Ctrl-C and signals to end: the first asks, the second ends.

use crate::{Error, Result};
use std::{
    io::Write,
    sync::atomic::{AtomicBool, Ordering},
};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// From now on the first Ctrl-C, SIGTERM or SIGHUP only sets a flag and, unless `quiet`, says so. To be
/// called once.
pub fn watch(quiet: bool) -> Result<()> {
    ctrlc::set_handler(move || {
        if REQUESTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        if !quiet {
            let line = "finishing this iteration to write what there is; once more ends without it";
            // The bar or ^C stands on the line before.
            let _ = writeln!(std::io::stderr(), "\n{line}");
        }
    })
    .map_err(|e| Error::io("signal handler".as_ref(), std::io::Error::other(e)))
}

/// Whether the flag is set.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
