//! One mesh primitive in object space: indexed triangles with complete vertices.

use std::collections::HashMap;

use glam::{DVec3, Vec2, Vec3, Vec4};
use gltf::json::accessor::{ComponentType, VALID_INDEX_TYPES};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked::Valid;

use super::accessor::Accessor;
use super::asset::{Asset, Checked, valid};
use super::tangent::add_tangents;
use super::warnings::Warnings;
use super::{Material, TextureRef};

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
        let open = |semantic: Semantic, sizes: &[usize]| {
            let place = format!("{path}/attributes/{}", semantic.to_string());
            let Some(&index) = json.attributes.get(&Valid(semantic)) else {
                return Ok(None);
            };
            let accessor = Accessor::open(asset, index, &place)?;
            if !sizes.contains(&accessor.components) || accessor.component == ComponentType::U32 {
                return Err(format!("{place}: has a type that glTF does not allow"));
            }
            Ok(Some(accessor))
        };
        let Some(position) = open(Semantic::Positions, &[3])? else {
            let what = "lacks POSITION: left out";
            warnings.add(format_args!("{path}/attributes"), what);
            return Ok(None);
        };
        let indices = json
            .indices
            .map(|index| Accessor::open(asset, index, &format!("{path}/indices")));
        let indices = indices.transpose()?;
        if let Some(indices) = &indices
            && (indices.components != 1
                || !VALID_INDEX_TYPES.contains(&indices.component.as_gl_enum()))
        {
            return Err(format!("{path}/indices: must be unsigned integers"));
        }
        let normal = open(Semantic::Normals, &[3])?;
        // glTF 2.0, section 3.7.2.1: without normals, tangents do not count.
        let tangent = open(Semantic::Tangents, &[4])?.filter(|_| normal.is_some());
        let attributes = Self {
            indices,
            normal,
            tangent,
            uv: [
                open(Semantic::TexCoords(0), &[2])?,
                open(Semantic::TexCoords(1), &[2])?,
            ],
            color: open(Semantic::Colors(0), &[3, 4])?,
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
        if mode == Mode::Triangles && !attributes.corners().is_multiple_of(3) {
            let corners = attributes.corners();
            return Err(format!("{path}: {corners} indices are not whole triangles"));
        }
        Ok(Some(attributes))
    }

    /// How many corners its triangles have.
    pub fn corners(&self) -> usize {
        let indices = self.indices.as_ref().unwrap_or(&self.position).count;
        match self.mode {
            Mode::Triangles => indices,
            _ => indices.saturating_sub(2) * 3,
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
    repair_numbers(&mut primitive, path, warnings)?;
    complete_normals(&mut primitive);
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

/// Refuses positions that are no numbers; other such data becomes neutral, with a warning.
fn repair_numbers(primitive: &mut Triangles, path: &str, warnings: &mut Warnings) -> Checked<()> {
    let mut repaired = [false; 2];
    for vertex in &mut primitive.vertices {
        if !vertex.position_o.is_finite() {
            return Err(format!("{path}: a POSITION is not finite"));
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
    ];
    for (what, repaired) in what.iter().zip(repaired) {
        if repaired {
            warnings.add(path, what);
        }
    }
    Ok(())
}

/// Makes every normal a unit vector. Where the file has none, or none of any use, the vertices of
/// different triangles part and get the face normals (glTF 2.0, section 3.7.2.1: flat normals).
fn complete_normals(primitive: &mut Triangles) {
    let vertices = &mut primitive.vertices;
    let mut flat = Vec::new();
    for vertex in vertices.iter_mut() {
        let normal = vertex.normal_o.as_dvec3().try_normalize();
        vertex.normal_o = normal.map_or(Vec3::ZERO, DVec3::as_vec3);
        flat.push(normal.is_none());
    }
    // Triangles without a face normal have no area, whatever the node does to them.
    primitive.triangles.retain_mut(|triangle| {
        let corners = triangle.map(|i| vertices[i as usize]);
        let Some(normal) = face_normal(corners.map(|corner| corner.position_o)) else {
            return false;
        };
        for (i, mut corner) in triangle.iter_mut().zip(corners) {
            if flat[*i as usize] {
                // The first triangle takes the vertex itself, any other a copy.
                let first = corner.normal_o == Vec3::ZERO;
                corner.normal_o = normal;
                if first {
                    vertices[*i as usize] = corner;
                } else {
                    *i = vertices.len() as u32;
                    vertices.push(corner);
                }
            }
        }
        true
    });
}

/// The unit normal of a counter-clockwise triangle; `None` where its area is zero.
pub(super) fn face_normal(corners: [Vec3; 3]) -> Option<Vec3> {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let normal = (b - a).cross(c - a).try_normalize()?;
    Some(normal.as_vec3())
}

/// Warns where the material needs texture coordinates that the primitive lacks.
fn require_uvs(material: &Material, attributes: &Attributes, path: &str, warnings: &mut Warnings) {
    for set in 0..2 {
        let needed = textures(material).any(|texture| texture.uv_set == set);
        if needed && attributes.uv[set as usize].is_none() {
            let what = format!("lacks TEXCOORD_{set}, which its material needs: (0, 0) is used");
            warnings.add(format_args!("{path}/attributes"), what);
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
