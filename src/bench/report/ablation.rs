//! Culling, evaluation, radii and stored photons in the report: tables 3 and 4 and figure 10 of Kern, Brüll & Grosch 2023.

use super::plot::{Axis, Line, Plot};
use super::scene::write_iteration_times;
use super::{coverage, escape, interval, number};
use crate::bench::Results;
use crate::bench::ablation::{Ablation, FACTORS, GUIDES, SweepPoint};
use crate::bench::data::windows;
use crate::bench::race::{Photons, Track};
use crate::bench::statistics::{median, median_of, ratio_of_medians};
use std::fmt::Write;

pub fn section(page: &mut String, ablations: &[Ablation], results: &Results) {
    let technique = results
        .plan
        .ablation
        .as_ref()
        .map_or("", |s| s.technique.as_str());
    let _ = writeln!(
        page,
        "<h3>Culling and stochastic evaluation ({})</h3>",
        escape(technique)
    );
    combinations(page, ablations, results.plan.seeds);
    stored(page, ablations);
    *page += "<div class=\"plots\">\n";
    over_iterations(page, ablations);
    over_radius(
        page,
        ablations,
        "Time over the radius",
        "ms per iteration",
        &|t| 1e3 * median(t.seconds.iter().copied()),
    );
    over_radius(
        page,
        ablations,
        "Error over the radius",
        "relMSE",
        &last_error,
    );
    *page += "</div>\n";
    guiding(page, ablations);
}

/// Where light paths begin: what that is worth, and what learning it takes.
fn guiding(page: &mut String, ablations: &[Ablation]) {
    *page += "<h3>Guiding</h3>\n<div class=\"wide\"><table>\n<tr><th></th><th>useful light paths</th><th>cells</th>\
              <th>learned in s</th><th>ms per iteration</th><th>iterations</th><th>relMSE at the end</th></tr>\n";
    for (v, (label, _)) in GUIDES.iter().enumerate() {
        let tracks: Vec<&Track> = ablations.iter().filter_map(|a| a.guiding.get(v)).collect();
        let of = |f: &dyn Fn(&Track) -> f64| median(tracks.iter().map(|t| f(t)));
        let errors: Vec<f64> = tracks.iter().map(|t| last_error(t)).collect();
        let error = median_of(&errors);
        let _ = writeln!(
            page,
            "<tr><td>{label}</td><td>{} %</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}<small>{}</small></td></tr>",
            number(of(&|t| 100.0 * f64::from(t.guided.useful))),
            of(&|t| t.guided.cells as f64),
            number(of(&|t| t.guided.seconds)),
            number(of(&|t| 1e3 * median(t.seconds.iter().copied()))),
            of(&|t| t.iterations() as f64),
            number(error.value),
            interval(&error),
        );
    }
    *page += "</table></div>\n<p>After equal time, learning not counted; medians over seeds. A light path is useful that leaves a photon \
              where a view sample gathers.</p>\n<div class=\"plots\">\n";
    let lines = GUIDES.iter().enumerate().map(|(v, (label, _))| {
        let track = ablations.first().and_then(|a| a.guiding.get(v));
        let checkpoints = track.iter().flat_map(|t| &t.checkpoints);
        Line {
            label: label.to_string(),
            index: v,
            points: checkpoints.map(|c| [c.seconds, c.errors[0]]).collect(),
            band: Vec::new(),
        }
    });
    let plot = Plot {
        x: Axis {
            label: "s".into(),
            logarithmic: true,
        },
        y: Axis {
            label: "relMSE".into(),
            logarithmic: true,
        },
        lines: lines.collect(),
        level: None,
    };
    let _ = writeln!(
        page,
        "<div><h3>Error over time, guided or not</h3>\n{}</div>\n</div>",
        plot.svg()
    );
}

fn last_error(track: &Track) -> f64 {
    track.checkpoints.last().map_or(f64::NAN, |c| c.errors[0])
}

/// A combination's tracks, seed by seed.
fn tracks(ablations: &[Ablation], variant: usize) -> impl Iterator<Item = &Track> {
    ablations.iter().filter_map(move |a| a.tracks.get(variant))
}

