//! A scene's part of the report.

use super::plot::{Axis, Line, Plot, bars};
use super::{ablation, base64, escape, interval, number, sentence};
use crate::Result;
use crate::bench::data::{bias_and_variance, windows};
use crate::bench::race::{METRICS, Track};
use crate::bench::standing::{Equal, decay, of, standings};
use crate::bench::statistics::{Estimate, median, median_of};
use crate::bench::{Results, SceneResults};
use crate::image::{Rgb, Tone, auto_exposure, develop, encode_rgb8};
use crate::metrics::{Metric, Pair};
use std::fmt::Write;

/// Pictures wider than this (px) are shrunk, or the page becomes too large to send.
const PICTURE: usize = 512;

pub fn section(
    page: &mut String,
    results: &Results,
    scene: &SceneResults,
    labels: &[&str],
) -> Result<()> {
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
        "<h2>{}</h2>\n<p>{} triangles, {width} × {height} pixels. Reference: {}; {own}.</p>",
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
    numbers(page, scene, labels);
    pictures(page, scene, labels)?;
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
    if let Some(found) = &scene.ablation {
        ablation::section(page, found, results);
    }
    Ok(())
}

fn numbers(page: &mut String, scene: &SceneResults, labels: &[&str]) {
    let standings = standings(&scene.tracks, labels.len());
    let mut columns: Vec<(String, Vec<Option<Estimate>>)> = Vec::new();
    for standing in &standings {
        let head = match (standing.equal, standing.metric) {
            (Equal::Time(s), Metric::Ssim) => format!("1 − SSIM<br>at {} s", number(s)),
            (Equal::Time(s), _) => format!("relMSE<br>at {} s", number(s)),
            (Equal::Iterations(n), _) => format!("relMSE at<br>{n} iterations"),
            (Equal::Error(e), _) => format!("s to relMSE<br>{}", number(e)),
        };
        let estimate = |v| {
            standing
                .rows
                .iter()
                .find(|r| r.variant == v)
                .map(|r| r.estimate)
        };
        columns.push((head, (0..labels.len()).map(estimate).collect()));
    }
    let mut column = |head: &str, of_track: &dyn Fn(&Track) -> f64| {
        let estimate = |v| {
            let values: Vec<f64> = of(&scene.tracks, v).map(of_track).collect();
            (!values.is_empty()).then(|| median_of(&values))
        };
        columns.push((head.into(), (0..labels.len()).map(estimate).collect()));
    };
    let last = |t: &Track, metric: Metric| {
        let index = METRICS.iter().position(|m| *m == metric).unwrap_or(0);
        t.checkpoints.last().map_or(f64::NAN, |c| c.errors[index])
    };
    column("relMSE<br>trimmed, at the end", &|t| {
        last(t, Metric::RelMseTrimmed)
    });
    column("FLIP<br>at the end", &|t| t.flip);
    column("ms per<br>iteration", &|t| {
        1e3 * median(t.seconds.iter().copied())
    });
    column("iterations", &|t| t.iterations() as f64);
    let split = |v| bias_and_variance(scene, v);
    let fixed = |value: Option<f64>| {
        value.map(|value| Estimate {
            value,
            interval: None,
        })
    };
    columns.push((
        "bias²<br>at the end".into(),
        (0..labels.len())
            .map(|v| fixed(split(v).map(|s| s.bias2)))
            .collect(),
    ));
    columns.push((
        "variance<br>at the end".into(),
        (0..labels.len())
            .map(|v| fixed(split(v).map(|s| s.variance)))
            .collect(),
    ));
    columns.push((
        "decay<br>power".into(),
        (0..labels.len()).map(|v| decay(&scene.tracks, v)).collect(),
    ));

    *page += "<div class=\"wide\"><table>\n<tr><th></th>";
    for (head, _) in &columns {
        let _ = write!(page, "<th>{head}</th>");
    }
    *page += "</tr>\n";
    for (v, label) in labels.iter().enumerate() {
        let _ = write!(page, "<tr><td>{}</td>", escape(label));
        for (i, (_, estimates)) in columns.iter().enumerate() {
            let Some(estimate) = estimates.get(v).copied().flatten() else {
                *page += "<td>–</td>";
                continue;
            };
            // Only the standings say who is best.
            let verdict = standings.get(i).and_then(|s| s.verdict());
            let best = verdict.is_some_and(|d| {
                d.best == v && d.others.iter().all(|o| super::Verdict::is_beaten(&o.1))
            });
            let class = if best { " class=\"best\"" } else { "" };
            let _ = write!(
                page,
                "<td{class}>{}<small>{}</small></td>",
                number(estimate.value),
                interval(&estimate)
            );
        }
        *page += "</tr>\n";
    }
    *page += "</table></div>\n<p>Green: better than every other with its whole interval. Bias² and variance are the relMSE's parts, told apart by \
              the seeds; bias² contains the reference's own error and comes out below 0 where noise hides it. The decay power is the slope of log relMSE over log time \
              in the last decade: −2/3 where a photon map's bias and variance balance, −1 for a path tracer, towards 0 at \
              the reference's own error.</p>\n";
}

