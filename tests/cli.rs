//! The binary as a user meets it: exit codes, messages, files.
//! Rendering needs a Vulkan device; Mesa's lavapipe (mesa-vulkan-drivers) will do.

use lightfall::image::{
    Display, Exposure, Layer, Metadata, Picture, Tone, read_layer, read_picture, write,
};
use serde_json::{Value, json};
use std::{
    fs,
    io::{BufRead, BufReader},
    path::Path,
    process::{Command, Output, Stdio},
};

fn lightfall(args: &[&str]) -> Output {
    let binary = env!("CARGO_BIN_EXE_lightfall");
    Command::new(binary).args(args).output().unwrap()
}

/// Runs, checks the exit code, and returns stderr.
fn fails(args: &[&str], code: i32) -> String {
    let output = lightfall(args);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{args:?}: {stderr}");
    assert!(stderr.starts_with("error: "), "{args:?}: {stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
    stderr
}

#[test]
fn usage_errors_name_the_option_and_the_range() {
    for (option, value, message) in [
        ("--size", "0x1", "16384"),
        ("--size", "20000x100", "16384"),
        ("--size", "100", "WxH"),
        ("--radius", "0", "above 0"),
        ("--radius", "4cm", "pixels"),
        ("--caustic-radius", "-1px", "above 0"),
        ("--photons", "0", "1.."),
        ("--photons", "5000000000", "1.."),
        ("--iterations", "0", "1.."),
        ("--time", "soon", "30s"),
        ("--target-error", "0", "0.05"),
        ("--target-error", "1", "0.05"),
        ("--target-error", "nan", "0.05"),
        ("--quality", "best", "draft, normal, final"),
        ("--seed", "-1", "invalid"),
        ("--max-depth", "0", "1.."),
        ("--trace", "psychic", "software"),
        ("--technique", "magic", "rtpm"),
        ("--cull", "maybe", "off"),
        ("--evaluate", "half", "stochastic"),
        ("--reservoir", "0", "1.."),
        ("--reject", "1", "below 1"),
        ("--alpha", "1", "below 1"),
        ("--exposure", "bright", "auto"),
        ("--tone", "sepia", "neutral"),
        ("--resume", "a.png", "only .exr"),
        ("--env", "sky.png", ".exr or .hdr"),
        ("--env", "-1", "0.2,0.3,0.5"),
        ("--env", "1,2", "0.2,0.3,0.5"),
        ("--env-strength", "-1", "from 0"),
        ("--env-rotate", "361", "360"),
        ("-o", "a.jpg", ".exr or .png"),
    ] {
        let argument = format!("{option}={value}");
        let argument = if option == "-o" { "-oa.jpg" } else { &argument };
        let stderr = fails(&["render", "a.glb", "-o", "a.exr", argument], 2);
        assert!(stderr.contains(message), "{argument}: {stderr}");
        assert!(stderr.contains(option), "{argument}: {stderr}");
    }
    fails(&["render", "a.glb"], 2);
    fails(&["render", "-o", "a.exr"], 2);
    fails(&["frobnicate"], 2);
}

#[test]
fn failures_name_the_file() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_string();
    let (scene, image) = (at("scene.glb"), at("image.exr"));
    for (args, named) in [
        (vec!["info", scene.as_str()], "scene.glb"),
        (vec!["render", &scene, "-o", &image], "scene.glb"),
        (
            vec!["render", &scene, "-o", &at("no/image.exr")],
            "no/image.exr",
        ),
        (
            vec!["render", &scene, "-o", &image, "--resume", &at("old.exr")],
            "old.exr",
        ),
    ] {
        let stderr = fails(&args, 1);
        assert!(stderr.contains(named), "{stderr}");
    }
    // A resume file that is no EXR.
    fs::write(at("old.exr"), "not an image").unwrap();
    let stderr = fails(
        &["render", &scene, "-o", &image, "--resume", &at("old.exr")],
        1,
    );
    assert!(stderr.contains("old.exr"), "{stderr}");
    assert!(!Path::new(&image).exists());
}

#[test]
fn help_names_every_default() {
    let output = lightfall(&["render", "--help"]);
    assert_eq!(output.status.code(), Some(0));
    let help = String::from_utf8(output.stdout).unwrap();
    for text in [
        "60 s",
        "neutral",
        "PBR Neutral",
        "[default: auto]",
        "[default: 12]",
    ] {
        assert!(help.contains(text), "{text}");
    }
}

