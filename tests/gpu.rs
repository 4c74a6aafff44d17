//! The device layer, under the validation layer where that is installed.
//! The shaders are `tests/shaders/*.{comp,rgen}`, compiled by `glslangValidator -V -g0 --target-env vulkan1.2`.

use bytemuck::{Pod, Zeroable};
use lightfall::Error;
use lightfall::gpu::{
    Buffer, Gpu, Instance, OpenOptions, Ptr, RayShaders, TextureData, TriangleGeometry, devices,
};
use lightfall::scene::Wrap;

fn open() -> Gpu {
    let options = OpenOptions {
        device: None,
        validate: true,
    };
    Gpu::open(&options).expect("a Vulkan device: install mesa-vulkan-drivers")
}

/// The validation layer must have had nothing to say.
fn assert_valid(gpu: &Gpu) {
    assert_eq!(gpu.validation_messages(), Vec::<String>::new());
}

#[test]
fn buffers_keep_what_is_written() {
    let gpu = open();
    let data: Vec<u32> = (0..100_000).map(|i| i * 7).collect();
    let buffer = gpu.upload("data", &data).unwrap();
    gpu.write(&buffer, 10, &[1, 2, 3]).unwrap();
    assert_eq!(gpu.read(&buffer, 8..14).unwrap(), [56, 63, 1, 2, 3, 91]);
    assert_eq!(gpu.read(&buffer, 99_999..100_000).unwrap(), [699_993]);
    assert_eq!(buffer.bytes(), 400_000);

    assert!(gpu.read(&buffer, 99_999..100_001).is_err());
    assert!(gpu.write(&buffer, 99_999, &[0, 0]).is_err());
    assert!(gpu.write(&buffer, usize::MAX, &[0, 0]).is_err());
    let none = gpu.upload::<u64>("none", &[]).unwrap();
    assert!(gpu.read(&none, 0..0).unwrap().is_empty());
    assert_valid(&gpu);
}

#[test]
fn too_large_a_buffer_says_so() {
    let gpu = open();
    for len in [usize::MAX, 1 << 50] {
        let Err(Error::Device { fault, .. }) = gpu.buffer::<u64>("photons", len) else {
            panic!("{len} photons fit?");
        };
        assert!(
            fault.contains("photons needs") && fault.contains("allows"),
            "{fault}"
        );
    }
    assert_valid(&gpu);
}

#[test]
fn fills_and_copies() {
    let gpu = open();
    let a = gpu.upload("a", &[1u32, 2, 3, 4, 5]).unwrap();
    let b = gpu.buffer::<u32>("b", 4).unwrap();
    let mut commands = gpu.commands().unwrap();
    commands.fill(&b, 9);
    commands.copy(&a, 1..3, &b, 2);
    commands.copy(&a, 0..1, &a, 4);
    commands.submit().unwrap();
    assert_eq!(gpu.read(&b, 0..4).unwrap(), [9, 9, 2, 3]);
    assert_eq!(gpu.read(&a, 0..5).unwrap(), [1, 2, 3, 4, 1]);
    for (range, first) in [(0..6, 0), (0..2, 3), (0..2, 1)] {
        let mut commands = gpu.commands().unwrap();
        commands.copy(&a, range, if first == 1 { &a } else { &b }, first);
        assert!(commands.submit().is_err());
    }
    assert_valid(&gpu);
}

