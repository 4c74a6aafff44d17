//! What a device is and can do.

use std::ffi::CStr;

use ash::{ext, khr, vk};

use super::binding_table::BindingRules;
use super::instance::Instance;
use super::pass::GROUP_SIZE;

/// A Vulkan device as the driver describes it.
#[derive(Debug, Clone)]
pub struct DeviceInfo {
    /// Its place in the driver's list; what `--device` takes.
    pub index: usize,
    pub name: String,
    /// Name and version of the driver.
    pub driver: String,
    pub kind: DeviceKind,
    pub api_version: (u32, u32, u32),
    pub caps: Caps,
}

/// Ordered from the most to the least wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    Discrete,
    Integrated,
    Virtual,
    Other,
    Cpu,
}

/// What a device can do and how much of it.
#[derive(Debug, Clone, Default)]
pub struct Caps {
    /// VK_KHR_ray_query with VK_KHR_acceleration_structure.
    pub ray_query: bool,
    /// VK_KHR_ray_tracing_pipeline, likewise.
    pub ray_tracing_pipeline: bool,
    /// What a [`super::TextureArray`] needs.
    pub descriptor_indexing: bool,
    /// What lightfall requires and this device lacks; usable where empty.
    pub missing: Vec<&'static str>,
    pub max_push_constants: u32,
    /// Nanoseconds per tick; 0 where the device has no timestamps.
    pub timestamp_period_ns: f32,
    /// Of an acceleration structure; 0 without any.
    pub max_primitive_count: u64,
    /// Bytes; of an acceleration structure's scratch memory.
    pub scratch_alignment: u32,
    /// Bytes that one buffer may have.
    pub max_allocation: u64,
    /// Size of the largest device-local heap.
    pub memory_bytes: u64,
    /// Texels along an edge of a texture.
    pub max_texture_size: u32,
    /// Textures in a [`super::TextureArray`].
    pub max_textures: u32,
    /// Threads of a subgroup, where those of a compute shader can vote, broadcast and reduce; else 0.
    pub subgroup_size: u32,
    /// Shaders can ask for full subgroups of that size (VK_EXT_subgroup_size_control); elsewhere the driver is taken at its word.
    pub(super) subgroup_control: bool,
    pub(super) binding_rules: BindingRules,
    /// Queue family for all work and its count of valid timestamp bits.
    pub(super) queue_family: u32,
    pub(super) timestamp_bits: u32,
    /// All of the device's memory is mapped and cached on the host: no staging.
    pub(crate) unified: bool,
}

impl Caps {
    /// Something traces acceleration structures.
    pub fn traces_structures(&self) -> bool {
        self.ray_query || self.ray_tracing_pipeline
    }
}

impl DeviceInfo {
    /// Nothing that lightfall requires is missing.
    pub fn usable(&self) -> bool {
        self.caps.missing.is_empty()
    }

    /// Ray query runs on ray tracing cores, as far as Vulkan tells: what `--trace auto` goes by. A
    /// CPU device's ray query loses to our own traversal.
    pub fn traces_in_hardware(&self) -> bool {
        self.caps.ray_query && self.kind != DeviceKind::Cpu
    }
}

/// Asks the driver about `physical`, the device at `index` of its list.
pub(super) fn describe(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    index: usize,
) -> DeviceInfo {
    let raw = &instance.raw;
    // SAFETY: `physical` belongs to `instance`.
    let properties = unsafe { raw.get_physical_device_properties(physical) };
    let version = properties.api_version;
    let kind = kind(properties.device_type);
    let mut caps = Caps {
        max_push_constants: properties.limits.max_push_constants_size,
        max_texture_size: properties.limits.max_image_dimension2_d,
        scratch_alignment: 1,
        ..Caps::default()
    };
    let mut driver = String::new();
    if version < vk::API_VERSION_1_2 {
        caps.missing.push("Vulkan 1.2");
    } else {
        driver = describe_1_2(raw, physical, &mut caps);
    }
    describe_queue(raw, physical, &mut caps);
    if caps.timestamp_bits > 0 {
        caps.timestamp_period_ns = properties.limits.timestamp_period;
    }
    describe_memory(raw, physical, kind, &mut caps);
    DeviceInfo {
        index,
        name: text(properties.device_name_as_c_str()),
        driver,
        kind,
        api_version: (
            vk::api_version_major(version),
            vk::api_version_minor(version),
            vk::api_version_patch(version),
        ),
        caps,
    }
}

