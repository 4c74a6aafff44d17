//! From bytes to JSON and buffers: the GLB container, URIs and external files.

use std::borrow::Cow;
use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use gltf::binary::Glb;
use gltf::buffer;
use gltf::json::{Root, Value};

use super::asset::{Checked, to_usize};

/// All bytes read for one scene, together. A file list that names a large file again and again
/// cannot ask for more.
const MAX_BYTES: u64 = 8 << 30;

/// The JSON and the binary chunk of a GLB file, or the whole of a `.gltf` file as JSON.
/// glTF 2.0, section 4 (GLB File Format Specification). The crate refuses a chunk of unknown type
/// right behind the JSON, which glTF would have ignored.
pub(super) fn split(bytes: &[u8]) -> Checked<(Value, Option<Cow<'_, [u8]>>)> {
    let (json, bin) = if bytes.starts_with(b"glTF") {
        let glb = Glb::from_slice(whole(bytes)?).map_err(|error| format!("GLB: {error}"))?;
        (glb.json, glb.bin)
    } else if bytes.trim_ascii_start().starts_with(b"{") {
        (bytes.into(), None)
    } else {
        // It would fail as JSON too, but with words that puzzle the user.
        return Err("neither a GLB nor a glTF JSON file".into());
    };
    let json = serde_json::from_slice(&json).map_err(|error| format!("JSON: {error}"))?;
    Ok((json, bin))
}

/// A GLB file as long as its header says. The crate subtracts the header from that length unchecked,
/// and reads on behind it.
fn whole(bytes: &[u8]) -> Checked<&[u8]> {
    let length = bytes.get(8..).and_then(|rest| rest.first_chunk());
    let length = u32::from_le_bytes(*length.ok_or("GLB: ends inside its header")?);
    let file = bytes.get(..length as usize).filter(|file| file.len() >= 12);
    file.ok_or_else(|| {
        let here = bytes.len();
        format!("GLB: the header says {length} bytes, the file has {here}")
    })
}

/// Reads what the scene refers to and hashes it on the way.
pub(super) struct Resources {
    folder: PathBuf,
    hasher: blake3::Hasher,
    files: HashMap<PathBuf, Rc<[u8]>>,
    bytes_left: u64,
}

impl Resources {
    /// For the scene in the file `path`, which has the content `main`.
    pub fn new(path: &Path, main: &[u8]) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(main);
        Self {
            folder: path.parent().unwrap_or(Path::new("")).to_owned(),
            hasher,
            files: HashMap::new(),
            bytes_left: MAX_BYTES,
        }
    }

    /// blake3 of the scene file and of every external file, each once, in the order of reference.
    pub fn hash(&self) -> [u8; 32] {
        *self.hasher.finalize().as_bytes()
    }

    /// The bytes behind `uri`: a data URI, or a file in the scene's own folder.
    pub fn fetch(&mut self, uri: &str) -> Checked<Rc<[u8]>> {
        if uri.starts_with("data:") {
            // Without a folder the crate reads no file. It pads the data to a multiple of four.
            let data = buffer::Data::from_source(buffer::Source::Uri(uri), None);
            return Ok(data.map_err(|error| format!("data URI: {error}"))?.0.into());
        }
        let relative = relative_path(uri)?;
        if let Some(bytes) = self.files.get(&relative) {
            return Ok(bytes.clone());
        }
        let bytes: Rc<[u8]> = read_within(&self.folder, &relative, self.bytes_left)
            .map_err(|error| format!("{}: {error}", relative.display()))?
            .into();
        self.bytes_left -= bytes.len() as u64;
        self.hasher.update(&bytes);
        self.files.insert(relative, bytes.clone());
        Ok(bytes)
    }
}

/// Reads a file that lies in `folder`, symbolic links followed: an archive can hold those too.
fn read_within(folder: &Path, relative: &Path, limit: u64) -> std::io::Result<Vec<u8>> {
    let folder = match folder == Path::new("") {
        true => Path::new("."),
        false => folder,
    };
    let path = folder.join(relative).canonicalize()?;
    if !path.starts_with(folder.canonicalize()?) {
        let fault = "a symbolic link leads out of the scene's folder; put the file itself there";
        return Err(std::io::Error::other(fault));
    }
    read_file(&path, limit)
}

/// Reads a regular file of at most `limit` bytes: a pipe or a device could keep us for ever.
fn read_file(path: &Path, limit: u64) -> std::io::Result<Vec<u8>> {
    let fault = |text: &str| Err(std::io::Error::other(text));
    if !std::fs::metadata(path)?.is_file() {
        return fault("not a regular file");
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(limit + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        return fault("the scene's files together are larger than 8 GiB");
    }
    Ok(bytes)
}

/// Reads the scene file itself, within the same limit.
pub(super) fn read_main(path: &Path) -> std::io::Result<Vec<u8>> {
    read_file(path, MAX_BYTES)
}

/// A URI as a path that stays inside the folder it is joined to, but for symbolic links.
fn relative_path(uri: &str) -> Checked<PathBuf> {
    let text = urlencoding::decode(uri).map_err(|_| format!("{uri}: not UTF-8"))?;
    let scheme = text.split_once(':').is_some_and(|(scheme, _)| {
        let mut letters = scheme.chars();
        letters.next().is_some_and(|c| c.is_ascii_alphabetic())
            && letters.all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    });
    if scheme {
        return Err(format!(
            "{uri}: only files beside the scene are read; download it and refer to it by name"
        ));
    }
    let mut depth = 0;
    for part in text.split(['/', '\\']) {
        depth += match part {
            ".." => -1,
            "." => 0,
            _ => 1,
        };
        if depth < 0 {
            break;
        }
    }
    if depth < 0 || text.starts_with(['/', '\\']) {
        return Err(format!("{uri}: leads out of the scene's folder"));
    }
    if text.is_empty() || text.contains('\0') {
        return Err(format!("{uri:?}: not a file name"));
    }
    Ok(text.into_owned().into())
}

/// The content of every buffer, each at least as long as it says.
pub(super) fn buffers(
    root: &Root,
    bin: Option<&[u8]>,
    resources: &mut Resources,
) -> Checked<Vec<Rc<[u8]>>> {
    let mut buffers = Vec::new();
    for (i, buffer) in root.buffers.iter().enumerate() {
        let length = to_usize(buffer.byte_length);
        let extensions = buffer.extensions.as_ref();
        let bytes: Rc<[u8]> = match (&buffer.uri, bin) {
            (Some(uri), _) => resources
                .fetch(uri)
                .map_err(|fault| format!("/buffers/{i}/uri: {fault}"))?,
            (None, Some(bin)) if i == 0 => bin.into(),
            // What only a decoder would fill; who reads it is told that it is empty.
            _ if extensions.is_some_and(|e| e.others.contains_key("EXT_meshopt_compression")) => {
                buffers.push([].into());
                continue;
            }
            _ => {
                return Err(format!(
                    "/buffers/{i}: has no uri, and there is no GLB chunk for it"
                ));
            }
        };
        if bytes.len() < length {
            return Err(format!(
                "/buffers/{i}: byteLength is {length}, but there are only {} bytes",
                bytes.len()
            ));
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}
