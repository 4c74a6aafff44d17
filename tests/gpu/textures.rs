//! Textures.

use super::{assert_valid, open};
use bytemuck::{Pod, Zeroable};
use lightfall::gpu::{Ptr, TextureData};
use lightfall::scene::Wrap;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Place {
    texture: u32,
    uv: [f32; 2],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct SamplePush {
    places: Ptr<Place>,
    colors: Ptr<[f32; 4]>,
    count: u32,
    pad: u32,
}

/// One row of texels: black, then red of `red` / 255.
fn row(red: u8) -> [u8; 8] {
    [0, 0, 0, 255, red, 0, 0, 128]
}

fn texture(rgba8: &[u8], srgb: bool, wrap: Wrap, nearest: bool) -> TextureData<'_> {
    TextureData {
        width: 2,
        height: 1,
        rgba8,
        srgb,
        wrap: [wrap, Wrap::Clamp],
        nearest,
    }
}

#[test]
fn textures_are_sampled_as_asked() {
    let gpu = open();
    let (full, half) = (row(255), row(128));
    let textures = [
        texture(&full, false, Wrap::Repeat, false),
        texture(&full, false, Wrap::Clamp, false),
        texture(&full, false, Wrap::Mirror, true),
        texture(&half, true, Wrap::Clamp, true),
        texture(&half, false, Wrap::Clamp, true),
    ];
    if !gpu.info().caps.descriptor_indexing {
        let message = gpu.texture_array(&textures).err().unwrap().to_string();
        assert!(message.contains("descriptorIndexing"), "{message}");
        return;
    }
    let array = gpu.texture_array(&textures).unwrap();
    // Texture, u, expected red: texel centres lie at u = 1/4 and 3/4.
    let cases = [
        (0, 0.25, 0.0),
        (0, 0.5, 0.5),
        (0, 1.0, 0.5),
        (0, 1.75, 1.0),
        (1, 1.0, 1.0),
        (1, -0.5, 0.0),
        (2, 1.3, 1.0),
        (2, 1.8, 0.0),
        (2, 0.45, 0.0),
        (3, 0.75, ((128.0 / 255.0 + 0.055f32) / 1.055).powf(2.4)),
        (4, 0.75, 128.0 / 255.0),
    ];
    let places = cases.map(|(texture, u, _)| Place {
        texture,
        uv: [u, 0.5],
    });
    let place_buffer = gpu.upload("places", &places).unwrap();
    let colors = gpu.buffer::<[f32; 4]>("colors", cases.len()).unwrap();
    let spirv = include_bytes!("../shaders/sample.spv");
    let sample = gpu.pass("sample", spirv, &[], Some(&array)).unwrap();
    drop(array); // The pass keeps it.
    let push = SamplePush {
        places: place_buffer.ptr(),
        colors: colors.ptr(),
        count: cases.len() as u32,
        pad: 0,
    };
    let mut commands = gpu.commands().unwrap();
    commands.dispatch(&sample, &push, cases.len());
    drop(sample); // So do the commands.
    commands.submit().unwrap();
    for (case, color) in cases.iter().zip(gpu.read(&colors, 0..cases.len()).unwrap()) {
        assert!((color[0] - case.2).abs() < 4e-3, "{case:?} gives {color:?}");
        assert_eq!(color[1..3], [0.0, 0.0]);
    }
    assert_valid(&gpu);
}

#[test]
fn unfit_textures_are_errors() {
    let gpu = open();
    if !gpu.info().caps.descriptor_indexing {
        return;
    }
    let texels = row(1);
    let good = texture(&texels, false, Wrap::Clamp, true);
    let large = TextureData {
        width: 1 << 20,
        ..good
    };
    let short = TextureData { height: 2, ..good };
    for (bad, word) in [(large, "allows"), (short, "instead of 16")] {
        let message = gpu.texture_array(&[good, bad]).err().unwrap().to_string();
        assert!(
            message.contains("texture 1") && message.contains(word),
            "{message}"
        );
    }
    gpu.texture_array(&[]).unwrap();
    assert_valid(&gpu);
}
