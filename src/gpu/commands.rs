//! Recording work, submitting it, and timing its parts.

use std::any::Any;
use std::ops::Range;
use std::sync::Arc;

use ash::vk;
use bytemuck::Pod;

use super::buffer::Buffer;
use super::device::{Gpu, Shared, lock};
use super::memory::RawBuffer;
use super::pass::{GROUP_SIZE, MAX_PUSH_BYTES, Pass};
use super::recorder::{MAX_TIMED, Recorder};
use super::running::{Held, Running, Timings};
use crate::{Error, Result};

/// What vkCmdUpdateBuffer takes at once.
pub(super) const MAX_UPDATE_BYTES: usize = 65536;

/// Work groups along one dimension that every Vulkan device allows.
const MAX_GROUPS: usize = 65535;

/// Work for the device, run in the order recorded: each part sees all writes of those before it.
pub struct Commands {
    pub(super) shared: Arc<Shared>,
    /// `None` only once it went back to the idle ones.
    recorder: Option<Recorder>,
    labels: Vec<&'static str>,
    /// What the recorded work uses.
    held: Held,
    /// The first fault while recording; submit returns it.
    fault: Option<Error>,
}

impl Gpu {
    /// An empty recording.
    pub fn commands(&self) -> Result<Commands> {
        let shared = &self.shared;
        let idle = lock(&shared.recorders).pop();
        let recorder = match idle {
            Some(recorder) => recorder,
            None => Recorder::new(shared)?,
        };
        let commands = Commands {
            shared: shared.clone(),
            recorder: Some(recorder),
            labels: Vec::new(),
            held: Vec::new(),
            fault: None,
        };
        let info = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the recorder is ours alone and idle.
        unsafe {
            shared
                .device
                .reset_command_pool(recorder.pool, vk::CommandPoolResetFlags::empty())
                .map_err(shared.fault("vkResetCommandPool"))?;
            shared
                .device
                .begin_command_buffer(recorder.buffer, &info)
                .map_err(shared.fault("vkBeginCommandBuffer"))?;
        }
        Ok(commands)
    }
}

impl Commands {
    /// Runs `pass` on at least `threads` threads, in groups of [`GROUP_SIZE`].
    ///
    /// The groups lie in x and y, as one dimension holds too few: a shader's linear group index is
    /// `gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x`, and threads at or above its count
    /// must do nothing. The threads of a ray tracing pipeline are laid out alike. `push` may have up to [`MAX_PUSH_BYTES`], a multiple of 4.
    pub fn dispatch<P: Pod>(&mut self, pass: &Pass, push: &P, threads: usize) {
        let groups = threads.div_ceil(GROUP_SIZE as usize);
        let y = groups.div_ceil(MAX_GROUPS);
        let push = bytemuck::bytes_of(push);
        if push.len() > MAX_PUSH_BYTES as usize || !push.len().is_multiple_of(4) {
            let bytes = push.len();
            return self.fail(format!(
                "pass {}: {bytes} bytes of push constants, not a multiple of 4 up to {MAX_PUSH_BYTES}",
                pass.name
            ));
        }
        if y > MAX_GROUPS {
            return self.fail(format!(
                "pass {}: {threads} threads are too many",
                pass.name
            ));
        }
        if groups == 0 {
            return;
        }
        let x = groups.div_ceil(y);
        let raw = &pass.raw;
        let most = self.shared.info.caps.binding_rules.max_invocations as usize;
        if raw.table.is_some() && x * GROUP_SIZE as usize * y > most {
            return self.fail(format!(
                "pass {}: {threads} rays are too many: the device takes {most} at once",
                pass.name
            ));
        }
        self.hold(raw);
        // SAFETY: recording; the pass is held until the work was waited for; sizes checked above.
        self.timed(pass.name, |shared, buffer| unsafe {
            let device = &shared.device;
            let bind_point = match raw.table {
                Some(_) => vk::PipelineBindPoint::RAY_TRACING_KHR,
                None => vk::PipelineBindPoint::COMPUTE,
            };
            device.cmd_bind_pipeline(buffer, bind_point, raw.pipeline);
            if let Some(textures) = &raw.textures {
                let sets = [textures.set];
                device.cmd_bind_descriptor_sets(buffer, bind_point, raw.layout, 0, &sets, &[]);
            }
            if !push.is_empty() {
                device.cmd_push_constants(buffer, raw.layout, raw.stages, 0, push);
            }
            let (x, y) = (x as u32, y as u32);
            match (&raw.table, &shared.pipelines) {
                (Some(table), Some(functions)) => {
                    let [generation, miss, hit] = &table.regions;
                    let none = vk::StridedDeviceAddressRegionKHR::default();
                    let x = x * GROUP_SIZE;
                    functions.cmd_trace_rays(buffer, generation, miss, hit, &none, x, y, 1);
                }
                _ => device.cmd_dispatch(buffer, x, y, 1),
            }
        });
    }

    /// Sets every 32-bit word of `buffer`.
    pub fn fill<T: Pod>(&mut self, buffer: &Buffer<T>, value: u32) {
        self.hold(&buffer.raw);
        // SAFETY: recording; the buffer is held until the work was waited for.
        self.untimed(|shared, commands| unsafe {
            let raw = buffer.raw.raw;
            shared
                .device
                .cmd_fill_buffer(commands, raw, 0, vk::WHOLE_SIZE, value);
        });
    }

