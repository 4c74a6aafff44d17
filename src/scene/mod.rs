//! A glTF file as plain data: world-space triangles, materials, lights, cameras.
//!
//! Everything here has been checked: indices are in range, numbers are finite, factors are in the
//! ranges that glTF gives them. Later rooms rely on that and check nothing again.

mod accessor;
mod asset;
mod container;
mod dds;
mod draco;
mod environment;
mod extensions;
mod geometry;
mod guard;
mod instancing;
mod ktx2;
mod light_camera;
mod load;
mod material;
mod meshopt;
mod node;
mod normal;
mod picture;
mod primitive;
mod resources;
mod specular_glossiness;
mod tangent;
mod texels;
mod texture;
mod uri;
mod warnings;

use std::path::PathBuf;

use glam::{Affine3A, DVec3, Mat4, Vec2, Vec3, Vec4};

pub use environment::{Environment, Source};
pub use extensions::extensions_table;
pub use load::{LoadOptions, load, load_with, moved};

/// A loaded scene. Units: metres, candela, lux, nit (see the README).
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// Of all meshes but those below.
    pub vertices: Vec<Vertex>,
    /// Counter-clockwise seen from the front, also under mirroring node transforms.
    pub triangles: Vec<Triangle>,
    /// Those that are shown so often that each is stored once.
    pub meshes: Vec<Mesh>,
    /// Never empty where there are triangles: glTF's default material stands in.
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub images: Vec<Image>,
    pub lights: Vec<Light>,
    /// Light from all around; no file brings it: see [`Scene::set_environment`].
    pub environment: Option<Environment>,
    /// Never empty: without a camera in the file, one that frames the scene.
    pub cameras: Vec<Camera>,
    /// The extensions that the file uses, and what becomes of them, in its own order.
    pub extensions: Vec<(String, String)>,
    /// Where all positions here are measured from, in the file's world (m): zero, or the middle of a scene that
    /// lies so far out that f32 would lose its detail.
    pub origin: DVec3,
    /// What the file asks for and lightfall does not do, each with its JSON path, each once.
    pub warnings: Vec<String>,
    /// The file, for messages.
    pub path: PathBuf,
    /// Where all files that it was read from really lie, links followed: not to be overwritten.
    pub files: Vec<PathBuf>,
    /// blake3 of all bytes that the scene was read from (the file and what it refers to), and of the environment.
    pub hash: [u8; 32],
}

/// Triangles that are shown many times. Nothing of it emits light.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// In a space of the mesh's own, in metres, whatever the names of the fields say.
    pub vertices: Vec<Vertex>,
    /// Indices into these vertices and [`Scene::materials`].
    pub triangles: Vec<Triangle>,
    /// World from mesh, for each time that it is shown. None mirrors.
    pub places: Vec<Affine3A>,
}

/// One vertex in world space, seen from [`Scene::origin`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Vertex {
    pub position_w: Vec3,
    /// Unit length; the face normal where the file has none.
    pub normal_w: Vec3,
    /// xyz: unit tangent, w: handedness ±1 (glTF's bitangent = cross(n, t) w); zero where no
    /// normal map needs one.
    pub tangent_w: Vec4,
    /// TEXCOORD_0 and TEXCOORD_1.
    pub uv: [Vec2; 2],
    /// Linear, multiplies the base colour; white where the file has none.
    pub color: Vec4,
}

/// Indices into [`Scene::vertices`] and [`Scene::materials`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Triangle {
    pub vertices: [u32; 3],
    pub material: u32,
}

/// glTF metallic-roughness with the extensions that lightfall knows.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    pub name: String,
    pub base_color: Vec4,
    pub base_color_texture: Option<TextureRef>,
    pub metallic: f32,
    /// Perceptual roughness; the microfacet α is its square.
    pub roughness: f32,
    /// G: roughness, B: metallic.
    pub metallic_roughness_texture: Option<TextureRef>,
    pub normal_texture: Option<TextureRef>,
    pub normal_scale: f32,
    /// Radiance \[nit\] leaving the front face: emissiveFactor × emissiveStrength.
    pub emission: Vec3,
    pub emission_texture: Option<TextureRef>,
    pub alpha: Alpha,
    pub double_sided: bool,
    pub ior: f32,
    /// KHR_materials_specular: factor (texture A) and colour (texture RGB).
    pub specular: f32,
    pub specular_texture: Option<TextureRef>,
    pub specular_color: Vec3,
    pub specular_color_texture: Option<TextureRef>,
    /// KHR_materials_transmission: factor (texture R).
    pub transmission: f32,
    pub transmission_texture: Option<TextureRef>,
    /// KHR_materials_volume with a thickness above 0: light refracts and is absorbed by σ [1/m]
    /// = −ln(attenuationColor) / attenuationDistance. `None`: thin-walled.
    pub absorption: Option<Vec3>,
    /// KHR_materials_unlit: the base colour \[nit\], for the eye only. All else that has to do with light is zero.
    pub unlit: bool,
}

/// What the base colour's alpha does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Alpha {
    /// Nothing.
    Opaque,
    /// Where it is below this the surface is not there.
    Mask { cutoff: f32 },
    /// It is the share of the surface that is there; the rest lets light pass as it is.
    Blend,
}

impl Default for Material {
    /// glTF's default material.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            emission: Vec3::ZERO,
            emission_texture: None,
            alpha: Alpha::Opaque,
            double_sided: false,
            ior: 1.5,
            specular: 1.0,
            specular_texture: None,
            specular_color: Vec3::ONE,
            specular_color_texture: None,
            transmission: 0.0,
            transmission_texture: None,
            absorption: None,
            unlit: false,
        }
    }
}

/// A material's use of a texture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextureRef {
    /// Into [`Scene::textures`].
    pub texture: u32,
    /// Which of [`Vertex::uv`].
    pub uv_set: u32,
    /// KHR_texture_transform as two rows: (u', v') = rows · (u, v, 1).
    pub transform: [Vec3; 2],
}

/// An image with a sampler.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Texture {
    /// Into [`Scene::images`].
    pub image: u32,
    pub wrap: [Wrap; 2],
    /// Nearest instead of linear magnification.
    pub nearest: bool,
    /// The texels are sRGB-encoded (colours) rather than linear (data).
    pub srgb: bool,
}

/// What lies outside [0, 1].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrap {
    Repeat,
    Mirror,
    Clamp,
}

/// Decoded texels, RGBA, 8 bits a channel, rows from the top (v = 0).
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Image {
    pub width: u32,
    pub height: u32,
    pub rgba: Vec<u8>,
}

/// KHR_lights_punctual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Light {
    /// Intensity \[cd\].
    Point { position_w: Vec3, intensity: Vec3 },
    /// Intensity \[cd\]; the direction that the light shines in is a unit vector; 0 ≤ inner < outer ≤ π/2.
    Spot {
        position_w: Vec3,
        direction_w: Vec3,
        intensity: Vec3,
        inner_cone: f32,
        outer_cone: f32,
    },
    /// Illuminance \[lx\] of a surface that faces the light.
    Directional {
        direction_w: Vec3,
        illuminance: Vec3,
    },
}

/// A camera: looks down −Z of its own space, +Y up.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    pub name: String,
    /// Rigid: scale and shear are removed.
    pub world_from_camera: Mat4,
    pub projection: Projection,
    /// Width over height, where the file says.
    pub aspect: Option<f32>,
}

/// What a camera sees between the lower and the upper edge of its image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// A vertical field of view \[rad\], above 0 and below π.
    Perspective { yfov: f32 },
    /// `ymag` \[m\] below and above its axis, along it.
    Orthographic { ymag: f32 },
}
