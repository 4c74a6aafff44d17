//! Typed device memory and how bytes get there and back.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use gpu_allocator::MemoryLocation;

use super::device::Gpu;
use super::memory::RawBuffer;
use crate::Result;

/// Bytes copied at once on devices whose memory the host does not see.
const STAGING_BYTES: usize = 64 << 20;

/// The device address of a `T` or the first of many; in GLSL a buffer reference.
///
/// Like a raw pointer it keeps nothing alive.
#[repr(transparent)]
pub struct Ptr<T>(u64, PhantomData<fn() -> T>);

/// `len` values of `T` on the device. Clones share the memory.
pub struct Buffer<T> {
    pub(super) raw: Arc<RawBuffer>,
    name: &'static str,
    len: usize,
    of: PhantomData<fn() -> T>,
}

impl<T> Ptr<T> {
    pub const fn null() -> Self {
        Self(0, PhantomData)
    }

    /// The address of the value `elements` further on.
    pub fn offset(self, elements: usize) -> Self {
        let bytes = elements as u64 * size_of::<T>() as u64;
        Self(self.0 + bytes, PhantomData)
    }

    pub fn address(self) -> u64 {
        self.0
    }

    /// The same address, seen as values of another type.
    pub fn cast<U>(self) -> Ptr<U> {
        Ptr(self.0, PhantomData)
    }
}

impl<T> Clone for Ptr<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Ptr<T> {}

impl<T> fmt::Debug for Ptr<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#x}", self.0)
    }
}

// SAFETY: a transparent u64, for which zero is the null address.
unsafe impl<T> Zeroable for Ptr<T> {}
// SAFETY: a transparent u64; nothing on the host ever follows the address.
unsafe impl<T: 'static> Pod for Ptr<T> {}

impl<T> Buffer<T> {
    /// The address of the first value; valid while a clone of this buffer lives.
    pub fn ptr(&self) -> Ptr<T> {
        Ptr(self.raw.address, PhantomData)
    }

    pub fn len(&self) -> usize {
        self.len
    }

    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The size of all values.
    pub fn bytes(&self) -> usize {
        self.len * size_of::<T>()
    }

    /// The bytes of the values in `range`, or what is wrong with it.
    pub(super) fn byte_range(
        &self,
        range: &Range<usize>,
    ) -> std::result::Result<Range<usize>, String> {
        if range.start > range.end || range.end > self.len {
            return Err(format!(
                "values {}..{} of {}, which has {}",
                range.start, range.end, self.name, self.len
            ));
        }
        Ok(range.start * size_of::<T>()..range.end * size_of::<T>())
    }
}

impl<T> Clone for Buffer<T> {
    fn clone(&self) -> Self {
        Self {
            raw: self.raw.clone(),
            ..*self
        }
    }
}

impl Gpu {
    /// Memory for `len` values, contents undefined. A length of 0 is allowed.
    ///
    /// Fails where the device allows no buffer of that size or has no memory left.
    pub fn buffer<T: Pod>(&self, name: &'static str, len: usize) -> Result<Buffer<T>> {
        use vk::BufferUsageFlags as Usage;
        let shared = &self.shared;
        let mut usage = Usage::STORAGE_BUFFER
            | Usage::TRANSFER_SRC
            | Usage::TRANSFER_DST
            | Usage::SHADER_DEVICE_ADDRESS;
        if shared.accel.is_some() {
            usage |= Usage::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
        }
        let location = match shared.info.caps.unified {
            true => MemoryLocation::GpuToCpu,
            false => MemoryLocation::GpuOnly,
        };
        self.buffer_at(name, len, usage, location)
    }

    /// Memory that the host reads without a copy of its own: for few values that the device brings there.
    pub fn host_buffer<T: Pod>(&self, name: &'static str, len: usize) -> Result<Buffer<T>> {
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        self.buffer_at(name, len, usage, MemoryLocation::GpuToCpu)
    }

