//! Checked reading of accessors: whatever the file says, no read leaves its buffer.

use std::borrow::Cow;

use gltf::json::accessor::{ComponentType, Type, sparse};
use gltf::json::validation::USize64;
use gltf::json::{self, Index, buffer};

use super::asset::{Asset, Checked, get, to_usize, valid};
use super::warnings::Warnings;

/// Elements of an accessor without data: they cost the file nothing, so its size is no bound.
const MAX_ZEROS: usize = 1 << 20;

/// `count` elements, each at a multiple of `stride`; checked to lie within `bytes`.
struct Strided<'a> {
    bytes: Cow<'a, [u8]>,
    stride: usize,
}

/// Elements that a decoder made, packed.
pub(super) struct Decoded {
    pub count: usize,
    pub component: ComponentType,
    pub bytes: Vec<u8>,
}

impl<'a> Strided<'a> {
    /// `count` elements of `size` bytes, with components of `align`, from `offset` in a bufferView,
    /// for the object at `path`.
    fn new(
        asset: &Asset<'a>,
        path: &str,
        (view, offset): (Index<buffer::View>, USize64),
        count: usize,
        (size, align): (usize, usize),
        warnings: &mut Warnings,
    ) -> Checked<Self> {
        let (json, bytes) = asset.view(view, path, warnings)?;
        let stride = match json.byte_stride.map_or(size, |stride| stride.0) {
            0 => {
                let what = "byteStride is 0: its elements are taken to be packed";
                warnings.breach(format_args!("/bufferViews/{view}"), what);
                size
            }
            stride => stride,
        };
        if stride < size {
            return Err(format!(
                "/bufferViews/{view}: byteStride {stride} for elements of {size}"
            ));
        }
        let (offset, start) = (
            to_usize(offset),
            to_usize(json.byte_offset.unwrap_or_default()),
        );
        if offset % align != 0 || start.wrapping_add(offset) % align != 0 || stride % align != 0 {
            let what = format_args!("not aligned to its components of {align} bytes");
            warnings.breach(path, what);
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
                let size = bytes.len();
                format!("{path}: {count} elements leave the bufferView of {size} bytes")
            })?;
        Ok(Self {
            bytes: bytes.into(),
            stride,
        })
    }

    fn element(&self, i: usize) -> &[u8] {
        self.bytes.get(i * self.stride..).unwrap_or(&[])
    }
}

impl Decoded {
    fn strided<'a>(self, components: usize) -> Strided<'a> {
        Strided {
            bytes: self.bytes.into(),
            stride: self.component.size() * components,
        }
    }
}

/// An accessor, checked on opening.
pub(super) struct Accessor<'a> {
    pub count: usize,
    pub components: usize,
    pub component: ComponentType,
    normalized: bool,
    dense: Option<Strided<'a>>,
    sparse: Option<Sparse<'a>>,
}

struct Sparse<'a> {
    count: usize,
    index: ComponentType,
    indices: Strided<'a>,
    values: Strided<'a>,
}

impl<'a> Accessor<'a> {
    /// Opens the accessor that stands at `holder`.
    pub fn open(
        asset: &Asset<'a>,
        index: Index<json::Accessor>,
        holder: &str,
        warnings: &mut Warnings,
    ) -> Checked<Self> {
        Self::open_or(asset, index, holder, warnings, |_, _| Ok(None))
    }

