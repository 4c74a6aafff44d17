//! A scene's part of the report.

use super::bars::bars;
use super::plot::{Axis, Line, Plot};
use super::{ablation, escape, interval, number, pictures, sentence};
use crate::Result;
use crate::bench::data::windows;
use crate::bench::race::{METRICS, Track};
use crate::bench::standing::{self, Equal, Standing, decay, of, standings};
use crate::bench::statistics::{Estimate, median, median_of};
use crate::bench::{Results, SceneResults};
use crate::metrics::Metric;
use std::fmt::Write;

/// Errors below so many times the reference's own say little.
const CLEAR: f64 = 4.0;

pub fn section(
    page: &mut String,
    results: &Results,
    scene: &SceneResults,
    labels: &[&str],
) -> Result<()> {
    head(page, scene, labels);
    let standings = standings(&scene.tracks, labels.len());
    if standings.is_empty() {
        *page += "<p>Nothing was measured.</p>\n";
        return Ok(());
    }
    *page += "<div class=\"verdict\">\n";
    for standing in &standings {
        let _ = writeln!(page, "<p>{}</p>", sentence(standing, labels));
    }
    *page += "</div>\n";
    let least = standings[0]
        .rows
        .iter()
        .map(|r| r.estimate.value)
        .fold(f64::INFINITY, f64::min);
    if scene
        .reference
        .own_error
        .is_some_and(|own| least < CLEAR * own)
    {
        *page += "<p><strong>The least relMSE is near the noise of the reference, which is part of every number here and blurs their \
                  differences: a longer --reference-budget would tell more.</strong></p>\n";
    }
    numbers(page, scene, labels);
    pictures::section(page, scene, labels)?;
    *page += "<div class=\"plots\">\n";
    let level = scene.reference.own_error.filter(|e| *e > 0.0);
    over_time(
        page,
        scene,
        labels,
        "Error over time",
        Metric::RelMse,
        level,
    );
    over_time(
        page,
        scene,
        labels,
        "Dissimilarity over time",
        Metric::Ssim,
        None,
    );
    iteration_times(page, scene, labels);
    passes(page, scene, labels);
    *page += "</div>\n";
    if !scene.ablations.is_empty() {
        ablation::section(page, &scene.ablations, results);
    }
    Ok(())
}

/// What was measured, and against what.
pub fn head(page: &mut String, scene: &SceneResults, labels: &[&str]) {
    let [width, height] = scene.size;
    let own = scene
        .reference
        .own_error
        .map_or("its own error is not known".into(), |e| {
            format!(
                "noise leaves a relMSE of {} in it (bias, if any, is not in that number)",
                number(e)
            )
        });
    let _ = writeln!(
        page,
        "<h2 class=\"scene\">{}</h2>\n<p>{} triangles, {width} × {height} pixels. Reference: {}; {own}.</p>",
        escape(&scene.name),
        scene.triangles,
        escape(&scene.reference.origin)
    );
    for warning in &scene.warnings {
        let _ = writeln!(page, "<p>Warning: {}</p>", escape(warning));
    }
    for track in scene.tracks.iter().filter(|t| t.failure.is_some()) {
        let fault = track.failure.as_deref().unwrap_or_default();
        let label = labels.get(track.variant).unwrap_or(&"?");
        let _ = writeln!(
            page,
            "<p><strong>{} failed: {}</strong></p>",
            escape(label),
            escape(fault)
        );
    }
}

