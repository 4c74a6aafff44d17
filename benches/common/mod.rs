//! What benches share.

use lightfall::Result;
use lightfall::gpu::{Gpu, OpenOptions};
use std::process::Command;

/// The device that `LIGHTFALL_DEVICE` names, or the best there is; and a line that says what was measured where.
pub fn open() -> Result<(Gpu, String)> {
    let device = std::env::var("LIGHTFALL_DEVICE").ok();
    let gpu = Gpu::open(&OpenOptions {
        device: device.as_deref(),
        validate: false,
    })?;
    let info = gpu.info();
    let what = format!("{}, {}, commit {}", info.name, info.driver, commit());
    Ok((gpu, what))
}

/// Of the checkout; with a star where files differ from it.
fn commit() -> String {
    Command::new("git")
        .args(["describe", "--always", "--dirty=*"])
        .output()
        .map(|o| String::from_utf8_lossy(&o.stdout).trim().to_string())
        .unwrap_or_default()
}

/// The upper one of two in the middle.
pub fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
