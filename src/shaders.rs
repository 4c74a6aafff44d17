//! Every pass in every variant: one row here is one file in `glsl/spirv/`, compiled by
//! `tools/compile-shaders` from `glsl/`.

use crate::{Error, Result};
use include_dir::{Dir, include_dir};

/// A compiled variant of a pass.
pub struct Shader {
    /// `glsl/spirv/<stem>.spv`: the pass, then the variant's parts.
    pub stem: &'static str,
    /// Under `glsl/`.
    pub source: &'static str,
    /// Defines choose code: which traversal, textures or none.
    pub defines: &'static [&'static str],
}

macro_rules! shaders {
    ($($stem:literal $source:literal [$($define:literal)*],)*) => {
        /// All shaders.
        pub const SHADERS: &[Shader] = &[$(Shader {
            stem: $stem,
            source: $source,
            defines: &[$($define),*],
        }),*];
    };
}

shaders! {
    "view.software" "common/view.comp" [],
    "view.software.textured" "common/view.comp" ["TEXTURES"],
    "view.query" "common/view.comp" ["TRACE_QUERY"],
    "view.query.textured" "common/view.comp" ["TRACE_QUERY" "TEXTURES"],
    "view.pipeline" "common/view.comp" ["TRACE_PIPELINE"],
    "view.pipeline.textured" "common/view.comp" ["TRACE_PIPELINE" "TEXTURES"],
    "emit.software" "common/emit.comp" [],
    "emit.software.textured" "common/emit.comp" ["TEXTURES"],
    "emit.query" "common/emit.comp" ["TRACE_QUERY"],
    "emit.query.textured" "common/emit.comp" ["TRACE_QUERY" "TEXTURES"],
    "emit.pipeline" "common/emit.comp" ["TRACE_PIPELINE"],
    "emit.pipeline.textured" "common/emit.comp" ["TRACE_PIPELINE" "TEXTURES"],
    "primaries" "guide/primaries.comp" [],
    "importance.software" "guide/importance.comp" [],
    "importance.software.textured" "guide/importance.comp" ["TEXTURES"],
    "importance.query" "guide/importance.comp" ["TRACE_QUERY"],
    "importance.query.textured" "guide/importance.comp" ["TRACE_QUERY" "TEXTURES"],
    "importance.pipeline" "guide/importance.comp" ["TRACE_PIPELINE"],
    "importance.pipeline.textured" "guide/importance.comp" ["TRACE_PIPELINE" "TEXTURES"],
    "scene.closest" "common/scene.rchit" ["TRACE_PIPELINE"],
    "scene.miss" "common/scene.rmiss" ["TRACE_PIPELINE"],
    "scene.any" "common/scene.rahit" ["TRACE_PIPELINE"],
    "scene.any.textured" "common/scene.rahit" ["TRACE_PIPELINE" "TEXTURES"],
    "photon.intersection" "common/photon.rint" ["TRACE_PIPELINE"],
    "photon.any" "common/photon.rahit" ["TRACE_PIPELINE"],
    "cull" "common/cull.comp" [],
    "scan" "common/scan.comp" [],
    "scan_add" "common/scan_add.comp" [],
    "photon_keys" "common/photon_keys.comp" [],
    "sort_count" "common/sort_count.comp" [],
    "sort_scatter" "common/sort_scatter.comp" [],
    "film" "common/film.comp" [],
    "place.positions" "common/place.comp" [],
    "place.boxes" "common/place.comp" ["TRACE_QUERY"],
    "rtpm.tree" "rtpm/tree.comp" [],
    "rtpm.gather.software" "common/gather.comp" [],
    "rtpm.gather.query" "common/gather.comp" ["TRACE_QUERY"],
    "rtpm.gather.pipeline" "common/gather.comp" ["TRACE_PIPELINE"],
    "hash-grid.keys" "common/photon_keys.comp" ["NEAR_GRID"],
    "hash-grid.starts" "hash-grid/starts.comp" [],
    "hash-grid.gather" "common/gather.comp" ["NEAR_GRID"],
    "sppm.gather.software" "common/gather.comp" ["PIXEL_RADII"],
    "sppm.gather.query" "common/gather.comp" ["TRACE_QUERY" "PIXEL_RADII"],
    "sppm.gather.pipeline" "common/gather.comp" ["TRACE_PIPELINE" "PIXEL_RADII"],
    "sppm.shrink" "sppm/shrink.comp" [],
    "path.software" "path/path.comp" [],
    "path.software.textured" "path/path.comp" ["TEXTURES"],
    "path.query" "path/path.comp" ["TRACE_QUERY"],
    "path.query.textured" "path/path.comp" ["TRACE_QUERY" "TEXTURES"],
    "path.pipeline" "path/path.comp" ["TRACE_PIPELINE"],
    "path.pipeline.textured" "path/path.comp" ["TRACE_PIPELINE" "TEXTURES"],
    "hash-ppm.keys" "common/photon_keys.comp" ["NEAR_LISTS"],
    "hash-ppm.insert" "hash-ppm/insert.comp" [],
    "hash-ppm.gather" "common/gather.comp" ["NEAR_LISTS"],
    "bench.cells.keys" "common/photon_keys.comp" ["NEAR_CELLS"],
    "bench.cells.gather" "common/gather.comp" ["NEAR_CELLS"],
    "bench.rays.software" "bench/rays.comp" [],
    "bench.rays.query" "bench/rays.comp" ["TRACE_QUERY"],
    "bench.rays.pipeline" "bench/rays.comp" ["TRACE_PIPELINE"],
    "doctor.addresses" "doctor/addresses.comp" [],
    "doctor.boxes.query" "doctor/boxes.comp" [],
    "doctor.boxes.pipeline" "doctor/boxes.comp" ["TRACE_PIPELINE"],
    "doctor.boxes.any" "doctor/boxes.rahit" ["TRACE_PIPELINE"],
    "doctor.boxes.intersection" "doctor/boxes.rint" ["TRACE_PIPELINE"],
}

static SPIRV: Dir = include_dir!("$CARGO_MANIFEST_DIR/glsl/spirv");

/// The SPIR-V of a stem.
///
/// # Errors
/// The binary was built without it: `tools/compile-shaders` has not run since the row was added.
pub fn spirv(stem: &str) -> Result<&'static [u8]> {
    SPIRV
        .get_file(format!("{stem}.spv"))
        .map(|file| file.contents())
        .ok_or_else(|| Error::Device {
            device: "any".into(),
            fault: format!(
                "this build lacks the shader {stem}; run tools/compile-shaders and build again"
            ),
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shader_is_compiled() {
        for shader in SHADERS {
            assert!(spirv(shader.stem).is_ok(), "{}", shader.stem);
        }
    }
}
