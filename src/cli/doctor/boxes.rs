//! Which boxes does a driver report, by ray query or by pipelines? The host knows the answers.

use std::time::Instant;

use bytemuck::{Pod, Zeroable};

use super::{Finding, Verdict};
use crate::gpu::{Gpu, Instance, Pass, Ptr, RayShaders};
use crate::{Result, shaders};

/// Boxes and points of the main test; few enough for builders that need Morton order to end.
const BOXES: usize = 8192;
const POINTS: usize = 2048;
/// Of a box in the unit cube: about 10 boxes hold a point.
const EDGE: f32 = 0.107;
/// What counts as no length beside a box of this edge (see `find_near` in glsl/lib/near.glsl).
const NO_LENGTH: f32 = 1e-6 * EDGE;
/// Boxes remembered per point; many times the mean, so that no driver overflows it.
const CAPACITY: usize = 256;

type Box3 = [f32; 6];
type Point = [f32; 3];

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct BoxesPush {
    tlas: u64,
    points: Ptr<Point>,
    counts: Ptr<u32>,
    reported: Ptr<u32>,
    count: u32,
    capacity: u32,
    t_max: f32,
    pad: u32,
}

/// Asks the driver which boxes hold which points.
pub struct Probe<'a> {
    gpu: &'a Gpu,
    by: &'static str,
    pass: Pass,
}

struct Answers {
    /// Boxes that the driver reported, per point; the first [`CAPACITY`].
    reported: Vec<Vec<u32>>,
    /// Time of the question alone [ms].
    trace_ms: f64,
}

/// What is wrong with some answers.
#[derive(Default)]
struct Tally {
    /// Boxes that hold a point.
    true_count: usize,
    missed: usize,
    /// Boxes reported again for the same point.
    again: usize,
    /// Boxes reported that do not hold the point.
    beside: usize,
}

impl<'a> Probe<'a> {
    /// Needs VK_KHR_ray_query.
    pub fn query(gpu: &'a Gpu) -> Result<Self> {
        let pass = gpu.pass("boxes", shaders::spirv("doctor.boxes.query")?, &[], None)?;
        Self::new(gpu, "ray query", pass)
    }

    /// Needs VK_KHR_ray_tracing_pipeline.
    pub fn pipeline(gpu: &'a Gpu) -> Result<Self> {
        let called = RayShaders {
            any_hit: Some(shaders::spirv("doctor.boxes.any")?),
            intersection: Some(shaders::spirv("doctor.boxes.intersection")?),
            ..RayShaders::default()
        };
        let code = shaders::spirv("doctor.boxes.pipeline")?;
        let pass = gpu.ray_pass("boxes", code, &called, &[], None)?;
        Self::new(gpu, "pipelines", pass)
    }

    fn new(gpu: &'a Gpu, by: &'static str, pass: Pass) -> Result<Self> {
        let probe = Self { gpu, by, pass };
        // Some drivers compile at the first dispatch.
        probe.ask(&[cube([0.5; 3], 1.0)], &[[0.5; 3]], NO_LENGTH)?;
        Ok(probe)
    }

    pub fn scratch(&self) -> Finding {
        let alignment = self.gpu.info().caps.scratch_alignment;
        Finding {
            test: "scratch memory",
            verdict: Verdict::Good,
            text: format!("aligned to {alignment} bytes, as the driver asks"),
        }
    }

