//! Textures: one array of combined image samplers, the only descriptor set.

use std::collections::HashMap;
use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use super::commands::Commands;
use super::device::{Gpu, Shared};
use super::ray_pass::RAY_STAGES;
use crate::Result;
use crate::scene::Wrap;

/// The texels of one texture and how they are sampled.
#[derive(Debug, Clone, Copy)]
pub struct TextureData<'a> {
    pub width: u32,
    pub height: u32,
    /// 4 · width · height bytes, rows from v = 0.
    pub rgba8: &'a [u8],
    /// Sampling decodes the colour channels to linear.
    pub srgb: bool,
    /// For u and v.
    pub wrap: [Wrap; 2],
    /// Nearest texel instead of bilinear.
    pub nearest: bool,
}

/// Textures as shaders index them: `layout(set = 0, binding = 0) uniform sampler2D textures[]`.
#[derive(Clone)]
pub struct TextureArray {
    pub(super) raw: Arc<RawTextures>,
}

pub(super) struct RawTextures {
    shared: Arc<Shared>,
    pub set_layout: vk::DescriptorSetLayout,
    /// Freed with its pool.
    pub set: vk::DescriptorSet,
    pool: vk::DescriptorPool,
    /// Few, as devices may allow as few as 4000 (maxSamplerAllocationCount).
    samplers: HashMap<([vk::SamplerAddressMode; 2], vk::Filter), vk::Sampler>,
    textures: Vec<Arc<RawTexture>>,
}

struct RawTexture {
    shared: Arc<Shared>,
    image: vk::Image,
    view: vk::ImageView,
    allocation: Option<Allocation>,
}

impl Gpu {
    /// Uploads `textures`; their places become the indices in shaders. None is allowed.
    ///
    /// Fails without descriptor indexing, where a texture is too large or its bytes do not match its
    /// size, where there are too many, and where memory runs out.
    pub fn texture_array(&self, textures: &[TextureData]) -> Result<TextureArray> {
        let shared = &self.shared;
        let caps = &shared.info.caps;
        if !caps.descriptor_indexing {
            return Err(shared.error(
                "textures need Vulkan's descriptorIndexing; update the driver or use another --device",
            ));
        }
        if textures.len() > caps.max_textures as usize {
            return Err(shared.error(format!(
                "{} textures, the device allows {}",
                textures.len(),
                caps.max_textures
            )));
        }
        let mut raw = RawTextures {
            shared: shared.clone(),
            set_layout: vk::DescriptorSetLayout::null(),
            set: vk::DescriptorSet::null(),
            pool: vk::DescriptorPool::null(),
            samplers: HashMap::new(),
            textures: Vec::new(),
        };
        raw.create_set(textures.len() as u32)?;
        for (index, texture) in textures.iter().enumerate() {
            let uploaded = Arc::new(self.texture(index, texture)?);
            let sampler = raw.sampler(texture)?;
            raw.write_descriptor(index as u32, uploaded.view, sampler);
            raw.textures.push(uploaded);
        }
        Ok(TextureArray { raw: Arc::new(raw) })
    }

    fn texture(&self, index: usize, data: &TextureData) -> Result<RawTexture> {
        let shared = &self.shared;
        let &TextureData { width, height, .. } = data;
        let allowed = shared.info.caps.max_texture_size;
        if width.max(height) > allowed {
            return Err(shared.error(format!(
                "texture {index} has {width} × {height} texels, the device allows {allowed} × {allowed}; \
                 scale it down"
            )));
        }
        let bytes = 4 * width as usize * height as usize;
        if bytes == 0 || data.rgba8.len() != bytes {
            return Err(shared.error(format!(
                "texture {index} of {width} × {height} texels has {} bytes instead of {bytes}",
                data.rgba8.len()
            )));
        }
        let texture = Arc::new(RawTexture::new(shared, data)?);
        let staging = self.staging(bytes, MemoryLocation::CpuToGpu)?;
        staging.write(0, data.rgba8);
        let mut commands = self.commands()?;
        commands.hold(&staging);
        commands.hold(&texture);
        commands.upload(staging.raw, texture.image, width, height);
        commands.submit()?;
        Arc::into_inner(texture).ok_or_else(|| shared.error("texture upload still in use"))
    }
}

