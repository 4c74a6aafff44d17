//! The order of the scene's triangles, and the tree that the software traversal walks.

use super::node::node_around;
use crate::shared::{BvhNode, LEAF_PLACEMENT, LEAF_SHIFT, LEAF_TRIANGLES};
use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::triangle::Triangle;
use std::time::Duration;

/// The bits of a leaf that are its first triangle.
const LEAF_FIRST: u32 = (1 << LEAF_SHIFT) - 1;

/// A tree whose leaves are runs of `order`. Its first node has the root as its only child, so that a walk begins like it
/// goes on.
pub struct SceneTree {
    pub nodes: Vec<BvhNode>,
    /// Triangle `order[i]` of the scene lies at place `i`.
    pub order: Vec<u32>,
    /// Entries that a depth-first walk can have on its stack.
    pub stack_size: u32,
}

impl SceneTree {
    /// Over triangles given by their corners; PLOC with reinsertion (Meister & Bittner 2018, 2022).
    pub fn build(corners: &[[Vec3; 3]]) -> Self {
        Self::with_leaves(corners, LEAF_TRIANGLES)
    }

    /// Over placements given by their boxes: each is a leaf, by its number.
    pub fn over_placements(boxes: &[(Vec3, Vec3)]) -> Self {
        // A triangle with the same box.
        let corners: Vec<_> = boxes.iter().map(|&(low, high)| [low, high, low]).collect();
        let mut tree = Self::with_leaves(&corners, 1);
        for child in tree.nodes.iter_mut().flat_map(children_mut) {
            if *child >> LEAF_SHIFT > 0 {
                *child = LEAF_PLACEMENT << LEAF_SHIFT | tree.order[(*child & LEAF_FIRST) as usize];
            }
        }
        tree
    }

    /// Appends to `nodes`, with leaves from this triangle on. Returns where the walk begins.
    pub fn append_to(&self, nodes: &mut Vec<BvhNode>, first_triangle: u32) -> u32 {
        let first_node = nodes.len() as u32;
        for mut node in self.nodes.iter().copied() {
            for child in children_mut(&mut node) {
                *child += if *child >> LEAF_SHIFT > 0 {
                    first_triangle
                } else {
                    first_node
                };
            }
            nodes.push(node);
        }
        first_node
    }

    fn with_leaves(corners: &[[Vec3; 3]], most: u32) -> Self {
        let triangles: Vec<Triangle> = corners
            .iter()
            .map(|[a, b, c]| Triangle {
                v0: Vec3A::from(*a),
                v1: Vec3A::from(*b),
                v2: Vec3A::from(*c),
            })
            .collect();
        let parameters = BvhBuildParams {
            max_prims_per_leaf: most,
            ..BvhBuildParams::medium_build()
        };
        let binary = build_bvh2_from_tris(&triangles, parameters, &mut Duration::default());
        let mut result = Self {
            nodes: vec![node_around(&[(Vec3::ZERO, Vec3::ZERO)])],
            order: Vec::with_capacity(triangles.len()),
            stack_size: 1,
        };
        // What a node's children are in the binary tree, the node, its depth.
        let mut todo = Vec::new();
        let place = |result: &mut Self, from: u32, depth, todo: &mut Vec<_>| {
            let Some(node) = binary
                .nodes
                .get(from as usize)
                .filter(|node| node.prim_count > 0)
            else {
                result.nodes.push(BvhNode::default());
                let to = result.nodes.len() - 1;
                todo.push((four_children(&binary, from), to, depth));
                return to as u32;
            };
            let first = result.order.len() as u32;
            let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
            result.order.extend(&binary.primitive_indices[range]);
            node.prim_count << LEAF_SHIFT | first
        };
        result.nodes[0].children[0] = place(&mut result, 0, 1, &mut todo);
        while let Some((children, at, depth)) = todo.pop() {
            result.stack_size = result.stack_size.max(depth);
            let boxes: Vec<_> = children
                .iter()
                .map(|&child| {
                    let aabb = binary.nodes[child as usize].aabb;
                    (aabb.min.into(), aabb.max.into())
                })
                .collect();
            let mut node = node_around(&boxes);
            for (to, child) in node.children.iter_mut().zip(children) {
                *to = place(&mut result, child, depth + 1, &mut todo);
            }
            result.nodes[at] = node;
        }
        result
    }
}

