//! Vertex normals: complete, of unit length, and on the side of their faces.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::primitive::{ObjectVertex, Triangles};

/// Makes every normal a unit vector. Where the file has none, or none of any use, the vertices of
/// different triangles part and get the face normals (glTF 2.0, section 3.7.2.1: flat normals).
pub(super) fn complete(primitive: &mut Triangles) {
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

/// Slivers of smooth meshes have normals on the wrong side, too; less than this of the area is not
/// worth a word.
const STRAY: f64 = 1e-3;

/// Turns the normals of triangles that all point away from their face: exporters that reverse the
/// winding of a mesh, or its normals, write such files, and other viewers draw them lit. Single
/// normals that dip behind a face are common in smooth meshes, and right. Returns whether more was
/// turned than strays.
pub(super) fn turn_to_faces(primitive: &mut Triangles) -> bool {
    let vertices = &mut primitive.vertices;
    let normals: Vec<Vec3> = vertices.iter().map(|vertex| vertex.normal_o).collect();
    // The first triangle takes the vertex itself; those that need it turned otherwise, a copy.
    let mut is_turned: Vec<Option<bool>> = vec![None; vertices.len()];
    let mut copies = HashMap::new();
    let (mut area, mut area_turned) = (0.0, 0.0);
    for triangle in &mut primitive.triangles {
        let corners = triangle.map(|i| vertices[i as usize].position_o.as_dvec3());
        let face = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let is_away = |i: &u32| normals[*i as usize].as_dvec3().dot(face) < 0.0;
        let turn = triangle.iter().all(is_away);
        area += face.length();
        if turn {
            area_turned += face.length();
        }
        for i in triangle {
            let at = *i as usize;
            match is_turned[at] {
                Some(before) if before == turn => {}
                Some(_) => {
                    *i = *copies.entry(*i).or_insert_with(|| {
                        vertices.push(turned(vertices[at]));
                        vertices.len() as u32 - 1
                    });
                }
                None => {
                    is_turned[at] = Some(turn);
                    if turn {
                        vertices[at] = turned(vertices[at]);
                    }
                }
            }
        }
    }
    area_turned > STRAY * area
}

/// `vertex` seen from its other side; its bitangent, cross(n, t) w, stays.
fn turned(mut vertex: ObjectVertex) -> ObjectVertex {
    vertex.normal_o = -vertex.normal_o;
    vertex.tangent_o.w = -vertex.tangent_o.w;
    vertex
}
