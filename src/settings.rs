//! What a render can be asked for: plain data, its defaults, and how each option is spelled.
//!
//! The structs double as the command line's definition, so that an option, its range, its default
//! and its help text are written once.

use crate::shared::RESERVOIR_MAX;
use crate::technique::TECHNIQUES;
use clap::ValueEnum;

/// The longest image edge (px) that can be asked for.
pub const MAX_EDGE: u32 = 16384;

/// The most light paths per iteration that can be asked for.
pub const MAX_PHOTONS: u32 = 1 << 30;

/// How a scene is rendered. `None` means: chosen from the scene and the device.
#[derive(Debug, Clone, PartialEq, clap::Args)]
pub struct Settings {
    /// Image size (px), each edge 1 to 16384 [default: the camera's aspect ratio, 1024 px wide]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Camera, by its index or name in the file [default: the first]
    #[arg(long, value_name = "N|NAME")]
    pub camera: Option<String>,

    /// First radius of the global photon map, in metres, or in pixels seen from the camera: 4px
    /// [default: from the scene]
    #[arg(long, value_name = "LENGTH", value_parser = parse_length)]
    pub radius: Option<Length>,

    /// First radius of the caustic photon map, likewise [default: from the scene]
    #[arg(long, value_name = "LENGTH", value_parser = parse_length)]
    pub caustic_radius: Option<Length>,

    /// Light paths per iteration [default: from the image size and the device]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_PHOTONS)))]
    pub photons: Option<u32>,

    /// Seed of the random numbers; the same seed gives the same photons
    #[arg(long, value_name = "N", default_value_t = Settings::default().seed)]
    pub seed: u64,

    /// Edges of a path from the eye to the light at most, 1 to 64; 2 is direct light
    #[arg(long, value_name = "N", default_value_t = Settings::default().max_depth,
          value_parser = clap::value_parser!(u32).range(1..=64))]
    pub max_depth: u32,

    /// What traces the rays: the device's ray queries, its ray tracing pipelines, or lightfall's
    /// own BVH in compute shaders
    #[arg(long, value_enum, default_value_t = Settings::default().trace)]
    pub trace: Trace,

    /// How photons near a point are found; `rtpm`: as boxes hit by a ray of no length; `hash-grid`:
    /// in rows of a hashed grid; `hash-ppm`, `stochastic-hash`: in lists of a hash table, which
    /// keep a choice. `sppm`: as by `rtpm`, within each pixel's own radius. `path`: none are; paths
    /// from the eye alone
    #[arg(long, default_value_t = Settings::default().technique,
          value_parser = clap::builder::PossibleValuesParser::new(technique_names()))]
    pub technique: String,

    /// How a technique that gathers photons finds light that comes to a diffuse surface straight
    /// from a light
    #[arg(long, value_enum, default_value_t = Settings::default().direct)]
    pub direct: Direct,

    /// Store only photons that lie in a hash cell near a view sample
    #[arg(long, value_enum, default_value_t = Settings::default().cull)]
    pub cull: Switch,

    /// Begin light paths where the pilot learned that they matter; `auto`: where that is worth it
    #[arg(long, value_enum, default_value_t = Settings::default().guide)]
    pub guide: Switch,

    /// Evaluate the BSDF for every photon found, or for a few chosen by a reservoir
    #[arg(long, value_enum, default_value_t = Settings::default().evaluate)]
    pub evaluate: Evaluate,

    /// Photons that the reservoir of `--evaluate stochastic` keeps
    #[arg(long, value_name = "K", default_value_t = Settings::default().reservoir,
          value_parser = clap::value_parser!(u32).range(1..=i64::from(RESERVOIR_MAX)))]
    pub reservoir: u32,

    /// Probability of rejecting a global photon, 0 ≤ PROB < 1; those kept carry more
    #[arg(long, value_name = "PROB", default_value_t = Settings::default().reject,
          value_parser = parse_reject)]
    pub reject: f32,

    /// How slowly the radius shrinks: r² of iteration i+1 is r² of i times (i + α)/(i + 1), 0 < α <
    /// 1 (Knaus & Zwicker 2011)
    #[arg(long, default_value_t = Settings::default().alpha, value_parser = parse_alpha)]
    pub alpha: f32,

    /// Count what becomes of every light path and photon
    #[arg(long)]
    pub ledger: bool,
}

/// [`Settings::technique`] chosen by the device.
pub const AUTO: &str = "auto";

