//! The way from a file to a [`Scene`].

use std::cell::OnceCell;
use std::path::{Path, PathBuf};

use glam::{Affine3A, Vec3, Vec3A};
use gltf::json::{Root, Value};

use super::asset::{self, Asset, Checked};
use super::container;
use super::node::{self, Node};
use super::resources::{self, Resources};
use super::texture::Textures;
use super::warnings::Warnings;
use super::{
    Alpha, Material, Mesh, Scene, Triangle, Vertex, extensions, geometry, light_camera, material,
};
use crate::{Error, Result};

/// Loads the default (else the first) scene of a glTF 2.0 file, `.gltf` or `.glb`, with what it
/// refers to in its own folder.
///
/// # Errors
/// [`Error::Io`] where the file itself cannot be read; [`Error::Scene`] with a JSON path where its
/// content is at fault, where it requires an extension that is not supported, and where it holds no
/// triangles.
///
/// Source: Khronos glTF 2.0 specification, 2.0.1.
pub fn load(path: &Path) -> Result<Scene> {
    load_with(path, &LoadOptions::default())
}

/// How much a file is trusted, and how strictly it is read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LoadOptions {
    /// A folder: what lies in it may be referred to, too, by paths that leave the scene's own
    /// folder and by symbolic links.
    pub root: Option<PathBuf>,
    /// Refuse files that break a rule of glTF, also where they can be given a meaning.
    pub strict: bool,
}

/// As [`load`], with options.
///
/// # Errors
/// Those of [`load`].
pub fn load_with(path: &Path, options: &LoadOptions) -> Result<Scene> {
    if let Some(root) = &options.root
        && !root.is_dir()
    {
        let fault = format!("{} is no folder", root.display());
        return Err(Error::Option {
            option: "--root",
            fault,
        });
    }
    let bytes = resources::read_main(path).map_err(|error| Error::io(path, error))?;
    let resources = Resources::new(path, &bytes, options);
    let mut resources = resources.map_err(|error| Error::io(path, error))?;
    let mut warnings = Warnings::default();
    let scene = read(&bytes, &mut resources, &mut warnings);
    let scene = scene.map_err(|fault| Error::scene(path, fault))?;
    if let Some(breach) = warnings.first_breach().filter(|_| options.strict) {
        return Err(Error::scene(path, format!("{breach}: refused by --strict")));
    }
    Ok(Scene {
        path: path.into(),
        hash: resources.hash(),
        files: resources.into_paths(),
        warnings: warnings.into_lines(),
        ..scene
    })
}

fn read(bytes: &[u8], resources: &mut Resources, warnings: &mut Warnings) -> Checked<Scene> {
    let (json, bin) = container::split(bytes, warnings)?;
    check_version(&json)?;
    let extensions = extensions::check(&json, warnings)?;
    let center = node::center(&json)?;
    let animations = json.get("animations").and_then(Value::as_array);
    let animated = animations.is_some_and(|animations| !animations.is_empty());
    let root = asset::typed(json)?;
    let buffers = container::buffers(&root, bin, resources, warnings)?;
    let decoded: Vec<_> = root.buffer_views.iter().map(|_| OnceCell::new()).collect();
    let asset = Asset::new(&root, &buffers, &decoded);

    let mut nodes = node::nodes(&root, center, warnings)?;
    let mut textures = Textures::new(&asset, resources);
    let mut scene = Scene {
        materials: material::materials(&root, &mut textures, warnings)?,
        extensions,
        ..Scene::default()
    };
    scene.textures = textures.textures;
    scene.images = textures.images;
    scene.origin = geometry::origin(&root, &nodes);
    for node in &mut nodes {
        node.world_from_node.translation -= scene.origin;
    }
    geometry::add_meshes(&asset, &nodes, &mut scene, warnings)?;
    if scene.stored_triangles().next().is_none() {
        return Err("no triangles to render".into());
    }
    add_lights_and_cameras(&root, &nodes, &mut scene, warnings)?;
    if scene.cameras.is_empty() {
        let (low, high) = scene.bounds();
        scene.cameras.push(light_camera::framing(low, high));
    }
    if animated {
        warnings.add("/animations", "not supported: the scene as it stands");
    }
    Ok(scene)
}

