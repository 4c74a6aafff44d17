//! What a bench is asked to do.

use crate::scene::{Environment, LoadOptions};
use crate::settings::Settings;
use crate::technique::TECHNIQUES;
use crate::{Error, Result};
use clap::Parser;
use std::path::PathBuf;

/// A whole bench.
#[derive(Debug, Clone)]
pub struct Plan {
    pub scenes: Vec<PathBuf>,
    /// How they are read.
    pub load: LoadOptions,
    /// What all scenes are put into.
    pub environment: Option<Environment>,
    pub variants: Vec<Variant>,
    pub budget: Budget,
    pub seeds: u64,
    /// An EXR file, a folder of `<scene>.exr`, or `None`: rendered here.
    pub reference: Option<PathBuf>,
    /// For references rendered here.
    pub reference_budget: Budget,
    /// Where those are kept.
    pub cache: PathBuf,
    /// Of all images; a reference file's own where `None`.
    pub size: Option<[u32; 2]>,
    /// Settings on top of which culling, evaluation and radii are measured one by one; nothing where `None`.
    pub ablation: Option<Settings>,
    /// The variants are points around the first, and the report says what each buys.
    pub trade: bool,
}

/// A technique with settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// As the user wrote it.
    pub label: String,
    pub settings: Settings,
    pub factors: Factors,
}

/// Times what the settings alone would make the renderer choose for a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factors {
    /// Light paths per iteration.
    pub photons: f64,
    /// First radii of both maps.
    pub radii: f64,
    /// Width and height of the image, which is brought to the reference's size before it is measured.
    pub edges: f64,
}

impl Factors {
    pub const NONE: Self = Self {
        photons: 1.0,
        radii: 1.0,
        edges: 1.0,
    };
}

/// How much each technique gets for each seed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Budget {
    Seconds(f64),
    Iterations(u64),
}

impl Budget {
    /// 1 and more: used up.
    pub fn used(self, iterations: u64, seconds: f64) -> f64 {
        match self {
            Self::Seconds(s) => seconds / s,
            Self::Iterations(n) => iterations as f64 / n as f64,
        }
    }

    pub fn times(self, factor: f64) -> Self {
        match self {
            Self::Seconds(s) => Self::Seconds(s * factor),
            Self::Iterations(n) => Self::Iterations((n as f64 * factor).ceil().max(1.0) as u64),
        }
    }

    /// For people.
    pub fn text(self) -> String {
        match self {
            Self::Seconds(s) => format!("{s} s"),
            Self::Iterations(n) => format!("{n} iterations"),
        }
    }
}

/// Shares of the budget at which the error is measured: log-spaced, as error falls by a power of time.
pub fn checkpoints() -> impl Iterator<Item = f64> {
    (0..=12).rev().map(|k| 0.5f64.powf(f64::from(k) / 2.0))
}

/// `lightfall render`'s own definition of settings: an option, its range and its words have one home.
#[derive(Parser)]
#[command(no_binary_name = true, args_override_self = true)]
struct Options {
    #[command(flatten)]
    settings: Settings,
}

/// Settings as `--technique NAME` and `KEY=VALUE` say, the latter without their dashes; later ones win.
pub fn settings<'a>(technique: &str, pairs: impl Iterator<Item = &'a str>) -> Result<Settings> {
    let pairs = pairs.map(|pair| format!("--{pair}"));
    let technique = format!("--technique={technique}");
    let parsed = Options::try_parse_from(std::iter::once(technique).chain(pairs));
    match parsed {
        Ok(options) => Ok(options.settings),
        Err(error) => {
            let text = error.render().to_string();
            // The fault and, on the next line, what there is.
            let lines = text.lines().take_while(|l| !l.is_empty()).map(str::trim);
            let fault = lines.collect::<Vec<_>>().join(" ");
            let fault = fault.strip_prefix("error: ").unwrap_or(&fault).to_owned();
            Err(Error::Option {
                option: "--techniques",
                fault,
            })
        }
    }
}

/// `a,b:cull=off,evaluate=stochastic`: techniques, each with settings of its own on top of the `common` ones. `all` stands for
/// every row of the table.
///
/// # Errors
/// [`Error::Option`] names the technique or setting that there is not, or what is named twice.
pub fn variants(list: &str, common: &str) -> Result<Vec<Variant>> {
    let mut labels: Vec<String> = Vec::new();
    for word in list.split(',').map(str::trim) {
        match labels.last_mut() {
            // A second setting of the technique before it.
            Some(last) if word.contains('=') && !word.contains(':') => *last += &format!(",{word}"),
            _ if word == "all" => labels.extend(TECHNIQUES.iter().map(|row| row.name.into())),
            _ => labels.push(word.into()),
        }
    }
    let pairs = |text: &'_ str| -> Vec<String> {
        let words = text.split(',').map(str::trim);
        words.filter(|w| !w.is_empty()).map(Into::into).collect()
    };
    let mut variants: Vec<Variant> = Vec::new();
    for label in labels {
        let (technique, own) = label.split_once(':').unwrap_or((&label, ""));
        let pairs = [pairs(common), pairs(own)].concat();
        let settings = settings(technique, pairs.iter().map(String::as_str))?;
        if variants.iter().any(|v| v.label == label) {
            let fault = format!("{label} is named twice");
            return Err(Error::Option {
                option: "--techniques",
                fault,
            });
        }
        variants.push(Variant {
            label,
            settings,
            factors: Factors::NONE,
        });
    }
    Ok(variants)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{Evaluate, Switch};

    #[test]
    fn techniques_with_settings() {
        let list = "rtpm, rtpm:cull=off,evaluate=stochastic,rtpm:alpha=0.5";
        let found = variants(list, "photons=100,alpha=0.7").unwrap();
        let labels: Vec<&str> = found.iter().map(|v| v.label.as_str()).collect();
        assert_eq!(
            labels,
            [
                "rtpm",
                "rtpm:cull=off,evaluate=stochastic",
                "rtpm:alpha=0.5"
            ]
        );
        assert_eq!(found[0].settings.technique, "rtpm");
        assert_eq!(found[0].settings.photons, Some(100));
        assert_eq!(found[1].settings.cull, Switch::Off);
        assert_eq!(found[1].settings.evaluate, Evaluate::Stochastic);
        assert_eq!(found[1].settings.alpha, 0.7);
        assert_eq!(found[2].settings.alpha, 0.5, "its own wins");
        assert_eq!(variants("all", "").unwrap().len(), TECHNIQUES.len());
    }

    #[test]
    fn faults_are_named() {
        for (list, common, word) in [
            ("magic", "", "magic"),
            ("rtpm:colour=red", "", "colour"),
            ("rtpm:alpha=2", "", "alpha"),
            ("rtpm", "alpha=x", "alpha"),
            ("rtpm,rtpm", "", "twice"),
            ("", "", "--technique "),
            ("cull=off", "", "cull=off"),
        ] {
            let fault = variants(list, common).unwrap_err().to_string();
            assert!(fault.contains(word), "{list}: {fault}");
        }
    }

    #[test]
    fn budgets() {
        assert_eq!(Budget::Seconds(4.0).used(99, 1.0), 0.25);
        assert_eq!(Budget::Iterations(4).used(1, 99.0), 0.25);
        assert_eq!(Budget::Iterations(3).times(0.1), Budget::Iterations(1));
        let shares: Vec<f64> = checkpoints().collect();
        assert_eq!((shares[0], shares[12]), (1.0 / 64.0, 1.0));
        assert!(shares.is_sorted());
    }
}
