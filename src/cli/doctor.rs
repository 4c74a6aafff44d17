//! `lightfall doctor`: what the devices here can do, and what their drivers get wrong.

mod addresses;
mod boxes;

use std::io::{ErrorKind, Write};

use self::boxes::Probe;
use crate::gpu::{DeviceInfo, DeviceKind, Gpu, OpenOptions, devices};
use crate::render::auto_trace;
use crate::settings::Trace;
use crate::{Error, Result};

/// The outcome of one test.
struct Finding {
    test: &'static str,
    verdict: Verdict,
    text: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    Good,
    /// Strange or slow, and lightfall knows its way around it.
    Odd,
    /// Renders would be wrong.
    Bad,
}

/// Prints a report on all devices on stdout.
///
/// # Errors
/// [`Error::NoDevice`] where none is usable, [`Error::Device`] for the first whose driver fails a test
/// that a render relies on.
pub fn run() -> Result<()> {
    report(&mut std::io::stdout().lock())
}

/// As [`run`], on `out`. Each line goes out before the next test starts: a driver may crash in it.
pub fn report(out: &mut impl Write) -> Result<()> {
    let infos = devices()?;
    let mut first_fault = None;
    for info in &infos {
        for line in describe(info) {
            print(out, &line)?;
        }
        if info.usable()
            && let Err(fault) = examine(info, out)
        {
            if matches!(fault, Error::Io { .. }) {
                return Err(fault);
            }
            print(out, &row("FAILED", &fault.to_string()))?;
            first_fault = first_fault.or(Some(fault));
        }
        print(out, "")?;
    }
    let best = Gpu::open(&OpenOptions::default())?;
    let DeviceInfo { index, name, .. } = best.info();
    let choice = format!("Without --device, lightfall renders on device {index}: {name}");
    print(out, &choice)?;
    first_fault.map_or(Ok(()), Err)
}

fn describe(info: &DeviceInfo) -> Vec<String> {
    let caps = &info.caps;
    let (major, minor, patch) = info.api_version;
    let kind = match info.kind {
        DeviceKind::Discrete => "discrete GPU",
        DeviceKind::Integrated => "integrated GPU",
        DeviceKind::Virtual => "virtual GPU",
        DeviceKind::Cpu => "CPU",
        DeviceKind::Other => "unknown kind",
    };
    let (memory, allocation) = (bytes(caps.memory_bytes), bytes(caps.max_allocation));
    let mut lines = vec![
        format!("Device {}: {}", info.index, info.name),
        row("kind", &format!("{kind}, Vulkan {major}.{minor}.{patch}")),
        row("driver", &info.driver),
        row(
            "memory",
            &format!("{memory}, at most {allocation} in one piece"),
        ),
    ];
    let missing = caps.missing.join(", ");
    if !info.usable() {
        let text = format!("no: it lacks {missing}; a newer driver may have it");
        lines.push(row("usable", &text));
        return lines;
    }
    let traces = |has| match has {
        true => format!("yes, up to {} boxes or triangles", caps.max_primitive_count),
        false => "no".to_owned(),
    };
    let textures = match caps.descriptor_indexing {
        true => format!(
            "up to {} of {1} × {1}",
            caps.max_textures, caps.max_texture_size
        ),
        false => "no (lacks descriptorIndexing): only scenes without textures".to_owned(),
    };
    let timestamps = match caps.timestamp_period_ns {
        0.0 => "no: timings stay empty".to_owned(),
        period => format!("every {period} ns"),
    };
    let auto = match auto_trace(info) {
        Trace::Query => "query: the device traces rays in hardware",
        Trace::Pipeline => "pipeline: the device has no ray query",
        _ if caps.traces_structures() => {
            "software: faster on a CPU device than what its driver has"
        }
        _ => "software: the device has neither ray query nor ray pipeline",
    };
    lines.extend([
        row("ray query", &traces(caps.ray_query)),
        row("ray pipeline", &traces(caps.ray_tracing_pipeline)),
        row("textures", &textures),
        row("timestamps", &timestamps),
        row("--trace auto", auto),
    ]);
    lines
}

/// Tests the driver of a usable device.
fn examine(info: &DeviceInfo, out: &mut impl Write) -> Result<()> {
    let index = info.index.to_string();
    let gpu = Gpu::open(&OpenOptions {
        device: Some(&index),
        validate: false,
    })?;
    let mut fault = None;
    let mut show = |finding: Finding| {
        let verdict = match finding.verdict {
            Verdict::Good => "ok",
            Verdict::Odd => "note",
            Verdict::Bad => "BAD",
        };
        let text = format!("{verdict:<5}{}", finding.text);
        if finding.verdict == Verdict::Bad && fault.is_none() {
            fault = Some(Error::Device {
                device: info.name.clone(),
                fault: format!("{}: {}", finding.test, finding.text),
            });
        }
        print(out, &row(finding.test, &text))
    };
    show(addresses::test(&gpu)?)?;
    let probes = [
        (info.caps.ray_query, Probe::query as fn(_) -> _),
        (info.caps.ray_tracing_pipeline, Probe::pipeline),
    ];
    let mut probes = probes.iter().filter(|(there, _)| *there);
    if let Some((_, probe)) = probes.next() {
        let probe: Probe = probe(&gpu)?;
        show(probe.scratch())?;
        for finding in probe.boxes()? {
            show(finding)?;
        }
        show(probe.no_length()?)?;
        show(probe.inactive()?)?;
    }
    // What both share was asked above.
    if let Some((_, probe)) = probes.next() {
        let [found, ..] = probe(&gpu)?.boxes()?;
        show(found)?;
    }
    fault.map_or(Ok(()), Err)
}

fn row(name: &str, text: &str) -> String {
    format!("    {name:18}{text}")
}

fn bytes(count: u64) -> String {
    let mib = count as f64 / f64::from(1 << 20);
    match mib < 1024.0 {
        true => format!("{mib:.0} MiB"),
        false => format!("{:.1} GiB", mib / 1024.0),
    }
}

/// A reader that had enough, such as `head`, is no fault.
fn print(out: &mut impl Write, line: &str) -> Result<()> {
    match writeln!(out, "{line}") {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::io("stdout".as_ref(), e)),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pipelines_alone_are_said_to_be_the_choice() {
        let mut info = devices().unwrap().swap_remove(0);
        info.kind = DeviceKind::Discrete;
        info.caps.missing.clear();
        info.caps.ray_query = false;
        info.caps.ray_tracing_pipeline = true;
        let lines = describe(&info);
        let said = |name: &str| {
            lines
                .iter()
                .find(|line| line.trim_start().starts_with(name))
        };
        assert!(said("ray query").is_some_and(|line| line.ends_with("no")));
        assert!(said("--trace auto").is_some_and(|line| line.contains("pipeline: ")));
    }
}