    /// Boxes missed, reported twice or in vain, and what their order costs.
    pub fn boxes(&self) -> Result<[Finding; 3]> {
        let centers: Vec<_> = (0..BOXES as u32).map(random_point).collect();
        let random: Vec<_> = centers.iter().map(|center| cube(*center, EDGE)).collect();
        let mut sorted_centers = centers;
        sorted_centers.sort_by_key(morton);
        let sorted: Vec<_> = sorted_centers
            .iter()
            .map(|center| cube(*center, EDGE))
            .collect();
        let mut points: Vec<_> = (BOXES..BOXES + POINTS)
            .map(|i| random_point(i as u32))
            .collect();
        points.sort_by_key(morton);

        let in_order = self.ask(&sorted, &points, NO_LENGTH)?;
        let shuffled = self.ask(&random, &points, NO_LENGTH)?;
        let tally = tally(&sorted, &points, &in_order);
        let wrong = tally.missed + tally.again > 0;
        let found = Finding {
            test: "boxes",
            verdict: if wrong { Verdict::Bad } else { Verdict::Good },
            text: format!(
                "{POINTS} points lie in {} boxes: {} missed, {} reported twice by {}{}",
                tally.true_count,
                tally.missed,
                tally.again,
                self.by,
                if wrong { "; use --trace software" } else { "" },
            ),
        };
        let beside = Finding {
            test: "boxes beside",
            verdict: Verdict::Good,
            text: format!(
                "{} boxes reported that do not hold the point: allowed, lightfall checks each",
                tally.beside
            ),
        };
        let ratio = shuffled.trace_ms / in_order.trace_ms.max(1e-6);
        let (fast, slow) = (in_order.trace_ms, shuffled.trace_ms);
        let times = format!("{fast:.3} ms in Morton order, {slow:.3} ms in random order");
        let order = Finding {
            test: "order of boxes",
            verdict: if ratio > 2.0 {
                Verdict::Odd
            } else {
                Verdict::Good
            },
            text: match ratio > 2.0 {
                true => format!("{ratio:.0} times slower unsorted ({times}): lightfall sorts"),
                false => times,
            },
        };
        Ok([found, beside, order])
    }

    /// Rays of length zero, and boxes of size zero.
    pub fn no_length(&self) -> Result<Finding> {
        let mut points: Vec<_> = (0..256).map(random_point).collect();
        points.sort_by_key(morton);
        let mut lost = Vec::new();
        for (edge, boxes) in [(EDGE, "boxes"), (0.0, "boxes of no size")] {
            let cubes: Vec<_> = points.iter().map(|point| cube(*point, edge)).collect();
            for (t_max, rays) in [(0.0, "length 0"), (NO_LENGTH, "almost no length")] {
                let answers = self.ask(&cubes, &points, t_max)?;
                let missed = tally(&cubes, &points, &answers).missed;
                if missed > 0 {
                    lost.push(format!("rays of {rays} miss {missed} {boxes}"));
                }
            }
        }
        Ok(Finding {
            test: "rays of length 0",
            verdict: if lost.is_empty() {
                Verdict::Good
            } else {
                Verdict::Odd
            },
            text: match lost.is_empty() {
                true => "find boxes of any size".to_owned(),
                false => format!("{}: lightfall uses none", lost.join(", ")),
            },
        })
    }

    /// A box whose first coordinate is NaN is inactive (Vulkan, "Inactive Primitives and Instances")
    /// and must not touch the others.
    pub fn inactive(&self) -> Result<Finding> {
        let mut points: Vec<_> = (0..1024).map(random_point).collect();
        points.sort_by_key(morton);
        let mut boxes: Vec<_> = points.iter().map(|point| cube(*point, EDGE)).collect();
        // The last one: there lavapipe's builder lets it swallow the whole tree.
        if let Some(last) = boxes.last_mut() {
            *last = [f32::NAN; 6];
        }
        let answers = self.ask(&boxes, &points, NO_LENGTH)?;
        let Tally {
            true_count, missed, ..
        } = tally(&boxes, &points, &answers);
        Ok(Finding {
            test: "inactive boxes",
            verdict: if missed == 0 {
                Verdict::Good
            } else {
                Verdict::Odd
            },
            text: match missed {
                0 => "a NaN box leaves the others alone".to_owned(),
                _ => format!(
                    "a NaN box hides {missed} of {true_count} others: lightfall never makes one"
                ),
            },
        })
    }

