//! The running means of all iterations, and how they become a picture.

use crate::gpu::{Buffer, Commands, Gpu, Pass};
use crate::image::Layer;
use crate::render::Traced;
use crate::shaders::spirv;
use crate::shared::{FilmPixel, FilmPush};
use crate::view::View;
use crate::{Error, Result};
use std::path::Path;

/// Sums on the device.
pub struct Film {
    pass: Pass,
    pixels: Buffer<FilmPixel>,
}

/// A layer of the picture: its name, channels, and where a [`FilmPixel`] keeps it.
struct Field {
    name: &'static str,
    channels: &'static [&'static str],
    /// Floats from the start of the high half.
    first: usize,
}

const RGB: &[&str] = &["R", "G", "B"];
const FIELDS: &[Field] = &[
    Field {
        name: "emission",
        channels: RGB,
        first: 0,
    },
    Field {
        name: "direct",
        channels: RGB,
        first: 3,
    },
    Field {
        name: "caustic",
        channels: RGB,
        first: 6,
    },
    Field {
        name: "global",
        channels: RGB,
        first: 9,
    },
    Field {
        name: "albedo",
        channels: RGB,
        first: 12,
    },
    Field {
        name: "normal",
        channels: &["X", "Y", "Z"],
        first: 15,
    },
    Field {
        name: "depth",
        channels: &["Z"],
        first: 18,
    },
    // Of one iteration; the picture's own variance layer is that of the mean.
    Field {
        name: "resume.variance",
        channels: &["Y"],
        first: 19,
    },
    Field {
        name: "resume.bias",
        channels: &["Y"],
        first: 20,
    },
    Field {
        name: "resume.bias_variance",
        channels: &["Y"],
        first: 21,
    },
];
/// Floats of the high half, and of the low half after it.
const HALF: usize = size_of::<FilmPixel>() / 8;

/// What reaches the eye (nit).
pub fn radiance(p: &FilmPixel) -> [f32; 3] {
    std::array::from_fn(|c| p.emission[c] + p.direct[c] + p.caustic[c] + p.global[c])
}

/// A layer of so many floats.
///
/// # Errors
/// There is none.
pub fn resumed_layer<'a>(layers: &'a [Layer], name: &str, floats: usize) -> Result<&'a Layer> {
    let found = layers
        .iter()
        .find(|l| l.name == name && l.pixels.len() == floats);
    found.ok_or_else(|| {
        let fault = format!("the image has no layer {name} of this size");
        Error::image(Path::new("--resume"), fault)
    })
}

impl Film {
    /// Black, of the view's size.
    pub fn new(gpu: &Gpu, view: &View) -> Result<Self> {
        let film = Self {
            pass: gpu.pass("film", spirv("film")?, &[], None)?,
            pixels: gpu.buffer("film", view.pixel_count())?,
        };
        film.clear(gpu)?;
        Ok(film)
    }

    /// Black again.
    pub fn clear(&self, gpu: &Gpu) -> Result<()> {
        let mut commands = gpu.commands()?;
        commands.fill(&self.pixels, 0);
        commands.submit().map(drop)
    }

    /// Adds the iteration in `traced.pixels`.
    pub fn record(&self, commands: &mut Commands, traced: &Traced) {
        let push = FilmPush {
            frame: traced.frame.ptr(),
            pixels: traced.pixels.ptr(),
            film: self.pixels.ptr(),
        };
        commands.dispatch(&self.pass, &push, traced.pixels.len());
    }

    /// All layers after `iterations`: the picture's, and those that a resumed render needs.
    pub fn layers(&self, gpu: &Gpu, iterations: u64) -> Result<Vec<Layer>> {
        let pixels = self.pixels(gpu)?;
        let floats: &[f32] = bytemuck::cast_slice(&pixels);
        let pick = |first: usize, count: usize| -> Vec<f32> {
            floats
                .chunks_exact(2 * HALF)
                .flat_map(|p| p[first..first + count].iter().copied())
                .collect()
        };
        let beauty = pixels.iter().flat_map(radiance).collect();
        let mut layers = vec![Layer::new("", RGB, beauty)];
        let of_mean = (iterations.max(2) - 1) as f32;
        let variance = pixels.iter().map(|p| p.variance / of_mean).collect();
        for field in FIELDS {
            layers.push(Layer::new(
                field.name,
                field.channels,
                pick(field.first, field.channels.len()),
            ));
        }
        layers.push(Layer::new("variance", &["Y"], variance));
        for field in FIELDS {
            let name = format!("resume.{}.low", field.name);
            layers.push(Layer::new(
                &name,
                field.channels,
                pick(HALF + field.first, field.channels.len()),
            ));
        }
        Ok(layers)
    }

    /// Takes up the layers of a saved picture.
    pub fn restore(&self, gpu: &Gpu, layers: &[Layer]) -> Result<()> {
        let mut pixels = vec![FilmPixel::default(); self.pixels.len()];
        let floats: &mut [f32] = bytemuck::cast_slice_mut(&mut pixels);
        for field in FIELDS {
            let low = format!("resume.{}.low", field.name);
            for (name, first) in [(field.name, field.first), (&low, HALF + field.first)] {
                let count = field.channels.len();
                let layer = resumed_layer(layers, name, self.pixels.len() * count)?;
                for (pixel, values) in floats
                    .chunks_exact_mut(2 * HALF)
                    .zip(layer.pixels.chunks_exact(count))
                {
                    pixel[first..first + count].copy_from_slice(values);
                }
            }
        }
        gpu.write(&self.pixels, 0, &pixels)
    }

    /// What is known of each pixel, row by row.
    pub fn pixels(&self, gpu: &Gpu) -> Result<Vec<FilmPixel>> {
        gpu.read(&self.pixels, 0..self.pixels.len())
    }
}
