//! The document of a file, typed by the gltf crate, together with its bytes.
//!
//! Of the crate, the JSON types are used and not the wrappers around them ([`gltf::Document`]):
//! those unwrap whatever they look up, and rely on a validation of the whole document that refuses
//! what can be rendered (a POSITION without bounds, a texture with only a WebP source, any extension
//! that the crate does not know) and that itself panics where a POSITION is out of range. Here every
//! reference is checked where it is followed, and the fault names its place. Accessors are read in
//! [`super::accessor`] for the same reason: the crate's readers slice unchecked.

use std::cell::{Cell, OnceCell};
use std::fmt::Display;
use std::rc::Rc;

use gltf::json::validation::{self, USize64};
use gltf::json::{Buffer, Index, Root, Value, buffer};
use serde_path_to_error::Segment;

use super::meshopt::Compressed;
use super::uri::shown;
use super::warnings::Warnings;

/// A checked read: the fault is a sentence that begins with a JSON path.
pub(super) type Checked<T> = Result<T, String>;

/// Elements (triangle corners, sparse values) that a scene may read beyond [`PER_BYTE`] for each byte of its buffers: some
/// 84 bytes each in memory, 1.4 GB in all. Only files that use the same data again and again come near it: instances count
/// each time, unless their mesh is stored once.
const MAX_SHARED: u64 = 1 << 24;
const PER_BYTE: u64 = 4;

/// The document `json`, typed. Animations, which are not rendered, are left out unseen.
pub(super) fn typed(mut json: Value) -> Checked<Root> {
    // The crate asks for two members that glTF does not: an animation's target node, a scene's nodes.
    if let Some(root) = json.as_object_mut() {
        root.remove("animations");
    }
    let scenes = json.get_mut("scenes").and_then(Value::as_array_mut);
    for scene in scenes.into_iter().flatten() {
        if let Some(scene) = scene.as_object_mut() {
            scene.entry("nodes").or_insert_with(|| Value::Array(vec![]));
        }
    }
    serde_path_to_error::deserialize(json).map_err(|error| {
        let path: String = error
            .path()
            .iter()
            .map(|segment| match segment {
                Segment::Seq { index } => format!("/{index}"),
                Segment::Map { key } => format!("/{key}"),
                Segment::Enum { .. } | Segment::Unknown => "/?".into(),
            })
            .collect();
        let path = if path.is_empty() { "/" } else { &path };
        // It quotes what it did not expect, which can be a data URI.
        format!("{path}: {}", shown(&error.inner().to_string()))
    })
}

/// What `index`, which stands at `path`, refers to. Of larger numbers the crate keeps 32 bits.
pub(super) fn get<T>(root: &Root, index: Index<T>, path: impl Display) -> Checked<&T>
where
    Root: AsRef<[T]>,
{
    let list: &[T] = root.as_ref();
    list.get(index.value()).ok_or_else(|| {
        let count = list.len();
        format!("{path}: is {index}, but the file has {count} of these")
    })
}

/// The member at `path`, unless it is none of the names or numbers that glTF lists for it.
pub(super) fn valid<T>(member: validation::Checked<T>, path: impl Display) -> Checked<T> {
    match member {
        validation::Checked::Valid(value) => Ok(value),
        validation::Checked::Invalid => Err(format!("{path}: is none of the values of glTF")),
    }
}

/// Where it does not fit, it exceeds every buffer.
pub(super) fn to_usize(size: USize64) -> usize {
    size.0.try_into().unwrap_or(usize::MAX)
}

/// Bytes that decoders may make of the streams of a scene, together, beyond so many for each byte
/// of its buffers.
const MAX_DECODED: u64 = 1 << 30;
const DECODED_PER_BYTE: u64 = 16;

/// A document with the bytes that it refers to.
pub(super) struct Asset<'a> {
    pub root: &'a Root,
    buffers: &'a [Rc<[u8]>],
    /// What compressed bufferViews decode to, once they were read.
    decoded: &'a [OnceCell<Vec<u8>>],
    elements_left: Cell<u64>,
    decoded_left: Cell<u64>,
}

impl<'a> Asset<'a> {
    /// `decoded` has an empty cell for each bufferView.
    pub fn new(root: &'a Root, buffers: &'a [Rc<[u8]>], decoded: &'a [OnceCell<Vec<u8>>]) -> Self {
        let bytes: u64 = buffers.iter().map(|buffer| buffer.len() as u64).sum();
        Self {
            root,
            buffers,
            decoded,
            decoded_left: Cell::new(MAX_DECODED + DECODED_PER_BYTE * bytes),
            // Vertices are counted in u32.
            elements_left: Cell::new((MAX_SHARED + PER_BYTE * bytes).min(u32::MAX.into())),
        }
    }

