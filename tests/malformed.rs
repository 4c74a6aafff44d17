//! Broken files end in a message that names file and fault: no panic, no hang, no bomb.
//!
//! The files lie in `../shared/malformed`, with the outcome that each must have in EXPECTED.md.
//! Where they are absent, the tests say so and pass.

#[path = "scene/sound.rs"]
mod sound;

use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use lightfall::scene::{self, Scene};

const LIMIT: Duration = Duration::from_secs(10);

fn malformed() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/malformed");
    if !folder.is_dir() {
        println!("skipped: {} is absent", folder.display());
        return None;
    }
    Some(folder)
}

/// Loads in a thread of its own, so that neither a hang nor a small stack goes unseen.
fn load(path: &Path) -> lightfall::Result<Scene> {
    let (sender, receiver) = mpsc::channel();
    let owned = path.to_owned();
    let start = Instant::now();
    let thread = thread::spawn(move || {
        let _ = sender.send(scene::load(&owned));
    });
    match receiver.recv_timeout(LIMIT) {
        Ok(result) => {
            println!("{:6} ms {}", start.elapsed().as_millis(), path.display());
            result
        }
        Err(mpsc::RecvTimeoutError::Timeout) => panic!("{}: hangs", path.display()),
        Err(mpsc::RecvTimeoutError::Disconnected) => {
            panic!("{}: panics: {:?}", path.display(), thread.join())
        }
    }
}

#[test]
fn every_file_ends_as_expected() {
    let Some(folder) = malformed() else { return };
    let table = std::fs::read_to_string(folder.join("EXPECTED.md")).unwrap();
    let mut files = 0;
    for row in table.lines() {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let [_, file, expected, ..] = cells[..] else {
            continue;
        };
        let path = folder.join(file);
        if !path.is_file() {
            continue;
        }
        files += 1;
        let result = load(&path);
        let outcome = match &result {
            Ok(scene) => {
                sound::check(scene, &path);
                println!("          OK {:?}", scene.warnings);
                "OK"
            }
            Err(error) => {
                println!("          {error}");
                let name = path.file_name().unwrap().to_string_lossy();
                assert!(error.to_string().contains(&*name), "{error}: names no file");
                "REJECT"
            }
        };
        assert!(
            expected.contains("NO-CRASH") || expected.contains(outcome),
            "{file}: {outcome}, but {expected} is expected"
        );
    }
    assert!(files > 100, "only {files} files of EXPECTED.md were found");
}
