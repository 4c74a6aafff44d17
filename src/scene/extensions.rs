//! Which glTF extensions are done, and what becomes of a file that asks for others.

use std::collections::HashSet;

use gltf::json::Value;

use super::asset::Checked;
use super::warnings::Warnings;

enum Support {
    /// Done, or without any effect on a picture.
    Full,
    /// Left out also where it is required, as its specification foresees; the text says how.
    Approximated(&'static str),
    /// Left out where it is not required; the text says what the picture shows instead.
    Ignored(&'static str),
    /// Left out, and the text says how to convert a file that requires it.
    Convert(&'static str),
}
use Support::{Approximated, Convert, Full, Ignored};

const COPY: &str = "convert the file: npx @gltf-transform/cli copy in.glb out.glb";

/// One line for each extension that is known here.
const TABLE: &[(&str, Support)] = &[
    ("KHR_lights_punctual", Full),
    ("KHR_materials_emissive_strength", Full),
    ("KHR_materials_ior", Full),
    ("KHR_materials_specular", Full),
    ("KHR_materials_transmission", Full),
    ("KHR_materials_volume", Full),
    ("KHR_mesh_quantization", Full),
    ("KHR_texture_transform", Full),
    ("EXT_texture_webp", Full),
    ("KHR_xmp_json_ld", Full),
    ("KHR_xmp", Full),
    ("KHR_materials_anisotropy", Ignored("highlights are round")),
    ("KHR_materials_clearcoat", Ignored("there is no coat")),
    (
        "KHR_materials_diffuse_transmission",
        Ignored("no light passes"),
    ),
    (
        "KHR_materials_dispersion",
        Ignored("all wavelengths refract alike"),
    ),
    (
        "KHR_materials_iridescence",
        Ignored("there is no thin film"),
    ),
    ("KHR_materials_sheen", Ignored("there is no sheen")),
    ("KHR_materials_unlit", Approximated("it is lit")),
    (
        "KHR_materials_variants",
        Ignored("the default material is used"),
    ),
    (
        "EXT_mesh_gpu_instancing",
        Ignored("the mesh appears once only"),
    ),
    ("EXT_lights_image_based", Ignored("there is no environment")),
    (
        "KHR_materials_pbrSpecularGlossiness",
        Convert("convert the file: npx @gltf-transform/cli metalrough in.glb out.glb"),
    ),
    ("KHR_draco_mesh_compression", Convert(COPY)),
    ("EXT_meshopt_compression", Convert(COPY)),
    ("KHR_meshopt_compression", Convert(COPY)),
    (
        "KHR_texture_basisu",
        Convert("convert the file: npx @gltf-transform/cli ktxdecompress in.glb out.glb"),
    ),
];

fn support(name: &str) -> Option<&'static Support> {
    let row = TABLE.iter().find(|(known, _)| *known == name)?;
    Some(&row.1)
}

/// Refuses what the file requires and lightfall cannot do; warns of what it only uses. It looks at
/// the untyped document, because the gltf crate's types drop the place of some extensions.
pub(super) fn check(json: &Value, warnings: &mut Warnings) -> Checked<()> {
    for (i, name) in names(json, "extensionsRequired") {
        let fix = match support(name) {
            Some(Full | Approximated(_)) => continue,
            Some(Convert(fix)) => format!("; {fix}"),
            Some(Ignored(_)) | None => String::new(),
        };
        return Err(format!(
            "/extensionsRequired/{i}: the file requires {name}, which is not supported{fix}"
        ));
    }
    let mut met = HashSet::new();
    visit(json, &mut String::new(), &mut |name, path| {
        met.insert(name.to_owned());
        warn(name, path, warnings);
    });
    for (i, name) in names(json, "extensionsUsed") {
        if met.insert(name.to_owned()) {
            warn(name, &format!("/extensionsUsed/{i}"), warnings);
        }
    }
    Ok(())
}

/// The strings in the root's array `key`, with their places.
fn names<'a>(json: &'a Value, key: &str) -> impl Iterator<Item = (usize, &'a str)> {
    let names = json.get(key).and_then(Value::as_array);
    let names = names.into_iter().flatten().enumerate();
    names.filter_map(|(i, name)| Some((i, name.as_str()?)))
}

fn warn(name: &str, path: &str, warnings: &mut Warnings) {
    match support(name) {
        Some(Full) => {}
        Some(Approximated(instead) | Ignored(instead)) => {
            warnings.add(path, format_args!("{name} is not supported: {instead}"));
        }
        Some(Convert(fix)) => warnings.add(path, format_args!("{name} is not supported; {fix}")),
        None => warnings.add(path, format_args!("{name} is unknown here and ignored")),
    }
}

/// Calls `found(extension name, path)` for every extension object in `value`. The depth of the
/// recursion is bounded by the JSON parser's (128).
fn visit(value: &Value, path: &mut String, found: &mut impl FnMut(&str, &str)) {
    let end = path.len();
    match value {
        Value::Object(members) => {
            for (key, member) in members {
                // Extras are the application's own; what looks like an extension there is none.
                if key == "extras" {
                    continue;
                }
                path.push('/');
                path.push_str(key);
                if key == "extensions"
                    && let Value::Object(extensions) = member
                {
                    for name in extensions.keys() {
                        found(name, &format!("{path}/{name}"));
                    }
                }
                visit(member, path, found);
                path.truncate(end);
            }
        }
        Value::Array(elements) => {
            for (i, element) in elements.iter().enumerate() {
                if element.is_object() || element.is_array() {
                    path.push_str(&format!("/{i}"));
                    visit(element, path, found);
                    path.truncate(end);
                }
            }
        }
        _ => {}
    }
}
