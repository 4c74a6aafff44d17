//! Results for machines: JSON with everything but the pictures, CSV with every checkpoint.

use super::ablation::{Ablation, GUIDES};
use super::race::{METRICS, Track};
use super::standing::{Equal, Standing, decay, standings};
use super::statistics::{Estimate, median};
use super::trade::{METRIC, Place, SHARES, Trade, overall};
use super::{Results, SceneResults};
use crate::metrics::Metric;
use serde_json::{Map, Value, json};

/// Everything; numbers that are not known are null.
pub fn json(results: &Results) -> Value {
    let plan = &results.plan;
    let about = results
        .about
        .pairs()
        .map(|(name, value)| (name.to_string(), json!(value)));
    let variants = plan.variants.iter().map(|v| json!(v.label));
    json!({
        "about": Map::from_iter(about),
        "budget": plan.budget.text(),
        "seeds": plan.seeds,
        "techniques": variants.collect::<Vec<_>>(),
        "interrupted": results.interrupted,
        "failures": results.failures.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "trade": plan.trade.then(|| over_scenes(results)),
        "scenes": results.scenes.iter().map(|s| scene(s, plan.variants.len())).collect::<Vec<_>>(),
    })
}

/// What each setting does over all scenes.
fn over_scenes(results: &Results) -> Value {
    let scenes: Vec<&Trade> = results
        .scenes
        .iter()
        .filter_map(|s| s.trade.as_ref())
        .collect();
    let rows = overall(&scenes, results.plan.variants.len());
    let points = rows.iter().enumerate().map(|(v, row)| {
        json!({
            "technique": v,
            "error_over_first": row.ratios.map(estimate),
            "scenes_where_least": row.least,
            "scenes_where_tied": row.tied,
        })
    });
    json!({
        "compared": METRIC.name(),
        "at_shares_of_the_time": SHARES,
        "scenes": scenes.len(),
        "points": points.collect::<Vec<_>>(),
    })
}

fn trade(trade: &Trade) -> Value {
    let points = trade.points.iter().enumerate().map(|(v, point)| {
        json!({
            "technique": v,
            "error_over_first": point.ratios.map(estimate),
            "places": point.places.map(Place::name),
            "on_front": point.on_front,
        })
    });
    json!({"at_seconds": trade.times, "points": points.collect::<Vec<_>>()})
}

fn scene(scene: &SceneResults, variants: usize) -> Value {
    let hash: String = scene
        .scene_hash
        .iter()
        .map(|b| format!("{b:02x}"))
        .collect();
    let summary = (0..variants).map(|v| {
        let split = scene.splits.get(v).copied().flatten();
        json!({
            "technique": v,
            "bias2": split.map(|s| s.bias2),
            "variance": split.map(|s| s.variance),
            "decay": decay(&scene.tracks, v).map(estimate),
        })
    });
    json!({
        "scene": scene.name,
        "hash": hash,
        "triangles": scene.triangles,
        "warnings": scene.warnings,
        "size": scene.size,
        "reference": {"origin": scene.reference.origin, "relmse_of_its_noise": scene.reference.own_error},
        "standings": standings(&scene.tracks, variants).iter().map(standing).collect::<Vec<_>>(),
        "summary": summary.collect::<Vec<_>>(),
        "runs": scene.tracks.iter().map(track).collect::<Vec<_>>(),
        "ablations": scene.ablations.iter().map(ablation).collect::<Vec<_>>(),
        "trade": scene.trade.as_ref().map(trade),
    })
}

fn standing(standing: &Standing) -> Value {
    let (equal, at) = match standing.equal {
        Equal::Time(s) => ("seconds", s),
        Equal::Iterations(n) => ("iterations", n),
        Equal::Error(e) => ("relmse", e),
    };
    let compared = match standing.equal {
        Equal::Error(_) => "seconds".into(),
        _ if standing.metric == Metric::Ssim => "1 - ssim".into(),
        _ => standing.metric.name(),
    };
    let rows = standing.rows.iter().map(|row| {
        json!({"technique": row.variant, "of_each_seed": row.values, "median": estimate(row.estimate)})
    });
    let verdict = standing.verdict().map(|v| {
        let others = v
            .others
            .iter()
            .map(|(o, ratio)| json!({"technique": o, "times": estimate(*ratio)}));
        json!({"best": v.best, "others": others.collect::<Vec<_>>()})
    });
    json!({
        "equal": equal,
        "at": at,
        "compared": compared,
        "techniques": rows.collect::<Vec<_>>(),
        "verdict": verdict,
    })
}

