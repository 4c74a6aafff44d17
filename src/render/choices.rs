//! What settings leave open, from the scene and the device; and what they may not ask for.

use crate::gpu::{DeviceInfo, DeviceKind, Gpu};
use crate::scene::{Camera, Material, Scene, Triangle};
use crate::settings::{AUTO, Trace};
use crate::technique::{Row, TECHNIQUES};
use crate::{Error, Result};

/// What [`Trace::Auto`] takes: ray queries where the device traces rays in hardware, pipelines on GPUs that have no
/// ray queries; a CPU device's are both slower than our tree.
pub fn auto_trace(info: &DeviceInfo) -> Trace {
    match info.kind {
        DeviceKind::Cpu => Trace::Software,
        _ if info.caps.ray_query => Trace::Query,
        _ if info.caps.ray_tracing_pipeline => Trace::Pipeline,
        _ => Trace::Software,
    }
}

pub(super) fn choose_trace(gpu: &Gpu, wish: Trace) -> Result<Trace> {
    let info = gpu.info();
    let lacks = |what: &str| {
        Err(Error::Device {
            device: info.name.clone(),
            fault: format!("no {what} here; use --trace auto"),
        })
    };
    match wish {
        Trace::Query if !info.caps.ray_query => lacks("ray queries (VK_KHR_ray_query)"),
        Trace::Pipeline if !info.caps.ray_tracing_pipeline => {
            lacks("ray tracing pipelines (VK_KHR_ray_tracing_pipeline)")
        }
        Trace::Auto => Ok(auto_trace(info)),
        wish => Ok(wish),
    }
}

/// Boxes where the device traces rays in hardware; elsewhere the hashed grid is measured to be faster
/// (benches/README.md).
pub(super) fn choose_technique(gpu: &Gpu, wish: &str) -> Result<&'static Row> {
    let info = gpu.info();
    let name = match wish {
        AUTO if info.traces_in_hardware() || info.caps.subgroup_size == 0 => "rtpm",
        AUTO => "hash-grid",
        wish => wish,
    };
    TECHNIQUES
        .iter()
        .find(|row| row.name == name)
        .ok_or_else(|| Error::Option {
            option: "--technique",
            fault: format!("there is no technique {name}"),
        })
}

pub(super) fn choose_camera<'a>(scene: &'a Scene, wish: Option<&str>) -> Result<&'a Camera> {
    let Some(wish) = wish else {
        return scene.cameras.first().ok_or(Error::Option {
            option: "--camera",
            fault: "the scene has no camera".into(),
        });
    };
    let by_index = wish.parse().ok().and_then(|i: usize| scene.cameras.get(i));
    by_index
        .or_else(|| scene.cameras.iter().find(|c| c.name == wish))
        .ok_or_else(|| Error::Option {
            option: "--camera",
            fault: format!(
                "no camera {wish}; the scene has {}",
                scene
                    .cameras
                    .iter()
                    .enumerate()
                    .map(|(i, c)| format!("{i} ({})", c.name))
                    .collect::<Vec<_>>()
                    .join(", ")
            ),
        })
}

pub(super) fn default_size(camera: &Camera) -> [u32; 2] {
    const WIDTH: f32 = 1024.0;
    let aspect = camera.aspect.unwrap_or(16.0 / 9.0).clamp(1.0 / 16.0, 16.0);
    [WIDTH as u32, (WIDTH / aspect).round() as u32]
}

/// A photon's number takes 31 bits.
pub(super) fn check_photons(paths: u32, max_depth: u32) -> Result<()> {
    let most = (1 << 31) / max_depth.max(1);
    if paths <= most {
        return Ok(());
    }
    Err(Error::Option {
        option: "--photons",
        fault: format!(
            "{paths} light paths of up to {max_depth} edges could leave more than 2^31 photons: at most {most}"
        ),
    })
}

/// As many as pixels, about: between 60 000 and 200 000 light paths at 256 × 256 the error for the time
/// hardly changed. A CPU device takes fewer, so that the first picture comes soon; a GPU wants more work.
pub(super) fn default_paths(gpu: &Gpu, size: [u32; 2]) -> u32 {
    let paths = u64::from(size[0]) * u64::from(size[1]);
    let (least, most) = match gpu.info().kind {
        DeviceKind::Cpu => (80_000, 400_000),
        _ => (1_000_000, 4_000_000),
    };
    paths.clamp(least, most) as u32
}

/// Lamps without area, and smooth glass or mirrors that show their light.
pub(super) fn has_hidden_light(scene: &Scene) -> bool {
    let smooth = |m: &Material| {
        let specular = m.is_transmissive() || m.metallic > 0.5;
        specular && m.roughness < 0.05 && !m.unlit
    };
    let used = |t: &Triangle| scene.materials.get(t.material as usize).is_some_and(smooth);
    !scene.lights.is_empty() && scene.stored_triangles().any(used)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Renderer;
    use crate::settings::Settings;
    use std::path::Path;

    #[test]
    fn rays_are_traced_by_the_best_that_there_is() {
        use DeviceKind::{Cpu, Discrete, Integrated};
        let info = crate::gpu::devices().unwrap().swap_remove(0);
        for (kind, ray_query, ray_tracing_pipeline, best) in [
            (Discrete, true, true, Trace::Query),
            (Integrated, true, false, Trace::Query),
            (Discrete, false, true, Trace::Pipeline),
            (Discrete, false, false, Trace::Software),
            (Cpu, true, true, Trace::Software),
            (Cpu, false, true, Trace::Software),
        ] {
            let mut info = info.clone();
            info.kind = kind;
            info.caps.ray_query = ray_query;
            info.caps.ray_tracing_pipeline = ray_tracing_pipeline;
            assert_eq!(auto_trace(&info), best, "{kind:?}");
        }
    }

    /// As NVIDIA's without ray tracing cores.
    #[test]
    fn a_gpu_with_pipelines_alone_renders_by_them() {
        let gpu = Gpu::open_as(|info| {
            info.kind = DeviceKind::Discrete;
            info.caps.ray_query = false;
            info.caps.unified = false;
        });
        if !gpu.info().caps.ray_tracing_pipeline {
            println!("not tested: {} has no pipelines", gpu.info().name);
            return;
        }
        let scene = crate::scene::load(Path::new("scenes/cornell.glb")).unwrap();
        let render = |trace, technique: &str| {
            let settings = Settings {
                size: Some([32; 2]),
                photons: Some(2000),
                trace,
                technique: technique.into(),
                ..Settings::default()
            };
            let mut renderer = Renderer::new(&gpu, &scene, &settings)?;
            renderer.iterate()?;
            Ok((renderer.engine.world.trace, renderer.picture()?))
        };
        let error = render(Trace::Query, "rtpm")
            .err()
            .map(|e: Error| e.to_string());
        assert!(error.is_some_and(|text| text.contains("VK_KHR_ray_query")));
        let (_, truth) = render(Trace::Software, "rtpm").unwrap();
        for technique in ["rtpm", AUTO] {
            let (trace, picture) = render(Trace::Auto, technique).unwrap();
            assert_eq!(trace, Trace::Pipeline);
            for (a, b) in truth.layers.iter().zip(&picture.layers) {
                let differs = |(a, b): &(&f32, &f32)| (*a - *b).abs() > 1e-4 * a.abs();
                let count = a.pixels.iter().zip(&b.pixels).filter(differs).count();
                assert_eq!(count, 0, "{technique}, layer '{}'", a.name);
            }
        }
        assert_eq!(gpu.validation_messages(), Vec::<String>::new());
    }
}
