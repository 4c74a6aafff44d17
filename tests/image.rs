//! What goes into an image file comes out again.

use lightfall::image::{
    Display, Exposure, Layer, Metadata, Picture, Tone, auto_exposure, check_output, luminance,
    neutral, read_hdr, read_picture, read_rgb, write,
};
use std::{fs, path::Path};

const DISPLAY: Display = Display {
    exposure: Exposure::Auto,
    tone: Tone::Neutral,
};

/// Floats of every magnitude, signs, denormals and negative zero: SplitMix64 bits made finite.
fn noise(count: usize, seed: u64) -> Vec<f32> {
    let mut state = seed;
    let floats = std::iter::from_fn(|| {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        Some(f32::from_bits((z ^ (z >> 31)) as u32))
    });
    let mut floats: Vec<f32> = floats.filter(|x| x.is_finite()).take(count - 1).collect();
    floats.push(-0.0);
    floats
}

/// 37 × 21: no multiple of ZIP's 16 scan lines.
fn picture() -> Picture {
    let layer = |name, channels: &[&str], seed| {
        Layer::new(name, channels, noise(37 * 21 * channels.len(), seed))
    };
    Picture {
        width: 37,
        height: 21,
        layers: vec![
            layer("", &["R", "G", "B"], 1),
            layer("normal", &["X", "Y", "Z"], 2),
            layer("depth", &["Z"], 3),
            layer("albedo", &["R", "G", "B"], 4),
            layer("resume.sum", &["R", "G", "B", "n"], 5),
        ],
        metadata: Metadata {
            scene_hash: std::array::from_fn(|i| (i * 37) as u8),
            settings: "camera='Küche 厨房' alpha=0.6666667".into(),
            seed: u64::MAX,
            iterations: 1 << 40,
            radius_global: 0.1 + f32::EPSILON,
            radius_caustic: 1e-42,
            device: "llvmpipe (LLVM 19.1.7, 256 bits)".into(),
            version: "0.1.0".into(),
            seconds: std::f64::consts::PI,
            guide: "3f800000 00000000 00000000 40000000 .".into(),
        },
    }
}

fn bits(picture: &Picture) -> Vec<u32> {
    let pixels = picture.layers.iter().flat_map(|l| &l.pixels);
    pixels.map(|x| x.to_bits()).collect()
}

#[test]
fn exr_keeps_every_bit() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("image.EXR");
    let picture = picture();
    assert_eq!(write(&path, &picture, &DISPLAY).unwrap(), 0);
    let back = read_picture(&path).unwrap();
    assert_eq!(back, picture);
    // `==` takes -0 for 0.
    assert_eq!(bits(&back), bits(&picture));
    let (width, height, rgb) = read_rgb(&path).unwrap();
    assert_eq!((width, height), (37, 21));
    assert_eq!(rgb, picture.layers[0].pixels);
}

#[test]
fn nonfinite_pixels_become_zero_and_are_counted() {
    let dir = tempfile::tempdir().unwrap();
    let mut picture = picture();
    picture.layers[0].pixels[4] = f32::NAN;
    picture.layers[0].pixels[5] = f32::INFINITY;
    picture.layers[2].pixels[0] = f32::NEG_INFINITY;
    let exr = dir.path().join("a.exr");
    assert_eq!(write(&exr, &picture, &DISPLAY).unwrap(), 3);
    let back = read_picture(&exr).unwrap();
    assert_eq!(back.layers[0].pixels[4..6], [0.0, 0.0]);
    assert_eq!(back.layers[2].pixels[0], 0.0);
    assert_eq!(back.layers[1], picture.layers[1]);
    let png = dir.path().join("a.png");
    assert_eq!(write(&png, &picture, &DISPLAY).unwrap(), 2, "beauty only");
}

#[test]
fn failure_leaves_the_old_file_and_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["old.exr", "old.png"] {
        let path = dir.path().join(name);
        fs::write(&path, "old").unwrap();
        let mut bad = picture();
        // Two channels of one name are found out only while the file is being written.
        bad.layers.push(bad.layers[1].clone());
        bad.layers[0].name = "not beauty".into();
        let error = write(&path, &bad, &DISPLAY).unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
    }
    // A folder in the way makes the last step fail, the rename.
    let folder = dir.path().join("folder.exr");
    fs::create_dir(&folder).unwrap();
    assert!(write(&folder, &picture(), &DISPLAY).is_err());
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 3);
}

#[cfg(unix)]
#[test]
fn images_are_as_readable_as_other_files() {
    use std::os::unix::fs::PermissionsExt;
    let dir = tempfile::tempdir().unwrap();
    let (image, other) = (dir.path().join("a.exr"), dir.path().join("other"));
    write(&image, &picture(), &DISPLAY).unwrap();
    fs::write(&other, "").unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&image), mode(&other));
}