/// What is started later sees what was started before; what goes while work may reach it waits.
#[test]
fn work_runs_on_in_order() {
    let gpu = open();
    let spirv = include_bytes!("shaders/square.spv");
    let square = gpu.pass("square", spirv, &[3], None).unwrap();
    let count = 1 << 22;
    let [first, last] = [0, 1].map(|_| gpu.buffer::<u32>("words", count).unwrap());
    let seen = gpu.host_buffer::<u32>("seen", 2).unwrap();
    let start = |words: &Buffer<u32>| {
        let mut commands = gpu.commands().unwrap();
        let push = SquarePush {
            words: words.ptr(),
            count: count as u32,
            pad: 0,
        };
        commands.dispatch(&square, &push, count);
        commands.start().unwrap()
    };
    let running = [start(&first), start(&last)];
    drop(first);
    let mut commands = gpu.commands().unwrap();
    commands.write(&last, 0, &[77u32]);
    commands.copy(&last, 0..2, &seen, 0);
    let copied = commands.start().unwrap();
    let spans = running.map(|running| running.wait().unwrap().span_ms);
    copied.wait().unwrap();
    assert_eq!(gpu.read(&seen, 0..2).unwrap(), [77, 4]);
    if let [Some([_, end]), Some([start, _])] = spans {
        assert!(end <= start, "{spans:?}");
    }
    for data in [&[0u32; 0][..], &[0; 16385]] {
        let mut commands = gpu.commands().unwrap();
        commands.write(&last, 0, data);
        assert!(commands.submit().is_err());
    }
    assert_valid(&gpu);
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct SquarePush {
    words: Ptr<u32>,
    count: u32,
    pad: u32,
}

#[test]
fn a_dispatch_reaches_every_thread_past_65535_groups() {
    let gpu = open();
    let count = 65_536 * 64 + 5;
    let words = gpu.buffer::<u32>("words", count).unwrap();
    let spirv = include_bytes!("shaders/square.spv");
    let square = gpu.pass("square", spirv, &[3], None).unwrap();
    let spirv = include_bytes!("shaders/square.rgen.spv");
    let by_rays = gpu.ray_pass("square", spirv, &RayShaders::default(), &[3], None);
    let mut passes = vec![square];
    match gpu.info().caps.ray_tracing_pipeline {
        true => passes.push(by_rays.unwrap()),
        false => {
            let message = by_rays.err().unwrap().to_string();
            assert!(message.contains("VK_KHR_ray_tracing_pipeline"), "{message}");
        }
    }
    let push = SquarePush {
        words: words.ptr(),
        count: count as u32,
        pad: 0,
    };
    let expected: Vec<u32> = (0..count as u32).map(|i| i.wrapping_mul(i) + 3).collect();
    for square in passes {
        let mut commands = gpu.commands().unwrap();
        commands.fill(&words, 7);
        commands.dispatch(&square, &push, count);
        commands.dispatch(&square, &push, 0);
        let timings = commands.submit().unwrap();
        assert_eq!(timings.len(), 1);
        assert_eq!(timings[0].0, "square");
        assert!(timings[0].1 > 0.0 && timings[0].1 < 60_000.0, "{timings:?}");
        assert!(gpu.read(&words, 0..count).unwrap() == expected);
    }
    assert_valid(&gpu);
}

#[test]
fn what_does_not_fit_is_an_error() {
    let gpu = open();
    let spirv = include_bytes!("shaders/square.spv");
    let square = gpu.pass("square", spirv, &[], None).unwrap();
    let mut commands = gpu.commands().unwrap();
    commands.dispatch(&square, &[0u32; 33], 1);
    assert!(
        commands
            .submit()
            .unwrap_err()
            .to_string()
            .contains("132 bytes")
    );
    assert!(gpu.pass("text", b"#version 460\n", &[], None).is_err());
    assert_valid(&gpu);
}

#[test]
fn devices_are_chosen_by_index_or_name() {
    let infos = devices().unwrap();
    let open = |device: &str| {
        let options = OpenOptions {
            device: Some(device),
            validate: false,
        };
        Gpu::open(&options)
    };
    for info in infos.iter().filter(|info| info.usable()) {
        let by_index = open(&info.index.to_string()).unwrap();
        assert_eq!(by_index.info().index, info.index);
        let by_name = open(&info.name.to_uppercase()).unwrap();
        assert_eq!(by_name.info().name, info.name);
    }
    let Err(Error::Option { option, fault }) = open("Voodoo 2") else {
        panic!("a Voodoo 2?");
    };
    assert_eq!(option, "--device");
    assert!(fault.contains(&infos[0].name), "{fault}");
    assert!(matches!(open("99"), Err(Error::Option { .. })));
}

/// Without ray query there is nothing to test but the error.
fn open_with_ray_query() -> Option<Gpu> {
    let gpu = open();
    if gpu.info().caps.ray_query {
        return Some(gpu);
    }
    println!("{} has no ray query: not tested", gpu.info().name);
    if !gpu.info().caps.traces_structures() {
        let message = gpu.box_blas("photons", 1).err().unwrap().to_string();
        assert!(message.contains("VK_KHR_ray_query"), "{message}");
    }
    assert_valid(&gpu);
    None
}

/// Uniform in [0, 1), repeatable.
fn random(state: &mut u64) -> f32 {
    *state = state
        .wrapping_mul(6364136223846793005)
        .wrapping_add(1442695040888963407);
    (*state >> 40) as f32 / (1u64 << 24) as f32
}

fn instance(blas_address: u64, custom_index: u32, mask: u8) -> Instance {
    Instance {
        blas_address,
        transform: Instance::IDENTITY,
        custom_index,
        mask,
        facing_cull_disable: false,
        front_ccw: false,
    }
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct NearPush {
    tlas: u64,
    points: Ptr<[f32; 3]>,
    boxes: Ptr<[f32; 6]>,
    found: Ptr<[u32; 2]>,
    count: u32,
    mask: u32,
}

#[test]
fn ray_query_finds_the_boxes_around_points() {
    let Some(gpu) = open_with_ray_query() else {
        return;
    };
    let mut state = 1;
    let mut point = || [0; 3].map(|_| random(&mut state));
    let boxes: Vec<[f32; 6]> = (0..2000)
        .map(|_| {
            let ([x, y, z], [a, b, c]) = (point(), point());
            [x, y, z, x + 0.2 * a, y + 0.2 * b, z + 0.2 * c]
        })
        .collect();
    let points: Vec<[f32; 3]> = (0..1000).map(|_| point()).collect();
    let box_buffer = gpu.upload("boxes", &boxes).unwrap();
    let point_buffer = gpu.upload("points", &points).unwrap();
    let found = gpu.buffer::<[u32; 2]>("found", points.len()).unwrap();
    let spirv = include_bytes!("shaders/near.spv");
    let near = gpu.pass("near", spirv, &[], None).unwrap();

    // Two structures of at most 1500 boxes with their own masks, built twice with differing counts.
    let blas = [(); 2].map(|_| gpu.box_blas("photon boxes", 1500).unwrap());
    let tlas = gpu.tlas("photon maps", 2).unwrap();
    for (counts, mask) in [
        ([1000, 1000], 3),
        ([1000, 0], 3),
        ([0, 700], 3),
        ([1000, 1000], 2),
    ] {
        let mut commands = gpu.commands().unwrap();
        commands.build_boxes(&blas[0], box_buffer.ptr(), counts[0]);
        commands.build_boxes(&blas[1], box_buffer.ptr().offset(1000), counts[1]);
        let places = [
            instance(blas[0].address(), 0, 1),
            instance(blas[1].address(), 1, 2),
        ];
        commands.build_tlas(&tlas, &places);
        let push = NearPush {
            tlas: tlas.address(),
            points: point_buffer.ptr(),
            boxes: box_buffer.ptr(),
            found: found.ptr(),
            count: points.len() as u32,
            mask,
        };
        commands.dispatch(&near, &push, points.len());
        let timings = commands.submit().unwrap();
        let labels: Vec<_> = timings.iter().map(|(label, _)| *label).collect();
        assert_eq!(
            labels,
            ["photon boxes", "photon boxes", "photon maps", "near"]
        );

        let there = |index: usize| match index {
            0..1000 => index < counts[0] && mask & 1 != 0,
            _ => index - 1000 < counts[1] && mask & 2 != 0,
        };
        let expected: Vec<[u32; 2]> = points
            .iter()
            .map(|p| {
                let holds = |b: &[f32; 6]| (0..3).all(|k| b[k] <= p[k] && p[k] <= b[k + 3]);
                let around = boxes
                    .iter()
                    .enumerate()
                    .filter(|(i, b)| there(*i) && holds(b));
                around.fold([0, 0], |[n, sum], (i, _)| [n + 1, sum + i as u32])
            })
            .collect();
        assert!(expected.iter().any(|found| found[0] > 1));
        assert_eq!(gpu.read(&found, 0..points.len()).unwrap(), expected);
    }
    let mut commands = gpu.commands().unwrap();
    commands.build_boxes(&blas[0], box_buffer.ptr(), 1501);
    assert!(
        commands
            .submit()
            .unwrap_err()
            .to_string()
            .contains("holds 1500")
    );
    assert!(gpu.box_blas("photons", usize::MAX).is_err());
    assert_valid(&gpu);
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct ClosestPush {
    tlas: u64,
    rays: Ptr<[[f32; 3]; 2]>,
    hits: Ptr<Hit>,
    count: u32,
    first: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Hit {
    t: f32,
    triangle: i32,
}

/// Möller and Trumbore 1997, in double precision; the distance of a hit.
fn intersect([origin, direction]: [[f32; 3]; 2], triangle: &[[f32; 3]]) -> Option<f64> {
    use glam::DVec3;
    let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let (o, d) = (vector(origin), vector(direction));
    let a = vector(triangle[0]);
    let (ab, ac) = (vector(triangle[1]) - a, vector(triangle[2]) - a);
    let inverse = ab.dot(d.cross(ac)).recip();
    let u = (o - a).dot(d.cross(ac)) * inverse;
    let v = d.dot((o - a).cross(ab)) * inverse;
    let t = ac.dot((o - a).cross(ab)) * inverse;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
}

#[test]
fn ray_query_finds_the_closest_triangle() {
    let Some(gpu) = open_with_ray_query() else {
        return;
    };
    let mut state = 2;
    let mut point = || [0; 3].map(|_| random(&mut state));
    // 300 small triangles, two geometries: opaque ones and ones that stop as candidates.
    let positions: Vec<[f32; 3]> = (0..300)
        .flat_map(|_| {
            let [x, y, z] = point();
            [(); 3].map(|_| {
                let [a, b, c] = point();
                [x + 0.3 * a, y + 0.3 * b, z + 0.3 * c]
            })
        })
        .collect();
    let rays: Vec<[[f32; 3]; 2]> = (0..2000)
        .map(|_| [point(), point().map(|x| x - 0.5)])
        .collect();
    let position_buffer = gpu.upload("positions", &positions).unwrap();
    let ray_buffer = gpu.upload("rays", &rays).unwrap();
    let hits = gpu.buffer::<Hit>("hits", rays.len()).unwrap();
    let geometry = |first_triangle, triangles, opaque| TriangleGeometry {
        positions: position_buffer.ptr(),
        first_triangle,
        triangles,
        opaque,
    };
    let geometries = [geometry(0, 100, true), geometry(100, 200, false)];
    let blas = gpu.triangle_blas("triangles", &geometries).unwrap();
    let empty = gpu
        .triangle_blas("nothing", &[geometry(0, 0, true)])
        .unwrap();
    let tlas = gpu.tlas("scene", 2).unwrap();
    let spirv = include_bytes!("shaders/closest.spv");
    let closest = gpu.pass("closest", spirv, &[], None).unwrap();
    let mut commands = gpu.commands().unwrap();
    let places = [
        instance(blas.address(), 0, 0xff),
        instance(empty.address(), 1, 0xff),
    ];
    commands.build_tlas(&tlas, &places);
    let push = ClosestPush {
        tlas: tlas.address(),
        rays: ray_buffer.ptr(),
        hits: hits.ptr(),
        count: rays.len() as u32,
        first: 100,
    };
    commands.dispatch(&closest, &push, rays.len());
    commands.submit().unwrap();

    let (mut hit, mut unlike) = (0, 0);
    for (Hit { t, triangle }, ray) in gpu
        .read(&hits, 0..rays.len())
        .unwrap()
        .into_iter()
        .zip(&rays)
    {
        let found = positions
            .chunks(3)
            .enumerate()
            .filter_map(|(i, triangle)| Some((intersect(*ray, triangle)?, i)))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        hit += i32::from(found.is_some());
        unlike += i32::from(match found {
            Some((expected, i)) => {
                triangle != i as i32 || (f64::from(t) / expected - 1.0).abs() > 1e-3
            }
            None => triangle != -1,
        });
    }
    // A ray through an edge may go either way.
    assert!(hit > 500 && unlike <= 2, "{unlike} of {hit} hits differ");
    assert_valid(&gpu);
}

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
    let spirv = include_bytes!("shaders/sample.spv");
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

#[test]
fn the_doctor_finds_every_usable_device_fit() {
    let mut report = Vec::new();
    lightfall::cli::doctor::report(&mut report).unwrap();
    let report = String::from_utf8(report).unwrap();
    for info in devices().unwrap() {
        let (index, name) = (info.index, info.name);
        assert!(
            report.contains(&format!("Device {index}: {name}")),
            "{report}"
        );
    }
    assert!(
        report.contains("4096 device addresses followed"),
        "{report}"
    );
    assert!(
        !report.contains("BAD") && !report.contains("FAILED"),
        "{report}"
    );
    assert!(report.contains("Without --device"), "{report}");
    for info in devices().unwrap().iter().filter(|info| info.usable()) {
        for (there, by) in [
            (info.caps.ray_query, "ray query"),
            (info.caps.ray_tracing_pipeline, "pipelines"),
        ] {
            let good = format!("0 missed, 0 reported twice by {by}");
            assert!(!there || report.contains(&good), "{report}");
        }
    }
}
