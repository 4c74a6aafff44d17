//! Compute pipelines.

use std::io::Cursor;
use std::sync::Arc;

use ash::vk;

use super::device::{Gpu, Shared};
use super::texture::{RawTextures, TextureArray};
use crate::Result;

/// Threads in a work group of every pass.
pub const GROUP_SIZE: u32 = 64;
/// What every Vulkan device allows in push constants.
pub const MAX_PUSH_BYTES: u32 = 128;

/// A compute shader, ready to run.
pub struct Pass {
    pub(super) name: &'static str,
    pub(super) raw: Arc<RawPass>,
}

pub(super) struct RawPass {
    shared: Arc<Shared>,
    pub layout: vk::PipelineLayout,
    pub pipeline: vk::Pipeline,
    /// Bound as set 0.
    pub textures: Option<Arc<RawTextures>>,
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
        let code = ash::util::read_spv(&mut Cursor::new(spirv))
            .map_err(|e| shared.error(format!("pass {name}: the shader is not SPIR-V: {e}")))?;
        let mut pass = RawPass {
            shared: shared.clone(),
            layout: vk::PipelineLayout::null(),
            pipeline: vk::Pipeline::null(),
            textures: textures.map(|textures| textures.raw.clone()),
        };
        let push_constants = [vk::PushConstantRange::default()
            .stage_flags(vk::ShaderStageFlags::COMPUTE)
            .size(MAX_PUSH_BYTES)];
        let set_layouts: Vec<_> = pass.textures.iter().map(|t| t.set_layout).collect();
        let layout_info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&set_layouts)
            .push_constant_ranges(&push_constants);
        let entries: Vec<_> = (0u32..)
            .zip(specialization)
            .map(|(id, _)| vk::SpecializationMapEntry {
                constant_id: id,
                offset: id * 4,
                size: 4,
            })
            .collect();
        let constants = vk::SpecializationInfo::default()
            .map_entries(&entries)
            .data(bytemuck::cast_slice(specialization));
        let device = &shared.device;
        // SAFETY: infos and what they point at outlive the calls; handles go into `pass`, whose drop
        // frees them on any failure. The SPIR-V is our own.
        unsafe {
            pass.layout = device
                .create_pipeline_layout(&layout_info, None)
                .map_err(shared.fault(&format!("vkCreatePipelineLayout of pass {name}")))?;
            let module_info = vk::ShaderModuleCreateInfo::default().code(&code);
            let module = device
                .create_shader_module(&module_info, None)
                .map_err(shared.fault(&format!("vkCreateShaderModule of pass {name}")))?;
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(c"main")
                .specialization_info(&constants);
            let info = vk::ComputePipelineCreateInfo::default()
                .stage(stage)
                .layout(pass.layout);
            let created = device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None);
            device.destroy_shader_module(module, None);
            let pipelines = created.map_err(|(_, result)| {
                shared.fault(&format!("vkCreateComputePipelines of pass {name}"))(result)
            })?;
            pass.pipeline = pipelines.into_iter().next().unwrap_or_default();
        }
        Ok(Pass {
            name,
            raw: Arc::new(pass),
        })
    }
}

impl Drop for RawPass {
    fn drop(&mut self) {
        // SAFETY: no submitted work uses it: `Commands` holds what it uses until it was waited for.
        unsafe {
            self.shared.device.destroy_pipeline(self.pipeline, None);
            self.shared
                .device
                .destroy_pipeline_layout(self.layout, None);
        }
    }
}
