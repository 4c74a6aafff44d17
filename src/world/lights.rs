//! Everything that emits, with the numbers that choose among it in proportion to luminous flux, for
//! light paths, and the tree that does so by place, for rays to the lights.

use super::light_tree::{self, Emitter};
use super::{emission, environment};
use crate::scene::{self, Scene};
use crate::shared::{
    LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT, LIGHT_POINT, LIGHT_SPOT, LIGHT_TRIANGLE, Light, LightNode,
};
use crate::{Error, Result};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// All lights.
pub struct Lights {
    /// Emissive triangles, maybe in parts, in the order of the file; then lights without area; then
    /// the environment.
    pub lights: Vec<Light>,
    pub tree: Vec<LightNode>,
    pub names: LightNames,
}

/// What to call lights by, all triangles of a material as one.
#[derive(Debug, Default)]
pub struct LightNames {
    names: Vec<String>,
    /// The first number of each light (see [`Light::first_number`]), and its name's.
    lights: Vec<(u32, u32)>,
}

impl LightNames {
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Of the light that a number chooses.
    pub fn of_number(&self, number: u32) -> Option<usize> {
        let after = self.lights.partition_point(|light| light.0 <= number);
        let light = self.lights.get(after.checked_sub(1)?)?;
        Some(light.1 as usize)
    }

    /// Where lights of another name begin; none where that is more often than `most`.
    pub fn borders(&self, most: usize) -> Vec<u32> {
        let pairs = self.lights.windows(2);
        let other = pairs.filter(|pair| pair[0].1 != pair[1].1);
        let borders: Vec<u32> = other.map(|pair| pair[1].0).collect();
        if borders.len() <= most {
            borders
        } else {
            Vec::new()
        }
    }

    /// The next light has this name.
    fn add(&mut self, name: String) {
        let known = self.names.iter().rposition(|n| *n == name);
        let index = known.unwrap_or_else(|| {
            self.names.push(name);
            self.names.len() - 1
        });
        self.lights.push((0, index as u32));
    }
}

/// Of a scene whose triangles lie in this `order` on the device.
pub fn lights(scene: &Scene, order: &[u32]) -> Result<Lights> {
    let mut lights = Vec::new();
    let mut names = LightNames::default();
    let mut emitters = Vec::new();
    let mut fluxes = Vec::new();
    let mut budget = emission::Budget::new(scene);
    // In the order of the file: the order of each traversal would give each other photons.
    let mut places = vec![0; order.len()];
    for (place, &index) in order.iter().enumerate() {
        places[index as usize] = place as u32;
    }
    for (triangle, place) in scene.triangles.iter().zip(places) {
        let material = &scene.materials[triangle.material as usize];
        if material.emission.max_element() <= 0.0 {
            continue;
        }
        let corners = triangle
            .vertices
            .map(|v| scene.vertices[v as usize].position_w);
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let whole_area = 0.5 * (b - a).cross(c - a).length();
        for part in emission::parts(scene, triangle, &mut budget) {
            let area = whole_area * f64::from(part.edge).powi(2);
            let intensity = area * luminance(part.mean);
            if intensity <= 0.0 {
                continue;
            }
            fluxes.push(std::f64::consts::PI * intensity);
            let [p, q, r] = corners;
            let corners = [Vec2::ZERO, Vec2::X, Vec2::Y].map(|corner| {
                let bary = part.corner + part.edge * corner;
                p + bary.x * (q - p) + bary.y * (r - p)
            });
            emitters.push(Emitter {
                min_w: corners.into_iter().fold(Vec3::INFINITY, Vec3::min),
                max_w: corners.into_iter().fold(Vec3::NEG_INFINITY, Vec3::max),
                intensity,
                irradiance: 0.0,
            });
            names.add(match material.name.as_str() {
                "" => format!("emissive material {}", triangle.material),
                name => format!("emissive {name}"),
            });
            lights.push(Light {
                kind: LIGHT_TRIANGLE,
                triangle: place,
                part: part.key,
                part_corner: part.corner.into(),
                part_edge: part.edge,
                ..Default::default()
            });
        }
    }
    let (min, max) = scene.bounds();
    let (center, radius) = (0.5 * (min + max), 0.5 * (max - min).length());
    for (i, light) in scene.lights.iter().enumerate() {
        let (light, flux) = delta_light(light, radius);
        if flux.max_element() > 0.0 {
            fluxes.push(luminance(flux));
            let brightness = luminance(light.intensity.into());
            emitters.push(match light.kind {
                LIGHT_DIRECTIONAL => Emitter {
                    irradiance: brightness,
                    ..at(center)
                },
                _ => Emitter {
                    intensity: brightness,
                    ..at(light.position_w.into())
                },
            });
            let kind = match light.kind {
                LIGHT_POINT => "point",
                LIGHT_SPOT => "spot",
                _ => "directional",
            };
            names.add(format!("{kind} light {i}"));
            lights.push(light);
        }
    }
    if environment::shines(scene) {
        // Through the disc about the scene that each direction sees.
        let irradiation = luminance(environment::irradiation(&environment::of(scene)));
        let disc = PI * radius * radius;
        fluxes.push((irradiation * f64::from(disc)).max(f64::MIN_POSITIVE));
        emitters.push(Emitter {
            // What an even one brings to a surface.
            irradiance: 0.25 * irradiation,
            ..at(center)
        });
        names.add("environment".into());
        lights.push(Light {
            kind: LIGHT_ENVIRONMENT,
            ..Default::default()
        });
    }
    if lights.is_empty() && scene.materials.iter().any(|m| m.unlit) {
        // Nothing needs light; a dark one spares all passes the case of none.
        fluxes.push(1.0);
        emitters.push(at(center));
        names.add("no light".into());
        lights.push(Light {
            kind: LIGHT_POINT,
            ..Default::default()
        });
    }
    if lights.is_empty() {
        return Err(Error::scene(
            &scene.path,
            "nothing emits light: say --env 1 for light from all around or --env sky.hdr for a map of it, give a material \
             emissiveFactor, or add a light (KHR_lights_punctual)",
        ));
    }
    // A light far dimmer than the rest still gets numbers that choose it.
    let total = fluxes.iter().sum::<f64>();
    let floor = total * (1e-3 / fluxes.len() as f64).max(1e-9);
    fluxes.iter_mut().for_each(|flux| *flux = flux.max(floor));
    share_numbers(&mut lights, &fluxes);
    for (name, light) in names.lights.iter_mut().zip(&lights) {
        name.0 = light.first_number;
    }
    let tree = light_tree::build(&emitters, &mut lights);
    Ok(Lights {
        lights,
        tree,
        names,
    })
}

