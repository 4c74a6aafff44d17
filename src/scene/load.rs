//! The way from a file to a [`Scene`].

use std::path::Path;

use glam::Vec3;

use super::asset::Asset;
use super::container::{self, Resources};
use super::json::{Checked, Json};
use super::node::{self, Node};
use super::texture::Textures;
use super::warnings::Warnings;
use super::{Material, Scene, extensions, geometry, light_camera, material};
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
    let bytes = container::read_main(path).map_err(|error| Error::io(path, error))?;
    let mut resources = Resources::new(path, &bytes);
    read(&bytes, &mut resources).map_err(|fault| Error::scene(path, fault))
}

fn read(bytes: &[u8], resources: &mut Resources) -> Checked<Scene> {
    let (json, bin) = container::split(bytes)?;
    let json = serde_json::from_slice(json).map_err(|error| format!("JSON: {error}"))?;
    let root = Json::root(&json);
    check_version(&root)?;
    let mut warnings = Warnings::default();
    extensions::check(&root, &mut warnings)?;
    let buffers = container::buffers(&root, bin, resources)?;
    let asset = Asset::new(root, &buffers);

    let nodes = node::nodes(&asset, &mut warnings)?;
    let mut textures = Textures::new(&asset, resources);
    let mut scene = Scene {
        materials: material::materials(&asset.root, &mut textures, &mut warnings)?,
        ..Scene::default()
    };
    scene.textures = textures.textures;
    scene.images = textures.images;
    geometry::add_meshes(&asset, &nodes, &mut scene, &mut warnings)?;
    if scene.triangles.is_empty() {
        return Err("no triangles to render".into());
    }
    add_lights_and_cameras(&asset, &nodes, &mut scene, &mut warnings)?;
    if scene.cameras.is_empty() {
        let (low, high) = scene.bounds();
        scene.cameras.push(light_camera::framing(low, high));
    }
    if !asset.root.items("animations")?.is_empty() {
        warnings.add("/animations", "not supported: the scene as it stands");
    }
    scene.warnings = warnings.into_lines();
    scene.hash = resources.hash();
    Ok(scene)
}

/// glTF 2.0, section 3.2: any 2.x file that does not say it needs more than 2.0.
fn check_version(root: &Json) -> Checked<()> {
    let asset = root.need("asset")?;
    let version = asset.need("version")?;
    if !version.as_text()?.starts_with("2.") {
        let here = version.as_text()?;
        return Err(version.fault(format_args!("glTF {here} is not supported, only 2.0")));
    }
    match asset.text("minVersion")? {
        None | Some("2.0") => Ok(()),
        Some(other) => Err(asset.fault(format_args!("needs glTF {other}; 2.0 is supported"))),
    }
}

fn add_lights_and_cameras<'a>(
    asset: &Asset<'a>,
    nodes: &[Node<'a>],
    scene: &mut Scene,
    warnings: &mut Warnings,
) -> Checked<()> {
    let punctual = asset.root.extension("KHR_lights_punctual")?;
    for node in nodes {
        if let Some(here) = node.json.extension("KHR_lights_punctual")? {
            let list = punctual.as_ref().unwrap_or(&asset.root);
            if let Some((_, light)) = here.refer("light", list, "lights")? {
                let light = light_camera::light(&light, &node.world_from_node, warnings)?;
                scene.lights.extend(light);
            }
        }
        if let Some((i, camera)) = node.json.refer("camera", &asset.root, "cameras")? {
            let name = match (camera.text("name")?, node.json.text("name")?) {
                (Some(name), _) | (None, Some(name)) => name.to_owned(),
                (None, None) => format!("camera {i}"),
            };
            let camera = light_camera::camera(&camera, name, &node.world_from_node, warnings)?;
            scene.cameras.extend(camera);
        }
    }
    Ok(())
}

impl Scene {
    /// The least and greatest corner \[m\] of the box around all triangles.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let positions = self
            .triangles
            .iter()
            .flat_map(|triangle| triangle.vertices)
            .filter_map(|i| self.vertices.get(i as usize))
            .map(|vertex| vertex.position_w);
        positions
            .map(|position| (position, position))
            .reduce(|(low, high), (a, b)| (low.min(a), high.max(b)))
            .unwrap_or_default()
    }
}

impl Material {
    /// Whether some light goes through it.
    pub fn is_transmissive(&self) -> bool {
        self.transmission > 0.0
    }
}
