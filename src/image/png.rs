//! PNG: 8-bit sRGB of the beauty layer. <https://www.w3.org/TR/png-3/>

use super::{Display, Exposure, Picture, auto_exposure, display::srgb8, file::write_whole};
use crate::{Error, Result};
use png::{BitDepth, ColorType, Encoder, EncodingError, SrgbRenderingIntent};
use std::{fs::File, io::BufWriter, path::Path};

/// Writes the beauty layer; returns how many of its floats were not finite and are shown black.
pub(super) fn write(path: &Path, picture: &Picture, display: &Display) -> Result<usize> {
    let beauty = picture.layers.iter().find(|l| l.name.is_empty());
    let Some(beauty) = beauty.filter(|l| l.channels == ["R", "G", "B"]) else {
        return Err(Error::image(
            path,
            "the picture has no layer R, G, B to show",
        ));
    };
    let ev = match display.exposure {
        Exposure::Auto => auto_exposure(&beauty.pixels),
        Exposure::Ev(ev) => ev,
    };
    let scale = ev.exp2();
    let mut nonfinite = 0;
    let bytes: Vec<u8> = beauty
        .pixels
        .chunks_exact(3)
        .flat_map(|pixel| {
            let exposed = [0, 1, 2].map(|i| {
                nonfinite += usize::from(!pixel[i].is_finite());
                if pixel[i].is_finite() {
                    (f64::from(pixel[i]) * scale) as f32
                } else {
                    0.0
                }
            });
            display.tone.apply(exposed).map(srgb8)
        })
        .collect();

    let mut text = picture.metadata.pairs();
    text.push(("lightfall.exposure", format!("{ev} EV")));
    text.push(("lightfall.tone", display.tone.name().into()));
    text.push((
        "Software",
        format!("lightfall {}", picture.metadata.version),
    ));
    write_whole(path, |file| {
        let encoded = encode(file, [picture.width, picture.height], &bytes, text);
        encoded.map_err(|e| match e {
            EncodingError::IoError(e) => Error::io(path, e),
            other => Error::image(path, other.to_string()),
        })
    })?;
    Ok(nonfinite)
}

fn encode(
    file: &mut BufWriter<&File>,
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