/// As most tools do: the link stays and leads to the new image, which keeps the old one's
/// permissions.
#[cfg(unix)]
#[test]
fn images_replace_what_a_link_leads_to_and_keep_its_permissions() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fs::create_dir(at("d")).unwrap();
    fs::write(at("d/real.exr"), "old").unwrap();
    fs::set_permissions(at("d/real.exr"), fs::Permissions::from_mode(0o640)).unwrap();
    symlink("d/real.exr", at("one.exr")).unwrap();
    symlink("one.exr", at("two.exr")).unwrap();
    symlink("d/new.exr", at("new.exr")).unwrap();
    symlink("round.exr", at("round.exr")).unwrap();
    symlink("/dev/null", at("null.exr")).unwrap();
    for name in ["two.exr", "new.exr"] {
        check_output(&at(name)).unwrap();
        write(&at(name), &picture(), &DISPLAY).unwrap();
        assert!(
            fs::symlink_metadata(at(name)).unwrap().is_symlink(),
            "{name}"
        );
        assert_eq!(read_picture(&at(name)).unwrap(), picture(), "{name}");
    }
    let mode = fs::metadata(at("d/real.exr")).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o640);
    assert!(fs::symlink_metadata(at("d/new.exr")).unwrap().is_file());
    let long = format!("{}.exr", "n".repeat(260));
    for (name, fault) in [
        ("round.exr", "leads nowhere"),
        ("null.exr", "no regular file"),
        (&long, "name too long"),
        ("d/real.exr/a.exr", "Not a directory"),
    ] {
        let error = check_output(&at(name)).expect_err(name).to_string();
        assert!(error.contains(fault), "{error}");
    }
}

/// A Radiance file of 2 x 1 pixels, 0.5 1 2 and 4 4 4 as they are to be seen.
fn radiance(header: &str, resolution: &str, swapped: bool) -> Vec<u8> {
    let pixels = [[64u8, 128, 255, 129], [128, 128, 128, 131]];
    let [a, b] = if swapped {
        [pixels[1], pixels[0]]
    } else {
        pixels
    };
    [
        header.as_bytes(),
        b"\n",
        resolution.as_bytes(),
        b"\n",
        &a,
        &b,
    ]
    .concat()
}

/// Ward's Real Pixels and the reference manual: a header has one line for each change of exposure,
/// and a picture may begin in any corner.
#[test]
fn radiance_headers_mean_what_their_author_says() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.hdr");
    let read = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        read_hdr(&path)
    };
    let format = "FORMAT=32-bit_rle_rgbe\n";
    let plain = [0.5f32, 1.0, 255.0 / 128.0, 4.0, 4.0, 4.0];
    for (header, scale) in [
        (String::from("#?RADIANCE\n"), [1.0; 3]),
        (format!("#?RADIANCE\n{format}"), [1.0; 3]),
        (
            format!("#?RGBE\n# made by hand\nGAMMA=2\n{format}"),
            [1.0; 3],
        ),
        (format!("#?RADIANCE\n{format}EXPOSURE=2\r\n"), [2.0; 3]),
        (
            format!("#?RADIANCE\npfilt -e 4\nEXPOSURE= 4.0\nEXPOSURE=0.5\n{format}"),
            [2.0; 3],
        ),
        (
            format!("#?RADIANCE\n\tEXPOSURE=8\nCOLORCORR= 1 2 4\nEXPOSURE=2\n{format}"),
            [2.0, 4.0, 8.0],
        ),
    ] {
        let image = read(&radiance(&header, "-Y 1 +X 2", false)).unwrap();
        assert_eq!(image.size, [2, 1], "{header}");
        let expected: Vec<f32> = (0..6).map(|i| plain[i] / scale[i % 3]).collect();
        assert_eq!(image.pixels, expected, "{header}");
    }
    for (resolution, swapped, size) in [
        ("-Y 1 +X 2", false, [2, 1]),
        ("+Y 1 +X 2", false, [2, 1]),
        ("-Y 1 -X 2", true, [2, 1]),
        ("+Y 2 +X 1", true, [1, 2]),
        ("+X 2 -Y 1", false, [2, 1]),
        ("-X 2 +Y 1", true, [2, 1]),
        ("+X 1 -Y 2", false, [1, 2]),
        ("-X 1 +Y 2", true, [1, 2]),
    ] {
        let image = read(&radiance("#?RADIANCE\n", resolution, swapped)).unwrap();
        assert_eq!(
            (image.size, &image.pixels[..]),
            (size, &plain[..]),
            "{resolution}"
        );
    }
    // Greys of Radiance's white stay grey; its own red is not Rec. 709's.
    let primaries = "#?RADIANCE\nPRIMARIES= 0.64 0.33 0.29 0.60 0.15 0.06 0.3333 0.3333\n";
    let xyz = "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n";
    for header in [primaries, xyz] {
        let image = read(&radiance(header, "-Y 1 +X 2", false)).unwrap();
        assert!(
            image.pixels[3..].iter().all(|x| (x - 4.0).abs() < 0.01),
            "{:?}",
            image.pixels
        );
        assert!((image.pixels[0] - 0.5).abs() > 0.01, "{:?}", image.pixels);
    }
    for (header, resolution, fault) in [
        ("#?RADIANCE\nEXPOSURE=0\n", "-Y 1 +X 2", "above 0"),
        ("#?RADIANCE\nEXPOSURE=x\n", "-Y 1 +X 2", "not a number"),
        ("#?RADIANCE\nCOLORCORR=1\n", "-Y 1 +X 2", "three numbers"),
        ("#?RADIANCE\nPRIMARIES=1\n", "-Y 1 +X 2", "chromaticity"),
        ("#?RADIANCE\nFORMAT=ascii\n", "-Y 1 +X 2", "FORMAT ascii"),
        ("#?RADIANCE\n", "-Y 0 +X 2", "no resolution"),
        ("#?RADIANCE\n", "-Y 1 +Y 2", "no resolution"),
        ("#?RADIANCE\n", "-Y 99999 +X 99999", "too many"),
        ("#?RADIANCE\n", "-Y 9 +X 2", "a.hdr"),
        ("RADIANCE\n", "-Y 1 +X 2", "#?RGBE"),
    ] {
        let error = read(&radiance(header, resolution, false))
            .expect_err(fault)
            .to_string();
        assert!(error.contains(fault), "{error}");
    }
}

