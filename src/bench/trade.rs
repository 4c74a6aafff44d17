//! What a user can trade: single settings around a default, which of them lie on the front of error against time, and what each
//! does to the error after the same time.

use super::plan::{Variant, checkpoints};
use super::race::Track;
use super::standing::{Equal, Standing, Verdict, at_time};
use super::statistics::{Estimate, bootstrap, median_ratio};
use crate::metrics::Metric;
use crate::settings::{Direct, Evaluate, Switch};

/// A few pixels that a rough mirror made bright would hide what all others have to say.
pub const METRIC: Metric = Metric::RelMseTrimmed;

/// Shares of the measured time after which errors are compared.
pub const SHARES: [f64; 3] = [1.0 / 16.0, 1.0 / 4.0, 1.0];

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
    pub place: Place,
}

/// Where a variant stands to the front: the least error that any has reached, over time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Place {
    /// Times (s) at which it errs least.
    pub least: Vec<f64>,
    /// Times (s) at which it errs more, but not for certain.
    pub tied: Vec<f64>,
}

/// `None` where nothing can be compared.
pub fn trade(tracks: &[Track], variants: usize) -> Option<Trade> {
    let whole = tracks.iter().filter(|t| t.failure.is_none());
    let ends = whole.filter_map(|t| t.checkpoints.last().map(|c| c.seconds));
    let end = ends.fold(f64::INFINITY, f64::min);
    if !end.is_finite() {
        return None;
    }
    let standings = checkpoints().map(|share| at_time(tracks, variants, share * end, METRIC));
    let places = front(&standings.collect::<Vec<_>>(), variants);
    let times = SHARES.map(|share| share * end);
    let compared = times.map(|t| at_time(tracks, variants, t, METRIC));
    let points = places.into_iter().enumerate().map(|(v, place)| Point {
        ratios: compared.each_ref().map(|standing| to_first(standing, v)),
        place,
    });
    Some(Trade {
        times,
        points: points.collect(),
    })
}

/// Where each of the variants stands, from what all had at several equal times.
fn front(standings: &[Standing], variants: usize) -> Vec<Place> {
    let mut places = vec![Place::default(); variants];
    for standing in standings {
        let Equal::Time(seconds) = standing.equal else {
            continue;
        };
        if let Some(place) = standing.best().and_then(|b| places.get_mut(b.variant)) {
            place.least.push(seconds);
        }
        let others = standing.verdict().map_or(Vec::new(), |v| v.others);
        for (v, _) in others.iter().filter(|o| !Verdict::is_beaten(&o.1)) {
            if let Some(place) = places.get_mut(*v) {
                place.tied.push(seconds);
            }
        }
    }
    places
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
    /// Scenes in which it errs least at some time.
    pub least: usize,
    /// Further scenes in which it cannot be told from the least at some time.
    pub tied: usize,
}

/// One for each variant.
pub fn overall(scenes: &[&Trade], variants: usize) -> Vec<Overall> {
    let of_variant = |v: usize| {
        let points: Vec<&Point> = scenes.iter().filter_map(|s| s.points.get(v)).collect();
        let mean = |k: usize| {
            let logs: Vec<f64> = points.iter().map(|p| p.ratios[k].value.ln()).collect();
            geometric_mean(&logs)
        };
        Overall {
            ratios: [0, 1, 2].map(mean),
            least: points.iter().filter(|p| p.place.is_least()).count(),
            tied: points.iter().filter(|p| p.place.is_tied()).count(),
        }
    };
    (0..variants).map(of_variant).collect()
}

impl Place {
    pub fn is_least(&self) -> bool {
        !self.least.is_empty()
    }

    pub fn is_tied(&self) -> bool {
        self.least.is_empty() && !self.tied.is_empty()
    }
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
    use crate::bench::standing::Row;
    use crate::bench::statistics::median_of;

    /// Errors of each variant with each seed at one time; NaN: not measured.
    fn standing(seconds: f64, rows: &[&[f64]]) -> Standing {
        let row = |(variant, values): (usize, &&[f64])| {
            let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
            Row {
                variant,
                values: values.to_vec(),
                estimate: median_of(&known),
            }
        };
        Standing {
            equal: Equal::Time(seconds),
            metric: METRIC,
            rows: rows.iter().enumerate().map(row).collect(),
        }
    }

    #[test]
    fn the_front_is_the_least_error_at_some_time() {
        const NONE: [f64; 2] = [f64::NAN; 2];
        let places = front(
            &[
                // The only one with a picture; then ahead; then overtaken for certain; then equal.
                standing(1.0, &[&[9.0, 9.1], &NONE, &NONE, &NONE]),
                standing(2.0, &[&[4.0, 4.1], &[5.0, 5.2], &[4.5, 4.4], &NONE]),
                standing(4.0, &[&[3.0, 3.1], &[2.0, 2.1], &[2.5, 2.4], &[2.5, 2.0]]),
                standing(8.0, &[&[1.0, 1.0], &[1.0, 1.0], &[1.2, 1.1], &NONE]),
                standing(16.0, &[&NONE, &NONE, &NONE, &NONE]),
            ],
            4,
        );
        assert_eq!(places[0].least, [1.0, 2.0, 8.0]);
        assert!(places[0].tied.is_empty());
        assert_eq!(places[1].least, [4.0]);
        assert_eq!(places[1].tied, [8.0], "equal");
        assert!(!places[2].is_least() && !places[2].is_tied(), "dominated");
        assert_eq!(places[3].tied, [4.0], "better with one seed of two");
        assert!(places[3].is_tied() && !places[1].is_tied());
    }

    #[test]
    fn one_point_is_a_front() {
        let places = front(&[standing(1.0, &[&[2.0, 3.0]])], 2);
        assert_eq!(places[0].least, [1.0]);
        assert_eq!(places[1], Place::default(), "one that failed at once");
        assert!(front(&[], 1).iter().all(|p| *p == Place::default()));
    }

    #[test]
    fn ratios_are_to_the_first_seed_by_seed() {
        let found = standing(1.0, &[&[1.0, 8.0, f64::NAN], &[2.0, 16.0, 1.0]]);
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
