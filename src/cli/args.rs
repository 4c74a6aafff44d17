//! What can be typed. Ranges are checked here; clap prints the fault and exits with 2.

use super::{environment::EnvironmentArgs, load::LoadArgs, quality::Quality};
use crate::{
    bench::plan::Budget,
    image::{Display, Format},
    metrics::Metric,
    settings::Settings,
};
use clap::{
    Args, Parser, Subcommand,
    builder::{PathBufValueParser, TypedValueParser},
};
use std::{path::PathBuf, time::Duration};

/// Photon mapping on Vulkan ray tracing hardware: glTF in, converged caustics out.
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "Exit codes: 0 done, 1 failed, 2 usage, 130 interrupted."
)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a glTF scene to EXR and PNG images
    ///
    /// Stops after 60 s unless --quality, --iterations, --time or --target-error says otherwise; at whichever comes first. Ctrl-C finishes the iteration
    /// and writes the image so far; a second Ctrl-C ends at once without an image.
    Render(Box<RenderArgs>),
    /// Measure techniques side by side: error over time, time of each pass, who is ahead
    ///
    /// Writes results.json, results.csv and report.html, which opens in any browser. Ctrl-C writes what was measured so far; a second Ctrl-C ends at
    /// once without it.
    Bench(BenchArgs),
    /// Measure how far an image is from a reference
    ///
    /// Prints all metrics. relmse: mean of (x − r)² / (r² + 0.01) over pixels and channels; relmse-trimmed: without the worst
    /// 0.1 % of the pixels; mse, mae; ssim: 1 for equal images (Wang et al. 2004), of luminance as a PNG shows it; flip:
    /// HDR-FLIP (Andersson et al. 2021). Pixels that are not finite are counted and left out.
    Compare(CompareArgs),
    /// Show what a glTF file holds and what of it will not be rendered
    Info {
        /// A .gltf or .glb file
        scene: PathBuf,

        #[command(flatten)]
        load: LoadArgs,
    },
    /// Say whether this machine can render, and what to install if it cannot
    Doctor,
}

#[derive(Debug, Args)]
pub struct BenchArgs {
    /// .gltf or .glb files
    #[arg(required = true)]
    pub scenes: Vec<PathBuf>,

    /// Techniques, each with settings of its own where wanted: rtpm,rtpm:cull=off,evaluate=stochastic
    /// [default: all; with --trade: auto]
    #[arg(long, value_name = "LIST")]
    pub techniques: Option<String>,

    /// Measure what a user can trade instead: photons, radii, alpha, evaluation, rejection, culling, path length, image
    /// size and technique, each by itself around the first of --techniques; further ones of the list are measured as they are
    #[arg(long)]
    pub trade: bool,

    /// What each technique gets for each seed: a time (30s, 5m) or iterations (200i)
    #[arg(long, value_name = "TIME|Ni", default_value = "10s", value_parser = parse_budget)]
    pub budget: Budget,

    /// How often all is measured, with other random numbers; six and more make 95 % intervals
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub seeds: u64,

    /// What is taken for the truth: an .exr file, a folder with a SCENE.exr for each, or auto: a long render, kept in --cache
    #[arg(long, value_name = "FILE|FOLDER|auto", default_value = "auto")]
    pub reference: PathBuf,

    /// How long a reference is rendered [default: ten times --budget]
    #[arg(long, value_name = "TIME|Ni", value_parser = parse_budget)]
    pub reference_budget: Option<Budget>,

    /// Where references are kept [default: the user's cache folder]
    #[arg(long, value_name = "FOLDER")]
    pub cache: Option<PathBuf>,

    /// Image size (px) [default: the reference's, or 256x256]
    #[arg(long, value_name = "WxH", value_parser = crate::settings::parse_size)]
    pub size: Option<[u32; 2]>,