/// glTF 2.0, section 3.2: any 2.x file that does not say it needs more than 2.0. It looks at the
/// untyped document, for other versions have other types.
fn check_version(json: &Value) -> Checked<()> {
    let text = |key| json.get("asset")?.get(key)?.as_str();
    let Some(version) = text("version") else {
        return Err("/asset/version: missing: this is no glTF 2.0 file".into());
    };
    if !version.starts_with("2.") {
        return Err(format!(
            "/asset/version: glTF {version} is not supported, only 2.0"
        ));
    }
    match text("minVersion") {
        None | Some("2.0") => Ok(()),
        Some(other) => Err(format!(
            "/asset/minVersion: needs glTF {other}; 2.0 is supported"
        )),
    }
}

fn add_lights_and_cameras(
    root: &Root,
    nodes: &[Node],
    scene: &mut Scene,
    warnings: &mut Warnings,
) -> Checked<()> {
    for node in nodes {
        let (path, place) = (&node.path, &node.world_from_node);
        let extensions = node.json.extensions.as_ref();
        if let Some(here) = extensions.and_then(|all| all.khr_lights_punctual.as_ref()) {
            let at = format_args!("{path}/extensions/KHR_lights_punctual/light");
            let json = asset::get(root, here.light, at)?;
            let path = format!("/extensions/KHR_lights_punctual/lights/{}", here.light);
            scene
                .lights
                .extend(light_camera::light(json, &path, place, warnings)?);
        }
        if let Some(index) = node.json.camera {
            let json = asset::get(root, index, format_args!("{path}/camera"))?;
            let name = json.name.clone().or_else(|| node.json.name.clone());
            let name = name.unwrap_or_else(|| format!("camera {index}"));
            let path = format!("/cameras/{index}");
            let camera = light_camera::camera(json, &path, name, place, warnings)?;
            scene.cameras.extend(camera);
        }
    }
    Ok(())
}

impl Scene {
    /// The least and greatest corner \[m\] of a box around all triangles: of those that are shown once the least.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let mut boxes: Vec<(Vec3, Vec3)> = bounds(&self.triangles, &self.vertices)
            .into_iter()
            .collect();
        for mesh in &self.meshes {
            let bounds = mesh.bounds();
            boxes.extend(mesh.places.iter().map(|place| moved(bounds, place)));
        }
        let all = boxes.into_iter();
        all.reduce(|(low, high), (a, b)| (low.min(a), high.max(b)))
            .unwrap_or_default()
    }

    /// Every triangle that is stored, be it shown once or many times.
    pub fn stored_triangles(&self) -> impl Iterator<Item = &Triangle> {
        let of_meshes = self.meshes.iter().flat_map(|mesh| &mesh.triangles);
        self.triangles.iter().chain(of_meshes)
    }

    /// Every vertex that is stored.
    pub fn stored_vertices(&self) -> impl Iterator<Item = &Vertex> {
        let of_meshes = self.meshes.iter().flat_map(|mesh| &mesh.vertices);
        self.vertices.iter().chain(of_meshes)
    }
}

impl Mesh {
    /// The least and greatest corner \[m\] of its box, in its own space.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        bounds(&self.triangles, &self.vertices).unwrap_or_default()
    }
}

fn bounds(triangles: &[Triangle], vertices: &[Vertex]) -> Option<(Vec3, Vec3)> {
    let corners = triangles.iter().flat_map(|triangle| triangle.vertices);
    let positions = corners.filter_map(|i| Some(vertices.get(i as usize)?.position_w));
    let points = positions.map(|position| (position, position));
    points.reduce(|(low, high), (a, b)| (low.min(a), high.max(b)))
}

/// The box around a box that is moved.
pub fn moved((low, high): (Vec3, Vec3), place: &Affine3A) -> (Vec3, Vec3) {
    let middle = place.transform_point3(0.5 * (low + high));
    let half = Vec3A::from(0.5 * (high - low));
    let m = place.matrix3;
    let half = m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z;
    let half = Vec3::from(half);
    (middle - half, middle + half)
}

impl Material {
    /// Whether a ray may pass where its triangles are.
    pub fn has_holes(&self) -> bool {
        self.alpha != Alpha::Opaque || self.unlit
    }

    /// Whether some light goes through it.
    pub fn is_transmissive(&self) -> bool {
        self.transmission > 0.0
    }
}
