//! One mesh primitive in object space: indexed triangles with complete vertices.

use std::collections::HashMap;

use glam::{Vec2, Vec3, Vec4};
use gltf::json::accessor::{ComponentType, VALID_INDEX_TYPES};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked::Valid;

use super::accessor::Accessor;
use super::asset::{Asset, Checked, valid};
use super::draco::Draco;
use super::tangent::add_tangents;
use super::warnings::Warnings;
use super::{Material, TextureRef, normal};

/// A vertex in object space, otherwise like [`super::Vertex`].
#[derive(Debug, Clone, Copy)]
pub(super) struct ObjectVertex {
    pub position_o: Vec3,
    /// Unit length.
    pub normal_o: Vec3,
    pub tangent_o: Vec4,
    pub uv: [Vec2; 2],
    pub color: Vec4,
}

/// Triangles of one material.
#[derive(Default)]
pub(super) struct Triangles {
    pub vertices: Vec<ObjectVertex>,
    pub triangles: Vec<[u32; 3]>,
}

/// The accessors of a primitive, opened, and of equal count.
pub(super) struct Attributes<'a> {
    indices: Option<Accessor<'a>>,
    position: Accessor<'a>,
    normal: Option<Accessor<'a>>,
    tangent: Option<Accessor<'a>>,
    uv: [Option<Accessor<'a>>; 2],
    color: Option<Accessor<'a>>,
    mode: Mode,
}

impl<'a> Attributes<'a> {
    /// Opens the accessors of the primitive at `path`. `None`, with a warning, where there is
    /// nothing to draw.
    pub fn open(
        asset: &Asset<'a>,
        json: &Primitive,
        path: &str,
        warnings: &mut Warnings,
    ) -> Checked<Option<Self>> {
        let mode = valid(json.mode, format_args!("{path}/mode"))?;
        // In glTF's order: points, kinds of lines, kinds of triangles.
        if mode.as_gl_enum() < Mode::Triangles.as_gl_enum() {
            let what = "points and lines are not supported: left out";
            warnings.add(format_args!("{path}/mode"), what);
            return Ok(None);
        }
        if json.targets.is_some() {
            let what = "morph targets are not supported: the base shape";
            warnings.add(format_args!("{path}/targets"), what);
        }
        let draco = Draco::open(asset, json, path, warnings)?;
        let mut open = |semantic: Semantic, sizes: &[usize]| {
            let name = semantic.to_string();
            let place = format!("{path}/attributes/{name}");
            let Some(&index) = json.attributes.get(&Valid(semantic)) else {
                return Ok(None);
            };
            let decode = |components, component| match &draco {
                Some(draco) => draco.attribute(&name, components, component),
                None => Ok(None),
            };
            let accessor = Accessor::open_or(asset, index, &place, warnings, decode)?;
            if !sizes.contains(&accessor.components) || accessor.component == ComponentType::U32 {
                return Err(format!("{place}: has a type that glTF does not allow"));
            }
            Ok(Some(accessor))
        };
        let position = open(Semantic::Positions, &[3])?;
        let normal = open(Semantic::Normals, &[3])?;
        // glTF 2.0, section 3.7.2.1: without normals, tangents do not count.
        let tangent = open(Semantic::Tangents, &[4])?.filter(|_| normal.is_some());
        let uv = [
            open(Semantic::TexCoords(0), &[2])?,
            open(Semantic::TexCoords(1), &[2])?,
        ];
        let color = open(Semantic::Colors(0), &[3, 4])?;
        let Some(position) = position else {
            let what = "lacks POSITION: left out";
            warnings.add(format_args!("{path}/attributes"), what);
            return Ok(None);
        };
        let at = format!("{path}/indices");
        let indices = match (&draco, json.indices) {
            (Some(draco), _) => Some(Accessor::of(draco.indices())),
            (None, Some(index)) => Some(Accessor::open(asset, index, &at, warnings)?),
            (None, None) => None,
        };
        // The encoder made a list of triangles of what the mode says.
        let mode = draco.map_or(mode, |_| Mode::Triangles);
        if let Some(indices) = &indices
            && (indices.components != 1
                || !VALID_INDEX_TYPES.contains(&indices.component.as_gl_enum()))
        {
            return Err(format!("{path}/indices: must be unsigned integers"));
        }
        let attributes = Self {
            indices,
            normal,
            tangent,
            uv,
            color,
            position,
            mode,
        };
        let [uv_0, uv_1] = &attributes.uv;
        let others = [&attributes.normal, &attributes.tangent, uv_0, uv_1];
        for other in others.into_iter().chain([&attributes.color]).flatten() {
            if other.count != attributes.position.count {
                return Err(format!("{path}/attributes: have different counts"));
            }
        }
        if mode == Mode::Triangles && !attributes.elements().is_multiple_of(3) {
            warnings.breach(path, "the last indices are no whole triangle: left out");
        }
        Ok(Some(attributes))
    }

    /// How many indices, or else vertices, there are.
    fn elements(&self) -> usize {
        self.indices.as_ref().unwrap_or(&self.position).count
    }

    /// How many corners its triangles have.
    pub fn corners(&self) -> usize {
        match self.mode {
            Mode::Triangles => self.elements() / 3 * 3,
            _ => self.elements().saturating_sub(2) * 3,
        }
    }

