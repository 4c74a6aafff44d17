//! The table: what is measured, what was found, what it may be at most.

use crate::check::{Device, layer};
use lightfall::image::Rgb;
use lightfall::metrics::{Metric, Pair};
use lightfall::render::Renderer;
use lightfall::scene::Scene;
use lightfall::settings::{Settings, Trace};
use std::time::Instant;

/// Techniques and traversals that every kind of photon search appears in.
const WAYS: [(&str, Trace); 4] = [
    ("hash-grid", Trace::Software),
    ("rtpm", Trace::Software),
    ("rtpm", Trace::Pipeline),
    ("rtpm", Trace::Query),
];

/// A device, and rows in the order measured.
pub struct Table {
    pub device: Device,
    rows: Vec<String>,
    failed: usize,
    start: Instant,
}

impl Table {
    pub fn new() -> Self {
        Self {
            device: Device::open(),
            rows: Vec::new(),
            failed: 0,
            start: Instant::now(),
        }
    }

    /// The row `extreme`, where `found`, in words `what`, must be a number of at most `bound`.
    pub fn row(&mut self, extreme: &str, what: &str, found: f64, bound: f64) {
        let good = found <= bound;
        self.failed += usize::from(!good);
        let verdict = if good { "yes" } else { "**no**" };
        let row = format!("| {extreme} | {what} | {found:.2e} | {bound:.2e} | {verdict} |");
        println!("{:6.1} s {row}", self.start.elapsed().as_secs_f64());
        self.rows.push(row);
    }

    /// The row `extreme`: what `measure` finds by the last of the [`WAYS`] that the device has.
    pub fn one(
        &mut self,
        extreme: &str,
        what: &str,
        bound: f64,
        settings: &Settings,
        measure: impl Fn(&Device, &Settings) -> f64,
    ) {
        let last = self.ways(settings).pop().unwrap();
        let found = measure(&self.device, &last);
        self.row(extreme, what, found, bound);
    }

    /// The row `extreme`: the worst that `measure` finds by any technique and traversal.
    pub fn worst(
        &mut self,
        extreme: &str,
        what: &str,
        bound: f64,
        settings: &Settings,
        measure: impl Fn(&Device, &Settings) -> f64,
    ) {
        let ways = self.ways(settings);
        let found = ways.iter().map(|settings| measure(&self.device, settings));
        let found = found.fold(0.0, |worst, x| if x <= worst { worst } else { x });
        self.row(extreme, what, found, bound);
    }

    /// `settings` by every technique and traversal of the device.
    pub fn ways(&self, settings: &Settings) -> Vec<Settings> {
        let there = self.device.two_traversals();
        let ways = WAYS.iter().filter(|(_, trace)| there.contains(trace));
        ways.map(|&(technique, trace)| Settings {
            trace,
            technique: technique.into(),
            ..settings.clone()
        })
        .collect()
    }

    pub fn finish(self) {
        let info = self.device.info();
        println!(
            "\n{}, {}, {:.0} s\n",
            info.name,
            info.driver,
            self.start.elapsed().as_secs_f64()
        );
        println!("| extreme | measured | found | at most | holds |\n|---|---|---|---|---|");
        self.rows.iter().for_each(|row| println!("{row}"));
        assert_eq!(self.failed, 0, "rows that do not hold");
    }
}

/// The beauty image after some iterations; no layer may hold anything but numbers.
pub fn render(device: &Device, scene: &Scene, settings: &Settings, iterations: u32) -> Rgb {
    let mut renderer = Renderer::new(device, scene, settings).unwrap();
    (0..iterations).for_each(|_| renderer.iterate().unwrap());
    let picture = renderer.picture().unwrap();
    for layer in &picture.layers {
        let broken = layer.pixels.iter().filter(|x| !x.is_finite()).count();
        assert_eq!(broken, 0, "layer '{}' by {settings:?}", layer.name);
    }
    Rgb {
        size: [picture.width, picture.height],
        pixels: layer(&picture, "").to_vec(),
    }
}

pub fn rel_mse(test: &Rgb, truth: &Rgb) -> f64 {
    Pair::new(test, truth)
        .unwrap()
        .measure(Metric::RelMse)
        .value
}

pub fn mean(image: &Rgb) -> f64 {
    image.pixels.iter().map(|x| f64::from(*x)).sum::<f64>() / image.pixels.len() as f64
}

/// The furthest that any pixel lies from `truth`, in parts of it.
pub fn furthest(image: &Rgb, truth: f64) -> f64 {
    let off = image
        .pixels
        .iter()
        .map(|x| (f64::from(*x) / truth - 1.0).abs());
    off.fold(0.0, f64::max)
}
