//! Triangles in the order that their traversal wants: a part for all that is shown once and one for each mesh that is
//! stored once, and what lies over the places of all.

use super::convert::shading;
use super::edges::folded_edges;
use super::features::is_one_sided;
use crate::Result;
use crate::bvh::{SceneTree, morton_order};
use crate::gpu::{Blas, Buffer, Gpu, Instance, Tlas, TriangleGeometry};
use crate::scene::{self, Scene, Triangle, Vertex};
use crate::settings::Trace;
use crate::shared::*;
use glam::{Affine3A, Mat3, Vec3};

/// The scene's triangles, part after part.
#[derive(Default)]
pub struct Geometry {
    /// Three corners a triangle.
    pub positions: Vec<[f32; 3]>,
    pub triangles: Vec<TriangleShading>,
    /// Of the software traversal.
    pub nodes: Vec<BvhNode>,
    pub root: u32,
    /// Entries that a walk can have on its stack.
    pub stack_size: u32,
    /// Of each part, where its groups begin and end.
    pub groups: Vec<[u32; 5]>,
    /// None where a scene has only the one that changes nothing.
    pub placements: Vec<Placement>,
    /// Triangle `once[i]` of those that are shown once lies at place `i`.
    pub once: Vec<u32>,
    /// Box and part of each placement.
    places: Vec<((Vec3, Vec3), usize)>,
}

/// What one tree is over.
struct Part<'a> {
    vertices: &'a [Vertex],
    triangles: &'a [Triangle],
    places: &'a [Affine3A],
}

/// What is shown once comes first, unless there is no such thing beside meshes.
fn parts(scene: &Scene) -> Vec<Part<'_>> {
    let mut parts = Vec::new();
    if scene.meshes.is_empty() || !scene.triangles.is_empty() {
        parts.push(Part {
            vertices: &scene.vertices,
            triangles: &scene.triangles,
            places: &[Affine3A::IDENTITY],
        });
    }
    parts.extend(scene.meshes.iter().map(|mesh| Part {
        vertices: &mesh.vertices,
        triangles: &mesh.triangles,
        places: &mesh.places,
    }));
    parts
}

impl Geometry {
    /// `materials`: the scene's that are uploaded, ascending. `instances`: with placements.
    pub fn new(scene: &Scene, trace: Trace, materials: &[u32], instances: bool) -> Self {
        let mut all = Self::default();
        let mut first_vertex = 0;
        for (i, part) in parts(scene).iter().enumerate() {
            let corners: Vec<[Vec3; 3]> = part
                .triangles
                .iter()
                .map(|t| t.vertices.map(|v| part.vertices[v as usize].position_w))
                .collect();
            let first = all.triangles.len() as u32;
            let (mut order, mut groups) = (Vec::new(), [first; 5]);
            match trace.uses_structures() {
                true => {
                    (order, groups) = grouped_order(scene, part.triangles, &corners);
                    groups = groups.map(|group| first + group);
                }
                false => {
                    let mut tree = SceneTree::build(&corners);
                    std::mem::swap(&mut order, &mut tree.order);
                    all.root = tree.append_to(&mut all.nodes, first);
                    all.stack_size = all.stack_size.max(tree.stack_size);
                }
            }
            let folded = folded_edges(part.vertices, part.triangles, &corners);
            let of_order = order.iter().map(|&t| t as usize);
            all.positions.extend(
                of_order
                    .clone()
                    .flat_map(|t| corners[t].map(|corner| corner.to_array())),
            );
            all.triangles.extend(of_order.map(|t| {
                shading(
                    scene,
                    materials,
                    &part.triangles[t],
                    first_vertex,
                    folded[t],
                )
            }));
            all.groups.push(groups);
            first_vertex += part.vertices.len() as u32;
            if instances {
                let positions = corners.iter().flatten().map(|&corner| (corner, corner));
                let bounds = positions.reduce(|(a, b), (c, d)| (a.min(c), b.max(d)));
                let bounds = bounds.unwrap_or_default();
                for place in part.places {
                    let number = all.placements.len() as u32;
                    all.placements
                        .push(placement(place, groups, all.root, number));
                    all.places.push((scene::moved(bounds, place), i));
                }
            }
            if i == 0 && !scene.triangles.is_empty() {
                all.once = order;
            }
        }
        if instances && !trace.uses_structures() {
            let boxes: Vec<_> = all.places.iter().map(|place| place.0).collect();
            let tree = SceneTree::over_placements(&boxes);
            all.root = tree.append_to(&mut all.nodes, 0);
            all.stack_size += tree.stack_size;
        }
        all
    }