/// A lamp 1 m above a floor of 2 m × 2 m, as .gltf and .bin in `dir`.
fn write_scene(dir: &Path) -> String {
    let mut bin = Vec::new();
    for [x, z] in [[-1f32, -1f32], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]] {
        bin.extend([x, 0.0, z].iter().flat_map(|f| f.to_le_bytes()));
    }
    bin.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    fs::write(dir.join("floor.bin"), &bin).unwrap();
    let lamp = json!({"lights": [{"type": "point", "intensity": 10.0}]});
    let scene = json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": lamp},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [
            {"mesh": 0},
            {"translation": [0, 1, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}}
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0.0}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
             "min": [-1, 0, -1], "max": [1, 0, 1]},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 12}
        ],
        "buffers": [{"byteLength": 60, "uri": "floor.bin"}]
    });
    let path = dir.join("floor.gltf");
    fs::write(&path, scene.to_string()).unwrap();
    path.to_str().unwrap().into()
}

const SMALL: [&str; 4] = ["--size", "32x24", "--photons", "5000"];

fn bits(picture: &Picture) -> Vec<u32> {
    let pixels = picture.layers.iter().flat_map(|l| &l.pixels);
    pixels.map(|x| x.to_bits()).collect()
}

#[test]
fn a_resumed_render_is_the_whole_render() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scene(dir.path());
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_string();
    let (whole, half, png) = (at("whole.exr"), at("half.exr"), at("half.png"));
    let render = |args: &[&str]| {
        let common = ["render", &scene, "--trace", "software", "--json"];
        let output = lightfall(&[&common[..], &SMALL, args].concat());
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{args:?}: {stderr}");
        let stdout = String::from_utf8(output.stdout).unwrap();
        let lines = stdout.lines().map(serde_json::from_str);
        lines.collect::<Result<Vec<Value>, _>>().unwrap()
    };
    render(&["--iterations", "5", "-o", &whole]);
    let events = render(&["--iterations", "2", "-o", &half, "-o", &png]);
    assert_eq!(events[0]["event"], "start");
    assert_eq!(events[0]["triangles"], 2);
    let end = events.last().unwrap();
    assert_eq!(end["event"], "done");
    assert_eq!(end["iterations"], 2);
    assert_eq!(end["photons"], 10_000);
    assert_eq!(end["outputs"], json!([half, png]));
    assert!(Path::new(&png).exists());

    // In place: the file read is the file replaced.
    let events = render(&["--iterations", "5", "-o", &half, "--resume", &half]);
    assert_eq!(events[0]["iterations"], 2);
    assert_eq!(events.last().unwrap()["photons"], 15_000, "of this run");
    let [whole, half] = [whole, half].map(|path| read_picture(path.as_ref()).unwrap());
    assert!(bits(&whole).iter().any(|&b| b != 0), "all black");
    assert_eq!(bits(&half), bits(&whole));
    assert_eq!(half.metadata.iterations, 5);

    // Other settings would give another image.
    let path = at("half.exr");
    let args = [
        "render", &scene, "-o", &path, "--resume", &path, "--size", "8x8",
    ];
    let stderr = fails(&[&args[..], &["--quiet"]].concat(), 1);
    assert!(stderr.contains("half.exr"), "{stderr}");
    assert!(stderr.contains("size 32x24, now 8x8"), "{stderr}");
}

/// Threads of a subgroup search the grid together, however many they are: Mesa's CPU driver makes them as many as fit the
/// vectors that it is told to use. On other devices these are three times the same.
#[test]
fn subgroups_of_any_width_make_the_same_image() {
    let dir = tempfile::tempdir().unwrap();
    let [truth, narrow, wide] = ["256", "128", "512"].map(|bits| {
        let path = dir.path().join(bits).with_extension("exr");
        let output = Command::new(env!("CARGO_BIN_EXE_lightfall"))
            .env("LP_NATIVE_VECTOR_WIDTH", bits)
            // It would give back code for other vectors.
            .env("MESA_SHADER_CACHE_DISABLE", "true")
            .args(["render", "scenes/cornell.glb", "--technique", "hash-grid"])
            .args(["--iterations", "2", "--quiet", "-o"])
            .arg(&path)
            .args(SMALL)
            .output()
            .unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{stderr}");
        read_picture(&path).unwrap()
    });
    for picture in [narrow, wide] {
        for name in ["emission", "direct", "caustic", "global"] {
            let layer = |picture: &Picture| {
                let layer = picture.layers.iter().find(|layer| layer.name == name);
                layer.unwrap().pixels.clone()
            };
            let (truth, pixels) = (layer(&truth), layer(&picture));
            assert!(truth.iter().any(|&x| x > 0.0), "{name} is black");
            let differs = |(a, b): &(&f32, &f32)| (*a - *b).abs() > 1e-4 * a.abs();
            assert_eq!(
                truth.iter().zip(&pixels).filter(differs).count(),
                0,
                "{name}"
            );
        }
    }
}

