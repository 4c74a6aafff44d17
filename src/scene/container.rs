//! From bytes to JSON and buffers.

use std::borrow::Cow;
use std::rc::Rc;

use gltf::json::{Root, Value};

use super::asset::{Checked, to_usize};
use super::meshopt;
use super::resources::Resources;
use super::warnings::Warnings;

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// The JSON and the binary chunk of a GLB file, or the whole of a `.gltf` file as JSON.
pub(super) fn split<'a>(
    bytes: &'a [u8],
    warnings: &mut Warnings,
) -> Checked<(Value, Option<&'a [u8]>)> {
    let text = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    let (json, bin) = if bytes.starts_with(b"glTF") {
        glb(bytes, warnings)?
    } else if text.trim_ascii_start().starts_with(b"{") {
        (bytes, None)
    } else {
        // It would fail as JSON too, but with words that puzzle the user.
        return Err("neither a GLB nor a glTF JSON file".into());
    };
    let json = plain_json(json, warnings);
    let json = serde_json::from_slice(&json).map_err(|error| format!("JSON: {error}"))?;
    Ok((json, bin))
}

/// JSON without what exporters put around it, and UTF-8 throughout.
fn plain_json<'a>(json: &'a [u8], warnings: &mut Warnings) -> Cow<'a, [u8]> {
    let mut text = json;
    if let Some(rest) = text.strip_prefix(BYTE_ORDER_MARK) {
        warnings.breach("JSON", "begins with a byte order mark");
        text = rest;
    }
    let end = text.iter().rposition(|&byte| byte != 0);
    let end = end.map_or(0, |last| last + 1);
    if end < text.len() {
        warnings.breach("JSON", "is padded with NUL");
        text = &text[..end];
    }
    match String::from_utf8_lossy(text) {
        Cow::Borrowed(text) => Cow::Borrowed(text.as_bytes()),
        Cow::Owned(text) => {
            warnings.breach("JSON", "is not UTF-8: what is not is replaced by �");
            Cow::Owned(text.into_bytes())
        }
    }
}

/// The first two chunks of a GLB file: JSON, and BIN where it is the second. Those of unknown type
/// are ignored, as glTF 2.0, section 4.4, has it; so is what follows the length in the header.
fn glb<'a>(file: &'a [u8], warnings: &mut Warnings) -> Checked<(&'a [u8], Option<&'a [u8]>)> {
    let word = |at: usize| {
        let word = file.get(at..).and_then(|rest| rest.first_chunk());
        word.map(|word| u32::from_le_bytes(*word))
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err("GLB: ends inside its header".into());
    };
    if version != 2 {
        return Err(format!("GLB: version {version} is not supported, only 2"));
    }
    let whole = file.get(..length as usize).filter(|file| file.len() >= 12);
    let whole = whole.ok_or_else(|| {
        let here = file.len();
        format!("GLB: the header says {length} bytes, the file has {here}")
    })?;
    let mut rest = &whole[12..];
    let (kind, json) = chunk(&mut rest, warnings)?.ok_or("GLB: has no JSON chunk")?;
    if kind != b"JSON" {
        return Err("GLB: its first chunk is not JSON".into());
    }
    let second = chunk(&mut rest, warnings)?;
    let bin = second.filter(|(kind, _)| *kind == b"BIN\0");
    Ok((json, bin.map(|(_, bytes)| bytes)))
}

/// Takes a chunk off the front of `rest`: its type and its content; `None` at the end.
fn chunk<'a>(
    rest: &mut &'a [u8],
    warnings: &mut Warnings,
) -> Checked<Option<(&'a [u8], &'a [u8])>> {
    let Some((length, after)) = rest.split_first_chunk::<4>() else {
        return Ok(None);
    };
    let length = u32::from_le_bytes(*length) as usize;
    let Some((kind, after)) = after.split_at_checked(4) else {
        return Ok(None);
    };
    let Some((content, after)) = after.split_at_checked(length) else {
        return Err(format!(
            "GLB: a chunk of {length} bytes leaves the file: {} are left",
            after.len()
        ));
    };
    if !length.is_multiple_of(4) {
        warnings.breach("GLB", "a chunk is not padded to a multiple of 4 bytes");
    }
    *rest = after;
    Ok(Some((kind, content)))
}

/// The content of every buffer.
pub(super) fn buffers(
    root: &Root,
    bin: Option<&[u8]>,
    resources: &mut Resources,
    warnings: &mut Warnings,
) -> Checked<Vec<Rc<[u8]>>> {
    let mut buffers = Vec::new();
    for (i, buffer) in root.buffers.iter().enumerate() {
        let path = format!("/buffers/{i}");
        let length = to_usize(buffer.byte_length);
        let bytes: Rc<[u8]> = match (&buffer.uri, bin) {
            (Some(uri), _) => {
                let path = format!("{path}/uri");
                match resources.fetch(uri, &path, warnings) {
                    Ok(bytes) => bytes,
                    // It is needed only where a decoder fails, and then found to be empty.
                    Err(_) if meshopt::is_fallback(buffer) => {
                        buffers.push([].into());
                        continue;
                    }
                    Err(fault) => return Err(format!("{path}: {fault}")),
                }
            }
            (None, Some(bin)) if i == 0 => bin.into(),
            // It stands for what decoders make; who reads it is told that it is not there.
            (None, _) => [].into(),
        };
        if bytes.len() < length && !bytes.is_empty() {
            // Where a bufferView needs what is not there, it is refused.
            warnings.breach(path, "has fewer bytes than its byteLength");
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}
