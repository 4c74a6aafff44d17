//! Glass and mirrors against Fresnel, Snell and Beer. A layer of n = 1.5 reflects R = 0.04 at normal
//! incidence; between two such layers the series of reflections sums to (1 - R) / (1 + R).

use crate::check::{check, check_photons, settings};
use crate::closed_forms::{floor_scene, on_floor};
use crate::shapes::*;
use glam::{Vec3, vec3};
use lightfall::scene::{Light, Scene};
use lightfall::settings::Settings;
use std::f32::consts::PI;

const R: f32 = 0.04;
const LAMP: Vec3 = vec3(3.0, 5.0, 7.0);

/// A lamp that fills the view down the z axis, and a camera that looks at it within 1.5°.
fn lamp_scene() -> Scene {
    let mut scene = Scene::default();
    let shine = material(&mut scene, lamp(LAMP));
    quad(&mut scene, vec3(0.0, 0.0, -5.0), Vec3::X, Vec3::Y, shine);
    camera(&mut scene, vec3(0.0, 0.0, 5.0), Vec3::ZERO, 0.05);
    scene
}

/// Emission that reaches the eye through specular events only needs no photons.
fn check_seen(scene: &Scene, radiance: Vec3) {
    check(scene, &settings(64, 100, 0.01), 24, "", |_, _| radiance);
}

#[test]
fn a_lamp_through_a_slab() {
    let mut scene = lamp_scene();
    let glass = material(&mut scene, glass(0.0));
    cuboid(&mut scene, Vec3::ZERO, vec3(1.0, 1.0, 0.5), glass);
    check_seen(&scene, LAMP * ((1.0 - R) / (1.0 + R)));
}

/// Each pass through the slab takes A = e^{-σ d}: (1 - R)² A / (1 - R² A²).
#[test]
fn a_lamp_through_a_tinted_slab() {
    let mut scene = lamp_scene();
    let glass = material(&mut scene, glass(2.0));
    cuboid(&mut scene, Vec3::ZERO, vec3(1.0, 1.0, 0.25), glass);
    let a = (-2.0_f32 * 0.5).exp();
    check_seen(
        &scene,
        LAMP * ((1.0 - R).powi(2) * a / (1.0 - (R * a).powi(2))),
    );
}

#[test]
fn a_lamp_through_a_pane() {
    let mut scene = lamp_scene();
    let pane = material(&mut scene, pane());
    quad(&mut scene, Vec3::ZERO, Vec3::X, Vec3::Y, pane);
    check_seen(&scene, LAMP * (1.0 - R));
}

/// Inside of glass radiance is n² times that outside; what the far face reflects comes back from
/// the near one: (1 - R) (1 + R² + R⁴ …) = 1 / (1 + R).
#[test]
fn a_lamp_from_inside_of_glass() {
    let mut scene = lamp_scene();
    let glass = material(&mut scene, glass(0.0));
    cuboid(&mut scene, Vec3::ZERO, vec3(1.0, 1.0, 0.5), glass);
    camera(&mut scene, vec3(0.1, 0.0, 0.2), vec3(0.1, 0.0, -1.0), 0.05);
    check_seen(&scene, LAMP * (2.25 / (1.0 + R)));
}

/// A right-angled prism turns the view by 90°: at 45° all light is reflected within.
#[test]
fn a_lamp_around_the_corner_of_a_prism() {
    let mut scene = Scene::default();
    let shine = material(&mut scene, lamp(LAMP));
    let glass = material(&mut scene, glass(0.0));
    quad(&mut scene, vec3(5.0, 0.0, 0.0), Vec3::Z, Vec3::Y, shine);
    // Legs look along +z and +x, the hypotenuse along -x -z.
    let corner = |x: f32, y: f32, z: f32| vec3(x, y, z);
    let (a, b, c) = (
        corner(1.0, -1.0, 1.0),
        corner(1.0, -1.0, -1.0),
        corner(-1.0, -1.0, 1.0),
    );
    let up = Vec3::Y * 2.0;
    polygon(&mut scene, &[c, a, a + up, c + up], glass);
    polygon(&mut scene, &[a, b, b + up, a + up], glass);
    polygon(&mut scene, &[b, c, c + up, b + up], glass);
    polygon(&mut scene, &[a + up, b + up, c + up], glass);
    polygon(&mut scene, &[a, c, b], glass);
    camera(&mut scene, vec3(0.0, 0.0, 5.0), Vec3::ZERO, 0.05);
    check_seen(&scene, LAMP * ((1.0 - R) / (1.0 + R)));
}

