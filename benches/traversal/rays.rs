//! Scene rays: camera rays, one diffuse bounce as it comes, in any order and sorted, shadow rays.

use crate::room::{LAMP, room};
use crate::{RUNS, median};
use glam::{Quat, Vec3, vec3};
use lightfall::Result;
use lightfall::gpu::{Buffer, Gpu, Pass};
use lightfall::scene::Scene;
use lightfall::settings::Trace;
use lightfall::shared::{BenchRaysPush, NONE, Ray};
use lightfall::view::camera_frame;
use lightfall::world::{World, features};
use std::f32::consts::TAU;

const EDGE: u32 = 512;

/// A traversal with its own copy of the scene.
struct Tracer {
    world: World,
    pass: Pass,
    met: Buffer<u32>,
}

pub fn run(gpu: &Gpu) -> Result<()> {
    println!(
        "| rays, 512 × 512 | triangles | by | Mrays/s | software is faster by | hits that differ from software's |"
    );
    println!("|---|---|---|---|---|---|");
    let caps = &gpu.info().caps;
    let traversals = [
        Some(("software", Trace::Software)),
        caps.ray_query.then_some(("ray query", Trace::Query)),
        caps.ray_tracing_pipeline
            .then_some(("pipeline", Trace::Pipeline)),
    ];
    let traversals: Vec<_> = traversals.into_iter().flatten().collect();
    for (balls, splits) in [(8, 3), (15, 5)] {
        let scene = room(balls, splits);
        let tracers = traversals
            .iter()
            .map(|(_, trace)| tracer(gpu, &scene, *trace))
            .collect::<Result<Vec<_>>>()?;
        let camera = camera_rays(&scene);
        let met = tracers[0]
            .trace(gpu, &gpu.upload("rays", &camera)?, false)?
            .1;
        let (bounced, shadow) = from_hits(&scene, &camera, &met);
        let any_order = shuffled(&bounced);
        let sorted = sorted(&any_order);
        for (name, rays, shadow) in [
            ("camera", &camera, false),
            ("one bounce", &bounced, false),
            ("one bounce, in any order", &any_order, false),
            ("one bounce, sorted", &sorted, false),
            ("shadow", &shadow, true),
        ] {
            let rays = gpu.upload("rays", rays)?;
            let mut ms = vec![Vec::new(); tracers.len()];
            let mut met = vec![Vec::new(); tracers.len()];
            for run in 0..=RUNS {
                for (i, tracer) in tracers.iter().enumerate() {
                    let (time, hits) = tracer.trace(gpu, &rays, shadow)?;
                    met[i] = hits;
                    if run > 0 {
                        ms[i].push(time);
                    }
                }
            }
            let ms: Vec<f64> = ms.iter_mut().map(|ms| median(ms)).collect();
            for (i, (by, _)) in traversals.iter().enumerate() {
                let differ = met[0].iter().zip(&met[i]).filter(|(a, b)| a != b).count();
                println!(
                    "| {name} | {} | {by} | {:.2} | **{:.2}** | {differ} |",
                    scene.triangles.len(),
                    rays.len() as f64 / ms[i] * 1e-3,
                    ms[i] / ms[0],
                );
            }
        }
    }
    println!();
    Ok(())
}

/// Camera rays and bounced rays in any order, in millions a second.
pub fn rates(gpu: &Gpu, scene: &Scene, trace: Trace) -> Result<[f64; 2]> {
    let tracer = tracer(gpu, scene, trace)?;
    let camera = camera_rays(scene);
    let met = tracer.trace(gpu, &gpu.upload("rays", &camera)?, false)?.1;
    let bounced = shuffled(&from_hits(scene, &camera, &met).0);
    let mut rates = [0.0; 2];
    for (rate, rays) in rates.iter_mut().zip([camera, bounced]) {
        let rays = gpu.upload("rays", &rays)?;
        let times = (0..=RUNS).map(|_| Ok(tracer.trace(gpu, &rays, false)?.0));
        let mut times = times.collect::<Result<Vec<_>>>()?;
        *rate = rays.len() as f64 * 1e-3 / median(&mut times[1..]);
    }
    Ok(rates)
}

fn tracer(gpu: &Gpu, scene: &Scene, trace: Trace) -> Result<Tracer> {
    let world = World::new(gpu, scene, trace, features(scene))?;
    Ok(Tracer {
        pass: world.pass(gpu, "bench.rays", 0, &[])?,
        met: gpu.buffer("met", (EDGE * EDGE) as usize)?,
        world,
    })
}

