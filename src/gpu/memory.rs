//! Device memory and the Vulkan buffers in it.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use super::device::{Gpu, Shared};
use crate::Result;

/// GLSL's default alignment of a buffer reference.
const MIN_ALIGNMENT: u64 = 16;

/// A Vulkan buffer with its memory.
pub(super) struct RawBuffer {
    shared: Arc<Shared>,
    pub raw: vk::Buffer,
    allocation: Option<Allocation>,
    location: MemoryLocation,
    /// 0 where the usage has no SHADER_DEVICE_ADDRESS.
    pub address: u64,
    pub size: u64,
}

impl RawBuffer {
    pub fn new(
        shared: &Arc<Shared>,
        name: &str,
        bytes: u64,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> Result<Self> {
        let allowed = shared.info.caps.max_allocation;
        // vkCmdFillBuffer works in words.
        let size = bytes
            .checked_next_multiple_of(4)
            .filter(|size| *size <= allowed);
        let Some(size) = size else {
            return Err(shared.error(format!(
                "{name} needs {bytes} bytes, the device allows {allowed} in one buffer; use fewer \
                 --photons or a smaller --size"
            )));
        };
        let size = size.max(4);
        let device = &shared.device;
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        // SAFETY: valid info; the handles go into `buffer`, whose drop frees them on any failure.
        unsafe {
            let raw = device
                .create_buffer(&info, None)
                .map_err(shared.fault(&format!("vkCreateBuffer of {name}, {size} bytes")))?;
            let mut buffer = Self {
                shared: shared.clone(),
                raw,
                allocation: None,
                location,
                address: 0,
                size,
            };
            let mut requirements = device.get_buffer_memory_requirements(raw);
            requirements.alignment = requirements.alignment.max(MIN_ALIGNMENT);
            let allocation = shared.allocate(name, requirements, location, true)?;
            let (memory, offset) = (allocation.memory(), allocation.offset());
            buffer.allocation = Some(allocation);
            device
                .bind_buffer_memory(raw, memory, offset)
                .map_err(shared.fault(&format!("vkBindBufferMemory of {name}")))?;
            if usage.contains(vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS) {
                let info = vk::BufferDeviceAddressInfo::default().buffer(raw);
                buffer.address = device.get_buffer_device_address(&info);
            }
            Ok(buffer)
        }
    }

    /// The host reads and writes it without staging.
    pub fn is_mapped(&self) -> bool {
        self.mapped().is_some()
    }

    /// Drivers map device memory too where they can, but reads of it may crawl.
    fn mapped(&self) -> Option<*mut u8> {
        if self.location == MemoryLocation::GpuOnly {
            return None;
        }
        let pointer = self.allocation.as_ref()?.mapped_ptr()?;
        Some(pointer.as_ptr().cast())
    }

    /// Writes to mapped memory; the caller checked the range.
    pub fn write(&self, first: usize, data: &[u8]) {
        assert!(first + data.len() <= self.size as usize);
        if let Some(pointer) = self.mapped() {
            // SAFETY: in range, mapped, host-coherent, and not in use by the device (`Gpu::write`).
            unsafe {
                pointer
                    .add(first)
                    .copy_from_nonoverlapping(data.as_ptr(), data.len())
            };
        }
    }

    /// Reads mapped memory; the caller checked the range.
    pub fn read(&self, first: usize, data: &mut [u8]) {
        assert!(first + data.len() <= self.size as usize);
        if let Some(pointer) = self.mapped() {
            // SAFETY: as for `write`; all work was waited for and its writes made visible to the host.
            unsafe {
                pointer
                    .add(first)
                    .copy_to_nonoverlapping(data.as_mut_ptr(), data.len())
            };
        }
    }
}

impl Drop for RawBuffer {
    fn drop(&mut self) {
        self.shared.settle();
        // SAFETY: nothing runs on the device that could use it.
        unsafe { self.shared.device.destroy_buffer(self.raw, None) };
        self.shared.free(self.allocation.take());
    }
}

impl Gpu {
    /// Names and bytes of all that lies in the device's memory.
    pub fn allocations(&self) -> Vec<(String, u64)> {
        let report = self.shared.allocator().generate_report();
        let allocations = report.allocations.into_iter();
        allocations.map(|of| (of.name, of.size)).collect()
    }
}

impl Shared {
    pub fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation> {
        let description = AllocationCreateDesc {
            name,
            requirements,
            location,
            linear,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        self.allocator().allocate(&description).map_err(|e| {
            self.error(format!(
                "memory for {name}, {} bytes: {e}; use fewer --photons, a smaller --size or another \
                 --device",
                requirements.size
            ))
        })
    }

    pub fn free(&self, allocation: Option<Allocation>) {
        if let Some(allocation) = allocation {
            // It fails only for an allocation of another allocator.
            let _ = self.allocator().free(allocation);
        }
    }
}
