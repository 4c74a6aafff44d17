//! The same seed gives the same picture, bit for bit on the software traversal, however often the
//! render was interrupted.

use crate::check::{Device, layer, settings};
use crate::showroom::showroom;
use lightfall::gpu::Gpu;
use lightfall::image::{Display, Exposure, Picture, Tone, read_picture, write};
use lightfall::render::Renderer;
use lightfall::scene::Scene;
use lightfall::settings::{Direct, Settings, Trace};
use lightfall::technique::TECHNIQUES;

fn software(seed: u64) -> Settings {
    Settings {
        trace: Trace::Software,
        seed,
        direct: Direct::Rays,
        ..settings(16, 2_000, 0.1)
    }
}

fn render(
    gpu: &Gpu,
    scene: &Scene,
    settings: &Settings,
    from: Option<&Picture>,
    iterations: u32,
) -> Picture {
    let mut renderer = Renderer::new(gpu, scene, settings).unwrap();
    if let Some(picture) = from {
        renderer.resume(picture).unwrap();
    }
    for _ in 0..iterations {
        renderer.iterate().unwrap();
    }
    renderer.picture().unwrap()
}

fn assert_same_bits(a: &Picture, b: &Picture) {
    for (a, b) in a.layers.iter().zip(&b.layers) {
        let bits = |pixels: &[f32]| pixels.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert!(
            a.name == b.name && bits(&a.pixels) == bits(&b.pixels),
            "layer '{}' differs",
            a.name
        );
    }
}

#[test]
fn a_seed_gives_the_same_bits() {
    let device = Device::open();
    let scene = showroom(&device);
    for row in TECHNIQUES {
        let settings = |seed| Settings {
            technique: row.name.into(),
            ..software(seed)
        };
        let first = render(&device, &scene, &settings(1), None, 3);
        assert_same_bits(&first, &render(&device, &scene, &settings(1), None, 3));
        // Seeds beyond 32 bits count too.
        for seed in [2, 1 << 32 | 1] {
            let other = render(&device, &scene, &settings(seed), None, 3);
            assert_ne!(
                layer(&first, "global"),
                layer(&other, "global"),
                "{}, seed {seed}",
                row.name
            );
        }
    }
}

/// What a warm-up leaves behind must not be seen, whatever state a technique keeps.
#[test]
fn a_restarted_render_is_a_fresh_one() {
    let device = Device::open();
    let scene = showroom(&device);
    for row in TECHNIQUES {
        let settings = Settings {
            technique: row.name.into(),
            ..software(1)
        };
        let fresh = render(&device, &scene, &settings, None, 3);
        let mut renderer = Renderer::new(&device, &scene, &settings).unwrap();
        renderer.iterate().unwrap();
        renderer.iterate().unwrap();
        renderer.restart().unwrap();
        assert_eq!(renderer.iterations(), 0);
        assert_eq!(renderer.photons_emitted(), 0);
        for _ in 0..3 {
            renderer.iterate().unwrap();
        }
        assert_same_bits(&fresh, &renderer.picture().unwrap());
    }
}

#[test]
fn a_resumed_render_gives_the_same_bits() {
    let device = Device::open();
    let scene = showroom(&device);
    let whole = render(&device, &scene, &software(1), None, 64);
    let half = render(&device, &scene, &software(1), None, 32);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("half.exr");
    write(
        &path,
        &half,
        &Display {
            exposure: Exposure::Auto,
            tone: Tone::Neutral,
        },
    )
    .unwrap();
    let resumed = render(
        &device,
        &scene,
        &software(1),
        Some(&read_picture(&path).unwrap()),
        32,
    );
    assert_eq!(resumed.metadata.iterations, 64);
    assert_same_bits(&whole, &resumed);
}

#[test]
fn resuming_something_else_is_refused() {
    let device = Device::open();
    let mut scene = showroom(&device);
    let picture = render(&device, &scene, &software(1), None, 1);
    let refuses = |scene: &Scene, settings: Settings, word: &str| {
        let mut renderer = Renderer::new(&device, scene, &settings).unwrap();
        let error = renderer.resume(&picture).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    };
    refuses(&scene, software(2), "settings");
    refuses(
        &scene,
        Settings {
            photons: Some(2_001),
            ..software(1)
        },
        "settings",
    );
    refuses(
        &scene,
        Settings {
            max_depth: 11,
            ..software(1)
        },
        "settings",
    );
    refuses(
        &scene,
        Settings {
            reject: 0.5,
            ..software(1)
        },
        "settings",
    );
    refuses(
        &scene,
        Settings {
            direct: Direct::Photons,
            ..software(1)
        },
        "direct rays",
    );
    scene.hash = [8; 32];
    refuses(&scene, software(1), "scene");
}