/// Features and limits that only a Vulkan 1.2 device can be asked for; returns the driver's name.
fn describe_1_2(raw: &ash::Instance, physical: vk::PhysicalDevice, caps: &mut Caps) -> String {
    // SAFETY: `physical` belongs to the instance.
    let extensions =
        unsafe { raw.enumerate_device_extension_properties(physical) }.unwrap_or_default();
    let has = |name: &CStr| {
        extensions
            .iter()
            .any(|e| e.extension_name_as_c_str() == Ok(name))
    };
    let has_accel =
        has(khr::acceleration_structure::NAME) && has(khr::deferred_host_operations::NAME);
    let has_query = has_accel && has(khr::ray_query::NAME);
    let has_pipeline = has_accel && has(khr::ray_tracing_pipeline::NAME);
    let has_control = has(ext::subgroup_size_control::NAME);

    let mut f12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut accel = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default();
    let mut query = vk::PhysicalDeviceRayQueryFeaturesKHR::default();
    let mut pipeline = vk::PhysicalDeviceRayTracingPipelineFeaturesKHR::default();
    let mut control = vk::PhysicalDeviceSubgroupSizeControlFeatures::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut f12);
    let mut p11 = vk::PhysicalDeviceVulkan11Properties::default();
    let mut p12 = vk::PhysicalDeviceVulkan12Properties::default();
    let mut p_accel = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
    let mut p_pipeline = vk::PhysicalDeviceRayTracingPipelinePropertiesKHR::default();
    let mut p_control = vk::PhysicalDeviceSubgroupSizeControlProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default()
        .push_next(&mut p11)
        .push_next(&mut p12);
    if has_control {
        features = features.push_next(&mut control);
        properties = properties.push_next(&mut p_control);
    }
    if has_accel {
        features = features.push_next(&mut accel);
        properties = properties.push_next(&mut p_accel);
    }
    if has_query {
        features = features.push_next(&mut query);
    }
    if has_pipeline {
        features = features.push_next(&mut pipeline);
        properties = properties.push_next(&mut p_pipeline);
    }
    // SAFETY: the chained structs outlive the calls, and the device knows each of them.
    unsafe {
        raw.get_physical_device_features2(physical, &mut features);
        raw.get_physical_device_properties2(physical, &mut properties);
    }

    let int64 = features.features.shader_int64;
    for (present, name) in [
        (int64, "shaderInt64"),
        (f12.buffer_device_address, "bufferDeviceAddress"),
        (f12.scalar_block_layout, "scalarBlockLayout"),
    ] {
        if present == vk::FALSE {
            caps.missing.push(name);
        }
    }
    let subgroup_operations = vk::SubgroupFeatureFlags::BASIC
        | vk::SubgroupFeatureFlags::VOTE
        | vk::SubgroupFeatureFlags::BALLOT
        | vk::SubgroupFeatureFlags::ARITHMETIC;
    let in_compute = p11
        .subgroup_supported_stages
        .contains(vk::ShaderStageFlags::COMPUTE);
    if in_compute
        && p11
            .subgroup_supported_operations
            .contains(subgroup_operations)
    {
        caps.subgroup_size = p11.subgroup_size;
        let sizes = p_control.min_subgroup_size..=p_control.max_subgroup_size;
        caps.subgroup_control = control.subgroup_size_control == vk::TRUE
            && control.compute_full_subgroups == vk::TRUE
            && p_control
                .required_subgroup_size_stages
                .contains(vk::ShaderStageFlags::COMPUTE)
            && sizes.contains(&caps.subgroup_size)
            && GROUP_SIZE.is_multiple_of(caps.subgroup_size)
            && GROUP_SIZE / caps.subgroup_size <= p_control.max_compute_workgroup_subgroups;
    }
    let accel_structure = accel.acceleration_structure == vk::TRUE;
    caps.ray_query = accel_structure && query.ray_query == vk::TRUE;
    caps.ray_tracing_pipeline = accel_structure && pipeline.ray_tracing_pipeline == vk::TRUE;
    // The spec makes descriptorIndexing imply the non-uniform indexing, the runtime arrays and the
    // update after bind of sampled images (Vulkan 1.2, Feature Requirements).
    caps.descriptor_indexing = f12.descriptor_indexing == vk::TRUE;
    caps.max_textures = p12
        .max_per_stage_descriptor_update_after_bind_sampled_images
        .min(p12.max_per_stage_descriptor_update_after_bind_samplers)
        .min(p12.max_per_stage_update_after_bind_resources);
    caps.max_allocation = p11.max_memory_allocation_size;
    if has_accel {
        caps.max_primitive_count = p_accel.max_primitive_count;
        caps.scratch_alignment = p_accel
            .min_acceleration_structure_scratch_offset_alignment
            .max(1);
    }
    if caps.ray_tracing_pipeline {
        caps.binding_rules = BindingRules {
            handle_size: p_pipeline.shader_group_handle_size,
            handle_alignment: p_pipeline.shader_group_handle_alignment.max(1),
            base_alignment: p_pipeline.shader_group_base_alignment.max(1),
            max_invocations: p_pipeline.max_ray_dispatch_invocation_count,
        };
    }
    let name = text(p12.driver_name_as_c_str());
    format!("{name} {}", text(p12.driver_info_as_c_str()))
        .trim()
        .to_owned()
}

