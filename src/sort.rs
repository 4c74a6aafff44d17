//! Prefix sums and a stable radix sort on the device, without atomics: the same order on every run.

use crate::Result;
use crate::gpu::{Buffer, Commands, Gpu, Pass, Ptr};
use crate::shaders::spirv;
use crate::shared::{SCAN_CHUNK, SORT_CHUNK, SORT_DIGIT_BITS, ScanPush, SortPush};

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
}

impl Sort {
    /// For up to `capacity` pairs.
    pub fn new(gpu: &Gpu, capacity: usize) -> Result<Self> {
        let entries = capacity.div_ceil(SORT_CHUNK as usize) << SORT_DIGIT_BITS;
        Ok(Self {
            count: gpu.pass("sort", spirv("sort_count")?, &[], None)?,
            scatter: gpu.pass("sort", spirv("sort_scatter")?, &[], None)?,
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
        let chunks = count.div_ceil(SORT_CHUNK as usize);
        let mut from = 0;
        for shift in (0..bits).step_by(SORT_DIGIT_BITS as usize) {
            let push = SortPush {
                keys: self.keys[from].ptr(),
                values: self.values[from].ptr(),
                keys_out: self.keys[1 - from].ptr(),
                values_out: self.values[1 - from].ptr(),
                histogram: self.histogram.ptr(),
                count: count as u32,
                shift,
            };
            commands.dispatch(&self.count, &push, chunks);
            self.scan
                .record(commands, self.histogram.ptr(), chunks << SORT_DIGIT_BITS);
            commands.dispatch(&self.scatter, &push, chunks);
            from = 1 - from;
        }
        [self.keys[from].ptr(), self.values[from].ptr()]
    }
}
