//! The software traversal beside ray queries and pipelines, in one process on one device: runs take turns, and
//! medians are compared, so that a noisy machine disturbs both alike. Prints Markdown.
//!
//! `cargo bench --bench traversal -- [rays] [gather] [limits] [VARIANT…]`: all, or those named ("eight cells"); `LIGHTFALL_DEVICE`
//! names a device.

mod cells;
#[path = "../common/mod.rs"]
mod common;
mod gather;
mod limits;
mod rays;
mod room;
#[allow(dead_code, reason = "shared with the tests, which use all of it")]
#[path = "../../tests/render/shapes.rs"]
mod shapes;

use common::{median, open};

/// Measured runs of each variant, after one that compiles pipelines and warms caches.
const RUNS: usize = 11;

fn main() -> lightfall::Result<()> {
    let words: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .collect();
    let (benches, variants): (Vec<_>, Vec<_>) = words
        .iter()
        .partition(|w| ["rays", "gather", "limits"].contains(&w.as_str()));
    let named =
        |words: &[&String], name: &str| words.is_empty() || words.iter().any(|w| *w == name);
    let wanted = |name: &str| named(&benches, name);
    let (gpu, what) = open()?;
    println!("{what}, medians of {RUNS} runs in turn\n");
    if wanted("rays") {
        rays::run(&gpu)?;
    }
    if wanted("gather") {
        gather::run(&gpu, |variant| named(&variants, variant))?;
    }
    if wanted("limits") {
        limits::run(&gpu)?;
    }
    Ok(())
}
