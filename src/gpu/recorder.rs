//! What Vulkan needs for one submission: command buffer, fence, timestamps.

use ash::vk;

use super::device::Shared;
use crate::Result;

/// Timed parts of one submission.
pub(super) const MAX_TIMED: u32 = 1024;

/// Vulkan's objects for one submission at a time.
#[derive(Clone, Copy)]
pub(super) struct Recorder {
    pub pool: vk::CommandPool,
    pub buffer: vk::CommandBuffer,
    pub fence: vk::Fence,
    pub queries: vk::QueryPool,
}

impl Recorder {
    pub fn new(shared: &Shared) -> Result<Self> {
        let mut recorder = Self {
            pool: vk::CommandPool::null(),
            buffer: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            queries: vk::QueryPool::null(),
        };
        recorder.create(shared).inspect_err(|_| {
            // SAFETY: nothing was recorded.
            unsafe { recorder.destroy(&shared.device) };
        })?;
        Ok(recorder)
    }

    fn create(&mut self, shared: &Shared) -> Result<()> {
        let device = &shared.device;
        let pool_info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(shared.info.caps.queue_family);
        let queries_info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::TIMESTAMP)
            .query_count(2 * MAX_TIMED);
        // SAFETY: valid infos; the caller destroys what was made.
        unsafe {
            self.pool = device
                .create_command_pool(&pool_info, None)
                .map_err(shared.fault("vkCreateCommandPool"))?;
            let buffer_info = vk::CommandBufferAllocateInfo::default()
                .command_pool(self.pool)
                .command_buffer_count(1);
            self.buffer = device
                .allocate_command_buffers(&buffer_info)
                .map_err(shared.fault("vkAllocateCommandBuffers"))?
                .into_iter()
                .next()
                .unwrap_or_default();
            self.fence = device
                .create_fence(&vk::FenceCreateInfo::default(), None)
                .map_err(shared.fault("vkCreateFence"))?;
            if shared.info.caps.timestamp_bits > 0 {
                self.queries = device
                    .create_query_pool(&queries_info, None)
                    .map_err(shared.fault("vkCreateQueryPool"))?;
            }
        }
        Ok(())
    }

    /// # Safety
    /// The device finished or never saw the recorder's work.
    pub unsafe fn destroy(self, device: &ash::Device) {
        // SAFETY: the caller's; null handles are ignored.
        unsafe {
            device.destroy_query_pool(self.queries, None);
            device.destroy_fence(self.fence, None);
            device.destroy_command_pool(self.pool, None);
        }
    }
}