/// Maps of both formats, scaled; what is no map; and another sky is another scene.
#[test]
fn an_environment_lights_a_dark_scene() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scene(dir.path());
    let dark = fs::read_to_string(&scene).unwrap().replace("10.0", "0.0");
    fs::write(&scene, dark).unwrap();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_string();
    let image = at("image.exr");
    let args = ["render", &scene, "-o", &image, "--iterations", "1"];
    let args = [&args[..], &SMALL].concat();
    let quiet = [&args[..], &["--quiet"]].concat();

    // 0.5, 1, 2 in RGBE; in the EXR one value is no radiance.
    let rgb = [0.5_f32, 1.0, 2.0];
    let hdr = image::codecs::hdr::HdrEncoder::new(fs::File::create(at("sky.hdr")).unwrap());
    hdr.encode(&[image::Rgb(rgb); 8], 4, 2).unwrap();
    let mut pixels = rgb.repeat(8);
    pixels[0] = -1.0;
    let sky = Picture {
        width: 4,
        height: 2,
        layers: vec![Layer::new("", &["R", "G", "B"], pixels)],
        metadata: Metadata::default(),
    };
    let display = Display {
        exposure: Exposure::Auto,
        tone: Tone::Neutral,
    };
    write(at("sky.exr").as_ref(), &sky, &display).unwrap();
    for (name, warned) in [("sky.hdr", false), ("sky.exr", true)] {
        let sky = at(name);
        let lit = lightfall(&[&args[..], &["--env", &sky, "--env-strength", "2"]].concat());
        let stderr = String::from_utf8(lit.stderr).unwrap();
        assert_eq!(lit.status.code(), Some(0), "{stderr}");
        assert_eq!(
            stderr.contains("--env: 1 values are negative"),
            warned,
            "{stderr}"
        );
        let seen = read_layer(image.as_ref(), "emission").unwrap().pixels;
        let brightest = |c: usize| {
            seen.iter()
                .skip(c)
                .step_by(3)
                .fold(0.0, |a: f32, b| a.max(*b))
        };
        assert_eq!([0, 1, 2].map(brightest), [1.0, 2.0, 4.0], "{name}");
    }
    let resume = ["--resume", &image, "--env", "1"];
    let stderr = fails(&[&quiet[..], &resume].concat(), 1);
    assert!(stderr.contains("another scene"), "{stderr}");

    for env in [&["--env", "0"][..], &[]] {
        let stderr = fails(&[&quiet[..], env].concat(), 1);
        assert!(
            stderr.contains("nothing emits light: say --env"),
            "{stderr}"
        );
    }
    for name in ["broken.hdr", "broken.exr", "missing.hdr", "missing.exr"] {
        if name.starts_with("broken") {
            fs::write(at(name), "not an image").unwrap();
        }
        let stderr = fails(&[&quiet[..], &["--env", &at(name)]].concat(), 1);
        assert!(stderr.contains(name), "{stderr}");
    }
}

/// Not the scene's texture, nor the map, nor the images compared.
#[test]
fn inputs_are_not_overwritten() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scene(dir.path());
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_string();
    let (texture, image) = (at("t.png"), at("e.exr"));
    image::RgbImage::from_pixel(1, 1, image::Rgb([255; 3]))
        .save(&texture)
        .unwrap();
    let mut json: Value = serde_json::from_str(&fs::read_to_string(&scene).unwrap()).unwrap();
    json["images"] = json!([{"uri": "t.png"}]);
    json["textures"] = json!([{"source": 0}]);
    json["materials"][0]["emissiveTexture"] = json!({"index": 0});
    fs::write(&scene, json.to_string()).unwrap();

    let before = fs::read(&texture).unwrap();
    let render = ["render", &scene, "--iterations", "1", "--quiet", "-o"];
    let render = |output: &[&str]| lightfall(&[&render[..], output, &SMALL].concat());
    assert_eq!(render(&[&image]).status.code(), Some(0));
    let compare = ["compare", &image, &image, "-o", &image];
    for (refused, name) in [
        (render(&[&texture]), "t.png"),
        (render(&[&image, "--env", &image]), "e.exr"),
        (lightfall(&compare), "e.exr"),
    ] {
        let stderr = String::from_utf8(refused.stderr).unwrap();
        let fault = format!("{name}: is read as an input");
        assert!(stderr.contains(&fault), "{stderr}");
    }
    assert_eq!(fs::read(&texture).unwrap(), before);
}

