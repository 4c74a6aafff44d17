//! Where the surface ends or folds: the edges at which a gather must not count on photons beyond.

use crate::scene::{Triangle, Vertex};
use crate::shared::FOLD_COSINE;
use glam::Vec3;

/// For each triangle three bits: edge i runs from corner i to corner i + 1, and no neighbour goes on
/// smoothly there. Corners are the same where their positions are.
pub fn folded_edges(
    vertices: &[Vertex],
    triangles: &[Triangle],
    corners: &[[Vec3; 3]],
) -> Vec<u32> {
    let normals: Vec<Vec3> = corners
        .iter()
        .map(|[a, b, c]| {
            (b - a)
                .normalize_or_zero()
                .cross((c - a).normalize_or_zero())
                .normalize_or_zero()
        })
        .collect();
    // In the plane of triangle t, across its edge i, to its inside.
    let inward = |t: u32, i: u32| {
        let (triangle, i) = (corners[t as usize], i as usize);
        let edge = (triangle[(i + 1) % 3] - triangle[i]).normalize_or_zero();
        normals[t as usize].cross(edge)
    };
    let welded = weld(vertices);
    // (the edge's ends in order, triangle, edge)
    let mut edges: Vec<([u32; 2], u32, u32)> = Vec::with_capacity(3 * corners.len());
    for (t, triangle) in triangles.iter().enumerate() {
        let v = triangle.vertices.map(|v| welded[v as usize]);
        for i in 0..3 {
            let ends = [v[i], v[(i + 1) % 3]];
            edges.push((
                [ends[0].min(ends[1]), ends[0].max(ends[1])],
                t as u32,
                i as u32,
            ));
        }
    }
    edges.sort_unstable();
    let mut flags = vec![0; corners.len()];
    for shared in edges.chunk_by(|a, b| a.0 == b.0) {
        for &(_, t, edge) in shared {
            // On the other side of the edge: one that lies upon this one, or is its back, does not go on from it. Meshes
            // that are seen from both sides may change their winding from face to face.
            let goes_on = shared.iter().any(|&(_, other, other_edge)| {
                inward(t, edge).dot(inward(other, other_edge)) < -FOLD_COSINE
            });
            if !goes_on {
                flags[t as usize] |= 1 << edge;
            }
        }
    }
    flags
}

/// For each vertex the first one at the same place.
fn weld(vertices: &[Vertex]) -> Vec<u32> {
    // Adding zero makes -0 and 0 the same bits.
    let key = |v: u32| {
        (vertices[v as usize].position_w + Vec3::ZERO)
            .to_array()
            .map(f32::to_bits)
    };
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    order.sort_by_cached_key(|&v| key(v));
    let mut welded = vec![0; order.len()];
    for same in order.chunk_by(|&a, &b| key(a) == key(b)) {
        for &v in same {
            welded[v as usize] = same[0];
        }
    }
    welded
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    /// Two triangles that share the edge from (0,0,0) to (1,1,0), the second one turned about it.
    fn pair(apex: Vec3) -> (Scene, Vec<[Vec3; 3]>) {
        let corners = vec![
            [Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0), Vec3::Y],
            [Vec3::ZERO, apex, Vec3::new(1.0, 1.0, -0.0)],
        ];
        let vertices = corners
            .iter()
            .flatten()
            .map(|&p| Vertex {
                position_w: p,
                ..Default::default()
            })
            .collect();
        let triangles = (0..2)
            .map(|t| Triangle {
                vertices: [3 * t, 3 * t + 1, 3 * t + 2],
                material: 0,
            })
            .collect();
        (
            Scene {
                vertices,
                triangles,
                ..Default::default()
            },
            corners,
        )
    }

    #[test]
    fn a_surface_does_not_go_on_in_its_copy() {
        let (mut scene, mut corners) = pair(Vec3::X);
        scene.triangles.push(scene.triangles[0]);
        corners.push(corners[0]);
        assert_eq!(
            folded_edges(&scene.vertices, &scene.triangles, &corners),
            [0b110, 0b011, 0b110]
        );
    }

    #[test]
    fn a_flat_diagonal_goes_on_and_a_fold_does_not() {
        let (scene, corners) = pair(Vec3::X);
        assert_eq!(
            folded_edges(&scene.vertices, &scene.triangles, &corners),
            [0b110, 0b011]
        );
        let (scene, corners) = pair(Vec3::new(0.5, 0.5, 1.0));
        assert_eq!(
            folded_edges(&scene.vertices, &scene.triangles, &corners),
            [0b111, 0b111]
        );
    }
}