    /// Settings of `lightfall render` for all techniques: photons=100000,max-depth=8,camera=1
    #[arg(
        long,
        value_name = "KEY=VALUE,…",
        default_value = "",
        hide_default_value = true
    )]
    pub set: String,

    #[command(flatten)]
    pub load: LoadArgs,

    #[command(flatten)]
    pub environment: EnvironmentArgs,

    /// Leave out the measurements of culling, stochastic evaluation and radii one by one
    #[arg(long)]
    pub skip_ablation: bool,

    /// Where the report goes
    #[arg(short, long, value_name = "FOLDER")]
    pub output: PathBuf,

    /// Vulkan device, by its index or part of its name, as `lightfall doctor` lists them
    /// [default: the best]
    #[arg(long, value_name = "N|NAME")]
    pub device: Option<String>,

    /// Print nothing but errors
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct CompareArgs {
    /// An .exr image
    pub image: PathBuf,

    /// The .exr image that is taken for the truth, of the same size
    pub reference: PathBuf,

    /// What the error image shows and --fail-above judges
    #[arg(long, value_enum, default_value_t = Metric::RelMse)]
    pub metric: Metric,

    /// Where an image of the error goes: .exr holds the numbers, .png colours from black to pale yellow: flip and ssim linear
    /// from 0 to 1, others logarithmic from 0.0001 to 1 (mse and mae: of the reference's mean)
    #[arg(short, long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(image_path))]
    pub output: Option<PathBuf>,

    /// Exit with 1 if the metric (for ssim: 1 − SSIM) is above X, or a pixel is not finite
    #[arg(long, value_name = "X", value_parser = parse_limit)]
    pub fail_above: Option<f64>,

    /// Compare this layer of both, such as `caustic` [default: the beauty image]
    #[arg(
        long,
        value_name = "NAME",
        default_value = "",
        hide_default_value = true
    )]
    pub layer: String,

    /// Print one JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct RenderArgs {
    /// A .gltf or .glb file
    pub scene: PathBuf,

    /// Where the image goes, .exr (all layers, can be resumed) or .png (for looking at); may be given
    /// several times
    #[arg(short, long = "output", value_name = "FILE", required = true,
          value_parser = PathBufValueParser::new().try_map(image_path))]
    pub outputs: Vec<PathBuf>,

    /// When to stop, unless --iterations, --time or --target-error say
    #[arg(long, value_enum, default_value_t = Quality::Normal)]
    pub quality: Quality,

    /// Stop at N iterations, those of a resumed image included
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=u64::from(u32::MAX)))]
    pub iterations: Option<u64>,

    /// Stop after this long: 90, 90s, 1.5m, 2h; an iteration once begun is finished
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    pub time: Option<Duration>,

    /// Stop where the error, noise and bias together, is below E with a confidence of 95 %: the root mean square over the
    /// pixels of (x − r) / √(r² + (m / 10)²), for luminances x of r of a mean of m; 0.05 looks clean
    #[arg(long, value_name = "E", value_parser = parse_error)]
    pub target_error: Option<f64>,

    /// Go on from an .exr image of the same scene and settings
    #[arg(long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(resumable_path))]
    pub resume: Option<PathBuf>,

    /// Vulkan device, by its index or part of its name, as `lightfall doctor` lists them
    /// [default: the best]
    #[arg(long, value_name = "N|NAME")]
    pub device: Option<String>,

    #[command(flatten)]
    pub load: LoadArgs,

    #[command(flatten)]
    pub environment: EnvironmentArgs,

    #[command(flatten)]
    pub settings: Settings,

    #[command(flatten)]
    pub display: Display,

    /// Print the time that each pass took
    #[arg(long)]
    pub timings: bool,

    /// Print nothing but errors
    #[arg(long)]
    pub quiet: bool,

    /// Print one JSON object per line on stdout: start, progress about every second, end
    #[arg(long)]
    pub json: bool,

    /// Run under the Khronos validation layer; any message of it is a failure
    #[arg(long)]
    pub validate: bool,
}

fn image_path(path: PathBuf) -> Result<PathBuf, &'static str> {
    match Format::of(&path) {
        Ok(_) => Ok(path),
        Err(_) => Err("the name must end in .exr or .png"),
    }
}

fn resumable_path(path: PathBuf) -> Result<PathBuf, &'static str> {
    match Format::of(&path) {
        Ok(Format::Exr) => Ok(path),
        _ => Err("only .exr images hold all that is needed to go on"),
    }
}

fn parse_budget(text: &str) -> Result<Budget, String> {
    if let Some(number) = text.strip_suffix('i') {
        return match number.parse() {
            Ok(n) if n > 0 => Ok(Budget::Iterations(n)),
            _ => Err("expected iterations above 0, such as 200i".into()),
        };
    }
    parse_time(text).map(|time| Budget::Seconds(time.as_secs_f64()))
}

fn parse_error(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(x) if (1e-6..1.0).contains(&x) => Ok(x),
        _ => Err("expected an error from 0.000001 to below 1, such as 0.05".into()),
    }
}

fn parse_limit(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(x) if (0.0..f64::INFINITY).contains(&x) => Ok(x),
        _ => Err("expected a number from 0".into()),
    }
}

fn parse_time(text: &str) -> Result<Duration, String> {
    let (number, unit) = match text.char_indices().last() {
        Some((end, 's')) => (&text[..end], 1.0),
        Some((end, 'm')) => (&text[..end], 60.0),
        Some((end, 'h')) => (&text[..end], 3600.0),
        _ => (text, 1.0),
    };
    match number.parse::<f64>() {
        // Nobody waits for more than a year, and Duration stays far from its bounds.
        Ok(n) if n > 0.0 && n * unit <= 365.0 * 86400.0 => Ok(Duration::from_secs_f64(n * unit)),
        _ => Err("expected a time above 0, at most a year, such as 30s, 5m or 1h".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times() {
        let seconds = |text| parse_time(text).map(|t| t.as_secs_f64());
        assert_eq!(seconds("90"), Ok(90.0));
        assert_eq!(seconds("0.5s"), Ok(0.5));
        assert_eq!(seconds("1.5m"), Ok(90.0));
        assert_eq!(seconds("2h"), Ok(7200.0));
        for bad in [
            "", "s", "0", "-1s", "nan", "inf", "1e300h", "1d", "5µ", "1 h",
        ] {
            assert!(parse_time(bad).is_err(), "{bad}");
        }
    }

    /// clap's own consistency checks: no option twice, defaults within their ranges.
    #[test]
    fn command_line_is_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
        let cli = Cli::try_parse_from(["lightfall", "render", "a.glb", "-o", "a.exr"]).unwrap();
        let Command::Render(args) = cli.command else {
            panic!("not render")
        };
        assert_eq!(args.settings, Settings::default());
    }
}
