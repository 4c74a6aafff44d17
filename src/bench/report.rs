//! Results for people: one HTML file that needs no network and no scripts.

mod ablation;
mod bars;
mod pictures;
mod plot;
mod scene;
mod trade;

use super::Results;
use super::reference::{DARKER, NOISIER, TRIAL, UNBIASED};
use super::standing::{Equal, Standing, Verdict, standings};
use super::statistics::Estimate;
use crate::Result;
use crate::metrics::Metric;
use std::fmt::Write;

/// The whole page.
///
/// # Errors
/// A picture could not be encoded.
pub fn html(results: &Results) -> Result<String> {
    let labels: Vec<&str> = results
        .plan
        .variants
        .iter()
        .map(|v| v.label.as_str())
        .collect();
    let mut page = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>lightfall bench</title>\n<style>\n{}</style>\n</head>\n<body>\n\
         <h1>lightfall bench</h1>\n<p>{}</p>\n",
        include_str!("report/style.css"),
        escape(&labels.join(", "))
    );
    if results.interrupted {
        page += "<p><strong>Interrupted: this is what was measured until then.</strong></p>\n";
    }
    for failure in &results.failures {
        let _ = writeln!(
            page,
            "<p><strong>Not measured: {}</strong></p>",
            escape(&failure.to_string())
        );
    }
    if results.plan.trade {
        trade::summary(&mut page, results, &labels);
    } else {
        summary(&mut page, results, &labels);
    }
    about(&mut page, results);
    for scene in &results.scenes {
        match &scene.trade {
            Some(found) => trade::section(&mut page, scene, found, &labels),
            None => scene::section(&mut page, results, scene, &labels)?,
        }
    }
    page += "</body>\n</html>\n";
    Ok(page)
}

fn summary(page: &mut String, results: &Results, labels: &[&str]) {
    *page += "<h2>Who is ahead</h2>\n<div class=\"wide\"><table class=\"summary\">\n<tr><th>scene</th>\
              <th>equal time,<br>relMSE</th><th>equal time,<br>1 − SSIM</th>\
              <th>equal iterations,<br>relMSE</th><th>equal relMSE,<br>time</th></tr>\n";
    for scene in &results.scenes {
        let _ = write!(page, "<tr><td>{}</td>", escape(&scene.name));
        for standing in standings(&scene.tracks, labels.len()) {
            let text = standing.verdict().map_or("–".into(), |v| short(&v, labels));
            let _ = write!(page, "<td>{text}</td>");
        }
        *page += "</tr>\n";
    }
    let seeds = results.plan.seeds;
    let _ = writeln!(
        page,
        "</table></div>\n<p>A name alone is ahead of all others with every interval above 1; in brackets, how many times as much the next \
         one has [95 % interval]. Names joined by ≈ cannot be told apart. Lower is better in all columns. {}</p>",
        coverage(seeds)
    );
}

/// What an interval over so few seeds is worth.
fn coverage(seeds: u64) -> String {
    match seeds {
        0 | 1 => "One seed gives no interval, so no winner is named.".into(),
        2..=5 => format!(
            "With {seeds} seeds an interval reaches from the smallest to the largest value, and holds the true median in {:.0} % of \
             cases only; six seeds make 95 %.",
            100.0 * (1.0 - 0.5f64.powf(seeds as f64 - 1.0))
        ),
        _ => format!("Intervals are over {seeds} seeds."),
    }
}

fn about(page: &mut String, results: &Results) {
    *page += "<h2>How it was measured</h2>\n<table class=\"about\">\n";
    for (name, value) in results.about.pairs() {
        let _ = writeln!(page, "<tr><th>{name}</th><td>{}</td></tr>", escape(value));
    }
    let budget = results.plan.budget.text();
    let _ = writeln!(
        page,
        "<tr><th>budget</th><td>{budget} for each technique and seed, {} seeds</td></tr>\n</table>\n\
         <ul>\n<li>All techniques run in one process on one device, an iteration at a time, always the one that has used up least: what else \
         the machine does hits all alike. Seeds are blocks one after another; comparisons are made within blocks.</li>\n\
         <li>Two iterations before the clock starts compile pipelines and fill caches. Loading the scene, reading images back and measuring \
         them do not count. Times of passes are the device's timestamps; <em>host</em>: the device waited for the host; \
         <em>other</em>: the rest of an iteration.</li>\n\
         <li>relMSE is the mean of (x − r)² / (r² + 0.01) over pixels and channels, outliers kept; <em>trimmed</em> leaves out the worst \
         0.1 % of the pixels. SSIM (Wang et al. 2004) is that of displayed luminance, FLIP is HDR-FLIP (Andersson et al. 2021).</li>\n\
         <li>References that were rendered here: by {UNBIASED}, unless a trial of {} % of the time found it to see less than {} % of a photon map's \
         light or to have over {NOISIER} times its noise; then by photons with direct light by rays, and what is left of their blur is hidden by such a reference. Two renders of different \
         seeds make its halves, and their difference its noise.</li>\n\
         <li>Numbers are medians over seeds with 95 % intervals: percentile bootstrap, expanded for few samples (Hesterberg 2015).</li>\n</ul>",
        results.plan.seeds,
        100.0 * TRIAL,
        100.0 * DARKER
    );
}

