//! What acceleration structures are built from, in Vulkan's words.

use ash::vk;
use bytemuck::{Pod, Zeroable};

use super::buffer::Ptr;

/// Triangles of a [`Blas`](super::Blas); in shaders a geometry index.
#[derive(Debug, Clone, Copy)]
pub struct TriangleGeometry {
    /// Three positions per triangle, not indexed; the caller keeps the buffer alive.
    pub positions: Ptr<[f32; 3]>,
    pub first_triangle: usize,
    pub triangles: usize,
    /// Hits are final: ray queries do not stop at candidates, pipelines call no any-hit shader.
    pub opaque: bool,
}

/// A place of a [`Blas`](super::Blas) or [`BoxBlas`](super::BoxBlas) in a [`Tlas`](super::Tlas).
#[derive(Debug, Clone, Copy)]
pub struct Instance {
    pub blas_address: u64,
    /// World from structure, by rows; see [`Instance::IDENTITY`].
    pub transform: [[f32; 4]; 3],
    /// 24 bits; what shaders read as the custom index.
    pub custom_index: u32,
    pub mask: u8,
    /// Rays that cull faces do not cull here.
    pub facing_cull_disable: bool,
    /// Swaps front and back. Without it, faces that are counter-clockwise in a right-handed space, as
    /// glTF's, are front faces: the rule is stated for a left-handed space, where they are clockwise.
    pub front_ccw: bool,
}

impl Instance {
    /// The transform that changes nothing.
    pub const IDENTITY: [[f32; 4]; 3] = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ];
}

/// An instance as Vulkan lays it out (VkAccelerationStructureInstanceKHR).
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct PackedInstance {
    transform: [[f32; 4]; 3],
    index_and_mask: u32,
    offset_and_flags: u32,
    blas_address: u64,
}

pub(super) fn build_info<'a>(
    ty: vk::AccelerationStructureTypeKHR,
    flags: vk::BuildAccelerationStructureFlagsKHR,
    geometries: &'a [vk::AccelerationStructureGeometryKHR<'a>],
) -> vk::AccelerationStructureBuildGeometryInfoKHR<'a> {
    vk::AccelerationStructureBuildGeometryInfoKHR::default()
        .ty(ty)
        .flags(flags)
        .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
        .geometries(geometries)
}

/// Photons are built anew each iteration and asked a few times, so building counts.
pub(super) fn box_info<'a>(
    geometry: &'a [vk::AccelerationStructureGeometryKHR<'a>],
) -> vk::AccelerationStructureBuildGeometryInfoKHR<'a> {
    build_info(
        vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL,
        vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_BUILD,
        geometry,
    )
}

pub(super) fn tlas_info<'a>(
    geometry: &'a [vk::AccelerationStructureGeometryKHR<'a>],
) -> vk::AccelerationStructureBuildGeometryInfoKHR<'a> {
    build_info(
        vk::AccelerationStructureTypeKHR::TOP_LEVEL,
        vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE,
        geometry,
    )
}

pub(super) fn triangles(
    geometry: &TriangleGeometry,
) -> vk::AccelerationStructureGeometryKHR<'static> {
    let first = geometry.positions.offset(3 * geometry.first_triangle);
    let data = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
        .vertex_format(vk::Format::R32G32B32_SFLOAT)
        .vertex_data(const_address(first.address()))
        .vertex_stride(size_of::<[f32; 3]>() as u64)
        .max_vertex(
            (geometry.triangles as u32)
                .saturating_mul(3)
                .saturating_sub(1),
        )
        .index_type(vk::IndexType::NONE_KHR);
    let flags = match geometry.opaque {
        true => vk::GeometryFlagsKHR::OPAQUE,
        false => vk::GeometryFlagsKHR::empty(),
    };
    vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { triangles: data })
        .flags(flags)
}

/// A photon seen twice would shine twice: no duplicates.
pub(super) fn boxes(first: Ptr<[f32; 6]>) -> vk::AccelerationStructureGeometryKHR<'static> {
    let data = vk::AccelerationStructureGeometryAabbsDataKHR::default()
        .data(const_address(first.address()))
        .stride(size_of::<[f32; 6]>() as u64);
    vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::AABBS)
        .geometry(vk::AccelerationStructureGeometryDataKHR { aabbs: data })
        .flags(vk::GeometryFlagsKHR::NO_DUPLICATE_ANY_HIT_INVOCATION)
}

pub(super) fn instances(first: u64) -> vk::AccelerationStructureGeometryKHR<'static> {
    let data =
        vk::AccelerationStructureGeometryInstancesDataKHR::default().data(const_address(first));
    vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::INSTANCES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { instances: data })
}

pub(super) fn pack(instance: &Instance) -> PackedInstance {
    use vk::GeometryInstanceFlagsKHR as Flags;
    let mut flags = Flags::empty();
    if instance.facing_cull_disable {
        flags |= Flags::TRIANGLE_FACING_CULL_DISABLE;
    }
    if instance.front_ccw {
        flags |= Flags::TRIANGLE_FRONT_COUNTERCLOCKWISE;
    }
    PackedInstance {
        transform: instance.transform,
        index_and_mask: (instance.custom_index & 0xff_ffff) | u32::from(instance.mask) << 24,
        offset_and_flags: flags.as_raw() << 24,
        blas_address: instance.blas_address,
    }
}

fn const_address(device_address: u64) -> vk::DeviceOrHostAddressConstKHR {
    vk::DeviceOrHostAddressConstKHR { device_address }
}