    /// Copies the values in `range` of `from` to `to` from its value `first` on.
    pub fn copy<T: Pod>(
        &mut self,
        from: &Buffer<T>,
        range: Range<usize>,
        to: &Buffer<T>,
        first: usize,
    ) {
        let target = first..first.saturating_add(range.len());
        match (from.byte_range(&range), to.byte_range(&target)) {
            (Err(fault), _) => self.fail(format!("copy from {fault}")),
            (_, Err(fault)) => self.fail(format!("copy to {fault}")),
            (Ok(source), Ok(target)) => {
                let overlap = source.start < target.end && target.start < source.end;
                if from.raw.raw == to.raw.raw && overlap {
                    return self.fail(format!("copy within {} overlaps", from.name()));
                }
                self.copy_bytes(&from.raw, source.start, &to.raw, target.start, source.len());
            }
        }
    }

    /// As `copy`; the caller checked the ranges.
    pub(super) fn copy_bytes(
        &mut self,
        from: &Arc<RawBuffer>,
        first: usize,
        to: &Arc<RawBuffer>,
        target: usize,
        bytes: usize,
    ) {
        if bytes == 0 {
            return;
        }
        self.hold(from);
        self.hold(to);
        let region = vk::BufferCopy {
            src_offset: first as u64,
            dst_offset: target as u64,
            size: bytes as u64,
        };
        // SAFETY: recording; ranges were checked, and both are held until the work was waited for.
        self.untimed(|shared, buffer| unsafe {
            shared
                .device
                .cmd_copy_buffer(buffer, from.raw, to.raw, &[region]);
        });
    }

    /// Overwrites the values from `first` on, in its turn, with whole words up to 64 KiB.
    pub fn write<T: Pod>(&mut self, buffer: &Buffer<T>, first: usize, data: &[T]) {
        let range = match buffer.byte_range(&(first..first.saturating_add(data.len()))) {
            Ok(range) => range,
            Err(fault) => return self.fail(format!("write of {fault}")),
        };
        let bytes = range.len();
        let words = range.start.is_multiple_of(4) && bytes.is_multiple_of(4);
        if !words || !(1..=MAX_UPDATE_BYTES).contains(&bytes) {
            let name = buffer.name();
            return self.fail(format!(
                "write of {bytes} bytes to {name}, not of whole words up to {MAX_UPDATE_BYTES}"
            ));
        }
        self.write_bytes(&buffer.raw, range.start, bytemuck::cast_slice(data));
    }

    /// As `write`; the caller checked the range, and that it is whole words.
    pub(super) fn write_bytes(&mut self, buffer: &Arc<RawBuffer>, first: usize, data: &[u8]) {
        self.hold(buffer);
        let raw = buffer.raw;
        // SAFETY: recording; in range and of a size that is allowed; the buffer is held until the work was waited for.
        self.untimed(|shared, commands| unsafe {
            shared
                .device
                .cmd_update_buffer(commands, raw, first as u64, data);
        });
    }

    /// Starts the work.
    ///
    /// Fails with the first fault of the recording, or where the device runs out of memory or is lost.
    pub fn start(mut self) -> Result<Running> {
        if let Some(fault) = self.fault.take() {
            return Err(fault);
        }
        let labels = std::mem::take(&mut self.labels);
        let held = std::mem::take(&mut self.held);
        Running::start(&self.shared, self.recorder.take(), labels, held)
    }

    /// Runs the work and waits for it; fails as [`Self::start`].
    pub fn submit(self) -> Result<Timings> {
        Ok(self.start()?.wait()?.timings)
    }

    /// Keeps `resource` until the work was waited for.
    pub(super) fn hold<T: Any + Send + Sync>(&mut self, resource: &Arc<T>) {
        self.held.push(resource.clone());
    }

    /// Remembers the first fault; submit returns it.
    pub(super) fn fail(&mut self, fault: String) {
        if self.fault.is_none() {
            self.fault = Some(self.shared.error(fault));
        }
    }

    /// Records a part between two timestamps.
    pub(super) fn timed(
        &mut self,
        label: &'static str,
        record: impl FnOnce(&Shared, vk::CommandBuffer),
    ) {
        let Some(Recorder {
            queries, buffer, ..
        }) = self.recorder
        else {
            return;
        };
        let part = self.labels.len() as u32;
        self.labels.push(label);
        let device = &self.shared.device;
        let stage = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
        let stamped = self.shared.info.caps.timestamp_bits > 0 && part < MAX_TIMED;
        if stamped {
            // SAFETY: recording; the pool has 2 MAX_TIMED queries.
            unsafe {
                device.cmd_reset_query_pool(buffer, queries, 2 * part, 2);
                device.cmd_write_timestamp(buffer, stage, queries, 2 * part);
            }
        }
        self.untimed(record);
        if stamped {
            // SAFETY: as above.
            let device = &self.shared.device;
            unsafe { device.cmd_write_timestamp(buffer, stage, queries, 2 * part + 1) };
        }
    }

    /// Records a part, and the barrier that shows its writes to the next.
    pub(super) fn untimed(&mut self, record: impl FnOnce(&Shared, vk::CommandBuffer)) {
        let Some(Recorder { buffer, .. }) = self.recorder else {
            return;
        };
        record(&self.shared, buffer);
        let mut stages = self.shared.pass_stages() | vk::PipelineStageFlags::TRANSFER;
        if self.shared.accel.is_some() {
            stages |= vk::PipelineStageFlags::ACCELERATION_STRUCTURE_BUILD_KHR;
        }
        let barrier = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)];
        let flags = vk::DependencyFlags::empty();
        // SAFETY: recording.
        unsafe {
            let device = &self.shared.device;
            device.cmd_pipeline_barrier(buffer, stages, stages, flags, &barrier, &[], &[]);
        }
    }
}

impl Drop for Commands {
    fn drop(&mut self) {
        if let Some(recorder) = self.recorder.take() {
            lock(&self.shared.recorders).push(recorder);
        }
    }
}
