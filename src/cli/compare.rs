//! `lightfall compare`: how far an image is from a reference.

use super::{CompareArgs, progress::print_json};
use crate::{
    Error, Result,
    image::{
        Display, Exposure, Layer, Metadata, Picture, Rgb, Tone, check_inputs_survive, check_output,
        read_layer, write, write_rgb8,
    },
    metrics::{Metric, Pair},
};
use clap::ValueEnum;
use serde_json::json;
use std::{
    io::{ErrorKind, Write},
    path::Path,
};

/// Prints all metrics, writes the error image and judges.
///
/// # Errors
/// An image cannot be read or written, the sizes differ, or the error is above the limit.
pub fn run(args: &CompareArgs) -> Result<()> {
    if let Some(output) = &args.output {
        check_output(output)?;
        check_inputs_survive([output], &[&args.image, &args.reference])?;
    }
    let image = read_layer(&args.image, &args.layer)?;
    let reference = read_layer(&args.reference, &args.layer)?;
    let pair = Pair::new(&image, &reference).map_err(|fault| Error::image(&args.image, fault))?;

    let mut numbers = Vec::new();
    let mut judged = f64::NAN;
    for &metric in Metric::value_variants() {
        let measured = pair.measure(metric);
        numbers.push((metric.name(), shown(metric, measured.value)));
        if metric == args.metric {
            judged = measured.value;
            if let Some(output) = &args.output {
                write_map(output, metric, measured.map, &reference)?;
            }
        }
    }
    print(args, &numbers, pair.excluded)?;
    judge(args, judged, pair.excluded)
}

/// SSIM as everybody knows it.
fn shown(metric: Metric, value: f64) -> f64 {
    match metric {
        Metric::Ssim => 1.0 - value,
        _ => value,
    }
}

fn write_map(path: &Path, metric: Metric, map: Vec<f32>, reference: &Rgb) -> Result<()> {
    let [width, height] = reference.size;
    if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("png"))
    {
        let text = vec![("Title", metric.name())];
        return write_rgb8(path, reference.size, &metric.picture(&map, reference), text);
    }
    let picture = Picture {
        width,
        height,
        layers: vec![Layer::new("", &["Y"], map)],
        metadata: Metadata {
            version: env!("CARGO_PKG_VERSION").into(),
            ..Metadata::default()
        },
    };
    let display = Display {
        exposure: Exposure::Auto,
        tone: Tone::Neutral,
    };
    write(path, &picture, &display).map(drop)
}

fn print(args: &CompareArgs, numbers: &[(String, f64)], excluded: usize) -> Result<()> {
    if args.json {
        let mut object = json!({
            "image": args.image.display().to_string(),
            "reference": args.reference.display().to_string(),
            "layer": args.layer,
            "not_finite": excluded,
        });
        for (name, value) in numbers {
            object[name] = json!(value);
        }
        print_json(&object);
        return Ok(());
    }
    let mut text: String = numbers
        .iter()
        .map(|(name, value)| format!("{name:16}{value:.6}\n"))
        .collect();
    if excluded > 0 {
        text += &format!("{:16}{excluded} pixels, left out\n", "not finite");
    }
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::io("stdout".as_ref(), e)),
        _ => Ok(()),
    }
}

/// An error that nobody could measure is not below any limit.
fn judge(args: &CompareArgs, value: f64, excluded: usize) -> Result<()> {
    let Some(limit) = args.fail_above else {
        return Ok(());
    };
    if excluded > 0 {
        let fault = format!("{excluded} pixels are not finite, here or in the reference");
        return Err(Error::image(&args.image, fault));
    }
    if value <= limit {
        return Ok(());
    }
    let name = match args.metric {
        Metric::Ssim => "1 - ssim".into(),
        metric => metric.name(),
    };
    Err(Error::image(
        &args.image,
        format!("{name} is {value:.6}, above {limit}"),
    ))
}
