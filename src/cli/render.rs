//! `lightfall render`.

use super::{
    Outcome, RenderArgs, interrupt,
    progress::{Limit, Progress, Status, print_json},
};
use crate::{
    Error, Result,
    gpu::{Commands, Gpu, OpenOptions},
    guide::Lesson,
    image::{check_inputs_survive, check_output, read_picture, write},
    render::Renderer,
    scene::{self, Scene},
};
use serde_json::{Map, Value, json};
use std::{
    io::Write,
    path::{Path, PathBuf},
    time::Instant,
};

/// Renders until the limit or an interrupt and writes all outputs.
pub fn run(args: &RenderArgs) -> Result<Outcome> {
    // What can fail fast fails before anything slow.
    for output in &args.outputs {
        check_output(output)?;
    }
    let resumed = args.resume.as_deref().map(read_picture).transpose()?;
    let environment = args.environment.load()?;
    let mut scene = scene::load_with(&args.scene, &args.load.options())?;
    let map = args.environment.file();
    let inputs: Vec<&Path> = scene
        .files
        .iter()
        .map(PathBuf::as_path)
        .chain(map)
        .collect();
    check_inputs_survive(&args.outputs, &inputs)?;
    if let Some(environment) = environment {
        scene.set_environment(environment);
    }
    for warning in &scene.warnings {
        say(args, &format!("warning: {warning}"));
    }
    let gpu = Gpu::open(&OpenOptions {
        device: args.device.as_deref(),
        validate: args.validate,
    })?;
    let device = &gpu.info().name;
    let triangles = scene.stored_triangles().count();
    say(
        args,
        &format!(
            "{}: {triangles} triangles on {device}",
            args.scene.display()
        ),
    );
    let rename = |error| with_files_named(error, args);
    let mut renderer = Renderer::new(&gpu, &scene, &args.settings).map_err(rename)?;
    if let Some(picture) = &resumed {
        renderer.resume(picture).map_err(rename)?;
    }
    if args.json {
        print_json(&json!({
            "event": "start",
            "scene": args.scene.display().to_string(),
            "triangles": triangles,
            "warnings": scene.warnings,
            "device": device,
            "iterations": renderer.iterations(),
        }));
    }

    // Only now: until here there is no image to save, and Ctrl-C may end the program as usual.
    interrupt::watch(args.quiet)?;
    let limit = limit(args);
    if args.iterations.is_some_and(|n| n <= renderer.iterations()) {
        let done = renderer.iterations();
        say(
            args,
            &format!("nothing to add: the image has {done} iterations"),
        );
    }
    let start = Instant::now();
    let mut progress = Progress::start(limit, &renderer, args.quiet, args.json);
    let mut result = Ok(());
    while result.is_ok() && !progress.limit_reached(&renderer) && !interrupt::requested() {
        result = renderer.iterate().and_then(|()| progress.update(&renderer));
    }
    progress.finish();

    let interrupted = !progress.limit_reached(&renderer);
    if renderer.iterations() == 0 {
        return result.map(|()| Outcome::Interrupted);
    }
    let before = resumed.map_or(0.0, |picture| picture.metadata.seconds);
    if let Err(error) = result {
        // Out of memory costs one iteration, not those before it. A lost device answers nothing more.
        let answers = gpu.commands().and_then(Commands::submit).is_ok();
        if answers && let Err(fault) = save(args, &renderer, before + start.elapsed().as_secs_f64())
        {
            complain(&format!("error: {fault}"));
        }
        return Err(error);
    }
    let status = progress.status(&renderer)?;
    save(args, &renderer, before + status.elapsed.as_secs_f64())?;
    report(args, &scene, &renderer, &status, limit.error, interrupted);

    let messages = gpu.validation_messages();
    for message in &messages {
        complain(message);
    }
    if args.validate && !messages.is_empty() {
        return Err(Error::Device {
            device: device.clone(),
            fault: format!(
                "{} messages of the validation layer, see above",
                messages.len()
            ),
        });
    }
    Ok(if interrupted {
        Outcome::Interrupted
    } else {
        Outcome::Done
    })
}

/// As asked for by number, else in a word.
fn limit(args: &RenderArgs) -> Limit {
    let asked = Limit {
        iterations: args.iterations,
        time: args.time,
        error: args.target_error,
    };
    match (asked.iterations, asked.time, asked.error) {
        (None, None, None) => args.quality.limit(),
        _ => asked,
    }
}

/// The renderer sees a scene and a picture, but not where they came from: the user shall.
fn with_files_named(error: Error, args: &RenderArgs) -> Error {
    match (error, &args.resume) {
        (Error::Scene { fault, .. }, _) => Error::scene(&args.scene, fault),
        (Error::Image { fault, .. }, Some(resumed)) => Error::image(resumed, fault),
        (other, _) => other,
    }
}