/// What takes the place of an inner node's two children where the larger ones are replaced by theirs, up to four.
/// None where there is no such node.
fn four_children(tree: &Bvh2, node: u32) -> Vec<u32> {
    let both = |node: u32| {
        tree.nodes
            .get(node as usize)
            .map_or(vec![], |n| vec![n.first_index, n.first_index + 1])
    };
    let mut children = both(node);
    while children.len() < 4 {
        let of = |child: &u32| &tree.nodes[*child as usize];
        let inner = (0..children.len()).filter(|&i| of(&children[i]).prim_count == 0);
        let Some(largest) = inner.max_by(|&a, &b| {
            let area = |i: usize| of(&children[i]).aabb.half_area();
            area(a).total_cmp(&area(b))
        }) else {
            break;
        };
        let parts = both(children[largest]);
        children.splice(largest..=largest, parts);
    }
    children
}

/// Those that a node has.
fn children_mut(node: &mut BvhNode) -> &mut [u32] {
    let count = node.exponents >> 24;
    &mut node.children[..count as usize]
}

/// The order of triangles along a Morton curve through their centres: drivers build good
/// acceleration structures from neighbours that come one after the other.
pub fn morton_order(corners: &[[Vec3; 3]], of: &mut [u32]) {
    let center = |i: u32| corners[i as usize].iter().sum::<Vec3>() / 3.0;
    let (min, max) = of.iter().fold((Vec3::MAX, Vec3::MIN), |(lo, hi), &i| {
        (lo.min(center(i)), hi.max(center(i)))
    });
    let scale =
        Vec3::splat(((1u64 << 21) - 1) as f32) / (max - min).max(Vec3::splat(f32::MIN_POSITIVE));
    of.sort_by_cached_key(|&i| {
        let p = ((center(i) - min) * scale).as_u64vec3();
        spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2
    });
}

/// 21 bits, moved three apart.
fn spread(x: u64) -> u64 {
    let x = x & 0x1f_ffff;
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::super::node::boxes_of;
    use super::*;

    fn strip(n: usize) -> Vec<[Vec3; 3]> {
        (0..n)
            .map(|i| {
                let p = Vec3::new((i * 7919 % n) as f32, (i * 104_729 % 13) as f32, 0.0);
                [p, p + Vec3::X, p + Vec3::Y]
            })
            .collect()
    }

    #[test]
    fn every_triangle_lies_in_one_leaf_inside_its_boxes() {
        for n in [1, 2, 5, 20, 1000] {
            let corners = strip(n);
            let tree = SceneTree::build(&corners);
            let mut seen = vec![0; n];
            for (i, node) in tree.nodes.iter().enumerate() {
                for (child, [min, max]) in node.children.iter().zip(boxes_of(node)) {
                    let (first, count) = (child & LEAF_FIRST, child >> LEAF_SHIFT);
                    assert!(count <= LEAF_TRIANGLES);
                    let inside = |corner: Vec3| {
                        (0..3).all(|axis| {
                            let x = f64::from(corner[axis]);
                            min[axis] < x && x < max[axis]
                        })
                    };
                    for place in first..first + count {
                        let triangle = tree.order[place as usize];
                        seen[triangle as usize] += 1;
                        // The root's box is never asked for.
                        assert!(i == 0 || corners[triangle as usize].into_iter().all(inside));
                    }
                }
            }
            assert!(seen.iter().all(|&n| n == 1), "{n} triangles");
        }
    }

    #[test]
    fn morton_order_keeps_neighbours_together() {
        let corners = strip(4096);
        let mut order: Vec<u32> = (0..4096).collect();
        let length = |order: &[u32]| -> f32 {
            order
                .windows(2)
                .map(|w| corners[w[0] as usize][0].distance(corners[w[1] as usize][0]))
                .sum()
        };
        let before = length(&order);
        morton_order(&corners, &mut order);
        assert!(length(&order) < 0.1 * before);
    }
}
