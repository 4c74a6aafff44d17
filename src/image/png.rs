//! PNG: 8-bit sRGB of the beauty layer. <https://www.w3.org/TR/png-3/>

use super::{Display, Picture, Tone, display::srgb8, file::write_whole};
use crate::{Error, Result};
use png::{BitDepth, ColorType, Encoder, EncodingError, SrgbRenderingIntent};
use std::{io::Write, path::Path};

/// Writes the beauty layer; returns how many of its floats were not finite and are shown black.
pub(super) fn write(path: &Path, picture: &Picture, display: &Display) -> Result<usize> {
    let beauty = picture.layers.iter().find(|l| l.name.is_empty());
    let Some(beauty) = beauty.filter(|l| l.channels == ["R", "G", "B"]) else {
        return Err(Error::image(
            path,
            "the picture has no layer R, G, B to show",
        ));
    };
    let ev = display.ev(&beauty.pixels);
    let (bytes, nonfinite) = develop(&beauty.pixels, ev, display.tone);
    let mut text = picture.metadata.pairs();
    text.push(("lightfall.exposure", format!("{ev} EV")));
    text.push(("lightfall.tone", display.tone.name().into()));
    text.push((
        "Software",
        format!("lightfall {}", picture.metadata.version),
    ));
    write_rgb8(path, [picture.width, picture.height], &bytes, text)?;
    Ok(nonfinite)
}

/// 8-bit sRGB of linear RGB × 2^`ev`, and how many floats were not finite and are shown black.
pub fn develop(pixels: &[f32], ev: f64, tone: Tone) -> (Vec<u8>, usize) {
    let scale = ev.exp2();
    let mut nonfinite = 0;
    let exposed = |x: &f32| {
        nonfinite += usize::from(!x.is_finite());
        match x.is_finite() {
            true => (f64::from(*x) * scale) as f32,
            false => 0.0,
        }
    };
    let mut exposed: Vec<f32> = pixels.iter().map(exposed).collect();
    let (pixels, _) = exposed.as_chunks_mut();
    for pixel in pixels.iter_mut() {
        *pixel = tone.apply(*pixel);
    }
    (exposed.into_iter().map(srgb8).collect(), nonfinite)
}

/// Writes a file of 8-bit sRGB, three bytes a pixel, whole or not at all.
///
/// # Errors
/// Those of the file system.
pub fn write_rgb8(
    path: &Path,
    size: [u32; 2],
    bytes: &[u8],
    text: Vec<(&str, String)>,
) -> Result<()> {
    write_whole(path, |file| {
        encode(file, size, bytes, text).map_err(|e| match e {
            EncodingError::IoError(e) => Error::io(path, e),
            other => Error::image(path, other.to_string()),
        })
    })
}

/// A PNG file of 8-bit sRGB, three bytes a pixel.
///
/// # Errors
/// There are not as many bytes as `size` says.
pub fn encode_rgb8(size: [u32; 2], bytes: &[u8]) -> Result<Vec<u8>> {
    let mut file = Vec::new();
    match encode(&mut file, size, bytes, Vec::new()) {
        Ok(()) => Ok(file),
        Err(e) => Err(Error::image("PNG".as_ref(), e.to_string())),
    }
}

fn encode(
    file: impl Write,
    [width, height]: [u32; 2],
    bytes: &[u8],
    text: Vec<(&str, String)>,
) -> std::result::Result<(), EncodingError> {
    let mut encoder = Encoder::new(file, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    for (keyword, text) in text {
        // tEXt is Latin-1 (PNG 3rd edition, 11.3.3.2).
        let latin1 = |c: char| if u32::from(c) < 256 { c } else { '?' };
        let text = text.chars().map(latin1).collect();
        encoder.add_text_chunk(keyword.into(), text)?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()
}
