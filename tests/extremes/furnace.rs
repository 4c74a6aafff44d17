//! The white furnace: under light from everywhere a white surface looks as bright as the light, less what its BSDF itself
//! loses. glTF's microfacets scatter once (appendix B of glTF 2.0): what they reflect at one another is lost, and a coat
//! takes from the diffuse lobe below it what it does not reflect. Here that loss is integrated in f64, in another way than the
//! shaders sample it, and the renderer may neither lose nor gain besides.

use crate::check::settings;
use crate::shapes::*;
use crate::table::{Table, mean, render};
use glam::{DVec3, Vec3, Vec4, dvec3, vec3};
use lightfall::scene::{Material, Scene};
use lightfall::settings::{Direct, Settings};
use std::f64::consts::PI;

const IOR: f64 = 1.5;
const F0: f64 = 0.04;

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Metal,
    Glass,
    Pane,
    Coat,
}

pub fn rows(table: &mut Table) {
    let kinds = [
        ("metal", Kind::Metal),
        ("glass", Kind::Glass),
        ("a pane", Kind::Pane),
        ("a coat on white", Kind::Coat),
    ];
    for (name, kind) in kinds {
        let (mut off, mut loss) = (0.0_f64, 0.0_f64);
        for roughness in [0.0, 0.3, 1.0] {
            for degrees in [10.0_f64, 60.0] {
                let truth = albedo(kind, roughness * roughness, degrees.to_radians());
                let scene = sky_and_surface(kind, roughness as f32, degrees.to_radians() as f32);
                let settings = Settings {
                    direct: Direct::Rays,
                    ..settings(24, 100, 0.1)
                };
                let found = mean(&render(&table.device, &scene, &settings, 32));
                println!(
                    "{name}, roughness {roughness}, {degrees}°: {found:.4}, its BSDF {truth:.4}"
                );
                off = off.max((found - truth).abs());
                loss = loss.max((1.0 - truth).abs());
            }
        }
        table.row(
            &format!("white furnace: {name}, roughness 0 to 1"),
            "light lost or gained beside the BSDF's own loss",
            off,
            0.005,
        );
        table.row(
            &format!("white furnace: {name}, roughness 0 to 1"),
            "loss or gain of glTF's BSDF itself",
            loss,
            stated_loss(kind),
        );
    }
}

/// As the README says.
fn stated_loss(kind: Kind) -> f64 {
    match kind {
        Kind::Metal | Kind::Pane => 0.7,
        Kind::Glass => 0.33,
        Kind::Coat => 0.03,
    }
}

/// What a surface reflects and lets through of light from everywhere, seen at `theta` from its normal.
fn albedo(kind: Kind, alpha: f64, theta: f64) -> f64 {
    let o = dvec3(theta.sin(), 0.0, theta.cos());
    let mut sum = 0.0;
    const N: u32 = 256;
    for i in 0..N * N {
        let (u, v) = (f64::from(i % N) + 0.5, f64::from(i / N) + 0.5);
        let (u, phi) = (u / f64::from(N), 2.0 * PI * v / f64::from(N));
        // Steps that shrink towards grazing microfacets, where the integrand is that of 1 / √x.
        sum += facet(kind, alpha, o, 1.0 - u * u, phi) * 2.0 * u;
        if kind == Kind::Coat {
            // The diffuse lobe, over directions in proportion to their cosine.
            let i = dvec3(u.sqrt() * phi.cos(), u.sqrt() * phi.sin(), (1.0 - u).sqrt());
            sum += 1.0 - schlick(o.dot((o + i).normalize()));
        }
    }
    sum / f64::from(N * N)
}

/// One microfacet; normals h with density D (n·h): what it reflects and lets through is G₂ (o·h) / ((n·o) (n·h)) of the light.
fn facet(kind: Kind, alpha: f64, o: DVec3, u: f64, phi: f64) -> f64 {
    let cos2 = (1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u);
    let sine = (1.0 - cos2).sqrt();
    let h = dvec3(sine * phi.cos(), sine * phi.sin(), cos2.sqrt());
    let o_h = o.dot(h);
    if o_h <= 0.0 {
        return 0.0;
    }
    let reflected = 2.0 * o_h * h - o;
    let (reflectance, through) = match kind {
        Kind::Metal => (1.0, None),
        Kind::Coat => (schlick(o_h), None),
        Kind::Glass => {
            let cos_t = (1.0 - (1.0 - o_h * o_h) / (IOR * IOR)).sqrt();
            let refracted = h * (o_h / IOR - cos_t) - o / IOR;
            (fresnel(o_h), (refracted.z < 0.0).then_some(-refracted.z))
        }
        // The reflected direction, mirrored.
        Kind::Pane => (fresnel(o_h), (reflected.z > 0.0).then_some(reflected.z)),
    };
    let (lo, share) = (lambda(o.z, alpha), o_h / (o.z * h.z));
    let mut sum = 0.0;
    if reflected.z > 0.0 {
        sum += reflectance / (1.0 + lo + lambda(reflected.z, alpha));
    }
    if let Some(cosine) = through {
        sum += (1.0 - reflectance) / ((1.0 + lo) * (1.0 + lambda(cosine, alpha)));
    }
    sum * share
}

/// Smith's Λ of GGX.
fn lambda(cosine: f64, alpha: f64) -> f64 {
    let tan2 = 1.0 / (cosine * cosine) - 1.0;
    0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
}

fn schlick(cosine: f64) -> f64 {
    F0 + (1.0 - F0) * (1.0 - cosine).powi(5)
}

fn fresnel(cosine: f64) -> f64 {
    let cos_t = (1.0 - (1.0 - cosine * cosine) / (IOR * IOR)).sqrt();
    let s = (cosine - IOR * cos_t) / (cosine + IOR * cos_t);
    let p = (IOR * cosine - cos_t) / (IOR * cosine + cos_t);
    0.5 * (s * s + p * p)
}

/// A flat surface that parts two skies. The one below shines n² times as bright where it lies in glass, so that
/// refraction makes both the same.
fn sky_and_surface(kind: Kind, roughness: f32, theta: f32) -> Scene {
    let mut scene = Scene::default();
    let white = Material {
        base_color: Vec4::ONE,
        metallic: 0.0,
        roughness,
        double_sided: true,
        ..Material::default()
    };
    let white = match kind {
        Kind::Metal => Material {
            metallic: 1.0,
            ..white
        },
        Kind::Glass => Material {
            transmission: 1.0,
            absorption: Some(Vec3::ZERO),
            ..white
        },
        Kind::Pane => Material {
            transmission: 1.0,
            ..white
        },
        Kind::Coat => white,
    };
    let white = material(&mut scene, white);
    floor(&mut scene, 0.0, 10.0, white);
    let below = if kind == Kind::Glass {
        (IOR * IOR) as f32
    } else {
        1.0
    };
    for (y, radiance) in [(10.0, 1.0), (-10.0, below)] {
        let shine = material(&mut scene, lamp(Vec3::splat(radiance)));
        cuboid(&mut scene, Vec3::Y * y, vec3(-10.0, -10.0, -10.0), shine);
    }
    // The boxes' own faces at y = 0 are not there.
    scene.triangles.retain(|t| {
        t.material == white
            || t.vertices
                .iter()
                .any(|v| scene.vertices[*v as usize].position_w.y != 0.0)
    });
    camera(
        &mut scene,
        vec3(theta.sin(), theta.cos(), 0.0),
        Vec3::ZERO,
        0.01,
    );
    scene
}
