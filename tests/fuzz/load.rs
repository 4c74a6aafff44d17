//! Fuzzes the loader: whatever the bytes, an error or a scene that the renderer can rely on.
//!
//! Input: a GLB or glTF file, as a user would give it. Beside it lie `data.bin` and `image.png`, so that URIs lead
//! somewhere. How to run it: CONTRIBUTING.md.
#![no_main]

#[path = "../scene/document.rs"]
#[allow(dead_code)]
mod document;
mod mutate;
mod seeds;
#[path = "../scene/sound.rs"]
mod sound;

use std::path::PathBuf;
use std::sync::LazyLock;

use libfuzzer_sys::{fuzz_mutator, fuzz_target};
use lightfall::scene;
use tempfile::TempDir;

/// Where the file under test lies.
static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.path().join(name), bytes).expect("space in the temporary folder");
    };
    write("data.bin", &[0x3f; 4096]);
    write("image.png", &document::png([255, 128, 0, 255]));
    folder
});
static FILE: LazyLock<PathBuf> = LazyLock::new(|| FOLDER.path().join("scene.gltf"));

fuzz_target!(|bytes: &[u8]| {
    std::fs::write(&*FILE, bytes).expect("space in the temporary folder");
    match scene::load(&FILE) {
        Ok(scene) => sound::check(&scene, &FILE),
        Err(error) => assert!(
            error.to_string().contains("scene.gltf"),
            "names no file: {error}"
        ),
    }
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    mutate::mutate(data, size, max_size, seed)
});
