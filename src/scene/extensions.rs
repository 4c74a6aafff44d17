//! Which glTF extensions are done, and what becomes of a file that asks for others.

use std::collections::HashSet;

use super::json::{Checked, Json};
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

/// Refuses what the file requires and lightfall cannot do; warns of what it only uses.
pub(super) fn check(root: &Json, warnings: &mut Warnings) -> Checked<()> {
    for entry in root.items("extensionsRequired")? {
        let name = entry.as_text()?;
        match support(name) {
            Some(Full | Approximated(_)) => {}
            Some(Convert(fix)) => {
                return Err(entry.fault(format_args!(
                    "the file requires {name}, which is not supported; {fix}"
                )));
            }
            Some(Ignored(_)) | None => {
                return Err(entry.fault(format_args!(
                    "the file requires {name}, which is not supported"
                )));
            }
        }
    }
    let mut met = HashSet::new();
    root.each_extension(&mut |name, path| {
        met.insert(name.to_owned());
        warn(name, path, warnings);
    });
    for entry in root.items("extensionsUsed")? {
        let name = entry.as_text()?;
        if met.insert(name.to_owned()) {
            warn(name, entry.path(), warnings);
        }
    }
    Ok(())
}

fn warn(name: &str, path: &str, warnings: &mut Warnings) {
    match support(name) {
        Some(Full) => {}
        Some(Approximated(instead) | Ignored(instead)) => {
            warnings.add(path, &format!("{name} is not supported: {instead}"));
        }
        Some(Convert(fix)) => warnings.add(path, &format!("{name} is not supported; {fix}")),
        None => warnings.add(path, &format!("{name} is unknown here and ignored")),
    }
}