/// `--root` and `--strict` reach the loader.
#[test]
fn how_files_are_read_can_be_said() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scene(dir.path());
    let below = dir.path().join("below");
    fs::create_dir(&below).unwrap();
    let text = fs::read_to_string(&scene).unwrap();
    let moved = below.join("floor.gltf");
    fs::write(&moved, text.replace("floor.bin", "../floor.bin")).unwrap();
    let moved = moved.to_str().unwrap();
    let stderr = fails(&["info", moved], 1);
    assert!(stderr.contains("--root DIR"), "{stderr}");
    let root = dir.path().to_str().unwrap();
    assert_eq!(
        lightfall(&["info", moved, "--root", root]).status.code(),
        Some(0)
    );
    fails(&["info", moved, "--root", root, "--strict"], 2);
    fails(&["info", moved, "--root", &scene], 2);

    assert_eq!(
        lightfall(&["info", &scene, "--strict"]).status.code(),
        Some(0)
    );
    fs::write(&scene, format!("\u{feff}{text}")).unwrap();
    assert_eq!(lightfall(&["info", &scene]).status.code(), Some(0));
    let stderr = fails(&["info", &scene, "--strict"], 1);
    assert!(stderr.contains("byte order mark"), "{stderr}");
}

/// A word says when to stop, unless a number does.
#[test]
fn qualities_stop_by_themselves() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scene(dir.path());
    let image = dir.path().join("image.exr");
    let render = |args: &[&str]| {
        let common = ["render", &scene, "-o", image.to_str().unwrap()];
        let output = lightfall(&[&common[..], &SMALL, args].concat());
        assert_eq!(output.status.code(), Some(0), "{args:?}");
        String::from_utf8(output.stderr).unwrap()
    };
    let draft = render(&["--quality", "draft"]);
    assert!(draft.contains("target of 25 % reached"), "{draft}");
    let two = render(&["--quality", "final", "--iterations", "2"]);
    assert!(
        two.contains(": 2 iterations") && !two.contains("target"),
        "{two}"
    );
}

#[cfg(unix)]
#[test]
fn an_interrupted_render_writes_its_image() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scene(dir.path());
    let image = dir.path().join("image.exr");
    let mut render = Command::new(env!("CARGO_BIN_EXE_lightfall"))
        .args(["render", &scene, "--time", "2m", "--json", "--quiet", "-o"])
        .arg(&image)
        .args(SMALL)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    // Progress is reported only once the signal is being watched for.
    let mut lines = BufReader::new(render.stdout.take().unwrap()).lines();
    let mut next = || serde_json::from_str::<Value>(&lines.next().unwrap().unwrap()).unwrap();
    assert_eq!(next()["event"], "start");
    assert_eq!(next()["event"], "progress");
    // By the shell, which knows `kill` where no such program is installed.
    let kill = format!("kill -TERM {}", render.id());
    let killed = Command::new("sh").args(["-c", &kill]).status().unwrap();
    assert!(killed.success());
    let end = std::iter::repeat_with(next)
        .find(|e| e["event"] != "progress")
        .unwrap();
    assert_eq!(end["event"], "interrupted");
    assert_eq!(render.wait().unwrap().code(), Some(130));
    let picture = read_picture(&image).unwrap();
    assert_eq!(end["iterations"], picture.metadata.iterations);
    assert!(picture.metadata.seconds >= 1.0);
}

/// 16 x 16 pixels of one grey, with depth.
fn write_grey(path: &Path, value: f32) {
    use lightfall::image::{Display, Exposure, Layer, Metadata, Tone, write};
    let picture = Picture {
        width: 16,
        height: 16,
        layers: vec![
            Layer::new("", &["R", "G", "B"], vec![value; 768]),
            Layer::new("depth", &["Z"], vec![2.0 * value; 256]),
        ],
        metadata: Metadata::default(),
    };
    let display = Display {
        exposure: Exposure::Auto,
        tone: Tone::Neutral,
    };
    write(path, &picture, &display).unwrap();
}

