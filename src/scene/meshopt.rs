//! EXT_meshopt_compression and KHR_meshopt_compression: bufferViews that are decoded when they are
//! read.

use draco_gltf::{MeshoptFilter, MeshoptMode, meshopt};
use gltf::json::{Value, buffer};

use super::asset::Checked;
use super::guard::guarded;

/// Both have the same members; the second knows a newer stream and one more filter.
const NAMES: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];

/// A byte of a stream stands for 1024 at most: for four bytes each of 256 vertices that are alike.
const MOST_PER_BYTE: usize = 1024;

/// What the extension says about a bufferView.
pub(super) struct Compressed {
    pub buffer: u32,
    pub offset: usize,
    pub length: usize,
    stride: usize,
    count: usize,
    mode: MeshoptMode,
    filter: MeshoptFilter,
}

/// Whether `buffer` stands for data that only a decoder has.
pub(super) fn is_fallback(buffer: &gltf::json::Buffer) -> bool {
    let extensions = buffer.extensions.as_ref();
    NAMES.iter().any(|name| {
        let json = extensions.and_then(|all| all.others.get(*name));
        json.and_then(|json| json.get("fallback")?.as_bool()) == Some(true)
    })
}

impl Compressed {
    /// Of the bufferView at `path`, if it is compressed.
    pub fn of(view: &buffer::View, path: &str) -> Checked<Option<Self>> {
        let Some(extensions) = view.extensions.as_ref() else {
            return Ok(None);
        };
        let found = NAMES
            .iter()
            .find_map(|name| Some((name, extensions.others.get(*name)?)));
        let Some((name, json)) = found else {
            return Ok(None);
        };
        let path = format!("{path}/extensions/{name}");
        Self::parse(json, &path).map(Some)
    }

    fn parse(json: &Value, path: &str) -> Checked<Self> {
        let number = |key: &str| {
            let number = json.get(key).and_then(Value::as_u64);
            let number = number.and_then(|number| usize::try_from(number).ok());
            number.ok_or_else(|| format!("{path}/{key}: must be a whole number"))
        };
        let word = |key: &str| json.get(key).and_then(Value::as_str);
        let words = |error| format!("{path}: {error}");
        Ok(Self {
            buffer: u32::try_from(number("buffer")?).unwrap_or(u32::MAX),
            offset: json
                .get("byteOffset")
                .map_or(Ok(0), |_| number("byteOffset"))?,
            length: number("byteLength")?,
            stride: number("byteStride")?,
            count: number("count")?,
            mode: MeshoptMode::from_name(word("mode").unwrap_or_default()).map_err(words)?,
            filter: MeshoptFilter::from_name(word("filter").unwrap_or("NONE")).map_err(words)?,
        })
    }

    /// The size of what it decodes to, if a stream of this length can hold so much.
    pub fn decoded_size(&self) -> Checked<usize> {
        let size = self.count.checked_mul(self.stride);
        let most = self.length.saturating_mul(MOST_PER_BYTE);
        size.filter(|size| *size <= most).ok_or_else(|| {
            format!(
                "{} elements of {} bytes are more than {} bytes can hold",
                self.count, self.stride, self.length
            )
        })
    }

    pub fn decode(&self, stream: &[u8]) -> Checked<Vec<u8>> {
        let mut bytes = vec![0; self.decoded_size()?];
        guarded(|| {
            let decoded = meshopt::decode_buffer_view(
                &mut bytes,
                stream,
                self.mode,
                self.filter,
                self.count,
                self.stride,
            );
            decoded.map_err(|error| error.to_string())
        })?;
        Ok(bytes)
    }
}
