//! Files that appear whole or not at all.

use super::Format;
use crate::{Error, Result};
use std::{
    fs::File,
    io::{BufWriter, Error as IoError, ErrorKind, Write},
    path::Path,
};
use tempfile::{Builder, NamedTempFile};

/// Finds out before a long render what would keep `path` from being written after it.
///
/// # Errors
/// The extension is neither .exr nor .png, `path` is a folder, or no file can be created beside it.
pub fn check_output(path: &Path) -> Result<()> {
    Format::of(path)?;
    if path.is_dir() {
        return Err(Error::image(path, "is a folder, not a file"));
    }
    temporary_beside(path).map(drop)
}

/// Hands `fill` a temporary file beside `path` and renames it to `path` when all is on the disk.
///
/// # Errors
/// Those of `fill` and of the file system; `path` is then what it was before.
pub(super) fn write_whole(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> Result<()>,
) -> Result<()> {
    let file = temporary_beside(path)?;
    let mut writer = BufWriter::new(file.as_file());
    fill(&mut writer)?;
    writer.flush().map_err(|e| Error::io(path, e))?;
    drop(writer);
    // Without this a crash soon after the rename can leave an empty file in the old one's place.
    file.as_file().sync_all().map_err(|e| Error::io(path, e))?;
    file.persist(path).map_err(|e| Error::io(path, e.error))?;
    Ok(())
}

fn temporary_beside(path: &Path) -> Result<NamedTempFile> {
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        let fault = format!("there is no folder {}", folder.display());
        return Err(Error::io(path, IoError::new(ErrorKind::NotFound, fault)));
    }
    let mut builder = Builder::new();
    builder.prefix(".lightfall-");
    // Temporary files are private by default, but an image is for whomever the umask allows.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder).map_err(|e| Error::io(path, e))
}