fn estimate(estimate: Estimate) -> Value {
    json!({"value": estimate.value, "interval95": estimate.interval})
}

fn track(track: &Track) -> Value {
    let passes = track
        .passes
        .iter()
        .map(|(name, ms)| (name.to_string(), json!(median(ms.iter().copied()))));
    let checkpoints = track.checkpoints.iter().map(|c| {
        let mut object = json!({"iterations": c.iterations, "seconds": c.seconds});
        for (name, value) in named(&c.errors) {
            object[name] = json!(value);
        }
        object
    });
    let times = windows(&track.seconds).map(|(iteration, s)| json!([iteration, s * 1e3]));
    json!({
        "technique": track.variant,
        "seed": track.seed,
        "failure": track.failure,
        "iterations": track.iterations(),
        "seconds": track.total_seconds(),
        "flip": track.flip,
        "first_radius_m": {"caustic": track.radii.caustic, "global": track.radii.global},
        "photons": {
            "emitted": track.photons.emitted,
            "stored_caustic": track.photons.stored_caustic,
            "stored_global": track.photons.stored_global,
        },
        "checkpoints": checkpoints.collect::<Vec<_>>(),
        "pass_ms_median": Map::from_iter(passes),
        "iteration_ms": times.collect::<Vec<_>>(),
    })
}

/// Metrics by name; SSIM as everybody knows it.
fn named(errors: &[f64; METRICS.len()]) -> impl Iterator<Item = (String, f64)> {
    METRICS
        .iter()
        .zip(errors)
        .map(|(metric, value)| match metric {
            Metric::Ssim => (metric.name(), 1.0 - value),
            _ => (metric.name(), *value),
        })
}

/// Medians over log-spaced ranges of iterations, at most about a hundred: the middle of each (from 1) and its median.
pub fn windows(series: &[f64]) -> impl Iterator<Item = (f64, f64)> {
    let mut start = 0;
    std::iter::from_fn(move || {
        let end = (start + 1 + start / 12).min(series.len());
        let window = series.get(start..end).filter(|w| !w.is_empty())?;
        let middle = 0.5 * (start + 1 + end) as f64;
        start = end;
        Some((middle, median(window.iter().copied())))
    })
}

fn ablation(ablation: &Ablation) -> Value {
    let combinations = ablation.variants.iter().zip(&ablation.tracks);
    let combinations =
        combinations.map(|(variant, t)| json!({"with": variant.label, "run": track(t)}));
    let sweep = ablation.sweep.iter().map(|point| {
        json!({"factor": point.factor, "full": track(&point.full), "stochastic": track(&point.stochastic)})
    });
    let guiding = GUIDES.iter().zip(&ablation.guiding).map(|((label, _), t)| {
        let guided = t.guided;
        json!({
            "with": label, "run": track(t), "on": guided.on, "useful_share": guided.useful,
            "cells": guided.cells, "learning_seconds": guided.seconds,
        })
    });
    json!({
        "combinations": combinations.collect::<Vec<_>>(),
        "radii": sweep.collect::<Vec<_>>(),
        "guiding": guiding.collect::<Vec<_>>(),
    })
}

/// A row for each checkpoint.
pub fn csv(results: &Results) -> String {
    let names = METRICS.map(Metric::name).join(",");
    let mut text = format!("scene,technique,seed,iterations,seconds,{names}\n");
    for scene in &results.scenes {
        for track in &scene.tracks {
            let Some(variant) = results.plan.variants.get(track.variant) else {
                continue;
            };
            for c in &track.checkpoints {
                let head = [&scene.name, &variant.label]
                    .map(|word| format!("\"{}\"", word.replace('"', "\"\"")));
                let errors: Vec<String> = named(&c.errors)
                    .map(|(_, value)| value.to_string())
                    .collect();
                let (head, errors) = (head.join(","), errors.join(","));
                text += &format!(
                    "{head},{},{},{},{errors}\n",
                    track.seed, c.iterations, c.seconds
                );
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::windows;

    #[test]
    fn windows_hold_every_iteration_once() {
        let series: Vec<f64> = (1..=10_000).map(f64::from).collect();
        let found: Vec<(f64, f64)> = windows(&series).collect();
        assert!(found.len() < 120, "{}", found.len());
        assert_eq!(found[..3], [(1.0, 1.0), (2.0, 2.0), (3.0, 3.0)]);
        // Of consecutive numbers the median is the middle.
        assert!(found.iter().all(|(middle, median)| middle == median));
        assert_eq!(windows(&[]).count(), 0);
    }
}
