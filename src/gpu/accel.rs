//! Acceleration structures, built on the device.

use std::sync::Arc;

use ash::{khr, vk};
use gpu_allocator::MemoryLocation;

use super::buffer::Ptr;
use super::commands::{Commands, MAX_UPDATE_BYTES};
use super::device::{Gpu, Shared};
use super::geometry::{self, Instance, PackedInstance, TriangleGeometry};
use super::memory::RawBuffer;
use crate::Result;

/// Triangles, ready to be traced.
pub struct Blas {
    raw: RawAccel,
}

/// Boxes, built anew by each [`Commands::build_boxes`].
pub struct BoxBlas {
    name: &'static str,
    max_boxes: usize,
    raw: Arc<RawAccel>,
}

/// Instances, built anew by each [`Commands::build_tlas`].
pub struct Tlas {
    name: &'static str,
    max_instances: usize,
    instances: Arc<RawBuffer>,
    raw: Arc<RawAccel>,
}

impl Blas {
    /// For [`Instance::blas_address`]; valid while this lives.
    pub fn address(&self) -> u64 {
        self.raw.address
    }
}

impl BoxBlas {
    /// For [`Instance::blas_address`]; valid while this lives.
    pub fn address(&self) -> u64 {
        self.raw.address
    }
}

impl Tlas {
    /// What shaders make an `accelerationStructureEXT` from; valid while this lives.
    pub fn address(&self) -> u64 {
        self.raw.address
    }
}

struct RawAccel {
    shared: Arc<Shared>,
    raw: vk::AccelerationStructureKHR,
    address: u64,
    scratch_address: u64,
    _storage: RawBuffer,
    /// Dropped early where the structure is built once.
    scratch: Option<RawBuffer>,
}

impl Gpu {
    /// Builds `geometries` and waits for it.
    ///
    /// Fails without ray tracing, and where the triangles are too many for the device or its memory.
    /// Give neighbouring triangles neighbouring places: lavapipe splits them in the order given.
    pub fn triangle_blas(
        &self,
        name: &'static str,
        geometries: &[TriangleGeometry],
    ) -> Result<Blas> {
        let shared = &self.shared;
        let total = geometries.iter().map(|geometry| geometry.triangles).sum();
        check_count(shared, name, "triangles", total)?;
        let counts: Vec<_> = geometries.iter().map(|g| g.triangles as u32).collect();
        let described: Vec<_> = geometries.iter().map(geometry::triangles).collect();
        let info = geometry::build_info(
            vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL,
            vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE,
            &described,
        );
        let mut raw = RawAccel::new(shared, name, &info, &counts)?;
        let mut commands = self.commands()?;
        commands.build(name, &raw, info, &counts);
        commands.submit()?;
        raw.scratch = None;
        Ok(Blas { raw })
    }

    /// Memory for up to `max_boxes` boxes; to be built before it is traced.
    ///
    /// Fails without ray tracing, and where the boxes are too many for the device or its memory.
    pub fn box_blas(&self, name: &'static str, max_boxes: usize) -> Result<BoxBlas> {
        check_count(&self.shared, name, "boxes", max_boxes)?;
        let described = [geometry::boxes(Ptr::null())];
        let raw = RawAccel::new(
            &self.shared,
            name,
            &geometry::box_info(&described),
            &[max_boxes as u32],
        )?;
        Ok(BoxBlas {
            name,
            max_boxes,
            raw: Arc::new(raw),
        })
    }

    /// Memory for up to `max_instances` instances; to be built before it is traced.
    ///
    /// Fails without ray tracing, and where memory runs out.
    pub fn tlas(&self, name: &'static str, max_instances: usize) -> Result<Tlas> {
        let shared = &self.shared;
        check_count(shared, name, "instances", max_instances)?;
        let described = [geometry::instances(0)];
        let raw = RawAccel::new(
            shared,
            name,
            &geometry::tlas_info(&described),
            &[max_instances as u32],
        )?;
        let instances = RawBuffer::new(
            shared,
            name,
            (max_instances.max(1) * size_of::<PackedInstance>()) as u64,
            vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR
                | vk::BufferUsageFlags::TRANSFER_DST
                | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS,
            MemoryLocation::GpuOnly,
        )?;
        Ok(Tlas {
            name,
            max_instances,
            instances: Arc::new(instances),
            raw: Arc::new(raw),
        })
    }
}

impl Commands {
    /// Builds `count` boxes (minimum, maximum) into `blas`; 0 is allowed.
    ///
    /// All must be finite with minimum ≤ maximum: lavapipe loses neighbours of NaN boxes.
    pub fn build_boxes(&mut self, blas: &BoxBlas, first_box: Ptr<[f32; 6]>, count: usize) {
        if count > blas.max_boxes {
            let (name, max_boxes) = (blas.name, blas.max_boxes);
            return self.fail(format!("{name} holds {max_boxes} boxes, not {count}"));
        }
        self.hold(&blas.raw);
        let described = [geometry::boxes(first_box)];
        self.build(
            blas.name,
            &blas.raw,
            geometry::box_info(&described),
            &[count as u32],
        );
    }

