//! Ray tracing pipelines.

use std::sync::Arc;

use ash::vk;

use super::binding_table::BindingTable;
use super::device::Gpu;
use super::pass::{Constants, Module, Pass, RawPass};
use super::texture::TextureArray;
use crate::Result;

/// SPIR-V (entry points `main`) of the shaders that a pass's rays call; all share its constants, push
/// constants and textures.
#[derive(Debug, Clone, Copy, Default)]
pub struct RayShaders<'a> {
    pub miss: Option<&'a [u8]>,
    pub closest_hit: Option<&'a [u8]>,
    pub any_hit: Option<&'a [u8]>,
    /// Where rays meet boxes instead of triangles.
    pub intersection: Option<&'a [u8]>,
}

impl Gpu {
    /// As [`Gpu::pass`], for a ray generation shader, of which an invocation is a thread. Rays must not be traced
    /// by the shaders that rays call, and all find the same ones (index, offset and stride 0).
    ///
    /// Fails without VK_KHR_ray_tracing_pipeline too.
    pub fn ray_pass(
        &self,
        name: &'static str,
        generation: &[u8],
        called: &RayShaders,
        specialization: &[u32],
        textures: Option<&TextureArray>,
    ) -> Result<Pass> {
        use vk::ShaderStageFlags as Stage;
        let shared = &self.shared;
        let Some(functions) = &shared.pipelines else {
            return Err(shared.error(format!(
                "pass {name} needs VK_KHR_ray_tracing_pipeline; use another --trace"
            )));
        };
        let mut pass = RawPass::new(shared, name, RAY_STAGES, textures)?;
        let constants = Constants::new(specialization);
        let constants = constants.info();
        let mut modules = Vec::new();
        let mut stages = Vec::new();
        let mut add = |stage, spirv: Option<&[u8]>| -> Result<u32> {
            let Some(spirv) = spirv else {
                return Ok(vk::SHADER_UNUSED_KHR);
            };
            let module = Module::new(shared, name, spirv)?;
            stages.push(module.stage(stage, &constants));
            modules.push(module);
            Ok(stages.len() as u32 - 1)
        };
        let general =
            |shader| group(vk::RayTracingShaderGroupTypeKHR::GENERAL).general_shader(shader);
        let mut groups = vec![general(add(Stage::RAYGEN_KHR, Some(generation))?)];
        if called.miss.is_some() {
            groups.push(general(add(Stage::MISS_KHR, called.miss)?));
        }
        let hit = match called.intersection {
            Some(_) => vk::RayTracingShaderGroupTypeKHR::PROCEDURAL_HIT_GROUP,
            None => vk::RayTracingShaderGroupTypeKHR::TRIANGLES_HIT_GROUP,
        };
        groups.push(
            group(hit)
                .closest_hit_shader(add(Stage::CLOSEST_HIT_KHR, called.closest_hit)?)
                .any_hit_shader(add(Stage::ANY_HIT_KHR, called.any_hit)?)
                .intersection_shader(add(Stage::INTERSECTION_KHR, called.intersection)?),
        );
        let info = vk::RayTracingPipelineCreateInfoKHR::default()
            .stages(&stages)
            .groups(&groups)
            .max_pipeline_ray_recursion_depth(1)
            .layout(pass.layout);
        let (deferred, cache) = (vk::DeferredOperationKHR::null(), vk::PipelineCache::null());
        let size = shared.info.caps.binding_rules.handle_size as usize;
        // SAFETY: infos and what they point at outlive the calls; the pipeline goes into `pass`, whose drop
        // frees it. The SPIR-V is our own. As many handles are asked for as there are groups.
        let handles = unsafe {
            pass.pipeline = functions
                .create_ray_tracing_pipelines(deferred, cache, &[info], None)
                .map_err(|(_, result)| {
                    shared.fault(&format!("vkCreateRayTracingPipelinesKHR of pass {name}"))(result)
                })?
                .into_iter()
                .next()
                .unwrap_or_default();
            functions
                .get_ray_tracing_shader_group_handles(
                    pass.pipeline,
                    0,
                    groups.len() as u32,
                    groups.len() * size,
                )
                .map_err(shared.fault(&format!("vkGetRayTracingShaderGroupHandlesKHR of {name}")))?
        };
        let mut handles = handles.chunks_exact(size.max(1));
        let mut next = || handles.next().unwrap_or_default();
        let generation = next();
        let miss = if called.miss.is_some() { next() } else { &[] };
        pass.table = Some(BindingTable::new(self, name, [generation, miss, next()])?);
        Ok(Pass {
            name,
            raw: Arc::new(pass),
        })
    }
}

/// What sees push constants and textures.
pub(super) const RAY_STAGES: vk::ShaderStageFlags = vk::ShaderStageFlags::from_raw(
    vk::ShaderStageFlags::RAYGEN_KHR.as_raw()
        | vk::ShaderStageFlags::MISS_KHR.as_raw()
        | vk::ShaderStageFlags::CLOSEST_HIT_KHR.as_raw()
        | vk::ShaderStageFlags::ANY_HIT_KHR.as_raw()
        | vk::ShaderStageFlags::INTERSECTION_KHR.as_raw(),
);

fn group(ty: vk::RayTracingShaderGroupTypeKHR) -> vk::RayTracingShaderGroupCreateInfoKHR<'static> {
    vk::RayTracingShaderGroupCreateInfoKHR::default()
        .ty(ty)
        .general_shader(vk::SHADER_UNUSED_KHR)
        .closest_hit_shader(vk::SHADER_UNUSED_KHR)
        .any_hit_shader(vk::SHADER_UNUSED_KHR)
        .intersection_shader(vk::SHADER_UNUSED_KHR)
}
