//! Prefix sums and a stable radix sort on the device, without atomics: the same order on every run.

use crate::Result;
use crate::gpu::{Buffer, Commands, DeviceKind, Gpu, Pass, Ptr};
use crate::shaders::spirv;
use crate::shared::{SCAN_CHUNK, ScanPush, SortPush};

/// Exclusive prefix sums of up to a given number of values.
pub struct Scan {
    scan: Pass,
    add: Pass,
    /// Sums of chunks, chunks of those sums, and so on to a single one.
    totals: Vec<Buffer<u32>>,
}

impl Scan {
    /// For up to `capacity` values.
    pub fn new(gpu: &Gpu, capacity: usize) -> Result<Self> {
        let mut totals = Vec::new();
        let mut count = capacity;
        loop {
            count = count.div_ceil(SCAN_CHUNK as usize).max(1);
            totals.push(gpu.buffer("scan totals", count)?);
            if count == 1 {
                break;
            }
        }
        Ok(Self {
            scan: gpu.pass("scan", spirv("scan")?, &[], None)?,
            add: gpu.pass("scan", spirv("scan_add")?, &[], None)?,
            totals,
        })
    }

    /// Replaces each of `count` values by the sum of those before it.
    pub fn record(&self, commands: &mut Commands, values: Ptr<u32>, count: usize) {
        let mut levels = Vec::new();
        let (mut values, mut count) = (values, count);
        for totals in &self.totals {
            let push = ScanPush {
                values,
                totals: totals.ptr(),
                count: count as u32,
                unused: 0,
            };
            let chunks = count.div_ceil(SCAN_CHUNK as usize);
            commands.dispatch(&self.scan, &push, chunks);
            levels.push((push, count));
            if chunks <= 1 {
                break;
            }
            (values, count) = (totals.ptr(), chunks);
        }
        // The last level is one chunk: it is done already.
        levels.pop();
        for (push, count) in levels.iter().rev() {
            commands.dispatch(&self.add, push, *count);
        }
    }
}

/// Sorts pairs of keys and values by their keys.
pub struct Sort {
    count: Pass,
    scatter: Pass,
    scan: Scan,
    /// Input and scratch in turn.
    pub keys: [Buffer<u32>; 2],
    pub values: [Buffer<u32>; 2],
    histogram: Buffer<u32>,
    /// Of a digit at most.
    digit_bits: u32,
    /// Keys that a thread takes in order.
    chunk: usize,
}

/// Bits of a digit at most, and keys of a thread: a CPU device has few threads and sorts in fewer passes.
fn widths(gpu: &Gpu) -> (u32, u32) {
    match gpu.info().kind {
        DeviceKind::Cpu => (11, 2048),
        _ => (8, 256),
    }
}

impl Sort {
    /// For up to `capacity` pairs.
    pub fn new(gpu: &Gpu, capacity: usize) -> Result<Self> {
        let (digit_bits, chunk) = widths(gpu);
        let constants = [0, 0, chunk];
        let entries = capacity.div_ceil(chunk as usize) << digit_bits;
        Ok(Self {
            count: gpu.pass("sort", spirv("sort_count")?, &constants, None)?,
            scatter: gpu.pass("sort", spirv("sort_scatter")?, &constants, None)?,
            digit_bits,
            chunk: chunk as usize,
            scan: Scan::new(gpu, entries)?,
            keys: [
                gpu.buffer("sort keys", capacity)?,
                gpu.buffer("sort keys", capacity)?,
            ],
            values: [
                gpu.buffer("sort values", capacity)?,
                gpu.buffer("sort values", capacity)?,
            ],
            histogram: gpu.buffer("sort histogram", entries)?,
        })
    }

    /// Sorts the first `count` pairs of `keys[0]` and `values[0]` by the low `bits` of the keys; keys and
    /// values end in the buffers that are returned.
    pub fn record(&self, commands: &mut Commands, count: usize, bits: u32) -> [Ptr<u32>; 2] {
        let chunks = count.div_ceil(self.chunk);
        // Digits as short as as few passes allow: histograms are long.
        let digit_bits = bits.div_ceil(bits.div_ceil(self.digit_bits).max(1));
        let mut from = 0;
        for shift in (0..bits).step_by(digit_bits.max(1) as usize) {
            let push = SortPush {
                keys: self.keys[from].ptr(),
                values: self.values[from].ptr(),
                keys_out: self.keys[1 - from].ptr(),
                values_out: self.values[1 - from].ptr(),
                histogram: self.histogram.ptr(),
                count: count as u32,
                digit_bits,
                shift,
                unused: 0,
            };
            commands.dispatch(&self.count, &push, chunks);
            self.scan
                .record(commands, self.histogram.ptr(), chunks << digit_bits);
            commands.dispatch(&self.scatter, &push, chunks);
            from = 1 - from;
        }
        [self.keys[from].ptr(), self.values[from].ptr()]
    }
}
