//! Pictures in and out: EXR keeps everything, PNG is for looking at.

mod display;
mod exr;
mod file;
mod hdr;
mod png;
mod resize;

pub use display::{Display, Exposure, Tone, auto_exposure, neutral, srgb};
pub use exr::{read_layer, read_picture, read_rgb};
pub use file::{check_inputs_survive, check_output};
pub use hdr::read_hdr;
pub use png::{develop, encode_rgb8, write_rgb8};
pub use resize::{reduce, resample};

use crate::{Error, Result};
use std::path::Path;

/// What a render hands over: layers of one size and where they came from.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    pub layers: Vec<Layer>,
    pub metadata: Metadata,
}

/// Three channels without a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Rgb {
    /// Width and height (px).
    pub size: [u32; 2],
    /// Linear, interleaved, row-major from the top left.
    pub pixels: Vec<f32>,
}

/// Channels that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Empty for the beauty image; otherwise the prefix of its channels' names: `albedo` gives
    /// `albedo.R`.
    pub name: String,
    /// R, G, B or X, Y, Z or Z or Y, in the order of the pixels' floats.
    pub channels: Vec<String>,
    /// Interleaved, row-major from the top left: width × height × channels floats.
    pub pixels: Vec<f32>,
}

impl Layer {
    /// A layer of interleaved `pixels`, row-major from the top left.
    pub fn new(name: &str, channels: &[&str], pixels: Vec<f32>) -> Self {
        Self {
            name: name.into(),
            channels: channels.iter().map(|&c| c.into()).collect(),
            pixels,
        }
    }
}

/// Where a picture came from; what a resumed render has to agree with.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Metadata {
    /// [`crate::scene::Scene::hash`].
    pub scene_hash: [u8; 32],
    /// One line that names everything that changes the expected image or its random numbers.
    pub settings: String,
    pub seed: u64,
    pub iterations: u64,
    /// Radii (m) after the last iteration.
    pub radius_global: f32,
    pub radius_caustic: f32,
    pub device: String,
    /// lightfall's.
    pub version: String,
    /// Time (s) spent on all iterations.
    pub seconds: f64,
    /// Where light paths began (see [`crate::guide::Guide::to_text`]); empty: as without a guide.
    pub guide: String,
}

impl Metadata {
    /// Names and values as both file formats store them. Numbers are decimal with as many digits as
    /// it takes to read back the same bits: EXR has no 64-bit integer attribute.
    fn pairs(&self) -> Vec<(&'static str, String)> {
        let hash = self.scene_hash.iter().map(|b| format!("{b:02x}")).collect();
        vec![
            ("lightfall.sceneHash", hash),
            ("lightfall.settings", self.settings.clone()),
            ("lightfall.seed", self.seed.to_string()),
            ("lightfall.iterations", self.iterations.to_string()),
            ("lightfall.radiusGlobal", self.radius_global.to_string()),
            ("lightfall.radiusCaustic", self.radius_caustic.to_string()),
            ("lightfall.device", self.device.clone()),
            ("lightfall.version", self.version.clone()),
            ("lightfall.seconds", self.seconds.to_string()),
            ("lightfall.guide", self.guide.clone()),
        ]
    }

    /// The inverse of [`Metadata::pairs`]; `Err` is the name that is missing or malformed.
    fn from_pairs(
        get: impl Fn(&'static str) -> Option<String>,
    ) -> std::result::Result<Self, &'static str> {
        fn parse<T: std::str::FromStr>(
            name: &'static str,
            text: Option<String>,
        ) -> std::result::Result<T, &'static str> {
            text.and_then(|t| t.parse().ok()).ok_or(name)
        }
        let text = |name| get(name).ok_or(name);
        let hash = text("lightfall.sceneHash")?;
        Ok(Self {
            scene_hash: parse_hash(&hash).ok_or("lightfall.sceneHash")?,
            settings: text("lightfall.settings")?,
            seed: parse("lightfall.seed", get("lightfall.seed"))?,
            iterations: parse("lightfall.iterations", get("lightfall.iterations"))?,
            radius_global: parse("lightfall.radiusGlobal", get("lightfall.radiusGlobal"))?,
            radius_caustic: parse("lightfall.radiusCaustic", get("lightfall.radiusCaustic"))?,
            device: text("lightfall.device")?,
            version: text("lightfall.version")?,
            seconds: parse("lightfall.seconds", get("lightfall.seconds"))?,
            // Older versions had none.
            guide: get("lightfall.guide").unwrap_or_default(),
        })
    }
}

fn parse_hash(hex: &str) -> Option<[u8; 32]> {
    if hex.len() != 64 || !hex.is_ascii() {
        return None;
    }
    let mut hash = [0; 32];
    for (byte, digits) in hash.iter_mut().zip(hex.as_bytes().chunks(2)) {
        *byte = u8::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()?;
    }
    Some(hash)
}

/// A picture's kind of file, from the name's extension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    Exr,
    Png,
}

impl Format {
    pub fn of(path: &Path) -> Result<Self> {
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("exr") {
            Ok(Self::Exr)
        } else if extension.eq_ignore_ascii_case("png") {
            Ok(Self::Png)
        } else {
            Err(Error::image(path, "the name must end in .exr or .png"))
        }
    }
}

/// Writes `picture` to `path` as its extension says, whole or not at all; returns how many floats
/// were NaN or infinite and are written as zero (black, for PNG).
///
/// # Errors
/// The extension is neither .exr nor .png, the layers do not fit the size, or writing failed; a
/// file that was there before is then still there.
pub fn write(path: &Path, picture: &Picture, display: &Display) -> Result<usize> {
    check_layers(path, picture)?;
    match Format::of(path)? {
        Format::Exr => exr::write(path, picture),
        Format::Png => png::write(path, picture, display),
    }
}

/// A layer that does not fit would be written as a shifted image, or not at all.
fn check_layers(path: &Path, picture: &Picture) -> Result<()> {
    let area = picture.width as usize * picture.height as usize;
    for layer in &picture.layers {
        if area == 0
            || layer.channels.is_empty()
            || layer.pixels.len() != area * layer.channels.len()
        {
            return Err(Error::image(
                path,
                format!(
                    "layer '{}' has {} floats in {} channels, which is not {} x {} pixels",
                    layer.name,
                    layer.pixels.len(),
                    layer.channels.len(),
                    picture.width,
                    picture.height,
                ),
            ));
        }
    }
    Ok(())
}

/// Rec. 709 luminance of linear RGB.
pub fn luminance(rgb: [f32; 3]) -> f32 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}
