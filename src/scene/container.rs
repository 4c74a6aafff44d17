//! From bytes to JSON and buffers: the GLB container, URIs and external files.

use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::json::{Checked, Json};

/// All bytes read for one scene, together. A file list that names a large file again and again
/// cannot ask for more.
const MAX_BYTES: u64 = 8 << 30;

/// The JSON and binary chunks of a GLB file, or the whole of a `.gltf` file as JSON.
/// glTF 2.0, section 4 (GLB File Format Specification).
pub(super) fn split(bytes: &[u8]) -> Checked<(&[u8], Option<&[u8]>)> {
    if !bytes.starts_with(b"glTF") {
        let text = bytes.trim_ascii_start();
        // Anything else would fail as JSON too, but with words that puzzle the user.
        if text.first() != Some(&b'{') {
            return Err("neither a GLB nor a glTF JSON file".into());
        }
        return Ok((bytes, None));
    }
    let (version, length) = (word(bytes, 4), word(bytes, 8));
    let (Some(version), Some(length)) = (version, length) else {
        return Err("GLB: ends inside its header".into());
    };
    if version != 2 {
        return Err(format!("GLB: container version {version}, not 2"));
    }
    let body = bytes.get(12..length as usize).ok_or_else(|| {
        let here = bytes.len();
        format!("GLB: the header says {length} bytes, the file has {here}")
    })?;
    let (kind, json, rest) = chunk(body)?;
    if kind != *b"JSON" {
        return Err("GLB: the first chunk is not JSON".into());
    }
    if rest.is_empty() {
        return Ok((json, None));
    }
    let (kind, bin, _) = chunk(rest)?;
    Ok((json, (kind == *b"BIN\0").then_some(bin)))
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let bytes = bytes.get(at..)?.first_chunk()?;
    Some(u32::from_le_bytes(*bytes))
}

/// The type and data of the chunk that `bytes` begins with, and what follows.
fn chunk(bytes: &[u8]) -> Checked<([u8; 4], &[u8], &[u8])> {
    let ends = || "GLB: ends inside a chunk".to_owned();
    let length = word(bytes, 0).ok_or_else(ends)? as usize;
    let (kind, data) = bytes
        .get(4..)
        .and_then(|rest| rest.split_first_chunk::<4>())
        .ok_or_else(ends)?;
    let (data, rest) = data.split_at_checked(length).ok_or_else(ends)?;
    Ok((*kind, data, rest))
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

    /// The bytes behind the string `uri`: a data URI, or a file in the scene's own folder.
    pub fn fetch(&mut self, uri: &Json) -> Checked<Rc<[u8]>> {
        let text = uri.as_text()?;
        if let Some(data) = text.strip_prefix("data:") {
            return decode_data_uri(data).map_err(|fault| uri.fault(fault));
        }
        let relative = relative_path(text).map_err(|fault| uri.fault(fault))?;
        if let Some(bytes) = self.files.get(&relative) {
            return Ok(bytes.clone());
        }
        let bytes: Rc<[u8]> = read_file(&self.folder.join(&relative), self.bytes_left)
            .map_err(|error| uri.fault(format_args!("{}: {error}", relative.display())))?
            .into();
        self.bytes_left -= bytes.len() as u64;
        self.hasher.update(&bytes);
        self.files.insert(relative, bytes.clone());
        Ok(bytes)
    }
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

/// A URI as a path that stays inside the folder it is joined to. Symbolic links are followed: the
/// user made them, not the file.
fn relative_path(uri: &str) -> Checked<PathBuf> {
    let text = percent_decode(uri)?;
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
    Ok(text.into())
}

fn percent_decode(uri: &str) -> Checked<String> {
    let mut rest = uri.as_bytes();
    let mut decoded = Vec::with_capacity(rest.len());
    while let [first, tail @ ..] = rest {
        let digit = |i: usize| tail.get(i).and_then(|&c| char::from(c).to_digit(16));
        match (first, digit(0), digit(1)) {
            (b'%', Some(high), Some(low)) => {
                decoded.push((high * 16 + low) as u8);
                rest = &tail[2..];
            }
            _ => {
                decoded.push(*first);
                rest = tail;
            }
        }
    }
    String::from_utf8(decoded).map_err(|_| format!("{uri}: not UTF-8"))
}

/// RFC 2397, the part behind `data:`.
fn decode_data_uri(data: &str) -> Checked<Rc<[u8]>> {
    let (kind, content) = data.split_once(',').ok_or("data URI without a comma")?;
    if !kind.ends_with(";base64") {
        return Err("data URI that is not base64".into());
    }
    let mut bytes = Vec::with_capacity(content.len() / 4 * 3 + 3);
    let (mut bits, mut held) = (0u32, 0);
    for c in percent_decode(content)?.trim_end_matches('=').bytes() {
        let digit = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return Err("data URI with a character that is not base64".into()),
        };
        bits = (bits << 6) | u32::from(digit);
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held) as u8);
        }
    }
    Ok(bytes.into())
}

/// The content of every buffer, each at least as long as it says.
pub(super) fn buffers(
    root: &Json,
    bin: Option<&[u8]>,
    resources: &mut Resources,
) -> Checked<Vec<Rc<[u8]>>> {
    let mut buffers = Vec::new();
    for (i, buffer) in root.items("buffers")?.iter().enumerate() {
        let length = buffer.need("byteLength")?.as_index()?;
        let bytes: Rc<[u8]> = match (buffer.get("uri")?, bin) {
            (Some(uri), _) => resources.fetch(&uri)?,
            (None, Some(bin)) if i == 0 => bin.into(),
            // What only a decoder would fill; who reads it is told that it is empty.
            _ if buffer.extension("EXT_meshopt_compression")?.is_some() => {
                buffers.push([].into());
                continue;
            }
            _ => return Err(buffer.fault("has no uri, and there is no GLB chunk for it")),
        };
        if bytes.len() < length {
            return Err(buffer.fault(format_args!(
                "byteLength is {length}, but there are only {} bytes",
                bytes.len()
            )));
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}