    /// Two instances of each placement at most: faces seen from both sides, and those that are not there from behind.
    pub fn structure(&self, gpu: &Gpu, positions: &Buffer<[f32; 3]>) -> Result<(Vec<Blas>, Tlas)> {
        let mut all = Vec::new();
        // Those of each part, with their first groups.
        let mut of_parts = Vec::new();
        for groups in &self.groups {
            let mut of_part = Vec::new();
            for first_group in [0, 2] {
                if groups[first_group] == groups[first_group + 2] {
                    continue;
                }
                let geometry = |group: usize| {
                    let [first, end] = [groups[group] as usize, groups[group + 1] as usize];
                    TriangleGeometry {
                        positions: positions.ptr(),
                        // An empty group at the end would begin where no buffer is.
                        first_triangle: if first == end { 0 } else { first },
                        triangles: end - first,
                        opaque: group.is_multiple_of(2),
                    }
                };
                let both = [geometry(first_group), geometry(first_group + 1)];
                let blas = gpu.triangle_blas("scene", &both)?;
                of_part.push((first_group as u32, blas.address()));
                all.push(blas);
            }
            of_parts.push(of_part);
        }
        let mut instances = Vec::new();
        let instance = |(first_group, blas_address), transform, custom_index| Instance {
            blas_address,
            transform,
            custom_index,
            mask: 0xff,
            facing_cull_disable: first_group == 0,
            front_ccw: false,
        };
        if self.placements.is_empty() {
            for &of_part in of_parts.iter().flatten() {
                instances.push(instance(of_part, Instance::IDENTITY, of_part.0));
            }
        }
        // In an order that drivers build good structures from.
        let boxes = self
            .places
            .iter()
            .map(|&((low, high), _)| [low, high, 0.5 * (low + high)]);
        let boxes: Vec<_> = boxes.collect();
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        morton_order(&boxes, &mut order);
        for place in order {
            let (_, part) = self.places[place as usize];
            for &of_part in &of_parts[part] {
                let transform = rows(&self.placements[place as usize]);
                instances.push(instance(of_part, transform, place << 1 | of_part.0 >> 1));
            }
        }
        let tlas = gpu.tlas("scene", instances.len())?;
        let mut commands = gpu.commands()?;
        commands.build_tlas(&tlas, &instances);
        commands.submit()?;
        Ok((all, tlas))
    }
}

fn placement(place: &Affine3A, groups: [u32; 5], node: u32, number: u32) -> Placement {
    let forth = place.matrix3;
    let back = Mat3::from(forth).as_dmat3().inverse().as_mat3();
    Placement {
        world_from_mesh_x: forth.x_axis.into(),
        world_from_mesh_y: forth.y_axis.into(),
        world_from_mesh_z: forth.z_axis.into(),
        mesh_from_world_x: back.x_axis.into(),
        mesh_from_world_y: back.y_axis.into(),
        mesh_from_world_z: back.z_axis.into(),
        origin_w: place.translation.into(),
        groups: [groups[0], groups[1], groups[2], groups[3]],
        node,
        number,
        unused: 0,
    }
}

fn rows(p: &Placement) -> [[f32; 4]; 3] {
    let [x, y, z] = [
        p.world_from_mesh_x,
        p.world_from_mesh_y,
        p.world_from_mesh_z,
    ];
    [0, 1, 2].map(|i| [x[i], y[i], z[i], p.origin_w[i]])
}

/// Triangles in Morton order within each of the four groups of the acceleration structure, and
/// where the groups begin and end.
fn grouped_order(
    scene: &Scene,
    triangles: &[Triangle],
    corners: &[[Vec3; 3]],
) -> (Vec<u32>, [u32; 5]) {
    let mut groups = [const { Vec::new() }; 4];
    for (i, triangle) in triangles.iter().enumerate() {
        let material = &scene.materials[triangle.material as usize];
        let group = usize::from(is_one_sided(material)) * 2 + usize::from(material.has_holes());
        groups[group].push(i as u32);
    }
    let mut order = Vec::with_capacity(corners.len());
    let mut first = [0; 5];
    for (i, mut group) in groups.into_iter().enumerate() {
        morton_order(corners, &mut group);
        order.extend(group);
        first[i + 1] = order.len() as u32;
    }
    (order, first)
}