/// The family that all work goes to: compute, with graphics where there is one, as drivers treat
/// that as their main queue.
fn describe_queue(raw: &ash::Instance, physical: vk::PhysicalDevice, caps: &mut Caps) {
    // SAFETY: `physical` belongs to the instance.
    let families = unsafe { raw.get_physical_device_queue_family_properties(physical) };
    let best = families
        .iter()
        .zip(0u32..)
        .filter(|(family, _)| family.queue_flags.contains(vk::QueueFlags::COMPUTE))
        .min_by_key(|(family, _)| !family.queue_flags.contains(vk::QueueFlags::GRAPHICS));
    match best {
        Some((family, index)) => {
            caps.queue_family = index;
            caps.timestamp_bits = family.timestamp_valid_bits;
        }
        None => caps.missing.push("a compute queue"),
    }
}

fn describe_memory(
    raw: &ash::Instance,
    physical: vk::PhysicalDevice,
    kind: DeviceKind,
    caps: &mut Caps,
) {
    use vk::MemoryPropertyFlags as Flags;
    // SAFETY: `physical` belongs to the instance.
    let memory = unsafe { raw.get_physical_device_memory_properties(physical) };
    caps.memory_bytes = memory
        .memory_heaps_as_slice()
        .iter()
        .filter(|heap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
        .map(|heap| heap.size)
        .max()
        .unwrap_or(0);
    // Host reads of uncached memory crawl, so discrete devices with a mapped BAR are staged too.
    let cached = Flags::HOST_VISIBLE | Flags::HOST_COHERENT | Flags::HOST_CACHED;
    let first_cached = memory
        .memory_types_as_slice()
        .iter()
        .find(|memory_type| memory_type.property_flags.contains(cached));
    caps.unified = matches!(kind, DeviceKind::Cpu | DeviceKind::Integrated)
        && first_cached.is_some_and(|t| t.property_flags.contains(Flags::DEVICE_LOCAL));
}

fn kind(device_type: vk::PhysicalDeviceType) -> DeviceKind {
    match device_type {
        vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
        vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
        vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
        vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
        _ => DeviceKind::Other,
    }
}

fn text<E>(name: Result<&CStr, E>) -> String {
    name.map_or_else(
        |_| String::new(),
        |name| name.to_string_lossy().into_owned(),
    )
}
