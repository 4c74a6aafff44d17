//! Who stands where: at equal time, at equal iterations, at equal error.

use super::plan::checkpoints;
use super::race::{Checkpoint, METRICS, Track};
use super::statistics::{Estimate, median_of, median_ratio, slope};
use crate::metrics::Metric;

/// What is held equal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Equal {
    /// Seconds that all have had.
    Time(f64),
    /// Iterations that all have done.
    Iterations(f64),
    /// relMSE that all have reached; what differs is the time.
    Error(f64),
}

/// One comparison of all variants on one scene.
pub struct Standing {
    pub equal: Equal,
    /// Lower is better, all of them.
    pub metric: Metric,
    pub rows: Vec<Row>,
}

/// One variant.
pub struct Row {
    pub variant: usize,
    /// Of each seed.
    pub values: Vec<f64>,
    pub estimate: Estimate,
}

/// What can be said of the best: against each other variant, how many times as large that one's value is.
pub struct Verdict {
    pub best: usize,
    /// By rising ratio.
    pub others: Vec<(usize, Estimate)>,
}

impl Verdict {
    /// Whether a variant's ratio is above 1 for certain.
    pub fn is_beaten(ratio: &Estimate) -> bool {
        ratio.interval.is_some_and(|[low, _]| low > 1.0)
    }
}

/// All comparisons that the tracks allow; empty where fewer than two variants have been measured.
pub fn standings(tracks: &[Track], variants: usize) -> Vec<Standing> {
    let measured: Vec<usize> = (0..variants)
        .filter(|v| of(tracks, *v).next().is_some())
        .collect();
    let seen = || tracks.iter().filter(|t| !t.checkpoints.is_empty());
    let least = |x: fn(&Checkpoint) -> f64| {
        let ends = seen().filter_map(|t| t.checkpoints.last().map(x));
        ends.fold(f64::INFINITY, f64::min)
    };
    // The worst of what each has reached.
    let reached = |t: &Track| {
        t.checkpoints
            .iter()
            .map(|c| c.errors[0])
            .fold(f64::INFINITY, f64::min)
    };
    let error = seen().map(reached).fold(0.0, f64::max);
    let (time, iterations) = (least(|c| c.seconds), least(|c| c.iterations as f64));
    let mut standings = Vec::new();
    for (equal, metric) in [
        (Equal::Time(time), Metric::RelMse),
        (Equal::Time(time), Metric::Ssim),
        (Equal::Iterations(iterations), Metric::RelMse),
        (Equal::Error(error), Metric::RelMse),
    ] {
        standings.push(compare(tracks, &measured, equal, metric));
    }
    if measured.is_empty() {
        Vec::new()
    } else {
        standings
    }
}

/// All variants after the same time.
pub fn at_time(tracks: &[Track], variants: usize, seconds: f64, metric: Metric) -> Standing {
    let all: Vec<usize> = (0..variants).collect();
    compare(tracks, &all, Equal::Time(seconds), metric)
}

fn compare(tracks: &[Track], variants: &[usize], equal: Equal, metric: Metric) -> Standing {
    let rows = variants.iter().map(|&variant| {
        let values = of(tracks, variant).map(|t| value(t, equal, metric));
        let values: Vec<f64> = values.collect();
        let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        Row {
            variant,
            estimate: median_of(&known),
            values,
        }
    });
    Standing {
        equal,
        metric,
        rows: rows.collect(),
    }
}

/// A variant's tracks that have been measured, by seed.
pub fn of(tracks: &[Track], variant: usize) -> impl Iterator<Item = &Track> {
    let measured = move |t: &&Track| t.variant == variant && !t.checkpoints.is_empty();
    tracks.iter().filter(measured)
}

/// A variant's error over time: seconds and the median over its seeds with its interval, at the budget's log-spaced shares
/// of the time that all its seeds have been measured for.
pub fn over_time(tracks: &[Track], variant: usize, metric: Metric) -> Vec<(f64, Estimate)> {
    let seen = || of(tracks, variant).map(|t| &t.checkpoints);
    let first = seen()
        .filter_map(|c| c.first())
        .map(|c| c.seconds)
        .fold(0.0, f64::max);
    let last = seen()
        .filter_map(|c| c.last())
        .map(|c| c.seconds)
        .fold(f64::INFINITY, f64::min);
    let times = checkpoints()
        .map(|share| share * last)
        .filter(|t| *t > first);
    let times = std::iter::once(first).chain(times).filter(|t| *t <= last);
    let at = |t| {
        let errors: Vec<f64> = of(tracks, variant)
            .map(|track| value(track, Equal::Time(t), metric))
            .collect();
        (t, median_of(&errors))
    };
    times.map(at).collect()
}

fn value(track: &Track, equal: Equal, metric: Metric) -> f64 {
    let index = METRICS.iter().position(|m| *m == metric).unwrap_or(0);
    let curve = |x: fn(&Checkpoint) -> f64| -> Vec<[f64; 2]> {
        track
            .checkpoints
            .iter()
            .map(|c| [x(c), c.errors[index]])
            .collect()
    };
    match equal {
        Equal::Time(t) => at(&curve(|c| c.seconds), t),
        Equal::Iterations(n) => at(&curve(|c| c.iterations as f64), n),
        Equal::Error(e) => first_below(&curve(|c| c.seconds), e),
    }
}

