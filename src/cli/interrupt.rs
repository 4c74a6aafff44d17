//! Ctrl-C and signals to end: the first asks, the second ends.

use crate::{Error, Result};
use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// From now on the first Ctrl-C, SIGTERM or SIGHUP only sets a flag. To be called once.
pub fn watch() -> Result<()> {
    ctrlc::set_handler(|| {
        if REQUESTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })
    .map_err(|e| Error::io("signal handler".as_ref(), std::io::Error::other(e)))
}

/// Whether the flag is set.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
