//! The order of the scene's triangles, and the tree that the software traversal walks.

use crate::shared::{BvhNode, LEAF_PLACEMENT, LEAF_TRIANGLES};
use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::triangle::Triangle;
use std::time::Duration;

/// A binary tree whose leaves are runs of `order`.
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
        for node in &mut tree.nodes {
            let leaf = |child: &mut u32, count: &mut u32| {
                if *count > 0 {
                    (*child, *count) = (tree.order[*child as usize], LEAF_PLACEMENT);
                }
            };
            leaf(&mut node.child0, &mut node.count0);
            leaf(&mut node.child1, &mut node.count1);
        }
        tree
    }

    /// Appends to `nodes`, with leaves from this triangle on. Returns where the root lies.
    pub fn append_to(&self, nodes: &mut Vec<BvhNode>, first_triangle: u32) -> u32 {
        let root = nodes.len() as u32;
        nodes.extend(self.nodes.iter().map(|node| {
            let moved = |child, count| match count {
                0 => child + root,
                _ => child + first_triangle,
            };
            BvhNode {
                child0: moved(node.child0, node.count0),
                child1: moved(node.child1, node.count1),
                ..*node
            }
        }));
        root
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
        let tree = build_bvh2_from_tris(&triangles, parameters, &mut Duration::default());

        // Places in depth-first order, and for every old node the node that its children became.
        let mut result = Self {
            nodes: Vec::with_capacity(tree.nodes.len() / 2 + 1),
            order: Vec::with_capacity(triangles.len()),
            stack_size: 1,
        };
        let Some(root) = tree.nodes.first() else {
            return result;
        };
        let leaf = |result: &mut Self, node: &obvhs::bvh2::node::Bvh2Node| {
            let first = result.order.len() as u32;
            let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
            result.order.extend(&tree.primitive_indices[range]);
            (first, node.prim_count)
        };
        if root.prim_count > 0 {
            // A lone leaf: its sibling is a box that no ray meets.
            let (child0, count0) = leaf(&mut result, root);
            result.nodes.push(BvhNode {
                min0_w: root.aabb.min.into(),
                max0_w: root.aabb.max.into(),
                child0,
                count0,
                min1_w: [f32::MAX; 3],
                max1_w: [f32::MAX; 3],
                child1: 0,
                count1: 0,
            });
            return result;
        }
        result.nodes.push(BvhNode::default());
        // (children of an inner node, the node that they go to, its depth)
        let mut todo = vec![(root.first_index, 0usize, 1u32)];
        while let Some((children, at, depth)) = todo.pop() {
            result.stack_size = result.stack_size.max(depth);
            let mut place = |child: u32, result: &mut Self| {
                let node = &tree.nodes[child as usize];
                if node.prim_count > 0 {
                    return leaf(result, node);
                }
                result.nodes.push(BvhNode::default());
                let to = result.nodes.len() - 1;
                todo.push((node.first_index, to, depth + 1));
                (to as u32, 0)
            };
            let (child0, count0) = place(children, &mut result);
            let (child1, count1) = place(children + 1, &mut result);
            let [a, b] = [children, children + 1].map(|i| tree.nodes[i as usize].aabb);
            result.nodes[at] = BvhNode {
                min0_w: a.min.into(),
                max0_w: a.max.into(),
                child0,
                count0,
                min1_w: b.min.into(),
                max1_w: b.max.into(),
                child1,
                count1,
            };
        }
        result
    }
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
        for n in [1, 2, 5, 1000] {
            let corners = strip(n);
            let tree = SceneTree::build(&corners);
            let mut seen = vec![0; n];
            for node in &tree.nodes {
                for (child, count, min, max) in [
                    (node.child0, node.count0, node.min0_w, node.max0_w),
                    (node.child1, node.count1, node.min1_w, node.max1_w),
                ] {
                    assert!(count <= LEAF_TRIANGLES);
                    for place in child..child + count {
                        let triangle = tree.order[place as usize];
                        seen[triangle as usize] += 1;
                        for corner in corners[triangle as usize] {
                            assert!(
                                corner.cmpge(min.into()).all() && corner.cmple(max.into()).all()
                            );
                        }
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
