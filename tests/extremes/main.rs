//! Numerics at the extremes: each row of the table is a measurement with a bound.
//!
//! `cargo test --release --test extremes -- --nocapture` prints the table; with `--include-ignored` another one of what
//! takes minutes.

#[path = "../render/check.rs"]
#[allow(dead_code, reason = "shared with tests/render")]
mod check;
mod counts;
#[path = "../scene/document.rs"]
#[allow(dead_code, reason = "shared with tests/scene")]
mod document;
mod furnace;
mod glass;
mod image;
mod mesh;
mod place;
mod power;
#[path = "../render/shapes.rs"]
#[allow(dead_code, reason = "shared with tests/render")]
mod shapes;
mod table;

use table::Table;

#[test]
fn the_table_is_green() {
    let mut table = Table::new();
    place::rows(&mut table);
    power::rows(&mut table);
    counts::rows(&mut table);
    glass::rows(&mut table);
    furnace::rows(&mut table);
    mesh::rows(&mut table);
    image::rows(&mut table);
    table.finish();
}

#[test]
#[ignore = "takes minutes and gigabytes"]
fn the_long_table_is_green() {
    let mut table = Table::new();
    counts::long_rows(&mut table);
    table.finish();
}