    /// The same; `decode` is asked for its elements, of so many components of that type, first.
    pub fn open_or(
        asset: &Asset<'a>,
        index: Index<json::Accessor>,
        holder: &str,
        warnings: &mut Warnings,
        decode: impl FnOnce(usize, ComponentType) -> Checked<Option<Decoded>>,
    ) -> Checked<Self> {
        let json = get(asset.root, index, holder)?;
        let path = format!("/accessors/{index}");
        let component = valid(json.component_type, format_args!("{path}/componentType"))?.0;
        let kind = valid(json.type_, format_args!("{path}/type"))?;
        if matches!(kind, Type::Mat2 | Type::Mat3 | Type::Mat4) {
            return Err(format!("{path}/type: a matrix is no vertex data"));
        }
        let components = kind.multiplicity();
        let size = (component.size() * components, component.size());
        let decoded = decode(components, component).map_err(|fault| format!("{path}: {fault}"))?;
        let count = decoded.as_ref().map_or(to_usize(json.count), |d| d.count);
        let dense = match (decoded, json.buffer_view) {
            (Some(decoded), _) => Some(decoded.strided(components)),
            (None, Some(view)) => {
                let place = (view, json.byte_offset.unwrap_or_default());
                Some(Strided::new(asset, &path, place, count, size, warnings)?)
            }
            (None, None) if count > MAX_ZEROS => {
                return Err(format!(
                    "{path}: {count} elements without a bufferView; at most {MAX_ZEROS}"
                ));
            }
            (None, None) => None,
        };
        let sparse = match &json.sparse {
            Some(sparse) => {
                let path = format!("{path}/sparse");
                Some(Sparse::open(asset, sparse, &path, count, size, warnings)?)
            }
            None => None,
        };
        Ok(Self {
            count,
            components,
            component,
            normalized: json.normalized,
            dense,
            sparse,
        })
    }

    /// One number for each of the elements that a decoder made.
    pub fn of(decoded: Decoded) -> Self {
        Self {
            count: decoded.count,
            components: 1,
            component: decoded.component,
            normalized: false,
            dense: Some(decoded.strided(1)),
            sparse: None,
        }
    }

    fn element(&self, i: usize) -> &[u8] {
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
            ComponentType::I8 => (f32::from(i8::from_le_bytes(le(bytes, at))), 127.0),
            ComponentType::U8 => (f32::from(u8::from_le_bytes(le(bytes, at))), 255.0),
            ComponentType::I16 => (f32::from(i16::from_le_bytes(le(bytes, at))), 32767.0),
            ComponentType::U16 => (f32::from(u16::from_le_bytes(le(bytes, at))), 65535.0),
            ComponentType::U32 => (u32::from_le_bytes(le(bytes, at)) as f32, u32::MAX as f32),
            ComponentType::F32 => return f32::from_le_bytes(le(bytes, at)),
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
        json: &sparse::Sparse,
        path: &str,
        elements: usize,
        size: (usize, usize),
        warnings: &mut Warnings,
    ) -> Checked<Self> {
        let count = to_usize(json.count);
        let at = format!("{path}/indices");
        let kind = json.indices.component_type;
        let index = valid(kind, format_args!("{at}/componentType"))?.0;
        let place = (json.indices.buffer_view, json.indices.byte_offset);
        let size_of_index = (index.size(), index.size());
        let indices = Strided::new(asset, &at, place, count, size_of_index, warnings)?;
        let place = (json.values.buffer_view, json.values.byte_offset);
        let values = format!("{path}/values");
        let values = Strided::new(asset, &values, place, count, size, warnings)?;
        asset.charge(count as u64, path)?;
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
                return Err(format!(
                    "{at}: {element} is out of order or not below {elements}"
                ));
            }
            next = element + 1;
        }
        Ok(sparse)
    }

    fn at(&self, i: usize) -> usize {
        unsigned(self.index, self.indices.element(i)) as usize
    }

    /// The value that replaces element `element`; binary search, for the indices increase.
    fn find(&self, element: usize) -> Option<&[u8]> {
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

fn unsigned(component: ComponentType, bytes: &[u8]) -> u32 {
    match component {
        ComponentType::U8 => u8::from_le_bytes(le(bytes, 0)).into(),
        ComponentType::U16 => u16::from_le_bytes(le(bytes, 0)).into(),
        _ => u32::from_le_bytes(le(bytes, 0)),
    }
}

/// The `N` bytes from `at`; zeros where an accessor has no data.
fn le<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    let chunk = bytes.get(at..).and_then(|bytes| bytes.first_chunk());
    chunk.copied().unwrap_or([0; N])
}
