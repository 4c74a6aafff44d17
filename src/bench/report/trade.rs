//! What a user can trade, in the report: what each setting does to the error, and the front of error against time.

use super::plot::{Axis, Line, Plot};
use super::{coverage, escape, interval, number, scene};
use crate::bench::standing::{self, of};
use crate::bench::statistics::{Estimate, median};
use crate::bench::trade::{METRIC, Overall, Place, SHARES, Trade, overall};
use crate::bench::{Results, SceneResults};
use std::fmt::Write;

/// Over all scenes.
pub fn summary(page: &mut String, results: &Results, labels: &[&str]) {
    let scenes = results.scenes.iter().filter_map(|s| s.trade.as_ref());
    let scenes: Vec<&Trade> = scenes.collect();
    let rows = overall(&scenes, labels.len());
    *page += "<h2>What a setting buys</h2>\n<div class=\"wide\"><table>\n";
    heads(page, &SHARES.map(percent));
    *page += "</tr>\n";
    for (label, row) in labels.iter().zip(&rows) {
        let _ = write!(page, "<tr><td>{}</td>", escape(label));
        for k in 0..3 {
            let place = match (row.least[k], row.tied[k]) {
                (0, 0) => String::new(),
                (least, 0) => format!("least in {least}"),
                (0, tied) => format!("≈ in {tied}"),
                (least, tied) => format!("least in {least}, ≈ in {tied}"),
            };
            cell(page, &row.ratios[k], &place);
        }
        *page += "</tr>\n";
    }
    let first = escape(labels.first().unwrap_or(&""));
    let _ = writeln!(
        page,
        "</table></div>\n<p>Error (relMSE, trimmed) over that of <em>{first}</em>, the first row, after the same time: below 1 is better. Geometric \
         means over the scenes ({}) with 95 % intervals over the scenes; green: the whole interval is below 1, red: above. Below, in how many scenes a \
         setting errs <em>least</em> of all at that time, so that it lies on the front of error against time, and in how many more no difference to \
         the least is shown (≈). Rows that ask for what the default is anyway show how far noise goes.</p>",
        scenes.len()
    );
    if scenes.is_empty() {
        return;
    }
    *page += "<ul>\n";
    for (k, share) in SHARES.into_iter().enumerate() {
        let words = words(labels, &rows, k, scenes.len());
        let _ = writeln!(
            page,
            "<li>After {} of the time: {words}</li>",
            percent(share)
        );
    }
    *page += "</ul>\n";
}

/// Which settings lie on the front at the time `k`.
fn words(labels: &[&str], rows: &[Overall], k: usize, scenes: usize) -> String {
    let list = |wanted: &dyn Fn(usize) -> bool| {
        let rows = labels.iter().zip(rows);
        let rows = rows.filter(|(_, row)| wanted(row.least[k] + row.tied[k]));
        let names: Vec<String> = rows.map(|(label, _)| escape(label)).collect();
        match names.is_empty() {
            true => "none".into(),
            false => names.join(", "),
        }
    };
    format!(
        "on the front or not told from it <strong>in every scene: {}</strong>; in none: {}.",
        list(&|n| n == scenes),
        list(&|n| n == 0)
    )
}

/// Of one scene.
pub fn section(page: &mut String, scene: &SceneResults, trade: &Trade, labels: &[&str]) {
    scene::head(page, scene, labels);
    front(page, scene, trade, labels);
    *page += "<div class=\"wide\"><table>\n";
    heads(page, &trade.times.map(|t| format!("{} s", number(t))));
    *page += "<th>ms per iteration</th><th>error at the end</th></tr>\n";
    for (v, (label, point)) in labels.iter().zip(&trade.points).enumerate() {
        let _ = write!(page, "<tr><td>{}</td>", escape(label));
        for (ratio, place) in point.ratios.iter().zip(point.places) {
            let place = match place {
                Place::Least => "least",
                Place::Tied => "≈",
                Place::Behind | Place::Unknown => "",
            };
            cell(page, ratio, place);
        }
        let tracks = of(&scene.tracks, v);
        let time = median(tracks.map(|t| 1e3 * median(t.seconds.iter().copied())));
        let curve = standing::over_time(&scene.tracks, v, METRIC);
        let error = curve.last().map_or(f64::NAN, |(_, error)| error.value);
        let (time, error) = (number(time), number(error));
        let _ = writeln!(page, "<td>{time}</td><td>{error}</td></tr>");
    }
    let seeds = of(&scene.tracks, 0).count() as u64;
    let _ = writeln!(
        page,
        "</table></div>\n<p>Error over the first row's after the same time: medians over seeds with 95 % intervals. {}</p>",
        coverage(seeds)
    );
}

fn heads(page: &mut String, times: &[String; 3]) {
    *page += "<tr><th></th>";
    for time in times {
        let _ = write!(page, "<th>error ratio after {time}</th>");
    }
}

fn cell(page: &mut String, ratio: &Estimate, place: &str) {
    let class = match ratio.interval {
        Some([_, high]) if high < 1.0 => " class=\"best\"",
        Some([low, _]) if low > 1.0 => " class=\"worse\"",
        _ => "",
    };
    let (value, interval) = (number(ratio.value), interval(ratio));
    let _ = write!(
        page,
        "<td{class}>{value}<small>{interval}</small><small>{place}</small></td>"
    );
}

/// The default and what lies on the front by name, all others in grey.
fn front(page: &mut String, scene: &SceneResults, trade: &Trade, labels: &[&str]) {
    const GREY: usize = 6;
    let line = |v: usize, label: &str, index: usize| Line {
        label: label.into(),
        index,
        points: standing::over_time(&scene.tracks, v, METRIC)
            .iter()
            .map(|(t, error)| [*t, error.value])
            .collect(),
        band: Vec::new(),
    };
    let named = |v: &usize| *v == 0 || trade.points.get(*v).is_some_and(|p| p.on_front);
    let (named, others): (Vec<usize>, Vec<usize>) = (0..labels.len()).partition(named);
    let others = others.iter().map(|&v| line(v, "", GREY));
    // Grey, the seventh colour, is left to the others.
    let colour = |i: usize| i + i / GREY;
    let named = named.iter().enumerate();
    let named = named.map(|(i, &v)| line(v, labels[v], colour(i)));
    let plot = Plot {
        x: Axis {
            label: "time (s)".into(),
            logarithmic: true,
        },
        y: Axis {
            label: "relMSE, trimmed".into(),
            logarithmic: true,
        },
        lines: others.chain(named).collect(),
        level: None,
    };
    let _ = writeln!(
        page,
        "<div class=\"front\"><h3>The front of error against time</h3>\n{}</div>\n\
         <p>By name: the default, and what errs least at some time. Grey: all others.</p>",
        plot.svg()
    );
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}
