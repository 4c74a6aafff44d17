//! Do device addresses work as the renderer uses them?

use bytemuck::{Pod, Zeroable};

use super::{Finding, Verdict};
use crate::gpu::{Gpu, Ptr};
use crate::{Result, shaders};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Link {
    words: Ptr<u32>,
    index: u32,
    pad: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct AddressesPush {
    links: Ptr<Link>,
    sums: Ptr<u32>,
    count: u32,
    pad: u32,
}

/// Addresses are stored in memory, read back, offset and followed.
pub fn test(gpu: &Gpu) -> Result<Finding> {
    const COUNT: u32 = 4096;
    let words: Vec<u32> = (0..COUNT).map(|i| i.wrapping_mul(0x9e37_79b9)).collect();
    let buffer = gpu.upload("words", &words)?;
    // The words in reverse; half of each way is in the address, at any multiple of four bytes.
    let links: Vec<_> = (0..COUNT)
        .rev()
        .map(|i| Link {
            words: buffer.ptr().offset(i as usize / 2),
            index: i - i / 2,
            pad: 0,
        })
        .collect();
    let link_buffer = gpu.upload("links", &links)?;
    let sums = gpu.buffer::<u32>("sums", COUNT as usize)?;
    let pass = gpu.pass("addresses", shaders::spirv("doctor.addresses")?, &[], None)?;
    let push = AddressesPush {
        links: link_buffer.ptr(),
        sums: sums.ptr(),
        count: COUNT,
        pad: 0,
    };
    let mut commands = gpu.commands()?;
    commands.dispatch(&pass, &push, COUNT as usize);
    commands.submit()?;
    let sums = gpu.read(&sums, 0..COUNT as usize)?;
    let expected = words
        .iter()
        .rev()
        .zip(0u32..)
        .map(|(word, i)| word.wrapping_add(i));
    let wrong = sums
        .iter()
        .zip(expected)
        .filter(|(sum, expected)| *sum != expected)
        .count();
    Ok(Finding {
        test: "addresses",
        verdict: if wrong == 0 {
            Verdict::Good
        } else {
            Verdict::Bad
        },
        text: match wrong {
            0 => format!("{COUNT} device addresses followed"),
            _ => format!("{wrong} of {COUNT} device addresses lead astray; update the driver"),
        },
    })
}
