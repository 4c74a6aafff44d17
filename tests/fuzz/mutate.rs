//! Mutation that knows the container: JSON and binary chunk change apart and are put together again, so that most
//! inputs get past the parser.

use libfuzzer_sys::fuzzer_mutate;
use serde_json::{Map, Value, json};

use crate::seeds;

/// Changes the first `size` bytes of `data`; returns their new number.
pub fn mutate(data: &mut [u8], size: usize, max_size: usize, seed: u32) -> usize {
    let mut random = Random(seed.into());
    if size < 20 || random.below(1000) == 0 {
        return put(&seeds::seed(random.below(seeds::COUNT)), data, max_size).unwrap_or(size);
    }
    if random.below(5) == 0 {
        return fuzzer_mutate(data, size, max_size);
    }
    let Some((mut json, mut bin)) = split(&data[..size]) else {
        return fuzzer_mutate(data, size, max_size);
    };
    match &mut bin {
        Some(bin) if random.below(4) == 0 => {
            let old = bin.len();
            bin.resize(old + 16, 0);
            let new = fuzzer_mutate(bin, old, old + 16);
            bin.truncate(new);
        }
        _ => (0..=random.below(3)).for_each(|_| change(&mut json, &mut random)),
    }
    put(&join(&json, bin.as_deref()), data, max_size).unwrap_or(size)
}

/// `None` where it does not fit.
fn put(bytes: &[u8], data: &mut [u8], max_size: usize) -> Option<usize> {
    if bytes.len() > max_size {
        return None;
    }
    data.get_mut(..bytes.len())?.copy_from_slice(bytes);
    Some(bytes.len())
}

fn split(bytes: &[u8]) -> Option<(Value, Option<Vec<u8>>)> {
    if !bytes.starts_with(b"glTF") {
        return Some((serde_json::from_slice(bytes).ok()?, None));
    }
    let length = u32::from_le_bytes(*bytes.get(12..)?.first_chunk()?) as usize;
    let json = bytes.get(20..)?.get(..length)?;
    let bin = bytes.get(20 + length + 8..).unwrap_or(&[]);
    Some((serde_json::from_slice(json).ok()?, Some(bin.to_vec())))
}

fn join(json: &Value, bin: Option<&[u8]>) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    let Some(bin) = bin else { return text };
    text.resize(text.len().next_multiple_of(4), b' ');
    let bin_length = bin.len().next_multiple_of(4);
    let word = |x: usize| (x as u32).to_le_bytes();
    let mut file = [
        *b"glTF",
        word(2),
        word(28 + text.len() + bin_length),
        word(text.len()),
        *b"JSON",
    ]
    .concat();
    file.extend(text);
    file.extend([word(bin_length), *b"BIN\0"].concat());
    file.extend(bin);
    file.resize(file.len().next_multiple_of(4), 0);
    file
}

/// Numbers and words at which glTF, or a careless loader of it, turns a corner.
fn constant(random: &mut Random) -> Value {
    let all = json!([
        0,
        1,
        2,
        3,
        4,
        5,
        6,
        7,
        255,
        65535,
        4294967295u64,
        u64::MAX,
        -1,
        i64::MIN,
        0.5,
        1e-300,
        1e-38,
        1e38,
        1e300,
        -1e300,
        5120,
        5121,
        5122,
        5123,
        5125,
        5126,
        "SCALAR",
        "VEC2",
        "VEC3",
        "VEC4",
        "MAT4",
        "OPAQUE",
        "MASK",
        "BLEND",
        "point",
        "spot",
        "directional",
        "perspective",
        "data.bin",
        "image.png",
        "data:,x",
        "../data.bin",
        ".",
        "",
        null,
        true,
        false,
        [],
        {},
        [0],
        [1e300, 0, -1e300]
    ]);
    let all = all.as_array().expect("an array");
    all[random.below(all.len())].clone()
}

const KEYS: &[&str] = &[
    "POSITION",
    "NORMAL",
    "TANGENT",
    "TEXCOORD_0",
    "TEXCOORD_1",
    "COLOR_0",
    "indices",
    "mode",
    "material",
    "byteStride",
    "byteOffset",
    "byteLength",
    "count",
    "bufferView",
    "sparse",
    "normalized",
    "children",
    "mesh",
    "skin",
    "camera",
    "matrix",
    "rotation",
    "scale",
    "translation",
    "uri",
    "source",
    "sampler",
    "extensions",
    "extensionsRequired",
    "extras",
    "targets",
    "KHR_materials_unlit",
    "KHR_lights_punctual",
    "KHR_texture_transform",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "KHR_draco_mesh_compression",
    "KHR_materials_pbrSpecularGlossiness",
    "CESIUM_RTC",
    "center",
    "filter",
    "fallback",
];

/// One change at a random place.
fn change(root: &mut Value, random: &mut Random) {
    let other = root
        .pointer(&place(root, random))
        .cloned()
        .unwrap_or_default();
    let pointer = place(root, random);
    let Some(place) = root.pointer_mut(&pointer) else {
        return;
    };
    match (random.below(6), place) {
        (0, place) => *place = other,
        (1, place) => *place = constant(random),
        (2, Value::Number(number)) => {
            let (x, y) = (number.as_i64().unwrap_or(0), number.as_f64().unwrap_or(0.0));
            let options = [
                json!(x.wrapping_add(1)),
                json!(x.wrapping_sub(1)),
                json!(x.wrapping_mul(2)),
                json!(-y),
                json!(y * 0.5),
            ];
            let option = random.below(options.len());
            *number = options[option].as_number().cloned().unwrap_or(0.into());
        }
        (3, Value::Array(list)) if !list.is_empty() => {
            list.remove(random.below(list.len()));
        }
        (4, Value::Array(list)) if !list.is_empty() => {
            let copies = vec![list[random.below(list.len())].clone(); 1 << random.below(7)];
            list.extend(copies);
        }
        (3, Value::Object(members)) if !members.is_empty() => {
            let key = key(members, random);
            members.remove(&key);
        }
        (_, Value::Array(list)) => list.push(other),
        (_, Value::Object(members)) => {
            members.insert(KEYS[random.below(KEYS.len())].into(), other);
        }
        (_, place) => *place = constant(random),
    }
}

/// The JSON pointer to a random value inside `value`, or to itself.
fn place(mut value: &Value, random: &mut Random) -> String {
    let mut pointer = String::new();
    while random.below(8) != 0 {
        let step = match value {
            Value::Array(list) if !list.is_empty() => random.below(list.len()).to_string(),
            Value::Object(members) if !members.is_empty() => key(members, random),
            _ => break,
        };
        let Some(inner) = value.pointer(&format!("/{step}")) else {
            break;
        };
        pointer += &format!("/{step}");
        value = inner;
    }
    pointer
}

fn key(members: &Map<String, Value>, random: &mut Random) -> String {
    let i = random.below(members.len());
    members.keys().nth(i).cloned().unwrap_or_default()
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as usize % n
    }
}
