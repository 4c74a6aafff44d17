//! A new or deleted shader must be seen: `include_dir!` alone follows only files it already knows.
fn main() {
    println!("cargo::rerun-if-changed=glsl/spirv");
}
