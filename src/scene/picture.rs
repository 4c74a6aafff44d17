//! Image files, decoded within limits.

use std::io::Cursor;

use image::{DynamicImage, GrayImage, ImageDecoder, ImageReader, Limits, RgbImage};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::asset::Checked;
use super::{Image, dds, ktx2};

/// Texels a side; what every Vulkan device with ray tracing offers.
const MAX_SIDE: u32 = 16384;
/// Bytes of one decoded image, and of all images of a scene together.
pub(super) const MAX_IMAGE_BYTES: u64 = 512 << 20;
pub(super) const MAX_IMAGES_BYTES: u64 = 4 << 30;

/// An image, and what is wrong with it where it was read all the same.
pub(super) type Decoded = (Image, Option<String>);

/// Decodes an image file, whatever it calls itself, of which `bytes_left` may be kept.
pub(super) fn decode(bytes: &[u8], bytes_left: u64) -> Checked<Decoded> {
    if bytes.starts_with(b"\xff\xd8\xff") {
        // The lenient decoder fills with grey what it cannot read, and does not say so.
        return match jpeg(bytes, bytes_left) {
            Ok(image) => Ok((image, None)),
            Err(fault) => Ok((lenient(bytes, bytes_left)?, Some(fault))),
        };
    }
    let image = if bytes.starts_with(ktx2::MAGIC) {
        ktx2::decode(bytes, bytes_left)?
    } else if bytes.starts_with(dds::MAGIC) {
        dds::decode(bytes, bytes_left)?
    } else {
        lenient(bytes, bytes_left)?
    };
    Ok((image, None))
}

/// Refuses a size in texels that the renderer cannot hold: what a header claims costs nothing.
pub(super) fn check_size(width: u32, height: u32, bytes_left: u64) -> Checked<()> {
    if width == 0 || height == 0 {
        return Err("has no texels".into());
    }
    let size = u64::from(width) * u64::from(height) * 4;
    if width > MAX_SIDE || height > MAX_SIDE || size > MAX_IMAGE_BYTES.min(bytes_left) {
        return Err(format!(
            "{width} × {height} texels are too many: at most {MAX_SIDE} a side, {} MiB an image, \
             {} MiB in all",
            MAX_IMAGE_BYTES >> 20,
            MAX_IMAGES_BYTES >> 20
        ));
    }
    Ok(())
}

/// A JPEG that is whole.
fn jpeg(bytes: &[u8], bytes_left: u64) -> Checked<Image> {
    let words = |error| format!("{error:?}");
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(MAX_SIDE as usize)
        .set_max_height(MAX_SIDE as usize);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(words)?;
    let (width, height) = decoder.dimensions().ok_or("has no size")?;
    let (width, height) = (width as u32, height as u32);
    check_size(width, height, bytes_left)?;
    let grey = decoder.input_colorspace() == Some(ColorSpace::Luma);
    let space = if grey {
        ColorSpace::Luma
    } else {
        ColorSpace::RGB
    };
    decoder.set_options(decoder.options().jpeg_set_out_colorspace(space));
    let texels = decoder.decode().map_err(words)?;
    if !bytes.windows(2).rev().any(|end| end == b"\xff\xd9") {
        return Err("it ends before its end marker".into());
    }
    let image = match grey {
        true => GrayImage::from_raw(width, height, texels).map(DynamicImage::from),
        false => RgbImage::from_raw(width, height, texels).map(DynamicImage::from),
    };
    image.map(flat).ok_or("has too few texels".into())
}

/// Any format of the image crate.
fn lenient(bytes: &[u8], bytes_left: u64) -> Checked<Image> {
    let words = |error: image::ImageError| error.to_string();
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| error.to_string())?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_IMAGE_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(words)?;
    let (width, height) = decoder.dimensions();
    // As RGBA it may be larger than what the decoder's own limit counts.
    check_size(width, height, bytes_left)?;
    Ok(flat(DynamicImage::from_decoder(decoder).map_err(words)?))
}

fn flat(image: DynamicImage) -> Image {
    let (width, height) = (image.width(), image.height());
    Image {
        width,
        height,
        rgba: image.into_rgba8().into_raw(),
    }
}
