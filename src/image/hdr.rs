//! Radiance pictures (.hdr, .pic), reading only.
//!
//! Their header is read as its author has it (Ward, *Real Pixels*, 1991, and the Radiance reference
//! manual, "File Formats"); the pixels are left to the image crate, which knows one orientation
//! only and asks for one of the signatures that are in use.

use super::Rgb;
use crate::{Error, Result};
use ::image::{DynamicImage, ImageDecoder, codecs::hdr::HdrDecoder};
use glam::{Mat3, Vec2, Vec3};
use std::path::Path;

/// The most pixels; a broken header must not ask for all memory there is.
const MAX_PIXELS: u64 = 16384 * 8192;

/// What a header says.
#[derive(Debug, Clone, PartialEq)]
struct Header {
    /// The file's pixels are the scene's times this, for each channel.
    scale: Vec3,
    /// From the file's colours.
    rec709: Option<Mat3>,
    /// How many scanlines there are, and how many pixels each has.
    scanlines: [u32; 2],
    /// Scanlines are columns.
    columns: bool,
    /// The first scanline is the lowest or the rightmost; pixels run upwards or to the left.
    reversed: [bool; 2],
}

/// Reads a Radiance file: linear Rec. 709, in the units in which it was rendered or measured.
///
/// # Errors
/// The file cannot be read, or is no Radiance picture.
pub fn read_hdr(path: &Path) -> Result<Rgb> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    let fault = |text: String| Error::image(path, text);
    let (header, pixels) = parse(&bytes).map_err(fault)?;
    let [lines, length] = header.scanlines;
    let plain = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {lines} +X {length}\n");
    let plain = [plain.as_bytes(), pixels].concat();
    let decoder = HdrDecoder::new(plain.as_slice()).map_err(|e| fault(e.to_string()))?;
    debug_assert_eq!(decoder.dimensions(), (length, lines));
    let image = DynamicImage::from_decoder(decoder).map_err(|e| fault(e.to_string()))?;
    Ok(upright(&header, &image.into_rgb32f().into_raw()))
}

/// The picture as it is to be seen, in the scene's radiance.
fn upright(header: &Header, pixels: &[f32]) -> Rgb {
    let [lines, length] = header.scanlines.map(|n| n as usize);
    let size = if header.columns {
        [lines, length]
    } else {
        [length, lines]
    };
    let mut picture = vec![0.0; pixels.len()];
    let flip = |i: usize, n: usize, reversed: bool| if reversed { n - 1 - i } else { i };
    for (i, pixel) in pixels.chunks_exact(3).enumerate() {
        let line = flip(i / length, lines, header.reversed[0]);
        let along = flip(i % length, length, header.reversed[1]);
        let [x, y] = if header.columns {
            [line, along]
        } else {
            [along, line]
        };
        let color = Vec3::from_slice(pixel) / header.scale;
        let color = header.rec709.map_or(color, |matrix| matrix * color);
        let at = 3 * (y * size[0] + x);
        picture[at..at + 3].copy_from_slice(&color.to_array());
    }
    Rgb {
        size: size.map(|n| n as u32),
        pixels: picture,
    }
}