#[test]
fn layers_that_do_not_fit_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let mut bad = picture();
    bad.layers[1].pixels.pop();
    let error = write(&path, &bad, &DISPLAY).unwrap_err().to_string();
    assert!(error.contains("normal"), "{error}");
    assert!(!path.exists());
}

#[test]
fn outputs_are_checked_before_rendering() {
    let dir = tempfile::tempdir().unwrap();
    let error = |name: &str| {
        let path = dir.path().join(name);
        let text = check_output(&path).unwrap_err().to_string();
        assert!(text.contains(name), "{text}");
        text
    };
    assert!(check_output(&dir.path().join("a.exr")).is_ok());
    assert!(check_output(&dir.path().join("a.PNG")).is_ok());
    assert!(error("a.jpg").contains(".exr or .png"));
    assert!(error("a").contains(".exr or .png"));
    assert!(error("no/a.exr").contains("no folder"));
    fs::create_dir(dir.path().join("d.exr")).unwrap();
    assert!(error("d.exr").contains("is a folder"));
    assert_eq!(
        fs::read_dir(dir.path()).unwrap().count(),
        1,
        "leaves nothing"
    );
}

/// Truncated and corrupted files give errors that name the file (or other pixels), never a panic.
#[test]
fn broken_exr_files_are_errors() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    write(&path, &picture(), &DISPLAY).unwrap();
    let good = fs::read(&path).unwrap();
    for cut in (0..good.len()).step_by(997) {
        fs::write(&path, &good[..cut]).unwrap();
        let error = read_picture(&path).unwrap_err().to_string();
        assert!(error.contains("a.exr"), "{error}");
    }
    let positions = noise(200, 7);
    for (i, x) in positions.iter().enumerate() {
        let mut bad = good.clone();
        // Half of the hits in the header, where they hurt.
        let end = if i % 2 == 0 { 2000 } else { bad.len() };
        bad[x.to_bits() as usize % end] ^= 1 << (i % 8);
        fs::write(&path, bad).unwrap();
        let _ = (read_picture(&path), read_rgb(&path));
    }
}

#[test]
fn another_programs_exr_cannot_be_resumed() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    exr::prelude::write_rgb_file(&path, 3, 2, |x, y| (x as f32, y as f32, 0.5f32)).unwrap();
    let error = read_picture(&path).unwrap_err().to_string();
    assert!(error.contains("lightfall.sceneHash"), "{error}");
    let (width, height, rgb) = read_rgb(&path).unwrap();
    assert_eq!((width, height), (3, 2));
    assert_eq!(rgb[12..], [1.0, 1.0, 0.5, 2.0, 1.0, 0.5]);
}

