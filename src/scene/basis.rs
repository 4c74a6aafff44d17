//! KHR_texture_basisu: KTX2 files of Basis Universal, ETC1S or UASTC.

use basisu::{DecodeFlags, Error, TargetFormat, Transcoder};

use super::Image;
use super::asset::Checked;
use super::guard::guarded;
use super::picture::{MAX_IMAGE_BYTES, check_size};

pub(super) const MAGIC: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// The largest level of the file; the renderer makes no use of smaller ones.
pub(super) fn decode(bytes: &[u8], bytes_left: u64) -> Checked<Image> {
    // KTX 2.0, section 3: the size and the first of the levels, seen before anything is decoded.
    let word = |at: usize| {
        let word = bytes.get(at..).and_then(|rest| rest.first_chunk());
        let word = word.ok_or("KTX2: ends inside its header");
        word.map(|word| u32::from_le_bytes(*word))
    };
    let (width, height) = (word(20)?, word(24)?);
    check_size(width, height, bytes_left)?;
    let uncompressed = u64::from(word(96)?) | u64::from(word(100)?) << 32;
    if uncompressed > MAX_IMAGE_BYTES {
        return Err(format!(
            "KTX2: a level of {uncompressed} bytes is too large"
        ));
    }
    let rgba = guarded(|| {
        let words = |error| match error {
            Error::InvalidData => {
                "KTX2: is damaged, or not of Basis Universal (ETC1S or UASTC); convert the file: \
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
    })?;
    Ok(Image {
        width,
        height,
        rgba,
    })
}