/// The header, and the pixels behind it.
fn parse(bytes: &[u8]) -> std::result::Result<(Header, &[u8]), String> {
    // Radiance itself writes RADIANCE, HDRShop and Photoshop RGBE.
    if !bytes.starts_with(b"#?") {
        return Err("is no Radiance picture: it must begin with #?RADIANCE or #?RGBE".into());
    }
    let mut rest = bytes;
    let mut line = || {
        let end = rest.iter().position(|&b| b == b'\n')?;
        let line = String::from_utf8_lossy(&rest[..end]).into_owned();
        rest = &rest[end + 1..];
        Some(line.trim_end().to_owned())
    };
    let mut scale = Vec3::ONE;
    let mut primaries = None;
    let mut is_xyz = false;
    loop {
        let line = line().ok_or("ends inside its header")?;
        if line.is_empty() {
            break;
        }
        // Indented lines are of pictures that this one was made from.
        let Some((name, value)) = line.split_once('=') else {
            continue;
        };
        let numbers = || numbers(value).ok_or_else(|| format!("{line}: not a number"));
        match name {
            // Each program that changed the exposure added a line.
            "EXPOSURE" => scale *= numbers()?.first().copied().unwrap_or(1.0),
            "COLORCORR" => match numbers()?[..] {
                [r, g, b] => scale *= Vec3::new(r, g, b),
                _ => return Err(format!("{line}: must be three numbers")),
            },
            "PRIMARIES" => primaries = Some(numbers()?),
            "FORMAT" => match value.trim() {
                "32-bit_rle_rgbe" => is_xyz = false,
                "32-bit_rle_xyze" => is_xyz = true,
                other => return Err(format!("FORMAT {other} is none of Radiance")),
            },
            _ => {}
        }
    }
    let usable = |x: f32| x.is_normal() && x > 0.0;
    if !scale.to_array().into_iter().all(usable) {
        return Err("EXPOSURE and COLORCORR must be above 0".into());
    }
    let rec709 = match (is_xyz, primaries) {
        // Radiance's white is that of equal energy.
        (true, _) => Some(rec709_from_xyz(Vec3::ONE)),
        (false, Some(primaries)) => Some(
            rec709_from(&primaries)
                .ok_or("PRIMARIES must be four points of the chromaticity chart")?,
        ),
        (false, None) => None,
    };
    let resolution = line().ok_or("ends before its resolution")?;
    let header = Header {
        scale,
        rec709,
        ..oriented(&resolution).ok_or_else(|| format!("{resolution}: is no resolution"))?
    };
    let [lines, length] = header.scanlines;
    if u64::from(lines) * u64::from(length) > MAX_PIXELS {
        return Err(format!("{lines} x {length} pixels are too many"));
    }
    Ok((header, rest))
}

fn numbers(text: &str) -> Option<Vec<f32>> {
    text.split_whitespace().map(|n| n.parse().ok()).collect()
}

/// A resolution line: `-Y 512 +X 1024` where scanlines run from the top, pixels from the left.
fn oriented(line: &str) -> Option<Header> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [first, lines, second, length] = words[..] else {
        return None;
    };
    let (columns, reversed) = match (first, second) {
        ("-Y" | "+Y", "+X" | "-X") => (false, [first == "+Y", second == "-X"]),
        ("-X" | "+X", "+Y" | "-Y") => (true, [first == "-X", second == "+Y"]),
        _ => return None,
    };
    let scanlines = [lines.parse().ok()?, length.parse().ok()?];
    (!scanlines.contains(&0)).then_some(Header {
        scale: Vec3::ONE,
        rec709: None,
        scanlines,
        columns,
        reversed,
    })
}

/// Rec. 709 from colours of other primaries; white stays white.
fn rec709_from(primaries: &[f32]) -> Option<Mat3> {
    let &[rx, ry, gx, gy, bx, by, wx, wy] = primaries else {
        return None;
    };
    let xyz = |x: f32, y: f32| (y != 0.0).then(|| Vec3::new(x / y, 1.0, (1.0 - x - y) / y));
    let columns = Mat3::from_cols(xyz(rx, ry)?, xyz(gx, gy)?, xyz(bx, by)?);
    if columns.determinant().abs() < 1e-6 {
        return None;
    }
    let white = xyz(wx, wy)?;
    let matrix = columns * Mat3::from_diagonal(columns.inverse() * white);
    let matrix = rec709_from_xyz(white) * matrix;
    matrix.is_finite().then_some(matrix)
}

/// Rec. 709 from XYZ with the white point `white`, adapted to that of Rec. 709 (Bradford).
fn rec709_from_xyz(white: Vec3) -> Mat3 {
    let d65 = Vec2::new(0.3127, 0.3290);
    let d65 = Vec3::new(d65.x / d65.y, 1.0, (1.0 - d65.x - d65.y) / d65.y);
    let cones = Mat3::from_cols_array_2d(&[
        [0.8951, -0.7502, 0.0389],
        [0.2664, 1.7135, -0.0685],
        [-0.1614, 0.0367, 1.0296],
    ]);
    let gain = (cones * d65) / (cones * white);
    let rec709 = Mat3::from_cols_array_2d(&[
        [3.240_97, -0.969_244, 0.055_630],
        [-1.537_383, 1.875_967, -0.203_977],
        [-0.498_611, 0.041_555, 1.056_972],
    ]);
    rec709 * cones.inverse() * Mat3::from_diagonal(gain) * cones
}
