//! Checked reading of accessors: whatever the file says, no read leaves its buffer.

use super::asset::Asset;
use super::json::{Checked, Json};

/// Elements of an accessor without data: they cost the file nothing, so its size is no bound.
const MAX_ZEROS: usize = 1 << 20;

/// glTF's componentType.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn new(holder: &Json) -> Checked<Self> {
        let json = holder.need("componentType")?;
        Ok(match json.as_index()? {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            other => return Err(json.fault(format_args!("{other} is no component type"))),
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

/// `count` elements, each at a multiple of `stride`; checked to lie within `bytes`.
struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
}

impl<'a> Strided<'a> {
    /// The elements that begin at `holder`'s byteOffset in its bufferView.
    fn new(
        asset: &Asset<'a>,
        holder: &Json<'a>,
        count: usize,
        size: usize,
        align: usize,
    ) -> Checked<Option<Self>> {
        let Some((bytes, view)) = asset.view(holder)? else {
            return Ok(None);
        };
        let stride = view.index("byteStride", size)?;
        if stride < size || stride > 252.max(size) {
            return Err(view.fault(format_args!("byteStride {stride} for elements of {size}")));
        }
        let offset = holder.index("byteOffset", 0)?;
        let start = view.index("byteOffset", 0)?;
        if offset % align != 0 || start.wrapping_add(offset) % align != 0 || stride % align != 0 {
            return Err(holder.fault(format_args!("not aligned to its components of {align}")));
        }
        let length = match count {
            0 => Some(0),
            _ => (count - 1)
                .checked_mul(stride)
                .and_then(|length| length.checked_add(size)),
        };
        let bytes = length
            .and_then(|length| offset.checked_add(length))
            .and_then(|end| bytes.get(offset..end))
            .ok_or_else(|| {
                holder.fault(format_args!(
                    "{count} elements leave the bufferView of {} bytes",
                    bytes.len()
                ))
            })?;
        Ok(Some(Self { bytes, stride }))
    }

    fn element(&self, i: usize) -> &'a [u8] {
        self.bytes.get(i * self.stride..).unwrap_or(&[])
    }
}

/// An accessor, checked on opening.
pub(super) struct Accessor<'a> {
    pub count: usize,
    pub components: usize,
    pub component: Component,
    normalized: bool,
    dense: Option<Strided<'a>>,
    sparse: Option<Sparse<'a>>,
}

struct Sparse<'a> {
    count: usize,
    index: Component,
    indices: Strided<'a>,
    values: Strided<'a>,
}

impl<'a> Accessor<'a> {
    /// Opens the accessor whose index is the member `key` of `holder`, where there is one.
    pub fn open(asset: &Asset<'a>, holder: &Json<'a>, key: &str) -> Checked<Option<Self>> {
        let Some((_, json)) = holder.refer(key, &asset.root, "accessors")? else {
            return Ok(None);
        };
        let count = json.need("count")?.as_index()?;
        let component = Component::new(&json)?;
        let kind = json.need("type")?;
        let components = match kind.as_text()? {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            other => return Err(kind.fault(format_args!("{other} is no vertex data"))),
        };
        let align = component.size();
        let size = align * components;
        let dense = Strided::new(asset, &json, count, size, align)?;
        if dense.is_none() && count > MAX_ZEROS {
            return Err(json.fault(format_args!(
                "{count} elements without a bufferView; at most {MAX_ZEROS}"
            )));
        }
        let sparse = match json.get("sparse")? {
            Some(sparse) => Some(Sparse::open(asset, &sparse, count, size, align)?),
            None => None,
        };
        Ok(Some(Self {
            count,
            components,
            component,
            normalized: json.flag("normalized")?,
            dense,
            sparse,
        }))
    }

