//! OpenEXR: one part, 32-bit floats, lossless. <https://openexr.com/en/latest/TechnicalIntroduction.html>

use super::{Layer, Metadata, Picture, Rgb, file::write_whole};
use crate::{Error, Result, settings::MAX_EDGE};
use exr::{
    image::write::WritableImage,
    image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer as Part, read::read},
    meta::{
        MetaData,
        attribute::{AttributeValue, Chromaticities, Text},
        header::LayerAttributes,
    },
    prelude::{Blocks, Compression, LineOrder, ReadChannels, ReadLayers, Vec2},
};
use std::{collections::HashMap, path::Path};

/// EXR sorts its channels by name; this attribute keeps the layers' own order.
const LAYERS: &str = "lightfall.layers";

/// Larger than any render (of [`MAX_EDGE`]), so that other programs' files can be read too, and
/// small enough that a broken header does not ask for all memory there is.
const MAX_PIXELS: usize = MAX_EDGE as usize * MAX_EDGE as usize;

/// Writes all layers and metadata; returns how many floats were not finite and became zero.
pub(super) fn write(path: &Path, picture: &Picture) -> Result<usize> {
    let mut nonfinite = 0;
    let mut channels = Vec::new();
    for layer in &picture.layers {
        for (i, channel) in layer.channels.iter().enumerate() {
            let samples = layer.pixels.iter().skip(i).step_by(layer.channels.len());
            let plane = samples.map(|&x| {
                nonfinite += usize::from(!x.is_finite());
                if x.is_finite() { x } else { 0.0 }
            });
            let name = channel_name(&layer.name, channel);
            channels.push(AnyChannel {
                name: text(&name),
                sample_data: FlatSamples::F32(plane.collect()),
                quantize_linearly: false,
                sampling: Vec2(1, 1),
            });
        }
    }
    let part = Part::new(
        (picture.width as usize, picture.height as usize),
        attributes(picture),
        // Of the lossless codecs, PIZ and ZIP do best on noisy floats, and ZIP reads everywhere.
        Encoding {
            compression: Compression::ZIP16,
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        },
        AnyChannels::sort(channels.into_iter().collect()),
    );
    let mut image = Image::from_layer(part);
    image.attributes.chromaticities = Some(REC_709);
    write_whole(path, |file| {
        let written = image.write().to_buffered(file);
        written.map_err(|e| fault(path, e))
    })?;
    Ok(nonfinite)
}

/// Rec. ITU-R BT.709-6, table 1, items 1.3 and 1.4.
const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.3, 0.6),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.329),
};

fn attributes(picture: &Picture) -> LayerAttributes {
    let order: Vec<_> = picture
        .layers
        .iter()
        .map(|l| format!("{}={}", l.name, l.channels.join(",")))
        .collect();
    let mut attributes = LayerAttributes {
        software_name: Some(text(&format!("lightfall {}", picture.metadata.version))),
        // The luminance [nit] of the pixel (1, 1, 1).
        white_luminance: Some(1.0),
        ..LayerAttributes::default()
    };
    let pairs = picture.metadata.pairs();
    for (name, value) in pairs.into_iter().chain([(LAYERS, order.join(";"))]) {
        let value = AttributeValue::Text(text(&value));
        attributes.other.insert(text(name), value);
    }
    attributes
}

/// Reads back what [`super::write`] wrote, bit for bit.
///
/// # Errors
/// The file cannot be read, or lightfall did not write it.
pub fn read_picture(path: &Path) -> Result<Picture> {
    let Part {
        channel_data,
        attributes,
        size,
        ..
    } = read_part(path)?;
    let get = |name: &str| match attributes.other.get(name.as_bytes()) {
        Some(AttributeValue::Text(value)) => String::from_utf8(value.as_slice().to_vec()).ok(),
        _ => None,
    };
    let missing = |name: &str| {
        let fault = format!("is not an image that lightfall can resume: no valid '{name}'");
        Error::image(path, fault)
    };
    let metadata = Metadata::from_pairs(get).map_err(missing)?;
    let order = get(LAYERS).ok_or_else(|| missing(LAYERS))?;

    let area = size.area();
    let planes = planes(path, channel_data, area)?;
    let mut layers = Vec::new();
    for entry in order.split(';').filter(|entry| !entry.is_empty()) {
        let (name, channels) = entry.split_once('=').ok_or_else(|| missing(LAYERS))?;
        let channels: Vec<String> = channels.split(',').map(Into::into).collect();
        let mut pixels = vec![0.0; area * channels.len()];
        for (i, channel) in channels.iter().enumerate() {
            let channel = channel_name(name, channel);
            let plane = planes.get(&channel).ok_or_else(|| missing(&channel))?;
            for (pixel, x) in pixels.chunks_exact_mut(channels.len()).zip(plane.iter()) {
                pixel[i] = *x;
            }
        }
        layers.push(Layer {
            name: name.into(),
            channels,
            pixels,
        });
    }
    Ok(Picture {
        width: size.0 as u32,
        height: size.1 as u32,
        layers,
        metadata,
    })
}

