//! What a user can trade: single settings around a default, which of them lie on the front of error against time, and what each
//! does to the error after the same time.

use super::plan::{Variant, checkpoints};
use super::race::Track;
use super::standing::{Standing, Verdict, at_time};
use super::statistics::{Estimate, bootstrap, median_ratio};
use crate::metrics::Metric;
use crate::settings::{Direct, Evaluate, Switch};

/// A few pixels that a rough mirror made bright would hide what all others have to say.
pub const METRIC: Metric = Metric::RelMseTrimmed;

/// Shares of the measured time at which settings are compared. A front at every checkpoint would find most settings on it once, by
/// chance.
pub const SHARES: [f64; 3] = [0.125, 0.35, 1.0];

/// `base` with one setting changed, for each that there is a point in changing. What culling and technique the device chooses by itself
/// is among them: the difference to the default is then noise.
pub fn around(base: &Variant) -> Vec<Variant> {
    let mut points = Vec::new();
    let mut add = |label: String, change: &dyn Fn(&mut Variant)| {
        let mut point = Variant {
            label,
            ..base.clone()
        };
        change(&mut point);
        if (&point.settings, point.factors) != (&base.settings, base.factors) {
            points.push(point);
        }
    };
    for factor in [0.25, 0.5, 2.0, 4.0] {
        let photons = |v: &mut Variant| v.factors.photons = factor;
        add(format!("photons × {factor}"), &photons);
    }
    for factor in [0.5, 0.7, 1.4, 2.0] {
        let radii = |v: &mut Variant| v.factors.radii = factor;
        add(format!("radii × {factor}"), &radii);
    }
    for alpha in [0.5, 0.8, 0.95] {
        add(format!("alpha {alpha}"), &|v| v.settings.alpha = alpha);
    }
    for k in [1, 3, 8] {
        add(format!("stochastic, k {k}"), &|v| {
            v.settings.evaluate = Evaluate::Stochastic;
            v.settings.reservoir = k;
        });
    }
    for reject in [0.5, 0.8] {
        add(format!("reject {reject}"), &|v| v.settings.reject = reject);
    }
    add("cull on".into(), &|v| v.settings.cull = Switch::On);
    add("cull off".into(), &|v| v.settings.cull = Switch::Off);
    for depth in [4, 6, 8]
        .into_iter()
        .filter(|d| *d < base.settings.max_depth)
    {
        let shorter = |v: &mut Variant| v.settings.max_depth = depth;
        add(format!("max-depth {depth}"), &shorter);
    }
    for factor in [0.5, 0.7] {
        let edges = |v: &mut Variant| v.factors.edges = factor;
        add(format!("size × {factor}"), &edges);
    }
    let photons = |v: &mut Variant| v.settings.direct = Direct::Photons;
    add("direct photons".into(), &photons);
    for technique in ["rtpm", "hash-grid", "sppm", "path"] {
        add(technique.into(), &|v| {
            v.settings.technique = technique.into()
        });
    }
    points
}

/// What was found on one scene.
pub struct Trade {
    /// Seconds, as [`SHARES`] of what all have had.
    pub times: [f64; 3],
    /// One for each variant.
    pub points: Vec<Point>,
}

/// One variant.
pub struct Point {
    /// Its error over the first variant's after [`Trade::times`], with intervals over seeds.
    pub ratios: [Estimate; 3],
    /// At the same times.
    pub places: [Place; 3],
    /// Whether it errs least at any time: the front.
    pub on_front: bool,
}

/// Where a variant stands to the least error that any has reached at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    Least,
    /// More, but no difference is shown.
    Tied,
    Behind,
    /// It has no image yet, or failed.
    Unknown,
}

impl Place {
    pub fn name(self) -> &'static str {
        match self {
            Self::Least => "least",
            Self::Tied => "tied",
            Self::Behind => "behind",
            Self::Unknown => "unknown",
        }
    }
}

/// `None` where nothing can be compared.
pub fn trade(tracks: &[Track], variants: usize) -> Option<Trade> {
    let whole = tracks.iter().filter(|t| t.failure.is_none());
    let ends = whole.filter_map(|t| t.checkpoints.last().map(|c| c.seconds));
    let end = ends.fold(f64::INFINITY, f64::min);
    if !end.is_finite() {
        return None;
    }
    let standing = |share| at_time(tracks, variants, share * end, METRIC);
    let compared = SHARES.map(standing);
    let standings: Vec<Standing> = checkpoints().map(standing).collect();
    let points = (0..variants).map(|v| Point {
        ratios: compared.each_ref().map(|s| to_first(s, v)),
        places: compared.each_ref().map(|s| place(s, v)),
        on_front: standings.iter().any(|s| place(s, v) == Place::Least),
    });
    Some(Trade {
        times: SHARES.map(|share| share * end),
        points: points.collect(),
    })
}

fn place(standing: &Standing, variant: usize) -> Place {
    if standing.best().is_some_and(|best| best.variant == variant) {
        return Place::Least;
    }
    let others = standing.verdict().map_or(Vec::new(), |v| v.others);
    match others.iter().find(|o| o.0 == variant) {
        Some((_, ratio)) if Verdict::is_beaten(ratio) => Place::Behind,
        Some(_) => Place::Tied,
        None => Place::Unknown,
    }
}

