//! The software traversal beside ray queries and pipelines, in one process on one device: runs take turns, and
//! medians are compared, so that a noisy machine disturbs both alike. Prints Markdown.
//!
//! `cargo bench --bench traversal -- [rays] [gather]`; `LIGHTFALL_DEVICE` names a device.

mod cells;
mod gather;
mod rays;
mod room;
#[allow(dead_code, reason = "shared with the tests, which use all of it")]
#[path = "../../tests/render/shapes.rs"]
mod shapes;

use lightfall::gpu::{Gpu, OpenOptions};
use std::process::Command;

/// Measured runs of each variant, after one that compiles pipelines and warms caches.
const RUNS: usize = 7;

fn main() -> lightfall::Result<()> {
    let words: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .collect();
    let wanted = |name: &str| words.is_empty() || words.iter().any(|w| w == name);
    let device = std::env::var("LIGHTFALL_DEVICE").ok();
    let gpu = Gpu::open(&OpenOptions {
        device: device.as_deref(),
        validate: false,
    })?;
    let info = gpu.info();
    println!(
        "{}, {}, commit {}, medians of {RUNS} runs in turn\n",
        info.name,
        info.driver,
        commit()
    );
    if wanted("rays") {
        rays::run(&gpu)?;
    }
    if wanted("gather") {
        gather::run(&gpu)?;
    }
    Ok(())
}

/// Of the checkout; with a star where files differ from it.
fn commit() -> String {
    Command::new("git")
        .args(["describe", "--always", "--dirty=*"])
        .output()
        .map(|o| String::from_utf8_lossy(&o.stdout).trim().to_string())
        .unwrap_or_default()
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
