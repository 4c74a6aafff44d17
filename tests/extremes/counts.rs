//! Radii, photons and iterations, from least to most.

use crate::check::settings;
use crate::power::furnace_sphere;
use crate::table::{Table, mean, render};
use lightfall::render::{Renderer, shrink};
use lightfall::settings::Settings;
use lightfall::shaders::spirv;
use lightfall::shared::{FilmPixel, FilmPush, Frame, FramePixel};

pub fn rows(table: &mut Table) {
    let scene = furnace_sphere(0.5, 0.5);
    let below = settings(16, 2_000, 1e-9);
    let refused = Renderer::new(&table.device, &scene, &below)
        .err()
        .map(|error| error.to_string());
    let named = refused.is_some_and(|error| error.starts_with("--caustic-radius: 1e-9 m"));
    table.row(
        "radius below the float grid",
        "not named before the start",
        f64::from(!named),
        0.0,
    );
    for (radius, name) in [
        (2e-6, "radius of 16 float steps"),
        (1e3, "radius 500 times the scene"),
    ] {
        // Kernels reach over folds and beyond the sphere, so light is missing; none may be invented.
        table.worst(
            name,
            "mean above the truth",
            0.005,
            &settings(16, 2_000, radius),
            |device, settings| (mean(&render(device, &scene, settings, 4)) - 1.0).max(0.0),
        );
    }
    radii(table);
    table.worst(
        "1 photon an iteration",
        "mean of 400 off the truth",
        0.08,
        &settings(8, 1, 0.3),
        |device, settings| (mean(&render(device, &scene, settings, 400)) - 1.0).abs(),
    );
    // More than the seven photons a path that the first buffers hold.
    let bright = furnace_sphere(0.9, 0.1);
    table.worst(
        "buffers that grow under way",
        "mean off the truth",
        0.005,
        &settings(32, 20_000, 0.1),
        |device, settings| {
            (mean(&render(device, &bright, settings, 8)) / (1.0 - 0.9_f64.powi(12)) - 1.0).abs()
        },
    );
    let few = [0.0001, 0.9999].map(|alpha| Settings {
        alpha,
        ..settings(16, 5_000, 0.2)
    });
    for settings in few {
        let name = format!("α = {}", settings.alpha);
        table.one(
            &name,
            "mean off the truth",
            0.01,
            &settings,
            |device, settings| (mean(&render(device, &scene, settings, 8)) - 1.0).abs(),
        );
    }
}

/// The closed form against the product r²_{i+1} = r²_i (i + α) / (i + 1), over a million iterations.
fn radii(table: &mut Table) {
    let mut off = 0.0_f64;
    for alpha in [1e-6, 0.5, 2.0 / 3.0, 0.999999] {
        let mut radius2 = 1.0;
        for i in 1..=1_000_000_u64 {
            if i < 100 || i.is_power_of_two() || i % 100_000 == 0 {
                off = off.max((shrink(1.0, alpha, i - 1) / radius2 - 1.0).abs());
            }
            radius2 *= (i as f64 + alpha) / (i as f64 + 1.0);
        }
    }
    table.row(
        "10⁶ radii, α from 10⁻⁶ to 1 - 10⁻⁶",
        "closed form off the product",
        off,
        1e-9,
    );
}

pub fn long_rows(table: &mut Table) {
    let scene = furnace_sphere(0.5, 0.5);
    for paths in [1 << 20, 1 << 22, 1 << 24] {
        let most = settings(16, paths, 0.1);
        let found = (mean(&render(&table.device, &scene, &most, 1)) - 1.0).abs();
        table.row(
            &format!("{paths} photons an iteration"),
            "mean off the truth",
            found,
            0.005,
        );
    }
    film(table);
}

/// A million iterations through the film pass, against sums in f64.
fn film(table: &mut Table) {
    const ITERATIONS: u32 = 1_000_000;
    const BATCH: u32 = 4096;
    let gpu = &table.device;
    let pass = gpu.pass("film", spirv("film").unwrap(), &[], None).unwrap();
    let film = gpu.upload("film", &[FilmPixel::default()]).unwrap();
    let value = |i: u32| {
        (f64::from(i.wrapping_mul(2_654_435_761)) / f64::from(u32::MAX)).powi(8) as f32 * 1e3
    };
    let mut sum = 0.0;
    for first in (0..ITERATIONS).step_by(BATCH as usize) {
        let batch = first..(first + BATCH).min(ITERATIONS);
        let frames: Vec<Frame> = batch
            .clone()
            .map(|iteration| Frame {
                size: [1, 1],
                iteration,
                ..Frame::default()
            })
            .collect();
        let pixels: Vec<FramePixel> = batch
            .clone()
            .map(|i| FramePixel {
                global: [value(i); 3],
                ..FramePixel::default()
            })
            .collect();
        sum += batch.clone().map(|i| f64::from(value(i))).sum::<f64>();
        let (frames, pixels) = (
            gpu.upload("frame", &frames).unwrap(),
            gpu.upload("pixels", &pixels).unwrap(),
        );
        let mut commands = gpu.commands().unwrap();
        for i in 0..batch.len() {
            let push = FilmPush {
                frame: frames.ptr().offset(i),
                pixels: pixels.ptr().offset(i),
                film: film.ptr(),
            };
            commands.dispatch(&pass, &push, 1);
        }
        commands.submit().unwrap();
    }
    let pixel = gpu.read(&film, 0..1).unwrap()[0];
    let truth = sum / f64::from(ITERATIONS);
    let off = (f64::from(pixel.global[0]) + f64::from(pixel.global_low[0])) / truth - 1.0;
    table.row(
        "10⁶ iterations in the film",
        "mean off that of f64",
        off.abs(),
        1e-6,
    );
}
