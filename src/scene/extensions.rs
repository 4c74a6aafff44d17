//! Which glTF extensions are done, and what becomes of a file that asks for others.

use std::collections::HashSet;

use gltf::json::Value;

use super::asset::Checked;
use super::uri::shown;
use super::warnings::Warnings;

#[derive(PartialEq)]
enum Support {
    /// Done.
    Full,
    /// Says nothing about the picture.
    Unseen,
    /// Done in a simpler way, also where it is required; the text says how.
    Approximated(&'static str),
    /// Left out, also where it is required; the text says what the picture shows instead.
    Ignored(&'static str),
    /// Left out where it is not required; the text says how to convert a file that requires it.
    Convert(&'static str),
}
use Support::{Approximated, Convert, Full, Ignored, Unseen};

/// One line for each extension that is known here; docs/extensions.md has them, too
/// (see [`extensions_table`]).
#[rustfmt::skip]
const TABLE: &[(&str, Support)] = &[
    ("CESIUM_RTC", Full),
    ("EXT_mesh_gpu_instancing", Full),
    ("EXT_meshopt_compression", Full),
    ("EXT_texture_webp", Full),
    ("KHR_draco_mesh_compression", Full),
    ("KHR_lights_punctual", Full),
    ("KHR_materials_emissive_strength", Full),
    ("KHR_materials_ior", Full),
    ("KHR_materials_specular", Full),
    ("KHR_materials_transmission", Full),
    ("KHR_materials_volume", Full),
    ("KHR_mesh_quantization", Full),
    ("KHR_meshopt_compression", Full),
    ("KHR_node_visibility", Full),
    ("KHR_texture_basisu", Full),
    ("KHR_texture_transform", Full),
    ("MSFT_texture_dds", Full),
    ("AGI_articulations", Unseen),
    ("AGI_stk_metadata", Unseen),
    ("EXT_instance_features", Unseen),
    ("EXT_mesh_features", Unseen),
    ("EXT_mesh_manifold", Unseen),
    ("EXT_structural_metadata", Unseen),
    ("KHR_audio_emitter", Unseen),
    ("KHR_implicit_shapes", Unseen),
    ("KHR_interactivity", Unseen),
    ("KHR_node_hoverability", Unseen),
    ("KHR_node_selectability", Unseen),
    ("KHR_physics_rigid_bodies", Unseen),
    ("KHR_xmp", Unseen),
    ("KHR_xmp_json_ld", Unseen),
    ("MSFT_packing_normalRoughnessMetallic", Unseen),
    ("MSFT_packing_occlusionRoughnessMetallic", Unseen),
    ("KHR_animation_pointer", Approximated("the scene as it stands")),
    ("KHR_materials_pbrSpecularGlossiness", Approximated("the metallic-roughness material that looks the same")),
    ("KHR_materials_unlit", Approximated("the eye sees 1 nit × base colour, also in mirrors and through glass; it casts no light and no shadow")),
    ("KHR_materials_variants", Approximated("the default material")),
    ("MSFT_lod", Approximated("the finest level")),
    ("ADOBE_materials_thin_transparency", Ignored("the glTF material is used")),
    ("EXT_lights_ies", Ignored("lamps shine evenly")),
    ("EXT_lights_image_based", Ignored("`--env` lights the scene")),
    ("KHR_gaussian_splatting", Ignored("there are no splats")),
    ("KHR_materials_anisotropy", Ignored("highlights are round")),
    ("KHR_materials_clearcoat", Ignored("there is no coat")),
    ("KHR_materials_diffuse_transmission", Ignored("no light passes")),
    ("KHR_materials_dispersion", Ignored("all wavelengths refract alike")),
    ("KHR_materials_iridescence", Ignored("there is no thin film")),
    ("KHR_materials_sheen", Ignored("there is no sheen")),
    ("KHR_materials_volume_scatter", Ignored("nothing scatters inside")),
    ("KHR_technique_webgl", Ignored("shaders are not run, the glTF material is used")),
    ("KHR_techniques_webgl", Ignored("shaders are not run, the glTF material is used")),
    ("NV_materials_mdl", Ignored("the glTF material is used")),
    ("EXT_texture_avif", Convert("`npx @gltf-transform/cli png in.glb out.glb --formats avif`")),
];

fn support(name: &str) -> Option<&'static Support> {
    let row = TABLE.iter().find(|(known, _)| *known == name)?;
    Some(&row.1)
}

/// The table as docs/extensions.md shows it, in Markdown.
pub fn extensions_table() -> String {
    let row = |title: &str, wanted: fn(&Support) -> bool| {
        let cells: Vec<String> = TABLE
            .iter()
            .filter(|(_, support)| wanted(support))
            .map(|(name, support)| match support {
                Full | Unseen => format!("`{name}`"),
                Approximated(text) | Ignored(text) | Convert(text) => format!("`{name}`: {text}"),
            })
            .collect();
        let separator = if wanted(&Full) || wanted(&Unseen) {
            ", "
        } else {
            "; "
        };
        format!("| {title} | {} |\n", cells.join(separator))
    };
    [
        "| becomes of it | extension |\n|---|---|\n".into(),
        row("supported", |s| *s == Full),
        row("no effect on pictures", |s| *s == Unseen),
        row("approximated", |s| matches!(s, Approximated(_))),
        row("left out, with a warning", |s| matches!(s, Ignored(_))),
        row("refused where required: convert the file", |s| {
            matches!(s, Convert(_))
        }),
    ]
    .concat()
}

/// Refuses what the file requires and lightfall cannot do; warns of what it only uses. Returns all that it
/// uses, with what becomes of it. It looks at the untyped document, because the gltf crate's types
/// drop the place of some extensions.
pub(super) fn check(json: &Value, warnings: &mut Warnings) -> Checked<Vec<(String, String)>> {
    for (i, name) in names(json, "extensionsRequired") {
        let fix = match support(name) {
            Some(Full | Unseen | Approximated(_) | Ignored(_)) => continue,
            Some(Convert(how)) => format!("convert the file: {}", how.replace('`', "")),
            None => {
                "it is unknown here; take it out of extensionsRequired to render without it".into()
            }
        };
        return Err(format!(
            "/extensionsRequired/{i}: the file requires {}, which is not supported; {fix}",
            shown(name)
        ));
    }
    let mut met = Vec::new();
    let mut seen = HashSet::new();
    let mut meet = |name: &str, path: &str, warned: bool| {
        if seen.insert(name.to_owned()) {
            met.push((name.to_owned(), becomes(name)));
        } else if !warned {
            return;
        }
        warn(name, path, warnings);
    };
    visit(json, &mut String::new(), &mut |name, path| {
        meet(name, path, true);
    });
    for (i, name) in names(json, "extensionsUsed") {
        meet(name, &format!("/extensionsUsed/{i}"), false);
    }
    Ok(met)
}

/// What becomes of an extension that a file uses and does not require, or that is not refused.
fn becomes(name: &str) -> String {
    match support(name) {
        Some(Full) => "supported".into(),
        Some(Unseen) => "no effect on pictures".into(),
        Some(Approximated(how)) => format!("approximated: {how}"),
        Some(Ignored(instead)) => format!("left out: {instead}"),
        Some(Convert(how)) => format!("ignored; convert the file: {}", how.replace('`', "")),
        None => "unknown here and ignored".into(),
    }
}

/// The strings in the root's array `key`, with their places.
fn names<'a>(json: &'a Value, key: &str) -> impl Iterator<Item = (usize, &'a str)> {
    let names = json.get(key).and_then(Value::as_array);
    let names = names.into_iter().flatten().enumerate();
    names.filter_map(|(i, name)| Some((i, name.as_str()?)))
}

fn warn(name: &str, path: &str, warnings: &mut Warnings) {
    if !matches!(support(name), Some(Full | Unseen)) {
        warnings.add(path, format_args!("{name} is {}", becomes(name)));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documentation_says_what_becomes_of_each_extension() {
        let document = include_str!("../../docs/extensions.md");
        let table = extensions_table();
        assert!(document.contains(&table), "the table must be\n{table}");
        for (i, (name, _)) in TABLE.iter().enumerate() {
            assert!(
                TABLE[..i].iter().all(|(before, _)| before != name),
                "{name} twice"
            );
        }
    }
}
