//! Devices, estimates with their standard errors, and what an estimate is held to.

use glam::{Vec3, vec3};
use lightfall::gpu::{Gpu, OpenOptions};
use lightfall::image::Picture;
use lightfall::render::Renderer;
use lightfall::scene::{Projection, Scene};
use lightfall::settings::{Direct, Length, Settings, Switch, Trace};
use lightfall::technique::{Row, TECHNIQUES};
use std::ops::Deref;

/// Standard errors that an estimate may be off: with a fixed seed this is decided once, and among a
/// hundred correct checks about one in a hundred runs of new seeds would fail.
pub const SIGMAS: f64 = 4.0;

/// A device under the validation layer, where that is installed, which must have nothing to say.
pub struct Device(Gpu);

impl Device {
    pub fn open() -> Self {
        let options = OpenOptions {
            device: None,
            validate: true,
        };
        Self(Gpu::open(&options).expect("a Vulkan device: install mesa-vulkan-drivers"))
    }

    /// Those that the device has.
    pub fn traversals(&self) -> Vec<Trace> {
        let caps = &self.info().caps;
        let mut traversals = vec![Trace::Software];
        for (there, trace) in [
            (caps.ray_query, Trace::Query),
            (caps.ray_tracing_pipeline, Trace::Pipeline),
        ] {
            match there {
                true => traversals.push(trace),
                false => println!("not tested: {} has no {trace:?}", self.info().name),
            }
        }
        traversals
    }

    /// Two for what takes many iterations: ours, and one through the driver's structures.
    /// [`assert_traversals_agree`] holds the third to them.
    pub fn two_traversals(&self) -> Vec<Trace> {
        self.traversals().into_iter().take(2).collect()
    }
}

impl Deref for Device {
    type Target = Gpu;
    fn deref(&self) -> &Gpu {
        &self.0
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            assert_eq!(self.validation_messages(), Vec::<String>::new());
        }
    }
}

/// All techniques; those that differ from `rtpm` in the search for photons only, which is no matter of
/// rays, on one traversal.
pub fn techniques(device: &Device) -> Vec<(&'static Row, Trace)> {
    let traversals = device.two_traversals();
    let of = |row: &Row| match row.name {
        "rtpm" | "sppm" | "path" => traversals.clone(),
        _ => vec![Trace::Software],
    };
    TECHNIQUES
        .iter()
        .flat_map(|row| of(row).into_iter().map(move |trace| (row, trace)))
        .collect()
}

/// Square images of `edge` pixels, `photons` light paths an iteration, one radius [m] for both maps;
/// direct light by photons, which begin without a guide.
pub fn settings(edge: u32, photons: u32, radius: f32) -> Settings {
    Settings {
        size: Some([edge; 2]),
        photons: Some(photons),
        radius: Some(Length::World(radius)),
        caustic_radius: Some(Length::World(radius)),
        technique: "rtpm".into(),
        direct: Direct::Photons,
        guide: Switch::Off,
        ..Settings::default()
    }
}

/// A layer's floats; `""` is the beauty image.
pub fn layer<'a>(picture: &'a Picture, name: &str) -> &'a [f32] {
    &picture
        .layers
        .iter()
        .find(|l| l.name == name)
        .expect(name)
        .pixels
}

/// A mean of independent iterations and its standard error.
#[derive(Debug, Clone, Copy)]
pub struct Estimate {
    pub mean: f64,
    pub error: f64,
}

impl Estimate {
    pub fn of(samples: &[f64]) -> Self {
        let n = samples.len() as f64;
        let mean = samples.iter().sum::<f64>() / n;
        let variance = samples.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        Self {
            mean,
            error: (variance / n).sqrt(),
        }
    }
}

/// Estimates of what `measure` finds in a picture; it must be linear in the pixels, as the value of
/// an iteration alone is got back from the running means.
pub fn estimate(
    renderer: &mut Renderer,
    iterations: u32,
    measure: impl Fn(&Picture) -> Vec<f64>,
) -> Vec<Estimate> {
    let mut samples: Vec<Vec<f64>> = Vec::new();
    let mut before = Vec::new();
    for n in 1..=iterations {
        renderer.iterate().unwrap();
        let total: Vec<f64> = measure(&renderer.picture().unwrap())
            .iter()
            .map(|s| s * f64::from(n))
            .collect();
        before.resize(total.len(), 0.0);
        samples.resize(total.len(), Vec::new());
        for i in 0..total.len() {
            samples[i].push(total[i] - before[i]);
        }
        before = total;
    }
    samples.iter().map(|s| Estimate::of(s)).collect()
}

/// The image's mean and the means of its 3 × 3 blocks, over all channels.
pub fn block_means(pixels: &[f32]) -> Vec<f64> {
    let edge = (pixels.len() / 3).isqrt();
    let mut sums = [(0.0, 0.0); 10];
    for (i, value) in pixels.iter().enumerate() {
        let (x, y) = (i / 3 % edge, i / 3 / edge);
        for block in [0, 1 + y * 3 / edge * 3 + x * 3 / edge] {
            sums[block].0 += f64::from(*value);
            sums[block].1 += 1.0;
        }
    }
    sums.iter().map(|(sum, n)| sum / n).collect()
}

