//! Damaged compressed data: whatever the bytes, an error or a scene that is sound, in little time
//! and memory.

use std::time::{Duration, Instant};

use lightfall::scene;

use crate::compressed::{bytes, textured};

const TIME: Duration = Duration::from_secs(10);
const MEMORY_KIB: u64 = 3 << 20;

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as usize % n
    }
}

/// A file for each decoder, and where in it the data begin that are to be damaged.
fn seeds() -> Vec<(String, Vec<u8>, usize)> {
    let mut seeds = Vec::new();
    for name in [
        "meshopt-ext",
        "meshopt-khr",
        "gltfpack",
        "draco-edgebreaker",
        "draco-sequential",
    ] {
        let file = bytes(&format!("{name}.glb"));
        let json = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
        seeds.push((name.into(), file, 28 + json));
    }
    for name in [
        "etc1s.ktx2",
        "uastc.ktx2",
        "uastc-raw.ktx2",
        "bc1.dds",
        "bc7.dds",
    ] {
        let image = bytes(name);
        let extension = match name.ends_with("dds") {
            true => "MSFT_texture_dds",
            false => "KHR_texture_basisu",
        };
        // The image comes last.
        let file = textured(&image, extension).glb();
        let start = file.len() - image.len().next_multiple_of(4);
        seeds.push((name.into(), file, start));
    }
    seeds
}

/// One to eight changes of the bytes from `start`: a bit, a byte, a number of four bytes, a copy.
fn mutate(file: &mut [u8], start: usize, random: &mut Random) {
    for _ in 0..=random.below(8) {
        let at = start + random.below(file.len() - start - 4);
        match random.below(5) {
            0 => file[at] ^= 1 << random.below(8),
            1 => file[at] = random.below(256) as u8,
            2 => file[at] = [0, 1, 127, 128, 255][random.below(5)],
            3 => {
                let number = [0, 1, u32::MAX, 1 << 31, 65536][random.below(5)];
                file[at..at + 4].copy_from_slice(&number.to_le_bytes());
            }
            _ => {
                let from = start + random.below(file.len() - start - 4);
                file.copy_within(from..from + 4, at);
            }
        }
    }
}

/// The most memory that this process ever held, where the system says.
fn peak_kib() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

fn damage_each(times: usize) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.glb");
    for (name, file, start) in seeds() {
        let mut random = Random(times as u64);
        let (mut read, mut longest) = (0, Duration::ZERO);
        for i in 0..times {
            let mut file = file.clone();
            mutate(&mut file, start, &mut random);
            std::fs::write(&path, &file).unwrap();
            let begin = Instant::now();
            if let Ok(scene) = scene::load(&path) {
                read += usize::from(scene.warnings.is_empty());
                if !scene.triangles.is_empty() {
                    crate::sound::check(&scene, &path);
                }
            }
            longest = longest.max(begin.elapsed());
            assert!(longest < TIME, "{name}, {i}: {longest:?}");
        }
        let ms = longest.as_millis();
        println!("{name}: {read} of {times} without a word, {ms} ms at most");
    }
    let peak = peak_kib();
    assert!(peak.is_none_or(|peak| peak < MEMORY_KIB), "{peak:?} KiB");
}

#[test]
fn damaged_streams_end_in_errors() {
    damage_each(300);
}

/// `cargo test --release --test scene -- --ignored mutated`
#[test]
#[ignore = "takes ten minutes"]
fn streams_damaged_a_hundred_thousand_times_end_in_errors() {
    damage_each(100_000);
}
