//! Scenes simple enough for pen and paper: lights over a diffuse floor.

use crate::check::{check, check_photons, settings};
use crate::shapes::*;
use glam::{Vec3, vec3};
use lightfall::scene::{Alpha, Light, Material, Scene};
use std::f32::consts::PI;

pub const ALBEDO: Vec3 = vec3(0.8, 0.5, 0.3);

/// Where a ray meets the floor, y = 0.
pub fn on_floor(eye: Vec3, direction: Vec3) -> Vec3 {
    eye - direction * (eye.y / direction.y)
}

/// A floor of edge 2 × `half` about the origin, seen from above.
pub fn floor_scene(half: f32, yfov: f32) -> Scene {
    let mut scene = Scene::default();
    let diffuse = material(&mut scene, lambertian(ALBEDO));
    floor(&mut scene, 0.0, half, diffuse);
    camera(&mut scene, vec3(0.0, 3.0, 0.0), Vec3::ZERO, yfov);
    scene
}

/// L = ρ I cos³θ / (π h²), here out to θ = 63°; the floor goes on beyond what is seen.
#[test]
fn a_point_light_over_a_floor() {
    let (height, intensity) = (0.8, vec3(3.0, 5.0, 7.0));
    let mut scene = floor_scene(1.5, 0.7);
    scene.lights.push(Light::Point {
        position_w: Vec3::Y * height,
        intensity,
    });
    check(&scene, &settings(64, 200_000, 0.03), 16, "", |eye, d| {
        let p = on_floor(eye, d);
        let cos = height / p.distance(Vec3::Y * height);
        ALBEDO * intensity * cos.powi(3) / (PI * height * height)
    });
}

/// As above, times KHR_lights_punctual's falloff; the spot is tilted.
#[test]
fn a_spot_light_over_a_floor() {
    let position_w = vec3(0.4, 1.0, 0.1);
    let (direction_w, intensity, inner_cone, outer_cone) = (
        (vec3(0.0, 0.0, 0.0) - position_w).normalize(),
        vec3(3.0, 5.0, 7.0),
        0.3_f32,
        0.7_f32,
    );
    let mut scene = floor_scene(3.0, 0.6);
    scene.lights.push(Light::Spot {
        position_w,
        direction_w,
        intensity,
        inner_cone,
        outer_cone,
    });
    check(&scene, &settings(64, 100_000, 0.03), 16, "", |eye, d| {
        let to = on_floor(eye, d) - position_w;
        let ramp = (to.normalize().dot(direction_w) - outer_cone.cos())
            / (inner_cone.cos() - outer_cone.cos());
        let cos = -to.y / to.length();
        ALBEDO * intensity * ramp.clamp(0.0, 1.0).powi(2) * cos / (PI * to.length_squared())
    });
}

/// L = ρ E cosθ / π.
#[test]
fn a_directional_light_over_a_floor() {
    let (direction_w, illuminance) = (vec3(0.6, -0.8, 0.0), vec3(3.0, 5.0, 7.0));
    let mut scene = floor_scene(1.2, 0.6);
    scene.lights.push(Light::Directional {
        direction_w,
        illuminance,
    });
    check(&scene, &settings(64, 100_000, 0.03), 16, "", |_, _| {
        ALBEDO * illuminance * 0.8 / PI
    });
}

/// ∫ cos / π over the rectangle from (0, 0) to (x, z) at height 1, from a floor point below its
/// corner (e.g. Modest, Radiative Heat Transfer, configuration factor 13).
fn corner_factor(x: f32, z: f32) -> f32 {
    let part = |a: f32, b: f32| a / a.hypot(1.0) * (b / a.hypot(1.0)).atan();
    (part(x, z) + part(z, x)) / (2.0 * PI)
}

/// L = ρ Lₑ F with the form factor F of a rectangle. Its back is to the camera, and is not there.
fn check_square_lamp(lamp: Material, emitted: Vec3) {
    let (height, half) = (0.7, 0.4);
    let mut scene = floor_scene(1.5, 0.6);
    let shine = material(&mut scene, lamp);
    quad(
        &mut scene,
        Vec3::Y * height,
        Vec3::X * half,
        Vec3::Z * half,
        shine,
    );
    check(&scene, &settings(64, 100_000, 0.03), 16, "", |eye, d| {
        let p = on_floor(eye, d);
        let mut factor = 0.0;
        for (sx, sz) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            factor += corner_factor((half + sx * p.x) / height, (half + sz * p.z) / height);
        }
        ALBEDO * emitted * factor
    });
}

#[test]
fn a_square_lamp_over_a_floor() {
    let emitted = vec3(3.0, 5.0, 7.0);
    check_square_lamp(lamp(emitted), emitted);
}

/// A lamp shines where it is there.
#[test]
fn a_blended_lamp_shines_by_its_alpha() {
    let emitted = vec3(3.0, 5.0, 7.0);
    let blended = Material {
        base_color: Vec3::ZERO.extend(0.25),
        alpha: Alpha::Blend,
        ..lamp(emitted)
    };
    check_square_lamp(blended, emitted * 0.25);
}

/// Shading normals stand for a smooth surface: with all normals tilted, L = ρ E cosθₛ / π.
#[test]
fn a_floor_with_tilted_shading_normals() {
    let (direction_w, illuminance, normal) = (
        vec3(-0.6, -0.8, 0.0),
        vec3(3.0, 5.0, 7.0),
        vec3(0.28, 0.96, 0.0),
    );
    let mut scene = Scene::default();
    let diffuse = material(&mut scene, lambertian(ALBEDO));
    bent_quad(
        &mut scene,
        Vec3::ZERO,
        Vec3::Z * 1.2,
        Vec3::X * 1.2,
        normal,
        diffuse,
    );
    camera(&mut scene, vec3(0.5, 3.0, 0.0), Vec3::ZERO, 0.6);
    scene.lights.push(Light::Directional {
        direction_w,
        illuminance,
    });
    check(&scene, &settings(64, 100_000, 0.03), 16, "", |_, _| {
        ALBEDO * illuminance * -normal.dot(direction_w) / PI
    });
}

/// A coarse sphere with smooth normals under a far light looks as the ideal sphere does, but for 0.07 %
/// that paths without noise would show; `partition.rs` holds them to photons on smooth spheres.
#[test]
fn a_smooth_shaded_sphere() {
    let (direction_w, illuminance) = (vec3(-0.36, -0.8, 0.48), vec3(3.0, 5.0, 7.0));
    let mut scene = Scene::default();
    let diffuse = material(&mut scene, lambertian(ALBEDO));
    sphere(&mut scene, Vec3::ZERO, 1.0, 3, true, diffuse);
    camera(&mut scene, vec3(0.0, 4.0, 0.0), Vec3::ZERO, 0.3);
    scene.lights.push(Light::Directional {
        direction_w,
        illuminance,
    });
    check_photons(&scene, &settings(64, 100_000, 0.03), 16, "", |eye, d| {
        let b = eye.dot(d);
        let normal = eye + d * (-b - (b * b - eye.length_squared() + 1.0).sqrt());
        ALBEDO * illuminance * -normal.dot(direction_w) / PI
    });
}
