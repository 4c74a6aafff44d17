//! Radiance RGBE (Ward 1991), reading only.

use super::Rgb;
use crate::{Error, Result};
use ::image::{ImageReader, error::ImageError};
use std::path::Path;

/// Reads an .hdr file: linear RGB.
///
/// # Errors
/// The file cannot be read, or is no image.
pub fn read_hdr(path: &Path) -> Result<Rgb> {
    let file = ImageReader::open(path).map_err(|e| Error::io(path, e))?;
    let mut file = file.with_guessed_format().map_err(|e| Error::io(path, e))?;
    // A map of 16384 × 8192 floats; a broken header must not ask for all memory there is.
    let mut limits = ::image::Limits::default();
    limits.max_alloc = Some(16384 * 8192 * 12);
    file.limits(limits);
    let image = file.decode().map_err(|error| match error {
        ImageError::IoError(e) if e.kind() != std::io::ErrorKind::UnexpectedEof => {
            Error::io(path, e)
        }
        other => Error::image(path, other.to_string()),
    })?;
    let image = image.into_rgb32f();
    let (width, height) = image.dimensions();
    Ok(Rgb {
        size: [width, height],
        pixels: image.into_raw(),
    })
}