    fn buffer_at<T: Pod>(
        &self,
        name: &'static str,
        len: usize,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> Result<Buffer<T>> {
        let bytes = (len.max(1) as u64).saturating_mul(size_of::<T>() as u64);
        let raw = RawBuffer::new(&self.shared, name, bytes, usage, location)?;
        Ok(Buffer {
            raw: Arc::new(raw),
            name,
            len,
            of: PhantomData,
        })
    }

    /// A buffer that holds `data`.
    pub fn upload<T: Pod>(&self, name: &'static str, data: &[T]) -> Result<Buffer<T>> {
        let buffer = self.buffer(name, data.len())?;
        self.write(&buffer, 0, data)?;
        Ok(buffer)
    }

    /// Overwrites the values from `first` on. No submitted work may be using them.
    pub fn write<T: Pod>(&self, buffer: &Buffer<T>, first: usize, data: &[T]) -> Result<()> {
        let range = first..first.saturating_add(data.len());
        let range = buffer
            .byte_range(&range)
            .map_err(|fault| self.shared.error(format!("write of {fault}")))?;
        self.write_bytes(&buffer.raw, range.start, bytemuck::cast_slice(data))
    }

    /// The values in `range`.
    pub fn read<T: Pod>(&self, buffer: &Buffer<T>, range: Range<usize>) -> Result<Vec<T>> {
        let bytes = buffer
            .byte_range(&range)
            .map_err(|fault| self.shared.error(format!("read of {fault}")))?;
        let mut data = vec![T::zeroed(); range.len()];
        self.read_bytes(
            &buffer.raw,
            bytes.start,
            bytemuck::cast_slice_mut(&mut data),
        )?;
        Ok(data)
    }

    pub(super) fn write_bytes(
        &self,
        buffer: &Arc<RawBuffer>,
        first: usize,
        data: &[u8],
    ) -> Result<()> {
        if buffer.is_mapped() {
            buffer.write(first, data);
            return Ok(());
        }
        for (chunk, at) in data
            .chunks(STAGING_BYTES)
            .zip((first..).step_by(STAGING_BYTES))
        {
            let staging = self.staging(chunk.len(), MemoryLocation::CpuToGpu)?;
            staging.write(0, chunk);
            let mut commands = self.commands()?;
            commands.copy_bytes(&staging, 0, buffer, at, chunk.len());
            commands.submit()?;
        }
        Ok(())
    }

    fn read_bytes(&self, buffer: &Arc<RawBuffer>, first: usize, data: &mut [u8]) -> Result<()> {
        if buffer.is_mapped() {
            buffer.read(first, data);
            return Ok(());
        }
        let starts = (first..).step_by(STAGING_BYTES);
        for (chunk, at) in data.chunks_mut(STAGING_BYTES).zip(starts) {
            let staging = self.staging(chunk.len(), MemoryLocation::GpuToCpu)?;
            let mut commands = self.commands()?;
            commands.copy_bytes(buffer, at, &staging, 0, chunk.len());
            commands.submit()?;
            staging.read(0, chunk);
        }
        Ok(())
    }

    /// Mapped memory to copy through.
    pub(super) fn staging(&self, bytes: usize, location: MemoryLocation) -> Result<Arc<RawBuffer>> {
        let usage = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
        RawBuffer::new(&self.shared, "staging", bytes as u64, usage, location).map(Arc::new)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Gpu;
    use super::STAGING_BYTES;

    /// A device that hides its memory from the host, as discrete ones do.
    #[test]
    fn staging_moves_the_same_bytes() {
        let gpu = Gpu::open_as(|info| info.caps.unified = false);
        // Two and a bit rounds of staging.
        let data: Vec<u32> = (0..STAGING_BYTES as u32 / 2 + 3).collect();
        let buffer = gpu.upload("data", &data).unwrap();
        assert!(!buffer.raw.is_mapped());
        gpu.write(&buffer, 5, &[77, 78]).unwrap();
        assert_eq!(gpu.read(&buffer, 4..8).unwrap(), [4, 77, 78, 7]);
        gpu.write(&buffer, 5, &[5, 6]).unwrap();
        assert!(gpu.read(&buffer, 0..data.len()).unwrap() == data);
        assert_eq!(gpu.validation_messages(), Vec::<String>::new());
    }
}