impl Commands {
    /// Records the copy of all texels to a new image and makes it readable by shaders.
    fn upload(&mut self, from: vk::Buffer, to: vk::Image, width: u32, height: u32) {
        use vk::{AccessFlags as Access, ImageLayout as Layout, PipelineStageFlags as Stage};
        let layers = vk::ImageSubresourceLayers::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .layer_count(1);
        let region = vk::BufferImageCopy::default()
            .image_subresource(layers)
            .image_extent(extent(width, height));
        let writable = transition(to)
            .dst_access_mask(Access::TRANSFER_WRITE)
            .old_layout(Layout::UNDEFINED)
            .new_layout(Layout::TRANSFER_DST_OPTIMAL);
        let readable = transition(to)
            .src_access_mask(Access::TRANSFER_WRITE)
            .dst_access_mask(Access::SHADER_READ)
            .old_layout(Layout::TRANSFER_DST_OPTIMAL)
            .new_layout(Layout::SHADER_READ_ONLY_OPTIMAL);
        // SAFETY: recording; the caller holds buffer and image, which are both of this size.
        self.untimed(|shared, buffer| unsafe {
            let device = &shared.device;
            let none = vk::DependencyFlags::empty();
            let (top, copy, shader) = (Stage::TOP_OF_PIPE, Stage::TRANSFER, shared.pass_stages());
            device.cmd_pipeline_barrier(buffer, top, copy, none, &[], &[], &[writable]);
            let layout = Layout::TRANSFER_DST_OPTIMAL;
            device.cmd_copy_buffer_to_image(buffer, from, to, layout, &[region]);
            device.cmd_pipeline_barrier(buffer, copy, shader, none, &[], &[], &[readable]);
        });
    }
}

impl RawTextures {
    /// Update after bind, as without it some devices allow only a few textures.
    fn create_set(&mut self, count: u32) -> Result<()> {
        let shared = &self.shared;
        let device = &shared.device;
        let kind = vk::DescriptorType::COMBINED_IMAGE_SAMPLER;
        let mut stages = vk::ShaderStageFlags::COMPUTE;
        if shared.pipelines.is_some() {
            stages |= RAY_STAGES;
        }
        let bindings = [vk::DescriptorSetLayoutBinding::default()
            .descriptor_type(kind)
            .descriptor_count(count)
            .stage_flags(stages)];
        let flags = [vk::DescriptorBindingFlags::UPDATE_AFTER_BIND];
        let mut flags =
            vk::DescriptorSetLayoutBindingFlagsCreateInfo::default().binding_flags(&flags);
        let layout_info = vk::DescriptorSetLayoutCreateInfo::default()
            .bindings(&bindings)
            .flags(vk::DescriptorSetLayoutCreateFlags::UPDATE_AFTER_BIND_POOL)
            .push_next(&mut flags);
        let sizes = [vk::DescriptorPoolSize {
            ty: kind,
            descriptor_count: count.max(1),
        }];
        let pool_info = vk::DescriptorPoolCreateInfo::default()
            .flags(vk::DescriptorPoolCreateFlags::UPDATE_AFTER_BIND)
            .max_sets(1)
            .pool_sizes(&sizes);
        // SAFETY: valid infos that outlive the calls; drop frees what was made.
        unsafe {
            self.set_layout = device
                .create_descriptor_set_layout(&layout_info, None)
                .map_err(shared.fault("vkCreateDescriptorSetLayout of the textures"))?;
            self.pool = device
                .create_descriptor_pool(&pool_info, None)
                .map_err(shared.fault("vkCreateDescriptorPool of the textures"))?;
            let layouts = [self.set_layout];
            let set_info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(self.pool)
                .set_layouts(&layouts);
            self.set = device
                .allocate_descriptor_sets(&set_info)
                .map_err(shared.fault("vkAllocateDescriptorSets of the textures"))?
                .into_iter()
                .next()
                .unwrap_or_default();
        }
        Ok(())
    }