    /// Builds `instances` into `tlas`; none is allowed.
    pub fn build_tlas(&mut self, tlas: &Tlas, places: &[Instance]) {
        if places.len() > tlas.max_instances {
            let (name, max_instances, count) = (tlas.name, tlas.max_instances, places.len());
            return self.fail(format!(
                "{name} holds {max_instances} instances, not {count}"
            ));
        }
        self.hold(&tlas.raw);
        let packed: Vec<_> = places.iter().map(geometry::pack).collect();
        let chunks = bytemuck::cast_slice::<_, u8>(&packed).chunks(MAX_UPDATE_BYTES);
        for (chunk, at) in chunks.zip((0..).step_by(MAX_UPDATE_BYTES)) {
            self.write_bytes(&tlas.instances, at, chunk);
        }
        let described = [geometry::instances(tlas.instances.address)];
        let counts = [places.len() as u32];
        self.build(
            tlas.name,
            &tlas.raw,
            geometry::tlas_info(&described),
            &counts,
        );
    }

    /// Records the build of `info` into `accel`, which was made for at least these counts.
    fn build(
        &mut self,
        name: &'static str,
        accel: &RawAccel,
        info: vk::AccelerationStructureBuildGeometryInfoKHR<'_>,
        counts: &[u32],
    ) {
        let info =
            info.dst_acceleration_structure(accel.raw)
                .scratch_data(vk::DeviceOrHostAddressKHR {
                    device_address: accel.scratch_address,
                });
        let ranges: Vec<_> = counts
            .iter()
            .map(|count| vk::AccelerationStructureBuildRangeInfoKHR {
                primitive_count: *count,
                ..Default::default()
            })
            .collect();
        self.timed(name, |shared, buffer| {
            if let Some(functions) = &shared.accel {
                // SAFETY: recording; structure and scratch are large enough for these counts and,
                // like the inputs, live until the work was waited for.
                unsafe { functions.cmd_build_acceleration_structures(buffer, &[info], &[&ranges]) };
            }
        });
    }
}

impl RawAccel {
    fn new(
        shared: &Arc<Shared>,
        name: &str,
        info: &vk::AccelerationStructureBuildGeometryInfoKHR<'_>,
        max_counts: &[u32],
    ) -> Result<Self> {
        use vk::BufferUsageFlags as Usage;
        let functions = functions(shared, name)?;
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        // SAFETY: one count per geometry.
        unsafe {
            functions.get_acceleration_structure_build_sizes(
                vk::AccelerationStructureBuildTypeKHR::DEVICE,
                info,
                max_counts,
                &mut sizes,
            );
        }
        let storage = RawBuffer::new(
            shared,
            name,
            sizes.acceleration_structure_size,
            Usage::ACCELERATION_STRUCTURE_STORAGE_KHR | Usage::SHADER_DEVICE_ADDRESS,
            MemoryLocation::GpuOnly,
        )?;
        let alignment = u64::from(shared.info.caps.scratch_alignment);
        let scratch = RawBuffer::new(
            shared,
            name,
            sizes.build_scratch_size.saturating_add(alignment),
            Usage::STORAGE_BUFFER | Usage::SHADER_DEVICE_ADDRESS,
            MemoryLocation::GpuOnly,
        )?;
        let create = vk::AccelerationStructureCreateInfoKHR::default()
            .buffer(storage.raw)
            .size(sizes.acceleration_structure_size)
            .ty(info.ty);
        // SAFETY: the storage is at least of that size, and lives as long as the structure.
        let (raw, address) = unsafe {
            let raw = functions
                .create_acceleration_structure(&create, None)
                .map_err(shared.fault(&format!("vkCreateAccelerationStructureKHR of {name}")))?;
            let info = vk::AccelerationStructureDeviceAddressInfoKHR::default()
                .acceleration_structure(raw);
            (
                raw,
                functions.get_acceleration_structure_device_address(&info),
            )
        };
        Ok(Self {
            shared: shared.clone(),
            raw,
            address,
            scratch_address: scratch.address.next_multiple_of(alignment),
            _storage: storage,
            scratch: Some(scratch),
        })
    }
}

impl Drop for RawAccel {
    fn drop(&mut self) {
        if let Some(functions) = &self.shared.accel {
            self.shared.settle();
            // SAFETY: nothing runs on the device that could use it.
            unsafe { functions.destroy_acceleration_structure(self.raw, None) };
        }
    }
}

fn functions<'a>(
    shared: &'a Shared,
    name: &str,
) -> Result<&'a khr::acceleration_structure::Device> {
    let missing = || {
        shared.error(format!(
            "{name} needs VK_KHR_ray_query or VK_KHR_ray_tracing_pipeline; use --trace software"
        ))
    };
    shared.accel.as_ref().ok_or_else(missing)
}

fn check_count(shared: &Shared, name: &str, what: &str, count: usize) -> Result<()> {
    functions(shared, name)?;
    let allowed = shared
        .info
        .caps
        .max_primitive_count
        .min(u64::from(u32::MAX));
    if count as u64 > allowed {
        return Err(shared.error(format!(
            "{name} has {count} {what}, the device allows {allowed} in one structure; use fewer \
             --photons or --trace software"
        )));
    }
    Ok(())
}