/// Writes every output that can be written, so that one full disk does not cost the others; the
/// first failure is returned.
fn save(args: &RenderArgs, renderer: &Renderer, seconds: f64) -> Result<()> {
    let mut picture = renderer.picture()?;
    picture.metadata.seconds = seconds;
    let mut result = Ok(());
    for output in &args.outputs {
        match write(output, &picture, &args.display) {
            Ok(0) => say(args, &format!("wrote {}", output.display())),
            Ok(n) => say(
                args,
                &format!(
                    "warning: {}: {n} values were not finite and are written as 0; please report this",
                    output.display()
                ),
            ),
            Err(error) if result.is_ok() => result = Err(error),
            Err(error) => complain(&format!("error: {error}")),
        }
    }
    result
}

/// The last words: on stderr for people, one object on stdout for programs.
fn report(
    args: &RenderArgs,
    scene: &Scene,
    renderer: &Renderer,
    status: &Status,
    target: Option<f64>,
    interrupted: bool,
) {
    let timings = if args.timings {
        renderer.timings()
    } else {
        Vec::new()
    };
    let ledger = if args.settings.ledger {
        renderer.ledger()
    } else {
        Vec::new()
    };
    let seconds = status.elapsed.as_secs_f64();
    let verb = if interrupted {
        "interrupted after"
    } else {
        "done in"
    };
    say(args, &format!("{verb} {seconds:.1} s: {}", status.text()));
    if let Some(target) = target {
        let is = if status.accuracy.reaches(target) {
            "reached"
        } else {
            "not reached"
        };
        let bound = match status.accuracy.unknown {
            Some(unknown) => format!("error {}", unknown.text()),
            None => format!(
                "error below {:.2} % with 95 % confidence",
                100.0 * status.accuracy.error_95
            ),
        };
        say(
            args,
            &format!("target of {} % {is}: {bound}", 100.0 * target),
        );
    }
    if args.timings || args.settings.ledger {
        say_guide(args, renderer.lesson());
    }
    if args.timings {
        say(
            args,
            &format!("features: {}", super::used_and_left_out(scene)),
        );
        say(
            args,
            &format!("{:42} {:>15} {:>8}", "pass", "ms/iteration", "share"),
        );
    }
    let total = timings.iter().map(|(_, ms)| ms).sum::<f64>().max(1e-9);
    for (pass, ms) in &timings {
        let share = 100.0 * ms / total;
        let ms = ms / status.iterations_now.max(1) as f64;
        say(args, &format!("{pass:42} {ms:15.3} {share:6.1} %"));
    }
    for (name, count) in &ledger {
        say(args, &format!("{name:42} {count:15}"));
    }
    if args.json {
        let mut end = status.json(if interrupted { "interrupted" } else { "done" });
        // Through display: a path that is not UTF-8 has no JSON.
        let outputs = args.outputs.iter().map(|o| o.display().to_string());
        end["outputs"] = outputs.collect();
        if args.timings {
            let pairs = timings
                .into_iter()
                .map(|(pass, ms)| (pass.to_string(), json!(ms)));
            end["timings_ms"] = Value::Object(Map::from_iter(pairs));
        }
        if !ledger.is_empty() {
            let pairs = ledger
                .into_iter()
                .map(|(name, n)| (name.to_string(), json!(n)));
            end["ledger"] = Value::Object(Map::from_iter(pairs));
        }
        print_json(&end);
    }
}

/// Lights that are listed at most.
const MOST_LIGHTS: usize = 16;

/// What the pilot found of where light paths should begin, and what it made of that.
fn say_guide(args: &RenderArgs, lesson: &Lesson) {
    let percent = |share: f32| format!("{:.3} %", 100.0 * share);
    if lesson.cells == 0 {
        let before = percent(lesson.useful[0]);
        let line = format!("guide off: {before} of light paths leave a photon where the eye looks");
        return say(args, &line);
    }
    let on = if lesson.on { "on" } else { "off" };
    let gain = match lesson.gain {
        gain if gain > 1000.0 => "more than 1000".into(),
        gain => format!("{gain:.2}"),
    };
    say(
        args,
        &format!(
            "guide {on}: it lowers the variance {gain} times and takes {:.2} times as long a path; \
             {} cells, {:.1} kB, learned in {:.2} s",
            lesson.cost,
            lesson.cells,
            lesson.bytes as f64 * 1e-3,
            lesson.seconds.as_secs_f64()
        ),
    );
    let row = |name: &str, without: &str, with: &str| {
        say(args, &format!("{name:42} {without:>15} {with:>8}"));
    };
    row(
        "paths that leave a photon where it matters",
        "without",
        "with",
    );
    let mut lights: Vec<_> = lesson.lights.iter().collect();
    lights.sort_by(|(_, a), (_, b)| b[1].total_cmp(&a[1]));
    let all = ("all lights".to_string(), lesson.useful);
    for (name, shares) in std::iter::once(&all).chain(lights.into_iter().take(MOST_LIGHTS)) {
        let [without, with] = shares.map(percent);
        row(&format!("  {name}"), &without, &with);
    }
    if let more @ 1.. = lesson.lights.len().saturating_sub(MOST_LIGHTS) {
        say(args, &format!("  and {more} lights more"));
    }
}

fn say(args: &RenderArgs, line: &str) {
    if !args.quiet {
        complain(line);
    }
}

/// A line on stderr; where that is closed, nobody listens.
fn complain(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}
