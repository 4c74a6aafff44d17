//! The pictures of a scene and their errors.

use super::{escape, number};
use crate::Result;
use crate::bench::SceneResults;
use crate::bench::standing::of;
use crate::image::{Rgb, Tone, auto_exposure, develop, encode_rgb8};
use crate::metrics::{Metric, Pair};
use std::fmt::Write;

/// Pictures wider than this (px) are shrunk, or the page becomes too large to send.
const PICTURE: usize = 512;

pub fn section(page: &mut String, scene: &SceneResults, labels: &[&str]) -> Result<()> {
    let reference = &scene.reference.image;
    let ev = auto_exposure(&reference.pixels);
    *page += "<h3>Pictures</h3>\n<div class=\"pictures\">\n";
    let shown = |image: &Rgb| -> Result<String> {
        let small = shrink(image);
        picture(small.size, &develop(&small.pixels, ev, Tone::Neutral).0)
    };
    let _ = writeln!(
        page,
        "<figure><img alt=\"reference\" src=\"{}\"><figcaption>reference</figcaption></figure>",
        shown(reference)?
    );
    for (v, label) in labels.iter().enumerate() {
        let Some(track) = of(&scene.tracks, v).next() else {
            continue;
        };
        let label = escape(label);
        let end = track.checkpoints.last().map_or(0.0, |c| c.seconds);
        let _ = writeln!(
            page,
            "<figure><img alt=\"{label}\" src=\"{}\"><figcaption>{label}, {} s, {} iterations</figcaption></figure>",
            shown(&track.image)?,
            number(end),
            track.iterations()
        );
        let Ok(pair) = Pair::new(&shrink(&track.image), &shrink(reference)) else {
            continue;
        };
        let map = pair.measure(Metric::RelMse).map;
        let bytes = Metric::RelMse.picture(&map, reference);
        let _ = writeln!(
            page,
            "<figure><img alt=\"error of {label}\" src=\"{}\"><figcaption>its relMSE</figcaption></figure>",
            picture(shrink(reference).size, &bytes)?
        );
    }
    *page += "</div>\n<div class=\"scale\"></div><p><span>0.0001</span><span>0.01</span><span>1 relMSE</span></p>\n";
    Ok(())
}

fn picture(size: [u32; 2], bytes: &[u8]) -> Result<String> {
    Ok(format!(
        "data:image/png;base64,{}",
        base64(&encode_rgb8(size, bytes)?)
    ))
}

/// By whole factors, so that the widest edge is at most [`PICTURE`]; a pixel is the mean of those that it stands for.
fn shrink(image: &Rgb) -> Rgb {
    let [width, height] = image.size.map(|n| n as usize);
    let factor = width.max(height).div_ceil(PICTURE).max(1);
    let (small_width, small_height) = ((width / factor).max(1), (height / factor).max(1));
    let mut pixels = Vec::with_capacity(small_width * small_height * 3);
    for y in 0..small_height {
        for x in 0..small_width {
            for c in 0..3 {
                let rows = (y * factor..(y + 1) * factor).map(|y| y * width);
                let values = rows
                    .flat_map(|row| (x * factor..(x + 1) * factor).map(move |x| (row + x) * 3 + c));
                let sum: f32 = values.filter_map(|i| image.pixels.get(i)).sum();
                pixels.push(sum / (factor * factor) as f32);
            }
        }
    }
    Rgb {
        size: [small_width as u32, small_height as u32],
        pixels,
    }
}

/// RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let word =
            chunk.iter().fold(0u32, |w, b| w << 8 | u32::from(*b)) << (8 * (3 - chunk.len()));
        for i in 0..4 {
            let sextet = (word >> (18 - 6 * i) & 63) as usize;
            text.push(if i <= chunk.len() {
                char::from(ALPHABET[sextet])
            } else {
                '='
            });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_shrink_by_whole_factors() {
        let image = |size: [u32; 2]| Rgb {
            size,
            pixels: (0..size[0] * size[1] * 3)
                .map(|i| (i / 3 % size[0]) as f32)
                .collect(),
        };
        let same = image([512, 3]);
        assert_eq!(shrink(&same), same);
        let small = shrink(&image([1025, 6]));
        assert_eq!(small.size, [341, 2]);
        assert_eq!(small.pixels[..6], [1.0, 1.0, 1.0, 4.0, 4.0, 4.0]);
        assert_eq!(shrink(&image([2000, 1])).size, [500, 1]);
    }

    /// RFC 4648, section 10.
    #[test]
    fn base64_of_the_standard() {
        for (text, code) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
        ] {
            assert_eq!(base64(text.as_bytes()), code);
        }
    }
}