fn pictures(page: &mut String, scene: &SceneResults, labels: &[&str]) -> Result<()> {
    let reference = &scene.reference.image;
    let ev = auto_exposure(&reference.pixels);
    *page += "<h3>Pictures</h3>\n<div class=\"pictures\">\n";
    let shown = |image: &Rgb| -> Result<String> {
        let small = shrink(image);
        picture(small.size, &develop(&small.pixels, ev, Tone::Neutral).0)
    };
    let _ = writeln!(
        page,
        "<figure><img alt=\"reference\" src=\"{}\"><figcaption>reference</figcaption></figure>",
        shown(reference)?
    );
    for (v, label) in labels.iter().enumerate() {
        let Some(track) = of(&scene.tracks, v).next() else {
            continue;
        };
        let label = escape(label);
        let end = track.checkpoints.last().map_or(0.0, |c| c.seconds);
        let _ = writeln!(
            page,
            "<figure><img alt=\"{label}\" src=\"{}\"><figcaption>{label}, {} s, {} iterations</figcaption></figure>",
            shown(&track.image)?,
            number(end),
            track.iterations()
        );
        let Ok(pair) = Pair::new(&shrink(&track.image), &shrink(reference)) else {
            continue;
        };
        let map = pair.measure(Metric::RelMse).map;
        let bytes = Metric::RelMse.picture(&map, reference);
        let _ = writeln!(
            page,
            "<figure><img alt=\"error of {label}\" src=\"{}\"><figcaption>its relMSE</figcaption></figure>",
            picture(shrink(reference).size, &bytes)?
        );
    }
    *page += "</div>\n<div class=\"scale\"></div><p><span>0.0001</span><span>0.01</span><span>1 relMSE</span></p>\n";
    Ok(())
}

fn picture(size: [u32; 2], bytes: &[u8]) -> Result<String> {
    Ok(format!(
        "data:image/png;base64,{}",
        base64(&encode_rgb8(size, bytes)?)
    ))
}

/// By whole factors, so that the widest edge is at most [`PICTURE`]; a pixel is the mean of those that it stands for.
fn shrink(image: &Rgb) -> Rgb {
    let [width, height] = image.size.map(|n| n as usize);
    let factor = width.max(height).div_ceil(PICTURE).max(1);
    let (small_width, small_height) = ((width / factor).max(1), (height / factor).max(1));
    let mut pixels = Vec::with_capacity(small_width * small_height * 3);
    for y in 0..small_height {
        for x in 0..small_width {
            for c in 0..3 {
                let rows = (y * factor..(y + 1) * factor).map(|y| y * width);
                let values = rows
                    .flat_map(|row| (x * factor..(x + 1) * factor).map(move |x| (row + x) * 3 + c));
                let sum: f32 = values.filter_map(|i| image.pixels.get(i)).sum();
                pixels.push(sum / (factor * factor) as f32);
            }
        }
    }
    Rgb {
        size: [small_width as u32, small_height as u32],
        pixels,
    }
}

fn over_time(
    page: &mut String,
    scene: &SceneResults,
    labels: &[&str],
    title: &str,
    metric: Metric,
    level: Option<f64>,
) {
    let index = METRICS.iter().position(|m| *m == metric).unwrap_or(0);
    let lines = labels.iter().enumerate().map(|(v, label)| {
        // Checkpoints of the seeds are taken at about the same times: the k-th of each makes a point.
        let tracks: Vec<&Track> = of(&scene.tracks, v).collect();
        let count = tracks
            .iter()
            .map(|t| t.checkpoints.len())
            .min()
            .unwrap_or(0);
        let (mut points, mut band) = (Vec::new(), Vec::new());
        for k in 0..count {
            let at = |x: &dyn Fn(&crate::bench::race::Checkpoint) -> f64| -> Vec<f64> {
                tracks.iter().map(|t| x(&t.checkpoints[k])).collect()
            };
            let time = median(at(&|c| c.seconds));
            let error = median_of(&at(&|c| c.errors[index]));
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
    let plot = Plot {
        x: Axis {
            label: "iteration".into(),
            logarithmic: true,
        },
        y: Axis {
            label: "ms per iteration".into(),
            logarithmic: false,
        },
        lines: lines.collect(),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_shrink_by_whole_factors() {
        let image = |size: [u32; 2]| Rgb {
            size,
            pixels: (0..size[0] * size[1] * 3)
                .map(|i| (i / 3 % size[0]) as f32)
                .collect(),
        };
        let same = image([512, 3]);
        assert_eq!(shrink(&same), same);
        let small = shrink(&image([1025, 6]));
        assert_eq!(small.size, [341, 2]);
        assert_eq!(small.pixels[..6], [1.0, 1.0, 1.0, 4.0, 4.0, 4.0]);
        assert_eq!(shrink(&image([2000, 1])).size, [500, 1]);
    }
}