    /// Takes `count` elements from what this scene may read.
    pub fn charge(&self, count: u64, path: &str) -> Checked<()> {
        let left = self.elements_left.get().checked_sub(count);
        self.elements_left.set(left.ok_or_else(|| {
            format!(
                "{path}: the scene is too large for its file: more than {MAX_SHARED} triangle corners, flattened \
                 instances counted, and {PER_BYTE} for each byte of its buffers"
            )
        })?);
        Ok(())
    }

    /// Takes `bytes` from what decoders may make for this scene.
    pub fn charge_decoded(&self, bytes: u64, path: &str) -> Checked<()> {
        let left = self.decoded_left.get().checked_sub(bytes);
        self.decoded_left.set(left.ok_or_else(|| {
            format!("{path}: the scene's compressed data are too large once decoded")
        })?);
        Ok(())
    }

    /// How many elements, and decoded bytes, the scene may still have.
    pub fn limits(&self) -> (u64, u64) {
        (self.elements_left.get(), self.decoded_left.get())
    }

    /// The bufferView that the object at `path` refers to, and its bytes, decoded.
    pub fn view(
        &self,
        index: Index<buffer::View>,
        path: &str,
        warnings: &mut Warnings,
    ) -> Checked<(&'a buffer::View, &'a [u8])> {
        let view = get(self.root, index, format_args!("{path}/bufferView"))?;
        let path = format!("/bufferViews/{index}");
        let offset = to_usize(view.byte_offset.unwrap_or_default());
        let length = to_usize(view.byte_length);
        let fault = match self.decoded(index, view, &path, warnings) {
            Ok(Some(bytes)) => return Ok((view, bytes)),
            Ok(None) => None,
            Err(fault) => Some(fault),
        };
        let plain = self.slice(view.buffer, offset, length, &path, warnings);
        match (plain, fault) {
            (Ok(bytes), None) => Ok((view, bytes)),
            // The file has the same once more for those that cannot decode.
            (Ok(bytes), Some(fault)) => {
                warnings.breach(path, format_args!("not decoded: {fault}"));
                Ok((view, bytes))
            }
            (Err(_), Some(fault)) | (Err(fault), None) => Err(fault),
        }
    }

    /// What the compressed bufferView decodes to; `None` where it is not compressed.
    fn decoded(
        &self,
        index: Index<buffer::View>,
        view: &buffer::View,
        path: &str,
        warnings: &mut Warnings,
    ) -> Checked<Option<&'a [u8]>> {
        let Some(compressed) = Compressed::of(view, path)? else {
            return Ok(None);
        };
        let Some(cell) = self.decoded.get(index.value()) else {
            return Ok(None);
        };
        if cell.get().is_none() {
            let words = |fault| format!("{path}: meshopt: {fault}");
            let size = compressed.decoded_size().map_err(words)?;
            let Compressed { offset, length, .. } = compressed;
            let buffer = Index::new(compressed.buffer);
            let stream = self.slice(buffer, offset, length, path, warnings)?;
            self.charge_decoded(size as u64, path)?;
            let bytes = compressed.decode(stream).map_err(words)?;
            // The cell is empty, so this cannot fail.
            let _ = cell.set(bytes);
        }
        Ok(cell.get().map(Vec::as_slice))
    }

    /// `length` bytes from `offset` of a buffer, for the bufferView at `path`.
    fn slice(
        &self,
        buffer: Index<Buffer>,
        offset: usize,
        length: usize,
        path: &str,
        warnings: &mut Warnings,
    ) -> Checked<&'a [u8]> {
        let json: &Buffer = get(self.root, buffer, format_args!("{path}/buffer"))?;
        let bytes = self.buffers.get(buffer.value());
        let bytes: &[u8] = bytes.map_or(&[], |bytes| bytes);
        let size = bytes.len();
        let end = offset.saturating_add(length);
        let bytes = bytes.get(offset..end).ok_or_else(|| {
            if json.uri.is_none() && size == 0 {
                return format!("/buffers/{buffer}: has no uri, and there is no GLB chunk for it");
            }
            format!("{path}: {length} bytes from {offset} leave its buffer of {size}")
        })?;
        if end > to_usize(json.byte_length) {
            warnings.breach(path, "leaves the byteLength of its buffer");
        }
        Ok(bytes)
    }
}
