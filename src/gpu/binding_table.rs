//! Shader binding tables: where a pipeline and its rays find the shaders to run.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;

use super::device::Gpu;
use super::memory::RawBuffer;
use crate::Result;

/// What a device asks of shader binding tables and of the work that uses them. Bytes.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct BindingRules {
    pub handle_size: u32,
    pub handle_alignment: u32,
    pub base_alignment: u32,
    /// Rays that one dispatch may start with.
    pub max_invocations: u32,
}

/// One record each for ray generation, misses and hits.
pub(super) struct BindingTable {
    pub regions: [vk::StridedDeviceAddressRegionKHR; 3],
    _memory: Arc<RawBuffer>,
}

impl BindingTable {
    /// Of the handles of ray generation, miss and hit shaders; an empty one is called without effect, as the
    /// specification has it of zeros (VK_PIPELINE_CREATE_RAY_TRACING_NO_NULL_MISS_SHADERS_BIT_KHR).
    pub fn new(gpu: &Gpu, name: &str, handles: [&[u8]; 3]) -> Result<Self> {
        use vk::BufferUsageFlags as Usage;
        let shared = &gpu.shared;
        let rules = &shared.info.caps.binding_rules;
        let location = match shared.info.caps.unified {
            true => MemoryLocation::GpuToCpu,
            false => MemoryLocation::GpuOnly,
        };
        // Memory may begin anywhere below the alignment.
        let mut bytes = vec![0; (rules.record() * 3 + rules.base_alignment) as usize];
        let memory = Arc::new(RawBuffer::new(
            shared,
            name,
            bytes.len() as u64,
            Usage::SHADER_BINDING_TABLE_KHR | Usage::SHADER_DEVICE_ADDRESS | Usage::TRANSFER_DST,
            location,
        )?);
        let regions = rules.regions(memory.address);
        for (region, handle) in regions.iter().zip(handles) {
            let first = (region.device_address - memory.address) as usize;
            if let Some(record) = bytes.get_mut(first..first + handle.len()) {
                record.copy_from_slice(handle);
            }
        }
        gpu.write_bytes(&memory, 0, &bytes)?;
        Ok(Self {
            regions,
            _memory: memory,
        })
    }
}

impl BindingRules {
    /// From one record to the next: each begins a region.
    fn record(&self) -> u32 {
        self.stride().next_multiple_of(self.base_alignment)
    }

    fn stride(&self) -> u32 {
        self.handle_size.next_multiple_of(self.handle_alignment)
    }

    /// In memory from `address` on, with three records and a base alignment's bytes.
    fn regions(&self, address: u64) -> [vk::StridedDeviceAddressRegionKHR; 3] {
        let first = address.next_multiple_of(u64::from(self.base_alignment));
        let stride = u64::from(self.stride());
        [0, 1, 2].map(|i| vk::StridedDeviceAddressRegionKHR {
            device_address: first + i * u64::from(self.record()),
            stride,
            size: stride,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rules for vkCmdTraceRaysKHR's regions, on devices that exist and on stricter ones.
    #[test]
    fn regions_are_aligned_and_apart() {
        for (handle_alignment, base_alignment) in [(32, 64), (32, 32), (16, 64), (64, 4096)] {
            let rules = BindingRules {
                handle_size: 32,
                handle_alignment,
                base_alignment,
                max_invocations: 1,
            };
            for address in [1 << 40, (1 << 40) + 16] {
                let regions = rules.regions(address);
                let mut free = address;
                for region in regions {
                    assert_eq!(region.device_address % u64::from(base_alignment), 0);
                    assert_eq!(region.stride % u64::from(handle_alignment), 0);
                    assert!(region.stride >= 32 && region.size == region.stride);
                    assert!(region.device_address >= free);
                    free = region.device_address + region.size;
                }
                assert!(free <= address + u64::from(3 * rules.record() + base_alignment));
            }
        }
    }
}