#[test]
fn compare_measures_and_judges() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_string();
    let (a, b, small) = (at("a.exr"), at("b.exr"), at("small.exr"));
    write_grey(a.as_ref(), 0.75);
    write_grey(b.as_ref(), 0.5);
    let compare = |args: &[&str]| lightfall(&[&["compare", &a, &b], args].concat());

    // (0.25)² / (0.25 + 0.01)
    let output = compare(&["--json"]);
    assert_eq!(output.status.code(), Some(0));
    let numbers: Value = serde_json::from_slice(&output.stdout).unwrap();
    let near = |name: &str, x: f64| (numbers[name].as_f64().unwrap() - x).abs() < 1e-6;
    assert!(
        near("relmse", 0.0625 / 0.26) && near("relmse-trimmed", 0.0625 / 0.26),
        "{numbers}"
    );
    assert!(
        near("mse", 0.0625) && near("mae", 0.25) && near("not_finite", 0.0),
        "{numbers}"
    );
    let ssim = numbers["ssim"].as_f64().unwrap();
    assert!((0.9..1.0).contains(&ssim), "{numbers}");
    let text = String::from_utf8(compare(&[]).stdout).unwrap();
    assert!(text.contains("relmse          0.240385"), "{text}");

    let layer = lightfall(&["compare", &a, &b, "--layer", "depth", "--json"]);
    let layer: Value = serde_json::from_slice(&layer.stdout).unwrap();
    assert_eq!(layer["mae"], 0.5);

    // The limit itself passes; the metric chosen is the one judged.
    assert_eq!(compare(&["--fail-above", "0.25"]).status.code(), Some(0));
    assert_eq!(
        compare(&["--fail-above", "0.25", "--metric", "mae"])
            .status
            .code(),
        Some(0)
    );
    let stderr = fails(&["compare", &a, &b, "--fail-above", "0.24"], 1);
    assert!(
        stderr.contains("a.exr") && stderr.contains("relmse is 0.240385, above 0.24"),
        "{stderr}"
    );
    fails(
        &[
            "compare",
            &a,
            &b,
            "--fail-above",
            "0.0001",
            "--metric",
            "ssim",
        ],
        1,
    );

    for (name, metric) in [("e.png", "flip"), ("e.exr", "mse")] {
        let path = at(name);
        let output = compare(&["--metric", metric, "-o", &path]);
        assert_eq!(output.status.code(), Some(0));
    }
    let map = lightfall::image::read_layer(at("e.exr").as_ref(), "").unwrap();
    assert!(map.pixels.iter().all(|&e| e == 0.0625));
    assert_eq!(image::open(at("e.png")).unwrap().width(), 16);

    // What cannot be compared.
    let dot = Picture {
        width: 1,
        height: 1,
        layers: vec![],
        metadata: Default::default(),
    };
    let layers = vec![lightfall::image::Layer::new(
        "",
        &["R", "G", "B"],
        vec![1.0; 3],
    )];
    let display = lightfall::image::Display {
        exposure: lightfall::image::Exposure::Auto,
        tone: lightfall::image::Tone::Neutral,
    };
    lightfall::image::write(small.as_ref(), &Picture { layers, ..dot }, &display).unwrap();
    let stderr = fails(&["compare", &small, &b], 1);
    assert!(
        stderr.contains("small.exr: is 1 x 1 pixels, but the reference is 16 x 16"),
        "{stderr}"
    );
    let stderr = fails(&["compare", &a, &b, "--layer", "caustic"], 1);
    assert!(
        stderr.contains("caustic.R") && stderr.contains("depth.Z"),
        "{stderr}"
    );
    let stderr = fails(&["compare", &a, &at("none.exr")], 1);
    assert!(stderr.contains("none.exr"), "{stderr}");
    for bad in [
        ["--fail-above", "nan"],
        ["--fail-above", "-1"],
        ["--metric", "taste"],
        ["-o", "e.jpg"],
    ] {
        fails(&[&["compare", &a, &b], &bad[..]].concat(), 2);
    }
}

/// A limit on the size of files stands for the disk: writing fails in the middle of a file. Without a device, whose memory
/// some drivers keep in files.
#[cfg(unix)]
#[test]
fn a_full_disk_leaves_the_image_before() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    write_grey(&at("test.exr"), 0.5);
    write_grey(&at("reference.exr"), 0.25);
    for name in ["error.exr", "error.png"] {
        fs::write(at(name), "the last good image").unwrap();
        let compare = "trap '' XFSZ; ulimit -f 0; exec \"$0\" compare test.exr reference.exr -o $1";
        let output = Command::new("sh")
            .args(["-c", compare, env!("CARGO_BIN_EXE_lightfall"), name])
            .current_dir(dir.path())
            .output()
            .unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert!(stderr.starts_with(&format!("error: {name}: ")), "{stderr}");
        assert_eq!(fs::read(at(name)).unwrap(), b"the last good image");
    }
    let left = fs::read_dir(dir.path()).unwrap().count();
    assert_eq!(left, 4, "no temporary file");
}