impl Tracer {
    /// Milliseconds on the device, and what was met.
    fn trace(&self, gpu: &Gpu, rays: &Buffer<Ray>, shadow: bool) -> Result<(f64, Vec<u32>)> {
        let push = BenchRaysPush {
            world: self.world.world.ptr(),
            rays: rays.ptr(),
            met: self.met.ptr(),
            count: rays.len() as u32,
            shadow: u32::from(shadow),
        };
        let mut commands = gpu.commands()?;
        commands.dispatch(&self.pass, &push, rays.len());
        let ms = commands.submit()?.iter().map(|(_, ms)| ms).sum();
        Ok((ms, gpu.read(&self.met, 0..rays.len())?))
    }
}

/// Through pixel centres, in tiles of 8 × 8 as the view pass goes.
fn camera_rays(scene: &Scene) -> Vec<Ray> {
    let frame = camera_frame(&scene.cameras[0], [EDGE; 2]);
    let [origin, right, up, forward] = [
        frame.camera_position_w,
        frame.camera_right_w,
        frame.camera_up_w,
        frame.camera_forward_w,
    ]
    .map(Vec3::from);
    let at = |pixel: u32| (pixel as f32 + 0.5) / EDGE as f32 * 2.0 - 1.0;
    (0..EDGE * EDGE)
        .map(|i| {
            let (tile, within) = (i / 64, i % 64);
            let (x, y) = (
                tile % (EDGE / 8) * 8 + within % 8,
                tile / (EDGE / 8) * 8 + within / 8,
            );
            ray(origin, forward + at(x) * right - at(y) * up, f32::MAX)
        })
        .collect()
}

fn ray(origin: Vec3, direction: Vec3, distance_w: f32) -> Ray {
    Ray {
        origin_w: origin.into(),
        direction_w: direction.normalize().into(),
        distance_w,
    }
}

/// From where camera rays hit: a cosine-distributed direction each, and a point on the lamp each.
fn from_hits(scene: &Scene, camera: &[Ray], met: &[u32]) -> (Vec<Ray>, Vec<Ray>) {
    let mut random = Random(1);
    let hits = camera
        .iter()
        .zip(met)
        .filter(|(_, vertex)| **vertex != NONE);
    hits.map(|(camera, &vertex)| {
        let [a, b, c] = [0, 1, 2].map(|i| scene.vertices[vertex as usize + i].position_w);
        let normal = (b - a).cross(c - a).normalize();
        let (origin, direction) = (Vec3::from(camera.origin_w), Vec3::from(camera.direction_w));
        let point =
            origin + direction * ((a - origin).dot(normal) / direction.dot(normal)) + 1e-5 * normal;
        let (u, phi) = (random.next(), TAU * random.next());
        let cosine = vec3(u.sqrt() * phi.cos(), u.sqrt() * phi.sin(), (1.0 - u).sqrt());
        let on_lamp =
            LAMP[0] + LAMP[1] * (2.0 * random.next() - 1.0) + LAMP[2] * (2.0 * random.next() - 1.0);
        let way = on_lamp - 1e-3 * Vec3::Y - point;
        (
            ray(
                point,
                Quat::from_rotation_arc(Vec3::Z, normal) * cosine,
                f32::MAX,
            ),
            ray(point, way, way.length()),
        )
    })
    .unzip()
}

/// As photons have bounced a few times.
fn shuffled(rays: &[Ray]) -> Vec<Ray> {
    let mut rays = rays.to_vec();
    let mut random = Random(2);
    for i in (1..rays.len()).rev() {
        rays.swap(i, ((random.next() * (i + 1) as f32) as usize).min(i));
    }
    rays
}

/// By the cell of their origin, 32 an axis along a Morton curve, then by the octant of their direction: what sorting rays
/// could gain, without what it costs.
fn sorted(rays: &[Ray]) -> Vec<Ray> {
    let origins = || rays.iter().map(|ray| Vec3::from(ray.origin_w));
    let min = origins().reduce(Vec3::min).unwrap_or_default();
    let max = origins().reduce(Vec3::max).unwrap_or_default();
    let key = |ray: &Ray| {
        let cell = ((Vec3::from(ray.origin_w) - min) / (max - min) * 31.0).as_uvec3();
        let bits = (0..5).flat_map(|bit| cell.to_array().map(|x| x >> bit & 1));
        let octant = ray.direction_w.map(|d| u32::from(d < 0.0));
        octant
            .into_iter()
            .chain(bits)
            .enumerate()
            .fold(0, |key, (i, bit)| key | bit << i)
    };
    let mut rays = rays.to_vec();
    rays.sort_by_cached_key(key);
    rays
}

/// Weyl sequence, mixed (Steele et al. 2014, SplitMix64).
struct Random(u64);

impl Random {
    /// Uniform below 1.
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 40) as f32 / (1 << 24) as f32
    }
}
