//! Buffers, and work on them.

use super::{assert_valid, open};
use bytemuck::{Pod, Zeroable};
use lightfall::Error;
use lightfall::gpu::{Buffer, Ptr, RayShaders};

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

/// What is started later sees what was started before.
#[test]
fn work_runs_on_in_order() {
    let gpu = open();
    let spirv = include_bytes!("../shaders/square.spv");
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
    let spirv = include_bytes!("../shaders/square.spv");
    let square = gpu.pass("square", spirv, &[3], None).unwrap();
    let spirv = include_bytes!("../shaders/square.rgen.spv");
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
    let spirv = include_bytes!("../shaders/square.spv");
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
