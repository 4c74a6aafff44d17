//! Broken files through the binary: an exit code and a message, and an image or none.
//!
//! The files lie in `../shared/malformed`, with the outcome that each must have in EXPECTED.md.
//! Where they are absent, the test says so and passes.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use lightfall::image::read_picture;

const TIME: Duration = Duration::from_secs(20);
const MEMORY_KIB: u64 = 2 << 20;

/// Exit code and stderr of a render into `image`, held to the limits.
fn render(scene: &Path, image: &Path) -> (Option<i32>, String) {
    let log = image.with_extension("log");
    let start = Instant::now();
    let mut child = Command::new(env!("CARGO_BIN_EXE_lightfall"))
        .arg("render")
        .arg(scene)
        .arg("-o")
        .arg(image)
        .args(["--size", "32x32", "--iterations", "1"])
        .args(["--photons", "10000", "--trace", "software"])
        .stdout(Stdio::null())
        .stderr(fs::File::create(&log).unwrap())
        .spawn()
        .unwrap();
    let mut peak = 0;
    let status = loop {
        peak = peak.max(peak_kib(child.id()).unwrap_or(0));
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > TIME || peak > MEMORY_KIB {
            child.kill().unwrap();
            child.wait().unwrap();
            panic!("{}: {:?}, {peak} KiB", scene.display(), start.elapsed());
        }
        sleep(Duration::from_millis(5));
    };
    let ms = start.elapsed().as_millis();
    println!("{ms:6} ms {:5} MiB {}", peak / 1024, scene.display());
    (status.code(), fs::read_to_string(log).unwrap())
}

/// The most memory that a process ever held, where the system says.
fn peak_kib(process: u32) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

#[test]
fn broken_files_end_in_an_image_or_in_an_error() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/malformed");
    if !folder.is_dir() {
        println!("skipped: {} is absent", folder.display());
        return;
    }
    let out = tempfile::tempdir().unwrap();
    let image = out.path().join("image.exr");
    let table = fs::read_to_string(folder.join("EXPECTED.md")).unwrap();
    let mut files = 0;
    for row in table.lines() {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let [_, file, expected, ..] = cells[..] else {
            continue;
        };
        // The other folders hold fragments without a camera, which tests/malformed.rs loads.
        if !file.starts_with("mutated/") {
            continue;
        }
        files += 1;
        let (code, stderr) = render(&folder.join(file), &image);
        if stderr.contains("descriptorIndexing") {
            println!("not tested: {file}: {}", stderr.trim());
            continue;
        }
        let outcome = match code {
            Some(0) => "OK",
            Some(1) => "REJECT",
            _ => panic!("{file}: {code:?}: {stderr}"),
        };
        assert!(
            expected.contains(outcome),
            "{file}: {outcome}, but {expected} is expected: {stderr}"
        );
        if outcome == "OK" {
            let picture = read_picture(&image).unwrap();
            assert_eq!((picture.width, picture.height), (32, 32), "{file}");
            // NaN and infinities are written as 0, but not in silence.
            assert!(!stderr.contains("not finite"), "{file}: {stderr}");
            fs::remove_file(&image).unwrap();
        } else {
            let error = stderr.lines().find(|line| line.starts_with("error: "));
            let error = error.unwrap_or_else(|| panic!("{file}: {stderr}"));
            let name = file.trim_start_matches("mutated/");
            assert!(error.contains(name), "names no file: {error}");
            assert!(!image.exists(), "{file}: an image in spite of {error}");
        }
    }
    assert!(files > 30, "only {files} files of EXPECTED.md were found");
}
