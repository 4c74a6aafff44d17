//! Light from all around: an equirectangular map, or one radiance for all directions.

use super::Scene;
use crate::image::{Rgb, read_hdr, read_rgb};
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// Radiance that comes from infinitely far away.
///
/// The middle of the map is seen towards +X, its left and right edge towards −X, its top is +Y; to the right of the
/// middle lies +Z (the convention of three.js and, in its own axes, of Blender).
#[derive(Debug, Clone, PartialEq)]
pub struct Environment {
    /// Radiance \[nit\], finite and not negative.
    pub map: Rgb,
    /// The map is turned by this \[rad\] about +Y, counter-clockwise seen from above.
    pub rotation: f32,
    /// What was wrong with the file, for the user.
    pub warnings: Vec<String>,
}

/// Where an environment comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// The same radiance \[nit\] everywhere.
    Uniform([f32; 3]),
    /// An .exr or .hdr file.
    Map(PathBuf),
}

/// The most texels of a map.
const MAX_TEXELS: usize = 16384 * 8192;

/// Radiance [nit] above this is taken for a fault: sums of it would leave f32.
const MAX_RADIANCE: f32 = 1e30;

impl Environment {
    /// Reads the map, and scales it by `strength`: nit for each unit of the file.
    ///
    /// # Errors
    /// The file cannot be read, is neither .exr nor .hdr, or has more than 2²⁷ texels.
    pub fn load(source: &Source, strength: f32, rotation: f32) -> Result<Self> {
        let mut warnings = Vec::new();
        let mut map = match source {
            Source::Uniform(radiance) => Rgb {
                size: [1, 1],
                pixels: radiance.to_vec(),
            },
            Source::Map(path) => read_map(path, &mut warnings)?,
        };
        let mut faulty = 0;
        for value in &mut map.pixels {
            *value *= strength;
            if !(0.0..=MAX_RADIANCE).contains(value) {
                *value = 0.0;
                faulty += 1;
            }
        }
        if faulty > 0 {
            let fault = "are negative, not finite or above 1e30 nit, and count as 0";
            warnings.push(format!("--env: {faulty} values {fault}"));
        }
        Ok(Self {
            map,
            rotation,
            warnings,
        })
    }

    fn hash(&self) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        hasher.update(bytemuck::bytes_of(&self.map.size));
        hasher.update(bytemuck::cast_slice(&self.map.pixels));
        hasher.update(&self.rotation.to_le_bytes());
        *hasher.finalize().as_bytes()
    }
}

impl Scene {
    /// Puts the scene into an environment; it is then another scene, by its hash too.
    pub fn set_environment(&mut self, environment: Environment) {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&self.hash).update(&environment.hash());
        self.hash = *hasher.finalize().as_bytes();
        self.warnings.extend(environment.warnings.iter().cloned());
        self.environment = Some(environment);
    }
}

fn read_map(path: &Path, warnings: &mut Vec<String>) -> Result<Rgb> {
    let extension = path.extension().unwrap_or_default();
    let map = if extension.eq_ignore_ascii_case("hdr") {
        read_hdr(path)?
    } else {
        let (width, height, pixels) = read_rgb(path)?;
        Rgb {
            size: [width, height],
            pixels,
        }
    };
    let [width, height] = map.size;
    if width as usize * height as usize > MAX_TEXELS {
        let fault = format!("{width} x {height} pixels are too many for an environment");
        return Err(Error::image(path, fault));
    }
    if width != 2 * height {
        warnings.push(format!(
            "--env: {width} x {height} pixels: an equirectangular map is twice as wide as high"
        ));
    }
    Ok(map)
}