fn combinations(page: &mut String, ablations: &[Ablation], seeds: u64) {
    *page += "<div class=\"wide\"><table>\n<tr><th></th><th>ms per iteration</th><th>speedup</th><th>iterations</th><th>relMSE at the end</th></tr>\n";
    let times = |v| -> Vec<f64> {
        tracks(ablations, v)
            .flat_map(|t| t.seconds.clone())
            .collect()
    };
    let neither = times(0);
    let variants = ablations.first().map_or(&[][..], |a| &a.variants);
    for (v, variant) in variants.iter().enumerate() {
        let label = escape(&variant.label);
        if let Some(fault) = tracks(ablations, v).find_map(|t| t.failure.as_ref()) {
            let _ = writeln!(
                page,
                "<tr><td>{label}</td><td colspan=\"4\">{}</td></tr>",
                escape(fault)
            );
            continue;
        }
        let seconds = times(v);
        let speedup = ratio_of_medians(&neither, &seconds);
        let errors: Vec<f64> = tracks(ablations, v).map(last_error).collect();
        let error = median_of(&errors);
        let _ = writeln!(
            page,
            "<tr><td>{label}</td><td>{}</td><td>{}<small>{}</small></td><td>{}</td><td>{}<small>{}</small></td></tr>",
            number(1e3 * median(seconds.iter().copied())),
            number(speedup.value),
            interval(&speedup),
            seconds.len(),
            number(error.value),
            interval(&error),
        );
    }
    let _ = writeln!(
        page,
        "</table></div>\n<p>Iteration by iteration side by side, all seeds together: speedups have intervals over runs of iterations, errors over \
         seeds. {} Stochastic evaluation keeps a few of the photons found, so it buys time with noise: compare both columns.</p>",
        coverage(seeds)
    );
}

fn stored(page: &mut String, ablations: &[Ablation]) {
    *page += "<h3>Photons of an iteration</h3>\n<div class=\"wide\"><table>\n<tr><th></th><th>emitted</th><th>stored, caustic</th><th>stored, global</th></tr>\n";
    for (label, v) in [("without culling", 0), ("with culling", 1)] {
        let iterations: u64 = tracks(ablations, v).map(Track::iterations).sum();
        let mean = |count: fn(&Photons) -> u64| {
            let sum: u64 = tracks(ablations, v).map(|t| count(&t.photons)).sum();
            number(sum as f64 / iterations.max(1) as f64)
        };
        let _ = writeln!(
            page,
            "<tr><td>{label}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            mean(|p| p.emitted),
            mean(|p| p.stored_caustic),
            mean(|p| p.stored_global)
        );
    }
    *page += "</table></div>\n";
}

/// Of the first seed.
fn over_iterations(page: &mut String, ablations: &[Ablation]) {
    let first = ablations.iter().take(1);
    let pairs = first.flat_map(|a| a.variants.iter().zip(&a.tracks));
    let lines = pairs.enumerate().map(|(index, (variant, track))| Line {
        label: variant.label.clone(),
        index,
        points: windows(&track.seconds).map(|(i, s)| [i, 1e3 * s]).collect(),
        band: Vec::new(),
    });
    write_iteration_times(page, lines.collect());
}

/// Medians over the seeds.
fn over_radius(
    page: &mut String,
    ablations: &[Ablation],
    title: &str,
    what: &str,
    of: &dyn Fn(&Track) -> f64,
) {
    type Side = fn(&SweepPoint) -> &Track;
    let sides: [(&str, Side); 2] = [
        ("full evaluation", |p| &p.full),
        ("stochastic evaluation", |p| &p.stochastic),
    ];
    let point = |i: usize, side: Side| {
        let tracks = || ablations.iter().filter_map(|a| a.sweep.get(i)).map(side);
        [
            median(tracks().map(|t| f64::from(t.radii.global))),
            median(tracks().map(of)),
        ]
    };
    let lines = sides.into_iter().enumerate();
    let lines = lines.map(|(index, (label, side))| Line {
        label: label.into(),
        index,
        points: (0..FACTORS.len()).map(|i| point(i, side)).collect(),
        band: Vec::new(),
    });
    let plot = Plot {
        x: Axis {
            label: "radius of the global map (m), constant".into(),
            logarithmic: true,
        },
        y: Axis {
            label: what.into(),
            logarithmic: true,
        },
        lines: lines.collect(),
        level: None,
    };
    let _ = writeln!(page, "<div><h3>{title}</h3>\n{}</div>", plot.svg());
}
