//! `--env`: what a scene is put into.

use crate::scene::{Environment, Source};
use clap::Args;
use std::path::Path;

/// Shared by the subcommands that render.
#[derive(Debug, Args)]
pub struct EnvironmentArgs {
    /// Light from all around: an equirectangular map (.exr, .hdr), or the same for all directions, in nit: 1, or
    /// 0.2,0.3,0.5 as linear RGB. The map's middle is seen towards +X, +Z is to the right of it, the top is up (+Y)
    #[arg(long, value_name = "FILE|NIT", value_parser = parse_source)]
    pub env: Option<Source>,

    /// What the environment is multiplied by: nit for each unit of the map
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, requires = "env", value_parser = parse_strength)]
    pub env_strength: f32,

    /// Turn the environment about the vertical axis, counter-clockwise seen from above: 90 brings what was towards +X
    /// to −Z
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, requires = "env", allow_negative_numbers = true,
          value_parser = parse_rotation)]
    pub env_rotate: f32,
}

impl EnvironmentArgs {
    /// The environment, if one is asked for.
    ///
    /// # Errors
    /// Those of [`Environment::load`].
    pub fn load(&self) -> crate::Result<Option<Environment>> {
        let source = self.env.as_ref();
        let rotation = self.env_rotate.to_radians();
        source
            .map(|source| Environment::load(source, self.env_strength, rotation))
            .transpose()
    }

    /// The map's file, if there is one.
    pub fn file(&self) -> Option<&Path> {
        match &self.env {
            Some(Source::Map(path)) => Some(path),
            _ => None,
        }
    }
}

fn parse_source(text: &str) -> Result<Source, String> {
    let numbers: Vec<_> = text.split(',').map(|n| n.trim().parse::<f32>()).collect();
    let in_range = |x: f32| (0.0..=1e30).contains(&x);
    match numbers[..] {
        [Ok(grey)] if in_range(grey) => return Ok(Source::Uniform([grey; 3])),
        [Ok(r), Ok(g), Ok(b)] if [r, g, b].into_iter().all(in_range) => {
            return Ok(Source::Uniform([r, g, b]));
        }
        _ => {}
    }
    let lower = text.to_ascii_lowercase();
    if lower.ends_with(".exr") || lower.ends_with(".hdr") {
        return Ok(Source::Map(text.into()));
    }
    Err("expected an .exr or .hdr file, or radiance from 0 to 1e30 nit: 1, or 0.2,0.3,0.5".into())
}

fn parse_strength(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(x) if (0.0..=1e30).contains(&x) => Ok(x),
        _ => Err("expected a number from 0 to 1e30".into()),
    }
}

fn parse_rotation(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(x) if (-360.0..=360.0).contains(&x) => Ok(x),
        _ => Err("expected degrees from -360 to 360".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources() {
        assert_eq!(parse_source("1"), Ok(Source::Uniform([1.0; 3])));
        assert_eq!(
            parse_source("0.2, 0,5e3"),
            Ok(Source::Uniform([0.2, 0.0, 5e3]))
        );
        let map = |text: &str| Ok(Source::Map(text.into()));
        assert_eq!(parse_source("a/b.EXR"), map("a/b.EXR"));
        assert_eq!(parse_source("1,2,3.hdr"), map("1,2,3.hdr"));
        for bad in [
            "", "-1", "nan", "inf", "1e31", "1,2", "1,2,3,4", "sky.png", "1,,2",
        ] {
            assert!(parse_source(bad).is_err(), "{bad}");
        }
    }
}
