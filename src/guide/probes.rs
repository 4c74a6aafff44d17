//! What photons bring to some of the view samples, found on the host.

use crate::Result;
use crate::image::luminance;
use crate::render::Engine;
use crate::shared::{FramePixel, MAP_CAUSTIC, Photon, ViewSample};
use glam::{IVec3, Vec3};
use std::collections::HashMap;
use std::f32::consts::PI;

/// View samples at which photons are looked for.
const PROBES: usize = 4096;

/// Of one iteration.
pub struct Probes {
    /// Of all pixels that have one.
    pub samples: Vec<ViewSample>,
    /// Light (nit) that reaches the eye from there by other ways than photons.
    others: Vec<f32>,
    /// Width (m) that a pixel has at the median sample.
    pub footprint: Option<f32>,
    /// Lengths (m) below this are lost in the rounding of positions at the median sample.
    pub resolution: Option<f32>,
}

impl Probes {
    /// Reads them back.
    pub fn of(engine: &Engine) -> Result<Self> {
        let traced = engine.traced();
        let all = 0..engine.view.pixel_count();
        let mut samples = engine.gpu.read(&traced.samples, all.clone())?;
        let pixels: Vec<FramePixel> = engine.gpu.read(&traced.pixels, all)?;
        let mut others: Vec<f32> = pixels
            .iter()
            .map(|p| luminance(p.emission) + luminance(p.direct))
            .collect();
        let mut there = samples.iter().map(|s| s.weight != [0.0; 3]);
        others.retain(|_| there.next() == Some(true));
        samples.retain(|s| s.weight != [0.0; 3]);
        let mut footprints: Vec<f32> = samples.iter().map(|s| s.footprint).collect();
        let mut offsets: Vec<f32> = samples.iter().map(|s| s.offset).collect();
        Ok(Self {
            footprint: median(&mut footprints),
            resolution: median(&mut offsets),
            samples,
            others,
        })
    }

    /// Numbers of those that are looked at.
    fn some(&self) -> impl Iterator<Item = usize> {
        (0..self.samples.len()).step_by(self.samples.len().div_ceil(PROBES).max(1))
    }

    /// Photons of a map within `radius` (m) of the median sample, among those that find any.
    pub fn median_found(&self, photons: &[Photon], map: u32, radius: f32) -> Option<f32> {
        let near = Near::new(photons.iter().filter(|p| p.number >> 31 == map), radius);
        let found = self
            .some()
            .map(|i| near.at(&self.samples[i]).count() as f32);
        median(&mut found.filter(|&n| n > 0.0).collect::<Vec<_>>())
    }

    /// What photons bring to each view sample that is looked at, within these radii (pixels) in the
    /// caustic and the global map: wider ones where the view samples would otherwise leave gaps
    /// between them.
    pub fn brought(&self, photons: &[Photon], pixels: [f32; 2]) -> Vec<Brought> {
        let apart = (self.samples.len() as f32 / PROBES as f32).sqrt();
        let widest = pixels[0].max(pixels[1]);
        let pixel = self.footprint.unwrap_or(0.0) * (apart / widest).max(1.0);
        let radii = pixels.map(|p| p * pixel);
        let near = [0, 1].map(|map: u32| {
            let of_map = photons.iter().filter(move |p| p.number >> 31 == map);
            Near::new(of_map, radii[map as usize])
        });
        let mut brought = Vec::new();
        let mut seen = Vec::new();
        for (probe, i) in self.some().enumerate() {
            let sample = &self.samples[i];
            let weight = luminance(sample.weight);
            let mut light = self.others[i];
            for (near, radius) in near.iter().zip(radii) {
                for photon in near.at(sample) {
                    let relative = weight * luminance(photon.power.flux()) / (PI * radius * radius);
                    light += relative;
                    brought.push(Brought {
                        probe,
                        path: photon.path,
                        density: photon.density,
                        caustic: photon.number >> 31 == MAP_CAUSTIC,
                        relative,
                    });
                }
            }
            seen.push(light);
        }
        let mean = seen.iter().sum::<f32>() / seen.len().max(1) as f32;
        for b in &mut brought {
            b.relative /= (seen[b.probe].powi(2) + 0.01 * mean * mean).sqrt();
        }
        brought
    }
}

/// Of a photon at a view sample.
#[derive(Debug, Clone, Copy)]
pub struct Brought {
    probe: usize,
    pub path: u32,
    /// Of the guide where the path began.
    pub density: f32,
    pub caustic: bool,
    /// Light over all the light there.
    pub relative: f32,
}

/// How many times the variance would be without the guide by which these photons began: what they
/// bring has a variance in proportion to the square of their flux; without a guide there would be
/// as many fewer as each would carry more.
pub fn gain(brought: &[Brought]) -> f32 {
    let squares = |weight: fn(&Brought) -> f32| {
        let squares = brought.iter().map(|b| b.relative * b.relative * weight(b));
        squares.sum::<f32>()
    };
    let gain = squares(|b| b.density) / squares(|_| 1.0);
    if gain.is_finite() { gain } else { 1.0 }
}

/// Photons in cells.
struct Near<'a> {
    radius: f32,
    cells: HashMap<IVec3, Vec<&'a Photon>>,
}

impl<'a> Near<'a> {
    fn new(photons: impl Iterator<Item = &'a Photon>, radius: f32) -> Self {
        let mut cells: HashMap<IVec3, Vec<&Photon>> = HashMap::new();
        for photon in photons {
            let cell = cell(photon.position_w.into(), radius);
            cells.entry(cell).or_default().push(photon);
        }
        Self { radius, cells }
    }

    /// Those within the radius of a sample.
    fn at(&self, sample: &ViewSample) -> impl Iterator<Item = &'a Photon> {
        let at = Vec3::from(sample.position_w);
        let middle = cell(at, self.radius);
        let around = (0..27).map(move |i| middle + IVec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
        let radius2 = self.radius * self.radius;
        around
            .filter_map(|cell| self.cells.get(&cell))
            .flatten()
            .copied()
            .filter(move |p| at.distance_squared(p.position_w.into()) <= radius2)
    }
}

fn cell(at: Vec3, radius: f32) -> IVec3 {
    (at / radius).floor().as_ivec3()
}

fn median(values: &mut [f32]) -> Option<f32> {
    values.sort_unstable_by(f32::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_photons_about_the_median_sample() {
        let sample = |x: f32| ViewSample {
            position_w: [x, 0.0, 0.0],
            ..Default::default()
        };
        let photon = |x| Photon {
            position_w: [x, 0.0, 0.0],
            ..Default::default()
        };
        let photons = [0.05, -0.09, 0.2, 10.0, 10.01, 10.02].map(photon);
        let found = |at: &[f32]| {
            let probes = Probes {
                samples: at.iter().map(|&x| sample(x)).collect(),
                others: vec![0.0; at.len()],
                footprint: None,
                resolution: None,
            };
            probes.median_found(&photons, 0, 0.1)
        };
        assert_eq!(found(&[0.0]), Some(2.0));
        // The sample that finds nothing does not count.
        assert_eq!(found(&[10.0, 50.0]), Some(3.0));
        assert_eq!(found(&[50.0]), None);
    }
}