    fn ask(&self, boxes: &[Box3], points: &[Point], t_max: f32) -> Result<Answers> {
        let gpu = self.gpu;
        let box_buffer = gpu.upload("boxes", boxes)?;
        let point_buffer = gpu.upload("points", points)?;
        let counts = gpu.buffer::<u32>("counts", points.len())?;
        let reported = gpu.buffer::<u32>("reported", points.len() * CAPACITY)?;
        let blas = gpu.box_blas("build boxes", boxes.len())?;
        let tlas = gpu.tlas("build instance", 1)?;
        let mut commands = gpu.commands()?;
        commands.build_boxes(&blas, box_buffer.ptr(), boxes.len());
        let instance = Instance {
            blas_address: blas.address(),
            transform: Instance::IDENTITY,
            custom_index: 0,
            mask: 0xff,
            facing_cull_disable: false,
            front_ccw: false,
        };
        commands.build_tlas(&tlas, &[instance]);
        commands.submit()?;

        let push = BoxesPush {
            tlas: tlas.address(),
            points: point_buffer.ptr(),
            counts: counts.ptr(),
            reported: reported.ptr(),
            count: points.len() as u32,
            capacity: CAPACITY as u32,
            t_max,
            pad: 0,
        };
        let mut commands = gpu.commands()?;
        commands.dispatch(&self.pass, &push, points.len());
        let start = Instant::now();
        let timings = commands.submit()?;
        let host_ms = start.elapsed().as_secs_f64() * 1e3;
        let device_ms = timings.iter().map(|(_, ms)| ms).sum();
        let counts = gpu.read(&counts, 0..points.len())?;
        let reported = gpu.read(&reported, 0..points.len() * CAPACITY)?;
        Ok(Answers {
            reported: reported
                .chunks(CAPACITY)
                .zip(counts)
                .map(|(ids, count)| ids.iter().copied().take(count as usize).collect())
                .collect(),
            trace_ms: if device_ms > 0.0 { device_ms } else { host_ms },
        })
    }
}

/// Compares with brute force.
fn tally(boxes: &[Box3], points: &[Point], answers: &Answers) -> Tally {
    let mut tally = Tally::default();
    for (point, reported) in points.iter().zip(&answers.reported) {
        let mut ids = reported.clone();
        ids.sort_unstable();
        ids.dedup();
        tally.again += reported.len() - ids.len();
        let around = (0u32..).zip(boxes).filter(|(_, b)| holds(b, point));
        let (mut count, mut seen) = (0, 0);
        for (id, _) in around {
            count += 1;
            seen += usize::from(ids.binary_search(&id).is_ok());
        }
        tally.true_count += count;
        tally.missed += count - seen;
        tally.beside += ids.len() - seen;
    }
    tally
}

fn holds([x0, y0, z0, x1, y1, z1]: &Box3, [x, y, z]: &Point) -> bool {
    (x0..=x1).contains(&x) && (y0..=y1).contains(&y) && (z0..=z1).contains(&z)
}

fn cube([x, y, z]: Point, edge: f32) -> Box3 {
    let r = 0.5 * edge;
    [x - r, y - r, z - r, x + r, y + r, z + r]
}

/// The `index`-th of a fixed set of points in the unit cube (R3 sequence, Roberts 2018).
fn random_point(index: u32) -> Point {
    [
        0.819_172_513_396_164_4,
        0.671_043_606_703_789_2,
        0.549_700_477_901_970_3,
    ]
    .map(|step: f64| (step * f64::from(index + 1)).fract() as f32)
}

/// 10 bits an axis, interleaved.
fn morton(point: &Point) -> u32 {
    let axis = |x: f32| {
        (0..10).fold(0, |code, bit| {
            code | ((x * 1024.0) as u32 >> bit & 1) << (3 * bit)
        })
    };
    let [x, y, z] = *point;
    axis(x) << 2 | axis(y) << 1 | axis(z)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A doctor that overlooks a sick driver is worse than none.
    #[test]
    fn every_kind_of_wrong_answer_is_counted() {
        let boxes = [
            cube([0.0; 3], 2.0),
            cube([0.5; 3], 2.0),
            cube([9.0; 3], 1.0),
        ];
        let points = [[0.0; 3], [0.5; 3], [9.0; 3]];
        let answers = |reported: [&[u32]; 3]| Answers {
            reported: reported.map(<[u32]>::to_vec).to_vec(),
            trace_ms: 0.0,
        };
        let count = |reported| {
            let tally = tally(&boxes, &points, &answers(reported));
            [tally.true_count, tally.missed, tally.again, tally.beside]
        };
        assert_eq!(count([&[1, 0], &[0, 1], &[2]]), [5, 0, 0, 0]);
        assert_eq!(count([&[1], &[0, 1], &[]]), [5, 2, 0, 0]);
        assert_eq!(count([&[1, 0, 1, 1], &[0, 1], &[2]]), [5, 0, 2, 0]);
        assert_eq!(count([&[1, 0], &[0, 2, 1], &[2, 0]]), [5, 0, 0, 2]);
    }

    #[test]
    fn morton_order_interleaves() {
        assert_eq!(morton(&[0.5, 0.0, 0.0]), 1 << 29);
        assert_eq!(morton(&[0.0, 0.0, 0.999_999]), 0x0924_9249);
    }
}