/// Dark and without extent.
fn at(position_w: Vec3) -> Emitter {
    Emitter {
        min_w: position_w,
        max_w: position_w,
        intensity: 0.0,
        irradiance: 0.0,
    }
}

/// The numbers of the emissive triangles among `lights`, in the order of their places and parts.
pub fn by_triangle(lights: &[Light]) -> Vec<u32> {
    let mut numbers: Vec<u32> = (0..lights.len() as u32).collect();
    numbers.retain(|&i| lights[i as usize].kind == LIGHT_TRIANGLE);
    numbers.sort_unstable_by_key(|&i| (lights[i as usize].triangle, i));
    numbers
}

fn luminance(c: Vec3) -> f64 {
    // A blue lamp must not starve: luminance, floored by the mean.
    let l = c.dot(Vec3::new(0.2126, 0.7152, 0.0722));
    f64::from(l.max(0.1 * (c.x + c.y + c.z)))
}

/// A light without area and its flux [lm] (`physics.md`).
fn delta_light(light: &scene::Light, scene_radius: f32) -> (Light, Vec3) {
    match *light {
        scene::Light::Point {
            position_w,
            intensity,
        } => (
            Light {
                kind: LIGHT_POINT,
                position_w: position_w.into(),
                intensity: intensity.into(),
                ..Default::default()
            },
            4.0 * PI * intensity,
        ),
        scene::Light::Spot {
            position_w,
            direction_w,
            intensity,
            inner_cone,
            outer_cone,
        } => {
            let (cos_inner, cos_outer) = (inner_cone.cos(), outer_cone.cos());
            (
                Light {
                    kind: LIGHT_SPOT,
                    position_w: position_w.into(),
                    direction_w: direction_w.into(),
                    intensity: intensity.into(),
                    cos_inner,
                    cos_outer,
                    ..Default::default()
                },
                // The ramp between the cones, squared, carries a third (see light.glsl).
                2.0 * PI
                    * ((1.0 - cos_inner) + (cos_inner - cos_outer) / 3.0).max(1e-6)
                    * intensity,
            )
        }
        scene::Light::Directional {
            direction_w,
            illuminance,
        } => (
            Light {
                kind: LIGHT_DIRECTIONAL,
                direction_w: direction_w.into(),
                intensity: illuminance.into(),
                ..Default::default()
            },
            PI * scene_radius * scene_radius * illuminance,
        ),
    }
}

/// Gives each light an interval of the 2^32 numbers that choose one, as long as its flux.
fn share_numbers(lights: &mut [Light], fluxes: &[f64]) {
    const NUMBERS: f64 = 4294967296.0;
    let scale = NUMBERS / fluxes.iter().sum::<f64>();
    let mut before = 0.0;
    for (light, flux) in lights.iter_mut().zip(fluxes) {
        let first = f64::round(before * scale);
        before += flux;
        light.first_number = first as u32;
        light.probability = ((f64::round(before * scale) - first) / NUMBERS) as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dark_scene_is_named() {
        let scene = Scene {
            path: "dark.glb".into(),
            ..Scene::default()
        };
        let fault = lights(&scene, &[]).err().map(|e| e.to_string());
        let fault = fault.unwrap_or_default();
        assert!(
            fault.starts_with("dark.glb: nothing emits light"),
            "{fault}"
        );
    }

    #[test]
    fn lights_share_all_numbers() {
        let weights = [1.0, 5.0, 0.25, 3.0, 1e-3];
        let mut lights = vec![Light::default(); weights.len()];
        share_numbers(&mut lights, &weights);
        let total: f64 = weights.iter().sum();
        let ends = lights[1..].iter().map(|l| u64::from(l.first_number));
        let ends: Vec<u64> = ends.chain([1 << 32]).collect();
        for ((light, end), weight) in lights.iter().zip(ends).zip(weights) {
            let numbers = (end - u64::from(light.first_number)) as f64 / 4294967296.0;
            assert!((numbers - weight / total).abs() < 1e-9, "{numbers}");
            assert!((numbers / f64::from(light.probability) - 1.0).abs() < 1e-6);
        }
    }
}