fn numbers(page: &mut String, scene: &SceneResults, labels: &[&str]) {
    let standings = standings(&scene.tracks, labels.len());
    let mut rows: Vec<(String, Vec<Option<Estimate>>)> = Vec::new();
    for standing in &standings {
        let head = match (standing.equal, standing.metric) {
            (Equal::Time(s), Metric::Ssim) => format!("1 − SSIM at {} s", number(s)),
            (Equal::Time(s), _) => format!("relMSE at {} s", number(s)),
            (Equal::Iterations(n), _) => format!("relMSE at {n} iterations"),
            (Equal::Error(e), _) => format!("s to relMSE {}", number(e)),
        };
        let estimate = |v| {
            standing
                .rows
                .iter()
                .find(|r| r.variant == v)
                .map(|r| r.estimate)
        };
        rows.push((head, (0..labels.len()).map(estimate).collect()));
    }
    let mut row = |head: &str, of_track: &dyn Fn(&Track) -> f64| {
        let estimate = |v| {
            let values: Vec<f64> = of(&scene.tracks, v).map(of_track).collect();
            (!values.is_empty()).then(|| median_of(&values))
        };
        rows.push((head.into(), (0..labels.len()).map(estimate).collect()));
    };
    let last = |t: &Track, metric: Metric| {
        let index = METRICS.iter().position(|m| *m == metric).unwrap_or(0);
        t.checkpoints.last().map_or(f64::NAN, |c| c.errors[index])
    };
    row("relMSE trimmed, at the end", &|t| {
        last(t, Metric::RelMseTrimmed)
    });
    row("FLIP at the end", &|t| t.flip);
    row("ms per iteration", &|t| {
        1e3 * median(t.seconds.iter().copied())
    });
    row("photons stored per iteration", &|t| {
        let stored = t.photons.stored_caustic + t.photons.stored_global;
        stored as f64 / t.iterations().max(1) as f64
    });
    row("iterations", &|t| t.iterations() as f64);
    let split = |v: usize| scene.splits.get(v).copied().flatten();
    let fixed = |value: Option<f64>| {
        value.map(|value| Estimate {
            value,
            interval: None,
        })
    };
    rows.push((
        "bias² at the end".into(),
        (0..labels.len())
            .map(|v| fixed(split(v).map(|s| s.bias2)))
            .collect(),
    ));
    rows.push((
        "variance at the end".into(),
        (0..labels.len())
            .map(|v| fixed(split(v).map(|s| s.variance)))
            .collect(),
    ));
    rows.push((
        "decay power".into(),
        (0..labels.len()).map(|v| decay(&scene.tracks, v)).collect(),
    ));

    *page += "<div class=\"wide\"><table>\n<tr><th></th>";
    for label in labels {
        // May be broken before the settings.
        let _ = write!(
            page,
            "<th>{}</th>",
            escape(label).replace(':', ":<wbr>").replace(',', ",<wbr>")
        );
    }
    *page += "</tr>\n";
    for (i, (head, estimates)) in rows.iter().enumerate() {
        // Only the standings, which come first, say who is best.
        let winner = standings.get(i).and_then(Standing::winner);
        let _ = write!(page, "<tr><td>{head}</td>");
        for (v, estimate) in estimates.iter().enumerate() {
            let class = if winner == Some(v) {
                " class=\"best\""
            } else {
                ""
            };
            let (value, interval) = match estimate {
                Some(estimate) => (number(estimate.value), interval(estimate)),
                None => ("–".into(), String::new()),
            };
            let _ = write!(page, "<td{class}>{value}<small>{interval}</small></td>");
        }
        *page += "</tr>\n";
    }
    *page += "</table></div>\n<p>Green: better than every other with its whole interval. A time to an error that was reached before the first \
              measurement is that measurement's. Bias² and variance are the relMSE's parts, told apart by \
              the seeds; bias² contains the reference's own error and comes out below 0 where noise hides it. The decay power is the slope of log relMSE over log time \
              in the last decade: −2/3 where a photon map's bias and variance balance, −1 for a path tracer, towards 0 at \
              the reference's own error.</p>\n";
}

fn over_time(
    page: &mut String,
    scene: &SceneResults,
    labels: &[&str],
    title: &str,
    metric: Metric,
    level: Option<f64>,
) {
    let lines = labels.iter().enumerate().map(|(v, label)| {
        let (mut points, mut band) = (Vec::new(), Vec::new());
        for (time, error) in standing::over_time(&scene.tracks, v, metric) {
            points.push([time, error.value]);
            if let Some([low, high]) = error.interval {
                band.push([time, low, high]);
            }
        }
        Line {
            label: (*label).into(),
            index: v,
            points,
            band,
        }
    });
    let what = if metric == Metric::Ssim {
        "1 − SSIM"
    } else {
        "relMSE"
    };
    let plot = Plot {
        x: Axis {
            label: "time (s)".into(),
            logarithmic: true,
        },
        y: Axis {
            label: what.into(),
            logarithmic: true,
        },
        lines: lines.collect(),
        level: level.map(|e| (e, "noise of the reference".into())),
    };
    let _ = writeln!(page, "<div><h3>{title}</h3>\n{}</div>", plot.svg());
}

fn iteration_times(page: &mut String, scene: &SceneResults, labels: &[&str]) {
    let lines = labels.iter().enumerate().map(|(v, label)| {
        // Medians over the seeds first, then over neighbouring iterations.
        let tracks: Vec<&Track> = of(&scene.tracks, v).collect();
        let count = tracks.iter().map(|t| t.seconds.len()).min().unwrap_or(0);
        let series: Vec<f64> = (0..count)
            .map(|i| 1e3 * median(tracks.iter().map(|t| t.seconds[i])))
            .collect();
        let points = windows(&series).map(|(i, ms)| [i, ms]).collect();
        Line {
            label: (*label).into(),
            index: v,
            points,
            band: Vec::new(),
        }
    });
    write_iteration_times(page, lines.collect());
}

/// Milliseconds over iterations (Kern et al. 2023, figure 6a).
pub(super) fn write_iteration_times(page: &mut String, lines: Vec<Line>) {
    let plot = Plot {
        x: Axis {
            label: "iteration".into(),
            logarithmic: true,
        },
        y: Axis {
            label: "ms per iteration".into(),
            logarithmic: false,
        },
        lines,
        level: None,
    };
    let _ = writeln!(
        page,
        "<div><h3>Time of an iteration</h3>\n{}</div>",
        plot.svg()
    );
}

fn passes(page: &mut String, scene: &SceneResults, labels: &[&str]) {
    let mut rows = Vec::new();
    for (v, label) in labels.iter().enumerate() {
        let tracks: Vec<&Track> = of(&scene.tracks, v).collect();
        let Some(first) = tracks.first() else {
            continue;
        };
        let parts = first.passes.iter().map(|(name, _)| {
            let of_track = |t: &&Track| t.passes.iter().find(|p| p.0 == *name).map(|p| mean(&p.1));
            (name.to_string(), median(tracks.iter().filter_map(of_track)))
        });
        rows.push((label.to_string(), parts.collect()));
    }
    let _ = writeln!(
        page,
        "<div><h3>Where the time goes</h3>\n{}</div>",
        bars(&rows, "ms per iteration")
    );
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
