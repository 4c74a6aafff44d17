//! From scene luminance to a screen: exposure, tone curve, sRGB.

use super::luminance;
use clap::ValueEnum;

/// How a PNG is made from radiance.
#[derive(Debug, Clone, Copy, PartialEq, clap::Args)]
pub struct Display {
    /// For PNG: radiance (nit) × 2^EV goes into the tone curve. `auto`: the log-average luminance
    /// of all pixels that are not black becomes 0.18, but no more than 5 % of them pass 1
    #[arg(long, value_name = "EV|auto", default_value = "auto", value_parser = parse_exposure,
          allow_negative_numbers = true)]
    pub exposure: Exposure,

    /// For PNG: how luminance beyond the screen's is shown
    #[arg(long, value_enum, default_value_t = Tone::Neutral)]
    pub tone: Tone,
}

impl Display {
    /// The exposure (EV) that linear RGB `pixels` get.
    pub fn ev(&self, pixels: &[f32]) -> f64 {
        match self.exposure {
            Exposure::Auto => auto_exposure(pixels),
            Exposure::Ev(ev) => ev,
        }
    }
}

/// The power of two that radiance (nit) is multiplied with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Exposure {
    /// [`auto_exposure`].
    Auto,
    Ev(f64),
}

/// A tone curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Tone {
    /// Khronos PBR Neutral: true colours up to 0.76, highlights roll off to white
    Neutral,
    /// No curve: clipped at 1
    Linear,
}

impl Tone {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Neutral => "neutral",
            Self::Linear => "linear",
        }
    }

    /// Display-linear RGB in [0, 1] of exposed RGB; what is no number is black.
    pub fn apply(self, rgb: [f32; 3]) -> [f32; 3] {
        // The upper bound keeps infinity out of the curve's quotients.
        let rgb = rgb.map(|x| if x > 0.0 { x.min(1e30) } else { 0.0 });
        let mapped = match self {
            Self::Neutral => neutral(rgb),
            Self::Linear => rgb,
        };
        mapped.map(|x| x.clamp(0.0, 1.0))
    }
}

/// Khronos PBR Neutral Tone Mapper (Khronos 3D Commerce 2024, `pbrNeutral.glsl`) of non-negative RGB.
pub fn neutral(rgb: [f32; 3]) -> [f32; 3] {
    const START_COMPRESSION: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    let x = rgb[0].min(rgb[1]).min(rgb[2]);
    let offset = if x < 0.08 { x - 6.25 * x * x } else { 0.04 };
    let rgb = rgb.map(|c| c - offset);

    let peak = rgb[0].max(rgb[1]).max(rgb[2]);
    if peak < START_COMPRESSION {
        return rgb;
    }
    let d = 1.0 - START_COMPRESSION;
    let new_peak = 1.0 - d * d / (peak + d - START_COMPRESSION);
    let g = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    rgb.map(|c| c * (new_peak / peak) * (1.0 - g) + new_peak * g)
}

/// The exposure (EV) that brings the log-average luminance of all pixels that are not black to 0.18
/// (Reinhard et al. 2002, §2.1), and at most 5 % of them above 1; 0 for a black image.
///
/// The log-average is taken of luminances clamped between the 5th and 95th percentile, so that
/// neither fireflies nor single faint photons move it; the second bound is for images that are
/// mostly darkness with a hint of light in it. Both are relative, so any unit of light will do.
pub fn auto_exposure(rgb: &[f32]) -> f64 {
    let mut lit: Vec<f32> = rgb
        .chunks_exact(3)
        .map(|p| luminance([p[0], p[1], p[2]]))
        .filter(|&y| y > 0.0 && y.is_finite())
        .collect();
    if lit.is_empty() {
        return 0.0;
    }
    lit.sort_unstable_by(f32::total_cmp);
    let percentile = |p: usize| f64::from(lit[(lit.len() - 1) * p / 100]);
    let (low, high) = (percentile(5), percentile(95));
    let sum: f64 = lit
        .iter()
        .map(|&y| f64::from(y).clamp(low, high).log2())
        .sum();
    let log_average = sum / lit.len() as f64;
    (0.18f64.log2() - log_average).min(-high.log2())
}

/// sRGB (IEC 61966-2-1) of display-linear `x`, both in [0, 1].
pub fn srgb(x: f32) -> f32 {
    if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    }
}

/// The same in 8 bits.
pub(super) fn srgb8(x: f32) -> u8 {
    (srgb(x) * 255.0 + 0.5) as u8
}

fn parse_exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    match text.parse() {
        Ok(ev) if (-100.0..=100.0).contains(&ev) => Ok(Exposure::Ev(ev)),
        _ => Err("expected 'auto' or a number of stops from -100 to 100".into()),
    }
}