    fn sampler(&mut self, texture: &TextureData) -> Result<vk::Sampler> {
        let filter = match texture.nearest {
            true => vk::Filter::NEAREST,
            false => vk::Filter::LINEAR,
        };
        let wrap = texture.wrap.map(address_mode);
        if let Some(sampler) = self.samplers.get(&(wrap, filter)) {
            return Ok(*sampler);
        }
        let [u, v] = wrap;
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(filter)
            .min_filter(filter)
            .address_mode_u(u)
            .address_mode_v(v);
        // SAFETY: valid info; drop frees it.
        let sampler = unsafe { self.shared.device.create_sampler(&info, None) }
            .map_err(self.shared.fault("vkCreateSampler"))?;
        self.samplers.insert((wrap, filter), sampler);
        Ok(sampler)
    }

    fn write_descriptor(&self, index: u32, view: vk::ImageView, sampler: vk::Sampler) {
        let image = [vk::DescriptorImageInfo {
            sampler,
            image_view: view,
            image_layout: vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
        }];
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .dst_array_element(index)
            .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
            .image_info(&image);
        // SAFETY: in range; the set is not in use before `texture_array` returns.
        unsafe { self.shared.device.update_descriptor_sets(&[write], &[]) };
    }
}

impl RawTexture {
    fn new(shared: &Arc<Shared>, data: &TextureData) -> Result<Self> {
        let device = &shared.device;
        let format = match data.srgb {
            true => vk::Format::R8G8B8A8_SRGB,
            false => vk::Format::R8G8B8A8_UNORM,
        };
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(extent(data.width, data.height))
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST);
        let mut texture = Self {
            shared: shared.clone(),
            image: vk::Image::null(),
            view: vk::ImageView::null(),
            allocation: None,
        };
        // SAFETY: every Vulkan device samples these formats; drop frees what was made.
        unsafe {
            texture.image = device
                .create_image(&info, None)
                .map_err(shared.fault("vkCreateImage"))?;
            let requirements = device.get_image_memory_requirements(texture.image);
            let allocation =
                shared.allocate("a texture", requirements, MemoryLocation::GpuOnly, false)?;
            let (memory, offset) = (allocation.memory(), allocation.offset());
            texture.allocation = Some(allocation);
            device
                .bind_image_memory(texture.image, memory, offset)
                .map_err(shared.fault("vkBindImageMemory"))?;
            let view_info = vk::ImageViewCreateInfo::default()
                .image(texture.image)
                .view_type(vk::ImageViewType::TYPE_2D)
                .format(format)
                .subresource_range(whole());
            texture.view = device
                .create_image_view(&view_info, None)
                .map_err(shared.fault("vkCreateImageView"))?;
        }
        Ok(texture)
    }
}

impl Drop for RawTextures {
    fn drop(&mut self) {
        let device = &self.shared.device;
        // SAFETY: no submitted work uses them: passes hold them, and `Running` its passes until it was waited for.
        unsafe {
            device.destroy_descriptor_pool(self.pool, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
            for sampler in self.samplers.values() {
                device.destroy_sampler(*sampler, None);
            }
        }
    }
}

impl Drop for RawTexture {
    fn drop(&mut self) {
        // SAFETY: as for `RawTextures`, which holds this.
        unsafe {
            self.shared.device.destroy_image_view(self.view, None);
            self.shared.device.destroy_image(self.image, None);
        }
        self.shared.free(self.allocation.take());
    }
}

fn address_mode(wrap: Wrap) -> vk::SamplerAddressMode {
    match wrap {
        Wrap::Repeat => vk::SamplerAddressMode::REPEAT,
        Wrap::Mirror => vk::SamplerAddressMode::MIRRORED_REPEAT,
        Wrap::Clamp => vk::SamplerAddressMode::CLAMP_TO_EDGE,
    }
}

fn transition(image: vk::Image) -> vk::ImageMemoryBarrier<'static> {
    vk::ImageMemoryBarrier::default()
        .image(image)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .subresource_range(whole())
}

fn whole() -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        level_count: 1,
        layer_count: 1,
        ..Default::default()
    }
}

fn extent(width: u32, height: u32) -> vk::Extent3D {
    vk::Extent3D {
        width,
        height,
        depth: 1,
    }
}
