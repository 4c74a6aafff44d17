//! The binary as a user meets it: exit codes and messages. Nothing here needs a device.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
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