/// The best, or those that cannot be told from it.
fn short(verdict: &Verdict, labels: &[&str]) -> String {
    let label = |v: usize| escape(labels.get(v).unwrap_or(&"?"));
    let Some((_, next)) = verdict.others.first() else {
        return label(verdict.best);
    };
    if next.interval.is_none() {
        return format!("({})", label(verdict.best));
    }
    let tied = verdict.others.iter().filter(|o| !Verdict::is_beaten(&o.1));
    let tied: Vec<String> = std::iter::once(label(verdict.best))
        .chain(tied.map(|o| label(o.0)))
        .collect();
    match tied.len() {
        1 => format!(
            "<strong>{}</strong><small>{}× {}</small>",
            tied[0],
            number(next.value),
            interval(next)
        ),
        _ => tied.join(" ≈ "),
    }
}

/// In whole sentences.
fn sentence(standing: &Standing, labels: &[&str]) -> String {
    let label = |v: usize| escape(labels.get(v).unwrap_or(&"?"));
    let head = match standing.equal {
        Equal::Time(s) => format!("After {} s", number(s)),
        Equal::Iterations(n) => format!("After {n} iterations"),
        Equal::Error(e) => format!("To a relMSE of {}", number(e)),
    };
    let what = match (standing.equal, standing.metric) {
        (Equal::Error(_), _) => "time",
        (_, Metric::Ssim) => "1 − SSIM",
        _ => "relMSE",
    };
    let Some(verdict) = standing.verdict() else {
        return format!("{head}: nobody to compare with.");
    };
    let times = |o: &(usize, Estimate)| {
        format!("{} ({}× {})", label(o.0), number(o.1.value), interval(&o.1))
    };
    let list = |others: &[&(usize, Estimate)]| {
        others
            .iter()
            .map(|o| times(o))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let best = label(verdict.best);
    type Others<'a> = Vec<&'a (usize, Estimate)>;
    let (beaten, tied): (Others, Others) = verdict
        .others
        .iter()
        .partition(|o| Verdict::is_beaten(&o.1));
    if tied.iter().any(|o| o.1.interval.is_none()) {
        let all: Vec<_> = verdict.others.iter().collect();
        return format!(
            "{head}, {best} measured the least {what}; others: {}. One seed, so no winner.",
            list(&all)
        );
    }
    match (beaten.is_empty(), tied.is_empty()) {
        (_, true) => format!(
            "{head}, <strong>{best} wins</strong> with the least {what}; others: {}.",
            list(&beaten)
        ),
        (true, false) => format!(
            "{head}, <strong>nobody wins</strong>: {best} has the least {what}, but cannot be told from {}.",
            list(&tied)
        ),
        (false, false) => format!(
            "{head}, <strong>nobody wins alone</strong>: {best} has the least {what}, but cannot be told from {}. Beaten: {}.",
            list(&tied),
            list(&beaten)
        ),
    }
}

fn interval(estimate: &Estimate) -> String {
    estimate.interval.map_or(String::new(), |[low, high]| {
        format!("[{}, {}]", number(low), number(high))
    })
}

/// Three digits.
fn number(x: f64) -> String {
    if !x.is_finite() {
        return "–".into();
    }
    let magnitude = x.abs();
    if magnitude == 0.0 {
        return "0".into();
    }
    if !(1e-4..1e6).contains(&magnitude) {
        let text = format!("{x:.2e}");
        let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let digits = digits.trim_end_matches('0').trim_end_matches('.');
        return format!("{digits}e{exponent}");
    }
    let decimals = (2 - magnitude.log10().floor() as i32).clamp(0, 7) as usize;
    let text = format!("{x:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text,
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        for (x, text) in [
            (0.0, "0"),
            (0.00012345, "0.000123"),
            (1.0, "1"),
            (2.5, "2.5"),
            (1234.5, "1234"),
            (0.999, "0.999"),
            (1.2e-7, "1.2e-7"),
            (1e-9, "1e-9"),
            (3.21e8, "3.21e8"),
            (f64::NAN, "–"),
        ] {
            assert_eq!(number(x), text);
        }
    }
}
