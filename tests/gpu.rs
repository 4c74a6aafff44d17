//! The device layer, under the validation layer where that is installed.
//! The shaders are `tests/shaders/*.comp`, compiled by `glslangValidator -V -g0 --target-env vulkan1.2`.

use bytemuck::{Pod, Zeroable};
use lightfall::Error;
use lightfall::gpu::{Gpu, OpenOptions, Ptr, devices};

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
    assert_eq!(gpu.read(&none, 0..0).unwrap(), []);
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
    let push = SquarePush {
        words: words.ptr(),
        count: count as u32,
        pad: 0,
    };
    let mut commands = gpu.commands().unwrap();
    commands.fill(&words, 7);
    commands.dispatch(&square, &push, count);
    commands.dispatch(&square, &push, 0);
    let timings = commands.submit().unwrap();
    assert_eq!(timings.len(), 1);
    assert_eq!(timings[0].0, "square");
    assert!(timings[0].1 > 0.0 && timings[0].1 < 60_000.0, "{timings:?}");
    let expected: Vec<u32> = (0..count as u32).map(|i| i.wrapping_mul(i) + 3).collect();
    assert!(gpu.read(&words, 0..count).unwrap() == expected);
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