    /// The indices of triangle `t`; glTF 2.0, section 3.7.2.1.
    fn triangle(&self, t: usize) -> [u32; 3] {
        let corners = match self.mode {
            Mode::TriangleStrip => [t, t + 1 + t % 2, t + 2 - t % 2],
            Mode::TriangleFan => [t + 1, t + 2, 0],
            _ => [3 * t, 3 * t + 1, 3 * t + 2],
        };
        match &self.indices {
            Some(indices) => corners.map(|corner| indices.index(corner)),
            None => corners.map(|corner| corner as u32),
        }
    }

    fn vertex(&self, i: usize) -> ObjectVertex {
        let vector = |accessor: &Option<Accessor>| accessor.as_ref().map(|a| a.vector(i));
        let vec2 = |[u, v, ..]: [f32; 4]| Vec2::new(u, v);
        ObjectVertex {
            position_o: vec3(self.position.vector(i)),
            normal_o: vector(&self.normal).map_or(Vec3::ZERO, vec3),
            tangent_o: vector(&self.tangent).map_or(Vec4::ZERO, Vec4::from),
            uv: [0, 1].map(|set| vector(&self.uv[set]).map_or(Vec2::ZERO, vec2)),
            color: vector(&self.color).map_or(Vec4::ONE, Vec4::from),
        }
    }
}

fn vec3([x, y, z, _]: [f32; 4]) -> Vec3 {
    Vec3::new(x, y, z)
}

/// Reads the primitive at `path`, whose attributes were opened. `material` is its place among the
/// `materials` of the file; `None`: glTF's default material.
pub(super) fn read(
    attributes: &Attributes,
    material: Option<usize>,
    path: &str,
    materials: &[Material],
    warnings: &mut Warnings,
) -> Checked<Triangles> {
    let mut primitive = Triangles::default();
    // Only what the indices name is read: files share one large accessor among many primitives.
    let mut vertex_of = HashMap::new();
    for t in 0..attributes.corners() / 3 {
        let triangle = attributes.triangle(t);
        for i in triangle {
            if i as usize >= attributes.position.count {
                let count = attributes.position.count;
                return Err(format!(
                    "{path}: index {i} is out of range: there are {count} vertices"
                ));
            }
        }
        primitive.triangles.push(triangle.map(|i| {
            *vertex_of.entry(i).or_insert_with(|| {
                primitive.vertices.push(attributes.vertex(i as usize));
                primitive.vertices.len() as u32 - 1
            })
        }));
    }
    repair_numbers(&mut primitive, path, warnings);
    normal::complete(&mut primitive);
    if normal::turn_to_faces(&mut primitive) {
        let what = "NORMALs point away from their faces: turned to their side";
        warnings.breach(mesh_of(path), what);
    }
    let material = material.and_then(|i| materials.get(i));
    if let Some(material) = material {
        require_uvs(material, attributes, path, warnings);
    }
    match material.and_then(|material| material.normal_texture) {
        None => {
            for vertex in &mut primitive.vertices {
                vertex.tangent_o = Vec4::ZERO;
            }
        }
        Some(texture) => add_tangents(&mut primitive, &texture, path, warnings),
    }
    Ok(primitive)
}

/// The path of the mesh whose primitive stands at `path`.
fn mesh_of(path: &str) -> &str {
    path.split("/primitives").next().unwrap_or(path)
}

/// What is no number becomes neutral, with a warning; triangles without a place are left out.
fn repair_numbers(primitive: &mut Triangles, path: &str, warnings: &mut Warnings) {
    let mut repaired = [false; 3];
    let vertices = &primitive.vertices;
    primitive.triangles.retain(|triangle| {
        let is_somewhere = |i: u32| vertices[i as usize].position_o.is_finite();
        let kept = triangle.iter().all(|i| is_somewhere(*i));
        repaired[2] |= !kept;
        kept
    });
    for vertex in &mut primitive.vertices {
        if !vertex.position_o.is_finite() {
            vertex.position_o = Vec3::ZERO;
        }
        for uv in &mut vertex.uv {
            // Texture coordinates beyond this have no fraction left in f32.
            if !uv.is_finite() || uv.abs().max_element() > 1e7 {
                *uv = Vec2::ZERO;
                repaired[0] = true;
            }
        }
        let color = vertex.color;
        vertex.color = Vec4::from(
            color
                .to_array()
                .map(|c| if c.is_nan() { 1.0 } else { c.clamp(0.0, 1.0) }),
        );
        repaired[1] |= vertex.color != color;
    }
    let what = [
        "a TEXCOORD is not finite or too large: (0, 0) is used",
        "a COLOR_0 is not within [0, 1]: moved there",
        "a POSITION is infinite or no number: its triangles are left out",
    ];
    for (what, repaired) in what.iter().zip(repaired) {
        if repaired {
            warnings.breach(path, what);
        }
    }
}

/// Warns where the material needs texture coordinates that the primitive lacks.
fn require_uvs(material: &Material, attributes: &Attributes, path: &str, warnings: &mut Warnings) {
    for set in 0..2 {
        let needed = textures(material).any(|texture| texture.uv_set == set);
        if needed && attributes.uv[set as usize].is_none() {
            let what = format!("lacks TEXCOORD_{set}, which its material needs: (0, 0) is used");
            warnings.breach(format_args!("{path}/attributes"), what);
        }
    }
}

fn textures(material: &Material) -> impl Iterator<Item = &TextureRef> {
    [
        &material.base_color_texture,
        &material.metallic_roughness_texture,
        &material.normal_texture,
        &material.emission_texture,
        &material.specular_texture,
        &material.specular_color_texture,
        &material.transmission_texture,
    ]
    .into_iter()
    .flatten()
}
