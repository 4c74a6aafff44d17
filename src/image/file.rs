//! Files that appear whole or not at all.

use super::Format;
use crate::{Error, Result};
use std::{
    fs::{self, File, OpenOptions},
    io::{BufWriter, Error as IoError, ErrorKind, Write},
    path::{Path, PathBuf},
};
use tempfile::{Builder, NamedTempFile};

/// Finds out before a long render what would keep `path` from being written after it.
///
/// # Errors
/// The extension is neither .exr nor .png, `path` is a folder, a device or write-protected, its
/// name is too long, or no file can be created beside it.
pub fn check_output(path: &Path) -> Result<()> {
    Format::of(path)?;
    let target = target(path)?;
    match fs::metadata(&target) {
        Ok(found) if found.is_dir() => return Err(Error::image(path, "is a folder, not a file")),
        Ok(found) if !found.is_file() => return Err(Error::image(path, "is no regular file")),
        Ok(_) => {
            let opened = OpenOptions::new().append(true).open(&target);
            opened.map_err(|e| Error::io(path, e))?;
        }
        Err(_) => {}
    }
    temporary_beside(path, &target).map(drop)
}

/// Refuses to write to any of `outputs` what was read from `inputs`, links followed.
///
/// # Errors
/// An output is one of the inputs.
pub fn check_inputs_survive<'a>(
    outputs: impl IntoIterator<Item = &'a PathBuf>,
    inputs: &[&Path],
) -> Result<()> {
    let inputs: Vec<_> = inputs.iter().flat_map(|i| i.canonicalize()).collect();
    for output in outputs {
        let target = output.canonicalize();
        if target.is_ok_and(|target| inputs.contains(&target)) {
            let fault = "is read as an input and would be overwritten: choose another name";
            return Err(Error::image(output, fault));
        }
    }
    Ok(())
}

/// The file that `path` means, at the end of all symbolic links; it need not be there yet.
fn target(path: &Path) -> Result<PathBuf> {
    let mut target = path.to_owned();
    // As many as Linux follows.
    for _ in 0..40 {
        match fs::symlink_metadata(&target) {
            Ok(found) if found.is_symlink() => {
                let link = fs::read_link(&target).map_err(|e| Error::io(path, e))?;
                target = target.parent().unwrap_or(Path::new("")).join(link);
            }
            Ok(_) => return Ok(target),
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(target),
            Err(e) => return Err(Error::io(path, e)),
        }
    }
    Err(Error::image(path, "is a symbolic link that leads nowhere"))
}

/// Hands `fill` a temporary file beside `path` and renames it to `path` when all is on the disk. A
/// link goes on to lead there, and a file that is replaced leaves its permissions to the new one.
///
/// # Errors
/// Those of `fill` and of the file system; `path` is then what it was before.
pub(super) fn write_whole(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> Result<()>,
) -> Result<()> {
    let target = target(path)?;
    let file = temporary_beside(path, &target)?;
    let mut writer = BufWriter::new(file.as_file());
    fill(&mut writer)?;
    writer.flush().map_err(|e| Error::io(path, e))?;
    drop(writer);
    // Without this a crash soon after the rename can leave an empty file in the old one's place.
    file.as_file().sync_all().map_err(|e| Error::io(path, e))?;
    if let Ok(old) = fs::metadata(&target) {
        let kept = file.as_file().set_permissions(old.permissions());
        kept.map_err(|e| Error::io(path, e))?;
    }
    file.persist(target).map_err(|e| Error::io(path, e.error))?;
    Ok(())
}

fn temporary_beside(path: &Path, target: &Path) -> Result<NamedTempFile> {
    let folder = match target.parent() {
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