/// A variant's errors over the first one's, seed by seed.
fn to_first(standing: &Standing, variant: usize) -> Estimate {
    let values = |v: usize| {
        let row = standing.rows.iter().find(|r| r.variant == v);
        row.map_or(&[][..], |r| &r.values)
    };
    let pairs = values(variant).iter().zip(values(0));
    let pairs = pairs.map(|(x, first)| [*x, *first]);
    let known = |p: &[f64; 2]| p.iter().all(|x| x.is_finite() && *x > 0.0);
    median_ratio(&pairs.filter(known).collect::<Vec<_>>())
}

/// One variant over all scenes.
pub struct Overall {
    /// Geometric means over the scenes of [`Point::ratios`], with intervals over the scenes: what would hold on others like them.
    pub ratios: [Estimate; 3],
    /// Scenes in which it errs least at each of the times.
    pub least: [usize; 3],
    /// Further scenes in which no difference to the least is shown.
    pub tied: [usize; 3],
}

/// One for each variant.
pub fn overall(scenes: &[&Trade], variants: usize) -> Vec<Overall> {
    let of_variant = |v: usize| {
        let points: Vec<&Point> = scenes.iter().filter_map(|s| s.points.get(v)).collect();
        let mean = |k: usize| {
            let logs: Vec<f64> = points.iter().map(|p| p.ratios[k].value.ln()).collect();
            geometric_mean(&logs)
        };
        let count = |k: usize, place| points.iter().filter(|p| p.places[k] == place).count();
        Overall {
            ratios: [0, 1, 2].map(mean),
            least: [0, 1, 2].map(|k| count(k, Place::Least)),
            tied: [0, 1, 2].map(|k| count(k, Place::Tied)),
        }
    };
    (0..variants).map(of_variant).collect()
}

/// Not known unless known of each scene: scenes differ more than settings.
fn geometric_mean(logs: &[f64]) -> Estimate {
    if logs.is_empty() || logs.iter().any(|x| !x.is_finite()) {
        return Estimate {
            value: f64::NAN,
            interval: None,
        };
    }
    bootstrap(logs.len(), 1, |drawn| {
        (drawn.iter().map(|&i| logs[i]).sum::<f64>() / drawn.len() as f64).exp()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::plan::{Factors, variants};
    use crate::bench::standing::{Equal, Row};
    use crate::bench::statistics::median_of;

    /// Errors of each variant with each seed; NaN: not measured.
    fn standing(rows: &[&[f64]]) -> Standing {
        let row = |(variant, values): (usize, &&[f64])| {
            let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
            Row {
                variant,
                values: values.to_vec(),
                estimate: median_of(&known),
            }
        };
        Standing {
            equal: Equal::Time(1.0),
            metric: METRIC,
            rows: rows.iter().enumerate().map(row).collect(),
        }
    }

    fn places(rows: &[&[f64]]) -> Vec<Place> {
        let standing = standing(rows);
        (0..rows.len()).map(|v| place(&standing, v)).collect()
    }

    #[test]
    fn the_front_is_the_least_error() {
        use Place::{Behind, Least, Tied, Unknown};
        const NONE: &[f64] = &[f64::NAN; 2];
        assert_eq!(
            places(&[&[3.0, 3.1], &[2.0, 2.1], &[2.5, 2.0], NONE]),
            [Behind, Least, Tied, Unknown],
            "better with both seeds, with one of two, and not measured"
        );
        assert_eq!(places(&[&[1.0, 1.0], &[1.0, 1.0]]), [Least, Tied], "equal");
        assert_eq!(places(&[&[5.0, 5.0], NONE]), [Least, Unknown], "alone");
        assert_eq!(
            places(&[&[5.0], &[1.0]]),
            [Tied, Least],
            "one seed beats nobody"
        );
        assert_eq!(places(&[NONE, NONE]), [Unknown; 2]);
        assert_eq!(
            places(&[&[], &[1.0, 1.0]]),
            [Unknown, Least],
            "failed at once"
        );
    }

    #[test]
    fn ratios_are_to_the_first_seed_by_seed() {
        let found = standing(&[&[1.0, 8.0, f64::NAN], &[2.0, 16.0, 1.0]]);
        let ratio = to_first(&found, 1);
        assert!((ratio.value - 2.0).abs() < 1e-12);
        assert!(to_first(&found, 2).value.is_nan());
    }

    #[test]
    fn means_over_scenes_are_geometric() {
        let mean = geometric_mean(&[0.5f64.ln(), 2f64.ln(), 1f64.ln()]);
        assert!((mean.value - 1.0).abs() < 1e-12);
        let [low, high] = mean.interval.unwrap();
        assert!(low < 0.7 && high > 1.4, "scenes that disagree say nothing");
        let unknown = geometric_mean(&[0.0, f64::NAN]);
        assert!(unknown.value.is_nan() && unknown.interval.is_none());
        assert_eq!(geometric_mean(&[0.0]).interval, None, "one scene");
    }

    #[test]
    fn points_differ_from_the_default_in_one_thing() {
        let base = variants("auto", "max-depth=6").unwrap().remove(0);
        let points = around(&base);
        assert!(points.len() > 20);
        assert!(points.iter().all(|p| p.settings.max_depth <= 6));
        for point in &points {
            let differs = point.settings != base.settings;
            assert!(
                differs != (point.factors != Factors::NONE),
                "{}",
                point.label
            );
            let same = points.iter().filter(|p| {
                p.label == point.label
                    || (&p.settings, p.factors) == (&point.settings, point.factors)
            });
            assert_eq!(same.count(), 1, "{}", point.label);
        }
        let labels: Vec<&str> = points.iter().map(|p| p.label.as_str()).collect();
        assert!(labels.contains(&"max-depth 4") && !labels.contains(&"max-depth 8"));
    }
}
