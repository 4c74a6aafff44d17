//! `lightfall bench` as a user meets it. Needs a Vulkan device, as rendering does.

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/ring-caustic.glb");

fn bench(args: &[&str]) -> Output {
    let binary = env!("CARGO_BIN_EXE_lightfall");
    Command::new(binary)
        .arg("bench")
        .args(args)
        .output()
        .unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn path(folder: &Path, name: &str) -> String {
    folder.join(name).to_str().unwrap().into()
}

#[test]
fn a_small_bench_from_end_to_end() {
    let dir = tempfile::tempdir().unwrap();
    let (cache, out) = (path(dir.path(), "cache"), path(dir.path(), "report"));
    let args = [
        SCENE,
        "--techniques=rtpm,rtpm:evaluate=stochastic",
        "--budget=6i",
        "--seeds=2",
        "--reference-budget=16i",
        "--size=64x64",
        "--set=photons=3000,trace=software",
        "--cache",
        &cache,
        "-o",
        &out,
    ];
    let output = bench(&args);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("rendering for 16 iterations"),
        "{}",
        stderr(&output)
    );

    let file = |name: &str| fs::read_to_string(Path::new(&out).join(name)).unwrap();
    let results: Value = serde_json::from_str(&file("results.json")).unwrap();
    assert_eq!(results["techniques"][1], "rtpm:evaluate=stochastic");
    assert!(
        results["about"]["command"]
            .as_str()
            .unwrap()
            .starts_with("lightfall bench")
    );
    let scene = &results["scenes"][0];
    let noise = scene["reference"]["relmse_of_its_noise"].as_f64().unwrap();
    assert!(noise > 0.0 && noise < 1.0, "{noise}");
    let runs = scene["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 4);
    for run in runs {
        assert_eq!(run["failure"], Value::Null);
        assert_eq!(run["iterations"], 6);
        assert_eq!(run["photons"]["emitted"], 18_000);
        assert!(run["photons"]["stored_caustic"].as_u64().unwrap() > 0);
        let checkpoints = run["checkpoints"].as_array().unwrap();
        let errors: Vec<f64> = checkpoints
            .iter()
            .map(|c| c["relmse"].as_f64().unwrap())
            .collect();
        let (first, last) = (errors[0], errors[errors.len() - 1]);
        assert!(last < first && last > 0.0, "{errors:?}");
        assert_eq!(checkpoints.last().unwrap()["iterations"], 6);
        // The device's timestamps are within the host's time.
        let passes = run["pass_ms_median"].as_object().unwrap();
        assert!(passes["emit"].as_f64().unwrap() > 0.0, "{passes:?}");
        let sum: f64 = passes.values().map(|ms| ms.as_f64().unwrap()).sum();
        assert!(
            sum * 6.0 < 2.0 * run["seconds"].as_f64().unwrap() * 1e3,
            "{passes:?}"
        );
    }
    // The same photons, other evaluation: equal seeds give nearly equal images, so that the error is alike.
    let equal_iterations = &scene["standings"][2];
    assert_eq!(equal_iterations["equal"], "iterations");
    assert_eq!(equal_iterations["at"], 6.0);
    assert_eq!(
        equal_iterations["techniques"][0]["of_each_seed"]
            .as_array()
            .unwrap()
            .len(),
        2
    );
    let ablations = scene["ablations"].as_array().unwrap();
    assert_eq!(ablations.len(), 2, "of each seed");
    let ablation = &ablations[1];
    assert_eq!(ablation["combinations"].as_array().unwrap().len(), 4);
    let radii = ablation["radii"].as_array().unwrap();
    let radius = |i: usize| {
        radii[i]["full"]["first_radius_m"]["global"]
            .as_f64()
            .unwrap()
    };
    assert!((radius(2) / radius(0) - 4.0).abs() < 1e-3, "{radii:?}");

    let rows = file("results.csv");
    assert!(
        rows.starts_with("scene,technique,seed,iterations,seconds,relmse,"),
        "{rows}"
    );
    assert_eq!(
        rows.lines().filter(|l| l.contains(",6,")).count(),
        4,
        "{rows}"
    );

    let page = file("report.html");
    for outside in ["http:", "https:", "<script", "<link", "@import", "url("] {
        assert!(!page.contains(outside), "{outside}");
    }
    assert!(page.matches("src=\"").count() == page.matches("src=\"data:image/png;base64,").count());
    assert!(page.matches("<img").count() == 5 && page.matches("<svg").count() > 6);
    for open in ["div", "table", "figure", "svg", "p", "td", "span"] {
        let ends = page.matches(&format!("</{open}>")).count();
        let starts =
            page.matches(&format!("<{open}>")).count() + page.matches(&format!("<{open} ")).count();
        assert_eq!(starts, ends, "{open}");
    }
    assert!(!page.contains("NaN"));

    // The reference is there now, and long enough.
    let output = bench(
        &[
            &args[..],
            &["--techniques=rtpm", "--skip-ablation", "--seeds=1"],
        ]
        .concat(),
    );
    assert_eq!(output.status.code(), Some(2), "an option twice");
    let again = [
        &[SCENE, "--techniques=rtpm", "--skip-ablation", "--seeds=1"],
        &args[4..],
    ]
    .concat();
    let output = bench(&again);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(
        !stderr(&output).contains("rendering for"),
        "{}",
        stderr(&output)
    );
    let page = file("report.html");
    assert!(page.contains("nobody to compare with") && !page.contains("wins"));
}

/// Points do what they say, the front is among them, and a reference file of a larger size serves.
#[test]
fn a_trade_from_end_to_end() {
    const ROOM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/room.glb");
    let dir = tempfile::tempdir().unwrap();
    let (reference, out) = (path(dir.path(), "room.exr"), path(dir.path(), "report"));
    let rendered = Command::new(env!("CARGO_BIN_EXE_lightfall"))
        .args(["render", ROOM, "-o", &reference, "--size=64x64"])
        .args(["--iterations=24", "--photons=4000", "--quiet"])
        .status();
    assert!(rendered.unwrap().success());
    let args = [
        ROOM,
        "--trade",
        "--techniques=hash-grid,hash-grid:alpha=0.6,photons=1500",
        "--budget=4i",
        "--seeds=1",
        "--size=32x32",
        "--set=photons=1000,max-depth=4",
        "--reference",
        &reference,
        "-o",
        &out,
    ];
    let output = bench(&args);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let file = |name: &str| fs::read_to_string(Path::new(&out).join(name)).unwrap();
    let results: Value = serde_json::from_str(&file("results.json")).unwrap();
    let labels: Vec<&str> = results["techniques"]
        .as_array()
        .unwrap()
        .iter()
        .map(|l| l.as_str().unwrap())
        .collect();
    assert_eq!(labels[0], "hash-grid");
    assert_eq!(labels[labels.len() - 1], "hash-grid:alpha=0.6,photons=1500");
    let scene = &results["scenes"][0];
    let run = |label: &str| {
        let index = labels.iter().position(|l| *l == label).unwrap();
        let run = &scene["runs"][index];
        assert_eq!(run["technique"], index);
        assert_eq!(run["failure"], Value::Null, "{label}");
        run
    };
    let emitted = |label| run(label)["photons"]["emitted"].as_u64().unwrap();
    assert_eq!(emitted("hash-grid"), 4000);
    assert_eq!(emitted("photons × 2"), 8000);
    assert_eq!(emitted("hash-grid:alpha=0.6,photons=1500"), 6000);
    let radius = |label| run(label)["first_radius_m"]["global"].as_f64().unwrap();
    assert!((radius("radii × 2") / radius("hash-grid") - 2.0).abs() < 1e-6);
    // What a smaller image blurs when it is enlarged shows even in noise.
    let error = |label| {
        let checkpoints = run(label)["checkpoints"].as_array().unwrap();
        checkpoints.last().unwrap()["relmse"].as_f64().unwrap()
    };
    assert!(error("size × 0.5") > 1.1 * error("hash-grid"));

    let points = scene["trade"]["points"].as_array().unwrap();
    assert_eq!(points.len(), labels.len());
    assert_eq!(points[0]["error_over_first"][2]["value"], 1.0);
    for time in 0..3 {
        let least = points.iter().filter(|p| p["places"][time] == "least");
        assert!(least.count() <= 1);
        assert!(
            points.iter().all(|p| p["places"][time] != "behind"),
            "one seed beats nobody"
        );
    }
    assert!(points.iter().any(|p| p["on_front"] == true));
    let overall = results["trade"]["points"].as_array().unwrap();
    assert_eq!(overall.len(), labels.len());
    assert!(scene["reference"]["relmse_of_its_noise"].as_f64().unwrap() > 0.0);

    let page = file("report.html");
    for word in [
        "What a setting buys",
        "photons × 0.25",
        "The front of error",
    ] {
        assert!(page.contains(word), "{word}");
    }
    assert!(!page.contains("NaN") && !page.contains("Who is ahead"));
    // Some other size does not.
    let odd = [&args[..5], &["--size=48x48"], &args[6..]].concat();
    let output = bench(&odd);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("no multiple"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn faults_are_told_before_anything_slow() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(dir.path(), "report");
    for (args, code, word) in [
        (vec![SCENE, "--techniques=magic"], 2, "magic"),
        (
            vec![SCENE, "--techniques=rtpm,rtpm:colour=red"],
            2,
            "colour",
        ),
        (vec![SCENE, "--set=photons=none"], 2, "photons"),
        (vec![SCENE, "--budget=0i"], 2, "200i"),
        (vec![SCENE, "--budget=soon"], 2, "30s"),
        (vec![SCENE, "--seeds=0"], 2, "1.."),
        (vec!["none.glb"], 1, "none.glb"),
        (vec![SCENE, "--reference=none.exr"], 1, "none.exr"),
    ] {
        let output = bench(&[&args[..], &["-o", &out]].concat());
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{args:?}: {text}");
        assert!(
            text.contains(word) && !text.contains("panicked"),
            "{args:?}: {text}"
        );
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_bench_writes_its_report() {
    use std::io::{BufRead, BufReader};
    let dir = tempfile::tempdir().unwrap();
    let (cache, out) = (path(dir.path(), "cache"), path(dir.path(), "report"));
    let mut child = Command::new(env!("CARGO_BIN_EXE_lightfall"))
        .args([
            "bench",
            SCENE,
            "--techniques=rtpm",
            "--seeds=900",
            "--budget=3i",
        ])
        .args([
            "--reference-budget=4i",
            "--size=32x32",
            "--set=photons=1000",
        ])
        .args(["--cache", &cache, "-o", &out])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap())
        .lines()
        .map_while(Result::ok);
    assert!(
        lines.any(|line| line.contains("seed 2 of 900")),
        "it ended by itself"
    );
    let kill = format!("kill -TERM {}", child.id());
    assert!(
        Command::new("sh")
            .args(["-c", &kill])
            .status()
            .unwrap()
            .success()
    );
    lines.for_each(drop);
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let page = fs::read_to_string(Path::new(&out).join("report.html")).unwrap();
    assert!(page.contains("Interrupted"));
    let json = fs::read_to_string(Path::new(&out).join("results.json")).unwrap();
    let results: Value = serde_json::from_str(&json).unwrap();
    assert!(results["scenes"][0]["runs"].as_array().unwrap().len() >= 2);
}
