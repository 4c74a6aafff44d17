//! The document of a file, typed by the gltf crate, together with its bytes.
//!
//! Of the crate, the JSON types are used and not the wrappers around them ([`gltf::Document`]):
//! those unwrap whatever they look up, and rely on a validation of the whole document that refuses
//! what can be rendered (a POSITION without bounds, a texture with only a WebP source, any extension
//! that the crate does not know) and that itself panics where a POSITION is out of range. Here every
//! reference is checked where it is followed, and the fault names its place. Accessors are read in
//! [`super::accessor`] for the same reason: the crate's readers slice unchecked.

use std::cell::Cell;
use std::fmt::Display;
use std::rc::Rc;

use gltf::json::validation::{self, USize64};
use gltf::json::{Buffer, Index, Root, Value, buffer};
use serde_path_to_error::Segment;

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

/// A document with the bytes that it refers to.
pub(super) struct Asset<'a> {
    pub root: &'a Root,
    buffers: &'a [Rc<[u8]>],
    elements_left: Cell<u64>,
}

impl<'a> Asset<'a> {
    pub fn new(root: &'a Root, buffers: &'a [Rc<[u8]>]) -> Self {
        let bytes: u64 = buffers.iter().map(|buffer| buffer.len() as u64).sum();
        Self {
            root,
            buffers,
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

    /// The bufferView that the object at `path` refers to, and its bytes.
    pub fn view(
        &self,
        index: Index<buffer::View>,
        path: &str,
        warnings: &mut Warnings,
    ) -> Checked<(&'a buffer::View, &'a [u8])> {
        let view = get(self.root, index, format_args!("{path}/bufferView"))?;
        let path = format!("/bufferViews/{index}");
        let buffer: &Buffer = get(self.root, view.buffer, format_args!("{path}/buffer"))?;
        let bytes = self.buffers.get(view.buffer.value());
        let bytes: &[u8] = bytes.map_or(&[], |bytes| bytes);
        let size = bytes.len();
        let offset = to_usize(view.byte_offset.unwrap_or_default());
        let length = to_usize(view.byte_length);
        let end = offset.saturating_add(length);
        let bytes = bytes.get(offset..end).ok_or_else(|| {
            format!("{path}: {length} bytes from {offset} leave its buffer of {size}")
        })?;
        if end > to_usize(buffer.byte_length) {
            warnings.breach(path, "leaves the byteLength of its buffer");
        }
        Ok((view, bytes))
    }
}