    fn element(&self, i: usize) -> &'a [u8] {
        if let Some(sparse) = &self.sparse
            && let Some(bytes) = sparse.find(i)
        {
            return bytes;
        }
        self.dense.as_ref().map_or(&[], |dense| dense.element(i))
    }

    /// Element `i` as floats, normalized where the accessor says so; what it lacks is 0 0 0 1.
    pub fn vector(&self, i: usize) -> [f32; 4] {
        let bytes = self.element(i);
        let mut vector = [0.0, 0.0, 0.0, 1.0];
        for (c, value) in vector.iter_mut().take(self.components).enumerate() {
            *value = self.float(bytes, c * self.component.size());
        }
        vector
    }

    /// glTF 2.0, section 3.6.2.2, also for KHR_mesh_quantization.
    fn float(&self, bytes: &[u8], at: usize) -> f32 {
        let (value, max) = match self.component {
            Component::I8 => (f32::from(i8::from_le_bytes(le(bytes, at))), 127.0),
            Component::U8 => (f32::from(u8::from_le_bytes(le(bytes, at))), 255.0),
            Component::I16 => (f32::from(i16::from_le_bytes(le(bytes, at))), 32767.0),
            Component::U16 => (f32::from(u16::from_le_bytes(le(bytes, at))), 65535.0),
            Component::U32 => (u32::from_le_bytes(le(bytes, at)) as f32, u32::MAX as f32),
            Component::F32 => return f32::from_le_bytes(le(bytes, at)),
        };
        if self.normalized {
            (value / max).max(-1.0)
        } else {
            value
        }
    }

    /// Element `i` of an index accessor.
    pub fn index(&self, i: usize) -> u32 {
        unsigned(self.component, self.element(i))
    }
}

impl<'a> Sparse<'a> {
    fn open(
        asset: &Asset<'a>,
        json: &Json<'a>,
        elements: usize,
        size: usize,
        align: usize,
    ) -> Checked<Self> {
        let count = json.need("count")?.as_index()?;
        let (at, values) = (json.need("indices")?, json.need("values")?);
        let index = Component::new(&at)?;
        if !matches!(index, Component::U8 | Component::U16 | Component::U32) {
            return Err(at.fault("must be unsigned integers"));
        }
        let no_view = |json: &Json| json.fault("lacks \"bufferView\"");
        let indices = Strided::new(asset, &at, count, index.size(), index.size())?
            .ok_or_else(|| no_view(&at))?;
        let values =
            Strided::new(asset, &values, count, size, align)?.ok_or_else(|| no_view(&values))?;
        asset.charge(count as u64, json)?;
        let sparse = Self {
            count,
            index,
            indices,
            values,
        };
        let mut next = 0;
        for i in 0..count {
            let element = sparse.at(i);
            if element < next || element >= elements {
                return Err(at.fault(format_args!(
                    "{element} is out of order or not below {elements}"
                )));
            }
            next = element + 1;
        }
        Ok(sparse)
    }

    fn at(&self, i: usize) -> usize {
        unsigned(self.index, self.indices.element(i)) as usize
    }

    /// The value that replaces element `element`; binary search, for the indices increase.
    fn find(&self, element: usize) -> Option<&'a [u8]> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low + (high - low) / 2;
            match self.at(middle).cmp(&element) {
                std::cmp::Ordering::Less => low = middle + 1,
                std::cmp::Ordering::Greater => high = middle,
                std::cmp::Ordering::Equal => return Some(self.values.element(middle)),
            }
        }
        None
    }
}

fn unsigned(component: Component, bytes: &[u8]) -> u32 {
    match component {
        Component::U8 => u8::from_le_bytes(le(bytes, 0)).into(),
        Component::U16 => u16::from_le_bytes(le(bytes, 0)).into(),
        _ => u32::from_le_bytes(le(bytes, 0)),
    }
}

/// The `N` bytes from `at`; zeros where an accessor has no data.
fn le<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    let chunk = bytes.get(at..).and_then(|bytes| bytes.first_chunk());
    chunk.copied().unwrap_or([0; N])
}
