//! KHR_texture_basisu: KTX2 files of Basis Universal, ETC1S or UASTC; and those of plain texels or
//! of Direct3D's blocks, which the extension does not allow and other viewers read.

use std::io::Read;

use basisu::{DecodeFlags, Error, TargetFormat, Transcoder};

use super::Image;
use super::asset::Checked;
use super::guard::guarded;
use super::picture::{MAX_IMAGE_BYTES, check_size};
use super::texels::{BC1, BC2, BC3, BC4, BC5, BC7, BGRA, GREY, Layout, RG, RGB, RGBA};

pub(super) const MAGIC: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// The largest level of the file; the renderer makes no use of smaller ones.
pub(super) fn decode(bytes: &[u8], bytes_left: u64) -> Checked<Image> {
    // KTX 2.0, section 3: the size and the first of the levels, seen before anything is decoded.
    let word = |at: usize| {
        let word = bytes.get(at..).and_then(|rest| rest.first_chunk());
        let word = word.ok_or("KTX2: ends inside its header")?;
        Checked::Ok(u32::from_le_bytes(*word))
    };
    let long = |at| Checked::Ok(u64::from(word(at)?) | (u64::from(word(at + 4)?) << 32));
    let (width, height) = (word(20)?, word(24)?);
    check_size(width, height, bytes_left)?;
    let (start, length, uncompressed) = (long(80)?, long(88)?, long(96)?);
    if uncompressed > MAX_IMAGE_BYTES {
        return Err(format!(
            "KTX2: a level of {uncompressed} bytes is too large"
        ));
    }
    if let Some(layout) = layout(word(12)?) {
        let end = start.saturating_add(length);
        let level = usize::try_from(start).ok().zip(usize::try_from(end).ok());
        let level = level.and_then(|(start, end)| bytes.get(start..end));
        let level = level.ok_or("KTX2: ends before its texels")?;
        let image = guarded(|| plain(layout, width, height, level, word(44)?));
        return image.map_err(|fault| format!("KTX2: {fault}"));
    }
    let rgba = guarded(|| basis(bytes))?;
    Ok(Image {
        width,
        height,
        rgba,
    })
}

fn basis(bytes: &[u8]) -> Checked<Vec<u8>> {
    let words = |error| match error {
        Error::InvalidData => {
            "KTX2: is damaged, or of a format that is not read; convert the file: \
             npx @gltf-transform/cli ktxdecompress in.glb out.glb, which needs the program \
             ktx of KTX-Software"
                .into()
        }
        // So it calls a level that ends too early.
        Error::UnsupportedFeature(_) => String::from("KTX2: is damaged"),
        other => format!("KTX2: {other:?}"),
    };
    let transcoder = Transcoder::new(bytes).map_err(words)?;
    let texels = transcoder.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE);
    texels.map_err(words)
}

/// A level of texels or blocks, as it is or by Zstandard.
fn plain(layout: Layout, width: u32, height: u32, level: &[u8], scheme: u32) -> Checked<Image> {
    match scheme {
        0 => layout.image(width, height, level),
        2 => {
            let words = |error: &dyn std::fmt::Display| format!("Zstandard: {error}");
            let mut decoder =
                ruzstd::StreamingDecoder::new(level).map_err(|error| words(&error))?;
            let mut texels = vec![0; layout.size(width, height)];
            let read = decoder.read_exact(&mut texels);
            read.map_err(|error| words(&error))?;
            layout.image(width, height, &texels)
        }
        _ => Err(format!("supercompression scheme {scheme} is not read")),
    }
}

/// Of a VkFormat. Whether colours are sRGB hangs on what the texture is for.
fn layout(format: u32) -> Option<Layout> {
    Some(match format {
        9 | 15 => GREY,
        16 | 22 => RG,
        23 | 29 => RGB,
        37 | 43 => RGBA,
        44 | 50 => BGRA,
        131..=134 => BC1,
        135 | 136 => BC2,
        137 | 138 => BC3,
        139 => BC4,
        141 => BC5,
        145 | 146 => BC7,
        _ => return None,
    })
}
