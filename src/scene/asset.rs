//! The JSON of a file together with its bytes.

use std::cell::Cell;
use std::rc::Rc;

use super::json::{Checked, Json};

/// Elements (triangle corners, sparse values) that a scene may read beyond one for each byte it has.
/// Only files that use the same data again and again come near it: instances count each time.
const MAX_SHARED: u64 = 1 << 26;

/// The JSON of a file with the bytes that it refers to.
pub(super) struct Asset<'a> {
    pub root: Json<'a>,
    pub buffers: &'a [Rc<[u8]>],
    elements_left: Cell<u64>,
}

impl<'a> Asset<'a> {
    pub fn new(root: Json<'a>, buffers: &'a [Rc<[u8]>]) -> Self {
        let bytes: u64 = buffers.iter().map(|buffer| buffer.len() as u64).sum();
        Self {
            root,
            buffers,
            // Vertices are counted in u32.
            elements_left: Cell::new((MAX_SHARED + bytes).min(u32::MAX.into())),
        }
    }

    /// Takes `count` elements from what this scene may read.
    pub fn charge(&self, count: u64, whose: &Json) -> Checked<()> {
        let left = self.elements_left.get().checked_sub(count);
        self.elements_left.set(left.ok_or_else(|| {
            whose.fault(format_args!(
                "the scene is too large: more than {MAX_SHARED} shared vertices, instances counted"
            ))
        })?);
        Ok(())
    }

    /// The bytes of the bufferView that `holder` refers to, and the view itself.
    pub fn view(&self, holder: &Json<'a>) -> Checked<Option<(&'a [u8], Json<'a>)>> {
        let Some((_, view)) = holder.refer("bufferView", &self.root, "bufferViews")? else {
            return Ok(None);
        };
        let (i, buffer) = view
            .refer("buffer", &self.root, "buffers")?
            .ok_or_else(|| view.fault("lacks \"buffer\""))?;
        let bytes: &[u8] = self.buffers.get(i).map_or(&[], |bytes| bytes);
        let byte_length = buffer.index("byteLength", 0)?.min(bytes.len());
        let offset = view.index("byteOffset", 0)?;
        let length = view.need("byteLength")?.as_index()?;
        let bytes = offset
            .checked_add(length)
            .filter(|end| *end <= byte_length)
            .and_then(|end| bytes.get(offset..end))
            .ok_or_else(|| {
                view.fault(format_args!(
                    "{length} bytes from {offset} leave its buffer of {byte_length}"
                ))
            })?;
        Ok(Some((bytes, view)))
    }
}