/// Radiance [nit] towards the camera of `scene` as `radiance(eye, direction)` says, averaged over
/// each pixel of a square image.
pub fn expected(scene: &Scene, edge: u32, radiance: impl Fn(Vec3, Vec3) -> Vec3) -> Vec<f32> {
    const STRATA: u32 = 4;
    let camera = &scene.cameras[0];
    let world_from_camera = camera.world_from_camera;
    let ndc = |i: u32| (i as f32 + 0.5) / (edge * STRATA) as f32 * 2.0 - 1.0;
    let mut image = vec![0.0; (edge * edge * 3) as usize];
    for y in 0..edge * STRATA {
        for x in 0..edge * STRATA {
            let aside = vec3(ndc(x), -ndc(y), 0.0);
            let (eye, d) = match camera.projection {
                Projection::Perspective { yfov } => (Vec3::ZERO, aside * (yfov * 0.5).tan()),
                Projection::Orthographic { ymag } => (aside * ymag, Vec3::ZERO),
            };
            let d = world_from_camera.transform_vector3(d - Vec3::Z);
            let l = radiance(world_from_camera.transform_point3(eye), d.normalize());
            let at = (y / STRATA * edge + x / STRATA) as usize * 3;
            for c in 0..3 {
                image[at + c] += l[c] / (STRATA * STRATA) as f32;
            }
        }
    }
    image
}

/// By one iteration of the same seed: no pixel of any layer differs, and there is something in the layers of `full`.
pub fn assert_traversals_agree(
    device: &Device,
    scene: &Scene,
    settings: &Settings,
    what: &str,
    full: &[&str],
) {
    let image = |trace| {
        let settings = Settings {
            trace,
            ..settings.clone()
        };
        let mut renderer = Renderer::new(device, scene, &settings).unwrap();
        renderer.iterate().unwrap();
        renderer.picture().unwrap()
    };
    let traversals = device.traversals();
    let software = image(Trace::Software);
    for trace in traversals.iter().filter(|t| **t != Trace::Software) {
        let other = image(*trace);
        for name in [
            "", "emission", "direct", "caustic", "global", "albedo", "normal", "depth",
        ] {
            let [a, b] = [&software, &other].map(|picture| layer(picture, name));
            assert!(
                !full.contains(&name) || a.iter().any(|x| *x != 0.0),
                "{what}: nothing in layer '{name}'"
            );
            let pixels = (software.width * software.height) as usize;
            let channels = a.len() / pixels;
            let differs = |(a, b): &(&[f32], &[f32])| {
                a.iter()
                    .zip(*b)
                    .any(|(a, b)| (a - b).abs() > 1e-4 * a.abs())
            };
            let count = a
                .chunks(channels)
                .zip(b.chunks(channels))
                .filter(differs)
                .count();
            assert!(
                count == 0,
                "{what}, {trace:?}, layer '{name}': {count} of {pixels} pixels differ"
            );
        }
    }
}

/// Iterations of `path` for one that gathers photons, of which each finds many.
const PATHS_FOR_PHOTONS: u32 = 4;

/// Holds a layer to a closed form by every technique and traversal: the mean to 0.5 % and its standard error, each
/// of 3 × 3 blocks to both together; the standard error of the mean must be below 0.25 %, or the
/// comparison would say nothing.
pub fn check(
    scene: &Scene,
    settings: &Settings,
    iterations: u32,
    name: &str,
    radiance: impl Fn(Vec3, Vec3) -> Vec3,
) {
    check_by(|_| true, scene, settings, iterations, name, radiance);
}

/// [`check`] for the techniques that gather photons: for what no path from the eye can find.
pub fn check_photons(
    scene: &Scene,
    settings: &Settings,
    iterations: u32,
    name: &str,
    radiance: impl Fn(Vec3, Vec3) -> Vec3,
) {
    check_by(
        |row| row.photons,
        scene,
        settings,
        iterations,
        name,
        radiance,
    );
}

/// [`check`] for the techniques that are wanted.
pub fn check_by(
    wanted: impl Fn(&Row) -> bool,
    scene: &Scene,
    settings: &Settings,
    iterations: u32,
    name: &str,
    radiance: impl Fn(Vec3, Vec3) -> Vec3,
) {
    let device = Device::open();
    let edge = settings.size.unwrap()[0];
    let truth = block_means(&expected(scene, edge, radiance));
    let wanted = |(row, _): &(&'static Row, Trace)| wanted(row);
    for (row, trace) in techniques(&device).into_iter().filter(wanted) {
        if trace != Trace::Software {
            let settings = Settings {
                technique: row.name.into(),
                ..settings.clone()
            };
            assert_traversals_agree(&device, scene, &settings, row.name, &[]);
        }
        let settings = Settings {
            trace,
            technique: row.name.into(),
            // One of them by guided photons.
            guide: match row.name {
                "hash-grid" => Switch::On,
                _ => settings.guide,
            },
            ..settings.clone()
        };
        let iterations = match row.photons {
            true => iterations,
            false => iterations * PATHS_FOR_PHOTONS,
        };
        let trace = format!("{}, {trace:?}", row.name);
        let mut renderer = Renderer::new(&device, scene, &settings).unwrap();
        let found = estimate(&mut renderer, iterations, |picture| {
            block_means(layer(picture, name))
        });
        println!(
            "{trace}: mean {:.5} ± {:.5} of the truth",
            found[0].mean / truth[0],
            found[0].error / truth[0]
        );
        for (block, (f, t)) in found.iter().zip(&truth).enumerate() {
            let (off, sigma, percent) = ((f.mean - t).abs(), SIGMAS * f.error, 0.005 * t.abs());
            if block == 0 {
                assert!(f.error <= 0.0025 * t, "{trace}: too noisy: {f:?} for {t}");
                assert!(
                    off <= percent && off <= sigma.max(1e-5 * t),
                    "{trace}: mean {f:?} for {t}"
                );
            }
            assert!(
                off <= sigma + percent,
                "{trace}: block {block}: {f:?} for {t}"
            );
        }
    }
}
