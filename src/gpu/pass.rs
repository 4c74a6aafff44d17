//! Compute pipelines, and what ray tracing pipelines share with them.

use std::io::Cursor;
use std::sync::Arc;

use ash::vk;

use super::binding_table::BindingTable;
use super::device::{Gpu, Shared};
use super::texture::{RawTextures, TextureArray};
use crate::Result;

/// Threads in a work group of every pass.
pub const GROUP_SIZE: u32 = 64;
/// What every Vulkan device allows in push constants.
pub const MAX_PUSH_BYTES: u32 = 128;

/// A shader, ready to run.
pub struct Pass {
    pub(super) name: &'static str,
    pub(super) raw: Arc<RawPass>,
}

pub(super) struct RawPass {
    shared: Arc<Shared>,
    /// That see push constants.
    pub stages: vk::ShaderStageFlags,
    pub layout: vk::PipelineLayout,
    pub pipeline: vk::Pipeline,
    /// Bound as set 0.
    pub textures: Option<Arc<RawTextures>>,
    /// Of a ray tracing pipeline.
    pub table: Option<BindingTable>,
}

impl Gpu {
    /// Compiles `spirv` (entry point `main`, local size [`GROUP_SIZE`]).
    ///
    /// `specialization` gives the constants with ids 0, 1, …; ids beyond keep their defaults.
    /// `textures` becomes set 0, binding 0, of every dispatch.
    pub fn pass(
        &self,
        name: &'static str,
        spirv: &[u8],
        specialization: &[u32],
        textures: Option<&TextureArray>,
    ) -> Result<Pass> {
        let shared = &self.shared;
        let mut pass = RawPass::new(shared, name, vk::ShaderStageFlags::COMPUTE, textures)?;
        let constants = Constants::new(specialization);
        let constants = constants.info();
        let module = Module::new(shared, name, spirv)?;
        let mut stage = module.stage(vk::ShaderStageFlags::COMPUTE, &constants);
        let caps = &shared.info.caps;
        let mut size = vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo::default()
            .required_subgroup_size(caps.subgroup_size);
        if caps.subgroup_control && uses_subgroups(spirv) {
            // Some drivers choose among several, and fill them in part.
            stage = stage
                .flags(vk::PipelineShaderStageCreateFlags::REQUIRE_FULL_SUBGROUPS)
                .push_next(&mut size);
        }
        let info = vk::ComputePipelineCreateInfo::default()
            .stage(stage)
            .layout(pass.layout);
        let cache = vk::PipelineCache::null();
        // SAFETY: the info and what it points at outlive the call; the pipeline goes into `pass`, whose drop
        // frees it. The SPIR-V is our own.
        let created = unsafe { shared.device.create_compute_pipelines(cache, &[info], None) };
        let pipelines = created.map_err(|(_, result)| {
            shared.fault(&format!("vkCreateComputePipelines of pass {name}"))(result)
        })?;
        pass.pipeline = pipelines.into_iter().next().unwrap_or_default();
        Ok(Pass {
            name,
            raw: Arc::new(pass),
        })
    }
}

impl RawPass {
    /// Without a pipeline yet.
    pub fn new(
        shared: &Arc<Shared>,
        name: &str,
        stages: vk::ShaderStageFlags,
        textures: Option<&TextureArray>,
    ) -> Result<Self> {
        let textures = textures.map(|textures| textures.raw.clone());
        let push_constants = [vk::PushConstantRange::default()
            .stage_flags(stages)
            .size(MAX_PUSH_BYTES)];
        let set_layouts: Vec<_> = textures.iter().map(|t| t.set_layout).collect();
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&set_layouts)
            .push_constant_ranges(&push_constants);
        // SAFETY: the info and what it points at outlive the call; drop frees the layout.
        let layout = unsafe { shared.device.create_pipeline_layout(&info, None) }
            .map_err(shared.fault(&format!("vkCreatePipelineLayout of pass {name}")))?;
        Ok(Self {
            shared: shared.clone(),
            stages,
            layout,
            pipeline: vk::Pipeline::null(),
            textures,
            table: None,
        })
    }
}

/// Whether a shader declares one of the capabilities GroupNonUniform, …Vote, …Arithmetic, …Ballot and so on.
fn uses_subgroups(spirv: &[u8]) -> bool {
    const HEADER_BYTES: usize = 20;
    const OP_CAPABILITY: [u8; 4] = [17, 0, 2, 0];
    let (instructions, _) = spirv
        .get(HEADER_BYTES..)
        .unwrap_or_default()
        .as_chunks::<8>();
    // Capabilities come first.
    instructions
        .iter()
        .map_while(|instruction| instruction.strip_prefix(&OP_CAPABILITY))
        .any(|capability| matches!(capability, [61..=68, 0, 0, 0]))
}

/// A shader until its pipeline is made.
pub(super) struct Module<'a> {
    shared: &'a Shared,
    raw: vk::ShaderModule,
}

impl<'a> Module<'a> {
    pub fn new(shared: &'a Shared, name: &str, spirv: &[u8]) -> Result<Self> {
        let code = ash::util::read_spv(&mut Cursor::new(spirv))
            .map_err(|e| shared.error(format!("pass {name}: the shader is not SPIR-V: {e}")))?;
        let info = vk::ShaderModuleCreateInfo::default().code(&code);
        // SAFETY: the info outlives the call; drop frees the module. The SPIR-V is our own.
        let raw = unsafe { shared.device.create_shader_module(&info, None) }
            .map_err(shared.fault(&format!("vkCreateShaderModule of pass {name}")))?;
        Ok(Self { shared, raw })
    }

    pub fn stage<'b>(
        &self,
        stage: vk::ShaderStageFlags,
        constants: &'b vk::SpecializationInfo<'b>,
    ) -> vk::PipelineShaderStageCreateInfo<'b> {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(stage)
            .module(self.raw)
            .name(c"main")
            .specialization_info(constants)
    }
}

impl Drop for Module<'_> {
    fn drop(&mut self) {
        // SAFETY: pipelines do not need it once they are made.
        unsafe { self.shared.device.destroy_shader_module(self.raw, None) };
    }
}

/// Specialization constants with ids 0, 1, ….
pub(super) struct Constants<'a> {
    entries: Vec<vk::SpecializationMapEntry>,
    values: &'a [u32],
}

impl<'a> Constants<'a> {
    pub fn new(values: &'a [u32]) -> Self {
        let entry = |(id, _)| vk::SpecializationMapEntry {
            constant_id: id,
            offset: id * 4,
            size: 4,
        };
        Self {
            entries: (0u32..).zip(values).map(entry).collect(),
            values,
        }
    }

    pub fn info(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default()
            .map_entries(&self.entries)
            .data(bytemuck::cast_slice(self.values))
    }
}

impl Drop for RawPass {
    fn drop(&mut self) {
        // SAFETY: no submitted work uses it: `Running` holds the passes of its work until it was waited for.
        unsafe {
            self.shared.device.destroy_pipeline(self.pipeline, None);
            self.shared
                .device
                .destroy_pipeline_layout(self.layout, None);
        }
    }
}
