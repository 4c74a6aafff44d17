//! What culling, stochastic evaluation and the radius do by themselves (Kern, Brüll & Grosch 2023,
//! table 4 and figure 10), and what guiding does.

use super::plan::{Budget, Factors, Variant};
use super::race::{Course, End, Track, race};
use crate::settings::{Evaluate, Settings, Switch};

/// Of one scene with one seed.
pub struct Ablation {
    /// Neither, culling, stochastic evaluation, both.
    pub variants: Vec<Variant>,
    /// One each, of as many iterations.
    pub tracks: Vec<Track>,
    pub sweep: Vec<SweepPoint>,
    /// Without a guide, with one, and as the pilot chooses: as long each, not counting what
    /// learning took.
    pub guiding: Vec<Track>,
}

/// Of [`Ablation::guiding`].
pub const GUIDES: [(&str, Switch); 3] = [
    ("without a guide", Switch::Off),
    ("with one", Switch::On),
    ("as the pilot chooses", Switch::Auto),
];

/// The same radii in every iteration, without culling.
pub struct SweepPoint {
    /// Times the radii that the scene starts with by default.
    pub factor: f64,
    pub full: Track,
    pub stochastic: Track,
}

/// Twice the radius finds four times the photons: larger factors would take most of a bench's time.
pub const FACTORS: [f64; 4] = [0.25, 0.5, 1.0, 2.0];

/// At least so many iterations each, or medians mean nothing.
const LEAST: u64 = 4;

/// Measures for about `seconds` each: the four combinations, then the radii.
pub fn measure(course: &Course, base: &Settings, seed: u64, seconds: f64) -> Ablation {
    let end = End::Rounds {
        seconds,
        least: LEAST,
    };
    let variants: Vec<Variant> = [
        ("neither", Switch::Off, Evaluate::Full),
        ("culling", Switch::On, Evaluate::Full),
        ("stochastic evaluation", Switch::Off, Evaluate::Stochastic),
        ("both", Switch::On, Evaluate::Stochastic),
    ]
    .into_iter()
    .map(|(label, cull, evaluate)| Variant {
        label: label.into(),
        settings: Settings {
            cull,
            evaluate,
            ..base.clone()
        },
        factors: Factors::NONE,
    })
    .collect();
    let tracks = race(course, &variants, seed, &end);
    let sweep = match tracks.first() {
        Some(track) if track.failure.is_none() => sweep(course, base, seed, &end),
        _ => Vec::new(),
    };
    let guiding = GUIDES.map(|(label, guide)| Variant {
        label: label.into(),
        settings: Settings {
            guide,
            ..base.clone()
        },
        factors: Factors::NONE,
    });
    let guiding = race(
        course,
        &guiding,
        seed,
        &End::Budget(Budget::Seconds(seconds)),
    );
    let mut ablation = Ablation {
        variants,
        tracks,
        sweep,
        guiding,
    };
    // No picture is made of them.
    let points = ablation
        .sweep
        .iter_mut()
        .flat_map(|p| [&mut p.full, &mut p.stochastic]);
    ablation
        .tracks
        .iter_mut()
        .chain(points)
        .chain(&mut ablation.guiding)
        .for_each(|t| t.image.pixels = Vec::new());
    ablation
}

fn sweep(course: &Course, base: &Settings, seed: u64, end: &End) -> Vec<SweepPoint> {
    let variant = |factor: f64, evaluate| Variant {
        label: format!("radius × {factor}"),
        settings: Settings {
            // As good as 1: the radius stays.
            alpha: 0.999_999,
            cull: Switch::Off,
            evaluate,
            ..base.clone()
        },
        factors: Factors {
            radii: factor,
            ..Factors::NONE
        },
    };
    let both = |factor| {
        [
            variant(factor, Evaluate::Full),
            variant(factor, Evaluate::Stochastic),
        ]
    };
    let variants: Vec<Variant> = FACTORS.into_iter().flat_map(both).collect();
    let mut tracks = race(course, &variants, seed, end).into_iter();
    let mut points = Vec::new();
    for factor in FACTORS {
        if let (Some(full), Some(stochastic)) = (tracks.next(), tracks.next()) {
            points.push(SweepPoint {
                factor,
                full,
                stochastic,
            });
        }
    }
    points
}