/// Reads R, G and B (or Y as grey) of the data window of any program's flat EXR: width, height and
/// interleaved floats, row-major from the top left.
///
/// # Errors
/// Those of [`read_layer`].
pub fn read_rgb(path: &Path) -> Result<(u32, u32, Vec<f32>)> {
    let Rgb { size, pixels } = read_layer(path, "")?;
    Ok((size[0], size[1], pixels))
}

/// Reads the channels of `layer`, the beauty image's where empty: R, G and B, else X, Y and Z, else a single
/// one as grey.
///
/// # Errors
/// The file cannot be read, or has no such channels at full resolution.
pub fn read_layer(path: &Path, layer: &str) -> Result<Rgb> {
    let Part {
        channel_data, size, ..
    } = read_part(path)?;
    let planes = planes(path, channel_data, size.area())?;
    let names = [["R", "G", "B"], ["X", "Y", "Z"], ["Y"; 3], ["Z"; 3]];
    let found = names.iter().find_map(|names| {
        let [r, g, b] = names.map(|name| planes.get(&channel_name(layer, name)));
        Some((r?, g?, b?))
    });
    let Some((r, g, b)) = found else {
        let mut names: Vec<_> = planes.into_keys().collect();
        names.sort();
        let wanted = ["R", "G", "B"].map(|name| channel_name(layer, name));
        let fault = format!(
            "has no channels {}; it has {}",
            wanted.join(", "),
            names.join(", ")
        );
        return Err(Error::image(path, fault));
    };
    let rgb = r.iter().zip(g).zip(b);
    Ok(Rgb {
        size: [size.0 as u32, size.1 as u32],
        pixels: rgb.flat_map(|((&r, &g), &b)| [r, g, b]).collect(),
    })
}

fn read_part(path: &Path) -> Result<Part<AnyChannels<FlatSamples>>> {
    let headers = MetaData::read_from_file(path, false).map_err(|e| fault(path, e))?;
    for header in &headers.headers {
        let Vec2(width, height) = header.layer_size;
        if width
            .checked_mul(height)
            .is_none_or(|area| area > MAX_PIXELS)
        {
            return Err(Error::image(
                path,
                format!("{width} x {height} pixels are too many"),
            ));
        }
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .map_err(|e| fault(path, e))?;
    Ok(image.layer_data)
}

/// The full-resolution channels by name.
fn planes(
    path: &Path,
    channels: AnyChannels<FlatSamples>,
    area: usize,
) -> Result<HashMap<String, Vec<f32>>> {
    let mut planes = HashMap::new();
    for channel in channels.list {
        // Subsampled chroma is of no use as RGB.
        if channel.sampling != Vec2(1, 1) {
            continue;
        }
        let plane = match channel.sample_data {
            FlatSamples::F32(plane) => plane,
            other => other.values_as_f32().collect(),
        };
        if plane.len() != area {
            return Err(Error::image(
                path,
                format!("channel {} is cut off", channel.name),
            ));
        }
        planes.insert(channel.name.to_string(), plane);
    }
    Ok(planes)
}

fn channel_name(layer: &str, channel: &str) -> String {
    if layer.is_empty() {
        channel.into()
    } else {
        format!("{layer}.{channel}")
    }
}

/// UTF-8, as OpenEXR's own tools print it; the crate's constructor knows Latin-1 only and panics.
fn text(string: &str) -> Text {
    Text::from_slice_unchecked(string.as_bytes())
}

fn fault(path: &Path, error: exr::error::Error) -> Error {
    match error {
        exr::error::Error::Io(e) => Error::io(path, e),
        other => Error::image(path, other.to_string()),
    }
}
