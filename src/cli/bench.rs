//! `lightfall bench`.

use super::{BenchArgs, Outcome, interrupt};
use crate::{
    Error, Result,
    bench::{
        self, Results, Session, data,
        plan::{Budget, Plan, settings, variants},
        report, trade,
    },
    gpu::{Gpu, OpenOptions},
    settings::AUTO,
    technique::TECHNIQUES,
};
use std::{
    env, fs,
    io::Write,
    path::{Path, PathBuf},
    time::Instant,
};

/// Measures and writes the report.
pub fn run(args: &BenchArgs) -> Result<Outcome> {
    let plan = plan(args)?;
    // What can fail fast fails before anything slow.
    fs::create_dir_all(&args.output).map_err(|e| Error::io(&args.output, e))?;
    for scene in &plan.scenes {
        fs::metadata(scene).map_err(|e| Error::io(scene, e))?;
    }
    let gpu = Gpu::open(&OpenOptions {
        device: args.device.as_deref(),
        validate: false,
    })?;
    let start = Instant::now();
    let say = |line: &str| {
        if !args.quiet {
            let _ = writeln!(
                std::io::stderr(),
                "{:6.0} s  {line}",
                start.elapsed().as_secs_f64()
            );
        }
    };
    if let Some(minutes) = estimate(&plan) {
        say(&format!(
            "this will take about {minutes:.0} min, more where references have to be rendered"
        ));
    }
    interrupt::watch(args.quiet)?;
    let mut results = {
        let session = Session {
            gpu: &gpu,
            stop: &interrupt::requested,
            say: &say,
        };
        bench::run(plan, &session)
    };
    write(&args.output, &results)?;
    say(&format!(
        "wrote {}",
        args.output.join("report.html").display()
    ));
    if !results.failures.is_empty() {
        return Err(results.failures.remove(0));
    }
    Ok(match results.interrupted {
        true => Outcome::Interrupted,
        false => Outcome::Done,
    })
}

fn plan(args: &BenchArgs) -> Result<Plan> {
    let common = args
        .set
        .split(',')
        .map(str::trim)
        .filter(|word| !word.is_empty());
    let list = match (&args.techniques, args.trade) {
        (Some(list), _) => list,
        (None, true) => AUTO,
        (None, false) => "all",
    };
    let mut variants = variants(list, &args.set)?;
    // On the first that gathers photons at all.
    let gathers =
        |name: &str| name == AUTO || TECHNIQUES.iter().any(|t| t.name == name && t.photons);
    let first = variants
        .iter()
        .map(|v| &v.settings.technique)
        .find(|t| gathers(t));
    let ablation = match first {
        Some(technique) if !(args.skip_ablation || args.trade) => {
            Some(settings(technique, common)?)
        }
        _ => None,
    };
    if args.trade {
        let points = variants.first().map_or_else(Vec::new, trade::around);
        variants.splice(1..1, points);
    }
    Ok(Plan {
        scenes: args.scenes.clone(),
        load: args.load.options(),
        environment: args.environment.load()?,
        variants,
        budget: args.budget,
        seeds: args.seeds,
        reference: (args.reference != Path::new("auto")).then(|| args.reference.clone()),
        reference_budget: args.reference_budget.unwrap_or(args.budget.times(10.0)),
        cache: args
            .cache
            .clone()
            .unwrap_or_else(|| cache_folder(&args.output)),
        size: args.size,
        ablation,
        trade: args.trade,
    })
}

/// The platform's, or beside the report where there is none.
fn cache_folder(output: &Path) -> PathBuf {
    let folder = |name: &str| {
        env::var_os(name)
            .filter(|v| !v.is_empty())
            .map(PathBuf::from)
    };
    let found = folder("XDG_CACHE_HOME")
        .or_else(|| folder("LOCALAPPDATA"))
        .or_else(|| folder("HOME").map(|home| home.join(".cache")));
    found.map_or_else(
        || output.join("references"),
        |f| f.join("lightfall/references"),
    )
}

/// Minutes, if the plan says.
fn estimate(plan: &Plan) -> Option<f64> {
    let Budget::Seconds(seconds) = plan.budget else {
        return None;
    };
    let runs = plan.variants.len() as f64 * plan.seeds as f64;
    let ablation = if plan.ablation.is_some() { 2.0 } else { 0.0 };
    Some(plan.scenes.len() as f64 * seconds * (runs + ablation) / 60.0)
}

fn write(folder: &Path, results: &Results) -> Result<()> {
    let files = [
        ("results.json", format!("{:#}\n", data::json(results))),
        ("results.csv", data::csv(results)),
        ("report.html", report::html(results)?),
    ];
    for (name, text) in files {
        let path = folder.join(name);
        fs::write(&path, text).map_err(|e| Error::io(&path, e))?;
    }
    Ok(())
}