/// A prism of small angle δ deviates by (n - 1) δ for rays near the normal; exactly, by Snell at the
/// second face. The lamp's edge lies in the direction so found: half of the view must be dark.
#[test]
fn a_wedge_deviates_the_view() {
    let angle = 0.2_f32;
    let out = (1.5 * angle.sin()).asin() - angle;
    let mut scene = Scene::default();
    let shine = material(&mut scene, lamp(LAMP));
    let glass = material(&mut scene, glass(0.0));
    // The first face looks at the eye along +z, the second along -z and tilted towards +y.
    let slope = Vec3::new(0.0, angle.cos(), angle.sin());
    quad(&mut scene, vec3(0.0, 0.0, 0.0), Vec3::X, Vec3::Y, glass);
    quad(&mut scene, vec3(0.0, 0.0, -0.5), Vec3::X, -slope, glass);
    // The ray on the axis leaves the second face at z = -0.5 and sinks (towards the thick end).
    let edge = -out.tan() * 20.0;
    quad(
        &mut scene,
        vec3(0.0, edge - 2.0, -20.5),
        Vec3::X * 2.0,
        Vec3::Y * 2.0,
        shine,
    );
    camera(&mut scene, vec3(0.0, 0.0, 5.0), Vec3::ZERO, 0.05);
    let (c1, c2) = ((1.5 * angle.sin()).asin().cos(), angle.cos());
    let (rs, rp) = (
        (1.5 * c2 - c1) / (1.5 * c2 + c1),
        (c2 - 1.5 * c1) / (c2 + 1.5 * c1),
    );
    let once = (1.0 - R) * (1.0 - 0.5 * (rs * rs + rp * rp));
    check(&scene, &settings(64, 100, 0.01), 24, "", |_, d| {
        if d.y < 0.0 { LAMP * once } else { Vec3::ZERO }
    });
}

/// A caustic of parallel light through a slab: flux is not scaled by n², and the lost part is R's.
#[test]
fn light_through_a_slab_onto_a_floor() {
    let mut scene = floor_scene(1.0, 0.6);
    let glass = material(&mut scene, glass(1.0));
    // The camera looks from below the slab.
    cuboid(&mut scene, Vec3::Y * 4.0, vec3(1.5, 0.25, 1.5), glass);
    scene.lights.push(Light::Directional {
        direction_w: Vec3::NEG_Y,
        illuminance: LAMP,
    });
    let a = (-0.5_f32).exp();
    let through = (1.0 - R).powi(2) * a / (1.0 - (R * a).powi(2));
    let albedo = scene.materials[0].base_color.truncate();
    check_photons(
        &scene,
        &settings(64, 200_000, 0.05),
        24,
        "caustic",
        |_, _| albedo * LAMP * (through / PI),
    );
}

/// A floor seen in a metal at 45°, which reflects by Schlick what is not white of it.
#[test]
fn a_floor_in_a_mirror() {
    let (height, intensity, f0) = (1.5, vec3(3.0, 5.0, 7.0), 0.7);
    let mut scene = floor_scene(3.0, 0.6);
    let metal = material(&mut scene, mirror(f0));
    // The eye looks along -z; the mirror turns the view down.
    let eye = vec3(0.0, 1.2, 1.5);
    quad(
        &mut scene,
        vec3(0.0, 1.2, 0.0),
        Vec3::X * 0.5,
        vec3(0.0, 0.5, 0.5),
        metal,
    );
    camera(&mut scene, eye, vec3(0.0, 1.2, 0.0), 0.3);
    let light = vec3(0.0, height, 1.0);
    scene.lights.push(Light::Spot {
        position_w: light,
        direction_w: vec3(0.0, -1.5, -0.7).normalize(),
        intensity,
        inner_cone: 0.7,
        outer_cone: 0.8,
    });
    let albedo = scene.materials[0].base_color.truncate();
    // Without the light that floor and mirror exchange.
    let settings = Settings {
        max_depth: 3,
        ..settings(64, 200_000, 0.03)
    };
    check(&scene, &settings, 16, "", |eye, d| {
        let normal = vec3(0.0, -0.5, 0.5).normalize();
        let hit = eye + d * ((vec3(0.0, 1.2, 0.0) - eye).dot(normal) / d.dot(normal));
        let p = on_floor(hit, d - 2.0 * d.dot(normal) * normal);
        let to = light - p;
        let fresnel = f0 + (1.0 - f0) * (1.0 + d.dot(normal)).powi(5);
        albedo * intensity * fresnel * to.y / (PI * to.length().powi(3))
    });
}
