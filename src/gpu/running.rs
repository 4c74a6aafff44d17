//! Work under way on the device, and how long its parts took.

use std::any::Any;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use ash::vk;

use super::device::{Shared, lock};
use super::recorder::{MAX_TIMED, Recorder};
use crate::Result;

/// Milliseconds on the device of each labelled part, in recording order; 0 where the device has no
/// timestamps, and for parts after the first 1024.
pub type Timings = Vec<(&'static str, f64)>;

/// What submitted work uses.
pub(super) type Held = Vec<Arc<dyn Any + Send + Sync>>;

/// Submitted work. What it reaches by address must live until it was waited for: buffers, passes and structures that are
/// dropped earlier wait for it first.
pub struct Running {
    shared: Arc<Shared>,
    /// `None` once it was waited for.
    recorder: Option<Recorder>,
    labels: Vec<&'static str>,
    _held: Held,
}

/// Work that was waited for.
pub struct Done {
    pub timings: Timings,
    /// When the first part began and the last one ended, in milliseconds of the device's clock; none without timestamps.
    pub span_ms: Option<[f64; 2]>,
}

impl Running {
    /// Submits what was recorded.
    pub(super) fn start(
        shared: &Arc<Shared>,
        recorder: Option<Recorder>,
        labels: Vec<&'static str>,
        held: Held,
    ) -> Result<Self> {
        if let Some(recorder) = recorder
            && let Err(error) = submit(shared, recorder)
        {
            lock(&shared.recorders).push(recorder);
            return Err(error);
        }
        Ok(Self {
            shared: shared.clone(),
            recorder,
            labels,
            _held: held,
        })
    }

    /// Waits for the work; its writes are then visible to the host.
    ///
    /// Fails where the device is lost.
    pub fn wait(mut self) -> Result<Done> {
        let ticks = self.finish()?;
        let caps = &self.shared.info.caps;
        let mask = u64::MAX >> (64 - caps.timestamp_bits.clamp(1, 64));
        let ms = |ticks: u64| (ticks & mask) as f64 * f64::from(caps.timestamp_period_ns) * 1e-6;
        let spans = ticks
            .iter()
            .map(|[start, end]| ms(end.wrapping_sub(*start)))
            .chain(std::iter::repeat(0.0));
        Ok(Done {
            timings: self.labels.iter().copied().zip(spans).collect(),
            span_ms: match (ticks.first(), ticks.last()) {
                (Some([start, _]), Some([_, end])) => Some([ms(*start), ms(*end)]),
                _ => None,
            },
        })
    }

    /// Waits once, and gives the recorder back. Returns when each part began and ended.
    fn finish(&mut self) -> Result<Vec<[u64; 2]>> {
        let Some(recorder) = self.recorder.take() else {
            return Ok(Vec::new());
        };
        // SAFETY: the fence was submitted with the work.
        let waited = unsafe {
            self.shared
                .device
                .wait_for_fences(&[recorder.fence], true, u64::MAX)
        };
        self.shared.running.fetch_sub(1, Ordering::AcqRel);
        let ticks = waited
            .map_err(self.shared.fault("vkWaitForFences"))
            .and_then(|()| self.ticks(recorder));
        lock(&self.shared.recorders).push(recorder);
        ticks
    }

    fn ticks(&self, recorder: Recorder) -> Result<Vec<[u64; 2]>> {
        let timed = match self.shared.info.caps.timestamp_bits {
            0 => 0,
            _ => self.labels.len().min(MAX_TIMED as usize),
        };
        let mut ticks = vec![[0u64; 2]; timed];
        if timed > 0 {
            let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
            // SAFETY: these queries were written by the work just waited for.
            unsafe {
                self.shared
                    .device
                    .get_query_pool_results(recorder.queries, 0, ticks.as_flattened_mut(), flags)
                    .map_err(self.shared.fault("vkGetQueryPoolResults"))?;
            }
        }
        Ok(ticks)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // A lost device runs nothing.
        let _ = self.finish();
    }
}

fn submit(shared: &Shared, recorder: Recorder) -> Result<()> {
    let device = &shared.device;
    let buffers = [recorder.buffer];
    let submits = [vk::SubmitInfo::default().command_buffers(&buffers)];
    let fences = [recorder.fence];
    let to_host = [vk::MemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
        .dst_access_mask(vk::AccessFlags::HOST_READ)];
    // SAFETY: the recorder is ours alone; the queue is locked; all that the work uses is held until it was waited for.
    unsafe {
        device.cmd_pipeline_barrier(
            recorder.buffer,
            vk::PipelineStageFlags::ALL_COMMANDS,
            vk::PipelineStageFlags::HOST,
            vk::DependencyFlags::empty(),
            &to_host,
            &[],
            &[],
        );
        device
            .end_command_buffer(recorder.buffer)
            .map_err(shared.fault("vkEndCommandBuffer"))?;
        device
            .reset_fences(&fences)
            .map_err(shared.fault("vkResetFences"))?;
        let queue = lock(&shared.queue);
        device
            .queue_submit(*queue, &submits, recorder.fence)
            .map_err(shared.fault("vkQueueSubmit"))?;
    }
    shared.running.fetch_add(1, Ordering::AcqRel);
    Ok(())
}

impl Shared {
    /// Before anything is destroyed that submitted work may still reach.
    pub fn settle(&self) {
        if self.running.load(Ordering::Acquire) > 0 {
            let queue = lock(&self.queue);
            // SAFETY: the queue is locked. A lost device runs nothing.
            let _ = unsafe { self.device.queue_wait_idle(*queue) };
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::gpu::Gpu;
    use crate::sort::Scan;

    #[test]
    fn a_buffer_stays_until_the_work_that_reaches_it_is_done() {
        let gpu = Gpu::open_as(|_| ());
        let words = gpu.buffer::<u32>("words", 1 << 24).unwrap();
        let scan = Scan::new(&gpu, words.len()).unwrap();
        let mut commands = gpu.commands().unwrap();
        scan.record(&mut commands, words.ptr(), words.len());
        let running = commands.start().unwrap();
        drop(words);
        let fence = running.recorder.as_ref().unwrap().fence;
        // SAFETY: the fence was submitted with the work, which was not waited for yet.
        let done = unsafe { running.shared.device.get_fence_status(fence) };
        assert_eq!(done, Ok(true));
        running.wait().unwrap();
        assert_eq!(gpu.validation_messages(), Vec::<String>::new());
    }
}