/// y at `x` on a curve that is straight between its points on logarithmic axes; NaN where `x` is outside.
fn at(curve: &[[f64; 2]], x: f64) -> f64 {
    if let Some(point) = curve.iter().find(|p| p[0] == x) {
        return point[1];
    }
    let around = curve.windows(2).find(|w| w[0][0] <= x && x <= w[1][0]);
    around.map_or(f64::NAN, |w| between(w[0], w[1], x))
}

fn between([x0, y0]: [f64; 2], [x1, y1]: [f64; 2], x: f64) -> f64 {
    let t = (x / x0).ln() / (x1 / x0).ln();
    // Equal images have no logarithm of their error.
    if y0 <= 0.0 || y1 <= 0.0 {
        return y0 + t * (y1 - y0);
    }
    y0 * (y1 / y0).powf(t)
}

/// The first x at which y is `limit` or less; NaN where it never is.
fn first_below(curve: &[[f64; 2]], limit: f64) -> f64 {
    let Some(i) = curve.iter().position(|p| p[1] <= limit) else {
        return f64::NAN;
    };
    match i.checked_sub(1) {
        // Before the first checkpoint nobody looked.
        None => curve[0][0],
        Some(before) => {
            let [[x0, y0], [x1, y1]] = [curve[before], curve[i]];
            if y1 <= 0.0 {
                x1
            } else {
                between([y0, x0], [y1, x1], limit)
            }
        }
    }
}

impl Standing {
    /// Who beats every other for certain.
    pub fn winner(&self) -> Option<usize> {
        let verdict = self.verdict()?;
        let alone = verdict.others.iter().all(|o| Verdict::is_beaten(&o.1));
        alone.then_some(verdict.best)
    }

    /// The least value, of which others need not be told.
    pub fn best(&self) -> Option<&Row> {
        let by_value = |a: &&Row, b: &&Row| a.estimate.value.total_cmp(&b.estimate.value);
        self.known().min_by(by_value)
    }

    fn known(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|r| r.estimate.value.is_finite())
    }

    /// `None` where there is nobody to compare with.
    pub fn verdict(&self) -> Option<Verdict> {
        let best = self.best()?;
        let others = self.known().filter(|r| r.variant != best.variant);
        let mut others: Vec<(usize, Estimate)> = others
            .map(|other| {
                let pairs = other.values.iter().zip(&best.values).map(|(o, b)| [*o, *b]);
                let pairs: Vec<[f64; 2]> = pairs
                    .filter(|p| p.iter().all(|x| x.is_finite() && *x > 0.0))
                    .collect();
                (other.variant, median_ratio(&pairs))
            })
            .collect();
        others.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
        (!others.is_empty()).then_some(Verdict {
            best: best.variant,
            others,
        })
    }
}

/// By which power relMSE falls with time over the last decade of it; the theory of progressive photon mapping says −2/3
/// where bias and variance balance, path tracing −1.
pub fn decay(tracks: &[Track], variant: usize) -> Option<Estimate> {
    let of_track = |t: &Track| {
        let end = t.checkpoints.last().map_or(0.0, |c| c.seconds);
        let late = t
            .checkpoints
            .iter()
            .filter(|c| c.seconds >= 0.1 * end && c.errors[0] > 0.0);
        let points: Vec<[f64; 2]> = late.map(|c| [c.seconds.ln(), c.errors[0].ln()]).collect();
        (points.len() >= 3).then(|| slope(&points))
    };
    let slopes: Vec<f64> = of(tracks, variant).filter_map(of_track).collect();
    (!slopes.is_empty()).then(|| median_of(&slopes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_read_on_logarithmic_axes() {
        let curve = [[1.0, 1.0], [4.0, 0.25], [16.0, 0.0625]];
        assert_eq!(at(&curve, 4.0), 0.25);
        assert!((at(&curve, 2.0) - 0.5).abs() < 1e-12);
        assert!(at(&curve, 0.5).is_nan() && at(&curve, 17.0).is_nan());
        assert!((first_below(&curve, 0.5) - 2.0).abs() < 1e-12);
        assert_eq!(first_below(&curve, 2.0), 1.0);
        assert!(first_below(&curve, 0.01).is_nan());
    }

    fn standing(rows: &[&[f64]]) -> Standing {
        let row = |(variant, values): (usize, &&[f64])| Row {
            variant,
            values: values.to_vec(),
            estimate: median_of(values),
        };
        Standing {
            equal: Equal::Time(1.0),
            metric: Metric::RelMse,
            rows: rows.iter().enumerate().map(row).collect(),
        }
    }

    #[test]
    fn winners_are_those_that_win_with_every_seed() {
        let standing = standing(&[
            &[2.0, 2.2, 2.1, 1.9, 2.0, 2.1],
            &[1.0, 1.1, 1.0, 1.0, 0.9, 1.0],
            &[1.1, 1.0, 1.0, 1.1, 1.0, 0.9],
        ]);
        let verdict = standing.verdict().unwrap();
        assert_eq!(verdict.best, 1);
        let beaten: Vec<(usize, bool)> = verdict
            .others
            .iter()
            .map(|o| (o.0, Verdict::is_beaten(&o.1)))
            .collect();
        assert_eq!(beaten, [(2, false), (0, true)]);
    }

    #[test]
    fn one_seed_beats_nobody() {
        let verdict = standing(&[&[2.0], &[1.0]]).verdict().unwrap();
        assert!(!Verdict::is_beaten(&verdict.others[0].1));
        assert!(standing(&[&[2.0]]).verdict().is_none());
    }
}