/// What [`Settings::technique`] may say.
fn technique_names() -> impl Iterator<Item = &'static str> {
    std::iter::once(AUTO).chain(TECHNIQUES.iter().map(|row| row.name))
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            size: None,
            camera: None,
            radius: None,
            caustic_radius: None,
            photons: None,
            seed: 0,
            max_depth: 12,
            trace: Trace::Auto,
            technique: AUTO.into(),
            direct: Direct::Auto,
            cull: Switch::Auto,
            guide: Switch::Auto,
            evaluate: Evaluate::Full,
            reservoir: 3,
            reject: 0.0,
            alpha: 2.0 / 3.0,
            ledger: false,
        }
    }
}

/// A length above 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Length {
    /// In metres.
    World(f32),
    /// In pixels, as seen from the camera.
    Pixels(f32),
}

/// What traces the rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Trace {
    /// On GPUs `query` or, without it, `pipeline`; else `software`
    Auto,
    /// VK_KHR_ray_query in compute shaders
    Query,
    /// VK_KHR_ray_tracing_pipeline
    Pipeline,
    /// Plain compute shaders
    Software,
}

impl Trace {
    /// Through acceleration structures that the driver builds.
    pub fn uses_structures(self) -> bool {
        matches!(self, Self::Query | Self::Pipeline)
    }

    /// The part of a shader's stem that names its variant.
    pub fn variant(self) -> &'static str {
        match self {
            Self::Query => "query",
            Self::Pipeline => "pipeline",
            Self::Software | Self::Auto => "software",
        }
    }
}

/// What brings direct light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Direct {
    /// `rays`, which were measured to err about as much or up to half as much after the same time
    Auto,
    /// Photons, as part of the global map
    Photons,
    /// Rays to the lights from what the eye sees; photons carry the rest
    Rays,
}

/// How the photons that a gather found are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Evaluate {
    /// Stochastic until full evaluation is measured to be faster; not repeatable bit for bit
    Auto,
    /// Every photon
    Full,
    /// A few, chosen by a reservoir
    Stochastic,
}

/// On, off, or whichever was measured faster.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Switch {
    /// Whichever was measured faster on this class of device
    Auto,
    On,
    Off,
}

/// `1280x720`.
pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let (w, h) = text
        .split_once(['x', 'X', '×'])
        .ok_or("expected WxH, such as 1280x720")?;
    let edge = |text: &str| match text.parse() {
        Ok(n) if (1..=MAX_EDGE).contains(&n) => Ok(n),
        _ => Err(format!(
            "each edge must be a whole number from 1 to {MAX_EDGE}"
        )),
    };
    Ok([edge(w)?, edge(h)?])
}

fn parse_length(text: &str) -> Result<Length, String> {
    let (number, length): (_, fn(f32) -> Length) = match text.strip_suffix("px") {
        Some(number) => (number, Length::Pixels),
        None => (text, Length::World),
    };
    match number.trim().parse::<f32>() {
        // Its square must be a normal number too: the density estimate divides by it.
        Ok(n) if (1e-18..=1e18).contains(&n) => Ok(length(n)),
        _ => Err("expected a length above 0, in metres (0.01) or pixels (4px)".into()),
    }
}

fn parse_reject(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(p) if (0.0..1.0).contains(&p) => Ok(p),
        _ => Err("expected a probability from 0 to below 1".into()),
    }
}

fn parse_alpha(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(a) if a > 0.0 && a < 1.0 => Ok(a),
        _ => Err("expected a number above 0 and below 1".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(parse_size("1280x720"), Ok([1280, 720]));
        assert_eq!(parse_size("1x16384"), Ok([1, 16384]));
        for bad in ["", "12", "0x1", "1x0", "16385x1", "-1x1", "1x1x1", "1.5x2"] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn lengths() {
        assert_eq!(parse_length("4px"), Ok(Length::Pixels(4.0)));
        assert_eq!(parse_length("1e-3"), Ok(Length::World(1e-3)));
        for bad in ["", "px", "0", "-1", "nan", "inf", "0px", "4 cm", "1e-30"] {
            assert!(parse_length(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn open_ranges() {
        assert_eq!(parse_reject("0"), Ok(0.0));
        assert_eq!(parse_reject("0.7"), Ok(0.7));
        for bad in ["1", "-0.1", "nan", "0.99999999"] {
            assert!(parse_reject(bad).is_err(), "{bad}");
        }
        for bad in ["0", "1", "nan", "-1", "2/3"] {
            assert!(parse_alpha(bad).is_err(), "{bad}");
        }
    }
}
