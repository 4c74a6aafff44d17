//! Tangents for normal maps: the file's own, else MikkTSpace, as glTF 2.0 (section 3.7.2.1) asks.

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec2, Vec3, Vec4};

use super::TextureRef;
use super::primitive::Triangles;
use super::warnings::Warnings;

/// Triangles around one point that MikkTSpace is asked to handle: it recurses over them, and its
/// time grows with their square.
const MAX_VALENCE: u32 = 1024;

/// Gives every vertex a unit tangent with handedness, splitting vertices where it differs.
pub(super) fn add_tangents(
    primitive: &mut Triangles,
    texture: &TextureRef,
    path: &str,
    warnings: &mut Warnings,
) {
    let usable = |t: Vec4| t.is_finite() && t.truncate().length_squared() > 0.0 && t.w != 0.0;
    let vertices = &mut primitive.vertices;
    if vertices.iter().all(|vertex| usable(vertex.tangent_o)) {
        for vertex in vertices {
            let tangent = vertex.tangent_o.truncate();
            vertex.tangent_o = unit(tangent, vertex.normal_o).extend(vertex.tangent_o.w.signum());
        }
        return;
    }
    if vertices.iter().any(|vertex| vertex.tangent_o != Vec4::ZERO) {
        warnings.breach(path, "a TANGENT is of no use (length 0): all are made anew");
    }
    let rows = texture.transform;
    let uv = |i: u32| {
        let uv = primitive.vertices[i as usize].uv[texture.uv_set as usize & 1];
        Vec2::from(rows.map(|row| row.dot(uv.extend(1.0))))
    };
    let mut mesh = Corners {
        primitive,
        uvs: primitive.triangles.iter().map(|t| t.map(uv)).collect(),
        tangents: vec![[Vec4::ZERO; 3]; primitive.triangles.len()],
    };
    if valence(primitive) <= MAX_VALENCE {
        // Its error type has no values.
        let _ = generate_tangents(&mut mesh);
    } else {
        warnings.add(
            path,
            "too many triangles meet in a point for MikkTSpace: simpler tangents",
        );
        mesh.fill_by_face();
    }
    let tangents = mesh.tangents;
    weld(primitive, &tangents);
}

/// The most triangle corners at one position.
fn valence(primitive: &Triangles) -> u32 {
    let mut counts = HashMap::new();
    for i in primitive.triangles.iter().flatten() {
        // Adding 0 makes −0 equal to 0, as it is for MikkTSpace.
        let position = primitive.vertices[*i as usize].position_o + 0.0;
        *counts
            .entry(position.to_array().map(f32::to_bits))
            .or_default() += 1;
    }
    counts.into_values().max().unwrap_or(0)
}

/// A primitive as MikkTSpace sees it, with one tangent for each corner.
struct Corners<'a> {
    primitive: &'a Triangles,
    uvs: Vec<[Vec2; 3]>,
    tangents: Vec<[Vec4; 3]>,
}

impl Corners<'_> {
    /// The direction of u on each triangle alone.
    fn fill_by_face(&mut self) {
        let triangles = self.primitive.triangles.iter().zip(&self.uvs);
        for ((triangle, [a, b, c]), tangents) in triangles.zip(&mut self.tangents) {
            let corners = triangle.map(|i| self.primitive.vertices[i as usize]);
            let [p, q, r] = corners.map(|corner| corner.position_o);
            let (ab, ac) = (b - a, c - a);
            let area = ab.perp_dot(ac);
            let tangent = ((q - p) * ac.y - (r - p) * ab.y) * area.signum();
            *tangents = corners.map(|corner| {
                let normal = corner.normal_o;
                let tangent = tangent - normal * normal.dot(tangent);
                // v points down in the image, so an upright image has a negative area.
                unit(tangent, normal).extend(if area > 0.0 { -1.0 } else { 1.0 })
            });
        }
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.primitive.triangles.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.vertex(face, corner).position_o.into()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.vertex(face, corner).normal_o.into()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.uvs[face][corner].into()
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        let [x, y, z, w] = space.unwrap_or_default().tangent_encoded();
        let normal = self.vertex(face, corner).normal_o;
        // MikkTSpace's v points up, glTF's points down: the bitangent turns round.
        self.tangents[face][corner] = unit(Vec3::new(x, y, z), normal).extend(-w);
    }
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> &super::primitive::ObjectVertex {
        &self.primitive.vertices[self.primitive.triangles[face][corner] as usize]
    }
}

/// `tangent` with length 1; anything across `normal` where that is impossible.
pub(super) fn unit(tangent: Vec3, normal: Vec3) -> Vec3 {
    let unit = tangent.as_dvec3().try_normalize();
    unit.map_or_else(|| normal.any_orthonormal_vector(), |unit| unit.as_vec3())
}

/// Gives the corners their tangents; those of one vertex with equal tangents stay one vertex.
fn weld(primitive: &mut Triangles, tangents: &[[Vec4; 3]]) {
    let mut vertices = Vec::new();
    let mut index_of = HashMap::new();
    for (triangle, tangents) in primitive.triangles.iter_mut().zip(tangents) {
        for (i, tangent) in triangle.iter_mut().zip(tangents) {
            let key = (*i, tangent.to_array().map(f32::to_bits));
            *i = *index_of.entry(key).or_insert_with(|| {
                let mut vertex = primitive.vertices[*i as usize];
                vertex.tangent_o = *tangent;
                vertices.push(vertex);
                vertices.len() as u32 - 1
            });
        }
    }
    primitive.vertices = vertices;
}
