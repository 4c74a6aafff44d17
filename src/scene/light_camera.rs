//! KHR_lights_punctual and cameras, placed by their nodes.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{DAffine3, DMat3, DMat4, DVec3, Vec3};
use gltf::json::camera;
use gltf::json::extensions::scene::khr_lights_punctual as punctual;

use super::asset::{Checked, valid};
use super::material::{MAX_RADIANCE, factor, factors};
use super::node::MAX_COORDINATE;
use super::warnings::Warnings;
use super::{Camera, Light, Projection};

/// The light that `json`, at `path`, describes. Its `range` is a hint for renderers that cull
/// lights, and not needed here.
pub(super) fn light(
    json: &punctual::Light,
    path: &str,
    world_from_node: &DAffine3,
    warnings: &mut Warnings,
) -> Checked<Option<Light>> {
    let color = factors(json.color, 0.0..=1.0, path, "color", warnings);
    let range = 0.0..=MAX_RADIANCE;
    let strength = factor(json.intensity, range, path, "intensity", warnings);
    let intensity = Vec3::from(color) * strength;
    let position_w = world_from_node.translation.as_vec3();
    let kind = valid(json.type_, format_args!("{path}/type"))?;
    if kind == punctual::Type::Point {
        return Ok(Some(Light::Point {
            position_w,
            intensity,
        }));
    }
    let Some(direction) = (-world_from_node.matrix3.z_axis).try_normalize() else {
        let what = "light left out: its node has no direction (scaled to zero)";
        warnings.add(path, what);
        return Ok(None);
    };
    let direction_w = direction.as_vec3().normalize();
    if kind == punctual::Type::Directional {
        return Ok(Some(Light::Directional {
            direction_w,
            illuminance: intensity,
        }));
    }
    let spot = json.spot.as_ref();
    let spot = spot.ok_or_else(|| format!("{path}: lacks \"spot\""))?;
    let (inner_cone, outer_cone) = cones(spot, &format!("{path}/spot"), warnings)?;
    Ok(Some(Light::Spot {
        position_w,
        direction_w,
        intensity,
        inner_cone,
        outer_cone,
    }))
}

/// Half angles [rad] with 0 ≤ inner < outer ≤ π/2.
fn cones(spot: &punctual::Spot, path: &str, warnings: &mut Warnings) -> Checked<(f32, f32)> {
    let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
    // Equal angles pass, for they may have been different in the file, which has more digits.
    if !(0.0 <= inner && inner <= outer && outer > 0.0) {
        return Err(format!(
            "{path}: innerConeAngle {inner} must be at least 0 and below outerConeAngle {outer}"
        ));
    }
    // π/2, written with few digits, is often a little too large: no reason to warn.
    if outer > FRAC_PI_2 + 1e-3 {
        warnings.breach(path, "outerConeAngle is above π/2: moved there");
    }
    let outer = outer.min(FRAC_PI_2);
    Ok((inner.min(outer.next_down()), outer))
}

/// The camera that `json`, at `path`, describes; `None`, with a warning, where it is none that can be used.
pub(super) fn camera(
    json: &camera::Camera,
    path: &str,
    name: String,
    world_from_node: &DAffine3,
    warnings: &mut Warnings,
) -> Checked<Option<Camera>> {
    let (projection, aspect) = match valid(json.type_, format_args!("{path}/type"))? {
        camera::Type::Perspective => perspective(json, path)?,
        camera::Type::Orthographic => orthographic(json, path, warnings)?,
    };
    let Some(rotation) = rigid(&world_from_node.matrix3) else {
        let what = "camera skipped: its node has no direction (scaled to zero)";
        warnings.add(path, what);
        return Ok(None);
    };
    let world_from_camera = DMat4::from_mat3_translation(rotation, world_from_node.translation);
    Ok(Some(Camera {
        name,
        world_from_camera: world_from_camera.as_mat4(),
        projection,
        aspect,
    }))
}

fn perspective(json: &camera::Camera, path: &str) -> Checked<(Projection, Option<f32>)> {
    let lens = json.perspective.as_ref();
    let lens = lens.ok_or_else(|| format!("{path}: lacks \"perspective\""))?;
    let yfov = lens.yfov;
    if !(yfov > 0.0 && yfov < PI) {
        return Err(format!(
            "{path}/perspective/yfov: {yfov} must be above 0 and below π"
        ));
    }
    let aspect = lens.aspect_ratio;
    if let Some(aspect) = aspect
        && !(aspect.is_normal() && aspect > 0.0)
    {
        return Err(format!(
            "{path}/perspective/aspectRatio: {aspect} must be above 0"
        ));
    }
    Ok((Projection::Perspective { yfov }, aspect))
}

fn orthographic(
    json: &camera::Camera,
    path: &str,
    warnings: &mut Warnings,
) -> Checked<(Projection, Option<f32>)> {
    let lens = json.orthographic.as_ref();
    let lens = lens.ok_or_else(|| format!("{path}: lacks \"orthographic\""))?;
    let path = format!("{path}/orthographic");
    for (key, mag) in [("xmag", lens.xmag), ("ymag", lens.ymag)] {
        if !(1e-20..=MAX_COORDINATE as f32).contains(&mag.abs()) {
            return Err(format!(
                "{path}/{key}: {mag} must be above 0, and at most {MAX_COORDINATE:e} m"
            ));
        }
        if mag < 0.0 {
            warnings.breach(
                format_args!("{path}/{key}"),
                "is negative: taken as positive",
            );
        }
    }
    let (xmag, ymag) = (lens.xmag.abs(), lens.ymag.abs());
    Ok((Projection::Orthographic { ymag }, Some(xmag / ymag)))
}

/// The rotation that looks along the same −Z, with +Y up as far as possible. A mirroring parent
/// does not mirror the picture: glTF asks for a camera without scale.
fn rigid(matrix: &DMat3) -> Option<DMat3> {
    let z = matrix.z_axis.try_normalize()?;
    let y = matrix.y_axis.try_normalize()?;
    let x = y.cross(z).try_normalize()?;
    Some(DMat3::from_cols(x, z.cross(x), z))
}

/// A camera that sees the whole box from the front, right and above, in a square or wider image.
pub(super) fn framing(low: Vec3, high: Vec3) -> Camera {
    let yfov = 45f64.to_radians();
    let (low, high) = (low.as_dvec3(), high.as_dvec3());
    let center = (low + high) / 2.0;
    let half = (high - low) / 2.0;
    let z = DVec3::new(1.0, 0.75, 1.5).normalize();
    let x = DVec3::Y.cross(z).normalize();
    let y = z.cross(x);
    let tangent = (yfov / 2.0).tan();
    // A corner at (a, b, c) from the centre is inside at distance d where |a|, |b| ≤ (d − c) tan.
    let distance = (0..8).fold(0f64, |distance, corner| {
        let sign = |bit: u32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
        let corner = half * DVec3::new(sign(0), sign(1), sign(2));
        let aside = corner.dot(x).abs().max(corner.dot(y).abs());
        distance.max(corner.dot(z) + aside / tangent)
    });
    let eye = center + z * (distance * 1.05);
    let world_from_camera = DMat4::from_mat3_translation(DMat3::from_cols(x, y, z), eye);
    Camera {
        name: "framing".into(),
        world_from_camera: world_from_camera.as_mat4(),
        projection: Projection::Perspective { yfov: yfov as f32 },
        aspect: None,
    }
}
