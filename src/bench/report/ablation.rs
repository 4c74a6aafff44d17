//! Culling, evaluation, radii and stored photons in the report: tables 3 and 4 and figure 10 of Kern, Brüll & Grosch 2023.

use super::plot::{Axis, Line, Plot};
use super::scene::write_iteration_times;
use super::{escape, interval, number};
use crate::bench::Results;
use crate::bench::ablation::Ablation;
use crate::bench::data::windows;
use crate::bench::race::Track;
use crate::bench::statistics::{median, ratio_of_medians};
use std::fmt::Write;

pub fn section(page: &mut String, ablation: &Ablation, results: &Results) {
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
    combinations(page, ablation);
    stored(page, ablation);
    *page += "<div class=\"plots\">\n";
    over_iterations(page, ablation);
    over_radius(
        page,
        ablation,
        "Time over the radius",
        "ms per iteration",
        &|t| 1e3 * median(t.seconds.iter().copied()),
    );
    over_radius(page, ablation, "Error over the radius", "relMSE", &|t| {
        t.checkpoints.last().map_or(f64::NAN, |c| c.errors[0])
    });
    *page += "</div>\n";
}

fn combinations(page: &mut String, ablation: &Ablation) {
    *page += "<div class=\"wide\"><table>\n<tr><th></th><th>ms per iteration</th><th>speedup</th><th>iterations</th><th>relMSE at the end</th></tr>\n";
    let neither = ablation.tracks.first().map_or(&[][..], |t| &t.seconds);
    for (variant, track) in ablation.variants.iter().zip(&ablation.tracks) {
        let label = escape(&variant.label);
        if let Some(fault) = &track.failure {
            let _ = writeln!(
                page,
                "<tr><td>{label}</td><td colspan=\"4\">{}</td></tr>",
                escape(fault)
            );
            continue;
        }
        let speedup = ratio_of_medians(neither, &track.seconds);
        let _ = writeln!(
            page,
            "<tr><td>{label}</td><td>{}</td><td>{}<small>{}</small></td><td>{}</td><td>{}</td></tr>",
            number(1e3 * median(track.seconds.iter().copied())),
            number(speedup.value),
            interval(&speedup),
            track.iterations(),
            number(track.checkpoints.last().map_or(f64::NAN, |c| c.errors[0])),
        );
    }
    *page += "</table></div>\n<p>One seed, iteration by iteration side by side; intervals over runs of iterations. Stochastic evaluation keeps \
              a few of the photons found, so it buys time with noise: compare both columns.</p>\n";
}

fn stored(page: &mut String, ablation: &Ablation) {
    let (Some(without), Some(with)) = (ablation.tracks.first(), ablation.tracks.get(1)) else {
        return;
    };
    let mean = |track: &Track, count: u64| number(count as f64 / track.iterations().max(1) as f64);
    *page += "<h3>Photons of an iteration</h3>\n<div class=\"wide\"><table>\n<tr><th></th><th>emitted</th><th>stored, caustic</th><th>stored, global</th></tr>\n";
    for (label, track) in [("without culling", without), ("with culling", with)] {
        let photons = track.photons;
        let _ = writeln!(
            page,
            "<tr><td>{label}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            mean(track, photons.emitted),
            mean(track, photons.stored_caustic),
            mean(track, photons.stored_global)
        );
    }
    *page += "</table></div>\n";
}

fn over_iterations(page: &mut String, ablation: &Ablation) {
    let pairs = ablation.variants.iter().zip(&ablation.tracks).enumerate();
    let lines = pairs.map(|(index, (variant, track))| Line {
        label: variant.label.clone(),
        index,
        points: windows(&track.seconds).map(|(i, s)| [i, 1e3 * s]).collect(),
        band: Vec::new(),
    });
    write_iteration_times(page, lines.collect());
}

fn over_radius(
    page: &mut String,
    ablation: &Ablation,
    title: &str,
    what: &str,
    of: &dyn Fn(&Track) -> f64,
) {
    type Side = fn(&crate::bench::ablation::SweepPoint) -> &Track;
    let sides: [(&str, Side); 2] = [
        ("full evaluation", |p| &p.full),
        ("stochastic evaluation", |p| &p.stochastic),
    ];
    let lines = sides
        .into_iter()
        .enumerate()
        .map(|(index, (label, side))| Line {
            label: label.into(),
            index,
            points: ablation
                .sweep
                .iter()
                .map(|p| [f64::from(side(p).radii.global), of(side(p))])
                .collect(),
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
