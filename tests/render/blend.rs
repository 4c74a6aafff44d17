//! `alphaMode: BLEND`: a surface that is there for a share α of all rays.

use crate::check::{check, settings};
use crate::shapes::*;
use glam::{Vec3, vec3};
use lightfall::scene::{Alpha, Light, Material, Scene};
use lightfall::settings::Settings;
use std::f32::consts::PI;

fn blended(albedo: Vec3, alpha: f32) -> Material {
    Material {
        base_color: albedo.extend(alpha),
        alpha: Alpha::Blend,
        double_sided: true,
        ..lambertian(albedo)
    }
}

/// Of light once scattered, the sheet sends back α and the floor (1 - α)²: it is lit, and seen, through the
/// sheet. The alpha of COLOR_0 counts too.
#[test]
fn a_blended_sheet_over_a_floor() {
    let (below, above, alpha) = (vec3(0.8, 0.5, 0.3), vec3(0.1, 0.4, 0.6), 0.4);
    let illuminance = vec3(3.0, 5.0, 7.0);
    let mut scene = Scene::default();
    let ground = material(&mut scene, lambertian(below));
    let sheet = material(&mut scene, blended(above, 2.0 * alpha));
    floor(&mut scene, 0.0, 1.2, ground);
    floor(&mut scene, 0.5, 1.2, sheet);
    scene.vertices.iter_mut().for_each(|v| v.color.w = 0.5);
    camera(&mut scene, vec3(0.0, 3.0, 0.0), Vec3::ZERO, 0.6);
    scene.lights.push(Light::Directional {
        direction_w: Vec3::NEG_Y,
        illuminance,
    });
    let once = Settings {
        max_depth: 2,
        ..settings(64, 50_000, 0.03)
    };
    check(&scene, &once, 24, "", |_, _| {
        (above * alpha + below * (1.0 - alpha).powi(2)) * illuminance / PI
    });
}

/// What reflects all changes nothing in a furnace, however much of it is there: light that it meets, photons
/// that it keeps and the eye's paths must agree about how much that is.
#[test]
fn a_white_blended_ball_in_a_furnace() {
    let mut scene = Scene::default();
    let wall = Material {
        emission: Vec3::splat(0.6),
        ..lambertian(Vec3::splat(0.4))
    };
    let wall = material(&mut scene, wall);
    let ball = material(&mut scene, blended(Vec3::ONE, 0.6));
    cuboid(&mut scene, Vec3::ZERO, Vec3::splat(-1.0), wall);
    sphere(&mut scene, vec3(-0.2, -0.2, -0.2), 0.5, 3, false, ball);
    camera(&mut scene, Vec3::splat(0.7), Vec3::splat(-0.7), 1.2);
    let long = Settings {
        max_depth: 24,
        ..settings(64, 20_000, 0.03)
    };
    check(&scene, &long, 24, "", |_, _| Vec3::ONE);
}
