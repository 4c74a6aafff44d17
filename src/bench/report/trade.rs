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
    let scenes: Vec<&Trade> = results
        .scenes
        .iter()
        .filter_map(|s| s.trade.as_ref())
        .collect();
    let rows = overall(&scenes, labels.len());
    *page += "<h2>What a setting buys</h2>\n<div class=\"wide\"><table>\n";
    heads(
        page,
        &SHARES.map(|share| format!("after {} of the time", fraction(share))),
    );
    *page += "<th>least error in … scenes</th><th>not told from it in … more</th></tr>\n";
    for (label, row) in labels.iter().zip(&rows) {
        let _ = write!(page, "<tr><td>{}</td>", escape(label));
        ratios(page, &row.ratios);
        let _ = writeln!(page, "<td>{}</td><td>{}</td></tr>", row.least, row.tied);
    }
    let first = escape(labels.first().unwrap_or(&""));
    let _ = writeln!(
        page,
        "</table></div>\n<p>Error (relMSE, trimmed) over that of <em>{first}</em>, the first row, after the same time: below 1 is better. Geometric \
         means over {} scenes with 95 % intervals over the scenes; green: the whole interval is below 1, red: above. The front is the least \
         error that any setting has reached, over time. Rows that ask for what the default is anyway show how far noise goes.</p>",
        scenes.len()
    );
    if !scenes.is_empty() {
        let _ = writeln!(page, "<p>{}</p>", words(labels, &rows, scenes.len()));
    }
}

/// Which settings lie on the front.
fn words(labels: &[&str], rows: &[Overall], scenes: usize) -> String {
    let list = |wanted: &dyn Fn(&Overall) -> bool| {
        let rows = labels.iter().zip(rows).filter(|(_, row)| wanted(row));
        let names: Vec<String> = rows.map(|(label, _)| escape(label)).collect();
        match names.is_empty() {
            true => "none".into(),
            false => names.join(", "),
        }
    };
    format!(
        "<strong>On the front or not told from it in every scene: {}.</strong> In some: {}. In none, at any time: {}.",
        list(&|r| r.least + r.tied == scenes),
        list(&|r| (1..scenes).contains(&(r.least + r.tied))),
        list(&|r| r.least + r.tied == 0)
    )
}

/// Of one scene.
pub fn section(page: &mut String, scene: &SceneResults, trade: &Trade, labels: &[&str]) {
    scene::head(page, scene, labels);
    front(page, scene, trade, labels);
    *page += "<div class=\"wide\"><table>\n";
    heads(page, &trade.times.map(|t| format!("after {} s", number(t))));
    *page += "<th>ms per iteration</th><th>error at the end</th><th>least error, or not told from it (s)</th></tr>\n";
    for (v, (label, point)) in labels.iter().zip(&trade.points).enumerate() {
        let _ = write!(page, "<tr><td>{}</td>", escape(label));
        ratios(page, &point.ratios);
        let tracks = || of(&scene.tracks, v);
        let time = median(tracks().map(|t| 1e3 * median(t.seconds.iter().copied())));
        let curve = standing::over_time(&scene.tracks, v, METRIC);
        let error = curve.last().map_or(f64::NAN, |(_, error)| error.value);
        let _ = writeln!(
            page,
            "<td>{}</td><td>{}</td><td>{}</td></tr>",
            number(time),
            number(error),
            place(&point.place)
        );
    }
    let seeds = of(&scene.tracks, 0).count() as u64;
    let _ = writeln!(
        page,
        "</table></div>\n<p>Error over the first row's: medians over seeds with 95 % intervals. {}</p>",
        coverage(seeds)
    );
}

fn heads(page: &mut String, times: &[String; 3]) {
    *page += "<tr><th></th>";
    for time in times {
        let _ = write!(page, "<th>error ratio {time}</th>");
    }
}

fn ratios(page: &mut String, ratios: &[Estimate; 3]) {
    for ratio in ratios {
        let class = match ratio.interval {
            Some([_, high]) if high < 1.0 => " class=\"best\"",
            Some([low, _]) if low > 1.0 => " class=\"worse\"",
            _ => "",
        };
        let (value, interval) = (number(ratio.value), interval(ratio));
        let _ = write!(page, "<td{class}>{value}<small>{interval}</small></td>");
    }
}

fn place(place: &Place) -> String {
    let range = |times: &[f64]| match times {
        [] => String::new(),
        [one] => number(*one),
        [first, .., last] => format!("{} – {}", number(*first), number(*last)),
    };
    match (place.is_least(), place.is_tied()) {
        (true, _) => format!("<strong>{}</strong>", range(&place.least)),
        (_, true) => format!("≈ {}", range(&place.tied)),
        _ => "–".into(),
    }
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
    let named = |v: &usize| *v == 0 || trade.points.get(*v).is_some_and(|p| p.place.is_least());
    let (named, others): (Vec<usize>, Vec<usize>) = (0..labels.len()).partition(named);
    let others = others.iter().map(|&v| line(v, "", GREY));
    // Grey is the seventh colour.
    let colour = |i: usize| i + i / GREY;
    let named = named
        .iter()
        .enumerate()
        .map(|(i, &v)| line(v, labels[v], colour(i)));
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
        "<div class=\"plots\"><div><h3>The front of error against time</h3>\n{}</div></div>\n\
         <p>By name: the default, and what errs least at some time. Grey: all others.</p>",
        plot.svg()
    );
}

fn fraction(share: f64) -> String {
    match share {
        1.0 => "all".into(),
        _ => format!("1/{}", number(1.0 / share)),
    }
}