#[test]
fn png_holds_srgb_and_its_exposure() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.png");
    let mut picture = picture();
    (picture.width, picture.height) = (3, 1);
    let pixels = vec![0.0, 0.25, 0.5, 1.0, 4.0, -1.0, 0.1, 0.1, 0.1];
    picture.layers = vec![Layer::new("", &["R", "G", "B"], pixels)];
    let display = Display {
        exposure: Exposure::Ev(1.0),
        tone: Tone::Linear,
    };
    write(&path, &picture, &display).unwrap();

    let decoder = png::Decoder::new(std::io::BufReader::new(fs::File::open(&path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    // sRGB of 0, 0.5, 1 | clipped | 0.2: IEC 61966-2-1 by hand.
    assert_eq!(bytes, [0, 188, 255, 255, 255, 0, 124, 124, 124]);
    let text = |key: &str| {
        let chunks = &reader.info().uncompressed_latin1_text;
        let chunk = chunks.iter().find(|c| c.keyword == key).unwrap();
        chunk.text.clone()
    };
    assert_eq!(text("lightfall.exposure"), "1 EV");
    assert_eq!(text("lightfall.tone"), "linear");
    assert_eq!(text("lightfall.seed"), u64::MAX.to_string());
    assert_eq!(
        text("lightfall.settings"),
        "camera='Küche ??' alpha=0.6666667"
    );
}

/// Values of Khronos' GLSL worked out by hand.
#[test]
fn neutral_curve_has_its_published_values() {
    let close = |rgb: [f32; 3], expected: [f32; 3]| {
        let got = neutral(rgb);
        for i in 0..3 {
            assert!((got[i] - expected[i]).abs() < 1e-5, "{rgb:?}: {got:?}");
        }
    };
    close([0.0; 3], [0.0; 3]);
    // Below the toe's end: x - (x - 6.25 x²) = 6.25 x².
    close([0.04; 3], [0.01; 3]);
    // Above it, in the linear part: minus 0.04.
    close([0.5, 0.3, 0.1], [0.46, 0.26, 0.06]);
    // Peak 1 - 0.04 = 0.96: 1 - 0.24² / (0.96 + 0.24 - 0.76) = 0.869 090 9.
    close([1.0; 3], [0.869_090_9; 3]);
    // Red at 3.96 after the offset of an unlit minimum is none: peak 4 -> 1 - 0.0576 / 3.48;
    // g = 1 - 1 / (0.15 (4 - 0.983 448 3) + 1) = 0.311 521 9, mixed towards white.
    close([4.0, 0.0, 0.0], [0.983_448_3, 0.306_365_7, 0.306_365_7]);
}

#[test]
fn tone_curves_are_monotonic_and_bounded() {
    for tone in [Tone::Neutral, Tone::Linear] {
        let mut last = -1.0;
        for step in 0..4000 {
            let grey = tone.apply([1e-6 * 1.02f32.powi(step); 3]);
            assert!(grey[0] >= last && (0.0..=1.0).contains(&grey[0]), "{step}");
            last = grey[0];
        }
        assert!(last > 0.999);
        for x in [
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MAX,
            -1.0,
            1e-45,
        ] {
            for rgb in [[x; 3], [x, 0.0, 1.0]] {
                let mapped = tone.apply(rgb);
                assert!(
                    mapped.iter().all(|c| (0.0..=1.0).contains(c)),
                    "{rgb:?}: {mapped:?}"
                );
            }
        }
    }
}

#[test]
fn auto_exposure_takes_any_light() {
    let grey = |y: f32| [y, y, y];
    // A flat image comes out at middle grey, whatever its unit.
    for y in [1e-38, 1e-8, 1.0, 1e12, 1e38] {
        let image = grey(y).repeat(100);
        let shown = f64::from(y) * auto_exposure(&image).exp2();
        assert!((shown / 0.18 - 1.0).abs() < 1e-5, "{y}: {shown}");
    }
    assert_eq!(auto_exposure(&[]), 0.0);
    assert_eq!(auto_exposure(&[0.0; 300]), 0.0);
    assert_eq!(
        auto_exposure(&[f32::NAN, 0.0, -1.0, f32::INFINITY, 1.0, 1.0]),
        0.0
    );
    // Black surroundings do not count.
    let mut image = [0.0; 3].repeat(9000);
    image.extend(grey(0.18).repeat(100));
    assert!(auto_exposure(&image).abs() < 1e-5);
    // 1 % of fireflies changes little.
    let mut image = grey(1.0).repeat(990);
    let calm = auto_exposure(&image);
    image.extend(grey(1e12).repeat(10));
    assert!((auto_exposure(&image) - calm).abs() < 0.01);
    // Faint light over most of the image does not wash out the lit part.
    let mut image = grey(1e-8).repeat(900);
    image.extend(grey(100.0).repeat(100));
    let shown = luminance(grey(100.0)) * auto_exposure(&image).exp2() as f32;
    assert!((shown - 1.0).abs() < 1e-5, "{shown}");
}
